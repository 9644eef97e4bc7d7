"""Branches of periodic orbits followed along their own length, around folds."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from stickslip import _core
from stickslip.cycles.branches.branch import BranchPoint, End, Placed, continued, first_orbit
from stickslip.cycles.cycle import Cycle
from stickslip.faults import OrbitError
from stickslip.scene.checks import Real
from stickslip.scene.parameters.values import SceneAt

#: Half the distance of the scenes by which the effect of the parameter is differenced, of the range.
WIDTH = 1e-6
#: Steps of Newton's method, a change that is rounding, one that may be the last if the next is no smaller.
NEWTON, ROUNDING, NEARLY = 25, 1e-13, 1e-9
#: A change larger than this, of the size of orbit or range, leads to another branch.
FAR = 1.0
#: Cosine of the angle between tangents of successive points: a sharper bend takes shorter steps.
BEND = 0.8
#: Growth of the step where the last one went well, and the shortest one before the branch counts as ended.
GROWTH, SHORTEST = 1.5, 1e-7
#: First step of a search for a fold, and steps until it is given up.
FIRST, TRIED = 1e-3, 60
#: Part of the largest amplitude of a branch below which an orbit is tested for a Hopf point, and largest
#: difference of two extrapolations to it, part of the way there.
SMALL, AGREE = 1e-2, 1e-2

Tangent = tuple[Real, float]


@dataclass(frozen=True)
class Place:
    """A point of a branch, with its direction."""

    orbit: _core.Orbit
    value: float
    tangent: Tangent


@dataclass(frozen=True)
class Curve:
    """The scenes of a branch over a parameter of which `unit` is the range."""

    scene_at: SceneAt
    unit: float

    def sides(self, value: float) -> tuple[_core.Scene, _core.Scene, float]:
        """Return scenes on either side of a value, and their distance in units."""
        half = WIDTH * self.unit
        return self.scene_at(value - half).core, self.scene_at(value + half).core, 2.0 * WIDTH

    def begin(self, orbit: _core.Orbit, value: float, towards: float) -> Place:
        """Return the place of an orbit, with the direction in which the parameter grows, or falls."""
        state, parameter = orbit.tangent(*self.sides(value), None)
        return Place(orbit, value, (towards * state, towards * parameter))

    def beyond(self, place: Place, length: float) -> Place:
        """Return the place of the branch a length further, across the tangent there.

        Raise `OrbitError` if Newton's method does not find it, or the events of the sequence come in another
        order there.
        """
        after = self.solution(place, length)
        if after.orbit.shortest < 0.0:
            raise OrbitError("the phases of the orbit no longer follow each other")
        return after

    def solution(self, place: Place, length: float) -> Place:
        """Return what `beyond` does, also where a phase of the solution has a negative duration."""
        guess = place.orbit.predicted(*self.sides(place.value), place.tangent, length)
        value = place.value + self.unit * length * place.tangent[1]
        last = np.inf
        for _ in range(NEWTON):
            scene = self.scene_at(value)
            guess, change, size = guess.corrected(scene.core, *self.sides(value), place.tangent)
            if not size <= FAR:
                break
            if size <= ROUNDING or (last <= NEARLY and size >= 0.5 * last):
                return Place(guess, value, guess.tangent(*self.sides(value), place.tangent))
            value += self.unit * change
            last = size
        raise OrbitError(f"Newton's method did not converge {length:g} further along the branch")

    def fold(self, name: str, before: Place, length: float) -> BranchPoint:
        """Return the fold between a place and the one a length further, where the parameter turns back."""

        def forward(at: float) -> float:
            return before.tangent[1] if at == 0.0 else self.beyond(before, at).tangent[1]

        # The parameter differs from its extreme by the square of the distance: half the digits are enough.
        at = scipy.optimize.brentq(forward, 0.0, length, xtol=1e-10 * length, rtol=1e-10)
        place = self.beyond(before, float(at))
        cycle = self.cycle(place)
        critical = cycle.transverse_multipliers[int(np.argmin(np.abs(cycle.transverse_multipliers - 1.0)))]
        return BranchPoint(name, place.value, "fold", complex(critical), None, None, cycle)

    def cycle(self, place: Place) -> Cycle:
        """Return the orbit at a place."""
        return Cycle(self.scene_at(place.value), place.orbit.cycle())


def bend(a: Tangent, b: Tangent) -> float:
    """Return the cosine of the angle between two directions."""
    return float(a[0] @ b[0] + a[1] * b[1]) if a[0].size == b[0].size else -1.0


@dataclass(frozen=True)
class Traced:
    """Orbits along a branch, the folds between them, why the branch ends, and the Hopf point if it is one."""

    placed: list[Placed]
    #: a fold, and the number of orbits before it
    folds: list[tuple[int, BranchPoint]]
    end: End
    hopf: BranchPoint | None = None


def trace(
    cycle: Cycle, name: str, ends: tuple[float, float], scene_at: SceneAt, step: float, points: int
) -> Traced:
    """Return the branch through a cycle from the first to the second value of a parameter, around its folds.

    Orbit, period and parameter are unknown together (pseudo-arclength, Keller 1977; the equations stand in
    the core), so that the branch goes on where the parameter turns back.

    Raise `OrbitError` if Newton's method does not find the orbit at the first value.
    """
    begin, end = ends
    low, high = min(ends), max(ends)
    curve = Curve(scene_at, high - low)
    first = first_orbit(cycle, name, ends, scene_at)
    place = curve.begin(first.core.orbit(), begin, 1.0 if end > begin else -1.0)
    placed: list[Placed] = [(begin, first)]
    folds: list[tuple[int, BranchPoint]] = []
    length = step
    why: End = "points"
    hopf: BranchPoint | None = None
    largest = float(first.amplitude.max())
    while len(placed) < points:
        further = _further(curve, place, length)
        if further is None:
            why = "sequence"
            break
        after, length = further
        if place.tangent[1] * after.tangent[1] < 0.0:
            folds.append((len(placed), curve.fold(name, place, length)))
        if not low <= after.value <= high:
            last = low if after.value < low else high
            if last != place.value:
                # Beside a fold the branch may have left the range on a way on which no value can be reached.
                with contextlib.suppress(OrbitError):
                    placed.append((last, continued(placed[-1], last, scene_at)))
            why = "range"
            break
        place = after
        placed.append((place.value, curve.cycle(place)))
        largest = max(largest, float(placed[-1][1].amplitude.max()))
        hopf = hopf_point(name, placed[-3:], largest)
        if hopf is not None:
            why = "hopf"
            break
        length = min(GROWTH * length, step)
    return Traced(placed, folds, why, hopf)


def hopf_point(name: str, last: list[Placed], largest: float) -> BranchPoint | None:
    """Return the Hopf point at which a branch is about to shrink into a steady state; None if it goes on.

    Near it the parameter is a power series in the square of the amplitude (Kuznetsov 2004, section 3.4). Its
    constant comes from the last three orbits, and is taken where the last two give nearly the same.
    """
    value, cycle = last[-1]
    if len(last) < 3 or len(cycle.run.events) or cycle.load_periods:
        return None
    amplitudes = np.array([float(one.amplitude.max()) for _, one in last])
    if amplitudes[-1] > SMALL * largest or not (np.diff(amplitudes) < 0.0).all():
        return None
    squares, values = (amplitudes / amplitudes[0]) ** 2, np.array([place for place, _ in last])
    line, parabola = (
        float(np.linalg.solve(np.vander(squares[-n:], increasing=True), values[-n:])[0]) for n in (2, 3)
    )
    if abs(parabola - line) > AGREE * abs(parabola - value):
        return None
    return BranchPoint(name, parabola, "hopf", 1.0 + 0.0j, None, None, cycle)


def _further(curve: Curve, place: Place, length: float) -> tuple[Place, float] | None:
    """Return the next place and its distance, at most `length`; None where the branch ends."""
    while length > SHORTEST:
        try:
            after = curve.beyond(place, length)
        except OrbitError:
            length *= 0.5
            continue
        if bend(place.tangent, after.tangent) >= BEND:
            return after, length
        length *= 0.5
    return None


def fold_near(
    name: str, before: Placed, towards: float, unit: float, scene_at: SceneAt
) -> BranchPoint | None:
    """Return the fold that a branch comes to shortly after an orbit; None if it goes on."""
    curve = Curve(scene_at, unit)
    value, cycle = before
    place = curve.begin(cycle.core.orbit(), value, towards)
    length = FIRST
    for _ in range(TRIED):
        further = _further(curve, place, length)
        if further is None:
            return None
        after, length = further
        if place.tangent[1] * after.tangent[1] < 0.0:
            return curve.fold(name, place, length)
        place, length = after, GROWTH * length
    return None
