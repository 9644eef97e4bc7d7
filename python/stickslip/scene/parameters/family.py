"""A model and its parameters by name: the one grammar of all questions about a parameter.

A name is one of

* a keyword of the model function, such as ``vertical_stiffness``;
* one entry of a keyword that takes an array: ``vertical_stiffness_1``;
* of ``models.chain``, a field of all its subsystems or links, or of one of them, such as
  ``link_vertical_stiffness_0``;
* a field of the contact law, of all contacts (``friction``) or of one, by index or name: ``friction_0``,
  ``friction_left``;
* a number of a load in time of a scene, by the name of the load: ``shaker_frequency``, ``load_0_amplitude``,
  ``pull_times_0``, ``pull_values_1``.

What is no keyword of a function is a field of the contacts of the scene that it returns.
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
from stickslip.scene import models
from stickslip.scene.checks import Real, described, real_number
from stickslip.scene.contact import LAW, SPRINGS, Contact, core_contact, nearest
from stickslip.scene.laws.friction import Law
from stickslip.scene.laws.of_contacts import (
    OF_LAW,
    check_laws_kept,
    concerns,
    law_entry,
    law_number,
    law_numbers,
    per_contact,
)
from stickslip.scene.loads.of_scene import NUMBERS, SWITCHED, core_place, load_number, load_parameters
from stickslip.scene.models import Link, Subsystem
from stickslip.scene.scene import Scene

#: A scene, or a function from named parameters to one.
Model = Scene | Callable[..., Scene]

#: Fields of a chain as a whole.
WHOLE = ("wall_stiffness", "damping")
#: Fields of the contacts of a chain.
CHAIN_LAW = tuple(name for name in LAW if name not in ("gap", "normal_force", *SPRINGS))


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

    Parameters
    ----------
    given
        A `Scene`, or a function from keywords to one; a `functools.partial` sets some of them.
    fixed
        Further arguments of the function.

    Raises
    ------
    InputError
        If it is neither.
    """

    given: Any
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
        is_bound = isinstance(self.given, partial) and not self.given.args
        model: Model = self.given.func if is_bound else self.given
        return model

    @cached_property
    def arguments(self) -> dict[str, Any]:
        """What is set beforehand; a partial may be set again, as in a call."""
        is_bound = isinstance(self.given, partial) and not self.given.args
        return {**(self.given.keywords if is_bound else {}), **self.fixed}

    @property
    def is_chain(self) -> bool:
        """Whether the model is one of `stickslip.models`."""
        return self.model in (models.two_subsystems, models.chain)

    @property
    def compiled(self) -> bool:
        """Whether scenes are made in compiled code, which knows constant friction alone."""
        if not (isinstance(self.model, Scene) or self.is_chain):
            return False
        return not any(isinstance(contact.friction, Law) for contact in self.template.contacts)

    @cached_property
    def keywords(self) -> Mapping[str, inspect.Parameter]:
        """The keywords of the function; none of a scene."""
        return inspect.signature(self.model).parameters if callable(self.model) else {}

    def slot(self, name: str) -> Slot:
        """Return what a name stands for.

        Raises
        ------
        InputError
            If it stands for nothing; the message offers the nearest names.
        """
        if isinstance(self.model, Scene):
            loads = load_parameters(self.model.loads, self.model.contacts)
            if name in loads:
                return Slot(*core_place(self.model.loads, self.model.contacts, *loads[name]), 1)
            entry, place = law_entry(self.model.contacts, name)
            chosen = self.model.contacts if place is None else [self.model.contacts[place]]
            if entry in SPRINGS and not any(concerns(entry, contact) for contact in chosen):
                raise InputError(f"{name}: a rigid contact has no {entry} to vary; give it one")
            return Slot(entry, place, len(self.model.contacts))
        if self.is_chain:
            if name in self._parts:
                return self._parts[name]
            if name not in self.keywords and name.startswith(OF_LAW):
                law_entry(self.template.contacts, name)
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
        is_load = any(name.rstrip("_0123456789").endswith(f"_{number}") for number in (*NUMBERS, *SWITCHED))
        if is_load or name in LAW or any(name.startswith(f"{entry}_") for entry in LAW):
            return Slot(name, None, 1, late=True)
        raise InputError(f"{name}: the model has no such parameter{nearest(name, [*self.keywords])}")

    def _standing(self, keyword: str) -> Any:
        """Return the value that a keyword has if nothing is said; None if there is none."""
        if self.model is models.two_subsystems:
            return models.standing(self.arguments, keyword)
        if keyword in self.arguments:
            return self.arguments[keyword]
        default = self.keywords[keyword].default if keyword in self.keywords else None
        return None if default is inspect.Parameter.empty else default

    @cached_property
    def _parts(self) -> dict[str, Slot]:
        """Every number of a chain by its names."""
        chain = self._chain
        parts = len(chain["subsystems"])
        counts = dict.fromkeys((*models.fields_of(Subsystem), *CHAIN_LAW), parts)
        counts |= {f"link_{name}": len(chain["links"]) for name in models.fields_of(Link)}
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
        if self.model is models.two_subsystems:
            return models.chain_arguments(self.arguments)
        for name in ("subsystems", "links"):
            if name not in self.arguments:
                raise InputError(f"fixed: models.chain needs {name}")
        return {"wall_stiffness": 0.0, **self.arguments}

    def check(self, names: Iterable[str]) -> None:
        """Refuse names that stand for nothing, for the same number, or for friction that a law gives.

        Raises
        ------
        InputError
            Naming one of them, or both.
        """
        seen: dict[tuple[str, int], str] = {}
        for name in names:
            entry, place, count, _ = self.slot(name)
            value = names[name] if isinstance(names, Mapping) else 0.0
            check_laws_kept(self._own_contacts, entry, place, value)
            for k in range(count) if place is None else [place]:
                if (entry, k) in seen:
                    raise InputError(f"parameters: {name!r} and {seen[entry, k]!r} set the same number")
                seen[entry, k] = name

    @cached_property
    def _own_contacts(self) -> Sequence[Contact]:
        """The contacts before any parameter is set; none of a function that makes them itself."""
        return self.template.contacts if isinstance(self.model, Scene) or self.is_chain else ()

    def check_angles(self, names: Sequence[str], rows: Real) -> None:
        """Refuse samples (k, names) with an inclination beyond a full turn: it must be meant in degrees.

        Raises
        ------
        InputError
            Naming the parameter and the largest angle.
        """
        for place, name in enumerate(names):
            if self.is_chain and rows.size and self.slot(name).entry == "inclination":
                models.radians(name, float(rows[np.abs(rows[:, place]).argmax(), place]))

    def scene(self, values: Mapping[str, Any]) -> Scene:
        """Return the scene for some parameter values; those not given stay as they are.

        Raises
        ------
        InputError
            If a name is unknown, or the scene ill-posed; a function may raise anything.
        """
        if isinstance(self.model, Scene):
            self.check(values)
            return self.model.replace(**values) if values else self.model
        arguments, law = self._assigned(values)
        return _scene(self.model, arguments, law)

    def replaced(self, values: Mapping[str, Any]) -> Model:
        """Return the model with other values where nothing is said.

        Raises
        ------
        InputError
            If a name is unknown, or two of them set the same number.
        """
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
        """Return the number that a parameter has where nothing is said.

        Raises
        ------
        InputError
            If it has none, or several.
        """
        entry, place, count, late = self.slot(name)
        if isinstance(self.model, Scene):
            entry, late = name, True
        if late:
            scene = self.scene({})
            loads = load_parameters(scene.loads, scene.contacts)
            if name in loads:
                return real_number(name, load_number(scene.loads, scene.contacts, name))
            entry, place = law_entry(scene.contacts, entry)
            check_laws_kept(scene.contacts, entry, place)
            numbers = [law_number(contact, entry) for contact in scene.contacts]
            if place is None:
                numbers = [
                    number for number, c in zip(numbers, scene.contacts, strict=True) if concerns(entry, c)
                ]
        else:
            numbers = per_contact(name, self._standing(entry), count)
        wanted = set(numbers) if place is None else {numbers[place]}
        (number,) = wanted if len(wanted) == 1 else (None,)
        if number is None:
            raise InputError(
                f"{name}: has no one value to start from; give it one, such as {{{name!r}: ...}}"
            )
        return real_number(name, number)

    def numbers(self) -> dict[str, float | None]:
        """Return every parameter that stands for one number, with its value where nothing is said.

        The value is None where it follows another, as static friction does unless it is told.
        """
        if isinstance(self.model, Scene):
            return law_numbers(self.model.contacts, LAW)
        if self.is_chain:
            singles = {
                name: slot for name, slot in self._parts.items() if (slot.place is None) == (slot.places == 1)
            }
            return {name: self._chain_number(*slot[:2]) for name, slot in singles.items()}
        found: dict[str, float | None] = {}
        for keyword in self.keywords:
            value = self._standing(keyword)
            if _is_number(value):
                found[keyword] = float(value)
            elif np.ndim(value) == 1 and len(value) and all(map(_is_number, value)):
                found |= {f"{keyword}_{k}": float(one) for k, one in enumerate(value)}
        if all(one.kind is not inspect.Parameter.VAR_KEYWORD for one in self.keywords.values()):
            found |= law_numbers(self.scene({}).contacts, [name for name in LAW if name not in self.keywords])
        return found

    def _chain_number(self, entry: str, place: int | None) -> float | None:
        chain, at = self._chain, place or 0
        if entry in WHOLE:
            return float(chain.get(entry, 1e-4))
        if entry in CHAIN_LAW:
            value = getattr(self.template.contacts[at], entry)
            return None if value is None or isinstance(value, Law) else float(value)
        part = chain["links"] if entry.startswith("link_") else chain["subsystems"]
        return float(getattr(part[at], entry.removeprefix("link_")))

    @cached_property
    def template(self) -> Scene:
        """The scene of a compiled model before any parameter is set."""
        return self.model if isinstance(self.model, Scene) else models.chain(**self._chain)

    def compile(self, names: Sequence[str]) -> _core.Family:
        """Return a scene or chain in compiled code: rows of numbers, in the order of `names`, to scenes."""
        slots = [self.slot(name)[:2] for name in names]
        following = [contact.static_friction is None for contact in self.template.contacts]
        if isinstance(self.model, Scene):
            return _core.Family.of_scene(self.model.core, slots, following)
        chain, scene = self._chain, self.template
        return _core.Family.of_chain(
            models.chain_columns(chain["subsystems"], chain["links"]),
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
    loads = load_parameters(scene.loads, scene.contacts)
    for name in law:
        if name not in loads:
            check_laws_kept(scene.contacts, *law_entry(scene.contacts, name), law[name])
    return scene.replace(**law) if law else scene


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)
