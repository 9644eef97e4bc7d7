"""Points at which curves meet, end or turn: two conditions hold at once.

They are found where a second function changes its sign between two points of a curve, and refined by Newton's
method for both conditions together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from stickslip.locus.boundary.conditions import (
    Condition,
    Divergence,
    Hopf,
    Separation,
    eigenvalues,
    growing,
    margins,
)
from stickslip.locus.boundary.curves import PointKind
from stickslip.locus.boundary.plane import Plane
from stickslip.locus.boundary.tracing import Trace, hermite, located
from stickslip.scene.checks import Complex, Index, Real

#: Distance, of the ranges, up to which two points of one kind are the same.
SAME = 1e-7
#: Parts of the way between two points of a curve up to which a sign change is located on its cubic, and on
#: the curve itself, where Newton's method for both conditions goes on.
_ON_CUBIC, _ON_CURVE = 1e-3, 1e-8
#: Imaginary part of an eigenvalue below this part of the frequency is taken to vanish.
_ZERO = 1e-6
#: Distance of two eigenvalues, of the frequency, up to which they are a double one with its rounding.
_TWINS = 1e-7
#: By how much, of the way, a point may pass the ends of a curve, and how far it may be from its cubic.
_ENDS, _OFF = 1e-9, 1e-2


@dataclass(frozen=True)
class Meeting:
    """A point at which two conditions hold: `kind` as in `CodimensionTwo`, frequencies in rad/s."""

    kind: PointKind
    place: Real
    omegas: tuple[float, ...]
    contact: int | None = None
    #: axis in which a curve turns
    axis: int | None = None


def others(trace: Trace, points: Real) -> list[Complex]:
    """Return what counts of the eigenvalues at points of a curve, by real parts, but its own on the axis."""
    plane, condition = trace.condition.plane, trace.condition
    found = []
    for y, values in zip(points, eigenvalues(plane, points), strict=True):
        own: tuple[complex, ...] = ()
        if isinstance(condition, Hopf):
            own = (1j * condition.omega(y), -1j * condition.omega(y))
        elif isinstance(condition, Divergence):
            own = (0.0j,)
        rest = values
        for value in own:
            rest = np.delete(rest, np.abs(rest - value).argmin())
        rest = plane.seen(rest)
        found.append(rest[np.argsort(-rest.real)])
    return found


def meetings(trace: Trace, along: list[Complex], steady: Index) -> list[Meeting]:
    """Return the points of a curve at which something else holds as well.

    `along` is what `others` gives at the points of the curve, `steady` are the contacts whose margins matter:
    those that may separate.
    """
    plane, condition = trace.condition.plane, trace.condition
    found = [
        Meeting("degenerate", trace.points[place, :2], _omegas(condition, trace.points[place]), None, axis)
        for place, axis in trace.turns
    ]
    if not isinstance(condition, Hopf):
        return found
    for place, end in ((0, trace.ends[0]), (-1, trace.ends[1])):
        if end == "zero_frequency":
            found.append(Meeting("zero_frequency", trace.points[place, :2], (0.0,)))
    counts = [growing(values) for values in along]
    pairs = [growing(values[values.imag > 0.0]) for values in along]
    signs = _determinants(plane, trace.points)[0]
    for k, (ends, product) in enumerate(zip(pairwise(counts), signs[:-1] * signs[1:], strict=True)):
        if product < 0.0:
            found += _zero_eigenvalue(trace, k)
            if abs(ends[0] - ends[1]) == 1 and pairs[k] == pairs[k + 1]:
                # Nothing else changes.
                continue
        # Of a pair one, as the other grows or decays with it. A real eigenvalue may be of a pair further on.
        more = k + int(np.argmax(ends))
        imaginary = along[more].imag
        counted = imaginary >= 0.0 if product > 0.0 else imaginary > 0.0
        # Where damping vanishes, a Hopf curve ends at a lock-in, and its own eigenvalue is a double one.
        omega = condition.omega(trace.points[more])
        counted &= np.abs(along[more] - 1j * omega) > _TWINS * omega
        ranks = [rank for rank in range(min(ends), max(ends)) if counted[rank]]
        found += [one for rank in ranks for one in _second_pair(trace, k, rank)]
    # A margin changes its sign at a pole, too, but not its product with the determinant that vanishes there.
    forces = signs[:, None] * _relative(plane, trace.points)
    for contact in steady:
        changes = np.flatnonzero(forces[:-1, contact] * forces[1:, contact] < 0.0)
        found += [one for k in changes for one in _separation(trace, int(k), int(contact))]
    return found


def _zero_eigenvalue(trace: Trace, k: int) -> list[Meeting]:
    """Return where a real eigenvalue vanishes between two points of a Hopf curve."""
    plane = trace.condition.plane
    unit = _determinants(plane, trace.points[k : k + 2])[1].max()

    def determinants(points: Real) -> Real:
        signs, logarithms = _determinants(plane, points)
        scaled: Real = signs * np.exp(logarithms - unit)
        return scaled

    found = _joined(trace, k, determinants, lambda y: Divergence(plane, y[:2]))
    if found is None:
        return []
    own = found[0][0]
    return [Meeting("zero_hopf", own[:2], (0.0, *_omegas(trace.condition, own)))]


def _determinants(plane: Plane, points: Real) -> tuple[Real, Real]:
    """Return signs of the determinant of the stiffness at points, and logarithms of its modulus, (n,)."""
    signs, logarithms = np.linalg.slogdet(np.stack([plane.at(*y[:2]).stiffness[0] for y in points]))
    return signs, logarithms


def _second_pair(trace: Trace, k: int, rank: int) -> list[Meeting]:
    """Return where the real part of the eigenvalue of a rank vanishes between two points of a Hopf curve.

    The eigenvalue is one of a pair there.
    """
    condition = trace.condition

    def second(y: Real) -> Condition | None:
        (values,) = others(trace, y[None])
        if rank >= values.size or abs(values[rank].imag) <= _ZERO * condition.omega(y):
            return None
        return Hopf(condition.plane, y[:2], abs(values[rank].imag))

    def real_parts(points: Real) -> Real:
        # An eigenvalue that has left the band does not grow in it.
        return np.array([-1.0 if rank >= one.size else one[rank].real for one in others(trace, points)])

    found = _joined(trace, k, real_parts, second)
    if found is None:
        return []
    (own, other), met = found
    return [Meeting("double_hopf", own[:2], tuple(sorted(_omegas(condition, own) + _omegas(met, other))))]


def _separation(trace: Trace, k: int, contact: int) -> list[Meeting]:
    """Return where a margin vanishes between two points of a Hopf curve."""
    plane = trace.condition.plane

    def numerators(points: Real) -> Real:
        numerator: Real = _determinants(plane, points)[0] * _relative(plane, points)[:, contact]
        return numerator

    found = _joined(trace, k, numerators, lambda y: Separation(plane, y[:2], contact))
    if found is None:
        return []
    own = found[0][0]
    return [Meeting("separation", own[:2], _omegas(trace.condition, own), contact)]


def _joined(
    trace: Trace, k: int, function: Callable[[Real], Real], second: Callable[[Real], Condition | None]
) -> tuple[list[Real], Condition] | None:
    """Return where a second condition holds between points k and k + 1 of a curve, and that condition.

    `function` of points (n,) changes its sign there, and `second` is the condition near a point, if any.
    Newton's method for both starts where the function would vanish if it were linear and, where that does not
    lead to a point between the two, nearer to where it vanishes.
    """
    trace.condition.settle(trace.points[k])
    for y in _starts(trace, k, function):
        if (met := second(y)) is not None:
            found = _joint([trace.condition, met], [y, met.start])
            if found is not None and _is_between(trace, k, found[0]) and not _vanishes(met, found[1]):
                return found, met
    return None


def _starts(trace: Trace, k: int, function: Callable[[Real], Real]) -> Iterator[Real]:
    """Yield points between points k and k + 1 of a curve, each nearer to a zero of a function of points."""
    ends = function(trace.points[k : k + 2])
    product = ends[0] * ends[1]
    yield hermite(trace, k, float(ends[0] / (ends[0] - ends[1])) if product < 0.0 else 0.5)
    if product > 0.0:
        return

    def on_cubic(part: float) -> float:
        return float(ends[int(part)] if part in (0.0, 1.0) else function(hermite(trace, k, part)[None])[0])

    yield hermite(trace, k, float(brentq(on_cubic, 0.0, 1.0, xtol=_ON_CUBIC)))
    found = located(trace, k, lambda y, along: float(function(y[None])[0]), _ON_CURVE)
    if found is not None:
        yield found[0]


def _vanishes(condition: Condition, y: Real) -> bool:
    """Return whether the frequency of a Hopf point is zero, where a divergence looks like one."""
    return isinstance(condition, Hopf) and abs(y[2]) <= _ZERO


def _is_between(trace: Trace, k: int, y: Real) -> bool:
    """Return whether a point lies on a curve between its points k and k + 1."""
    a, b = trace.points[k : k + 2]
    part = float((y - a) @ (b - a) / ((b - a) @ (b - a)))
    off = float(np.abs(y - hermite(trace, k, part)).max())
    return -_ENDS <= part <= 1.0 + _ENDS and off <= _ENDS + _OFF * float(np.linalg.norm(b - a))


def _relative(plane: Plane, points: Real) -> Real:
    """Return the margins at points, of the sizes of their terms, (n, c)."""
    values, sizes = margins(plane, points)
    relative: Real = values[:, 0] / sizes
    return relative


def _omegas(condition: Condition, y: Real) -> tuple[float, ...]:
    return (condition.omega(y),) if isinstance(condition, Hopf) else ()


def _joint(conditions: list[Condition], starts: list[Real]) -> list[Real] | None:
    """Return the unknowns of two conditions that hold at one point, by Newton's method from near it."""
    sizes = [start.size - 2 for start in starts]
    y = np.concatenate([starts[0][:2], *(start[2:] for start in starts)])

    def parts(y: Real) -> list[Real]:
        own, at = [], 2
        for size in sizes:
            own.append(np.concatenate([y[:2], y[at : at + size]]))
            at += size
        return own

    length = np.inf
    for _ in range(8):
        residuals, rows, at = [], [], 2
        for condition, own, size in zip(conditions, parts(y), sizes, strict=True):
            residual, slopes = condition.equations(own)
            row = np.zeros((len(residual), y.size))
            row[:, :2], row[:, at : at + size] = slopes[:, :2], slopes[:, 2:]
            at += size
            residuals.append(residual)
            rows.append(row)
        try:
            step = np.linalg.solve(np.vstack(rows), -np.concatenate(residuals))
        except np.linalg.LinAlgError:
            return None
        y, length = y + step, float(np.abs(step).max())
        if length <= 1e-13:
            break
        if not length <= 1.0:
            # It leaves the ranges.
            return None
    return parts(y) if length <= 1e-9 else None


def without_repetitions(found: list[Meeting]) -> list[Meeting]:
    """Return meetings each once: a point at which two curves cross is found on both."""
    kept: list[Meeting] = []
    for one in found:
        if not any(
            (one.kind, one.contact, one.axis) == (other.kind, other.contact, other.axis)
            and np.abs(one.place - other.place).max() <= SAME
            for other in kept
        ):
            kept.append(one)
    return kept
