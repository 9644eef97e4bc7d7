"""Derivatives of eigenvalues.

For a simple eigenvalue with right and left vectors xi and v, ``P = lambda^2 M + lambda C + K``,

    d lambda / d p = -v' (lambda^2 M_p + lambda C_p + K_p) xi / a,    a = v' (2 lambda M + C) xi

(Lancaster 1964). It grows without bound where two eigenvalues coalesce, as the square root does; their mean
stays smooth, and its derivative is the trace of the same quotient over the deflating subspace of the pair.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import scipy.linalg
import scipy.sparse
import xarray as xr

from stickslip import _core
from stickslip.faults import InputError
from stickslip.locus.band.path import wanted_region
from stickslip.locus.band.space import INTERPOLATED, Projected
from stickslip.locus.path import Sliding, is_linear, moved_friction
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.modes.sparse.pencil import sparse_array
from stickslip.scene.checks import Complex, Real, check_memory, real_number
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.reduction import equations_of
from stickslip.scene.scene import Scene

#: Names of the matrices whose entries eigenvalues can be differentiated by.
Entries = Literal["mass", "damping", "stiffness", "gyroscopic", "circulatory"]
#: Largest relative error of a derivative, condition^2 times rounding, up to which it counts as defined.
_DEFINED = 1e-6
#: Half-width of the interval on which a model function is interpolated, of the parameter's size.
_NEIGHBOURHOOD = 0.01


def sensitivity(
    model: Model,
    parameters: Sequence[str] | Mapping[str, float] | None = None,
    *,
    combination: str | None = None,
    entries: Entries | None = None,
    band: Sequence[float] | None = None,
    growth: Sequence[float | None] = (None, None),
) -> xr.Dataset:
    """Return the derivatives of all eigenvalues, or of those in a band, with respect to parameters.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one.
    parameters
        Names as for `sweep` (``friction`` changes all contacts alike), or names with the values at which to
        differentiate; the other parameters stay as they are. None: ``friction``, or nothing with `entries`.
    combination
        One letter of ``+ - s d`` per contact; None: that of steady sliding, as for `complex_modes`.
    entries
        Name of a matrix: the result has the derivatives with respect to every entry of it as well. Entries of
        mass and stiffness change proportional damping along with them.
    band, growth
        Frequencies in Hz and growth rates in 1/s as for `complex_modes`: only the modes inside are
        differentiated, and a large scene computes no others.

    Returns
    -------
    xarray.Dataset
        Over ``mode``, as in `complex_modes`: ``eigenvalue`` (1/s), ``defined``, ``partner`` (for an
        undefined eigenvalue the mode with the nearest other one, which may be its own conjugate, else the
        mode itself); over ``parameter`` and ``mode``:
        ``derivative``, nan where it is not defined, and ``mean_derivative`` of the mean of the eigenvalue and
        its partner, always finite but for bands of large scenes, where it is nan with the derivative. With
        `entries`, over ``mode``, ``row`` and ``column`` (dofs): ``entry_derivative``, nan where it is not
        defined; each value is for one entry alone, and a symmetric change is the sum of two entries.

    Raises
    ------
    InputError
        If a parameter is unknown, a function is to be differentiated where it has no value, the model is not
        smooth there, or `band` or `growth` is ill-posed; if `entries` is no matrix, or changes the normal
        forces of contacts under laws over slip speed.
    """
    wanted_region(band, growth)
    family, names, point = _point(model, parameters, entries)
    scene = family.scene(point)
    modes = complex_modes(scene, combination, band=band, growth=growth)
    large = scipy.sparse.issparse(modes.mass)
    right, left = modes.right_displacement, modes.left_displacement
    if all(is_linear(family.model, name) for name in names):
        of_contacts = _sparse_contact_change if large else _contact_change
        changes = [of_contacts(scene, modes.combination, name) for name in names]
    else:
        sliding = Sliding(family, modes.combination if large else combination)
        basis = None
        if large:
            # What is said of vectors of a large scene needs its matrices between them alone.
            basis, right, left = _basis(right, left)
        centres = {name: point[name] if name in point else family.value(name) for name in names}
        changes = [
            _model_change(sliding, {**point, name: value}, name, basis) for name, value in centres.items()
        ]
    partner, nearest = _partners(modes)
    defined = is_defined(modes.condition)
    derivative = np.array([_derivative(modes, right, left, change) for change in changes], dtype=complex)
    derivative = derivative.reshape(len(names), modes.eigenvalues.size)
    means = derivative.copy()
    for mode in np.flatnonzero(~defined):
        pair = np.array([modes.eigenvalues[mode], nearest[mode]])
        for row, change in zip(means, changes, strict=True):
            row[mode] = complex(np.nan, np.nan) if large else _mean_derivative(modes, change, pair)
    derivative[:, ~defined] = complex(np.nan, np.nan)
    units = [family.units(name).get("units", "") for name in names]
    found = xr.Dataset(
        {
            "eigenvalue": ("mode", modes.eigenvalues, {"units": "1/s"}),
            "defined": ("mode", defined),
            "partner": ("mode", np.where(defined, np.arange(len(modes)), partner)),
            "derivative": (("parameter", "mode"), derivative, {"units": "1/s per unit"}),
            "mean_derivative": (("parameter", "mode"), means, {"units": "1/s per unit"}),
        },
        coords={
            "parameter": np.array(names, dtype=str),
            "unit": ("parameter", np.array(units, dtype=str)),
            "mode": np.arange(modes.eigenvalues.size),
        },
    )
    return found if entries is None else found.merge(_entry_derivatives(scene, modes, entries, defined))


def _point(
    model: Model, parameters: Any, entries: Entries | None
) -> tuple[Family, tuple[str, ...], dict[str, float]]:
    """Return the family, the names to differentiate by, and the values of those that are given one."""
    if parameters is None:
        parameters = ("friction",) if entries is None else ()
    if isinstance(parameters, str):
        raise InputError(f"parameters: expected a sequence of names, or values by name, got {parameters!r}")
    given = parameters if isinstance(parameters, Mapping) else {}
    point = {name: real_number(name, value) for name, value in given.items()}
    family = Family(model)
    family.check(point)
    names = tuple(parameters)
    for name in names:
        family.check([name])
    return family, names, point


def _entry_derivatives(scene: Scene, modes: Modes, matrix: Entries, defined: Any) -> xr.Dataset:
    """Return the derivatives of all eigenvalues with respect to every entry of a matrix."""
    reduced = equations_of(scene, modes.combination)
    value = modes.eigenvalues
    law = scene.damping if isinstance(scene.damping, Rayleigh) else Rayleigh()
    if scene.core.has_massless and law.stiffness:
        raise InputError(
            "damping: beta K is formed from what the dofs with mass feel, where others have none or contacts"
            " are compliant; state it as a matrix to differentiate"
        )
    loaded = any(
        one.normal is not None and (isinstance(one.friction, FrictionLaw) or one.beside is not None)
        for one in scene.contacts
    )
    if scene.core.has_elements and matrix in ("stiffness", "circulatory"):
        raise InputError(
            f"entries: {matrix} also moves the rest, and with it the slope of springs; differentiate a"
            " function that returns the scene"
        )
    if loaded and matrix in ("stiffness", "circulatory"):
        raise InputError(
            f"entries: {matrix} also changes normal forces, and with them the slope of friction over slip"
            " velocity; differentiate a function that returns the scene"
        )
    per_viscous, per_spring = "1/s/(N s/m)", "1/s/(N/m)"
    factors = {
        "mass": (value**2 + law.mass * value, "1/s/kg"),
        "damping": (value, per_viscous),
        "stiffness": (1.0 + law.stiffness * value, per_spring),
        "gyroscopic": (value, per_viscous),
        "circulatory": (np.ones_like(value), per_spring),
    }
    if matrix not in factors:
        raise InputError(f"entries: expected one of {list(factors)}, got {matrix!r}")
    factor, unit = factors[matrix]
    check_memory("entries", 2 * value.size * scene.size**2, value.size)
    right = reduced.right_basis @ modes.right_displacement
    left = reduced.left_basis @ modes.left_displacement
    with np.errstate(invalid="ignore"):
        derivative = -np.einsum("r,ir,jr->rij", factor / modes.a, left, right)
    derivative[~defined] = complex(np.nan, np.nan)
    attrs = {"long_name": f"d eigenvalue / d entry of {matrix}", "units": unit}
    return xr.Dataset(
        {"entry_derivative": (("mode", "row", "column"), derivative, attrs)},
        coords={"row": list(scene.dofs), "column": list(scene.dofs)},
    )


#: Derivatives of M, C and K, dense or sparse.
Change = tuple[Any, Any, Any]


def _contact_change(scene: Scene, combination: str | None, name: str) -> Change:
    letters = Sliding(Family(scene), combination).letters(scene)
    moving = moved_friction(scene, name)
    path = _core.Path.contact_law(scene.core, scene.core, letters, moving, 0.0, 1.0)
    *_, mass, damping, stiffness = path.matrices(0.0)
    return mass, damping, stiffness


def _sparse_contact_change(scene: Scene, letters: str, name: str) -> Change:
    """Return what friction higher by one adds: it enters linearly."""
    moving = moved_friction(scene, name)
    raised = [
        dataclasses.replace(contact, friction=contact.friction + 1.0, static_friction=None)
        if i in moving and not isinstance(contact.friction, FrictionLaw)
        else contact
        for i, contact in enumerate(scene.contacts)
    ]
    more, here = (one.core.sparse_pencil(letters) for one in (scene.replace(contacts=raised), scene))
    mass, damping, stiffness = (
        sparse_array(one) - sparse_array(other) for one, other in zip(more, here, strict=True)
    )
    return mass, damping, stiffness


def _basis(right: Complex, left: Complex) -> tuple[Real, Complex, Complex]:
    """Return a real basis of right and left vectors, (m, r), and their coordinates in it, (r, k) each."""
    whole = np.nan_to_num(np.concatenate([right, left], axis=1))
    parts = np.concatenate([whole.real, whole.imag], axis=1)
    basis, coordinates = np.linalg.qr(parts)
    count = whole.shape[1]
    together = coordinates[:, :count] + 1j * coordinates[:, count:]
    return basis, together[:, : count // 2], together[:, count // 2 :]


def _model_change(
    sliding: Sliding, point: Mapping[str, float], name: str, basis: Real | None = None
) -> Change:
    value = point[name]
    fixed = {key: number for key, number in point.items() if key != name}
    width = _NEIGHBOURHOOD * (abs(value) or 1.0)
    # At the end of what the model accepts, friction 0 for one, the derivative is one-sided.
    for lower, upper in ((value - width, value + width), (value, value + width), (value - width, value)):
        try:
            if basis is None:
                path = sliding.path(name, lower, upper, fixed)
            else:
                path = Projected(sliding, name, fixed, INTERPOLATED, basis).path(lower, upper)
        except InputError as error:
            refused = error
        else:
            *_, mass, damping, stiffness = path.matrices(value)
            return mass, damping, stiffness
    raise refused


def is_defined(condition: Real) -> Any:
    """Return whether eigenvalues of some condition numbers have a derivative that is more than noise."""
    with np.errstate(over="ignore"):
        return condition**2 * np.finfo(float).eps <= _DEFINED


def _partners(modes: Modes) -> tuple[Any, Any]:
    """Return for every mode the number of the one whose eigenvalue or its conjugate is nearest, and that."""
    value = modes.eigenvalues
    # A pair that is about to meet on the real axis is its own neighbour.
    both = np.stack([value, np.where(value.imag == 0.0, np.inf, value.conj())])
    distance = np.abs(value[:, None, None] - both)
    np.fill_diagonal(distance[:, 0], np.inf)
    places = distance.reshape(value.size, -1).argmin(axis=1)
    return places % value.size, both.ravel()[places]


def _derivative(modes: Modes, right: Complex, left: Complex, change: Change) -> Complex:
    mass, damping, stiffness = change
    value = modes.eigenvalues
    moved = value**2 * (mass @ right) + value * (damping @ right) + stiffness @ right
    # a is nan for a defective mode, and so is its derivative.
    with np.errstate(invalid="ignore"):
        derivative: Complex = -(left * moved).sum(axis=0) / modes.a
    return derivative


def _mean_derivative(modes: Modes, change: Change, pair: Complex) -> complex:
    """Return half the trace of ``-(V' A X)^-1 V' (B_p X + A_p X Lambda)``; X, V: the pair's subspaces."""
    m = modes.mass.shape[0]
    mean = pair.mean()
    # Time in units of the pair's own, so that no block of the pencil drowns another.
    rate = np.abs(pair).max() or 1.0
    scale = np.concatenate([np.ones(m), np.full(m, rate)])
    a = modes.state_a * scale[:, None] * scale / rate
    b = modes.state_b * scale[:, None] * scale / rate**2

    def nearest(alpha: Complex, beta: Complex) -> Any:
        with np.errstate(divide="ignore", invalid="ignore"):
            order = np.argsort(np.abs(alpha / beta - mean / rate))
        chosen = np.zeros(alpha.size, dtype=bool)
        chosen[order[:2]] = True
        return chosen

    right = scipy.linalg.ordqz(-b, a, sort=nearest, output="complex")[5][:, :2]
    left = scipy.linalg.ordqz(-b.T, a.T, sort=nearest, output="complex")[5][:, :2]
    gram = left.T @ a @ right
    values = np.linalg.solve(gram, -left.T @ b @ right)
    mass, damping, stiffness = change
    zero = np.zeros_like(mass)
    moved_a = np.block([[damping, mass], [mass, zero]]) * scale[:, None] * scale / rate
    moved_b = np.block([[stiffness, zero], [zero, -mass]]) * scale[:, None] * scale / rate**2
    moved = left.T @ (moved_b @ right + moved_a @ right @ values)
    return complex(-0.5 * rate * np.trace(np.linalg.solve(gram, moved)))
