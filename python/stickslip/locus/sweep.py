"""Eigenvalues over one or two parameters, as continuous branches."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy.optimize
import xarray as xr

from stickslip.faults import InputError
from stickslip.locus.band.path import BandPath, is_large, wanted_region
from stickslip.locus.band.sweep import swept_band
from stickslip.locus.path import Sliding
from stickslip.locus.sensitivity import is_defined
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Complex, Flags, Real, check_memory, whole_number
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import apart, axis, divided
from stickslip.show.progress import LONG, watched

#: Decay of an eigenvalue, of its modulus, up to which its rounding is asked for.
_NEARLY = 1e-6
#: What a sweep tells of a point, not of its branches.
_POINTWISE = ("stable", "steady_sliding", "normal_force")


def sweep(
    model: Model,
    parameters: Mapping[str, Any],
    *,
    combination: str | None = None,
    vectors: bool = False,
    modes: int | None = None,
    progress: bool | None = None,
    band: Sequence[float] | None = None,
    growth: Sequence[float | None] = (None, None),
    marginal: bool = False,
) -> xr.Dataset:
    """Return the eigenvalues over one or two parameters, with branches tracked.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one, such as ``ss.models.two_subsystems``.
    parameters
        Values by name, one or two of them an array (k,) of distinct values, the rest a number. Names: a field
        of the contacts (``friction``, ``slider_speed``, ``gap``, ...), or of one contact (``friction_0``, or
        ``friction_left`` if it has a name); a number of a law of friction (``friction_kinetic``) or of a load
        (``shaker_amplitude``, ``load_0_frequency``); ``damping_mass`` (1/s) and ``damping_stiffness`` (s) of
        `Rayleigh` damping; ``mass``, ``stiffness``, ``damping``, ``gyroscopic``, ``circulatory`` and
        ``force``, each a factor on what the scene has. Of a function first its keywords that take a number,
        and entries of those that take an array (``vertical_stiffness_1``).
    combination
        One letter of ``+ - s d`` per contact; None: that of steady sliding, in which each slider speed gives
        the sign of its contact.
    vectors
        Whether to keep the left and right vectors of every point.
    modes
        Number of modes to follow, over one parameter: those that have the largest real parts at any of the
        values. A conjugate pair at the first value counts as one, a real eigenvalue too. None: all modes.
    progress
        Whether to show a progress bar on standard error; None: on a terminal, when it takes some seconds.
        With `modes` it counts eigenproblems, of as many as there may be.
    band, growth
        For a large scene, over one parameter: frequencies in Hz and growth rates in 1/s as for
        `complex_modes`. The result has the branches that are inside at any of the values.
    marginal
        Whether to say where a mode neither grows nor decays; this computes the modes again wherever an
        eigenvalue lies near the imaginary axis.

    Returns
    -------
    xarray.Dataset
        Over the parameters and ``branch`` (one per eigenvalue, or those of `modes`): ``eigenvalue`` (1/s),
        ``frequency`` (``|lambda| / 2 pi``, Hz), ``damping_ratio``, ``unstable``, ``derivative`` of the
        eigenvalue to the last parameter (nan near a coalescence, where it is not defined), ``condition``,
        ``defective``; over the parameters ``stable`` and ``steady_sliding``: whether the contacts slide
        steadily in this combination, each slipping as its slider drives it and none pulling (nor penetrating,
        if open). Where they do not, eigenvalues say nothing about steady sliding. ``normal_force`` of the
        contacts closed in equilibrium, N, over the parameters and ``contact``; nan where a contact sticks or
        the stiffness is singular. With `marginal`, ``marginal`` over the parameters: whether sliding is
        stable and a growth rate zero within its rounding (`Modes.marginal`). With `vectors`,
        ``right`` and ``left`` (displacement parts xi and v over ``coordinate``;
        state vectors are (xi, lambda xi) and (v, lambda v)) and ``a = left' A right``; where a mode is
        defective ``left`` and ``a`` are nan. The attribute ``meetings`` lists parameter values at which
        branches meet, so that their labels beyond are a convention. A variable that is named as a parameter
        has ``computed_`` before its name. With `band` the attributes ``missing``,
        the numbers of eigenvalues of the band that were not found at the lowest and the highest value, and
        ``doubts``, what could not be settled.

    Raises
    ------
    InputError
        If a parameter is unknown, values repeat or are not finite, a scene on the way is ill-posed, or a
        slider
        speed is zero or changes its sign on the way where no combination is given: no branch leads from one
        direction of sliding to the other.

    Notes
    -----
    Neighbouring points are joined by the correlation ``v_r' ((lambda_r + lambda_s) M + C) xi_s`` of their
    left and right vectors, with as many points between them as it takes (core, `branches`). Branches of two
    parameters are continuous along the last one and, at its first value, along the first one: around an
    exceptional point no labels are continuous everywhere. With `modes`, points are added until the
    correlation alone decides for the followed modes, at most three between two values; ``meetings`` lists
    the values at which it does not. Where two modes veer more sharply than the points resolve, each branch
    keeps the shape of its mode. ``stable`` takes all modes into account, with `band` those of the band.

    With `band` the modes of the band are computed at both ends, where they are counted (`Modes.missing`), and
    at values between. These values are added until the pencil projected on all modes, right and left, has the
    eigenvalues that the modes at the next value have. The branches are those of the projected pencil.
    """
    arrays, fixed = divided(model, parameters)
    if not 1 <= len(arrays) <= 2:
        raise InputError(f"sweep: expected one or two parameters with arrays of values, got {list(arrays)}")
    if modes is not None:
        modes = whole_number("modes", modes, 1)
        if len(arrays) == 2:
            raise InputError(f"modes: expected None with two parameters with arrays of values, got {modes}")
    region = wanted_region(band, growth)
    if region is not None:
        for name, given in (("modes", modes), ("vectors", vectors)):
            if given:
                raise InputError(f"{name}: cannot be given together with band, got {given!r}")
        if len(arrays) == 2:
            raise InputError("band: expected one parameter with an array of values, got two")
    axes = {name: _distinct(name, value) for name, value in arrays.items()}
    family = Family(model)
    sliding = Sliding(family, combination)
    points = math.prod(values.size for values in axes.values())
    first_scene = family.scene({**fixed, **{name: float(values[0]) for name, values in axes.items()}})
    # Of each of 2 n branches: eigenvalue, derivative, frequency, damping ratio, condition, verdicts.
    check_memory(" and ".join(axes), 2 * 8 * first_scene.size * points, points)
    attributes: dict[str, Any] = {}
    if region is not None:
        rows = [_along_band(sliding, fixed, axes, region, attributes)]
    else:
        rows = _along(sliding, fixed, axes, vectors, progress, modes)
    if len(axes) == 1:
        result = rows[0]
    else:
        first, second = axes
        joined = _along(sliding, {**fixed, second: axes[second][0]}, {first: axes[first]}, False, False)[0]
        orders = [
            _order(row["eigenvalue"][0], target)
            for row, target in zip(rows, joined["eigenvalue"], strict=True)
        ]
        result = {
            name: np.stack([row[name][..., order] for row, order in zip(rows, orders, strict=True)])
            for name in rows[0]
            if name not in ("meetings", *_POINTWISE)
        }
        result |= {name: np.stack([row[name] for row in rows]) for name in _POINTWISE}
        result["meetings"] = np.concatenate([row["meetings"] for row in rows])
    if marginal:
        result["marginal"] = _marginal(sliding, fixed, axes, result)
    return _dataset(model, first_scene.contact_labels(), axes, result).assign_attrs(attributes)


def _marginal(
    sliding: Sliding, fixed: Mapping[str, float], axes: dict[str, Real], result: dict[str, Any]
) -> Flags:
    """Return which points that are stable have a mode whose growth rate is zero within its rounding."""
    # Whoever names the statuses asks for their modes, whether or not the load keeps them.
    asked = result["stable"] & (result["steady_sliding"] | (sliding.combination is not None))
    value = result["eigenvalue"]
    # Most points are told by their eigenvalues alone; of the others the modes know their rounding.
    near = (value.real >= -_NEARLY * np.abs(value)).any(axis=-1)
    found: Flags = np.zeros(asked.shape, bool)
    for place in np.argwhere(asked & near):
        point = {name: float(values[k]) for (name, values), k in zip(axes.items(), place, strict=True)}
        modes = complex_modes(sliding.family.scene({**fixed, **point}), sliding.combination)
        found[tuple(place)] = modes.marginal.any()
    return found


def _along_band(
    sliding: Sliding,
    fixed: dict[str, float],
    axes: dict[str, Real],
    region: Region,
    attributes: dict[str, Any],
) -> dict[str, Any]:
    """Return the sweep of a band along one axis; `attributes` take what is known of its completeness."""
    ((name, values),) = axes.items()
    lower, upper = _ends(values)
    attributes |= {"missing": [0.0, 0.0], "doubts": []}
    if is_large(sliding, name, lower, fixed):
        followed = BandPath(sliding, name, fixed, lower, upper, region)
        path = followed.path
        attributes |= {"missing": followed.missing, "doubts": followed.doubts}
    else:
        path = sliding.path(name, lower, upper, fixed)
    return _as_given(values, swept_band(path, np.sort(values), region))


def _ends(values: Real) -> tuple[float, float]:
    """Return the ends of a path; it needs some length, and a single value is its lower end."""
    lower, upper = float(values.min()), float(values.max())
    return lower, upper if upper > lower else lower + max(abs(lower), 1.0) * 1e-6


def _as_given(values: Real, found: dict[str, Any]) -> dict[str, Any]:
    """Return a sweep over ascending values with them as they were given, and its branches in order."""
    backwards = np.argsort(np.argsort(values))
    order = _order(found["eigenvalue"][backwards[0]], None)
    if np.array_equal(np.sort(values), values) and np.array_equal(order, np.arange(order.size)):
        # Nothing to put in order, and vectors are large.
        return found
    return {
        key: part
        if key == "meetings"
        else part[backwards]
        if key in _POINTWISE
        else part[backwards][..., order]
        for key, part in found.items()
    }


def _distinct(name: str, value: Any) -> Real:
    values = axis(name, value)
    if np.unique(values).size != values.size:
        raise InputError(f"{name}: expected distinct values, got {value!r}")
    return values


def _along(
    sliding: Sliding,
    fixed: dict[str, float],
    axes: dict[str, Real],
    vectors: bool,
    progress: bool | None,
    modes: int | None = None,
) -> list[dict[str, Any]]:
    """Return the sweeps along the last axis, one for each value of the first if there are two."""
    *outer, (name, values) = axes.items()
    lower, upper = _ends(values)

    def row(other: dict[str, float], shown: bool | None) -> dict[str, Any]:
        path = sliding.path(name, lower, upper, {**fixed, **other})
        # Which of the modes are followed is known only from all values together.
        before, most = path.eigenproblems, values.size if modes is None else 2 * values.size - 1
        with watched(lambda: path.eigenproblems - before, most, "sweep", shown, LONG):
            return _as_given(values, path.sweep(np.sort(values), vectors, modes))

    if not outer:
        return [row({}, progress)]
    ((other, places),) = outer
    rows: list[dict[str, Any]] = []
    with watched(lambda: len(rows), places.size, "sweep", progress, LONG):
        for place in places:
            rows.append(row({other: float(place)}, False))
    return rows


def _order(found: Complex, target: Complex | None) -> Any:
    """Return the order of the eigenvalues `found` that matches `target`, or that sorts them as modes are."""
    if target is None:
        # Rounding must not part conjugates, whose moduli are equal.
        return np.lexsort((-found.imag, np.abs(found.imag), np.abs(found)))
    return scipy.optimize.linear_sum_assignment(np.abs(target[:, None] - found[None, :]))[1]


def _dataset(model: Model, contacts: list[Any], axes: dict[str, Real], result: dict[str, Any]) -> xr.Dataset:
    dims = (*axes, "branch")
    eigenvalue = result["eigenvalue"]
    modulus = np.abs(eigenvalue)
    with np.errstate(invalid="ignore"):
        ratio = -eigenvalue.real / modulus
    last = list(axes)[-1]
    derivative = np.where(is_defined(result["condition"]), result["slope"], complex(np.nan, np.nan))
    variables: dict[str, Any] = {
        "eigenvalue": (dims, eigenvalue, {"units": "1/s"}),
        "frequency": (dims, modulus / (2.0 * np.pi), {"units": "Hz", "long_name": "|eigenvalue| / 2 pi"}),
        "damping_ratio": (dims, ratio, {"units": "1"}),
        "unstable": (dims, result["unstable"]),
        "stable": (tuple(axes), result["stable"]),
        "steady_sliding": (tuple(axes), result["steady_sliding"]),
        "normal_force": ((*axes, "contact"), result["normal_force"], {"units": "N"}),
        "derivative": (
            dims,
            derivative,
            {"long_name": f"d eigenvalue / d {last}", **Family(model).derivative_units("1/s", last)},
        ),
        "condition": (dims, result["condition"], {"units": "1"}),
        "defective": (dims, result["defective"]),
    }
    if "marginal" in result:
        variables["marginal"] = (tuple(axes), result["marginal"])
    if "right" in result:
        vector = (*axes, "coordinate", "branch")
        variables |= {
            "right": (vector, result["right"], {"units": "1"}),
            "left": (vector, result["left"], {"units": "1"}),
            "a": (dims, result["a"], {"units": "kg/s"}),
        }
    attributes = {"meetings": np.sort(result["meetings"])}
    coords = {name: (name, values, Family(model).units(name)) for name, values in axes.items()}
    others = {"branch": np.arange(eigenvalue.shape[-1]), "contact": contacts}
    return xr.Dataset(apart(variables, axes), coords=coords | others, attrs=attributes)
