"""Where a branch of periodic orbits changes: period doublings, folds, tori, changes of the event sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import scipy.optimize

from stickslip.cycles.branches.arclength import fold_near
from stickslip.cycles.branches.branch import BranchPoint, Kind, Placed, checked_cycle, continued, first_orbit
from stickslip.cycles.cycle import Cycle
from stickslip.faults import OrbitError
from stickslip.scene.checks import whole_number
from stickslip.scene.parameters.family import Model
from stickslip.scene.parameters.values import SceneAt, between

#: Steps of a search for branch points: between two of them at most one of each kind is expected.
STEPS = 60
#: Accuracy of a multiplier at a branch point: its target is met to this.
MULTIPLIER = 1e-8
#: Relative distance to which the end of a branch is approached by halving; closer, Newton's method needs
#: better starts.
CLOSE = 1e-7
#: Distance from 1 of a multiplier at that end up to which it may be that of a fold: it falls like the root of
#: the distance.
NEAR_ONE = 0.3

#: Part of its amplitude to which an orbit without events shrinks within a step as it ends.
SHRUNK = 0.1


def branch_points(
    cycle: Cycle,
    parameters: Mapping[str, Any],
    model: Model | None = None,
    *,
    steps: int = STEPS,
) -> tuple[BranchPoint, ...]:
    """Return the points at which a branch of orbits changes stability, folds, or changes its event sequence.

    Parameters
    ----------
    cycle
        Where to begin.
    parameters
        Values by name as for `sweep`, one of them (begin, end): the branch is followed from the
        first to the second value, up to a change of the sequence.
    model
        A function from keywords to a `Scene`; None: the scene of the cycle.
    steps
        Number of steps of the search, >= 1. Two points of one kind within a step are not found.

    Returns
    -------
    tuple of BranchPoint
        The points in the order of the branch. The critical multiplier of a period doubling is -1 within 1e-8,
        that of a fold is 1. `trace_branch` follows a branch beyond its fold.

    Raises
    ------
    InputError
        If the parameter is unknown or not a pair of two values.
    OrbitError
        If Newton's method does not find the orbit at the first value.
    """
    checked_cycle(cycle)
    steps = whole_number("steps", steps, 1)
    source = cycle.scene if model is None else model
    name, begin, end, scene_at = between(source, parameters)
    values = np.linspace(begin, end, steps + 1)
    points: list[BranchPoint] = []
    before = (float(values[0]), first_orbit(cycle, name, float(values[0]), scene_at))
    for value in values[1:]:
        try:
            after = (float(value), continued(before, float(value), scene_at))
        except OrbitError:
            points.extend(_branch_end(name, before, float(value), scene_at))
            break
        found = [
            *_crossings(name, before, after, scene_at),
            *_sequence_changes(name, before, after, scene_at),
        ]
        found.sort(key=lambda point: abs(point.value - before[0]))
        for point in found:
            points.append(point)
            if point.kind in ("grazing", "switching"):
                return tuple(points)
        before = after
    return tuple(points)


def _product(cycle: Cycle, target: float) -> float:
    # Real, because multipliers come in conjugate pairs; zero where one of them is at the target.
    return float(np.prod(cycle.transverse_multipliers - target).real)


def _pairs_outside(cycle: Cycle) -> float:
    """Modulus of the outermost complex pair less 1; -1 without one."""
    pairs = cycle.transverse_multipliers[np.abs(cycle.transverse_multipliers.imag) > 0.0]
    return float(np.abs(pairs).max(initial=0.0)) - 1.0


def _crossings(name: str, before: Placed, after: Placed, scene_at: SceneAt) -> Iterable[BranchPoint]:
    tests: tuple[tuple[Kind, Callable[[Cycle], float], complex], ...] = (
        ("period_doubling", lambda cycle: _product(cycle, -1.0), -1.0),
        ("fold", lambda cycle: _product(cycle, 1.0), 1.0),
        ("torus", _pairs_outside, np.nan),
    )
    for kind, test, target in tests:
        if np.sign(test(before[1])) == np.sign(test(after[1])):
            continue
        value, cycle = _root(test, before, after, scene_at)
        multipliers = cycle.transverse_multipliers
        if kind == "torus":
            critical = complex(multipliers[int(np.argmin(np.abs(np.abs(multipliers) - 1.0)))])
            missed = abs(abs(critical) - 1.0)
        else:
            critical = complex(multipliers[int(np.argmin(np.abs(multipliers - target)))])
            missed = abs(critical - target)
        # A pair that becomes real passes no root of the modulus of pairs.
        if missed <= MULTIPLIER:
            yield BranchPoint(name, value, kind, critical, None, None, cycle)


def _root(test: Callable[[Cycle], float], before: Placed, after: Placed, scene_at: SceneAt) -> Placed:
    known = {before[0]: before[1], after[0]: after[1]}

    def orbit(value: float) -> Cycle:
        if value not in known:
            nearest = min(known, key=lambda other: abs(other - value))
            known[value] = continued((nearest, known[nearest]), value, scene_at)
        return known[value]

    low, high = sorted((before[0], after[0]))
    value = scipy.optimize.brentq(
        lambda value: test(orbit(float(value))), low, high, xtol=1e-15, rtol=4 * np.finfo(float).eps
    )
    return float(value), orbit(float(value))


def _sequence_tests(cycle: Cycle) -> dict[tuple[Any, ...], float]:
    """Everything that is positive while the sequence holds: margins and durations, by what they belong to."""
    margins = {(m.phase, m.contact, m.kind, m.interior): m.value for m in cycle.margins()}
    durations = {(k, None, "duration", False): float(d) for k, d in enumerate(cycle.core.durations)}
    return {**margins, **durations}


def _sequence_changes(name: str, before: Placed, after: Placed, scene_at: SceneAt) -> Iterable[BranchPoint]:
    first, last = _sequence_tests(before[1]), _sequence_tests(after[1])
    for key in [key for key, value in last.items() if value < 0.0 <= first.get(key, 0.0)]:

        def test(cycle: Cycle, key: tuple[Any, ...] = key) -> float:
            # A local minimum appears as the function begins to dip: until then the phase has no such margin.
            return _sequence_tests(cycle).get(key, np.inf)

        value, cycle = _bisected(test, before, after, scene_at)
        phase, contact, event, interior = key
        if contact is None:
            contact, event = next(
                ((m.contact, m.kind) for m in cycle.margins() if m.phase == phase and m.value < 0.0),
                (None, None),
            )
        kind: Kind = "grazing" if interior else "switching"
        yield BranchPoint(name, value, kind, complex(np.nan, np.nan), contact, event, cycle)


def _bisected(test: Callable[[Cycle], float], before: Placed, after: Placed, scene_at: SceneAt) -> Placed:
    if np.isfinite(test(before[1])):
        return _root(test, before, after, scene_at)
    inside, outside = before, after
    while True:
        middle = 0.5 * (inside[0] + outside[0])
        if middle in (inside[0], outside[0]):
            return outside
        placed = (middle, continued(outside, middle, scene_at))
        if test(placed[1]) < 0.0:
            outside = placed
        else:
            inside = placed
            if np.isfinite(test(placed[1])):
                return _root(test, inside, outside, scene_at)


def _branch_end(name: str, before: Placed, beyond: float, scene_at: SceneAt) -> Iterable[BranchPoint]:
    """Where a branch of one sequence ends: a fold, or a phase that shrinks to the touch it grew from."""
    places = [before]
    outside = beyond
    while abs(outside - places[-1][0]) > CLOSE * max(abs(outside), abs(places[-1][0])):
        middle = 0.5 * (places[-1][0] + outside)
        try:
            places.append((middle, places[-1][1].continued(scene_at(middle))))
        except OrbitError:
            outside = middle
    value, cycle = places[-1]
    if not len(cycle.run.events) and float(cycle.amplitude.max()) < SHRUNK * float(before[1].amplitude.max()):
        # To a steady state, at a Hopf point, which critical_points finds.
        return
    if np.abs(cycle.transverse_multipliers - 1.0).min(initial=np.inf) <= NEAR_ONE:
        fold = fold_near(name, (value, cycle), np.sign(beyond - before[0]), abs(beyond - before[0]), scene_at)
        if fold is not None:
            yield fold
            return
    shortest = int(np.argmin(cycle.core.durations))

    def square(orbit: Cycle) -> float:
        # An event function that dips below zero by the distance stays there for a time like its root.
        return float(orbit.core.durations[shortest]) ** 2

    estimate = np.inf
    while len(places) > 1 and square(places[-1][1]) < square(places[-2][1]):
        (near, near_cycle), (value, cycle) = places[-2:]
        before_estimate = estimate
        estimate = value + square(cycle) * (value - near) / (square(near_cycle) - square(cycle))
        if abs(estimate - before_estimate) <= CLOSE**2 * abs(estimate):
            break
        try:
            further = value + 0.5 * (estimate - value)
            places.append((further, continued((value, cycle), further, scene_at)))
        except OrbitError:
            break
    if np.isfinite(estimate):
        event = shortest - 1
        contact = int(cycle.run.events.contact[event])
        kind = str(cycle.run.events.kind[event])
        yield BranchPoint(name, float(estimate), "grazing", complex(np.nan, np.nan), contact, kind, cycle)
