"""Models of the literature as functions that return scenes, each with its equation and source."""

from __future__ import annotations

from collections.abc import Callable

from stickslip.scene.models.coupled_modes import hoffmann, rotating_disc
from stickslip.scene.models.one_mass import (
    bistable_oscillator,
    dahl_oscillator,
    den_hartog,
    lugre_slider,
    mass_on_belt,
    mass_on_belt_in_plane,
    spring_slider,
    thomsen_fidlin,
)
from stickslip.scene.models.rows import bowed_string, burridge_knopoff
from stickslip.scene.models.subsystems import Link, Subsystem, chain, two_subsystems
from stickslip.scene.scene import Scene

__all__ = [
    "Link",
    "Subsystem",
    "bistable_oscillator",
    "bowed_string",
    "burridge_knopoff",
    "chain",
    "dahl_oscillator",
    "den_hartog",
    "hoffmann",
    "lugre_slider",
    "mass_on_belt",
    "mass_on_belt_in_plane",
    "rotating_disc",
    "spring_slider",
    "thomsen_fidlin",
    "two_subsystems",
]

#: The models by the names that a file gives them.
MODELS: dict[str, Callable[..., Scene]] = {
    model.__name__: model
    for model in (
        two_subsystems,
        chain,
        mass_on_belt,
        thomsen_fidlin,
        bistable_oscillator,
        mass_on_belt_in_plane,
        den_hartog,
        lugre_slider,
        dahl_oscillator,
        spring_slider,
        hoffmann,
        rotating_disc,
        burridge_knopoff,
        bowed_string,
    )
}


def __dir__() -> list[str]:
    return __all__
