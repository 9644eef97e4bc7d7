"""Which attractor is reached from where, and with which parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import xarray as xr

from stickslip.cycles.attractors import LOOKS, OUTSIDE, starts_from, stretch_of
from stickslip.cycles.basins.reached import reached
from stickslip.cycles.basins.result import Basins
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, Interrupted
from stickslip.scene.checks import Real, finite_time
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import axis, divided
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, steady_sliding


@dataclass(frozen=True)
class _Axis:
    """Amounts to add to an initial coordinate, or values of a parameter (`kind` empty)."""

    kind: str
    of: str
    values: Real

    @property
    def name(self) -> str:
        return f"{self.kind}_{self.of}" if self.kind else self.of

    def moved(self, state: State, amount: float) -> State:
        change: dict[str | int, float] = {self.of: float(amount)}
        if self.kind == "position":
            return state.perturbed(position=change)
        return state.perturbed(velocity=change) if self.kind else state

    def units(self, model: Model) -> dict[str, str]:
        units = {"position": "m", "velocity": "m/s"}.get(self.kind)
        return Family(model).units(self.of) if units is None else {"units": units}


def basins(
    model: Model,
    parameters: Mapping[str, Any] | None = None,
    *,
    start: State | Callable[[Scene], State] | None = None,
    position: Mapping[str, Any] | None = None,
    velocity: Mapping[str, Any] | None = None,
    stretch: float | None = None,
    limit: float | None = None,
) -> Basins:
    """Return the attractor that a motion reaches, over two axes: initial coordinates or parameters.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one.
    parameters
        Values by name as for `sweep`; a parameter that is an axis has an array.
    start
        State to which amounts are added, or a function from the scene to one; None: `steady_sliding`, or
        `disturbed_sliding` where nothing is added.
    position, velocity
        Dofs with arrays of amounts to add, m and m/s.
    stretch, limit
        See `bifurcation`.

    Returns
    -------
    Basins
        The map and the attractors.

    Raises
    ------
    InputError
        If there are not exactly two axes, or a dof or parameter is unknown.
    Interrupted
        On Ctrl-C; a `KeyboardInterrupt` whose ``partial`` holds the map with -2 where nothing was computed.
    """
    arrays, fixed = divided(model, {} if parameters is None else parameters)
    given = [("position", dof, values) for dof, values in (position or {}).items()]
    given += [("velocity", dof, values) for dof, values in (velocity or {}).items()]
    given += [("", name, values) for name, values in arrays.items()]
    if len(given) != 2:
        raise InputError(
            f"basins: expected two axes, initial coordinates or parameters with arrays, got {len(given)}"
        )
    axes = [
        _Axis(kind, name, axis(f"{kind}[{name!r}]" if kind else name, values)) for kind, name, values in given
    ]
    first, second = axes
    added = any(one.kind for one in axes)
    starts, family = starts_from(steady_sliding if start is None and added else start), Family(model)
    cases = []
    for a in first.values:
        for b in second.values:
            chosen = {one.of: float(value) for one, value in ((first, a), (second, b)) if not one.kind}
            scene = family.scene({**fixed, **chosen})
            cases.append((scene, second.moved(first.moved(starts(scene), a), b)))
    length = stretch_of(cases[0][0], stretch)
    end = LOOKS * length if limit is None else finite_time("limit", limit)
    attractors: list[Cycle | str] = []
    scenes, states = [scene for scene, _ in cases], [state for _, state in cases]
    of_one_scene = not arrays
    numbers, interruption = reached(scenes, states, length, end, attractors, of_one_scene=of_one_scene)
    labelled = xr.DataArray(
        numbers.reshape(first.values.size, second.values.size),
        dims=(first.name, second.name),
        coords={one.name: (one.name, one.values, one.units(model)) for one in axes},
        name="reached",
    )
    result = Basins(
        labelled,
        tuple(attractors),
        scene=scenes[0] if of_one_scene else None,
        start=starts(scenes[0]) if of_one_scene else None,
        stretch=length,
        limit=end,
    )
    if isinstance(interruption, KeyboardInterrupt):
        done, valid = (numbers >= 0).sum(), (numbers != OUTSIDE).sum()
        raise Interrupted(f"interrupted after {done} of {valid} motions", result) from None
    if interruption is not None:
        raise interruption
    return result
