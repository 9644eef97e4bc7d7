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
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from stickslip import _core
from stickslip.faults import InputError
from stickslip.locus.path import Interpolation, Sliding
from stickslip.modes.complex_modes import FEW, band_modes, region_of
from stickslip.modes.sparse.pencil import SparsePencil, sparse_array
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Complex, Flags, Real
from stickslip.scene.scene import Scene

#: Relative error of a projected eigenvalue, times its condition, up to which the space is large enough.
_PROJECTED = 1e-9
#: Directions of the space smaller than this, of vectors of length 1, are left out: an eigenvalue errs by the
#: square.
_DIRECTION = 1e-7
#: Values at which the modes of the band are computed, at most.
_VALUES = 33
#: Error of an interpolant of projected entries, of the largest of its row: sums of large terms that cancel.
INTERPOLATED = 1e-9
#: Width beyond the band, of its own, from which modes are taken into the space.
_BEYOND = 0.1


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
        self.letters = self.sliding.letters(self._scene(self.lower))
        self.scaling: Real = np.zeros(0)
        self.first_order: Flags = np.zeros(0, dtype=bool)
        self.columns: list[Real] = []
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
        if self.sliding.letters(scene) != self.letters:
            self.sliding.check_direction(self.letters, self.name, (self.lower, value), self.fixed)
        wide = self.region.wider(_BEYOND * (self.region.high - self.region.low))
        modes = band_modes(scene, self.letters, SparsePencil.of(scene, self.letters), wide, certify)
        if certify:
            self.missing.append(float(modes.missing or 0.0))
            self.doubts += [f"{self.name} = {value:.6g}: {doubt}" for doubt in modes.doubts]
        modes = modes[~modes.defective]
        chosen = modes.eigenvalues
        if not self.scaling.size:
            inertia = np.abs(modes.mass.diagonal())
            self.scaling = 1.0 / np.sqrt(np.where(inertia > 0.0, inertia, 1.0))
            self.first_order = inertia == 0.0
        agrees = len(self.known) >= 2 and self._agrees(value, chosen, modes.condition)
        self.known[value] = (chosen, modes.condition)
        vectors = [modes.right_displacement, modes.left_displacement]
        columns = [part / self.scaling[:, None] for x in vectors for part in (x.real, x.imag)]
        load = scene.core.statics(self.letters)[0][0]
        stiffness = sparse_array(scene.core.sparse_pencil(self.letters)[2]).tocsc()
        # Normal forces are those of the equilibrium, which belongs to the space as well.
        if load.any():
            rest = scipy.sparse.linalg.spsolve(stiffness, load)
            if np.isfinite(rest).all():
                columns.append((rest / self.scaling)[:, None])
        lengths = [np.linalg.norm(column, axis=0) for column in columns]
        # Parts that are rounding of a vector stay small beside it.
        for k in range(0, 4, 2):
            whole = np.hypot(lengths[k], lengths[k + 1])
            columns[k], columns[k + 1] = columns[k] / whole, columns[k + 1] / whole
        if len(columns) > 4:
            columns[4] = columns[4] / lengths[4]
        self.columns.append(np.concatenate(columns, axis=1))
        return agrees

    def _agrees(self, value: float, exact: Complex, condition: Real) -> bool:
        """Return whether the projected eigenvalues at a value are the exact ones of the band."""
        ritz: Complex = self.path.sweep(np.array([value]), False)["eigenvalue"][0]
        inside = self.region.holds(exact)
        projected = ritz[self.region.holds(ritz) & (ritz.imag >= 0.0)]
        if not inside.any():
            return projected.size == 0
        error = np.abs(exact[inside][:, None] - ritz).min(axis=1)
        close = error <= _PROJECTED * condition[inside] * np.abs(exact[inside])
        return bool(close.all()) and projected.size == np.count_nonzero(inside)

    def _built(self) -> _core.Path:
        together = np.concatenate(self.columns, axis=1)
        # Slip under a law may have no mass: directions of its own have none in the space either.
        spaces = [_space(together, part) for part in (~self.first_order, self.first_order)]
        basis = np.concatenate(spaces, axis=1) * self.scaling[:, None]
        return Projected(self.sliding, self.name, self.fixed, INTERPOLATED, basis).path(
            self.lower, self.upper
        )


@dataclass
class Projected(Interpolation):
    """Samples of the reduced matrices projected on a basis, (m, r)."""

    basis: Real = field(default_factory=lambda: np.zeros((0, 0)))

    def is_proportional(self, scene: Scene) -> bool:
        """Return False: C is projected as it is."""
        return False

    def matrices(self, scene: Scene) -> tuple[Real, ...]:
        """Return the projected M, C and K and the statics."""
        pencil = [sparse_array(parts) for parts in scene.core.sparse_pencil(self.letters)]
        load, rows, offsets, speeds = scene.core.statics(self.letters)
        projected = [np.ascontiguousarray(self.basis.T @ (matrix @ self.basis)) for matrix in pencil]
        return (*projected, load @ self.basis, rows @ self.basis, offsets, speeds)


def _space(columns: Real, part: Flags) -> Real:
    """Return orthonormal directions of what columns span in a part of their rows; zero in the others."""
    directions, sizes, _ = scipy.linalg.svd(columns[part], full_matrices=False)
    wanted = sizes > _DIRECTION * sizes.max(initial=0.0)
    space = np.zeros((part.size, np.count_nonzero(wanted)))
    space[part] = directions[:, wanted]
    return space


def is_large(sliding: Sliding, name: str, value: float, fixed: Mapping[str, float]) -> bool:
    """Return whether a scene of the family has so many free coordinates that its band is searched for."""
    scene = sliding.family.scene({**fixed, name: value})
    return bool(scene.core.sparse_pencil(sliding.letters(scene))[0][2].size - 1 > FEW)


def wanted_region(band: Sequence[float] | None, growth: Sequence[float | None]) -> Region | None:
    """Return what a band in Hz and a range of growth rates bound, None without a band.

    Raises
    ------
    InputError
        If one is ill-posed, or growth is given without band.
    """
    if band is not None:
        return region_of(band, growth)
    if tuple(growth) != (None, None):
        raise InputError(f"growth: needs a band, got growth={growth!r} alone")
    return None


def refuse(name: str, given: Any) -> None:
    """Refuse an option that goes without a band.

    Raises
    ------
    InputError
        If it is given.
    """
    if given:
        raise InputError(f"{name}: cannot be given together with band, got {given!r}")
