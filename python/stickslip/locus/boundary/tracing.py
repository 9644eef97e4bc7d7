"""One curve by pseudo-arclength (Keller 1977), from a point of it to the border of the unit square or around.

Between its points a curve is the cubic with their tangents. Points at which it turns in u or v are points of
it, so that it is monotonous in both between two neighbours, and where it crosses a line is where signs say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from stickslip.locus.boundary.conditions import Condition, corrected, is_steady, tangent
from stickslip.locus.boundary.curves import CurveKind
from stickslip.scene.checks import Flags, Real

#: Step at most and at least, of the unit square.
_LARGEST, _SMALLEST = 0.08, 1e-9
#: Angle between tangents of neighbours that steps aim at, and at which they are refused, rad.
_ANGLE, _REFUSED = 0.15, 0.5
#: Distance of a curve from the cubic between two points, of the unit square, above which one is put between.
_BENT = 5e-5
#: Times that this is looked for along a curve.
_HALVINGS = 8
#: Way to the border at which a curve ends that Newton's method cannot follow, as where damping vanishes.
_EDGE = 1e-6
#: Part of the way to the border by which a step goes that does not end on it.
_NEARER = 0.9
#: Part of a tangent below which it is rounding.
_STRAIGHT = 1e-10
#: Part of a direction of growth below which it may be rounding.
_TURNING = 1e-6
#: Halvings until a cubic is known to have a value: one leaves the curve by more than their error.
_PARTED = 24
#: Points of one curve at most.
_POINTS = 20_000
#: Frequency, of that at the start, at which a Hopf curve ends: the error of the end is its square.
_SLOW = 1e-5


#: Point, tangent, `Trace.errors` and `Trace.growth` of it.
Settled = tuple[Real, Real, float, Real]


class _LostError(Exception):
    """Newton's method leaves a curve between two of its points."""


@dataclass
class Trace:
    """Points of one curve in order."""

    condition: Condition
    #: (k, 2), of Hopf curves (k, 3), see `Condition`.
    points: Real
    tangents: Real
    #: By how much the condition misses at every point, (k,).
    errors: Real
    #: `Condition.growth` at every point, (k, 2).
    growth: Real
    #: Why the curve ends at either side: ``range``, ``band``, ``zero_frequency``, ``closed``, or ``lost``.
    ends: tuple[str, str]
    #: Places in `points` at which the curve turns, with the axis, 0 or 1, in which it does.
    turns: list[tuple[int, int]] = field(default_factory=list)
    #: Numbers of eigenvalues of a band that are not found at the points, nan where they are not counted; None
    #: where all are computed.
    missing: Real | None = None
    #: Whether steady sliding exists at the points, (k,).
    steady: Flags = field(init=False)

    @property
    def closed(self) -> bool:
        """Whether it comes back to where it starts."""
        return self.ends[0] == "closed"


@dataclass(frozen=True)
class Crossing:
    """Where a line meets a curve: a critical point of the line, or what the curve says."""

    kind: CurveKind
    contact: int | None
    #: place along the line, of its range
    place: float
    #: rad/s, of Hopf points, else zero
    omega: float
    #: +1 where growth, or opening, begins as the parameter of the line grows
    direction: int
    #: of a separation, whether steady sliding begins or ends there
    steady: bool

    @property
    def begun(self) -> int:
        """How many eigenvalues begin to grow as the parameter of the line grows; of a pair both do."""
        return {"hopf": 2, "divergence": 1}.get(self.kind, 0) * self.direction


def traced(condition: Condition, start: Real) -> Trace | None:
    """Return the curve through a point, traced in both directions; None where no curve is found there."""
    row = tangent(condition.equations(start)[1])
    found = corrected(condition, start, row, float(row @ start))
    if found is None:
        return None
    origin = _settled(condition, found[0], row)
    forward, end = _followed(condition, origin)
    if end == "closed":
        return _finished(condition, forward, ("closed", "closed"))
    backward, begin = _followed(condition, _reversed(origin))
    return _finished(condition, [*map(_reversed, backward[:0:-1]), *forward], (begin, end))


def _reversed(point: Settled) -> Settled:
    """Return a point of a curve that is followed the other way."""
    return point[0], -point[1], *point[2:]


def _followed(condition: Condition, start: Settled) -> tuple[list[Settled], str]:
    """Return the points from one on, in the sense of its tangent, and why there are no more."""
    points, (y, along) = [start], start[:2]
    origin, begin = y, along
    condition.settle(y)
    step, bend = 0.25 * _LARGEST, np.zeros(y.size)
    away = False
    while len(points) < _POINTS:
        end = _end(condition, y, along, step)
        if end is not None:
            last = _settled(condition, end[0], along)
            # Where all modes are undamped on the border, the condition tells no direction there.
            if end[1] != "range" or _angle(last[1], along) <= _REFUSED:
                return [*points, last], end[1]
            condition.settle(y)
        step = min(step, max(_NEARER * _room(condition, y, along), _SMALLEST))
        guess = y + step * along + 0.5 * step**2 * bend
        found = corrected(condition, guess, along, float(along @ y) + step)
        turned = np.inf
        if found is not None:
            after = tangent(condition.equations(found[0])[1])
            after = after if after @ along > 0.0 else -after
            turned = _angle(after, along)
        if found is None or turned > _REFUSED or not _inside(condition, found[0]):
            if step <= _SMALLEST:
                return points, "range" if _room(condition, y, along) <= _EDGE else "lost"
            step *= 0.3
            continue
        before, y = y, found[0]
        bend = (after - along) / float(np.linalg.norm(y - before))
        distance = float(np.linalg.norm(y - origin))
        beside = float(np.linalg.norm((y - origin) - ((y - origin) @ begin) * begin))
        passes = (before - origin) @ begin < 0.0 <= (y - origin) @ begin
        if away and passes and distance < 2.0 * _LARGEST and beside < step:
            return [*points, start], "closed"
        away = away or distance > 2.0 * step
        points.append(_settled(condition, y, along))
        along = after
        step = min(_LARGEST, step * float(np.clip(_ANGLE / max(turned, 1e-12), 0.3, 2.0)))
    return points, "lost"


def _angle(a: Real, b: Real) -> float:
    """Return the angle between two directions, rad."""
    return float(np.arccos(np.clip(a @ b, -1.0, 1.0)))


def _inside(condition: Condition, y: Real) -> bool:
    low, high = condition.limits
    limited = y.size == 2 or (y[2] > 0.0 and low <= y[2] <= high)
    return bool((y[:2] >= 0.0).all() and (y[:2] <= 1.0).all() and limited)


def _limit(condition: Condition, y: Real, along: Real) -> tuple[float, float]:
    """Return the frequency at which a curve leaves its limits, and the way along the tangent to there."""
    if y.size == 2 or along[2] == 0.0:
        return np.inf, np.inf
    limit = condition.limits[int(along[2] > 0.0)]
    return limit, float((limit - y[2]) / along[2])


def _room(condition: Condition, y: Real, along: Real) -> float:
    """Return the way along the tangent to the border of the square, or to a limit of frequency."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ways = np.where(along[:2] > 0.0, (1.0 - y[:2]) / along[:2], -y[:2] / along[:2])
    ways = np.where(along[:2] == 0.0, np.inf, ways)
    return float(min(ways.min(), _limit(condition, y, along)[1]))


def _end(condition: Condition, y: Real, along: Real, step: float) -> tuple[Real, str] | None:
    """Return the end of a curve within a step: on the border, or where the frequency leaves its limits."""
    room = _room(condition, y, along)
    if room > step:
        return None
    reached = y + room * along
    limit, way = _limit(condition, y, along)
    if way <= room:
        last = limit or _SLOW
        found = corrected(condition, np.array([*reached[:2], last]), np.array([0.0, 0.0, 1.0]), last)
        if found is None:
            return None
        found[0][2] = last
        if limit and not _is_end(condition, found[0], y, along, step):
            return None
        return found[0], "band" if limit else "zero_frequency"
    axis = int(np.argmin(np.minimum(reached[:2], 1.0 - reached[:2])))
    side = 0.0 if reached[axis] < 0.5 else 1.0
    found = corrected(condition, reached, np.eye(y.size)[axis], side)
    if found is None:
        return None
    end = found[0]
    end[axis] = side
    return (end, "range") if _is_end(condition, end, y, along, step) else None


def _is_end(condition: Condition, end: Real, y: Real, along: Real, step: float) -> bool:
    """Return whether the end of a curve lies ahead of its point y, within a step."""
    ahead = (end - y) @ along >= -1e-12 and np.linalg.norm(end - y) <= 2.0 * step + 1e-12
    return bool(_inside(condition, end) and ahead)


def moved(trace: Trace, condition: Condition) -> Trace | None:
    """Return a curve whose points are moved to where another condition holds; None where it does not.

    Ends stay on what ends them. `condition` has the units of that of the curve.
    """
    turned = [place for place, _ in trace.turns]
    points = np.delete(trace.points, turned, axis=0)
    tangents = np.delete(trace.tangents, turned, axis=0)
    found: list[Settled] = []
    for k, (y, along) in enumerate(zip(points, tangents, strict=True)):
        end = trace.ends[0] if k == 0 else trace.ends[1] if k == len(points) - 1 else ""
        row = along
        if end == "range":
            row = np.eye(y.size)[int(np.argmin(np.minimum(y[:2], 1.0 - y[:2])))]
        elif end in ("band", "zero_frequency"):
            row = np.array([0.0, 0.0, 1.0])
        reached = corrected(condition, y, row, float(row @ y))
        if reached is None:
            return None
        found.append(_settled(condition, np.where(row == 1.0, y, reached[0]), along))
    if trace.closed:
        found[-1] = found[0]
    missing = None if trace.missing is None else np.delete(trace.missing, turned)
    return _finished(condition, found, trace.ends, missing)


def _finished(
    condition: Condition, points: list[Settled], ends: tuple[str, str], missing: Real | None = None
) -> Trace:
    """Return a curve with the points at which it turns, and so many that its cubics follow it."""
    # An end at the start is that point twice.
    found = [points[0], *(b for a, b in pairwise(points) if (a[0] != b[0]).any())]
    # The points of a band are counted.
    if missing is None:
        _refine(condition, found)
    places, tangents, errors, growth = map(np.array, zip(*found, strict=True))
    trace = Trace(condition, places, tangents, errors, growth, ends, missing=missing)
    for axis in (0, 1):
        _turned(trace, axis)
    trace.steady = is_steady(condition, trace.points)
    return trace


def _settled(condition: Condition, y: Real, way: Real) -> Settled:
    """Return a point of a curve with what `Trace` has of it, the tangent along the way."""
    error = condition.settle(y)
    along = tangent(condition.equations(y)[1])
    return y, along if along @ way >= 0.0 else -along, error, condition.growth(y)


def _refine(condition: Condition, found: list[Settled]) -> None:
    """Put points between those whose cubic may leave the curve, half of the way along it."""
    for _ in range(_HALVINGS):
        bent = [k for k, off in enumerate(_bent(found)) if off > _BENT]
        for k in reversed(bent):
            (a, begin, *_), (b, end, *_) = found[k : k + 2]
            guess = _cubic((a, b), (begin, end), float(np.linalg.norm(b - a)), 0.5)
            between = corrected(condition, guess, b - a, float((b - a) @ guess))
            if between is not None and _inside(condition, between[0]):
                found.insert(k + 1, _settled(condition, between[0], b - a))
        if not bent:
            return


def _bent(found: list[Settled]) -> Real:
    """Return about how far a curve is from the cubic between each point and the next.

    A cubic misses a curve of the fourth derivative d at the part t of its way H by
    ``t^2 (1 - t)^2 H^4 d / 24``, so that the cubic between the neighbours of a point says how far those
    beside the point are from the curve.
    """
    ways = [float(np.linalg.norm(b[0] - a[0])) for a, b in pairwise(found)]
    off = np.zeros(len(ways))
    for k in range(1, len(ways)):
        (a, begin, *_), (middle, along, *_), (b, end, *_) = found[k - 1 : k + 2]
        before, after = ways[k - 1 : k + 1]
        way = before + after
        x, z = (_cubic((a, b), (begin, end), way, before / way) - middle)[:2]
        across = abs(float(along[0] * z - along[1] * x)) / max(float(np.linalg.norm(along[:2])), 1e-300)
        for place, ratio in ((k - 1, before / after), (k, after / before)):
            off[place] = max(off[place], across * ratio**2 / 16.0)
    return off


def _cubic(points: tuple[Real, Real], tangents: tuple[Real, Real], way: float, t: float) -> Real:
    """Return the cubic between two points, with tangents over the way between them, at the part t of it."""
    (a, b), (begin, end) = points, tangents
    s, r = t * t * (3.0 - 2.0 * t), t * (1.0 - t)
    y: Real = a + s * (b - a) + way * r * ((1.0 - t) * begin - t * end)
    return y


def _turned(trace: Trace, axis: int) -> None:
    """Put the points at which a curve turns in u or v among its points."""
    along = trace.tangents[:, axis]
    signs = np.where(np.abs(along) > _STRAIGHT, np.sign(along), 0.0)
    # A point may turn by itself; a straight line does not turn by rounding.
    turns = np.flatnonzero((signs[1:-1] == 0.0) & (signs[:-2] * signs[2:] < 0.0)) + 1
    trace.turns += [(int(k), axis) for k in turns]
    for k in np.flatnonzero(signs[:-1] * signs[1:] < 0.0)[::-1]:
        found = located(trace, int(k), lambda y, along: float(along[axis]))
        if found is None or min(found[3], 1.0 - found[3]) < 1e-9:
            continue
        y, tangent_there, error, _ = found
        tangent_there[axis] = 0.0
        trace.points = np.insert(trace.points, k + 1, y, axis=0)
        trace.tangents = np.insert(trace.tangents, k + 1, tangent_there, axis=0)
        trace.errors = np.insert(trace.errors, k + 1, error)
        trace.growth = np.insert(trace.growth, k + 1, trace.condition.growth(y), axis=0)
        if trace.missing is not None:
            trace.missing = np.insert(trace.missing, k + 1, np.nan)
        trace.turns = [(place + (place > k), which) for place, which in trace.turns]
        trace.turns.append((int(k) + 1, axis))


def hermite(trace: Trace, k: int, t: float) -> Real:
    """Return the cubic between points k and k + 1 at the part t of the way."""
    a, b = trace.points[k : k + 2]
    begin, end = trace.tangents[k : k + 2]
    return _cubic((a, b), (begin, end), float(np.linalg.norm(b - a)), t)


def crossings(trace: Trace, axis: int, place: float, *, exact: bool) -> list[Crossing]:
    """Return where a curve crosses a line along a parameter (`axis`), the other at a place.

    That is on the cubics between its points or, if it has to be `exact`, where the condition holds.
    """
    condition, across = trace.condition, trace.points[:, 1 - axis] - place
    found = []
    for k in np.flatnonzero((across[:-1] < 0.0) != (across[1:] < 0.0)).tolist():
        y = hermite(trace, k, _part(trace, k, 1 - axis, place))
        if exact:
            y = _on_curve(trace, k, 1 - axis, place, y)
        exists = False
        if condition.contact is not None:
            begin, end = trace.steady[k : k + 2]
            exists = bool(begin if begin == end and not exact else is_steady(condition, y[None])[0])
        found.append(
            Crossing(
                condition.kind,
                condition.contact,
                float(y[axis]),
                condition.omega(y),
                _direction(trace, k, axis, y),
                exists,
            )
        )
    return found


def _direction(trace: Trace, k: int, axis: int, y: Real) -> int:
    """Return the sign of growth along an axis at y, between points k and k + 1 of a curve.

    Growth is perpendicular to the curve: its part along an axis vanishes only where the curve turns, which is
    a point of it, and where the gradient does, as at the end of a Hopf curve on a divergence.
    """
    both = trace.growth[k : k + 2]
    parts = both[:, axis] / np.maximum(np.linalg.norm(both, axis=1), 1e-300)
    if parts.min() < -_TURNING and parts.max() > _TURNING:
        return int(np.sign(trace.condition.growth(y)[axis]))
    return int(np.sign(parts.sum()))


def _part(trace: Trace, k: int, axis: int, value: float) -> float:
    """Return the part of the way from point k to k + 1 at which a coordinate of the cubic has a value."""
    (a, b), way = trace.points[k : k + 2, axis], trace.points[k + 1] - trace.points[k]
    length = float(np.linalg.norm(way))
    begin, end = (length * trace.tangents[k : k + 2, axis]).tolist()
    rise, sought = float(b - a), float(value - a)
    low, high, below = 0.0, 1.0, sought > 0.0
    for _ in range(_PARTED):
        t = 0.5 * (low + high)
        at = t * t * (3.0 - 2.0 * t) * rise + t * (1.0 - t) * ((1.0 - t) * begin - t * end)
        if (at < sought) == below:
            low = t
        else:
            high = t
    return 0.5 * (low + high)


def _on_curve(trace: Trace, k: int, axis: int, value: float, guess: Real) -> Real:
    """Return the point between points k and k + 1 of a curve at which a coordinate has a value."""
    trace.condition.settle(trace.points[k])
    found = corrected(trace.condition, guess, np.eye(guess.size)[axis], value)
    ends = trace.points[k : k + 2, 1 - axis]
    slack = 1e-9 + 1e-3 * abs(ends[1] - ends[0])
    if found is None or not ends.min() - slack <= found[0][1 - axis] <= ends.max() + slack:
        return guess
    y: Real = found[0]
    y[axis] = value
    return y


def located(
    trace: Trace, k: int, function: Callable[[Real, Real], float], within: float = 1e-15
) -> tuple[Real, Real, float, float] | None:
    """Return where a function of point and tangent vanishes between points k and k + 1 of a curve.

    That is the point, its tangent, by how much the condition misses, and the part of the way, to an error of
    `within`; None where it has like signs at both ends.
    """
    a, b = trace.points[k : k + 2]
    chord = (b - a) / np.linalg.norm(b - a)
    trace.condition.settle(a)

    def at(t: float) -> tuple[Real, Real, float] | None:
        guess = hermite(trace, k, t)
        found = corrected(trace.condition, guess, chord, float(chord @ guess))
        if found is None:
            return None
        along = tangent(trace.condition.equations(found[0])[1])
        along = along if along @ chord > 0.0 else -along
        return found[0], along, function(found[0], along)

    if function(a, trace.tangents[k]) * function(b, trace.tangents[k + 1]) > 0.0:
        return None

    def value(t: float) -> float:
        if t in (0.0, 1.0):
            return function(trace.points[k + int(t)], trace.tangents[k + int(t)])
        found = at(t)
        if found is None:
            raise _LostError
        return found[2]

    try:
        part = float(brentq(value, 0.0, 1.0, xtol=within, rtol=1e-15, disp=False))
    except _LostError:
        return None
    found = at(part)
    if found is None:
        return None
    return found[0], found[1], trace.condition.settle(found[0]), part
