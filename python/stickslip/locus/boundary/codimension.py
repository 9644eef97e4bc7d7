"""Points at which curves meet, end or turn: two conditions hold at once.

They are found where a second function changes its sign between two points of a curve, and refined by Newton's
method for both conditions together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
from stickslip.locus.boundary.tracing import Trace, located
from stickslip.scene.checks import Complex, Index, Real

#: Distance, of the ranges, up to which two points of one kind are the same.
SAME = 1e-7
#: Part of the way between two points of a curve from which Newton's method goes on for both conditions.
_NEAR = 1e-8
#: Real part of an eigenvalue below this part of its modulus is taken to vanish.
_ZERO = 1e-6


@dataclass(frozen=True)
class Meeting:
    """A point at which two conditions hold: `kind` as in `CodimensionTwo`, frequencies in rad/s."""

    kind: PointKind
    place: Real
    omegas: tuple[float, ...]
    contact: int | None = None
    #: axis in which a curve turns
    axis: int | None = None


def others(trace: Trace, y: Real) -> Complex:
    """Return what counts of the eigenvalues at a point of a curve, by real parts, but its own on the axis."""
    plane = trace.condition.plane
    found = eigenvalues(plane, y)
    own: tuple[complex, ...] = ()
    if isinstance(trace.condition, Hopf):
        omega = trace.condition.omega(y)
        own = (1j * omega, -1j * omega)
    elif isinstance(trace.condition, Divergence):
        own = (0.0j,)
    for value in own:
        found = np.delete(found, np.abs(found - value).argmin())
    found = plane.seen(found)
    return found[np.argsort(-found.real)]


def meetings(trace: Trace, steady: Index) -> list[Meeting]:
    """Return the points of a curve at which something else holds as well.

    `steady` are the contacts whose margins matter: those that may separate.
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
    along = [others(trace, y) for y in trace.points]
    counts = [growing(values) for values in along]
    for k in range(len(counts) - 1):
        low, high = sorted((counts[k], counts[k + 1]))
        found += [one for rank in range(low, high) for one in _second_eigenvalue(trace, k, rank)]
    forces = np.array([_relative(plane, y) for y in trace.points])
    for contact in steady:
        changes = np.flatnonzero(forces[:-1, contact] * forces[1:, contact] < 0.0)
        found += [one for k in changes for one in _separation(trace, int(k), int(contact))]
    return found


def _second_eigenvalue(trace: Trace, k: int, rank: int) -> list[Meeting]:
    """Return where the real part of the eigenvalue of a rank vanishes between two points of a Hopf curve."""
    condition = trace.condition
    assert isinstance(condition, Hopf)

    def real_part(y: Real, along: Real) -> float:
        return float(others(trace, y)[rank].real)

    found = located(trace, k, real_part, _NEAR)
    if found is None:
        return []
    y = found[0]
    value = others(trace, y)[rank]
    omega = condition.omega(y)
    kind: PointKind = "double_hopf"
    if abs(value.imag) <= _ZERO * omega:
        second: Condition = Divergence(condition.plane, y[:2])
        kind = "zero_hopf"
    elif abs(value.real) > _ZERO * abs(value):
        return []
    else:
        second = Hopf(condition.plane, y[:2], abs(value.imag))
    refined = _joint([condition, second], [y, second.start])
    if refined is None:
        return []
    frequencies = sorted(_omegas(condition, refined[0]) + (_omegas(second, refined[1]) or (0.0,)))
    return [Meeting(kind, refined[0][:2], tuple(frequencies))]


def _separation(trace: Trace, k: int, contact: int) -> list[Meeting]:
    """Return where a margin vanishes between two points of a Hopf curve."""
    plane = trace.condition.plane
    found = located(trace, k, lambda y, along: float(_relative(plane, y)[contact]), _NEAR)
    if found is None or abs(_relative(plane, found[0])[contact]) > _ZERO:
        return []
    second = Separation(plane, found[0][:2], contact)
    refined = _joint([trace.condition, second], [found[0], second.start])
    if refined is None:
        return []
    return [Meeting("separation", refined[0][:2], _omegas(trace.condition, refined[0]), contact)]


def _relative(plane: Plane, y: Real) -> Real:
    """Return the margins at a point, of the sizes of their terms."""
    values, sizes = margins(plane, y)
    relative: Real = values[0] / sizes
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

    step = np.full(y.size, np.inf)
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
        y = y + step
        if np.abs(step).max() <= 1e-13:
            break
    return parts(y) if np.abs(step).max() <= 1e-9 else None


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
