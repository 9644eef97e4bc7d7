"""Where stability changes along a parameter, and where eigenvalues meet."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from stickslip import _core
from stickslip.faults import InputError, NoSteadySlidingError, NoSteadyStateError
from stickslip.locus.asked import asked, divided, interval
from stickslip.locus.band.path import BandPath, is_large, wanted_region
from stickslip.locus.path import Sliding
from stickslip.modes.complex_modes import complex_modes
from stickslip.scene.checks import Complex, Real, real_number
from stickslip.scene.family import Family, Model

#: Growth rates up to this part of |lambda| are rounding, as those of undamped modes.
_NEUTRAL = 1e-8

Kind = Literal["hopf", "divergence", "lock_in", "crossing", "separation"]


@dataclass(frozen=True)
class CriticalPoint:
    """A parameter value at which the spectrum changes its kind.

    Attributes
    ----------
    kind
        ``hopf``: a complex pair crosses the imaginary axis; ``divergence``: a real eigenvalue crosses zero;
        ``lock_in``: two eigenvalues and their vectors coalesce (exceptional point); ``crossing``: the largest
        real part passes from one branch to another; ``separation``: steady sliding begins or ends, because
        the normal force of a contact vanishes (or the gap of an open one).
    parameter
        Its name.
    value
        Its value; at a complex exceptional point the real part, near which the two branches come closest.
    complex_value
        Its value with the imaginary part.
    eigenvalue
        lambda at the point, 1/s; at a crossing that of the branch that leads beyond it; nan at a separation.
    other
        At a crossing the eigenvalue of the branch that has led before it; None elsewhere.
    slope
        At a Hopf point d Re(lambda) / d parameter. At a crossing the slope of the branch that takes the lead
        less the slope of the branch that loses it. None elsewhere.
    direction
        +1 where an eigenvalue becomes unstable as the parameter grows, -1 where one becomes stable, 0 for a
        lock-in or a crossing; at a separation +1 where the contact opens as the parameter grows, -1 where it
        closes.
    steady_sliding
        Whether steady sliding of the combination exists at the value (`sweep`); if it does not, only the
        linear system has the point. True at a separation.
    contact
        The index of the contact that a separation opens or closes; None elsewhere.
    name
        The name of that contact, its index where contacts have no names; None elsewhere.
    cause
        Cause of a Hopf point or divergence if friction depends on slip speed: ``falling friction`` if the
        eigenvalue would be stable with the friction of steady sliding held constant, ``mode coupling`` if it
        would not. None elsewhere.
    """

    kind: Kind
    parameter: str
    value: float
    complex_value: complex
    eigenvalue: complex
    other: complex | None
    slope: float | None
    direction: int
    steady_sliding: bool = True
    contact: int | None = None
    name: str | None = None
    cause: str | None = None

    @property
    def frequency(self) -> float:
        """``|lambda| / (2 pi)``, Hz."""
        return float(abs(self.eigenvalue) / (2.0 * np.pi))

    @property
    def remark(self) -> str:
        """What happens there as the parameter grows, in words."""
        if self.kind == "separation":
            return f"contact {self.name} {'opens' if self.direction > 0 else 'closes'}"
        toward = {1: "destabilising", -1: "stabilising", 0: ""}[self.direction]
        return ", ".join(
            filter(None, [toward, self.cause, "" if self.steady_sliding else "no steady sliding there"])
        )

    def __repr__(self) -> str:
        place = f"{self.value:.14g}"
        if self.complex_value.imag:
            place += f" {self.complex_value.imag:+.3g}j"
        line = "" if self.kind == "separation" else f"{self.frequency:.4f} Hz"
        remarks = ", ".join(filter(None, [line, self.remark]))
        return f"CriticalPoint({self.kind} at {self.parameter} = {place}, {remarks})"


def critical_points(
    model: Model,
    combination: str | None = None,
    *,
    over: Mapping[str, Any] | None = None,
    proximity: float = 0.1,
    band: Sequence[float] | None = None,
    growth: Sequence[float | None] = (None, None),
    **parameters: Any,
) -> list[CriticalPoint]:
    """Return all critical points over a range of one parameter, in ascending order.

    Parameters
    ----------
    model, combination
        As for `sweep`.
    over
        Parameters by name as for `sweep`, one of them with a range ``(lower, upper)``.
    proximity
        How far off the real axis exceptional points are reported: the largest imaginary part of the
        parameter, as a part of its range. With damping that is not proportional lock-in is imperfect, and the
        point at which the two eigenvalues would coalesce is a complex one.
    band, growth
        For a large scene: the modes to follow, as for `sweep`.
    **parameters
        The same as keywords; refused where the model has a parameter that is named as an option here.

    Raises
    ------
    InputError
        If there is not exactly one range, a parameter is unknown, a scene on the way is ill-posed, or a
        slider speed is zero or changes its sign on the way where no combination is given.

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
    """
    if not 0.0 <= (proximity := real_number("proximity", proximity)) < np.inf:
        raise InputError(f"proximity: must be >= 0 and finite, got {proximity!r}")
    sliding, name, lower, upper, fixed = _range(critical_points, model, combination, over, parameters)
    labels = [str(label) for label in sliding.family.scene({**fixed, name: lower}).contact_labels()]

    def search(path: _core.Path) -> list[CriticalPoint]:
        return _points(name, labels, path.critical_points(proximity * (upper - lower))[0])

    return _found(search, sliding, name, lower, upper, fixed, band, growth)


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
    if region is None:
        return _with_causes(search(sliding.path(name, lower, upper, fixed)), sliding, fixed)

    def inside(points: list[CriticalPoint]) -> list[CriticalPoint]:
        return [
            point
            for point in points
            if point.kind == "separation" or region.holds(np.array([point.eigenvalue]))[0]
        ]

    if not is_large(sliding, name, lower, fixed):
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
    """Tell falling friction from mode coupling, by the spectrum with constant friction."""

    def cause(point: CriticalPoint) -> str | None:
        scene = sliding.family.scene({**fixed, point.parameter: point.value})
        if point.kind not in ("hopf", "divergence") or not scene.core.has_friction_laws:
            return None
        held = scene.replace(
            friction=[contact.coefficient() for contact in scene.contacts], static_friction=None
        )
        others = complex_modes(held, sliding.letters(scene), near=point.eigenvalue, count=1).eigenvalues
        nearest = others[np.abs(others - point.eigenvalue).argmin()]
        return "falling friction" if nearest.real < 0.0 else "mode coupling"

    return [dataclasses.replace(point, cause=cause(point)) for point in points]


def _range(
    call: Callable[..., Any],
    model: Model,
    combination: str | None,
    over: Mapping[str, Any] | None,
    parameters: dict[str, Any],
) -> tuple[Sliding, str, float, float, dict[str, float]]:
    """Return the family, the name of the one parameter with a range, its ends, the other parameters."""
    ranges, fixed = divided(asked(call, model, over, parameters))
    if len(ranges) != 1:
        raise InputError(f"{call.__name__}: expected one parameter with a range, got {list(ranges)}")
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


def hopf_points(
    model: Model,
    combination: str | None = None,
    *,
    over: Mapping[str, Any] | None = None,
    band: Sequence[float] | None = None,
    growth: Sequence[float | None] = (None, None),
    **parameters: Any,
) -> list[CriticalPoint]:
    """Return the Hopf points over a range of one parameter, in ascending order.

    The list includes points at which steady sliding does not exist, with ``steady_sliding`` False. Without
    damping a mode begins to grow at a lock-in, which is no Hopf point; if there is no Hopf point and a mode
    grows at one end of the range only, a warning says so.

    Parameters
    ----------
    model, combination, over, band, growth, **parameters
        As for `critical_points`.

    Raises
    ------
    InputError
        As `critical_points`.

    Notes
    -----
    Only the modes that may reach the imaginary axis are followed. Over an interval of the mesh a mode can
    reach it by its slope, or by meeting another mode near an exceptional point, where the square of the
    difference of the two eigenvalues is linear in the parameter. All others, which are most modes of a fine
    mesh, need not be followed. The limits of `critical_points` hold here as well.
    """
    sliding, name, lower, upper, fixed = _range(hopf_points, model, combination, over, parameters)
    labels = [str(label) for label in sliding.family.scene({**fixed, name: lower}).contact_labels()]
    points = _found(
        lambda path: _points(name, labels, path.hopf_points()[0]),
        sliding,
        name,
        lower,
        upper,
        fixed,
        band,
        growth,
    )
    if not points and band is None:
        _warn_of_lock_in(sliding, name, (lower, upper), fixed)
    return points


def _warn_of_lock_in(
    sliding: Sliding, name: str, ends: tuple[float, float], fixed: Mapping[str, float]
) -> None:
    """Warn where the modes grow at one end of the range and not at the other, without a Hopf point."""

    def grows(value: float) -> bool:
        scene = sliding.family.scene({**fixed, name: value})
        try:
            eigenvalues = complex_modes(scene, sliding.letters(scene)).eigenvalues
        except (NoSteadySlidingError, NoSteadyStateError):
            return False
        return bool((eigenvalues.real > _NEUTRAL * np.abs(eigenvalues)).any())

    growing = [value for value in ends if grows(value)]
    if len(growing) == 1:
        warnings.warn(
            f"hopf_points: no Hopf point, yet a mode grows at {name} = {growing[0]:g}: its growth begins "
            "at a lock-in, as without damping, or at a divergence; critical_points returns these",
            stacklevel=3,
        )
