"""A model and its parameters by name: the one grammar of all questions about a parameter.

A name is one of

* a keyword of the model function, such as ``vertical_stiffness``;
* one entry of a keyword that takes an array: ``vertical_stiffness_1``;
* of ``models.chain``, a field of all its subsystems or links, or of one of them, such as
  ``link_vertical_stiffness_0``;
* a number of the scene (`numbers`): a field of the contact law, of all contacts (``friction``) or of one, by
  index or name (``friction_0``, ``friction_left``), a number of a load (``shaker_frequency``), a coefficient
  of damping (``damping_stiffness``), or a factor on a matrix or the force (``stiffness``).

What is no keyword of a function is a number of the scene that it returns.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial, wraps
from typing import Any, NamedTuple

import numpy as np

from stickslip import _core
from stickslip.faults import InputError
from stickslip.scene.checks import Real, described, real_number
from stickslip.scene.contact import LAW, OF_LAW, SPRINGS, core_contact, laws_of, nearest
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.models import subsystems
from stickslip.scene.models.subsystems import Link, Subsystem
from stickslip.scene.parameters.numbers import (
    FACTORS,
    changed_parts,
    checked_numbers,
    common,
    is_number_name,
    number_of,
    per_contact,
    scene_numbers,
    unit_of_name,
)
from stickslip.scene.scene import Scene

#: A scene, or a function from named parameters to one.
Model = Scene | Callable[..., Scene]

#: Fields of a chain as a whole.
WHOLE = ("wall_stiffness", "damping")
#: Fields of the contacts of a chain.
CHAIN_LAW = tuple(name for name in LAW if name not in ("gap", "normal_force", *SPRINGS))
#: Units of the functions of `stickslip.models`; stiffnesses show theirs at the end of their names.
MODEL_UNITS = {
    "upper_mass": "kg",
    "contact_mass": "kg",
    "inclination": "rad",
    "preload_displacement": "m",
    "external_force": "N",
    "damping": "s",
}


class Slot(NamedTuple):
    """What a name stands for: a field or keyword, its place (None: everywhere), the number of places."""

    entry: str
    place: int | None
    places: int
    #: whether it is set in the scene that a function returns
    late: bool = False


@dataclass(frozen=True)
class Family:
    """The scenes that a model gives for the values of its parameters.

    Raise `InputError` if the model is neither a scene nor a function.
    """

    #: A `Scene`, or a function from keywords to one; a `functools.partial` sets some of them.
    given: Any
    #: Further arguments of the function.
    fixed: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.given, Scene) and not callable(self.given):
            raise InputError(
                f"model: expected a Scene or a function that returns one, got {described(self.given)}"
            )

    def __getstate__(self) -> dict[str, Any]:
        # What is derived is derived again.
        return {"given": self.given, "fixed": self.fixed}

    @cached_property
    def model(self) -> Model:
        """The scene, or the function without what a partial sets."""
        model: Model = self.given.func if self._is_bound else self.given
        return model

    @cached_property
    def arguments(self) -> dict[str, Any]:
        """What is set beforehand; a partial may be set again, as in a call."""
        return {**(self.given.keywords if self._is_bound else {}), **self.fixed}

    @property
    def _is_bound(self) -> bool:
        return isinstance(self.given, partial) and not self.given.args

    @property
    def is_chain(self) -> bool:
        """Whether the model is one of `stickslip.models`."""
        return self.model in (subsystems.two_subsystems, subsystems.chain)

    def compiled(self, names: Iterable[str]) -> bool:
        """Return whether scenes of these parameters are made in compiled code.

        It knows constant friction and no elements, and no number of a scene beyond those of contacts and
        loads.
        """
        if isinstance(self.model, Scene):
            known = all(number_of(self.model, name).owner != "scene" for name in names)
        else:
            known = self.is_chain and not any(self.slot(name).late for name in names)
        if not known or self.template.elements:
            return False
        return not any(laws_of(contact) for contact in self.template.contacts)

    @cached_property
    def keywords(self) -> Mapping[str, inspect.Parameter]:
        """The keywords of the function; none of a scene."""
        return inspect.signature(self.model).parameters if callable(self.model) else {}

    def slot(self, name: str) -> Slot:
        """Return what a name stands for."""
        if isinstance(self.model, Scene):
            number = number_of(self.model, name)
            place = None if number.joint else next(iter(number.places), 0)
            return Slot(number.field, place, len(self.model.contacts) if number.joint else 1)
        if self.is_chain:
            if name in self._parts:
                return self._parts[name]
            if name == "damping_stiffness":
                return Slot("damping", None, 1)
            if name not in self.keywords and is_number_name(name):
                number_of(self.template, name)
                return Slot(name, None, 1, late=True)
            if name not in self.keywords:
                raise InputError(f"{name}: the model has no such parameter{nearest(name, [*self._parts])}")
        stem, _, label = name.rpartition("_")
        taken = [one.kind for one in self.keywords.values()]
        if name in self.keywords or inspect.Parameter.VAR_KEYWORD in taken:
            return Slot(name, None, 1)
        values = self._standing(stem)
        if label.isdecimal() and np.ndim(values) == 1:
            if int(label) < len(values):
                return Slot(stem, int(label), len(values))
            raise InputError(f"{name}: {stem} has {len(values)} entries, from {stem}_0 on")
        if is_number_name(name):
            return Slot(name, None, 1, late=True)
        raise InputError(f"{name}: the model has no such parameter{nearest(name, [*self.keywords])}")

    def units(self, name: str) -> dict[str, str]:
        """Return ``{"units": ...}`` of a parameter, for labelled arrays.

        Nothing where it cannot be known: what a function of your own means by its keywords, unless they are
        those of a contact's law.
        """
        if isinstance(self.model, Scene):
            unit = number_of(self.model, name).unit
        else:
            entry, _, _, late = self.slot(name)
            if self.is_chain and not late:
                unit = MODEL_UNITS.get(entry, "N/m" if entry.endswith("_stiffness") else unit_of_name(entry))
            else:
                unit = unit_of_name(entry) if late or entry in LAW else ""
        return {"units": unit} if unit else {}

    def derivative_units(self, of: str, name: str) -> dict[str, str]:
        """Return ``{"units": ...}`` of the derivative of a quantity in units `of` to a parameter."""
        unit = self.units(name).get("units")
        if unit is None:
            return {}
        return {"units": of if unit == "1" else f"{of}/({unit})"}

    def _standing(self, keyword: str) -> Any:
        """Return the value that a keyword has if nothing is said; None if there is none."""
        if self.model is subsystems.two_subsystems:
            return subsystems.standing(self.arguments, keyword)
        if keyword in self.arguments:
            return self.arguments[keyword]
        default = self.keywords[keyword].default if keyword in self.keywords else None
        return None if default is inspect.Parameter.empty else default

    @cached_property
    def _parts(self) -> dict[str, Slot]:
        """Every number of a chain by its names."""
        chain = self._chain
        parts = len(chain["subsystems"])
        counts = dict.fromkeys((*subsystems.fields_of(Subsystem), *CHAIN_LAW), parts)
        counts |= {f"link_{name}": len(chain["links"]) for name in subsystems.fields_of(Link)}
        known = {name: Slot(name, None, 1) for name in WHOLE}
        for name, count in counts.items():
            if count:
                known[name] = Slot(name, None, count)
                known |= {f"{name}_{k}": Slot(name, k, count) for k in range(count)}
        return known

    @cached_property
    def _chain(self) -> dict[str, Any]:
        """The arguments of `chain` before any parameter is set."""
        for name in self.arguments:
            if name not in self.keywords:
                raise InputError(
                    f"fixed: {self.model.__name__} has no argument {name!r}"  # type: ignore[union-attr]
                )
        if self.model is subsystems.two_subsystems:
            return subsystems.chain_arguments(self.arguments)
        for name in ("subsystems", "links"):
            if name not in self.arguments:
                raise InputError(f"fixed: models.chain needs {name}")
        return {"wall_stiffness": 0.0, **self.arguments}

    def check(self, names: Iterable[str]) -> None:
        """Refuse names that stand for nothing, for the same number, or for friction that a law gives."""
        values = names if isinstance(names, Mapping) else dict.fromkeys(names, 0.0)
        if isinstance(self.model, Scene):
            checked_numbers(self.model, values)
            return
        seen: dict[tuple[str, int], str] = {}
        for name, value in values.items():
            entry, place, count, late = self.slot(name)
            if self.is_chain and (late or entry in LAW):
                checked_numbers(self.template, {name: value})
            for k in range(count) if place is None else [place]:
                if (entry, k) in seen:
                    raise InputError(f"parameters: {name!r} and {seen[entry, k]!r} set the same number")
                seen[entry, k] = name

    def check_angles(self, names: Sequence[str], rows: Real) -> None:
        """Refuse samples (k, names) with an inclination beyond a full turn: it must be meant in degrees."""
        for place, name in enumerate(names):
            if self.is_chain and rows.size and self.slot(name).entry == "inclination":
                subsystems.radians(name, float(rows[np.abs(rows[:, place]).argmax(), place]))

    def scene(self, values: Mapping[str, Any]) -> Scene:
        """Return the scene for some parameter values; those not given stay as they are."""
        if isinstance(self.model, Scene):
            return _changed(self.model, values)
        return _scene(self.model, *self._assigned(values))

    def replaced(self, values: Mapping[str, Any]) -> Model:
        """Return the model with other values where nothing is said."""
        self.check(values)
        if isinstance(self.model, Scene):
            return self.scene(values)
        arguments, law = self._assigned(values)
        function = self.model
        if not law:
            return partial(function, **arguments)

        @wraps(function)
        def changed(**given: Any) -> Scene:
            return _scene(function, {**arguments, **given}, law)

        return changed

    def _assigned(self, values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the arguments of the function, and what is set in the scene that it returns."""
        arguments, law = dict(self.arguments), {}
        for name, value in values.items():
            entry, place, count, late = self.slot(name)
            if late:
                law[name] = value
            elif entry in self.keywords or not self.is_chain:
                if place is not None and count > 1:
                    standing = arguments[entry] if entry in arguments else self._standing(entry)
                    entries = per_contact(entry, standing, count)
                    value = [value if k == place else old for k, old in enumerate(entries)]
                arguments[entry] = value
            else:
                group, kind = ("links", "link_") if entry.startswith("link_") else ("subsystems", "")
                values_of = per_contact(name, value, count) if place is None else {place: value}
                arguments[group] = [
                    dataclasses.replace(part, **{entry.removeprefix(kind): values_of[k]})
                    if place in (None, k)
                    else part
                    for k, part in enumerate(arguments[group])
                ]
        return arguments, law

    def value(self, name: str) -> float:
        """Return the number that a parameter has where nothing is said."""
        slot = self.slot(name)
        if isinstance(self.model, Scene) or slot.late:
            scene = self.scene({})
            ((number, _),) = checked_numbers(scene, {name: 0.0}).items()
            value = number.get(scene)
        else:
            value = common(self._values(slot))
        if value is None:
            raise InputError(
                f"{name}: has no one value to start from; give it one, such as {{{name!r}: ...}}"
            )
        return real_number(name, value)

    def _values(self, slot: Slot) -> list[Any]:
        """Return the numbers that a slot of a function stands for, as they stand."""
        entry = slot.entry
        if self.is_chain and entry in CHAIN_LAW:
            values = [getattr(contact, entry) for contact in self.template.contacts]
        elif self.is_chain and entry in WHOLE:
            values = [self._chain.get(entry, 1e-4)]
        elif self.is_chain:
            parts = self._chain["links" if entry.startswith("link_") else "subsystems"]
            values = [getattr(part, entry.removeprefix("link_")) for part in parts]
        else:
            values = per_contact(entry, self._standing(entry), slot.places)
        return values if slot.place is None else [values[slot.place]]

    def numbers(self) -> dict[str, float | None]:
        """Return every parameter that stands for one number, with its value where nothing is said.

        The value is None where it follows another, as static friction does unless it is told.
        """
        if isinstance(self.model, Scene):
            return scene_numbers(self.model)
        if self.is_chain:
            slots = {
                name: one for name, one in self._parts.items() if (one.place is None) == (one.places == 1)
            }
            values = {name: self._values(slot)[0] for name, slot in slots.items()}
            laws = {name for name, one in values.items() if isinstance(one, FrictionLaw)}
            of_laws = {
                name: value
                for name, value in scene_numbers(self.template, ("friction",)).items()
                if name.startswith(OF_LAW) and name not in self._parts
            }
            values = {name: one for name, one in values.items() if name not in laws} | of_laws
            return {name: float(one) if _is_number(one) else None for name, one in values.items()}
        found: dict[str, float | None] = {}
        for keyword in self.keywords:
            value = self._standing(keyword)
            if _is_number(value):
                found[keyword] = float(value)
            elif np.ndim(value) == 1 and len(value) and all(map(_is_number, value)):
                found |= {f"{keyword}_{k}": float(one) for k, one in enumerate(value)}
        if all(one.kind is not inspect.Parameter.VAR_KEYWORD for one in self.keywords.values()):
            own = [name for name in LAW if isinstance(self._standing(name), FrictionLaw)]
            others = scene_numbers(self.scene({}), [*own, *(one for one in LAW if one not in self.keywords)])
            found |= {name: value for name, value in others.items() if name not in self.keywords}
        return found

    @cached_property
    def template(self) -> Scene:
        """The scene of a compiled model before any parameter is set."""
        return self.model if isinstance(self.model, Scene) else subsystems.chain(**self._chain)

    def compile(self, names: Sequence[str]) -> _core.Family:
        """Return a scene or chain in compiled code: rows of numbers, in the order of `names`, to scenes."""
        following = [contact.static_friction is None for contact in self.template.contacts]
        if isinstance(self.model, Scene):
            places = [number_of(self.model, name).core_place(self.model) for name in names]
            return _core.Family.of_scene(self.model.core, places, following)
        slots = [self.slot(name)[:2] for name in names]
        chain, scene = self._chain, self.template
        return _core.Family.of_chain(
            subsystems.chain_columns(chain["subsystems"], chain["links"]),
            wall_stiffness=real_number("wall_stiffness", chain["wall_stiffness"]),
            damping=real_number("damping", chain.get("damping", 1e-4)),
            contacts=[core_contact(contact, k, scene.dofs) for k, contact in enumerate(scene.contacts)],
            impact_friction=bool(chain.get("impact_friction", False)),
            slots=slots,
            following=following,
        )


def _scene(function: Callable[..., Scene], arguments: dict[str, Any], law: dict[str, Any]) -> Scene:
    scene = function(**arguments)
    if not isinstance(scene, Scene):
        raise InputError(f"model: expected a function that returns a Scene, got {described(scene)}")
    return _changed(scene, law)


def _changed(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """Return a scene with other numbers; those that are factors become the arguments that they scale."""
    numbers = checked_numbers(scene, values)
    factors = {number: value for number, value in numbers.items() if number.field in FACTORS}
    scaled = changed_parts(scene, factors, "parameters")
    others = {number.name: value for number, value in numbers.items() if number not in factors}
    return scene.replace(**scaled, **others) if values else scene


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)
