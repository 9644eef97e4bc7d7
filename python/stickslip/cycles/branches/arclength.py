"""Branches of periodic orbits followed along their own length, around folds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.optimize

from stickslip import _core
from stickslip.cycles.bifurcation import table
from stickslip.cycles.branches.branch import Branch, BranchPoint, Placed, checked_cycle, first_orbit
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, OrbitError
from stickslip.scene.checks import Real, real_number, whole_number
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import SceneAt, between

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

        Raises
        ------
        OrbitError
            If Newton's method does not find it, or the events of the sequence come in another order there.
        """
        guess = place.orbit.predicted(*self.sides(place.value), place.tangent, length)
        value = place.value + self.unit * length * place.tangent[1]
        last = np.inf
        for _ in range(NEWTON):
            scene = self.scene_at(value)
            guess, change, size = guess.corrected(scene.core, *self.sides(value), place.tangent)
            if not size <= FAR:
                break
            if size <= ROUNDING or (last <= NEARLY and size >= 0.5 * last):
                if guess.shortest < 0.0:
                    raise OrbitError("the phases of the orbit no longer follow each other")
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


def trace_branch(
    cycle: Cycle,
    parameters: Mapping[str, Any],
    model: Model | None = None,
    *,
    step: float = 0.02,
    points: int = 200,
) -> Branch:
    """Return the branch of periodic orbits through a cycle, along its own length and around its folds.

    Orbit, period and parameter are unknown together (pseudo-arclength, Keller 1977; the equations stand in
    the core), so that the branch goes on where the parameter turns back.

    Parameters
    ----------
    cycle
        Where to begin.
    parameters
        Values by name as for `sweep`, one of them (begin, end): the value of the cycle, and the
        value to reach. The branch is followed while the parameter lies between both.
    model
        A function from keywords to a `Scene`; None: the scene of the cycle.
    step
        Longest step, in (0, 1], relative to the range of the parameter and the size of the orbit together.
        Steps become shorter where the branch bends.
    points
        Number of points after which the call stops, >= 1.

    Returns
    -------
    Branch
        Its `data` over ``point``, with the parameter as a coordinate: as `follow_branch`. The critical
        multiplier of its `folds` is 1 to 1e-8.

    Raises
    ------
    InputError
        If the parameter is unknown or not a pair of two values, or an argument is ill-posed.
    OrbitError
        If Newton's method does not find the orbit at the first value.
    """
    checked_cycle(cycle)
    points = whole_number("points", points, 1)
    longest = real_number("step", step)
    if not 0.0 < longest <= 1.0:
        raise InputError(f"step: expected 0 < step <= 1, got {longest:g}")
    source = cycle.scene if model is None else model
    name, begin, end, scene_at = between(source, parameters)
    low, high = min(begin, end), max(begin, end)
    curve = Curve(scene_at, high - low)
    first = first_orbit(cycle, name, begin, scene_at)
    place = curve.begin(first.core.orbit(), begin, 1.0 if end > begin else -1.0)
    placed: list[Placed] = [(begin, first)]
    folds: list[BranchPoint] = []
    length = longest
    why: Literal["range", "points", "sequence"] = "points"
    while len(placed) < points:
        further = _further(curve, place, length)
        if further is None:
            why = "sequence"
            break
        after, length = further
        if place.tangent[1] * after.tangent[1] < 0.0:
            folds.append(curve.fold(name, place, length))
        if not low <= after.value <= high:
            why = "range"
            break
        place = after
        placed.append((place.value, curve.cycle(place)))
        length = min(GROWTH * length, longest)
    values = np.array([value for value, _ in placed])
    cycles = [orbit for _, orbit in placed]
    result = table("point", np.arange(values.size), cycles, {}).assign_coords(
        {name: ("point", values, Family(source).units(name))}
    )
    result["followed"] = ("point", [orbit.is_followed() for orbit in cycles])
    return Branch(result, tuple(cycles), tuple(folds), why)


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
