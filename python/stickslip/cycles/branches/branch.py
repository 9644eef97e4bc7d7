"""Branches of periodic orbits over given values of a parameter, stable or not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from stickslip.cycles.bifurcation import Diagram, table
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, OrbitError
from stickslip.scene.checks import described
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import SceneAt, along
from stickslip.show.summary import Summary

#: Halvings of a step along a branch before it counts as ended.
HALVINGS = 10

#: A value of the parameter and the orbit there.
Placed = tuple[float, Cycle]

Kind = Literal["period_doubling", "fold", "torus", "grazing", "switching"]


@dataclass(frozen=True, repr=False)
class BranchPoint:
    """A value of a parameter at which a periodic orbit changes.

    Attributes
    ----------
    parameter, value
        Name and value of the parameter.
    kind
        ``period_doubling`` (a multiplier at -1), ``fold`` (another one at 1), ``torus`` (a pair on the unit
        circle), ``grazing`` (an event function touches zero within a phase), ``switching`` (two events meet).
    multiplier
        The critical multiplier; nan for a change of the sequence.
    contact, event
        Contact and kind of the event by which the sequence changes beyond the point; None at other points.
    cycle
        The orbit at the point; where the branch ends there, the last one before it.
    """

    parameter: str
    value: float
    kind: Kind
    multiplier: complex
    contact: int | None
    event: str | None
    cycle: Cycle

    def __repr__(self) -> str:
        place = f"{self.kind} at {self.parameter} = {self.value:.12g}"
        if self.contact is None:
            return f"BranchPoint({place}, multiplier {self.multiplier:.6g}, {self.cycle.frequency:.6g} Hz)"
        name = self.cycle.scene.contact_labels()[self.contact]
        return f"BranchPoint({place}, contact {name}: {self.event}, {self.cycle.frequency:.6g} Hz)"


@dataclass(frozen=True, repr=False, eq=False)
class Branch(Diagram):
    """A branch of periodic orbits over a parameter.

    Attributes
    ----------
    data
        The numbers, see `follow_branch` and `trace_branch`.
    cycles
        The orbits, stable or not; None at values that the branch does not reach.
    folds
        Points at which the branch turns back; `follow_branch` does not look for them.
    end
        Why the branch ends: ``range`` (the last value was reached), ``points`` (it has as many points as were
        allowed), ``sequence`` (no orbit has this sequence of events any more) or, from `follow_branch` alone,
        ``lost`` (Newton's method finds no further orbit).

    The dataset holds neither `folds` nor `end`.
    """

    folds: tuple[BranchPoint, ...]
    end: Literal["range", "points", "sequence", "lost"]

    def summary(self) -> Summary:
        """Return how many orbits there are, how the branch ends, and a table of the orbits."""
        told = super().summary()
        return Summary([*told.facts, ("folds", str(len(self.folds))), ("end", self.end)], told.tables)

    def __repr__(self) -> str:
        found = sum(cycle is not None for cycle in self.cycles)
        return f"Branch: {found} orbits, {len(self.folds)} folds, end: {self.end}\n{self.data!r}"


def follow_branch(
    cycle: Cycle,
    parameters: Mapping[str, Any],
    model: Model | None = None,
) -> Branch:
    """Return the branch of periodic orbits through a cycle, stable or not.

    The sequence of events stays that of the cycle; Newton's method solves its equations at each value from
    the orbit at the value before, in steps halved where it fails.

    Parameters
    ----------
    cycle
        Cycle at which the branch begins; the first value should be near the value of this cycle.
    parameters
        Values by name as for `sweep`, one of them an array (k,) in the order of the branch.
    model
        A function from keywords to a `Scene`; None: the scene of the cycle.

    Returns
    -------
    Branch
        Its `data` as `bifurcation` for its cycles, and ``followed``: whether the contact laws of the scene
        hold all along the orbit. nan beyond a fold, where the branch turns back (`trace_branch` goes around
        it).

    Raises
    ------
    InputError
        If `cycle` is none, the parameter is unknown or there is not exactly one array.
    """
    checked_cycle(cycle)
    source = cycle.scene if model is None else model
    name, values, scene_at = along(source, parameters)
    orbits: list[Cycle | None] = []
    before: tuple[float, Cycle] = (float(values[0]), cycle)
    for value in values:
        try:
            orbit = continued(before, float(value), scene_at)
        except OrbitError:
            break
        orbits.append(orbit)
        before = (float(value), orbit)
    orbits += [None] * (values.size - len(orbits))
    result = table(name, values, orbits, Family(source).units(name))
    result["followed"] = (name, [orbit is not None and orbit.is_followed() for orbit in orbits])
    return Branch(result, tuple(orbits), (), "lost" if orbits[-1] is None else "range")


def checked_cycle(cycle: Any) -> None:
    """Refuse what is no cycle.

    Raises
    ------
    InputError
        Naming what it is.
    """
    if not isinstance(cycle, Cycle):
        hint = "; its limit cycle is .limit_cycle()" if hasattr(cycle, "limit_cycle") else ""
        raise InputError(f"cycle: expected a Cycle, got {described(cycle)}{hint}")


def first_orbit(cycle: Cycle, name: str, value: float, scene_at: SceneAt) -> Cycle:
    """Return the orbit at the first value of a branch, from the cycle where it begins.

    Raises
    ------
    OrbitError
        If Newton's method does not find it; the message says where to begin.
    """
    try:
        return cycle.continued(scene_at(value))
    except OrbitError as error:
        try:
            own = f", {Family(cycle.scene).value(name):g}"
        except InputError:
            own = ""
        raise OrbitError(
            f"{name}: no orbit is found at the first value, {value:g} ({error}); "
            f"begin at the value of the cycle{own}"
        ) from error


def continued(before: Placed, value: float, scene_at: SceneAt, halvings: int = HALVINGS) -> Cycle:
    """Return the orbit at a value from one nearby, in halved steps where Newton's method fails.

    Raises
    ------
    OrbitError
        If it fails however short the steps are.
    """
    try:
        return before[1].continued(scene_at(value))
    except OrbitError:
        if halvings == 0 or value == before[0]:
            raise
    middle = 0.5 * (before[0] + value)
    half = continued(before, middle, scene_at, halvings - 1)
    return continued((middle, half), value, scene_at, halvings - 1)
