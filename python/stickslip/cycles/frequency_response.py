"""How large the periodic answer to a harmonic load is, over the frequency of the load."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stickslip.cycles.attractors import Outcome, is_valid, settled, starts_from
from stickslip.cycles.branches.arclength import trace
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, Interrupted, OrbitError
from stickslip.scene.checks import Complex, Real
from stickslip.scene.contact import dof_index, nearest
from stickslip.scene.loads.in_time import Harmonic
from stickslip.scene.loads.of_scene import core_loads, load_names
from stickslip.scene.parameters.numbers import load_numbers
from stickslip.scene.parameters.values import along, between
from stickslip.scene.reduction import equations_of
from stickslip.scene.scene import Scene, checked
from stickslip.scene.state import State, steady_sliding
from stickslip.scene.structure import core_matrices
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Periods of the load between two looks at a motion, and those after which it counts as not recurring.
LOOK, LIMIT = 64, 64 * 64
#: Part of the largest answer by which the two sweeps differ where there are two answers.
APART = 1e-6
#: Longest step along a branch between two answers, and points after which it is left.
STEP, POINTS = 0.02, 400


@dataclass(frozen=True, repr=False, eq=False)
class FrequencyResponse(Shown):
    """The periodic answers to a load over its frequency.

    Attributes
    ----------
    data
        The numbers, see `frequency_response`.
    cycles
        The orbit of every point.
    """

    data: xr.Dataset
    cycles: tuple[Cycle, ...]

    def to_dataset(self) -> xr.Dataset:
        """Return the numbers."""
        return self.data

    def summary(self) -> Summary:
        """Return how many orbits there are, and the largest answer of every dof."""
        rows = [
            (str(dof), float(of.max()), float(self.data.frequency.to_numpy()[np.argmax(of)]))
            for dof, of in zip(self.data.dof.to_numpy(), self.data.response.to_numpy().T, strict=True)
            if of.size
        ]
        stable = int(self.data.stable.sum())
        facts = [("orbits", f"{len(self.cycles)}, {stable} of them stable")]
        return Summary(facts, [Table("Largest answers", ("dof", "|x - mean|, m", "frequency, Hz"), rows)])

    def plot(self, dof: str | None = None, *, ax: Axes | None = None) -> Axes:
        """Draw the response of a dof over the frequency, unstable orbits hollow; return the Axes.

        The grey line is the linear response.

        Parameters
        ----------
        dof
            Name of the dof; None: the one that answers most.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If the dof is not among those of the response.
        """
        from stickslip.show.plots import axes_of
        from stickslip.show.style import STABLE

        names = [str(name) for name in self.data.dof.to_numpy()]
        if dof is None:
            largest = self.data.response.to_numpy().max(axis=0, initial=0.0)
            dof = names[int(np.argmax(largest))]
        if dof not in names:
            raise InputError(f"dof: the response has no dof {dof!r}{nearest(str(dof), names)}")
        axes, of = axes_of(ax), self.data.sel(dof=dof)
        axes.plot(self.data.linear_frequency, of.linear, color="0.6", linewidth=1.0, label="linear")
        for is_stable, filled, label in ((True, STABLE, "stable"), (False, "white", "not stable")):
            chosen = of.isel(point=np.flatnonzero(self.data.stable.to_numpy() == is_stable))
            if chosen.sizes["point"]:
                axes.plot(chosen.frequency, chosen.response, "o", color=STABLE, mfc=filled, ms=4, label=label)
        axes.set(xlabel="frequency of the load, Hz", ylabel=f"largest distance of {dof} from its mean, m")
        axes.legend(frameon=False, fontsize="small")
        return axes

    def __repr__(self) -> str:
        return f"FrequencyResponse: {len(self.cycles)} orbits\n{self.data!r}"


def frequency_response(
    scene: Scene,
    parameters: Mapping[str, Any],
    *,
    dofs: Sequence[str] | None = None,
    start: State | Callable[[Scene], State] | None = None,
    combination: str | None = None,
) -> FrequencyResponse:
    """Return the largest ``|x - mean|`` of the periodic motions under a harmonic load, over its frequency.

    Motions are followed until they recur, at ascending frequencies and then at descending ones, each from the
    orbit before. Where the two sweeps find different orbits, the branch between them is traced around its
    folds, so that the response also has the unstable orbits (`continuation`).

    Parameters
    ----------
    scene
        A scene with at least one `Harmonic` load, or a slider that vibrates.
    parameters
        Values by name as for `sweep`, the frequency of one load an array (k,), Hz:
        ``{"shaker_frequency": frequencies}``, or ``load_0_frequency`` of a load without a name.
    dofs
        Names of the dofs; None: all.
    start
        Start of the first motion, and of every motion for which the orbit before violates the scene: a state,
        or a function from the scene to one; None: steady sliding.
    combination
        Status combination of the linear response; None: that of the first start.

    Returns
    -------
    FrequencyResponse
        Its `data`: over ``point``, with the coordinate ``frequency`` Hz: ``response`` (point, dof), m;
        ``stable`` (False where that is not known), ``stability``, ``load_periods`` (the period, in periods of
        the loads), ``largest_multiplier``, ``direction`` (``up``, ``down``, ``between``). Over
        ``linear_frequency``, (k,) Hz, which has seven values between two of the array: ``linear``
        (linear_frequency, dof), m, the amplitude while no contact changes its status. Its `cycles` are the
        orbits of the points; where motions do not recur, there is none.

    Raises
    ------
    InputError
        If there is not exactly one array, it is no frequency of a load, a frequency is not positive, or a
        scene or start is ill-posed.
    Interrupted
        On Ctrl-C; a `KeyboardInterrupt` whose ``partial`` holds the orbits found by then.
    """
    field, given, scene_at = along(checked(scene), parameters)
    name = _load(scene, field)
    values = np.unique(given)
    if values[0] <= 0.0:
        raise InputError(f"{field}: must be positive, got {values[0]:g}")
    chosen = list(scene.dofs) if dofs is None else list(dofs)
    places = [dof_index("dofs", dof, scene.dofs) for dof in chosen]
    begins = starts_from(start, steady_sliding)
    scenes = [scene_at(float(value)) for value in values]
    begun = begins(scenes[0])
    fine = np.interp(np.arange(8 * len(values) - 7) / 8.0, np.arange(len(values)), values)
    linear = _linear(scenes[0], name, fine, begun.combination if combination is None else combination)
    up, stopped = _sweep(scenes, values, begins)
    down: list[Cycle | None] = []
    if stopped is None:
        down, stopped = _sweep(scenes[::-1], values[::-1], begins, up[-1])
    done = len(up) + len(down)
    up += [None] * (len(values) - len(up))
    down += [None] * (len(values) - len(down))
    down.reverse()
    found: list[tuple[float, Cycle, str]] = []
    scale = max((float(_response(cycle).max()) for cycle in up if cycle is not None), default=0.0)
    for value, one, other in zip(values, up, down, strict=True):
        found += [(float(value), one, "up")] if one is not None else []
        if other is not None and (one is None or _differs(one, other, scale)):
            found.append((float(value), other, "down"))
    try:
        found += [] if stopped is not None else _between(field, values, up, down, scale)
    except KeyboardInterrupt as interruption:
        stopped = interruption
    cycles = tuple(cycle for _, cycle, _ in found)
    rows = [_response(cycle)[places] for cycle in cycles]
    largest = np.array([cycle.largest_multiplier for cycle in cycles], dtype=float)
    data = xr.Dataset(
        {
            "response": (("point", "dof"), np.reshape(rows, (len(cycles), len(places))), {"units": "m"}),
            "stable": ("point", np.array([cycle.stable is True for cycle in cycles], dtype=bool)),
            "stability": ("point", np.array([cycle.stability for cycle in cycles], dtype=np.str_)),
            "load_periods": ("point", np.array([cycle.load_periods for cycle in cycles], dtype=np.int64)),
            "largest_multiplier": ("point", largest, {"units": "1"}),
            "direction": ("point", np.array([way for _, _, way in found], dtype=np.str_)),
            "linear": (("linear_frequency", "dof"), linear[:, places], {"units": "m"}),
        },
        coords={
            "frequency": ("point", np.array([value for value, _, _ in found]), {"units": "Hz"}),
            "linear_frequency": ("linear_frequency", fine, {"units": "Hz"}),
            "dof": chosen,
        },
    )
    response = FrequencyResponse(data, cycles)
    if stopped is not None:
        raise Interrupted(f"interrupted after {done} of {2 * len(values)} motions", response) from None
    return response


def _load(scene: Scene, field: str) -> str:
    """Return the name of the load whose frequency a parameter is."""
    fields = [name for name, number in load_numbers(scene).items() if number.field == "frequency"]
    if field not in fields:
        raise InputError(
            f"parameters: expected the frequency of a load, got {field!r}{nearest(field, fields)}"
        )
    return field.removesuffix("_frequency")


def _sweep(
    scenes: Sequence[Scene], values: Real, begins: Callable[[Scene], State], before: Cycle | None = None
) -> tuple[list[Cycle | None], KeyboardInterrupt | None]:
    """Return what motions settle to, each begun from the orbit before where that one fits.

    On Ctrl-C it is what was found by then, with the interruption.
    """
    found: list[Cycle | None] = []
    for scene, value in zip(scenes, values, strict=True):
        state = None if before is None else before.run.state(0.0)
        if state is None or not is_valid(scene, state):
            state = begins(scene)
        (outcome,), interruption = settled([scene], [state], LOOK / value, LIMIT / value)
        if isinstance(interruption, KeyboardInterrupt):
            return found, interruption
        if interruption is not None:
            raise interruption
        before = _cycle(scene, outcome)
        found.append(before)
    return found, None


def _cycle(scene: Scene, outcome: Outcome | None) -> Cycle | None:
    core = None if outcome is None else outcome[0][1]
    return None if core is None else Cycle(scene, core)


def _response(cycle: Cycle) -> Real:
    """Return the largest |x - mean| of every dof, (n,), m."""
    mean = cycle.core.harmonics(0)[0].real
    largest: Real = np.maximum(cycle.core.maximum - mean, mean - cycle.core.minimum)
    return largest


def _differs(one: Cycle, other: Cycle, scale: float) -> bool:
    return float(np.abs(_response(one) - _response(other)).max()) > APART * scale


def _between(
    field: str, values: Real, up: list[Cycle | None], down: list[Cycle | None], scale: float
) -> list[tuple[float, Cycle, str]]:
    """Return the orbits between two answers: the branch of the way up, traced around its fold."""
    apart = [
        one is not None and other is not None and _differs(one, other, scale)
        for one, other in zip(up, down, strict=True)
    ]
    found: list[tuple[float, Cycle, str]] = []
    for k, cycle in enumerate(up):
        if cycle is None or not apart[k] or (k + 1 < len(values) and apart[k + 1]):
            continue
        # The way up leaves its branch beyond this value, where it turns back.
        around = _traced(field, cycle, float(values[k]), float(values[k] + values[-1] - values[0]))
        found += around
        if around and around[-1][1].stable is False:
            value, turned, _ = around[-1]
            found += _traced(field, turned, value, float(values[0]))
    return found


def _traced(field: str, cycle: Cycle, begin: float, end: float) -> list[tuple[float, Cycle, str]]:
    """Return the orbits of a branch beyond its first value that obey the contact laws."""
    if begin == end:
        return []
    try:
        _, _, _, scene_at = between(cycle.scene, {field: (begin, end)})
        placed = trace(cycle, field, (begin, end), scene_at, STEP, POINTS).placed
    except OrbitError:
        return []
    return [(value, orbit, "between") for value, orbit in placed if orbit.is_followed() and value != begin]


def _linear(scene: Scene, name: str, values: Real, combination: str) -> Real:
    """Return the amplitudes of all dofs while the combination stays, (k, n), m."""
    reduced = equations_of(scene, combination)
    loads = dict(zip(load_names(scene.loads), scene.loads, strict=True))
    alone = loads.get(name)
    rows = []
    for frequency in values:
        rate = 2.0 * np.pi * frequency
        stiffness = reduced.stiffness + 1j * rate * reduced.damping - rate**2 * reduced.mass
        force, carried = np.zeros(scene.size, dtype=complex), np.zeros(scene.size, dtype=complex)
        if not isinstance(alone, Harmonic):
            force, carried = _vibration(scene, name, combination, rate)
        else:
            for dof, entry in core_loads([alone], (), scene.dofs)[0][0][0]:
                force[dof] += entry
        free = np.linalg.solve(stiffness, reduced.left_basis.T @ force)
        rows.append(np.abs(carried + reduced.right_basis @ free))
    return np.array(rows)


def _vibration(scene: Scene, name: str, combination: str, rate: float) -> tuple[Complex, Complex]:
    """Return force on the dofs and displacement of the dofs where a vibrating slider carries a contact."""
    (place,) = load_numbers(scene)[f"{name}_frequency"].places
    wave = scene.contacts[place].slider_vibration
    if wave is None or combination[place] != "s":
        return np.zeros(scene.size, dtype=complex), np.zeros(scene.size, dtype=complex)
    carried = scene.core.contact_basis()[2 * place] * (wave.amplitude / (1j * rate))
    mass, damping, stiffness, *_ = core_matrices(scene)
    return -(stiffness @ carried + 1j * rate * (damping @ carried) - rate**2 * (mass @ carried)), carried
