"""Loads that depend on time: harmonic ones, switched ones, and sliders that vibrate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from stickslip.scene.checks import by_label

#: A number, or entries by dof: which of them it is, the load says.
Amplitude: TypeAlias = Any


@dataclass(frozen=True)
class Harmonic:
    """``amplitude cos(2 pi frequency t + phase)``: a load on dofs, or the vibration of a slider.

    Parameters
    ----------
    amplitude
        For a load on dofs: the force in N by dof, such as ``{"x1": 2.0}``, or as a vector (n,). For a slider
        (`Contact.slider_vibration`): the velocity in m/s.
    frequency
        Hz, positive.
    phase
        Phase at t = 0, rad.
    name
        Name under which the numbers of the load are parameters: ``shaker_amplitude``, ``shaker_frequency``
        and ``shaker_phase`` for the name ``shaker``. None: ``load_0`` for the first load of a scene,
        ``slider_vibration_0`` for the slider of the first contact, or with the contact's name in place of 0.
    """

    amplitude: Amplitude
    frequency: float
    phase: float = 0.0
    name: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", _kept(self.amplitude))


@dataclass(frozen=True)
class Switched:
    """A load on dofs that is switched: `amplitude` times a factor that is constant between `times`.

    Each step is an event of kind ``load``.

    Parameters
    ----------
    amplitude
        The force at factor 1, N, by dof, such as ``{"x2": 3000.0}``, or a vector (n,).
    times
        Times at which the factor changes, s; positive, ascending.
    values
        The factors: one from t = 0 on, and one from each of the `times` on.
    name
        Name under which the numbers of the load are parameters: ``pull_amplitude``, ``pull_times_0``,
        ``pull_values_1`` for the name ``pull``. None: ``load_0`` for the first load of a scene.
    """

    amplitude: Amplitude
    times: Sequence[float]
    values: Sequence[float]
    name: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", _kept(self.amplitude))
        for field in ("times", "values"):
            if np.iterable(value := getattr(self, field)) and not isinstance(value, str):
                object.__setattr__(self, field, tuple(value))


def _kept(amplitude: Any) -> Any:
    """Return an amplitude that nobody changes: a mapping of its own, or the entries of a vector."""
    if isinstance(amplitude := by_label(amplitude), Mapping):
        return dict(amplitude)
    return tuple(np.asarray(amplitude).tolist()) if np.ndim(amplitude) == 1 else amplitude


#: A load in time of a scene.
Load = Harmonic | Switched
