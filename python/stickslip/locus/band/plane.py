"""The curves of a band of a large scene over two parameters.

The modes of the band at some places of the plane, right and left ones, span a space that hardly changes
between them, as along one parameter. Places are added where the projected eigenvalues, or normal forces, are
not those of the scene. Curves are followed with the projected matrices; then the modes at their points join
the space, where the projected eigenvalues are exact, and the points move by what little that changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from stickslip.locus.band.space import BandSpace, agree
from stickslip.locus.boundary.conditions import Condition, Divergence, Hopf, Separation, eigenvalues, margins
from stickslip.locus.boundary.plane import Plane
from stickslip.locus.boundary.search import FINER, Search
from stickslip.locus.boundary.tracing import moved
from stickslip.locus.path import Sliding
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Real
from stickslip.scene.scene import Scene

#: Places at which the modes of the band are computed, at most, beside those on curves.
_PLACES = 65
#: Places of a side of the first grid.
_SIDE = 3
#: One in so many points of a curve, and its ends, at which the modes of the band are counted.
_COUNTED = 4
#: Error of a projected normal force, of its terms.
_FORCE = 1e-9


@dataclass
class BandSearch(Search):
    """The curves of a band of a large scene; `plane` is projected on what is known by then.

    Use `over` to begin with.
    """

    #: Until the modes of the band are counted at the points of a curve, how many are missing is not known.
    uncounted: ClassVar[float] = np.nan

    space: BandSpace = field(kw_only=True)

    @classmethod
    def over(
        cls,
        sliding: Sliding,
        ranges: Mapping[str, tuple[float, float]],
        fixed: Mapping[str, float],
        region: Region,
        cells: int,
    ) -> BandSearch:
        """Return the search over ranges of two parameters, with the modes of one corner alone."""
        corner = {name: lower for name, (lower, _) in ranges.items()}
        scene = sliding.family.scene({**fixed, **corner})
        space = BandSpace(sliding.letters(scene), region)
        space.take(scene, space.modes(scene, certify=False))
        return cls(Plane(sliding, ranges, fixed, region, space.basis()), cells, space=space)

    def run(self) -> Iterator[tuple[int, int]]:
        """Find everything as for all modes, the space of modes before and the exact points after it."""
        total = (2 + FINER) * self.cells
        for _ in self._explored():
            yield 0, total
        yield from super().run()
        for _ in self._exact():
            yield total, total

    def _explored(self) -> Iterator[None]:
        """Take modes into the space until the projected eigenvalues are those of the scene."""
        count = 0
        side = np.linspace(0.0, 1.0, _SIDE)
        for place in [np.array([u, v]) for u in side for v in side]:
            scene = self._scene(place)
            self.space.take(scene, self._modes(scene, place)[0])
            count += 1
            yield
        self._rebuild()
        half = 0.5 / (_SIDE - 1)
        boxes = [(np.array([u, v]) + half, half) for u in side[:-1] for v in side[:-1]]
        while boxes:
            finer = []
            for centre, half in boxes:
                if count >= _PLACES:
                    self.doubts.append(f"the modes at {count} places don't settle the band between them")
                    boxes = []
                    break
                scene = self._scene(centre)
                modes = self.space.modes(scene, certify=False)
                count += 1
                if not self._agrees(scene, modes, centre):
                    half = 0.5 * half
                    finer += [(centre + half * np.array([a, b]), half) for a in (-1, 1) for b in (-1, 1)]
                self.space.take(scene, modes)
                yield
            self._rebuild()
            boxes = finer if boxes else []

    def _agrees(self, scene: Scene, modes: Modes, place: Real) -> bool:
        """Return whether the projected eigenvalues of the band, and margins, are those of the scene."""
        region = self.space.region
        known = modes[~modes.defective]
        (projected,) = eigenvalues(self.plane, place[None])
        if not agree(region, known.eigenvalues, known.condition, projected):
            return False
        (values,), (sizes,) = margins(self.plane, place[None])
        forces = self.space.margins(scene)
        return forces is None or bool((np.abs(values[0] - forces) <= _FORCE * sizes).all())

    def _exact(self) -> Iterator[None]:
        """Move the points of all curves to where the scene itself has them."""
        for trace in self.traces:
            trace.missing = np.full(len(trace.points), np.nan)
            for k, y in enumerate(trace.points):
                scene = self._scene(y)
                if k % _COUNTED == 0 or k == len(trace.points) - 1:
                    modes, trace.missing[k] = self._modes(scene, y)
                    self.space.take(scene, modes)
                elif isinstance(trace.condition, Separation):
                    self.space.take_equilibrium(scene)
                else:
                    near = 1j * trace.condition.omega(y)
                    self.space.take(scene, complex_modes(scene, self.space.letters, near=near, count=1))
                yield
        self._rebuild()
        for k, trace in enumerate(self.traces):
            found = moved(trace, self._moved(trace.condition))
            if found is None:
                kind = trace.condition.kind
                self.doubts.append(f"a {kind} curve of the projected scene is not found with exact modes")
                continue
            if isinstance(found.condition, Hopf):
                found.errors = np.array([self._error(found.condition, y) for y in found.points])
            self.traces[k] = found
            yield

    def _modes(self, scene: Scene, place: Real) -> tuple[Modes, float]:
        """Return the modes of the band, and how many are missing, which is a doubt."""
        modes = self.space.modes(scene, certify=True)
        self.doubts += [f"at {self.plane.described(place[:2])}: {doubt}" for doubt in modes.doubts]
        return modes, float(modes.missing or 0.0)

    def _scene(self, place: Real) -> Scene:
        """Return the scene at a place of the unit square."""
        return self.plane.sliding.family.scene({**self.plane.fixed, **self.plane.values(place[:2])})

    def _rebuild(self) -> None:
        """Project on all that is in the space by now."""
        plane, region = self.plane, self.space.region
        ends = zip(plane.names, zip(plane.lower, plane.upper, strict=True), strict=True)
        self.plane = Plane(plane.sliding, dict(ends), plane.fixed, region, self.space.basis())

    def _moved(self, condition: Condition) -> Condition:
        """Return the condition of a curve with the matrices that are known by now."""
        place = condition.start[:2]
        if isinstance(condition, Hopf):
            return Hopf(self.plane, place, condition.scale)
        if isinstance(condition, Separation):
            return Separation(self.plane, place, condition.contact)
        return Divergence(self.plane, place)

    def _error(self, condition: Hopf, y: Real) -> float:
        """Return the growth rate of the mode of the scene at a point of a Hopf curve, of its modulus."""
        condition.settle(y)
        basis = self.plane.basis
        assert basis is not None
        right, left = (basis @ (condition.units * x) for x in (condition.c, condition.b.conj()))
        eigenvalue = np.array([1j * condition.omega(y)])
        found = self._scene(y).core.judged_pairs(self.space.letters, eigenvalue, right[None], left[None])
        value = found["eigenvalues"][0]
        return float(abs(value.real) / abs(value))
