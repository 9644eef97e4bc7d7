"""The stability verdict alone, for many scenes at once."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
import xarray as xr

from stickslip import _core
from stickslip.errors import InputError
from stickslip.locus.path import Family, Model, contact_parameter
from stickslip.scene.checks import Real, real_array
from stickslip.scene.models import LABELS, radians, two_subsystems
from stickslip.scene.scene import Scene

#: Parameters of the two-subsystem model that its stability depends on, with the number of values per scene.
_SHAPES = {
    "friction": 2,
    "slider_speed": 2,
    "preload_displacement": 2,
    "external_force": 2,
    "upper_mass": 2,
    "contact_mass": 2,
    "inclination": 2,
    "vertical_stiffness": 2,
    "horizontal_stiffness": 2,
    "ceiling_stiffness": 2,
    "link_horizontal_stiffness": 1,
    "link_vertical_stiffness": 1,
    "wall_stiffness": 0,
    "damping": 0,
}
#: Those that have to be positive; the others only must not be negative, but for the inclination.
_POSITIVE = ("upper_mass", "contact_mass")


def stability(model: Model, combination: str | None = None, **parameters: Any) -> xr.Dataset:
    """Return the least stable eigenvalue of every scene of a sample, without computing vectors.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one. ``ss.models.two_subsystems`` is evaluated in compiled
        code.
    combination
        One letter of ``+ - s d`` per contact; None: that of steady sliding of each sample, in which each
        slider
        speed gives the sign of its contact.
    **parameters
        Samples (k,) of parameters, named as in `sweep`, all of one length; numbers stay the same in all
        samples. The parameters of ``two_subsystems`` that take one value per contact also take (k, 2).

    Returns
    -------
    xarray.Dataset
        Over ``sample``: ``eigenvalue``, the one with the largest real part and nonnegative imaginary part,
        1/s; ``growth_rate``, its real part; ``frequency``, ``|lambda| / 2 pi``, Hz; ``unstable``, how many
        eigenvalues have a positive real part, conjugates counted; ``steady_sliding``, whether steady sliding
        of
        the combination exists (`sweep`): elsewhere the rest says nothing about it; ``normal_force`` of the
        closed
        contacts in equilibrium, N, also over ``contact``.

    Raises
    ------
    InputError
        If a parameter is unknown, lengths differ, a value is ill-posed, or a slider speed is zero where no
        combination is given.
    """
    arrays = {name: real_array(name, value, 0, 1, 2) for name, value in parameters.items()}
    lengths = {name: len(value) for name, value in arrays.items() if value.ndim > 0}
    if not lengths:
        raise InputError("stability: expected at least one parameter with an array of samples")
    count = next(iter(lengths.values()))
    for name, length in lengths.items():
        if length != count:
            raise InputError(f"{name}: expected {count} samples like {next(iter(lengths))}, got {length}")
    if model is two_subsystems and combination in (None, "++") and set(arrays) <= set(_SHAPES):
        found, contacts = _two_subsystems(arrays, count, combination), [0, 1]
    else:
        found, contacts = _scenes(Family(model, combination), arrays, count)
    eigenvalue = found["eigenvalue"]
    return xr.Dataset(
        {
            "eigenvalue": ("sample", eigenvalue, {"units": "1/s"}),
            "growth_rate": ("sample", eigenvalue.real, {"units": "1/s"}),
            "frequency": ("sample", np.abs(eigenvalue) / (2.0 * np.pi), {"units": "Hz"}),
            "unstable": ("sample", found["unstable"]),
            "steady_sliding": ("sample", found["steady_sliding"]),
            "normal_force": (("sample", "contact"), found["normal_force"], {"units": "N"}),
        },
        coords={"contact": contacts},
    )


def _scenes(family: Family, arrays: dict[str, Real], count: int) -> tuple[dict[str, Any], list[Any]]:
    for name, array in arrays.items():
        if array.ndim == 2:
            raise InputError(f"{name}: expected shape ({count},), got {array.shape}")
    if isinstance(family.model, Scene) and len(arrays) == 1:
        ((name, values),) = arrays.items()
        field, _ = contact_parameter(family.model, name)
        if field == "friction":
            lower, upper = float(values.min()), float(values.max())
            path = family.path(name, lower, upper + (lower == upper))
            return path.growth(np.ascontiguousarray(values)), family.model.contact_labels()
    columns = {name: np.broadcast_to(array, count) for name, array in arrays.items()}
    scenes = [
        family.scene(**{name: float(column[i]) for name, column in columns.items()}) for i in range(count)
    ]
    for scene in scenes:
        if len(scene.contacts) != len(scenes[0].contacts):
            raise InputError(
                f"model: expected {len(scenes[0].contacts)} contacts in every scene, "
                f"got {len(scene.contacts)}"
            )
    found = _core.scene_growth([scene.core for scene in scenes], family.combination)
    return found, scenes[0].contact_labels() if scenes else []


def _two_subsystems(arrays: dict[str, Real], count: int, combination: str | None) -> dict[str, Any]:
    defaults = {
        name: parameter.default for name, parameter in inspect.signature(two_subsystems).parameters.items()
    }
    defaults |= LABELS["matrix"]
    columns = {}
    for name, width in _SHAPES.items():
        array = arrays.get(name)
        if array is None:
            values = np.broadcast_to(
                np.asarray(defaults[name], dtype=float), (count, width) if width else count
            )
        elif array.ndim == 2:
            if array.shape[1:] != (width,):
                raise InputError(
                    f"{name}: expected shape ({count},) or ({count}, {width}), got {array.shape}"
                )
            values = array
        else:
            column = np.broadcast_to(array, count)
            values = np.broadcast_to(column[:, None], (count, width)) if width else column
        _check(name, values)
        if name == "slider_speed" and combination is None:
            _check_driven(values)
        columns[name] = np.ascontiguousarray(values)
    return _core.chain_growth(
        link_horizontal=columns.pop("link_horizontal_stiffness"),
        link_vertical=columns.pop("link_vertical_stiffness"),
        positive=combination is not None,
        **columns,
    )


def _check_driven(speed: Real) -> None:
    if (speed == 0.0).any():
        sample, contact = (int(k) for k in np.argwhere(speed == 0.0)[0])
        raise InputError(
            f"slider_speed: must not be 0, as of contact {contact} in sample {sample}: steady sliding has no "
            "direction there; pass combination"
        )


def _check(name: str, values: Real) -> None:
    if name == "inclination" or name.endswith("stiffness"):
        # As in a scene, springs may be negative.
        wrong = ~np.isfinite(values)
        requirement = "finite"
    elif name in _POSITIVE:
        wrong, requirement = ~((values > 0.0) & np.isfinite(values)), "> 0 and finite"
    elif name == "friction":
        wrong, requirement = ~((values >= 0.0) & np.isfinite(values)), ">= 0 and finite"
    else:
        wrong, requirement = ~np.isfinite(values), "finite"
    if wrong.any():
        first = tuple(int(k) for k in np.argwhere(wrong)[0])
        raise InputError(f"{name}: must be {requirement}, got {float(values[first])!r} in sample {first[0]}")
    if name == "inclination" and values.size:
        radians(name, float(values.flat[np.abs(values).argmax()]))
