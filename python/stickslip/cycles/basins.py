"""Which attractor is reached from where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from stickslip.cycles.attractors import LOOKS, described, is_valid, positive_time, settled, stretch_of
from stickslip.cycles.bifurcation import table
from stickslip.cycles.cycle import Cycle
from stickslip.errors import InputError, SearchInterrupted
from stickslip.scene.checks import real_array
from stickslip.scene.scene import Scene
from stickslip.scene.state import State

#: Relative difference of period and extremes up to which two cycles are one.
SAME = 1e-6
#: Labels of starts that violate their combination, and of those that an interrupt came before.
OUTSIDE, UNKNOWN = -1, -2


@dataclass(frozen=True, repr=False, eq=False)
class Basins:
    """Which attractor is reached over two initial coordinates.

    Attributes
    ----------
    map
        Index into `attractors` (first, second), -1 where the start violates its combination, -2 where an
        interrupt came before.
    attractors
        In order of appearance: a `Cycle`, or a word for anything else.
    """

    map: xr.DataArray
    attractors: tuple[Cycle | str, ...]

    def to_dataset(self) -> xr.Dataset:
        """Return the map as ``reached``; over ``attractor`` its ``kind`` and cycle as in `bifurcation`."""
        cycles = [None if isinstance(reached, str) else reached for reached in self.attractors]
        kinds = [reached if isinstance(reached, str) else "cycle" for reached in self.attractors]
        listed = table("attractor", np.arange(len(cycles)), cycles, {})
        return listed.assign(kind=("attractor", np.array(kinds, dtype=str)), reached=self.map)

    def __repr__(self) -> str:
        listed = "\n".join(f"  {k}: {reached!r}" for k, reached in enumerate(self.attractors))
        return f"Basins of {len(self.attractors)} attractors\n{listed}\n{self.map!r}"


def basins(
    scene: Scene,
    start: State,
    *,
    position: dict[str, Any] | None = None,
    velocity: dict[str, Any] | None = None,
    stretch: float | None = None,
    limit: float | None = None,
) -> Basins:
    """Return which attractor is reached over two initial coordinates.

    Parameters
    ----------
    scene
        The scene.
    start
        State to which the values are added.
    position, velocity
        Two dofs in all, each with an array of amounts to add, m and m/s.
    stretch, limit
        See `bifurcation`.

    Returns
    -------
    Basins
        The map and the attractors.

    Raises
    ------
    InputError
        If there are not exactly two axes, or a dof is unknown.
    SearchInterrupted
        On Ctrl-C; a `KeyboardInterrupt` whose ``partial`` holds the map with -2 where nothing was computed.
    """
    axes = [("position", dof, values) for dof, values in (position or {}).items()]
    axes += [("velocity", dof, values) for dof, values in (velocity or {}).items()]
    if len(axes) != 2:
        raise InputError(f"basins: expected two initial coordinates, got {len(axes)}")
    (kind_a, dof_a, amounts_a), (kind_b, dof_b, amounts_b) = axes
    first = real_array(f"{kind_a}[{dof_a!r}]", amounts_a, 1)
    second = real_array(f"{kind_b}[{dof_b!r}]", amounts_b, 1)
    length = stretch_of(scene, stretch)
    end = LOOKS * length if limit is None else positive_time("limit", limit)
    states = [
        _displaced(_displaced(start, kind_a, dof_a, a), kind_b, dof_b, b) for a in first for b in second
    ]
    valid = [k for k, state in enumerate(states) if is_valid(scene, state)]
    found, interruption = settled([scene] * len(valid), [states[k] for k in valid], length, end)
    attractors: list[Cycle | str] = []
    labels = np.full(len(states), OUTSIDE)
    for k, outcome in zip(valid, found, strict=True):
        if outcome is None:
            labels[k] = UNKNOWN
            continue
        (kind, core, growth, _), message = outcome
        reached = described(kind, growth, message)[0] if core is None else Cycle(scene, core)
        labels[k] = next(
            (i for i, other in enumerate(attractors) if _is_same(reached, other)), len(attractors)
        )
        if labels[k] == len(attractors):
            attractors.append(reached)
    names = (f"{kind_a}_{dof_a}", f"{kind_b}_{dof_b}")
    labelled = xr.DataArray(
        labels.reshape(first.size, second.size),
        dims=names,
        coords={
            names[0]: (names[0], first, {"units": "m" if kind_a == "position" else "m/s"}),
            names[1]: (names[1], second, {"units": "m" if kind_b == "position" else "m/s"}),
        },
        name="reached",
    )
    result = Basins(labelled, tuple(attractors))
    if isinstance(interruption, KeyboardInterrupt):
        done = sum(outcome is not None for outcome in found)
        raise SearchInterrupted(result, done, len(valid)) from None
    if interruption is not None:
        raise interruption
    return result


def _displaced(state: State, kind: str, dof: str, amount: float) -> State:
    change: dict[str | int, float] = {dof: float(amount)}
    return state.perturbed(position=change) if kind == "position" else state.perturbed(velocity=change)


def _is_same(a: Cycle | str, b: Cycle | str) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    size = float(a.amplitude.max())
    apart = max(np.abs(a.core.minimum - b.core.minimum).max(), np.abs(a.core.maximum - b.core.maximum).max())
    return abs(a.period - b.period) <= SAME * a.period and apart <= SAME * size
