"""What bounds basins: segments between starts, bisected, and the unstable cycles that cross them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from stickslip import _core
from stickslip.cycles.attractors import STRETCH
from stickslip.cycles.basins.curve import OrbitCurve
from stickslip.cycles.basins.reached import is_same
from stickslip.cycles.cycle import Cycle
from stickslip.faults import OrbitError
from stickslip.scene.checks import Index, Real
from stickslip.scene.laws.state import LawWithState
from stickslip.scene.scene import Scene
from stickslip.scene.state import State

#: Lengths of the motion from a bisected point in which a cycle is looked for, in periods of the slowest mode:
#: a little more than two turns, the first of which are nearest to the cycle.
PERIODS = (2.25, 4.5, 9.0)
#: Part by which the first segment is shortened before a cycle is looked for again.
COARSE = 1.0 / 64.0
#: Why segments in a plane cross no cycle.
WITHOUT_CYCLE = "no unstable cycle is found there: a motion that grazes, sticks or comes to rest lies between"


class Segments(NamedTuple):
    """Segments between starts whose motions reach different attractors."""

    #: both ends, (segment, end, coordinate), amounts to add to the start
    ends: Real
    #: attractors that they reach, (segment, end)
    reached: Index

    def chosen(self, which: slice | list[bool]) -> Segments:
        """Return some of the segments."""
        return Segments(self.ends[which], self.reached[which])


class Bound(NamedTuple):
    """An unstable cycle of a scene with one dof, and the attractors just inside and just outside of it."""

    cycle: Cycle
    curve: OrbitCurve
    inside: int
    outside: int

    def separates(self, points: Real, reached: Index) -> bool:
        """Return whether one of two points lies inside, one outside, and both reach what they should."""
        first, second = (self.curve.encloses(*point) for point in points)
        expected = (self.inside, self.outside) if first else (self.outside, self.inside)
        return first != second and tuple(reached) == expected


def beyond_the_plane(scene: Scene) -> str:
    """Return why the state of a scene is more than x and x' of one mass, in words; empty: it is not."""
    if scene.size > 1:
        return f"the scene has {scene.size} dofs, and a cycle is the whole boundary only in a plane"
    if scene.loads or any(contact.slider_vibration is not None for contact in scene.contacts):
        return "loads in time move the boundary, and a cycle is the boundary only without them"
    for label, contact in zip(scene.contact_labels(), scene.contacts, strict=True):
        if contact.tangential_stiffness is not None or isinstance(contact.friction, LawWithState):
            return (
                f"contact {label} has a state of its own, and a cycle is the whole boundary only in a plane"
            )
    return ""


def neighbours(numbers: Index, axes: Sequence[Real]) -> Segments:
    """Return the segments between neighbouring cells of a map that reach different attractors."""
    ends, reached = [], []
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    for axis in range(2):
        cells, corners = np.moveaxis(numbers, axis, 0), np.moveaxis(places, axis, 0)
        first, second = cells[:-1], cells[1:]
        differ = (first != second) & (first >= 0) & (second >= 0)
        ends.append(np.stack([corners[:-1][differ], corners[1:][differ]], axis=1))
        reached.append(np.stack([first[differ], second[differ]], axis=1))
    return Segments(np.concatenate(ends), np.concatenate(reached))


def bisected(segments: Segments, tolerance: float, reached: Callable[[Real], Index]) -> Segments:
    """Return the segments, halved until they are shorter than before by the factor `tolerance`.

    A segment stays as long as it is once its middle has no attractor, since that start is none.
    """
    ends, numbers = segments.ends.copy(), segments.reached.copy()
    active = np.arange(len(ends))
    for _ in range(int(np.ceil(-np.log2(tolerance)))):
        middles = ends[active].mean(axis=1)
        found = reached(middles)
        active, middles, found = active[found >= 0], middles[found >= 0], found[found >= 0]
        side = np.where(found == numbers[active, 0], 0, 1)
        ends[active, side], numbers[active, side] = middles, found
    return Segments(ends, numbers)


@dataclass
class Search:
    """The search for the cycles that separate starts of one mass."""

    scene: Scene
    #: length of a bisected segment relative to the distance of the neighbours
    tolerance: float
    #: the state of amounts (coordinate,), and the attractors that amounts (start, coordinate) reach
    start: Callable[[Real], State]
    reached: Callable[[Real], Index]
    #: time between two looks at a motion, s
    stretch: float
    bounds: list[Bound] = field(default_factory=list)

    def run(self, segments: Segments) -> Segments:
        """Find the cycles; return what crosses none of them, bisected."""
        # Mostly one cycle separates all neighbours, and a few bisections find it.
        remaining = segments
        while len(remaining.ends) and self.crosses(remaining.chosen(slice(1))):
            remaining = self.unexplained(remaining)
        remaining = bisected(remaining, self.tolerance, self.reached)
        for k in range(len(remaining.ends)):
            self.close(self.unexplained(remaining.chosen(slice(k, k + 1))), 1.0)
        return self.unexplained(remaining)

    def crosses(self, first: Segments) -> bool:
        """Return whether a new cycle crosses a segment, which is shortened until one is found."""
        count, length = len(self.bounds), 1.0
        while len(self.unexplained(first).ends) and length > self.tolerance:
            part = max(COARSE, self.tolerance / length)
            first, length = bisected(first, part, self.reached), length * part
            self.close(self.unexplained(first), self.tolerance / length)
        return len(self.bounds) > count

    def unexplained(self, given: Segments) -> Segments:
        """Return the segments that no cycle separates."""
        pairs = [(self.plane(ends), numbers) for ends, numbers in zip(*given, strict=True)]
        return given.chosen([not any(bound.separates(*pair) for bound in self.bounds) for pair in pairs])

    def plane(self, amounts: Real) -> Real:
        """Return x and x' of amounts, (start, 2) each."""
        states = [self.start(row) for row in amounts]
        return np.array([[state.position[0], state.velocity[0]] for state in states])

    def close(self, given: Segments, part: float) -> None:
        """Add the cycle that crosses a segment, if there is a segment and a cycle.

        The segment is shortened by `part` to both sides of the curve, and the motions from its ends say what
        attractors are inside and outside.
        """
        if not len(given.ends):
            return
        for cycle in _cycles_near(self.scene, self.start(given.ends[0, 0]), self.stretch):
            if any(is_same(cycle, bound.cycle) for bound in self.bounds):
                continue
            curve = OrbitCurve(cycle)

            def within(amounts: Real, curve: OrbitCurve = curve) -> Index:
                return np.array([curve.encloses(*point) for point in self.plane(amounts)], dtype=int)

            sides = within(given.ends[0])
            if sides[0] != sides[1]:
                (ends,), (sides,) = bisected(Segments(given.ends, sides[None]), part, within)
                numbers = self.reached(ends)[np.argsort(sides)]
                if (numbers >= 0).all() and numbers[0] != numbers[1]:
                    self.bounds.append(Bound(cycle, curve, inside=int(numbers[1]), outside=int(numbers[0])))
                    return


def _cycles_near(scene: Scene, start: State, stretch: float) -> Iterator[Cycle]:
    """Yield the cycles that Newton's method closes from a motion and that repel on one side and the other."""
    for periods in PERIODS:
        state = start.position, start.velocity, start.statuses
        duration = periods * stretch / STRETCH
        run = _core.Trajectory.simulate(
            scene.core, *state, duration, "auto", None, None, accumulation_tolerance=0.0, on_grazing="keep"
        )
        if run.stop_reason == "interrupted":
            raise KeyboardInterrupt
        with contextlib.suppress(OrbitError):
            core = _core.closed(run, "auto")
            if core is not None and _repels(cycle := Cycle(scene, core)):
                yield cycle


def _repels(cycle: Cycle) -> bool:
    """Return whether a cycle of one mass is a motion of the scene with one multiplier outside the circle."""
    outside = int((np.abs(cycle.transverse_multipliers) > 1.0).sum())
    return cycle.stable is False and outside == 1 and cycle.is_followed()
