"""Periodic orbits over a parameter, and the points at which they change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, overload

import numpy as np
import scipy.optimize

from stickslip.cycles.branches.arclength import Traced, fold_near, trace
from stickslip.cycles.branches.branch import (
    Branch,
    BranchPoint,
    Kind,
    Placed,
    along_branch,
    checked_cycle,
    continued,
)
from stickslip.cycles.branches.conditions import product, sequence_tests
from stickslip.cycles.branches.curve import BifurcationCurve, bifurcation_curve
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, OrbitError
from stickslip.scene.checks import real_array, real_number, whole_number
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import SceneAt, between

#: Kinds of points at which the sequence of events changes.
CHANGES = ("grazing", "switching")
#: Steps in which the end of a branch is looked for, and how far before its last orbit they begin, part of the
#: range.
STEPS, AWAY = 60, 1e-2
#: Accuracy of a multiplier at a branch point: its target is met to this.
MULTIPLIER = 1e-8
#: Relative distance to which the end of a branch is approached by halving; closer, Newton's method needs
#: better starts.
CLOSE = 1e-7
#: Distance from 1 of a multiplier at that end up to which it may be that of a fold: it falls like the root of
#: the distance.
NEAR_ONE = 0.3


@overload
def continuation(
    cycle: Cycle,
    parameters: Mapping[str, Any],
    model: Model | None = None,
    *,
    at: Sequence[float] = (),
    step: float = 0.02,
    points: int = 200,
) -> Branch: ...
@overload
def continuation(
    cycle: BranchPoint,
    parameters: Mapping[str, Any],
    model: Model | None = None,
    *,
    step: float = 0.02,
    points: int = 200,
) -> BifurcationCurve: ...
def continuation(
    cycle: Cycle | BranchPoint,
    parameters: Mapping[str, Any],
    model: Model | None = None,
    *,
    at: Sequence[float] = (),
    step: float = 0.02,
    points: int = 200,
) -> Branch | BifurcationCurve:
    """Return the branch of periodic orbits through a cycle, or the curve of bifurcations through its point.

    Orbit, period and parameter are unknown together (pseudo-arclength, Keller 1977), so that the branch goes
    on where the parameter turns back. The sequence of events stays that of the cycle. From a point of
    `Branch.points` its bifurcation is followed over two parameters.

    Parameters
    ----------
    cycle
        Where to begin: a cycle, or a point of a branch.
    parameters
        Parameters by name as for `sweep`, one of them with (begin, end): the value of the cycle, or another
        one that its branch comes to without a fold, and the value to reach. The branch is followed while the
        parameter lies between both. From a point of a branch two of them with (lower, upper), the one of the
        branch and another one; the curve is followed to the border of this rectangle.
    model
        A function from keywords to a `Scene`, or a scene; None: the scene of the cycle.
    at
        Values of the parameter at which the branch has orbits besides those that its steps lead to;
        `Branch.at` returns them.
    step
        Longest step, in (0, 1], relative to the range of the parameter and the size of the orbit together.
        Steps become shorter where the branch bends. Two points of one kind within a step are not found.
    points
        Number of orbits after which the call stops, >= 1.

    Returns
    -------
    Branch or BifurcationCurve
        From a point of a branch a `BifurcationCurve`.
        From a cycle a `Branch`: its `data` over ``point``, with the parameter as a coordinate: as
        `bifurcation` for its cycles, and ``followed``: whether the contact laws of the scene hold all along
        the orbit. Its `points` in the order of the branch, up to the first change of the sequence, beyond
        which the contact laws do not hold. The critical multiplier of a period doubling is -1 within 1e-8,
        that of a fold is 1. Between the two orbits around a fold no other point is looked for. A branch whose
        orbits shrink into a steady state ends where they have a hundredth of its largest amplitude; its last
        point is the Hopf point, extrapolated over the square of the amplitude.

    Raises
    ------
    InputError
        If `cycle` is none, the parameter is unknown or not a pair of two values, a value of `at` lies outside
        of these, or an argument is ill-posed; from a point of a branch if it lies outside of the rectangle.
    OrbitError
        If Newton's method does not find the orbit at the first value, or the bifurcation at the point.
    Interrupted
        On Ctrl-C along a curve of bifurcations; its ``partial`` holds the points found by then.

    Notes
    -----
    On a curve of bifurcations the orbits around each point have two coordinates: the length of their branch
    across the curve, and the parameters along it. One equation holds in them. For a fold it is the part of
    the parameter in the tangent of the branch; for a period doubling or a torus a product over all
    multipliers that is zero where one is -1 or two have the product 1; for a grazing or switching the event
    function or the duration that vanishes. The secant method solves it, each orbit to rounding. The direction
    of the curve is differenced, to 1e-7.
    """
    points = whole_number("points", points, 1)
    longest = real_number("step", step)
    if not 0.0 < longest <= 1.0:
        raise InputError(f"step: expected 0 < step <= 1, got {longest:g}")
    if isinstance(cycle, BranchPoint):
        if len(at):
            raise InputError("at: expected no values where a bifurcation is followed over two parameters")
        return bifurcation_curve(cycle, parameters, model, longest, points)
    checked_cycle(cycle)
    source = cycle.scene if model is None else model
    name, begin, end, scene_at = between(source, parameters)
    chosen = real_array("at", at, 1)
    if not ((chosen >= min(begin, end)) & (chosen <= max(begin, end))).all():
        raise InputError(f"at: expected values from {min(begin, end):g} to {max(begin, end):g}, got {at!r}")
    traced = trace(cycle, name, (begin, end), scene_at, longest, points)
    placed = list(_with_values(traced, chosen.tolist(), scene_at))
    data = along_branch(name, placed, Family(source).units(name))
    cycles = tuple(orbit for _, orbit in placed)
    return Branch(data, cycles, tuple(_points(name, traced, end, scene_at)), traced.end)


def _with_values(traced: Traced, chosen: Sequence[float], scene_at: SceneAt) -> Iterable[Placed]:
    """Return the orbits of a branch with those at chosen values between them."""
    yield traced.placed[0]
    for before, after in pairwise(traced.placed):
        low, high = sorted((before[0], after[0]))
        inside = sorted((value for value in chosen if low < value < high), reverse=after[0] < before[0])
        for value in inside:
            yield value, continued(before, value, scene_at)
        yield after


def _points(name: str, traced: Traced, end: float, scene_at: SceneAt) -> Iterable[BranchPoint]:
    """Return the points of a branch in its order, up to the first change of the sequence."""
    folds = dict(traced.folds)
    for number, (before, after) in enumerate(pairwise(traced.placed), start=1):
        if number in folds:
            yield folds[number]
            continue
        for point in _between(name, before, after, scene_at):
            yield point
            if point.kind in CHANGES:
                return
    if traced.hopf is not None:
        yield traced.hopf
    elif len(traced.placed) in folds:
        yield folds[len(traced.placed)]
    elif traced.end == "sequence":
        values = [value for value, _ in traced.placed]
        onward = end if len(values) < 2 or (values[-1] - values[-2]) * (end - values[0]) > 0.0 else values[0]
        # From an orbit apart from the end, since how the branch ends is extrapolated from the way to it.
        apart = AWAY * abs(end - values[0])
        start = next((k for k in reversed(range(len(values))) if abs(values[k] - values[-1]) >= apart), 0)
        for point in _ending(name, traced.placed[start], onward, scene_at):
            # Others were found between the orbits.
            if point.kind in CHANGES or (point.value - values[-1]) * (onward - values[-1]) >= 0.0:
                yield point


def _between(name: str, before: Placed, after: Placed, scene_at: SceneAt) -> list[BranchPoint]:
    """Return the points between two orbits of a branch, in its order; none if they are at one value."""
    if before[0] == after[0]:
        return []
    found = [*_crossings(name, before, after, scene_at), *_sequence_changes(name, before, after, scene_at)]
    return sorted(found, key=lambda point: abs(point.value - before[0]))


def _ending(name: str, last: Placed, onward: float, scene_at: SceneAt) -> Iterable[BranchPoint]:
    """Return the points by which a branch of one sequence ends, beyond its last orbit."""
    before = last
    for value in np.linspace(last[0], onward, STEPS + 1)[1:].tolist():
        try:
            # Beyond a change of the sequence the equations still have solutions, with negative durations.
            after = value, continued(before, value, scene_at)
        except OrbitError:
            yield from _branch_end(name, before, value, scene_at)
            return
        for point in _between(name, before, after, scene_at):
            yield point
            if point.kind in CHANGES:
                return
        before = after


def _pairs_outside(cycle: Cycle) -> float:
    """Modulus of the outermost complex pair less 1; -1 without one."""
    pairs = cycle.transverse_multipliers[np.abs(cycle.transverse_multipliers.imag) > 0.0]
    return float(np.abs(pairs).max(initial=0.0)) - 1.0


def _crossings(name: str, before: Placed, after: Placed, scene_at: SceneAt) -> Iterable[BranchPoint]:
    tests: tuple[tuple[Kind, Callable[[Cycle], float], complex], ...] = (
        ("period_doubling", lambda cycle: product(cycle, -1.0), -1.0),
        ("fold", lambda cycle: product(cycle, 1.0), 1.0),
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


def _sequence_changes(name: str, before: Placed, after: Placed, scene_at: SceneAt) -> Iterable[BranchPoint]:
    first, last = sequence_tests(before[1]), sequence_tests(after[1])
    for key in [key for key, value in last.items() if value < 0.0 <= first.get(key, 0.0)]:

        def test(cycle: Cycle, key: tuple[Any, ...] = key) -> float:
            # A local minimum appears as the function begins to dip: until then the phase has no such margin.
            return sequence_tests(cycle).get(key, np.inf)

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
    if np.isfinite(estimate) and len(places) > 2:
        # With the next power of the duration, of which the square is the first that counts.
        values, orbits = zip(*places[-3:], strict=True)
        lengths = np.array([orbit.core.durations[shortest] for orbit in orbits]) / before[1].period
        powers = np.stack([np.ones(3), lengths**2, lengths**3], axis=1)
        estimate = float(np.linalg.solve(powers / powers.max(axis=0), values)[0])
    if np.isfinite(estimate):
        event = shortest - 1
        contact = int(cycle.run.events.contact[event])
        kind = str(cycle.run.events.kind[event])
        yield BranchPoint(name, float(estimate), "grazing", complex(np.nan, np.nan), contact, kind, cycle)
