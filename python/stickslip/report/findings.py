"""Everything a report tells about a scene, computed once; what cannot be computed is a sentence instead."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from stickslip.cycles.attractors import affordable_search, set_in_motion, shown_duration
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError
from stickslip.locus.boundary.boundary import stability_boundary
from stickslip.locus.boundary.result import StabilityBoundary
from stickslip.locus.critical import critical_points
from stickslip.locus.points import CriticalPoints
from stickslip.locus.sweep import sweep
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.motion.energy import Balance
from stickslip.motion.errors import NotPeriodicError, RunError
from stickslip.motion.motion import Motion
from stickslip.scene.checks import Real
from stickslip.scene.contact import driven_letter, steady_coefficients
from stickslip.scene.known import Known
from stickslip.scene.laws.friction import Tabulated
from stickslip.scene.parameters.family import Model
from stickslip.scene.parameters.values import axis, checked_parameters
from stickslip.scene.scene import Scene
from stickslip.scene.state import Equilibrium, State, steady_sliding
from stickslip.transient.simulate import simulate
from stickslip.transient.trajectory import Trajectory

#: Values of friction in the loci, and eigenvalues beyond which loci are left out: each value is a problem.
VALUES, LARGE = 301, 60
#: Lines searched for curves in each of two parameters.
CELLS = 16
#: Smallest and largest slider speed of the loci under laws of friction, over that of the scene.
SPEEDS = (0.1, 2.0)
#: Dofs beyond which energy is left out.
BIG = 400
#: Dofs beyond which energy and spectrum are those of the last quarter, at as many samples a second.
MANY = 48
#: Range of a displacement, relative to the largest, at which a dof is at rest.
REST = 1e-12
#: Kinds of motion of which nothing is left, or will be.
AT_REST = ("equilibrium", "decaying")
#: Samples of the spectrum of the whole stretch.
SAMPLES = 2**14
#: Events of the transient, and of the search for what it settles to, times the number of dofs; fewest events.
#: They limit the report by its work, so that the same scene gives the same report on every computer.
EVENTS, FEWEST = 400_000, 1000
#: How much further the search looks, s of motion; as long as the motion itself if that is longer.
FURTHER = 3.0
#: Wall-clock limit of transient and search together, s, for motions that take long between events.
PATIENCE = 30.0
#: Least wall-clock time of the search, s, however much the motion took: a look at its end.
SHORTEST_SEARCH = 0.1


@dataclass(frozen=True, eq=False)
class Findings:
    """The results that a report shows; if a field is None, `reasons` says why under the name of the field."""

    #: What the report is about.
    scene: Scene
    title: str
    equilibrium: Equilibrium | None
    #: Complex modes of steady sliding, or, where it does not exist, of contacts held closed that slide as
    #: their sliders drive them (in positive sliding where a slider rests).
    modes: Modes
    #: Lowest and highest frequency of these modes, and of what is computed over parameters, Hz; None: all.
    band: tuple[float, float] | None
    #: Eigenvalues over friction (of all contacts, or a factor on the friction of each), or over slider speed
    #: where friction depends on it, and where their kind changes.
    parameter: str
    loci: xr.Dataset | None
    critical: CriticalPoints
    #: The curves over two parameters on which stability ends; None also where none were asked for.
    boundary: StabilityBoundary | None
    #: The disturbed start and the motion from there.
    start: State | None
    run: Trajectory | None
    #: The limit cycle to which the motion settles, if it is periodic.
    cycle: Cycle | None
    #: The kind of motion otherwise (`NotPeriodicError.kind`).
    settled: str
    #: The motion that the report shows in detail: one period of the cycle, or the last stretch of the run.
    last: Motion | None
    #: Energy balance of `last`, from `since` on.
    balance: Balance | None
    #: Start of the part of `last` whose energy and spectrum the report shows, s: its last quarter if there
    #: are many dofs and no cycle, otherwise its start.
    since: float
    #: Spectrum of `last` from `since` on, of all dofs.
    lines: xr.Dataset | None
    reasons: dict[str, str]
    known: Known

    @property
    def is_large(self) -> bool:
        """Whether the scene has so many dofs that energy is left out."""
        return self.scene.size > BIG

    @cached_property
    def moving(self) -> list[int]:
        """The dofs that move most at the end, at most four, in their order; those at rest are left out."""
        if self.last is None:
            return []
        count = 129 if self.is_large else 513
        position = self.last.sample(np.linspace(0.0, self.last.duration, count)).position.to_numpy()
        span = np.ptp(position, axis=0)
        most = np.argsort(-span)[:4]
        return sorted(int(k) for k in most if span[k] > REST * span[most[0]])


def findings(
    scene: Scene,
    title: str,
    *,
    start: State | None = None,
    settings: Mapping[str, Any] | None = None,
    model: Model | None = None,
    parameters: Mapping[str, Any] | None = None,
    band: Sequence[float] | None = None,
    known: Known = Known(),  # noqa: B008
    told: Callable[[str], None] = lambda _: None,
) -> Findings:
    """Compute what a report tells; the arguments are those of `write_report`.

    Without a duration the motion lasts as long as the leading mode takes to grow (or decay) by e^30, but 20
    to 400 of its periods. Without `max_events` the number of dofs limits the events. The search for what the
    motion settles to has the rest of the time limit.
    """
    reasons: dict[str, str] = {}
    told("computing the modes of steady sliding")
    equilibrium = _equilibrium(scene, reasons)
    driven = "".join(map(driven_letter, scene.contacts))
    modes = complex_modes(scene, driven if equilibrium is None else equilibrium.combination, band=band)
    if band is not None and not len(modes):
        raise InputError(f"band: steady sliding has no mode from {band[0]} to {band[1]} Hz")
    told("computing the eigenvalues over a parameter")
    family, over, boundary = scene if model is None else model, parameters, None
    if over is not None and len(over) == 2:
        told("following the curves on which stability ends")
        boundary, over = _boundary(modes, family, over, band, reasons), None
    parameter, loci, critical = _loci(scene, modes, family, over, band, reasons)
    begin = start
    if begin is None and equilibrium is not None:
        begin = set_in_motion(scene, equilibrium, modes) if known.start is None else known.start
    run = None
    if begin is None:
        reasons["run"] = f"no motion: there is no steady sliding to disturb ({reasons['equilibrium']})"
    else:
        told("computing the motion")
        chosen = {
            "duration": shown_duration(modes),
            "max_events": _most_events(scene),
            "time_limit": PATIENCE,
            **(settings or {}),
        }
        started = time.perf_counter()
        run = _motion(scene, begin, chosen, reasons)
        spent = time.perf_counter() - started
    cycle, settled, last = None, "", None
    if run is not None:
        told("looking for what the motion settles to")
        limit = chosen["time_limit"]
        rest = None if limit is None else max(limit - spent, SHORTEST_SEARCH)
        cycle, settled, last = _settled(run, modes, rest, reasons)
    since = 0.75 * last.duration if last is not None and cycle is None and scene.size > MANY else 0.0
    lines = None
    if cycle is not None and last is not None:
        lines = cycle.harmonics().swap_dims(harmonic="frequency").assign_attrs(method="exact")
    elif last is not None and last.duration > 0.0 and settled not in AT_REST:
        lines = last.spectrum(begin=since, samples=SAMPLES if since == 0.0 else SAMPLES // 4)
    return Findings(
        scene=scene,
        title=title,
        equilibrium=equilibrium,
        modes=modes,
        band=None if band is None else (float(band[0]), float(band[1])),
        parameter=parameter,
        loci=loci,
        critical=critical,
        boundary=boundary,
        start=begin,
        run=run,
        cycle=cycle,
        settled=settled,
        last=last,
        balance=None if last is None or scene.size > BIG else last.balance(since),
        since=since,
        lines=lines,
        reasons=reasons,
        known=known,
    )


def _equilibrium(scene: Scene, reasons: dict[str, str]) -> Equilibrium | None:
    try:
        return steady_sliding(scene)
    except InputError as error:
        reasons["equilibrium"] = str(error)
        return None


def _most_events(scene: Scene) -> int:
    return max(EVENTS // scene.size, FEWEST)


def _loci(
    scene: Scene,
    modes: Modes,
    model: Model,
    parameters: Mapping[str, Any] | None,
    band: Sequence[float] | None,
    reasons: dict[str, str],
) -> tuple[str, xr.Dataset | None, CriticalPoints]:
    """Return the parameter of the loci, branches and critical points over it."""
    refused: Any = (InputError, RunError)
    nothing = "", None, CriticalPoints("", [], {})
    if parameters:
        if len(parameters) != 1:
            raise InputError(f"parameters: expected one or two, got {list(parameters)}")
        ((name, values),) = parameters.items()
        # What is wrong with a parameter that was asked for is no remark of the page.
        refused = RunError
    elif (found := _own_parameter(scene, modes, reasons)) is None:
        return nothing
    else:
        model, name, values = found
    ends = float(np.min(values)), float(np.max(values))
    options: dict[str, Any] = {"combination": modes.combination, "band": band}
    try:
        branches = sweep(model, {name: values}, progress=False, **options)
        if ends[0] == ends[1]:
            return name, branches, CriticalPoints(name, [], {})
        return name, branches, critical_points(model, {name: ends}, **options)
    except refused as error:
        reasons["loci"] = f"no loci: {error}"
        return nothing


def _own_parameter(scene: Scene, modes: Modes, reasons: dict[str, str]) -> tuple[Model, str, Real] | None:
    """Return what eigenvalues are followed over where nothing is asked for; None: over nothing."""
    frictions = set(steady_coefficients(scene.contacts))
    speeds = {contact.slider_speed for contact in scene.contacts if contact.tangential is not None}
    if scene.core.has_friction_laws and (len(speeds) > 1 or speeds == {0.0}):
        reasons["loci"] = (
            "no loci: friction depends on slip speed, and the sliders have no speed in common; see "
            "stickslip.sweep over parameters of its law"
        )
    elif not scene.contacts:
        reasons["loci"] = "no loci: the scene has no contact"
    elif frictions == {0.0}:
        reasons["loci"] = "no loci: friction is zero"
    elif len(modes) > LARGE:
        reasons["loci"] = f"no loci: {len(modes)} modes; see stickslip.sweep"
    if "loci" in reasons:
        return None
    if scene.core.has_friction_laws:
        return scene, "slider_speed", _speeds(scene, speeds.pop())
    # Steady sliding does not depend on static friction, which may not be less than friction.
    sliding = scene.replace(static_friction=None)
    if len(frictions) == 1:
        return sliding, "friction", np.linspace(0.0, max(2.0 * frictions.pop(), 1.0), VALUES)

    def scaled(friction_factor: float) -> Scene:
        return sliding.replace(friction=[friction_factor * mu for mu in steady_coefficients(scene.contacts)])

    return scaled, "friction_factor", np.linspace(0.0, 2.0, VALUES)


def _speeds(scene: Scene, speed: float) -> Real:
    """Return slider speeds about the one of the scene, between the knots of its tables of friction."""
    low, high = (factor * abs(speed) for factor in SPEEDS)
    laws = [contact.friction for contact in scene.contacts if isinstance(contact.friction, Tabulated)]
    knots = np.array([knot for law in laws for knot in law.speeds])
    low = knots[knots <= abs(speed)].max(initial=low)
    high = knots[knots > abs(speed)].min(initial=high)
    return np.copysign(np.linspace(low, high, VALUES), speed)


def _boundary(
    modes: Modes,
    model: Model,
    parameters: Mapping[str, Any],
    band: Sequence[float] | None,
    reasons: dict[str, str],
) -> StabilityBoundary | None:
    values = {name: axis(name, given) for name, given in checked_parameters(model, parameters).items()}
    ranges = {name: (float(given.min()), float(given.max())) for name, given in values.items()}
    try:
        return stability_boundary(
            model, ranges, combination=modes.combination, cells=CELLS, band=band, progress=False
        )
    except (InputError, RunError) as error:
        reasons["boundary"] = f"no curves over {' and '.join(ranges)}: {error}"
        return None


def _motion(
    scene: Scene, start: State, settings: Mapping[str, Any], reasons: dict[str, str]
) -> Trajectory | None:
    try:
        run = simulate(scene, start=start, **settings)
    except RunError as error:
        reasons["stopped"] = f"the motion could not be continued: {error}"
        return error.partial if isinstance(error.partial, Trajectory) else None
    if run.stop_reason == "time_limit":
        reasons["stopped"] = (
            f"the time limit of computing, {settings['time_limit']:g} s, was reached at {run.duration:g} s"
        )
    elif run.stop_reason == "max_events":
        reasons["cut"] = f"the limit of {len(run.events)} events was reached at {run.duration:g} s"
    elif run.stop_reason == "grazing":
        reasons["stopped"] = f"the motion was stopped at a touch within rounding, at {run.duration:g} s"
    elif run.stop_reason == "unbounded":
        reasons["stopped"] = f"the motion grows without bound; shown up to {run.duration:g} s"
    return run


def _settled(
    run: Trajectory, modes: Modes, time_limit: float | None, reasons: dict[str, str]
) -> tuple[Cycle | None, str, Motion | None]:
    # What decays and meets no event needs no search, which would take minutes for a thousand dofs.
    resting = len(run.events) == 0 and run.start.combination == modes.combination
    if resting and not (modes.unstable | modes.marginal).any():
        quiet = f"no contact changed its status in {run.duration:g} s, and every mode decays"
        reasons["cycle"] = f"No limit cycle was looked for: {quiet}"
        return None, "decaying", run
    if "stopped" in reasons:
        reasons["cycle"] = f"No limit cycle was looked for: {reasons['stopped']}"
        return None, run.stop_reason, run
    try:
        further = affordable_search(run, max(FURTHER, run.duration), _most_events(run.scene))
        cycle = run.limit_cycle(further=further, time_limit=time_limit)
    except NotPeriodicError as error:
        # Without an exponent there is nothing that parts or meets.
        neutral = error.kind == "unsettled" or (error.kind == "undecided" and math.isnan(error.exponent))
        quiet = "no contact changes its status, and the motion neither grows nor dies out"
        reasons["cycle"] = f"No limit cycle: {quiet if neutral and len(run.events) == 0 else error}"
        return None, error.kind, error.partial if error.partial is not None else run
    return cycle, "cycle", cycle.run
