"""Which attractor is reached from where, and with which parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stickslip.cycles.attractors import (
    LOOKS,
    OUTSIDE,
    UNKNOWN,
    described,
    is_valid,
    settled,
    starts_from,
    stretch_of,
)
from stickslip.cycles.bifurcation import table
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, Interrupted
from stickslip.scene.checks import Real, finite_time
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import axis, divided
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, steady_sliding
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Relative difference of period and extremes up to which two cycles are one.
SAME = 1e-6


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


@dataclass(frozen=True, repr=False, eq=False)
class Basins(Shown):
    """Which attractor is reached over two initial coordinates or parameters.

    Attributes
    ----------
    map
        Index into `attractors` over (first, second) axis; -1 where the start violates its combination, -2
        where the search was interrupted before this start.
    attractors
        The attractors in order of appearance: a `Cycle`, or a word for any other motion. If a parameter is an
        axis, all cycles with the same sequence of combinations count as one attractor, given by the first.
    """

    map: xr.DataArray
    attractors: tuple[Cycle | str, ...]

    def to_dataset(self) -> xr.Dataset:
        """Return the map as ``reached``; over ``attractor`` its ``kind`` and cycle as in `bifurcation`."""
        cycles = [None if isinstance(reached, str) else reached for reached in self.attractors]
        kinds = [reached if isinstance(reached, str) else "cycle" for reached in self.attractors]
        listed = table("attractor", np.arange(len(cycles)), cycles, {})
        return listed.assign(kind=("attractor", np.array(kinds, dtype=str)), reached=self.map)

    def summary(self) -> Summary:
        """Return a table of the attractors, and from how many starts each is reached."""
        counts = [int((self.map == number).sum()) for number in range(len(self.attractors))]
        rows = [
            (str(number), reached if isinstance(reached, str) else repr(reached), count)
            for number, (reached, count) in enumerate(zip(self.attractors, counts, strict=True))
        ]
        facts = [("starts", f"{self.map.size} over {' and '.join(map(str, self.map.dims))}")]
        return Summary(facts, [Table("Attractors", ("number", "attractor", "starts"), rows)])

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the map, one shade for each attractor; return the Axes.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.cycles.diagram_figures import basins

        return basins(self.to_dataset(), ax=ax)

    def __repr__(self) -> str:
        listed = "\n".join(f"  {k}: {reached!r}" for k, reached in enumerate(self.attractors))
        return f"Basins of {len(self.attractors)} attractors\n{listed}\n{self.map!r}"


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
    valid = [k for k, (scene, state) in enumerate(cases) if is_valid(scene, state)]
    found, interruption = settled([cases[k][0] for k in valid], [cases[k][1] for k in valid], length, end)
    attractors: list[Cycle | str] = []
    of_one_scene = not arrays
    labels = np.full(len(cases), OUTSIDE)
    for k, outcome in zip(valid, found, strict=True):
        if outcome is None:
            labels[k] = UNKNOWN
            continue
        (kind, core, growth, _), message = outcome
        reached = described(kind, growth, message)[0] if core is None else Cycle(cases[k][0], core)
        labels[k] = next(
            (i for i, other in enumerate(attractors) if _is_same(reached, other, of_one_scene)),
            len(attractors),
        )
        if labels[k] == len(attractors):
            attractors.append(reached)
    labelled = xr.DataArray(
        labels.reshape(first.values.size, second.values.size),
        dims=(first.name, second.name),
        coords={one.name: (one.name, one.values, one.units(model)) for one in axes},
        name="reached",
    )
    result = Basins(labelled, tuple(attractors))
    if isinstance(interruption, KeyboardInterrupt):
        done = sum(outcome is not None for outcome in found)
        raise Interrupted(f"interrupted after {done} of {len(valid)} motions", result) from None
    if interruption is not None:
        raise interruption
    return result


def _is_same(a: Cycle | str, b: Cycle | str, of_one_scene: bool) -> bool:
    """Return whether two attractors are one; of scenes that differ, cycles with the same sequence are."""
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    if not of_one_scene:
        return _rotated(a.combinations) == _rotated(b.combinations)
    size = float(a.amplitude.max())
    apart = max(np.abs(a.core.minimum - b.core.minimum).max(), np.abs(a.core.maximum - b.core.maximum).max())
    return abs(a.period - b.period) <= SAME * a.period and apart <= SAME * size


def _rotated(sequence: tuple[str, ...]) -> tuple[str, ...]:
    """Return a sequence that recurs from the place on where it comes first in order."""
    return min((sequence[k:] + sequence[:k] for k in range(len(sequence))), default=())
