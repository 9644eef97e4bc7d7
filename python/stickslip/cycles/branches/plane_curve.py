"""A curve of bifurcations over two parameters by pseudo-arclength: its points, its ends, where more holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.optimize

from stickslip.cycles.branches.chart import Chart, Motion, Spot
from stickslip.faults import OrbitError
from stickslip.locus.boundary.curves import PointKind
from stickslip.scene.checks import Real

#: Shortest step before the curve counts as lost, and how near to the border it then ends there.
SHORTEST, EDGE = 1e-6, 1e-5
#: Cosine of the angle between directions of successive points that steps aim at, and the least one.
AIM, BEND = 0.99, 0.9
#: Growth of a step after one that went well.
GROWTH = 1.5
#: Velocity in the unit square below which the direction of the parameters is kept, as near a cusp.
STILL = 1e-3
#: Sine of the angle between curve and coordinates up to which these are not turned again; turns at most.
ALIGNED, ALIGNMENTS = 0.1, 3
#: Velocities below this are rounding of differences: a straight curve does not turn.
STRAIGHT = 1e-6
#: Relative accuracy of a place between two points at which something changes.
PLACE = 1e-10
#: Length within which the speed of an event function vanishes where a curve is lost because of it.
TOUCH = 1e-4
#: How near, in terms of their sizes, period and amplitude of a closed curve come back to those at its start.
SAME = 1e-2


@dataclass(frozen=True, eq=False)
class Node:
    """A point of a curve, coordinates around it, and how the curve goes on."""

    chart: Chart
    motion: Motion

    @property
    def spot(self) -> Spot:
        """The orbit."""
        return self.chart.spot

    @property
    def heading(self) -> Real:
        """Direction of parameters and orbit together, of length 1."""
        state = self.motion.direction[0] * self.chart.place.tangent[0]
        whole: Real = np.concatenate([self.motion.velocity, state])
        return whole / np.linalg.norm(whole)

    def spot_at(self, h: float) -> tuple[Real, Spot]:
        """Return coordinates and orbit of the curve a length h further."""
        direction = self.motion.direction
        return self.chart.corrected(h * direction, direction)

    def renewed(self, spot: Spot) -> Node:
        """Return the node at an orbit further on the curve, with coordinates along the curve itself."""
        node = self
        for _ in range(ALIGNMENTS):
            along, velocity = node.chart.along, node.motion.velocity
            speed = float(np.linalg.norm(velocity))
            if speed > STILL:
                along = velocity / (speed * np.sign(velocity @ along or 1.0))
            chart = Chart.at(spot, along)
            node = Node(chart, chart.motion(np.zeros(2), node.motion.direction))
            if abs(node.motion.velocity @ chart.across) <= ALIGNED * speed:
                break
        return node


@dataclass(frozen=True, eq=False)
class Special:
    """A point of a curve at which something else holds; fields as of `CodimensionTwo`."""

    kind: PointKind
    node: Node
    multiplier: complex | None = None
    axis: int | None = None
    contact: int | None = None


@dataclass
class Side:
    """A curve from its start to one side."""

    nodes: list[Node]
    specials: list[Special] = field(default_factory=list)
    end: str = "points"


def started(spot: Spot, along: Real) -> Node:
    """Return the node of a curve near an orbit, `along` the axis that its branch does not follow.

    Raise `OrbitError` if the condition is not met near.
    """
    chart, ahead = Chart(spot, along, spot.place), np.array([0.0, 1.0])
    chart = Chart.at(chart.corrected(np.zeros(2), ahead)[1], along)
    node = Node(chart, chart.motion(np.zeros(2), ahead))
    return node.renewed(node.spot)


def turned(node: Node) -> Node:
    """Return a node from which the curve is followed to the other side."""
    return Node(node.chart, Motion(-node.motion.direction, -node.motion.velocity))


def follow(side: Side, longest: float, points: int) -> None:
    """Add points to a side as they are found, until the curve ends or the side has so many."""
    origin, length = side.nodes[0], longest
    while len(side.nodes) < points:
        before = side.nodes[-1]
        step = _shortened(before, length)
        if step is None:
            side.end = "range" if -_excess(before.spot) <= EDGE else "lost"
            contact = _touching(side.nodes)
            if side.end == "lost" and contact is not None:
                side.end = "tangency"
                side.specials.append(Special("tangency", before, contact=contact))
            return
        after = step.after
        side.specials += step.specials
        # Where the curve starts on the border, its end there is its start.
        if step.length > 0.0:
            side.nodes += [*(special.node for special in step.specials), after]
        if step.stop is not None:
            side.end = step.stop.why
            if side.end != "range":
                side.specials.append(_last(step.stop, after))
            return
        if len(side.nodes) > 3 and _returns(origin, before, after, longest):
            side.nodes[-1], side.end = origin, "closed"
            return
        bend = float(before.heading @ after.heading)
        length = min(longest, GROWTH * step.length if bend >= AIM else 0.7 * step.length)


@dataclass(frozen=True, eq=False)
class Stop:
    """Where a curve ends within a step: its last orbit, and one just beyond it."""

    length: float
    why: str
    spot: Spot
    beyond: Spot


@dataclass(frozen=True, eq=False)
class Step:
    """A step along a curve: its length, the node after it, what is between, where the curve ends."""

    length: float
    after: Node
    specials: list[Special]
    stop: Stop | None


def _shortened(before: Node, length: float) -> Step | None:
    """Return the longest step of at most a length, halved until it is found; None where there is none."""
    while length > SHORTEST:
        try:
            step = _step(before, length)
        except OrbitError:
            step = None
        if step is not None:
            return step
        length *= 0.5
    return None


def _step(before: Node, length: float) -> Step | None:
    """Return a step of a length; None where the curve bends too far in it.

    Raise `OrbitError` if an orbit on the way is not found.
    """
    after = before.renewed(before.spot_at(length)[1])
    if before.heading.size != after.heading.size or before.heading @ after.heading < BEND:
        return None
    stop = _stop(before, after.spot, length)
    if stop is not None:
        length, after = stop.length, _ending(before, stop.spot)
    found = sorted(_specials(before, after, length), key=lambda one: one[0])
    return Step(length, after, [special for _, special in found], stop)


def _excess(spot: Spot) -> float:
    """Return by how much a point lies outside the unit square; negative within."""
    return float(np.max([spot.at - 1.0, -spot.at]))


def _why(spot: Spot) -> str:
    """Return why a curve ends at an orbit; nothing if it goes on."""
    if spot.condition.breaks(spot.cycle):
        return "sequence"
    if spot.condition.is_resonant(spot.cycle):
        return "resonance"
    return "range" if _excess(spot) >= 0.0 else ""


def _stop(before: Node, after: Spot, length: float) -> Stop | None:
    """Return where the curve ends within a step; None if it goes on."""
    if not _why(after):
        return None
    if _excess(after) > 0.0:
        length = _root(before, length, _excess)
        after = before.spot_at(length)[1]
        rounded = np.round(after.at)
        after = replace(after, at=np.where(np.abs(after.at - rounded) <= PLACE, rounded, after.at))
    if _why(after) in ("range", ""):
        return Stop(length, "range", after, after)
    length, last, beyond = _change(before, length, after, lambda spot: bool(_why(spot)))
    return Stop(length, _why(beyond), last, beyond)


def _root(before: Node, length: float, function: Callable[[Spot], float]) -> float:
    """Return where a function of the orbit vanishes on the curve within a step."""
    if function(before.spot) >= 0.0:
        return 0.0
    found = scipy.optimize.brentq(
        lambda h: function(before.spot_at(h)[1]), 0.0, length, xtol=1e-16, rtol=1e-15
    )
    return float(found)


def _change(
    before: Node, length: float, after: Spot, function: Callable[[Spot], object]
) -> tuple[float, Spot, Spot]:
    """Return where a function of the orbit changes within a step, and the orbits on either side."""
    low, high, last, first = 0.0, length, before.spot, function(before.spot)
    while high - low > PLACE * length:
        middle = 0.5 * (low + high)
        spot = before.spot_at(middle)[1]
        if function(spot) == first:
            low, last = middle, spot
        else:
            high, after = middle, spot
    return low, last, after


def _ending(before: Node, spot: Spot) -> Node:
    """Return the last node of a curve; beyond it there may be no scenes to difference."""
    try:
        return before.renewed(spot)
    except OrbitError:
        return Node(Chart(spot, before.chart.along, spot.place), before.motion)


def _last(stop: Stop, node: Node) -> Special:
    """Return what holds where a curve ends within the ranges."""
    condition, cycle = stop.beyond.condition, stop.beyond.cycle
    if stop.why == "resonance":
        own = cycle.transverse_multipliers[condition.own(cycle)]
        return Special("resonance", node, complex(np.sign(own[0].real)))
    phase, contact, *_ = condition.breaks(cycle)[0]
    if contact is None:
        contact = cycle.phases[phase].contact
    return Special("sequence", node, contact=None if contact < 0 else contact)


def _touching(nodes: list[Node]) -> int | None:
    """Return the contact whose event function comes to touch zero where a curve ends; None if none does.

    At the distance d before that end the least value of the function is proportional to -d, so that it
    crosses zero with a speed h' that falls like the root of d (grazing bifurcation, di Bernardo and others
    2008, section 6.2). The square of h' is extrapolated from the last two orbits.
    """
    if len(nodes) < 2:
        return None
    before, last = (np.square(node.spot.cycle.core.crossing_speeds()) for node in nodes[-2:])
    falls = last < before
    step = float(np.linalg.norm(nodes[-1].spot.at - nodes[-2].spot.at))
    remaining = np.full(last.size, np.inf)
    remaining[falls] = step * last[falls] / (before - last)[falls]
    event = int(np.argmin(remaining))
    contact = nodes[-1].spot.cycle.phases[event].contact
    return contact if remaining[event] <= TOUCH and contact >= 0 else None


def _specials(before: Node, after: Node, length: float) -> Iterator[tuple[float, Special]]:
    """Give the points of a step at which something else holds, each with its distance."""

    def outside(spot: Spot) -> int:
        return spot.condition.outside(spot.cycle)

    def speed(node: Node) -> float:
        return float(node.motion.velocity @ node.chart.along)

    kind = before.spot.condition.kind
    if kind == "fold" and speed(before) * speed(after) < 0.0:
        yield from _turn(before, length, before.chart.along, "cusp", None)
    else:
        for axis in (0, 1):
            ends = before.motion.velocity[axis], after.motion.velocity[axis]
            if ends[0] * ends[1] < 0.0 and max(map(abs, ends)) > STRAIGHT:
                yield from _turn(before, length, np.eye(2)[axis], "degenerate", axis)
    if outside(before.spot) != outside(after.spot):
        h, spot, _ = _change(before, length, after.spot, outside)
        others = spot.condition.others(spot.cycle)
        second = others[int(np.argmin(np.abs(np.abs(others) - 1.0)))]
        yield h, Special("second_multiplier", before.renewed(spot), complex(second))


def _turn(
    before: Node, length: float, row: Real, kind: PointKind, axis: int | None
) -> Iterator[tuple[float, Special]]:
    """Give the point of a step at which the velocity has no part along a row, if its sign changes."""

    def part(h: float) -> float:
        point = before.spot_at(h)[0]
        return float(row @ before.chart.motion(point, before.motion.direction).velocity)

    if part(0.0) * part(length) < 0.0:
        # Velocities are differences: their zeros are not known better.
        h = float(scipy.optimize.brentq(part, 0.0, length, xtol=1e-8 * length, rtol=1e-8))
        yield h, Special(kind, before.renewed(before.spot_at(h)[1]), axis=axis)


def _returns(origin: Node, before: Node, after: Node, step: float) -> bool:
    """Return whether the curve has come back to its start between two nodes."""
    velocity = origin.motion.velocity
    passes = (before.spot.at - origin.spot.at) @ velocity < 0.0 <= (after.spot.at - origin.spot.at) @ velocity
    if not passes or np.linalg.norm(after.spot.at - origin.spot.at) > step:
        return False
    sizes = [np.append(one.cycle.period, one.cycle.amplitude.to_numpy()) for one in (origin.spot, after.spot)]
    alike = bool((np.abs(sizes[0] - sizes[1]) <= SAME * sizes[0]).all())
    return alike and float(origin.heading @ after.heading) >= BEND
