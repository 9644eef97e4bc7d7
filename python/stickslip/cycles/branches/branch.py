"""A branch of periodic orbits over a parameter, its points, and steps along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import xarray as xr

from stickslip.cycles.bifurcation import Diagram, table
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, OrbitError
from stickslip.scene.checks import described
from stickslip.scene.parameters.family import Family
from stickslip.scene.parameters.values import SceneAt, parameter_of
from stickslip.show.summary import Summary, Table

#: Halvings of a step along a branch before it counts as ended.
HALVINGS = 10
#: Parts of the range at whose ends the first orbit of a branch is looked for.
STARTS = 16

#: A value of the parameter and the orbit there.
Placed = tuple[float, Cycle]

Kind = Literal["period_doubling", "fold", "torus", "grazing", "switching", "hopf"]
#: Why a branch ends.
End = Literal["range", "points", "sequence", "hopf"]


@dataclass(frozen=True, repr=False)
class BranchPoint:
    """A value of a parameter at which a periodic orbit changes.

    Attributes
    ----------
    parameter, value
        Name and value of the parameter.
    kind
        ``period_doubling`` (a multiplier at -1), ``fold`` (another one at 1), ``torus`` (a pair on the unit
        circle), ``grazing`` (an event function touches zero within a phase), ``switching`` (two events meet),
        ``hopf`` (the orbit shrinks into a steady state).
    multiplier
        The critical multiplier; nan for a change of the sequence, 1 at a Hopf point.
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

    @property
    def described(self) -> str:
        """The critical multiplier, or the event by which the sequence changes, and the frequency."""
        if self.contact is None:
            return f"multiplier {self.multiplier:.6g}, {self.cycle.frequency:.6g} Hz"
        name = self.cycle.scene.contact_labels()[self.contact]
        return f"contact {name}: {self.event}, {self.cycle.frequency:.6g} Hz"

    def __repr__(self) -> str:
        return f"BranchPoint({self.kind} at {self.parameter} = {self.value:.12g}, {self.described})"


@dataclass(frozen=True, repr=False, eq=False)
class Branch(Diagram):
    """A branch of periodic orbits over a parameter, stable or not.

    Attributes
    ----------
    data
        The numbers over ``point``, see `continuation`.
    cycles
        The orbits.
    points
        Where the branch changes, in its order: folds, period doublings, tori, changes of the event sequence,
        and the Hopf point at which it ends.
    end
        Why the branch ends: ``range`` (the last value was reached), ``points`` (it has as many points as were
        allowed), ``sequence`` (no orbit has this sequence of events any more), or ``hopf`` (the orbits shrink
        into a steady state at the Hopf point that is the last of `points`).

    The dataset holds neither `points` nor `end`; a file that `save` writes holds both, and the orbits.
    """

    points: tuple[BranchPoint, ...]
    end: End

    @property
    def parameter(self) -> str:
        """Name of the parameter."""
        return parameter_of(self.data.period)

    @property
    def folds(self) -> tuple[BranchPoint, ...]:
        """Those of `points` at which the branch turns back."""
        return tuple(point for point in self.points if point.kind == "fold")

    def at(self, value: float) -> tuple[Cycle, ...]:
        """Return the orbits of the branch at exactly this value of the parameter, see `continuation`."""
        values = self.data[self.parameter].to_numpy()
        return tuple(
            orbit for place, orbit in zip(values, self.cycles, strict=True) if orbit and place == value
        )

    def summary(self) -> Summary:
        """Return how many orbits there are, how the branch ends, its points, and a table of the orbits."""
        whole = super().summary()
        rows = [(point.kind, point.value, point.described) for point in self.points]
        found = [Table("Points of the branch", ("kind", self.parameter, ""), rows)] if rows else []
        return Summary([*whole.facts, ("end", self.end)], [*found, *whole.tables])

    def __repr__(self) -> str:
        kinds = ", ".join(point.kind for point in self.points) or "none"
        return f"Branch: {len(self.cycles)} orbits, points: {kinds}, end: {self.end}\n{self.data!r}"


def along_branch(name: str, placed: Sequence[Placed], units: dict[str, str]) -> xr.Dataset:
    """Return orbits over ``point``, with a parameter as a coordinate, and whether the contact laws hold."""
    values = np.array([value for value, _ in placed])
    cycles = [cycle for _, cycle in placed]
    data = table("point", np.arange(values.size), cycles, {}).assign_coords({name: ("point", values, units)})
    data["followed"] = ("point", [cycle.is_followed() for cycle in cycles])
    return data


def checked_cycle(cycle: Any) -> None:
    """Refuse what is no cycle.

    Raise `InputError` naming what it is.
    """
    if not isinstance(cycle, Cycle):
        hint = "; its limit cycle is .limit_cycle()" if hasattr(cycle, "limit_cycle") else ""
        raise InputError(f"cycle: expected a Cycle, got {described(cycle)}{hint}")


def first_orbit(cycle: Cycle, name: str, ends: tuple[float, float], scene_at: SceneAt) -> Cycle:
    """Return the orbit at the first value of a branch, reached in steps where it is far from the cycle's own.

    Raise `OrbitError` if it is not found, or its phases do not follow each other; the message says where to
    begin.
    """
    begin, end = ends
    try:
        own: float | None = Family(cycle.scene).value(name)
    except InputError:
        own = None
    # A function of its own does not tell the value of the cycle: the first one that Newton's method reaches.
    starts = [begin, *(np.linspace(begin, end, STARTS + 1)[1:].tolist() if own is None else [own])]
    reason: OrbitError | None = None
    for start in starts:
        try:
            near = cycle.continued(scene_at(start))
            first = near if start == begin else continued((start, near), begin, scene_at)
            if first.core.orbit().shortest < 0.0:
                raise OrbitError("the phases of the orbit no longer follow each other")
        except OrbitError as error:
            reason = error
        else:
            return first
    raise OrbitError(
        f"{name}: no orbit is found at the first value, {begin:g} ({reason}); "
        f"begin at the value of the cycle{'' if own is None else f', {own:g}'}"
    ) from reason


def continued(before: Placed, value: float, scene_at: SceneAt, halvings: int = HALVINGS) -> Cycle:
    """Return the orbit at a value from one nearby, in halved steps where Newton's method fails.

    Raise `OrbitError` if it fails however short the steps are.
    """
    try:
        return before[1].continued(scene_at(value))
    except OrbitError:
        if halvings == 0 or value == before[0]:
            raise
    middle = 0.5 * (before[0] + value)
    half = continued(before, middle, scene_at, halvings - 1)
    return continued((middle, half), value, scene_at, halvings - 1)
