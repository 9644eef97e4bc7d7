"""The values that a call takes for parameters: arrays, ranges and numbers by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Real, described, real_array, real_number
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

#: The scene at a value of one parameter.
SceneAt = Callable[[float], Scene]


def checked_parameters(model: Any, parameters: Any) -> dict[str, Any]:
    """Return the parameters that a call takes, as given."""
    if not isinstance(parameters, Mapping):
        raise InputError(
            f"parameters: expected values by name, such as {{'friction': ...}}, got {described(parameters)}"
        )
    Family(model).check(parameters)
    return dict(parameters)


def axis(name: str, value: Any) -> Real:
    """Return the values of a parameter, (k,)."""
    values = real_array(name, value, 1)
    if values.size == 0 or not np.isfinite(values).all():
        raise InputError(f"{name}: expected finite values, at least one, got {value!r}")
    return values


def divided(model: Any, parameters: Any) -> tuple[dict[str, Any], dict[str, float]]:
    """Return the parameters with several values, and those with one number."""
    given = checked_parameters(model, parameters)
    several = {name: value for name, value in given.items() if np.ndim(value) > 0}
    fixed = {name: real_number(name, value) for name, value in given.items() if name not in several}
    return several, fixed


def interval(name: str, value: Any) -> tuple[float, float]:
    """Return a parameter range given as (lower, upper)."""
    try:
        lower, upper = value
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected a range (lower, upper), got {value!r}") from None
    ends = real_number(name, lower), real_number(name, upper)
    if not (np.isfinite(ends).all() and ends[0] < ends[1]):
        raise InputError(f"{name}: expected finite lower < upper, got {value!r}")
    return ends


def along(model: Model, parameters: Any) -> tuple[str, Real, SceneAt]:
    """Return name and values of the one parameter given as an array, and the scene at a value."""
    arrays, fixed = divided(model, parameters)
    if len(arrays) != 1:
        raise InputError(f"parameters: expected exactly one with an array of values, got {list(arrays)}")
    ((name, given),) = arrays.items()
    family = Family(model)
    return name, axis(name, given), lambda value: family.scene({**fixed, name: float(value)})


def between(model: Model, parameters: Any) -> tuple[str, float, float, SceneAt]:
    """Return name, begin and end of the one parameter to follow a branch along, and the scene at a value."""
    name, ends, scene_at = along(model, parameters)
    if ends.size != 2 or ends[0] == ends[1]:
        raise InputError(f"{name}: expected (begin, end) of the branch, got {ends.tolist()}")
    return name, float(ends[0]), float(ends[1]), scene_at


def apart(variables: Mapping[str, Any], parameters: Iterable[str]) -> dict[str, Any]:
    """Return variables of a dataset; one named as a parameter becomes ``computed_`` and its name."""
    taken = set(parameters)
    return {f"computed_{name}" if name in taken else name: one for name, one in variables.items()}


def parameter_of(values: xr.DataArray) -> str:
    """Return the name of the parameter over which the values of a result stand.

    It is their dimension or, where they stand over the points of a branch, the coordinate along that one.
    """
    (along,) = values.dims
    others = (name for name, held in values.coords.items() if held.dims == (along,) and name != along)
    return str(next(others, along))
