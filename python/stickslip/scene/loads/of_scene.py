"""Loads of a scene: what is checked of them, their numbers by name, and how the core takes them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import described, real_array, real_number
from stickslip.scene.contact import Contact, contact_labels, described_direction, entries_of
from stickslip.scene.loads.in_time import Harmonic, Load, Switched

if TYPE_CHECKING:
    from stickslip._core import _LoadData

#: What parameters of loads are called, after the name of the load.
NUMBERS = ("amplitude", "frequency", "phase")
#: And with the place of the number among them, those of a switched load.
SWITCHED = ("times", "values")


def vibration_name(contacts: Sequence[Contact], place: int) -> str:
    """Return the name of the vibration of a contact's slider, as parameters have it."""
    vibration = contacts[place].slider_vibration
    if vibration is None or vibration.name is None:
        return f"slider_vibration_{contact_labels(contacts)[place]}"
    return vibration.name


def load_names(loads: Sequence[Load]) -> list[str]:
    """Return the names of loads as parameters have them."""
    return [f"load_{k}" if load.name is None else load.name for k, load in enumerate(loads)]


def load_parameters(loads: Sequence[Load], contacts: Sequence[Contact]) -> dict[str, tuple[str, int, str]]:
    """Return every number of loads by name: whose it is (``load`` or ``vibration``), its place, its field."""
    known = {
        f"{name}_{field}": ("load", k, field)
        for k, name in enumerate(load_names(loads))
        for field in _fields(loads[k])
    }
    for k, contact in enumerate(contacts):
        if contact.slider_vibration is not None:
            name = vibration_name(contacts, k)
            known |= {f"{name}_{field}": ("vibration", k, field) for field in NUMBERS}
    return known


def _fields(load: Load) -> tuple[str, ...]:
    """Return what parameters of a load are called, after its name."""
    if isinstance(load, Harmonic):
        return NUMBERS
    places = [f"{field}_{j}" for field in SWITCHED for j in range(np.size(getattr(load, field)))]
    return (NUMBERS[0], *places)


def _entry(field: str) -> tuple[str, int | None]:
    """Return the attribute of a field, and the place in it; None: all of it."""
    attribute, _, place = field.rpartition("_")
    return (attribute, int(place)) if attribute in SWITCHED else (field, None)


def core_place(
    loads: Sequence[Load], contacts: Sequence[Contact], whose: str, place: int, field: str
) -> tuple[str, int]:
    """Return the field and the place under which the core knows a number of a load."""
    if whose == "vibration":
        vibrating = [k for k, contact in enumerate(contacts) if contact.slider_vibration is not None]
        return f"vibration_{field}", vibrating.index(place)
    kind = type(loads[place])
    attribute, at = _entry(field)
    if at is not None:
        earlier = [load for load in loads[:place] if isinstance(load, Switched)]
        return f"steps_{attribute}", at + sum(np.size(getattr(load, attribute)) for load in earlier)
    if field == "amplitude":
        single_entry(f"{load_names(loads)[place]}_{field}", loads[place].amplitude)
    before = sum(isinstance(load, kind) for load in loads[:place])
    return f"{'harmonic' if kind is Harmonic else 'steps'}_{field}", before


def single_entry(name: str, amplitude: Any) -> Any:
    """Return the key of the one entry that an amplitude has.

    Raises
    ------
    InputError
        If there are several, so that no one number is the amplitude.
    """
    entries = amplitude if isinstance(amplitude, Mapping) else dict(enumerate(np.asarray(amplitude)))
    keys = [key for key, entry in entries.items() if entry or isinstance(amplitude, Mapping)]
    if len(keys) != 1:
        raise InputError(f"{name}: the load acts on {len(keys)} dofs, and has no one amplitude")
    return keys[0]


def replaced(load: Any, name: str, field: str, value: Any) -> Any:
    """Return a load or vibration with another number."""
    if field == "amplitude" and np.ndim(load.amplitude) + isinstance(load.amplitude, Mapping):
        key = single_entry(name, load.amplitude)
        if isinstance(load.amplitude, Mapping):
            value = {key: value}
        else:
            entries = list(load.amplitude)
            entries[key] = value
            value = entries
    attribute, at = _entry(field)
    if at is not None:
        entries = list(getattr(load, attribute))
        entries[at], field = value, attribute
        value = entries
    return dataclasses.replace(load, **{field: value})


def load_number(loads: Sequence[Load], contacts: Sequence[Contact], name: str) -> Any:
    """Return a number of a load or vibration by its name."""
    whose, place, field = load_parameters(loads, contacts)[name]
    attribute, at = _entry(field)
    value = getattr(loads[place] if whose == "load" else contacts[place].slider_vibration, attribute)
    if at is not None:
        return value[at]
    if field == "amplitude" and np.ndim(value) + isinstance(value, Mapping):
        return value[single_entry(name, value)]
    return value


def checked_loads(loads: Any, contacts: Sequence[Contact]) -> tuple[Load, ...]:
    """Return the loads of a scene.

    Raises
    ------
    InputError
        If they are no sequence of loads, or a name stands for two of them.
    """
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
    """Return loads as the core takes them: harmonic ones, switched ones, and vibrations of sliders.

    Raises
    ------
    InputError
        If one is ill-posed.
    """
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
    phase = real_number(f"{place}: phase", load.phase)
    if not np.isfinite(phase):
        raise InputError(f"{place}: phase: must be finite, got {phase:g}")
    return frequency, phase


def _check_steps(place: str, times: list[float], values: list[float]) -> None:
    if len(values) != len(times) + 1:
        raise InputError(
            f"{place}: values: expected {len(times) + 1}, one more than times, got {len(values)}"
        )
    for before, time in zip([0.0, *times], times, strict=False):
        if not time > before:
            raise InputError(f"{place}: times: must be positive and ascending, got {time:g} after {before:g}")


def with_load_numbers(
    contacts: tuple[Contact, ...], loads: Any, changes: dict[str, Any]
) -> tuple[tuple[Contact, ...], dict[str, Any]]:
    """Return contacts and changes with numbers of loads in time set.

    Numbers of sliders that vibrate are set in the contacts, and those of loads in the change of ``loads``.
    """
    # A broken sequence is refused where the scene is made.
    known = load_parameters(checked_loads(loads, contacts), contacts) if changes else {}
    named = {name: known[name] for name in changes if name in known}
    if not named:
        return contacts, changes
    waves, others = list(contacts), list(loads)
    for name, (whose, place, field) in named.items():
        if whose == "load":
            others[place] = replaced(others[place], name, field, changes[name])
        else:
            wave = replaced(waves[place].slider_vibration, name, field, changes[name])
            waves[place] = dataclasses.replace(waves[place], slider_vibration=wave)
    rest = {name: value for name, value in changes.items() if name not in named}
    moved = [
        key for key, old, new in (("loads", loads, others), ("contacts", contacts, waves)) if list(old) != new
    ]
    rest |= {key: tuple(others if key == "loads" else waves) for key in moved}
    return tuple(waves), rest


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
