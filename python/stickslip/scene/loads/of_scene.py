"""Loads of a scene: what is checked of them, their names, and how the core takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import described, finite, real_array, real_number
from stickslip.scene.contact import Contact, contact_labels, described_direction, entries_of
from stickslip.scene.loads.in_time import Harmonic, Load, Switched

if TYPE_CHECKING:
    from stickslip._core import _LoadData


def vibration_name(contacts: Sequence[Contact], place: int) -> str:
    """Return the name of the vibration of a contact's slider, as parameters have it."""
    vibration = contacts[place].slider_vibration
    if vibration is None or vibration.name is None:
        return f"slider_vibration_{contact_labels(contacts)[place]}"
    return vibration.name


def load_names(loads: Sequence[Load]) -> list[str]:
    """Return the names of loads as parameters have them."""
    return [f"load_{k}" if load.name is None else load.name for k, load in enumerate(loads)]


def checked_loads(loads: Any, contacts: Sequence[Contact]) -> tuple[Load, ...]:
    """Return the loads of a scene."""
    if isinstance(loads, Harmonic | Switched):
        raise InputError(f"loads: expected a sequence of loads, got a single {type(loads).__name__}")
    if not np.iterable(loads) or isinstance(loads, str | Mapping):
        raise InputError(f"loads: expected a sequence of loads, got {described(loads)}")
    listed = tuple(loads)
    for k, load in enumerate(listed):
        if not isinstance(load, Harmonic | Switched):
            raise InputError(f"loads: expected Harmonic or Switched, got {described(load)} at {k}")
    vibrating = [k for k, contact in enumerate(contacts) if _vibration(contact, k) is not None]
    names = load_names(listed) + [vibration_name(contacts, k) for k in vibrating]
    for name in names:
        if not (isinstance(name, str) and name.strip()):
            raise InputError(f"loads: name: expected a text that is not empty, or None, got {name!r}")
        if names.count(name) > 1:
            raise InputError(f"loads: {name!r} names more than one load")
    return listed


def core_loads(loads: Sequence[Load], contacts: Sequence[Contact], dofs: Sequence[str]) -> _LoadData:
    """Return loads as the core takes them: harmonic ones, switched ones, and vibrations of sliders."""
    harmonics, steps = [], []
    for name, load in zip(load_names(loads), loads, strict=True):
        entries = entries_of(f"{name}: amplitude", load.amplitude, dofs)
        if isinstance(load, Harmonic):
            harmonics.append((entries, *_wave(name, load)))
        else:
            times, values = (
                real_array(f"{name}: {field}", getattr(load, field), 1).tolist()
                for field in ("times", "values")
            )
            _check_steps(name, times, values)
            steps.append((entries, times, values))
    vibrations = []
    for k, contact in enumerate(contacts):
        vibration = _vibration(contact, k)
        if vibration is not None:
            place = f"contact {k}: slider_vibration"
            amplitude = real_number(f"{place}: amplitude", vibration.amplitude)
            vibrations.append((k, amplitude, *_wave(place, vibration)))
    return harmonics, steps, vibrations


def _vibration(contact: Contact, place: int) -> Any:
    vibration = contact.slider_vibration
    if vibration is not None and contact.tangential is None:
        raise InputError(f"contact {place}: slider_vibration: a stop has no tangential direction")
    if vibration is None or isinstance(vibration, Harmonic):
        return vibration
    raise InputError(
        f"contact {place}: slider_vibration: expected Harmonic or None, got {described(vibration)}"
    )


def _wave(place: str, load: Harmonic) -> tuple[float, float]:
    frequency = real_number(f"{place}: frequency", load.frequency)
    if not 0.0 < frequency < np.inf:
        raise InputError(f"{place}: frequency: must be positive and finite, got {frequency:g}")
    return frequency, finite(f"{place}: phase", load.phase)


def _check_steps(place: str, times: list[float], values: list[float]) -> None:
    if len(values) != len(times) + 1:
        raise InputError(
            f"{place}: values: expected {len(times) + 1}, one more than times, got {len(values)}"
        )
    for before, time in zip([0.0, *times], times, strict=False):
        if not time > before:
            raise InputError(f"{place}: times: must be positive and ascending, got {time:g} after {before:g}")


def described_loads(
    loads: Sequence[Load], contacts: Sequence[Contact], dofs: Sequence[str]
) -> list[tuple[str, str]]:
    """Return names and words of the loads in time, sliders that vibrate among them."""
    rows = []
    for name, load in zip(load_names(loads), loads, strict=True):
        direction = described_direction(load.amplitude, dofs)
        what = (
            f"{load.frequency:g} Hz"
            if isinstance(load, Harmonic)
            else f"switched at {', '.join(f'{time:g}' for time in load.times)} s"
        )
        rows.append((name, f"{direction} N, {what}"))
    for label, contact in zip(contact_labels(contacts), contacts, strict=True):
        if (wave := contact.slider_vibration) is not None:
            rows.append((f"of slider {label}", f"{wave.amplitude:g} m/s, {wave.frequency:g} Hz"))
    return rows
