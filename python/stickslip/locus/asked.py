"""What a call is told of parameters: by `over` or as keywords, values, ranges and numbers."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Real, described, real_array, real_number
from stickslip.scene.family import Family, Model
from stickslip.scene.scene import Scene

#: The scene at a value of one parameter.
SceneAt = Callable[[float], Scene]


def asked(
    call: Callable[..., Any], model: Any, over: Mapping[str, Any] | None, keywords: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the parameters that a call is told, by `over` or by keywords of their names.

    Raises
    ------
    InputError
        If one is given both ways, or keywords are used where the model has one that is an option of the call.
    """
    if over is not None and not isinstance(over, Mapping):
        raise InputError(
            f"over: expected parameters by name, such as {{'friction': ...}}, got {described(over)}"
        )
    family = Family(model)
    if keywords and not isinstance(family.model, Scene):
        options = inspect.signature(call).parameters
        for name in family.keywords:
            if name in options and options[name].kind is not inspect.Parameter.VAR_KEYWORD:
                raise InputError(
                    f"{name}: the model has such a parameter, and {call.__name__} an option of that name; "
                    "give parameters as over={...}"
                )
    for name in keywords:
        if over and name in over:
            raise InputError(f"{name}: given both in over and as a keyword")
    found = {**(over or {}), **keywords}
    family.check(found)
    return found


def axis(name: str, value: Any) -> Real:
    """Return the values of a parameter, (k,).

    Raises
    ------
    InputError
        If there is none, or one is not finite.
    """
    values = real_array(name, value, 1)
    if values.size == 0 or not np.isfinite(values).all():
        raise InputError(f"{name}: expected finite values, at least one, got {value!r}")
    return values


def divided(parameters: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float]]:
    """Return the parameters with several values, and those with one number."""
    several = {name: value for name, value in parameters.items() if np.ndim(value) > 0}
    fixed = {name: real_number(name, value) for name, value in parameters.items() if name not in several}
    return several, fixed


def interval(name: str, value: Any) -> tuple[float, float]:
    """Return a parameter range given as (lower, upper).

    Raises
    ------
    InputError
        If it is not two finite numbers, the first below the second.
    """
    try:
        lower, upper = value
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected a range (lower, upper), got {value!r}") from None
    ends = real_number(name, lower), real_number(name, upper)
    if not (np.isfinite(ends).all() and ends[0] < ends[1]):
        raise InputError(f"{name}: expected finite lower < upper, got {value!r}")
    return ends


def along(
    call: Callable[..., Any], model: Model, over: Mapping[str, Any] | None, keywords: Mapping[str, Any]
) -> tuple[str, Real, SceneAt]:
    """Return name and values of the one parameter given as an array, and the scene at a value; see `asked`.

    Raises
    ------
    InputError
        If there is not exactly one array, or a value is not finite.
    """
    arrays, fixed = divided(asked(call, model, over, keywords))
    if len(arrays) != 1:
        raise InputError(f"parameter: expected exactly one with an array of values, got {list(arrays)}")
    ((name, given),) = arrays.items()
    family = Family(model)
    return name, axis(name, given), lambda value: family.scene({**fixed, name: float(value)})


def between(
    call: Callable[..., Any], model: Model, over: Mapping[str, Any] | None, keywords: Mapping[str, Any]
) -> tuple[str, float, float, SceneAt]:
    """Return name, begin and end of the one parameter to follow a branch along, and the scene at a value.

    Raises
    ------
    InputError
        If there is not exactly one pair of two finite values.
    """
    name, ends, scene_at = along(call, model, over, keywords)
    if ends.size != 2 or ends[0] == ends[1]:
        raise InputError(f"{name}: expected (begin, end) of the branch, got {ends.tolist()}")
    return name, float(ends[0]), float(ends[1]), scene_at
