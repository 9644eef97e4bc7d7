"""Where stability changes along a parameter, and where eigenvalues meet."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from stickslip import _core
from stickslip.faults import InputError, NoSteadyStateError
from stickslip.locus.band.path import BandPath, is_large, wanted_region
from stickslip.locus.criticality import criticality
from stickslip.locus.path import Sliding
from stickslip.locus.points import KINDS, CriticalPoint, CriticalPoints, Kind
from stickslip.modes.complex_modes import complex_modes
from stickslip.scene.checks import Complex, Real, real_number
from stickslip.scene.contact import steady_coefficients
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import divided, interval

#: Growth rates up to this part of |lambda| are rounding, as those of undamped modes.
_NEUTRAL = 1e-8


def critical_points(
    model: Model,
    parameters: Mapping[str, Any],
    *,
    combination: str | None = None,
    kinds: Sequence[Kind] = KINDS,
    proximity: float = 0.1,
    band: Sequence[float] | None = None,
    growth: Sequence[float | None] = (None, None),
) -> CriticalPoints:
    """Return the critical points over a range of one parameter, in ascending order.

    Parameters
    ----------
    model, combination
        As for `sweep`.
    parameters
        Values by name as for `sweep`, one of them a range ``(lower, upper)``.
    kinds
        Which to return of ``hopf``, ``divergence``, ``lock_in``, ``crossing`` and ``separation``. With
        ``("hopf",)`` alone only the modes that may reach the imaginary axis are followed, few of a fine mesh.
    proximity
        How far off the real axis exceptional points are reported: the largest imaginary part of the
        parameter, as a part of its range. With damping that is not proportional lock-in is imperfect, and the
        point at which the two eigenvalues would coalesce is a complex one.
    band, growth
        For a large scene: the modes to follow, as for `sweep`.

    Raises
    ------
    InputError
        If there is not exactly one range, a parameter or kind is unknown, a scene on the way is ill-posed, or
        a slider speed is zero or changes its sign on the way where no combination is given.

    Notes
    -----
    A mesh over the range is refined until every branch can be continued safely, and until the cubics through
    values and slopes at its points leave no room for a root of a real part, or of a difference to the largest
    real part, other than those that the signs at the ends show. Newton's method then refines roots to a few
    ulp of p, with ``d lambda / d p = -v' P_p xi / (v' P_lambda xi)``, and exceptional points by the implicit
    determinant (Spence and Poulton 2005), at complex p if need be. Two roots nearer to each other than 1e-7
    of the range can be missed. Real parts that are zero to rounding over a range, as without damping, do not
    cross: flutter then begins at the lock-in.

    Normal forces in equilibrium are rational functions of the matrices along the path. Their zeros are found
    in the same way as those of real parts, and distinguished from poles (where the stiffness is singular). A
    zero is reported as a separation if every other contact stays closed.

    The points include those at which steady sliding does not exist, with ``steady_sliding`` False. Without
    damping a mode begins to grow at a lock-in, which is no Hopf point; if Hopf points alone are asked for,
    there is none, and a mode grows at one end of the range only, a warning says so. Over an interval of the
    mesh a mode can reach the imaginary axis by its slope, or by meeting another mode near an exceptional
    point, where the square of the difference of the two eigenvalues is linear in the parameter. Where two
    modes meet, Hopf points alone are roots of a function of both together, which is analytic there.
    """
    kinds = _kinds(kinds)
    if not 0.0 <= (proximity := real_number("proximity", proximity)) < np.inf:
        raise InputError(f"proximity: must be >= 0 and finite, got {proximity!r}")
    sliding, name, lower, upper, fixed = _range(model, parameters, combination)
    labels = [str(label) for label in sliding.family.scene({**fixed, name: lower}).contact_labels()]
    hopf_alone = kinds == ("hopf",)

    def search(path: _core.Path) -> list[CriticalPoint]:
        arrays = path.hopf_points() if hopf_alone else path.critical_points(proximity * (upper - lower))
        return [point for point in _points(name, labels, arrays[0]) if point.kind in kinds]

    points = _found(search, sliding, name, lower, upper, fixed, band, growth)
    if hopf_alone and not points and band is None:
        _warn_of_lock_in(sliding, name, (lower, upper), fixed)
    return CriticalPoints(name, points, Family(model).units(name))


def _kinds(kinds: Any) -> tuple[Kind, ...]:
    """Return the kinds of points to look for."""
    listed = (kinds,) if isinstance(kinds, str) or not np.iterable(kinds) else tuple(kinds)
    if isinstance(kinds, str) or not listed or any(one not in KINDS for one in listed):
        raise InputError(f"kinds: expected some of {KINDS}, such as ('hopf',), got {kinds!r}")
    return tuple(dict.fromkeys(listed))


def _found(
    search: Callable[[_core.Path], list[CriticalPoint]],
    sliding: Sliding,
    name: str,
    lower: float,
    upper: float,
    fixed: Mapping[str, float],
    band: Sequence[float] | None,
    growth: Sequence[float | None],
) -> list[CriticalPoint]:
    """Return what a search finds along all modes, or along those of a band."""
    region = wanted_region(band, growth)

    def inside(points: list[CriticalPoint]) -> list[CriticalPoint]:
        if region is None:
            return points
        held = region.holds(np.array([point.eigenvalue for point in points]))
        return [
            point for point, holds in zip(points, held, strict=True) if holds or point.kind == "separation"
        ]

    if region is None or not is_large(sliding, name, lower, fixed):
        return _with_causes(inside(search(sliding.path(name, lower, upper, fixed))), sliding, fixed)
    followed = BandPath(sliding, name, fixed, lower, upper, region)
    points = inside(search(followed.path))
    # With the modes at the points themselves among those that it is made of, the path is exact there.
    followed.take([point.value for point in points if lower < point.value < upper])
    followed.warn()
    return inside(search(followed.path))


def _with_causes(
    points: list[CriticalPoint], sliding: Sliding, fixed: Mapping[str, float]
) -> list[CriticalPoint]:
    """Tell falling friction from mode coupling, and how motions grow from Hopf points."""

    def explained(point: CriticalPoint) -> CriticalPoint:
        if point.kind not in ("hopf", "divergence"):
            return point
        scene = sliding.family.scene({**fixed, point.parameter: point.value})
        letters = sliding.letters(scene)
        if point.kind == "hopf" and (found := criticality(scene, letters, point.eigenvalue)) is not None:
            point = dataclasses.replace(point, criticality=found[0], lyapunov=found[1])
        if not scene.core.has_friction_laws:
            return point
        # By the spectrum with constant friction.
        held = scene.replace(friction=steady_coefficients(scene.contacts), static_friction=None)
        others = complex_modes(held, letters, near=point.eigenvalue, count=1).eigenvalues
        nearest = others[np.abs(others - point.eigenvalue).argmin()]
        cause = "falling friction" if nearest.real < 0.0 else "mode coupling"
        return dataclasses.replace(point, cause=cause)

    return [explained(point) for point in points]


def _range(
    model: Model, parameters: Mapping[str, Any], combination: str | None
) -> tuple[Sliding, str, float, float, dict[str, float]]:
    """Return the family, the name of the one parameter with a range, its ends, the other parameters."""
    ranges, fixed = divided(model, parameters)
    if len(ranges) != 1:
        raise InputError(f"parameters: expected one with a range, got {list(ranges)}")
    ((name, value),) = ranges.items()
    return Sliding(Family(model), combination), name, *interval(name, value), fixed


def _points(
    name: str,
    labels: list[str],
    found: tuple[list[Kind], list[int | None], Complex, Complex, Complex, Real, list[bool]],
) -> list[CriticalPoint]:
    return [
        CriticalPoint(
            kind=kind,
            parameter=name,
            value=float(place.real),
            complex_value=complex(place),
            eigenvalue=complex(eigenvalue),
            other=complex(other) if kind == "crossing" else None,
            slope=float(slope) if kind in ("hopf", "crossing") else None,
            direction=int(np.sign(slope)) if kind in ("hopf", "divergence", "separation") else 0,
            steady_sliding=steady,
            contact=contact,
            name=None if contact is None else labels[contact],
        )
        for kind, contact, place, eigenvalue, other, slope, steady in zip(*found, strict=True)
    ]


def _warn_of_lock_in(
    sliding: Sliding, name: str, ends: tuple[float, float], fixed: Mapping[str, float]
) -> None:
    """Warn where the modes grow at one end of the range and not at the other, without a Hopf point."""

    def grows(value: float) -> bool:
        scene = sliding.family.scene({**fixed, name: value})
        try:
            eigenvalues = complex_modes(scene, sliding.letters(scene)).eigenvalues
        except NoSteadyStateError:
            return False
        return bool((eigenvalues.real > _NEUTRAL * np.abs(eigenvalues)).any())

    growing = [value for value in ends if grows(value)]
    if len(growing) == 1:
        warnings.warn(
            f"critical_points: no Hopf point, yet a mode grows at {name} = {growing[0]:g}: its growth begins "
            "at a lock-in, as without damping, or at a divergence; ask for these kinds as well",
            stacklevel=3,
        )
