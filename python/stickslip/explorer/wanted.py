"""What a page asks for: read from JSON, every name and number checked before anything is computed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stickslip.cycles.attractors import at_rest, is_valid, set_in_motion
from stickslip.explorer.knobs import Knob, joint, knobs, ordinates
from stickslip.faults import InputError
from stickslip.files.case import Case
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.scene.drawing.schematic import Schematic, structure
from stickslip.scene.known import Known
from stickslip.scene.parameters.family import Family
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, steady_sliding
from stickslip.show.style import COLOURS, HATCHES, NAMES, STABLE, STYLES, UNSTABLE

#: Computing time of a motion while a point is dragged and when it has come to rest, s.
PATIENCE = (0.02, 5.0)
#: Values of a parameter over which loci are followed, cells of a map in one direction, s of sound.
VALUES, CELLS, SECONDS = (5, 301), (3, 96), (0.1, 20.0)
#: Lines searched for curves in one direction of the map.
SEARCHED = (2, 32)
#: Dofs whose displacements go to the page of a scene without a mesh.
DOFS = 64
#: Kinds of starts.
STARTS = ("file", "mode", "kick", "on")


class MalformedError(ValueError):
    """A message that no page of this package sends."""


@dataclass(frozen=True, eq=False)
class Explored:
    """The model that a page explores."""

    #: The model with its start and the settings of its run.
    case: Case
    #: What is known of the scene beyond its numbers.
    known: Known
    #: What the page calls it.
    title: str
    #: Lowest and highest frequency of the modes that count, Hz; None: all count.
    band: tuple[float, float] | None = None

    @cached_property
    def family(self) -> Family:
        """The scenes that it gives."""
        return Family(self.case.model)

    @property
    def scene(self) -> Scene:
        """The scene, with every parameter as it stands."""
        return self.case.scene

    @cached_property
    def knobs(self) -> dict[str, Knob]:
        """Its parameters."""
        return knobs(self.family)

    @cached_property
    def joint(self) -> dict[str, list[str]]:
        """Names that set several parameters together."""
        return joint(self.family, self.knobs)

    @cached_property
    def schematic(self) -> Schematic:
        """The drawing of the scene: its mesh, where one is known and not too fine."""
        return structure(self.scene, self.known.columns)

    @cached_property
    def sent(self) -> list[int]:
        """The dofs that move the bodies of the drawing."""
        moving = {dof for body in self.schematic.bodies for dof, _, _ in body.along}
        return sorted(moving)[: None if self.schematic.faces else DOFS]

    @cached_property
    def told(self) -> dict[str, Any]:
        """What a page is told once."""
        scene, drawing = self.scene, self.schematic
        given = self.case.start or self.known.start is not None
        return {
            "title": self.title,
            "band": self.band,
            "dofs": list(scene.dofs),
            "sent": self.sent,
            "contacts": [str(label) for label in scene.contact_labels()],
            "knobs": [vars(knob) for knob in self.knobs.values()],
            "joint": self.joint,
            "ordinates": ordinates(self.family, self.knobs),
            "start": "file" if given else "mode",
            "bodies": [vars(body) for body in drawing.bodies],
            "springs": drawing.springs,
            "walls": drawing.walls,
            "faces": drawing.faces,
            "statuses": [
                {
                    "letter": letter,
                    "name": NAMES[letter],
                    "colour": COLOURS[letter],
                    "style": STYLES[letter],
                    "hatch": HATCHES[letter],
                }
                for letter in COLOURS
                if letter != "o" or scene.core.has_planes
            ],
            "colours": {"stable": STABLE, "unstable": UNSTABLE},
        }


@dataclass(frozen=True)
class Wanted:
    """A message of the page; `MalformedError` is raised where an entry is of another kind than it must be."""

    explored: Explored
    message: Mapping[str, Any]
    #: Lets other messages be computed first; raises `ConnectionError` where the page waits no longer.
    pause: Callable[[], None] = lambda: None

    def __post_init__(self) -> None:
        if not isinstance(self.message, dict):
            raise MalformedError("expected an object")

    @cached_property
    def values(self) -> dict[str, float | None]:
        """Every parameter that is set."""
        given = self.message.get("values", {})
        if not isinstance(given, dict):
            raise MalformedError("values: expected an object")
        return {
            self._of("values", name, self.explored.knobs): None
            if value is None
            else finite(f"values.{name}", value)
            for name, value in given.items()
        }

    @property
    def changed(self) -> dict[str, float]:
        """The parameters that differ from where they stand in the model."""
        knobs = self.explored.knobs
        return {
            name: value
            for name, value in self.values.items()
            if value is not None and value != knobs[name].value
        }

    def scene(self) -> Scene:
        """Return the scene at these values; `InputError` where it is ill-posed."""
        changed = self.changed
        return self.explored.family.scene(changed) if changed else self.explored.scene

    def axis(self, name: str) -> tuple[str, float, float]:
        """Return a parameter and its range."""
        given = self.message.get(name)
        if not isinstance(given, list) or len(given) != 3:
            raise MalformedError(f"{name}: expected [parameter, low, high]")
        parameter = self._of(name, given[0], {**self.explored.knobs, **self.explored.joint})
        low, high = finite(name, given[1]), finite(name, given[2])
        if not low < high:
            raise MalformedError(f"{name}: expected low < high")
        return parameter, low, high

    def fixed(self, *moved: str) -> dict[str, float]:
        """Return the values that stay while some parameters move."""
        gone = {single for name in moved for single in (name, *self.explored.joint.get(name, ()))}
        return {name: value for name, value in self.changed.items() if name not in gone}

    def whole(self, name: str, bounds: tuple[int, int]) -> int:
        """Return a whole number within bounds."""
        given = self.message.get(name)
        if not isinstance(given, int) or isinstance(given, bool) or not bounds[0] <= given <= bounds[1]:
            raise MalformedError(f"{name}: expected a whole number from {bounds[0]} to {bounds[1]}")
        return given

    def number(self, name: str, bounds: tuple[float, float]) -> float:
        """Return a number, moved to the nearest one within bounds."""
        return min(max(finite(name, self.message.get(name)), bounds[0]), bounds[1])

    def contact(self) -> int:
        """Return the index of a contact."""
        return self.whole("contact", (0, len(self.explored.scene.contacts) - 1))

    def dof(self) -> int:
        """Return the index of the dof whose history and spectrum are shown."""
        return self.whole("dof", (0, self.explored.scene.size - 1))

    def steady(self, scene: Scene) -> tuple[State, Modes, str]:
        """Return the equilibrium that motions start about, its modes, and "" or why it is no steady sliding.

        Where a slider rests, its contact sticks in that equilibrium.
        """
        try:
            state: State = steady_sliding(scene)
            reason = ""
        except InputError as error:
            reason = str(error)
            try:
                state = at_rest(scene)
            except InputError:
                raise error from None
        modes = complex_modes(scene, state.combination, band=self.explored.band)
        return state, modes, reason

    def start(self, scene: Scene, equilibrium: State, modes: Modes) -> tuple[State, str]:
        """Return where the motion starts, and a remark where that is not what was asked for."""
        given = self.message.get("start")
        if not isinstance(given, dict):
            raise MalformedError("start: expected an object")
        kind = self._of("start", given.get("kind"), STARTS)
        if kind == "file" and self.explored.case.start:
            return self.explored.case.started(equilibrium), ""
        if kind == "file" and self.explored.known.start is not None:
            moved = self.explored.known.start.velocity
            return equilibrium.perturbed(velocity=moved), ""
        if kind == "kick":
            dof = given.get("dof")
            if not isinstance(dof, int) or isinstance(dof, bool) or not 0 <= dof < scene.size:
                raise MalformedError("start.dof: expected the index of a dof")
            return equilibrium.perturbed(velocity={dof: finite("start.velocity", given.get("velocity"))}), ""
        if kind == "on":
            state = self._state(given, scene)
            if is_valid(scene, state):
                return state, ""
            return _disturbed(scene, equilibrium, modes), (
                "The motion shown before violates a contact here, so this one starts anew."
            )
        return _disturbed(scene, equilibrium, modes), ""

    def _state(self, given: Mapping[str, Any], scene: Scene) -> State:
        def vector(name: str) -> list[float]:
            entries = given.get(name)
            if not isinstance(entries, list) or len(entries) != scene.size:
                raise MalformedError(f"start.{name}: expected {scene.size} numbers")
            return [finite(f"start.{name}", entry) for entry in entries]

        letters = given.get("combination")
        if (
            not isinstance(letters, str)
            or len(letters) != len(scene.contacts)
            or not set(letters) <= set("+-sdo")
        ):
            raise MalformedError("start.combination: expected one letter of + - s d per contact")
        return State(vector("position"), vector("velocity"), letters, scene.dofs)

    def _of(self, place: str, name: Any, allowed: Mapping[str, Any] | Sequence[str]) -> str:
        if not isinstance(name, str) or name not in allowed:
            raise MalformedError(f"{place}: unknown name")
        return name


def _disturbed(scene: Scene, equilibrium: State, modes: Modes) -> State:
    """Return an equilibrium with its leading mode set in motion, or as it is where contacts stick in it."""
    return equilibrium if "s" in equilibrium.combination else set_in_motion(scene, equilibrium, modes)


def finite(place: str, value: Any) -> float:
    """Return a finite number."""
    try:
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
    except OverflowError:
        # An integer beyond the largest float is not finite either.
        pass
    raise MalformedError(f"{place}: expected a finite number")
