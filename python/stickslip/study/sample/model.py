"""From a row of parameter values to a scene: in compiled code where the model is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from inspect import signature
from typing import Any

from stickslip import _core
from stickslip.errors import InputError
from stickslip.locus.path import Model, contact_parameter
from stickslip.scene import models
from stickslip.scene.checks import Real, real_number
from stickslip.scene.contact import LAW, core_contact, nearest
from stickslip.scene.models import Link, Subsystem
from stickslip.scene.scene import Scene

#: Fields of a chain as a whole.
WHOLE = ("wall_stiffness", "damping")
#: Fields of the contacts of a chain.
CHAIN_LAW = tuple(name for name in LAW if name != "gap")


@dataclass(frozen=True)
class SampledModel:
    """A model, and the names of the numbers in a row.

    Parameters
    ----------
    model
        A `Scene`, ``models.two_subsystems``, ``models.chain``, or any function from keywords to a `Scene`.
    names
        Parameters, in the order of a row: fields of the model, of all subsystems, links or contacts at once
        or of one of them (``friction``, ``friction_0``, ``vertical_stiffness_1``); keywords of a function.
    fixed
        Other arguments of the model.
    """

    model: Model
    names: tuple[str, ...]
    fixed: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.model, Scene) and not callable(self.model):
            raise InputError(f"model: expected a Scene or a function that returns one, got {self.model!r}")
        if isinstance(self.model, Scene) and self.fixed:
            raise InputError(f"fixed: a Scene takes no further arguments, got {list(self.fixed)}")
        for name in self.fixed:
            if name in self.names:
                raise InputError(f"fixed: {name!r} is a parameter of the study as well")
        seen: dict[tuple[str, int | None], str] = {}
        for name, (entry, place, count) in zip(self.names, self._slots, strict=True):
            for k in range(count) if place is None else [place]:
                if (entry, k) in seen:
                    raise InputError(f"parameters: {name!r} and {seen[entry, k]!r} set the same number")
                seen[entry, k] = name

    @property
    def compiled(self) -> bool:
        """Whether scenes are made in compiled code."""
        return isinstance(self.model, Scene) or self._is_chain

    @property
    def _is_chain(self) -> bool:
        return self.model in (models.two_subsystems, models.chain)

    @cached_property
    def _chain(self) -> dict[str, Any]:
        if self.model is models.two_subsystems:
            known = set(signature(models.two_subsystems).parameters)
            for name in self.fixed:
                if name not in known:
                    raise InputError(f"fixed: two_subsystems has no argument {name!r}")
            return models.chain_arguments(self.fixed)
        arguments = dict(self.fixed)
        for name in ("subsystems", "links", "wall_stiffness"):
            if name not in arguments and name not in self.names:
                raise InputError(f"fixed: models.chain needs {name}")
        arguments["subsystems"] = tuple(arguments.get("subsystems", ()))
        arguments["links"] = tuple(arguments.get("links", ()))
        arguments.setdefault("wall_stiffness", 0.0)
        return arguments

    @cached_property
    def _slots(self) -> tuple[tuple[str, int | None, int], ...]:
        """Field, place (None: everywhere) and number of places of every parameter; none for a function."""
        if isinstance(self.model, Scene):
            found = []
            for name in self.names:
                entry, contacts = contact_parameter(self.model, name)
                count = len(self.model.contacts)
                found.append((entry, None if name in LAW else contacts[0], count))
            return tuple(found)
        if not self._is_chain:
            return tuple((name, None, 1) for name in self.names)
        parts = len(self._chain["subsystems"])
        counts = dict.fromkeys((*models.fields_of(Subsystem), *CHAIN_LAW), parts)
        counts |= {f"link_{name}": len(self._chain["links"]) for name in models.fields_of(Link)}
        known: dict[str, tuple[str, int | None, int]] = {name: (name, None, 1) for name in WHOLE}
        for name, count in counts.items():
            known[name] = (name, None, count)
            known |= {f"{name}_{k}": (name, k, count) for k in range(count)}
        for name in self.names:
            if name not in known or known[name][2] == 0:
                raise InputError(f"{name}: the chain has no such parameter{nearest(name, list(known))}")
        return tuple(known[name] for name in self.names)

    @cached_property
    def family(self) -> _core.Family:
        """The same model in compiled code."""
        slots = [(entry, place) for entry, place, _ in self._slots]
        if isinstance(self.model, Scene):
            following = [contact.static_friction is None for contact in self.model.contacts]
            return _core.Family.of_scene(self.model.core, slots, following)
        chain = self._chain
        scene = self.template
        columns = models.chain_columns(chain["subsystems"], chain["links"])
        return _core.Family.of_chain(
            columns,
            wall_stiffness=real_number("wall_stiffness", chain["wall_stiffness"]),
            damping=real_number("damping", chain.get("damping", 1e-4)),
            contacts=[core_contact(contact, k, scene.dofs) for k, contact in enumerate(scene.contacts)],
            impact_friction=bool(chain.get("impact_friction", False)),
            slots=slots,
            following=[contact.static_friction is None for contact in scene.contacts],
        )

    @cached_property
    def template(self) -> Scene:
        """The scene of a compiled model before any parameter is set."""
        return self.model if isinstance(self.model, Scene) else models.chain(**self._chain)

    def scene(self, row: Real) -> Scene:
        """Return the scene of a row.

        Raises
        ------
        InputError
            If it is ill-posed; a function may raise anything.
        """
        values = [float(value) for value in row]
        if not self.compiled:
            scene = self.model(**self.fixed, **dict(zip(self.names, values, strict=True)))  # type: ignore[operator]
            if not isinstance(scene, Scene):
                raise InputError(f"model: expected a function that returns a Scene, got {scene!r}")
            return scene
        base = self.template
        law: dict[str, list[Any]] = {}
        chain = dict(self._chain) if self._is_chain else {}
        for (entry, place, _), value in zip(self._slots, values, strict=True):
            if entry in LAW:
                each = law.setdefault(entry, [getattr(contact, entry) for contact in base.contacts])
                law[entry] = [value if place in (None, k) else old for k, old in enumerate(each)]
            elif entry in WHOLE:
                chain[entry] = value
            else:
                group = "links" if entry.startswith("link_") else "subsystems"
                chain[group] = [
                    dataclasses.replace(part, **{entry.removeprefix("link_"): value})
                    if place in (None, k)
                    else part
                    for k, part in enumerate(chain[group])
                ]
        if isinstance(self.model, Scene):
            return base.replace(**law)
        return models.chain(**(chain | law))

    def __getstate__(self) -> dict[str, Any]:
        return {"model": self.model, "names": self.names, "fixed": self.fixed}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)


def contacts_named(scene: Scene, name: str) -> list[int]:
    """Return the contacts whose friction a parameter moves: ``friction`` all, ``friction_0`` one.

    Raises
    ------
    InputError
        If it is no friction of a contact of the scene.
    """
    entry, contacts = contact_parameter(scene, name)
    if entry != "friction":
        raise InputError(f"hopf: expected the friction of contacts, such as 'friction', got {name!r}")
    return contacts
