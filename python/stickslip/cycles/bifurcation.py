"""What a motion settles to over a parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stickslip.cycles.attractors import (
    LOOKS,
    Outcome,
    described,
    is_valid,
    settled,
    starts_from,
    stretch_of,
)
from stickslip.cycles.cycle import Cycle
from stickslip.faults import Interrupted
from stickslip.scene.checks import Index, Real, finite_time
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import along, parameter_of
from stickslip.scene.scene import Scene
from stickslip.scene.state import State
from stickslip.show.summary import Shown, Summary, Table
from stickslip.show.units import TIMES, suited

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, repr=False, eq=False)
class Diagram(Shown):
    """Cycles over a parameter: the numbers and, at every value, the `Cycle` or None."""

    data: xr.Dataset
    cycles: tuple[Cycle | None, ...]

    def to_dataset(self) -> xr.Dataset:
        """Return the numbers."""
        return self.data

    def summary(self) -> Summary:
        """Return how many cycles there are, and a table of them."""
        name = parameter_of(self.data.period)
        periods = [cycle.period for cycle in self.cycles if cycle is not None]
        unit, per_second = suited(max(periods, default=0.0), TIMES)
        rows = [
            (
                f"{value:.6g}",
                "no cycle" if cycle is None else cycle.stability,
                *(("", "") if cycle is None else (per_second * cycle.period, " ".join(cycle.combinations))),
            )
            for value, cycle in zip(self.data[name].to_numpy(), self.cycles, strict=True)
        ]
        headings = (name, "stability", f"period, {unit}", "combinations")
        count = sum(cycle is not None for cycle in self.cycles)
        return Summary([("cycles", f"{count} at {len(rows)} values")], [Table("Cycles", headings, rows)])

    def plot(self, dof: str | None = None, *, ax: Axes | None = None) -> Axes:
        """Draw the amplitude of a dof over the parameter; return the Axes.

        Parameters
        ----------
        dof
            Name of the dof; None: the one with the largest amplitude.
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.cycles.diagram_figures import bifurcation

        return bifurcation(self.data, dof, ax=ax)


@dataclass(frozen=True, repr=False, eq=False)
class Bifurcation(Diagram):
    """What motions settle to over a parameter.

    Attributes
    ----------
    data
        The numbers, see `bifurcation`.
    cycles
        The `Cycle` at every value of the parameter; None where there is none.
    """

    def __repr__(self) -> str:
        found = sum(cycle is not None for cycle in self.cycles)
        return f"Bifurcation: {found} cycles at {len(self.cycles)} values\n{self.data!r}"


def bifurcation(
    model: Model,
    parameters: Mapping[str, Any],
    *,
    start: State | Callable[[Scene], State] | None = None,
    follow: bool = False,
    stretch: float | None = None,
    limit: float | None = None,
) -> Bifurcation:
    """Return the motions that a scene settles to, over a parameter.

    Every motion is simulated until it recurs, and Newton's method refines the recurrence to a periodic orbit
    (`Trajectory.limit_cycle`). Without `follow`, the motions at different values are independent and run on
    all processors.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one.
    parameters
        Values by name as for `sweep`, one of them an array (k,).
    start
        Where every motion starts: a state, or a function from the scene to one; None: `disturbed_sliding`.
    follow
        Whether each motion starts from the orbit to which the motion at the value before has settled, in the
        order given. The motions then stay on one branch, as under hysteresis. Where no state of that orbit
        satisfies the new scene, the motion begins at `start`, and ``restarted`` is True.
    stretch
        Duration of the motion, s, before the search for a recurrence begins; later searches wait longer.
        None: 60 periods of the slowest mode of sliding at the first value.
    limit
        Duration, s, after which a motion counts as not recurring; None: 30 stretches.

    Returns
    -------
    Bifurcation
        Its `data` over the parameter: ``kind`` (``cycle``, or what `NotPeriodicError` calls it); of cycles,
        else nan or empty: ``period`` s, ``main_frequency`` Hz, ``period_doubled``, ``stable`` (False where
        that is not known), ``stability`` (``stable``, ``unstable``, or why that is not known), ``sequence``
        of combinations, ``largest_multiplier`` (modulus, without the one that is 1), complex ``multiplier``
        (parameter, order), ``amplitude``, ``minimum``, ``maximum`` (parameter, dof) m; of others ``exponent``
        and ``exponent_error``, the largest Lyapunov exponent across the flow and its standard error, 1/s;
        ``restarted``. Its `cycles` are the `Cycle` of every value, or None.

    Raises
    ------
    InputError
        If the parameter is unknown, there is not exactly one array, a value is not finite, or a scene or
        start is ill-posed.
    Interrupted
        On Ctrl-C; a `KeyboardInterrupt` whose ``partial`` holds the values done by then.
    """
    name, values, scene_at = along(model, parameters)
    scenes = [scene_at(value) for value in values]
    starts = starts_from(start)
    length = stretch_of(scenes[0], stretch)
    end = LOOKS * length if limit is None else finite_time("limit", limit)
    if follow:
        found, restarted, interruption = _followed(scenes, starts, length, end)
    else:
        found, interruption = settled(scenes, [starts(scene) for scene in scenes], length, end)
        restarted = np.zeros(values.size, dtype=bool)
    done = [k for k, outcome in enumerate(found) if outcome is not None]
    result = _diagram(model, name, values[done], [scenes[k] for k in done], [found[k] for k in done])
    result.data["restarted"] = (name, restarted[done])
    if isinstance(interruption, KeyboardInterrupt):
        raise Interrupted(f"interrupted after {len(done)} of {values.size} motions", result) from None
    if interruption is not None:
        raise interruption
    return result


def _diagram(
    model: Model, name: str, values: Real, scenes: list[Scene], found: list[Outcome | None]
) -> Bifurcation:
    cycles: list[Cycle | None] = []
    kinds, exponents, errors = [], [], []
    for scene, outcome in zip(scenes, found, strict=True):
        assert outcome is not None
        (kind, core, growth, _), message = outcome
        cycles.append(None if core is None else Cycle(scene, core))
        kinds.append(kind if core is not None else described(kind, growth, message)[0])
        exponents.append(growth[0])
        errors.append(growth[1])
    result = table(name, values, cycles, Family(model).units(name), scenes)
    result["kind"] = (name, np.array(kinds, dtype=str))
    result["exponent"] = (name, np.array(exponents), {"units": "1/s"})
    result["exponent_error"] = (name, np.array(errors), {"units": "1/s"})
    return Bifurcation(result, tuple(cycles))


def _followed(
    scenes: list[Scene], starts: Callable[[Scene], State], stretch: float, limit: float
) -> tuple[list[Outcome | None], Any, BaseException | None]:
    found: list[Outcome | None] = [None] * len(scenes)
    restarted = np.zeros(len(scenes), dtype=bool)
    candidates: list[State] = []
    for index, scene in enumerate(scenes):
        state = next((state for state in candidates if is_valid(scene, state)), None)
        restarted[index] = state is None and index > 0
        start = starts(scene) if state is None else state
        (outcome,), interruption = settled([scene], [start], stretch, limit, runs=True)
        if interruption is not None or outcome is None:
            return found, restarted, interruption
        (kind, core, growth, run), message = outcome
        found[index] = (kind, core, growth, None), message
        if core is not None:
            cycle = Cycle(scene, core)
            # Under loads that oscillate a motion has to begin at their phase.
            middles = [phase.start + 0.5 * phase.duration for phase in cycle.phases]
            middles = [0.0] if cycle.load_periods else middles
            candidates = [cycle.run.state(time) for time in middles]
        elif run is not None:
            position, velocity, combination, *held = run.state(run.duration)
            candidates = [State(position, velocity, combination, scene.dofs, *held)]
    return found, restarted, None


def table(
    name: str,
    values: Real | Index,
    cycles: Sequence[Cycle | None],
    units: dict[str, str],
    scenes: Sequence[Scene] = (),
) -> xr.Dataset:
    """Return cycles over a parameter as one dataset; nan, False or empty where there is none.

    The dofs are those of the first of `scenes`, or of the first cycle.
    """
    given = [*scenes, *(cycle.scene for cycle in cycles if cycle is not None)]
    dofs = np.array(given[0].dofs if given else [], dtype=str)
    width = max((cycle.multipliers.size for cycle in cycles if cycle is not None), default=0)

    def column(of: Callable[[Cycle], Any], missing: Any) -> Any:
        return np.array([missing if cycle is None else of(cycle) for cycle in cycles])

    def padded(cycle: Cycle) -> Any:
        row = unknown.copy()
        row[: cycle.multipliers.size] = cycle.multipliers
        return row

    nothing, unknown = np.full(dofs.size, np.nan), np.full(width, complex(np.nan, np.nan))
    rows: dict[str, Any] = {
        "period": (name, column(lambda c: c.period, np.nan), {"units": "s"}),
        "main_frequency": (name, column(lambda c: c.main_frequency(), np.nan), {"units": "Hz"}),
        "period_doubled": (name, column(lambda c: c.period_doubled, False)),
        "stable": (name, column(lambda c: c.stable is True, False)),
        "stability": (name, column(lambda c: c.stability, "")),
        "sequence": (name, column(lambda c: " ".join(c.combinations), "")),
        "largest_multiplier": (name, column(lambda c: c.largest_multiplier, np.nan), {"units": "1"}),
        "multiplier": ((name, "order"), column(padded, unknown), {"units": "1"}),
    }
    lowest = column(lambda c: c.core.minimum, nothing)
    highest = column(lambda c: c.core.maximum, nothing)
    for key, cells in (("minimum", lowest), ("maximum", highest), ("amplitude", 0.5 * (highest - lowest))):
        rows[key] = ((name, "dof"), cells, {"units": "m"})
    coords = {name: (name, values, units), "dof": dofs}
    return xr.Dataset(rows, coords=coords)
