"""Scenes that know the model that made them, so that a file names it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial, wraps
from inspect import signature
from typing import Any, ParamSpec

from stickslip.scene.scene import Scene

P = ParamSpec("P")


def named(function: Callable[P, Scene]) -> Callable[P, Scene]:
    """Return a model whose scenes know it, with those arguments that are not its defaults."""

    @wraps(function)
    def model(*args: P.args, **kwargs: P.kwargs) -> Scene:
        return made_by(function(*args, **kwargs), model, kwargs)

    return model


def made_by(scene: Scene, model: Callable[..., Scene], given: Mapping[str, Any]) -> Scene:
    """Let a scene know the model that made it, with those arguments that are not its defaults."""
    standard = defaults(model)
    changed = {name: value for name, value in given.items() if value is not standard[name]}
    object.__setattr__(scene, "model", partial(model, **changed))
    return scene


@cache
def defaults(model: Callable[..., Scene]) -> dict[str, Any]:
    """Return the default of every argument of a model."""
    return {name: parameter.default for name, parameter in signature(model).parameters.items()}
