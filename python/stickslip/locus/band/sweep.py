"""Branches of the modes of a band along a projected path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.optimize
from threadpoolctl import threadpool_limits

from stickslip import _core
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Complex, Real

#: Correlation of a mode and its continuation from which the two are joined without more points between.
_DECISIVE = 0.8
#: Halvings of an interval after which labels are a convention.
_HALVINGS = 5
#: Condition from which an eigenvalue counts as defective, as of all modes (core).
_DEFECTIVE = 3.4e6
#: Relative error of an eigenvalue of a projected pencil, times its condition: growth within it is zero.
_ERROR = 1e-9
#: What a point takes of `Path.sweep`.
_NAMES = ("eigenvalue", "right", "left", "a", "slope", "condition")


@dataclass(frozen=True)
class _Point:
    """All eigenvalues of the projected pencil at one value; vectors with ``v' P'(lambda) x = 1``, or nan."""

    value: float
    eigenvalues: Complex
    right: Complex
    left: Complex
    mass: Real
    damping: Real
    slope: Complex
    condition: Real

    @classmethod
    def of(cls, path: _core.Path, value: float) -> _Point:
        mass, damping = path.matrices(value)[:2]
        found = {
            name: part[0] for name, part in path.sweep(np.array([value]), True).items() if name in _NAMES
        }
        with np.errstate(all="ignore"):
            left = found["left"] / found["a"]
        values, right = found["eigenvalue"], found["right"]
        return cls(value, values, right, left, mass, damping, found["slope"], found["condition"])

    def ordered(self, order: Any) -> _Point:
        """Return the point with its modes in another order."""
        names = ("eigenvalues", "right", "left", "slope", "condition")
        return replace(self, **{name: getattr(self, name)[..., order] for name in names})

    def correlation(self, other: _Point) -> Real:
        """Return ``|v_r' ((lambda_r + lambda_s) M + C) x_s|``, 1 for a mode and its continuation."""
        both = [
            first.left.T @ (first.mass @ second.right) * second.eigenvalues
            + (first.left.T * first.eigenvalues[:, None]) @ (first.mass @ second.right)
            + first.left.T @ (first.damping @ second.right)
            for first, second in ((self, other), (other, self))
        ]
        with np.errstate(invalid="ignore"):
            # The lengths of vectors cancel.
            correlation: Real = np.sqrt(np.abs(both[0] * both[1].T))
        return np.nan_to_num(correlation, nan=0.0, posinf=0.0)


def swept_band(path: _core.Path, values: Real, region: Region) -> dict[str, Any]:
    """Return what `Path.sweep` does at ascending values, of branches that are inside at any of them.

    That itself follows every eigenvalue of the projection, also those far outside that stand for no mode of
    the scene: of a mesh of 104 coordinates it takes 24 s where this takes 2 s.
    """
    first = _Point.of(path, float(values[0]))
    upper = np.argsort(np.abs(first.eigenvalues), kind="stable")
    points, meetings = [first.ordered(upper)], list[float]()
    # Matrices of some hundred rows: more threads take longer wherever anything else runs.
    with threadpool_limits(1, user_api="blas"):
        for value in values[1:]:
            points.append(_joined(path, points[-1], float(value), region, meetings, _HALVINGS))
    eigenvalues = np.array([point.eigenvalues for point in points])
    inside = region.holds(eigenvalues).any(axis=0)
    condition = np.array([point.condition for point in points])[:, inside]
    eigenvalues = eigenvalues[:, inside]
    unstable = _grow(eigenvalues, condition)
    verdict = path.growth(values)
    return {
        "eigenvalue": eigenvalues,
        "slope": np.array([point.slope for point in points])[:, inside],
        "condition": condition,
        "defective": condition > _DEFECTIVE,
        "unstable": unstable,
        "stable": ~unstable.any(axis=1),
        "steady_sliding": verdict["steady_sliding"],
        "normal_force": verdict["normal_force"],
        "meetings": np.array(meetings),
    }


def band_verdicts(path: _core.Path, values: Real, region: Region) -> dict[str, Any]:
    """Return what `Path.growth` does at values, of the modes of a region; nan where it has none."""
    verdict = path.growth(values)
    eigenvalue = np.full(values.size, complex(np.nan, np.nan))
    unstable = np.zeros(values.size, dtype=int)
    with threadpool_limits(1, user_api="blas"):
        for k, value in enumerate(values):
            point = _Point.of(path, float(value))
            inside = region.holds(point.eigenvalues) & (point.eigenvalues.imag >= 0.0)
            found = point.eigenvalues[inside]
            if found.size:
                eigenvalue[k] = found[np.argmax(found.real)]
                unstable[k] = np.count_nonzero(_grow(found, point.condition[inside]))
    return {**verdict, "eigenvalue": eigenvalue, "unstable_modes": unstable}


def _grow(eigenvalues: Complex, condition: Real) -> Any:
    return eigenvalues.real > _ERROR * np.minimum(condition, _DEFECTIVE) * np.abs(eigenvalues)


def _joined(
    path: _core.Path, before: _Point, value: float, region: Region, meetings: list[float], halvings: int
) -> _Point:
    """Return the point at a value in the order of the one before."""
    point = _Point.of(path, value)
    correlation = before.correlation(point)
    rows, order = scipy.optimize.linear_sum_assignment(-np.minimum(correlation, 1.0))
    followed = region.holds(before.eigenvalues) | region.holds(point.eigenvalues[order])
    if (correlation[rows, order][followed] >= _DECISIVE).all():
        return point.ordered(order)
    middle = 0.5 * (before.value + value)
    if halvings == 0 or not before.value < middle < value:
        meetings.append(middle)
        return point.ordered(order)
    between = _joined(path, before, middle, region, meetings, halvings - 1)
    return _joined(path, between, value, region, meetings, halvings - 1)
