"""The modes of a band of a large scene along one parameter.

The modes of the band at some values of the parameter, right and left ones, span a space that hardly changes
between them. The pencil projected on it is small and dense, and all that is known of paths holds for it.
Where a projected eigenvalue stands between two values is checked against the modes of the band there, which
join the space, until they agree. The error of a projected eigenvalue is the product of what right and left
vectors lack in the space.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from stickslip import _core
from stickslip.faults import InputError
from stickslip.locus.band.space import INTERPOLATED, BandSpace, Projected, agree
from stickslip.locus.path import Sliding
from stickslip.modes.complex_modes import FEW, region_of
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Complex, Real
from stickslip.scene.scene import Scene

#: Values at which the modes of the band are computed, at most.
_VALUES = 33


@dataclass
class BandPath:
    """A band of modes along one parameter, `combination` and other parameters given."""

    sliding: Sliding
    name: str
    fixed: Mapping[str, float]
    lower: float
    upper: float
    region: Region
    #: By value of the parameter: exact eigenvalues of the upper half plane and their conditions.
    known: dict[float, tuple[Complex, Real]] = field(default_factory=dict)
    #: What the count of eigenvalues misses at the ends.
    missing: list[float] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        letters = self.sliding.letters(self._scene(self.lower))
        self.space = BandSpace(letters, self.region)
        self._add(self.lower, certify=True)
        self._add(self.upper, certify=True)
        self.path = self._built()
        waiting = [(self.lower, self.upper)]
        while waiting:
            a, b = waiting.pop(0)
            middle = 0.5 * (a + b)
            if len(self.known) >= _VALUES:
                self.doubts.append(
                    f"{self.name}: {_VALUES} values don't settle the band between {a:.6g} and {b:.6g}"
                )
                break
            if not self._add(middle):
                waiting += [(a, middle), (middle, b)]
            self.path = self._built()

    def take(self, values: list[float]) -> None:
        """Take the modes at some more values into the space, where eigenvalues are then exact."""
        for value in values:
            if value not in self.known:
                self._add(value)
        self.path = self._built()

    def warn(self) -> None:
        """Tell doubts where the result is a list that cannot hold them."""
        for doubt in self.doubts:
            warnings.warn(doubt, stacklevel=4)

    def _scene(self, value: float) -> Scene:
        return self.sliding.family.scene({**self.fixed, self.name: value})

    def _add(self, value: float, certify: bool = False) -> bool:
        """Take the modes at a value into the space; say whether they were in it already."""
        scene = self._scene(value)
        if self.sliding.letters(scene) != self.space.letters:
            self.sliding.check_direction(self.space.letters, self.name, (self.lower, value), self.fixed)
        modes = self.space.modes(scene, certify)
        if certify:
            self.missing.append(float(modes.missing or 0.0))
            self.doubts += [f"{self.name} = {value:.6g}: {doubt}" for doubt in modes.doubts]
        modes = self.space.take(scene, modes)
        agrees = len(self.known) >= 2 and self._agrees(value, modes.eigenvalues, modes.condition)
        self.known[value] = (modes.eigenvalues, modes.condition)
        return agrees

    def _agrees(self, value: float, exact: Complex, condition: Real) -> bool:
        """Return whether the projected eigenvalues at a value are the exact ones of the band."""
        ritz: Complex = self.path.sweep(np.array([value]), False)["eigenvalue"][0]
        return agree(self.region, exact, condition, ritz)

    def _built(self) -> _core.Path:
        return Projected(self.sliding, self.name, self.fixed, INTERPOLATED, self.space.basis()).path(
            self.lower, self.upper
        )


def is_large(sliding: Sliding, name: str, value: float, fixed: Mapping[str, float]) -> bool:
    """Return whether a scene of the family has so many free coordinates that its band is searched for."""
    scene = sliding.family.scene({**fixed, name: value})
    return bool(scene.core.sparse_pencil(sliding.letters(scene))[0][2].size - 1 > FEW)


def wanted_region(band: Sequence[float] | None, growth: Sequence[float | None]) -> Region | None:
    """Return what a band in Hz and a range of growth rates bound, None without a band."""
    if band is not None:
        return region_of(band, growth)
    if tuple(growth) != (None, None):
        raise InputError(f"growth: needs a band, got growth={growth!r} alone")
    return None
