"""Every number of a scene by its name: whose it is, how it is read and set, and its unit."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.contact import (
    LAW,
    OF_LAW,
    OF_SPRING,
    SPRINGS,
    Contact,
    concerns,
    contact_labels,
    is_shared,
    law_number,
    law_numbers,
    laws_of,
    nearest,
    with_law_number,
)
from stickslip.scene.elements import element_names, element_numbers, with_element_number
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.laws.law import OneVariableLaw
from stickslip.scene.loads.in_time import Harmonic, Switched
from stickslip.scene.loads.of_scene import load_names, vibration_name

#: What a scene is made of that has no name for each of its numbers: a parameter is a factor on what it has.
FACTORS = ("mass", "stiffness", "damping", "gyroscopic", "circulatory", "force")
#: Coefficients of `Rayleigh` damping.
COEFFICIENTS = {"damping_mass": "mass", "damping_stiffness": "stiffness"}
#: What numbers of loads are called, after the name of the load; those of a switched one with a place.
WAVE, SWITCHED = ("amplitude", "frequency", "phase"), ("times", "values")
#: Fields by unit; an amplitude of a slider is a speed.
_BY_UNIT = {
    "1": ("friction", "static_friction", "restitution", "values", *FACTORS),
    "s/m": ("friction_slope", "friction_viscous"),
    "m/s": ("slider_speed", "friction_speed"),
    "m": ("gap",),
    "N": ("normal_force", "amplitude"),
    "N/m": SPRINGS,
    "Hz": ("frequency",),
    "rad": ("phase",),
    "s": ("times", "damping_stiffness"),
    "1/s": ("damping_mass",),
}
UNITS = {field: unit for unit, fields in _BY_UNIT.items() for field in fields}
#: The other numbers of laws of friction.
UNITS |= dict.fromkeys((f"{OF_LAW}{name}" for name in ("friction", "mu0", "static", "kinetic")), "1")


@dataclass(frozen=True)
class Number:
    """A number of a scene, or the same field of all contacts."""

    #: What a user calls it.
    name: str
    #: Whose it is: a contact's, a load's, an element's, that of a slider that vibrates, or the scene's own.
    owner: Literal["contact", "load", "element", "slider", "scene"]
    #: The attribute of its owner, or an entry of `FACTORS` or `COEFFICIENTS`.
    field: str
    #: The indices of the owners.
    places: tuple[int, ...] = ()
    #: Whether it is the field of all contacts, so that it also takes one value per contact.
    joint: bool = False

    @property
    def unit(self) -> str:
        """Its unit."""
        stem = _entry(self.field)[0]
        if self.owner == "element":
            return "m" if self.field == "offset" else ""
        return "m/s" if (self.owner, stem) == ("slider", "amplitude") else UNITS.get(stem, "")

    @property
    def keys(self) -> set[tuple[str, str, int]]:
        """What it sets, to find out whether two names set the same number."""
        if self.field == "damping":
            return {("scene", field, 0) for field in COEFFICIENTS}
        return {(self.owner, self.field, k) for k in self.places or (0,)}

    def get(self, scene: Any) -> Any:
        """Return its value; None where contacts differ, or where it follows another number."""
        if self.owner == "scene":
            if self.field in FACTORS:
                return 1.0
            return getattr(scene.damping or Rayleigh(), COEFFICIENTS[self.field])
        if self.owner == "contact":
            return common([law_number(scene.contacts[k], self.field) for k in self.places])
        if self.owner == "element":
            return element_numbers(scene.elements[self.places[0]])[self.field]
        return _of_wave(self.name, self.wave(scene), self.field)

    def put(self, scene: SimpleNamespace, value: Any) -> None:
        """Set it in the parts of a scene."""
        if self.owner == "contact":
            given = per_contact(self.name, value, len(scene.contacts) if self.joint else 1)
            places = range(len(scene.contacts)) if self.joint and np.ndim(value) else self.places
            if not places:
                raise InputError(f"replace: no contact of the scene takes {self.name!r}")
            for k in places:
                one = given[k if self.joint else 0]
                scene.contacts[k] = with_law_number(scene.contacts[k], self.field, one)
        elif self.owner == "element":
            element = scene.elements[self.places[0]]
            scene.elements[self.places[0]] = with_element_number(element, self.field, value)
        elif self.owner == "load":
            load = scene.loads[self.places[0]]
            scene.loads[self.places[0]] = _with_wave(self.name, load, self.field, value)
        elif self.owner == "slider":
            wave = _with_wave(self.name, self.wave(scene), self.field, value)
            contact = scene.contacts[self.places[0]]
            scene.contacts[self.places[0]] = dataclasses.replace(contact, slider_vibration=wave)
        elif self.field in COEFFICIENTS:
            damping = scene.damping or Rayleigh()
            scene.damping = dataclasses.replace(damping, **{COEFFICIENTS[self.field]: value})
        else:
            setattr(scene, self.field, _scaled(getattr(scene, self.field), value))

    def wave(self, scene: Any) -> Any:
        """Return the load or vibration whose number it is."""
        place = self.places[0]
        return scene.loads[place] if self.owner == "load" else scene.contacts[place].slider_vibration

    def core_place(self, scene: Any) -> tuple[str, int | None]:
        """Return the field and the place under which the core knows it."""
        if self.owner == "contact":
            return self.field, None if self.joint else self.places[0]
        place = self.places[0]
        if self.owner == "slider":
            vibrating = [k for k, one in enumerate(scene.contacts) if one.slider_vibration is not None]
            return f"vibration_{self.field}", vibrating.index(place)
        kind, (attribute, at) = type(scene.loads[place]), _entry(self.field)
        before = [load for load in scene.loads[:place] if isinstance(load, kind)]
        if at is not None:
            return f"steps_{attribute}", at + sum(np.size(getattr(load, attribute)) for load in before)
        if self.field == "amplitude":
            _single_entry(self.name, scene.loads[place].amplitude)
        return f"{'harmonic' if kind is Harmonic else 'steps'}_{self.field}", len(before)


def number_of(scene: Any, name: str) -> Number:
    """Return the number of a scene, or of the parts of one, that a name stands for."""
    found = found_number(scene, name)
    if found is None:
        raise InputError(
            f"{name}: a scene has no such parameter{nearest(name, known_names(scene))}; for others pass a"
            " function from parameters to a Scene"
        )
    if found.field in SPRINGS and not any(concerns(found.field, scene.contacts[k]) for k in found.places):
        raise InputError(f"{name}: a rigid contact has no {found.field} to vary; give it one")
    return found


def checked_numbers(scene: Any, values: Mapping[str, Any]) -> dict[Number, Any]:
    """Return the values by what they set, none of the same number and none in place of a law."""
    numbers = {number_of(scene, name): value for name, value in values.items()}
    _check_apart(numbers, "parameters")
    for number, value in numbers.items():
        _check_laws_kept(scene.contacts, number, value)
    return numbers


def common(values: Sequence[Any]) -> Any:
    """Return the value that all have, None where they differ."""
    return values[0] if values and all(one == values[0] for one in values) else None


def found_number(scene: Any, name: str) -> Number | None:
    """Return the number that a name stands for; None if there is none."""
    if (own := (load_numbers(scene) | _of_elements(scene)).get(name)) is not None:
        return own
    if name not in (*COEFFICIENTS, *FACTORS):
        return _of_contacts(scene.contacts, name)
    if name in _own_names(scene):
        return Number(name, "scene", name)
    if name in FACTORS:
        others = "; vary damping_mass or damping_stiffness" if name == "damping" else ""
        raise InputError(f"{name}: a parameter of this name is a factor, and the scene has no {name}{others}")
    raise InputError(
        f"{name}: the damping of the scene is a matrix, which has no coefficients; vary 'damping', a factor "
        "on it, or make the scene with damping=Rayleigh(...)"
    )


def _own_names(scene: Any) -> list[str]:
    """Return the names of the numbers that belong to the scene as a whole."""
    factors = [name for name in FACTORS if getattr(scene, name) is not None]
    if not np.any(scene.force):
        factors.remove("force")
    return [*(COEFFICIENTS if isinstance(scene.damping, Rayleigh | None) else ()), *factors]


def _of_contacts(contacts: Sequence[Contact], name: str) -> Number | None:
    fields = (*_laws(contacts), *LAW)
    if name in fields:
        concerned = tuple(k for k, contact in enumerate(contacts) if concerns(name, contact))
        return Number(name, "contact", name, concerned, joint=True)
    # A contact whose name is a number goes before the contact of that index.
    labels = {str(k): k for k in range(len(contacts))}
    labels |= {str(label): k for k, label in enumerate(contact_labels(contacts))}
    for field in reversed(fields):
        place = labels.get(name.removeprefix(f"{field}_")) if name.startswith(f"{field}_") else None
        if place is not None and (field in LAW or concerns(field, contacts[place])):
            beside = contacts[place].beside if is_shared(field) else None
            return Number(name, "contact", field, (place,) if beside is None else (place, beside))
    return None


def _laws(contacts: Sequence[Contact]) -> list[str]:
    """Return the numbers of laws of contacts by the names of parameters."""
    return list(dict.fromkeys(name for contact in contacts for name in law_numbers(contact)))


def known_names(scene: Any) -> list[str]:
    """Return the names of the numbers of a scene, those of all contacts first."""
    fields = [*LAW, *_laws(scene.contacts)]
    labels = dict.fromkeys([*map(str, range(len(scene.contacts))), *map(str, contact_labels(scene.contacts))])
    single = [f"{field}_{label}" for field in fields for label in labels]
    return [*fields, *load_numbers(scene), *_of_elements(scene), *COEFFICIENTS, *FACTORS, *single]


def load_numbers(scene: Any) -> dict[str, Number]:
    """Return every number of loads in time and of sliders that vibrate, by name."""
    found = {}
    for k, (name, load) in enumerate(zip(load_names(scene.loads), scene.loads, strict=True)):
        places = [f"{field}_{j}" for field in SWITCHED for j in range(np.size(getattr(load, field, ())))]
        for field in WAVE if isinstance(load, Harmonic) else (WAVE[0], *places):
            found[f"{name}_{field}"] = Number(f"{name}_{field}", "load", field, (k,))
    for k, contact in enumerate(scene.contacts):
        for field in WAVE if contact.slider_vibration is not None else ():
            name = f"{vibration_name(scene.contacts, k)}_{field}"
            found[name] = Number(name, "slider", field, (k,))
    return found


def _of_elements(scene: Any) -> dict[str, Number]:
    """Return every number of springs and dampers, by name."""
    found = {}
    for k, (name, one) in enumerate(zip(element_names(scene.elements), scene.elements, strict=True)):
        for field in element_numbers(one):
            found[f"{name}_{field}"] = Number(f"{name}_{field}", "element", field, (k,))
    return found


def scene_numbers(scene: Any, laws: Iterable[str] = LAW) -> dict[str, float | None]:
    """Return the numbers of a scene by the names of single parameters, of its contacts some fields.

    The value is None where it follows another, as static friction does unless it is given.
    """
    several = len(scene.contacts) > 1
    found: dict[str, float | None] = {}
    for name in laws:
        for k, contact in enumerate(scene.contacts):
            if name in ("normal_force", *SPRINGS) and not concerns(name, contact):
                continue
            law = laws_of(contact).get(name)
            names = [name] if law is None else [f"{name}_{one}" for one in law.parameters()]
            for one in names:
                found[f"{one}_{k}" if several else one] = law_number(contact, one)
    for name, number in load_numbers(scene).items():
        if number.field != "amplitude" or len(_entries(number.wave(scene).amplitude)) == 1:
            found[name] = number.get(scene)
    found |= {name: number.get(scene) for name, number in _of_elements(scene).items()}
    own = [name for name in _own_names(scene) if name != "damping" or not isinstance(scene.damping, Rayleigh)]
    return found | {name: Number(name, "scene", name).get(scene) for name in own}


def is_number_name(name: str) -> bool:
    """Return whether a name may stand for a number of a scene that is not made yet."""
    stem = name.rstrip("_0123456789")
    return (
        name in (*COEFFICIENTS, *FACTORS)
        or any(stem.endswith(f"_{field}") for field in (*WAVE, *SWITCHED))
        or any(name == field or name.startswith(f"{field}_") for field in LAW)
    )


def unit_of_name(name: str) -> str:
    """Return the unit of a number of a scene that is not made yet; empty where it cannot be known."""
    # What follows friction_ or normal_stiffness_ may be the number of a formula.
    formula = [
        prefix.removesuffix("_")
        for prefix in (OF_LAW, OF_SPRING)
        if name.startswith(prefix) and not name.removeprefix(prefix).isdecimal()
    ]
    fields = [
        field for field in UNITS if name == field or (name.startswith(f"{field}_") and field not in formula)
    ]
    stem = name.rstrip("_0123456789").rpartition("_")[2]
    # The amplitude of a load is a force, that of a slider a speed.
    return UNITS[max(fields, key=len)] if fields else UNITS.get(stem, "") if stem != "amplitude" else ""


def changed_parts(scene: Any, numbers: Mapping[Number, Any], call: str) -> dict[str, Any]:
    """Return the arguments of a scene that change where some of its numbers do."""
    _check_apart(numbers, call)
    parts = SimpleNamespace(**{name: getattr(scene, name) for name in FACTORS})
    parts.contacts, parts.loads = list(scene.contacts), list(scene.loads)
    parts.elements = list(scene.elements)
    for number, value in numbers.items():
        number.put(parts, value)
    owners = {"contact": "contacts", "slider": "contacts", "load": "loads", "element": "elements"}
    names = {owners.get(one.owner, "damping" if one.field in COEFFICIENTS else one.field) for one in numbers}
    return {name: getattr(parts, name) for name in names}


def _check_apart(numbers: Iterable[Number], call: str) -> None:
    """Refuse two names of the same number."""
    setting: dict[tuple[str, str, int], str] = {}
    for number in numbers:
        for key in number.keys:
            if key in setting:
                raise InputError(f"{call}: {number.name!r} and {setting[key]!r} set the same number")
            setting[key] = number.name


def _check_laws_kept(contacts: Sequence[Contact], number: Number, value: Any = 0.0) -> None:
    """Refuse a number as friction or normal stiffness of a contact that has a law there."""
    if number.owner != "contact" or isinstance(value, OneVariableLaw | Mapping):
        return
    for k in number.places:
        law = laws_of(contacts[k]).get(number.field)
        if law is not None and law.data() is not None:
            suffix = f"_{k}" if len(contacts) > 1 else ""
            field = number.field
            over = "slip speed" if field == "friction" else "penetration"
            numbers = ", ".join(f"{field}_{name}{suffix}" for name in law.parameters())
            known = f"; its numbers are {numbers}" if numbers else "; a table has no numbers to vary"
            raise InputError(
                f"{field}: a number would replace the law of contact {contact_labels(contacts)[k]}, "
                f"{law.law} over {over}{known}; scene.replace({field}=...) gives a scene without the law"
            )


def per_contact(argument: str, value: Any, count: int) -> list[Any]:
    """Return a scalar, or a sequence of one value per contact, as a list of one value per contact."""
    if isinstance(value, str):
        raise InputError(f"{argument}: expected a number, or one per contact, got {value!r}")
    if isinstance(value, Mapping):  # the table of a law
        return [value] * count
    try:
        values = list(value)
    except TypeError:
        return [value] * count
    if len(values) != count:
        raise InputError(
            f"{argument}: expected a scalar or one value per contact ({count}), got {len(values)}: {value!r}"
        )
    return values


def _scaled(part: Any, factor: Any) -> Any:
    if isinstance(part, Rayleigh):
        return Rayleigh(factor * part.mass, factor * part.stiffness)
    return factor * part


def _entry(field: str) -> tuple[str, int | None]:
    """Return the attribute of a field, and the place in it; None: all of it."""
    attribute, _, place = field.rpartition("_")
    return (attribute, int(place)) if attribute in SWITCHED else (field, None)


def _entries(amplitude: Any) -> list[Any]:
    """Return the keys of the entries that an amplitude has; of a number one."""
    if not np.ndim(amplitude) and not isinstance(amplitude, Mapping):
        return [None]
    entries = amplitude if isinstance(amplitude, Mapping) else dict(enumerate(np.asarray(amplitude)))
    return [key for key, entry in entries.items() if entry or isinstance(amplitude, Mapping)]


def _single_entry(name: str, amplitude: Any) -> Any:
    """Return the key of the one entry that an amplitude has."""
    keys = _entries(amplitude)
    if len(keys) != 1:
        raise InputError(f"{name}: the load acts on {len(keys)} dofs, and has no one amplitude")
    return keys[0]


def _of_wave(name: str, wave: Harmonic | Switched, field: str) -> Any:
    """Return a number of a load or vibration."""
    attribute, at = _entry(field)
    value = getattr(wave, attribute)
    if at is not None:
        return value[at]
    key = _single_entry(name, value) if field == "amplitude" else None
    return value if key is None else value[key]


def _with_wave(name: str, wave: Any, field: str, value: Any) -> Any:
    """Return a load or vibration with another number."""
    attribute, at = _entry(field)
    key = _single_entry(name, wave.amplitude) if field == "amplitude" else at
    if key is not None:
        whole = getattr(wave, attribute)
        entries: Any = dict(whole) if isinstance(whole, Mapping) else list(whole)
        entries[key] = value
        value = {key: value} if isinstance(whole, Mapping) else entries
    return dataclasses.replace(wave, **{attribute: value})
