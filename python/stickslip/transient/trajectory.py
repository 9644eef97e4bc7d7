"""The nonlinear transient: exact motion between status changes, and the changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.motion import energy as energetics
from stickslip.scene.checks import Index, Names, Real, real_array, real_number, whole_number
from stickslip.errors import InputError, RunError, RunInterrupted
from stickslip.scene.scene import Scene, checked
from stickslip.scene.state import State

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.cycles.cycle import Cycle


class Events:
    """Every status change and impact of a run, in order; one entry per contact and instant.

    Each array is made when it is first asked for.
    """

    def __init__(self, core: _core.Trajectory) -> None:
        self._core = core

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("time", "contact", "kind", "combination")}

    @cached_property
    def time(self) -> Real:
        """(e,), s."""
        return self._core.event_time

    @cached_property
    def contact(self) -> Index:
        """Index of the contact, (e,)."""
        return self._core.event_contact

    @cached_property
    def kind(self) -> Names:
        """What happened, (e,).

        One of ``velocity`` (slip velocity reached zero), ``slip+``, ``slip-`` (onset of slip), ``release``,
        ``impact``, ``accumulation``. An impact counts even if the combination stays.
        """
        return np.array(self._core.event_kind, dtype=np.str_)

    @cached_property
    def combination(self) -> Names:
        """The combination after the instant, (e,)."""
        return np.array(self._core.event_combination, dtype=np.str_)

    def __len__(self) -> int:
        return self.time.size

    def __repr__(self) -> str:
        rows = [
            f"  {t:.12f} s  contact {i}  {kind:<9} -> {combination}"
            for t, i, kind, combination in zip(
                self.time[:10], self.contact, self.kind, self.combination, strict=False
            )
        ]
        more = [f"  ... {len(self) - 10} more"] if len(self) > 10 else []
        return "\n".join([f"Events({len(self)})", *rows, *more])

    def _repr_html_(self) -> str:
        from stickslip.notebook import events_html

        return events_html(self)


class Grazing(NamedTuple):
    """A touch of an event function within rounding: the status was kept, the alternative may be true."""

    #: s
    time: float
    #: index of the contact
    contact: int
    #: kind of the event that was not taken
    alternative: str
    #: the event function at the touch, in its own unit (m/s, N or m)
    value: float
    #: bound on the error of `value`, same unit
    uncertainty: float


class Accumulation(NamedTuple):
    """The limit of a series of bounces, taken instead of the rest of them."""

    #: index of its event
    event: int
    #: bounces left out whose remaining time is at least one ulp of t
    bounces: int
    #: bound of the error of its time, s: the gap's acceleration is taken as constant over the rest
    error: float


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A computed motion from 0 to `duration`: the events are kept, anything between is evaluated on demand.

    Attributes
    ----------
    scene, start
        What was simulated, from where.
    """

    scene: Scene
    start: State
    core: _core.Trajectory

    @cached_property
    def events(self) -> Events:
        """The events."""
        return Events(self.core)

    @cached_property
    def grazings(self) -> tuple[Grazing, ...]:
        """Touches that rounding cannot tell from events."""
        return tuple(Grazing(*touch) for touch in self.core.grazings)

    @cached_property
    def accumulations(self) -> tuple[Accumulation, ...]:
        """The limits of series of bounces, one for each event ``accumulation``."""
        return tuple(Accumulation(*limit) for limit in self.core.accumulations)

    @property
    def duration(self) -> float:
        """End of the computed motion, s."""
        return self.core.duration

    @property
    def stop_reason(self) -> str:
        """Why the motion ends there.

        ``duration``, ``max_events``, ``time_limit``, ``grazing`` (asked to stop there), or ``unbounded``
        (beyond the range of numbers); the partial motion of an error also has ``failed``, ``chattering``,
        ``interrupted``.
        """
        return self.core.stop_reason

    @cached_property
    def counters(self) -> dict[str, int]:
        """How much work it took; exact numbers that do not depend on the machine."""
        return dict(self.core.counters)

    def state(self, time: float) -> State:
        """Return the state at a time in [0, duration], s; at an event time, the state after it.

        Raises
        ------
        InputError
            If the time lies outside the computed motion.
        """
        position, velocity, combination = self.core.state(real_number("time", time))
        return State(position, velocity, combination, self.scene.dofs)

    def sample(self, times: ArrayLike) -> xr.Dataset:
        """Return motion and contact forces at k times in [0, duration], s; any order.

        Returns
        -------
        xarray.Dataset
            ``position`` (time, dof) m, ``velocity`` (time, dof) m/s, ``normal_force`` (time, contact) N,
            compression positive, ``friction_force`` (time, contact) N, on the mass along t, and ``status``
            (time, contact), one of ``+ - s d``. At an event time: just after the event.

        Raises
        ------
        InputError
            If a time lies outside the computed motion.
        """
        import xarray as xr

        at = np.atleast_1d(real_array("times", times, 0, 1))
        position, velocity, normal, friction, status = self.core.sample(at)
        motion, force = ("time", "dof"), ("time", "contact")
        return xr.Dataset(
            {
                "position": (motion, position, {"units": "m"}),
                "velocity": (motion, velocity, {"units": "m/s"}),
                "normal_force": (force, normal, {"units": "N", "sign": "compression positive"}),
                "friction_force": (force, friction, {"units": "N", "sign": "on the mass, along t"}),
                "status": (force, np.ascontiguousarray(status).view("S1").astype(np.str_)),
            },
            coords={
                "time": ("time", at, {"units": "s"}),
                "dof": list(self.scene.dofs),
                "contact": self.scene.contact_labels(),
            },
        )

    def modal_coordinates(self, times: ArrayLike) -> xr.DataArray:
        """Return the modal coordinates z, ``(q, q') = Xi z``, in the modes of each instant's combination.

        Parameters
        ----------
        times
            k times in [0, duration], s, ascending or not.

        Returns
        -------
        xarray.DataArray
            (time, mode), complex, m, in the order of `Modes.eigenvalues` of the coordinate ``combination``
            (time); nan beyond the modes of a combination that has fewer than the largest of these.

        Raises
        ------
        InputError
            If a time lies outside the computed motion, or the modes of a combination are defective.
        """
        import xarray as xr

        at = np.atleast_1d(real_array("times", times, 0, 1))
        runs = self.core.modal_coordinates(at)
        width = max((coordinates.shape[1] for _, _, coordinates in runs), default=0)
        table = np.full((at.size, width), complex(np.nan, np.nan))
        combination = np.empty(at.size, dtype=f"<U{len(self.scene.contacts)}")
        for name, rows, coordinates in runs:
            table[rows, : coordinates.shape[1]] = coordinates
            combination[rows] = name
        return xr.DataArray(
            table,
            dims=("time", "mode"),
            coords={"time": ("time", at, {"units": "s"}), "combination": ("time", combination)},
            name="modal_coordinates",
            attrs={"units": "m"},
        )

    def energy(self, times: ArrayLike) -> xr.Dataset:
        """Return energies and powers at k times in [0, duration], s, each from its own formula.

        Returns
        -------
        xarray.Dataset
            ``kinetic`` ``1/2 x'^T M x'`` and ``elastic`` ``1/2 x^T K x`` (time) J. (time, contact) W:
            ``contact_power`` ``T_i (t_i . x')``, into the structure positive, which is ``slider_power``
            ``T_i v_i`` less ``friction_heat`` ``-T_i s_i >= 0``. (time) W: ``external_power`` ``F . x'``,
            into the structure positive; ``damping_power`` ``x'^T C x'``, dissipated, also by ``damper_power``
            (time, damper) for the mass and stiffness part of proportional damping; ``energy_rate`` dE/dt =
            ``x'^T (M x'' + K x)`` with x'' from the state equation of the combination, in which no contact
            force appears. ``combination`` (time). At an event time: just after the event.

        Raises
        ------
        InputError
            If a time lies outside the computed motion.

        Notes
        -----
        ``energy_rate = sum(contact_power) + external_power - damping_power`` is left for the caller to check.
        Nothing of this is computed before it is asked for. A preload by an imposed displacement counts as
        external force: the support's spring energy is relative to zero displacement (Brunetti, Massi,
        D'Ambrogio, Berthier, section 6).
        """
        return energetics.energy(self.scene, self.core, times)

    def balance(self, t0: float = 0.0, t1: float | None = None) -> energetics.Balance:
        """Return where the energy came from and went over (t0, t1], by default over the whole motion.

        The works are integrals of the powers over every phase by a Gauss rule that is exact to rounding for
        the motion at hand (its bound stands in the core), never from output samples.

        Parameters
        ----------
        t0, t1
            ``0 <= t0 <= t1 <= duration``, s; impacts at t1 are counted, those at t0 are not.

        Raises
        ------
        InputError
            If the interval is reversed or lies outside the computed motion.
        """
        end = self.duration if t1 is None else real_number("t1", t1)
        return energetics.balance(self.scene, self.core, real_number("t0", t0), end)

    def limit_cycle(
        self, further: float = 10.0, method: Literal["auto", "modal", "taylor"] = "auto"
    ) -> Cycle:
        """Return the periodic orbit that the motion settles to, refined to rounding.

        Recurring events and states give a first orbit, Newton's method on the exact return map the rest. The
        motion must be on the orbit, or approach it with the orbit stable; the period is the smallest one.

        Parameters
        ----------
        further
            Where the motion computed does not show it yet: how much longer to follow it, s; 0 to look at this
            run only.
        method
            How phases are propagated, see `simulate`.

        Raises
        ------
        NotPeriodicError
            If the motion settles to no cycle; it says what it is instead, with the largest Lyapunov exponent
            where there is one.
        InputError
            If `further` is negative or not finite, or `method` is no known word.
        RunInterrupted
            On Ctrl-C; a `KeyboardInterrupt` that holds the last stretch of the motion.
        """
        from stickslip.cycles.cycle import limit_cycle

        limit = real_number("further", further)
        if not 0.0 <= limit < np.inf:
            raise InputError(f"further: expected a finite time >= 0, got {limit:g}")
        return limit_cycle(self, limit, method)

    def spectrum(
        self,
        dof: str | None = None,
        *,
        begin: float | None = None,
        end: float | None = None,
        harmonics: int = 64,
        further: float = 10.0,
        samples: int = 2**14,
        window: Any = "hann",
        detrend: Literal["constant", "linear"] | None = "constant",
    ) -> xr.Dataset:
        """Return the spectrum of displacements.

        Without `begin` and `end`: the lines of the limit cycle that the motion settles to, in closed form
        (`Cycle.harmonics`): no window, no leakage. With one of them: the discrete Fourier transform of that
        stretch, such as the growing part up to the first event, or a motion that has no period.

        Parameters
        ----------
        dof
            Name of a dof; None: all of them.
        begin, end
            The stretch to sample, s; one of them alone: from 0, or up to the end of the motion.
        harmonics, further
            Of the exact lines: the highest one, and see `limit_cycle`.
        samples, window, detrend
            Of the transform: number of equidistant samples, >= 8, a window of `scipy.signal.get_window`, and
            what is subtracted first: the mean, a straight line, or nothing.

        Returns
        -------
        xarray.Dataset
            Over ``frequency`` (Hz), and ``dof`` if none was named: ``coefficient``, complex, and
            ``amplitude`` of the cosine at that frequency, m. The attribute ``method`` is ``exact`` or
            ``sampled``.

        Raises
        ------
        NotPeriodicError
            If the exact lines are asked for and the motion settles to no cycle.
        InputError
            If the dof is unknown or an argument is ill-posed.
        """
        from stickslip.motion.spectrum import exact_spectrum, sampled_spectrum

        if begin is None and end is None:
            limit = real_number("further", further)
            return exact_spectrum(self, dof, harmonics, limit)
        return sampled_spectrum(self, dof, begin, end, samples, window, detrend)

    def time_by_combination(self) -> dict[str, float]:
        """Return how long each status combination held, s, in order of first appearance."""
        begins = np.concatenate([[0.0], self.events.time])
        held: dict[str, float] = {}
        names = [self.start.combination, *map(str, self.events.combination)]
        for name, time in zip(names, np.diff(begins, append=self.duration), strict=True):
            held[name] = held.get(name, 0.0) + float(time)
        return held

    def dataset(self, samples: int = 2001) -> xr.Dataset:
        """Return what a file of the run holds: equidistant samples, and every event.

        Parameters
        ----------
        samples
            Number of instants from 0 to `duration`, >= 2.

        Returns
        -------
        xarray.Dataset
            What `sample` returns; ``event_time`` s, ``event_contact``, ``event_kind``, ``event_combination``
            (event). The attributes ``duration`` s, ``stop_reason``, ``start_combination``.

        Raises
        ------
        InputError
            If `samples` is no integer >= 2.
        """
        number = count("samples", samples, least=2) or 2
        motion = self.sample(np.linspace(0.0, self.duration, number))
        labels = np.array(self.scene.contact_labels())
        return motion.assign(
            event_time=("event", self.events.time, {"units": "s"}),
            event_contact=("event", labels[self.events.contact]),
            event_kind=("event", self.events.kind),
            event_combination=("event", self.events.combination),
        ).assign_attrs(
            duration=self.duration, stop_reason=self.stop_reason, start_combination=self.start.combination
        )

    def event_states(self) -> tuple[Real, Real]:
        """Return position, m, and velocity, m/s, just after each event, (e, n) each."""
        return self.core.event_states()

    def __repr__(self) -> str:
        counted = f"{len(self.events)} events, {len(self.grazings)} grazings"
        return f"Trajectory({self.duration:g} s, {counted}, stopped by {self.stop_reason})"

    def _repr_html_(self) -> str:
        from stickslip.notebook import trajectory_html

        return trajectory_html(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.scene, self.start, self.core.record())


def _restored(scene: Scene, start: State, record: dict[str, Any]) -> Trajectory:
    return Trajectory(scene, start, scene.core.trajectory(record))


def simulate(
    scene: Scene,
    start: State,
    duration: float,
    method: Literal["auto", "modal", "taylor"] = "auto",
    max_events: int | None = None,
    *,
    time_limit: float | None = None,
    accumulation_tolerance: float = 0.0,
    on_grazing: Literal["keep", "stop"] = "keep",
) -> Trajectory:
    """Return the motion of a scene from a start state.

    Parameters
    ----------
    scene
        The scene.
    start
        State at t = 0; it must satisfy its own combination.
    duration
        > 0, s.
    method
        How phases are propagated: in modal coordinates, by Taylor series, or whichever is less work and
        well-conditioned. The choice counts work and reads no clock: the same arguments give the same run.
    max_events
        Stop after that many events; None: no limit.
    time_limit
        Stop after that much wall-clock time, s; None: no limit.
    accumulation_tolerance
        Bounces whose remaining times sum to less than this, s, are replaced by their limit: the contact comes
        to rest there, as one event ``accumulation`` (see `Trajectory.accumulations`). At least one ulp of t.
    on_grazing
        What to do where an event function touches zero within rounding: ``keep`` the status and go on, or
        ``stop`` there.

    Raises
    ------
    InputError
        If an argument is ill-posed, or the start state penetrates or violates its combination.
    RunError
        If the motion cannot be continued; `RunError.partial` holds it up to there.
    RunInterrupted
        On Ctrl-C; a `KeyboardInterrupt` that holds the motion up to there.
    """
    checked(scene)
    if not isinstance(start, State):
        raise InputError(f"start: expected a State, got {start!r}")
    settings = run_settings(duration, method, max_events, time_limit, accumulation_tolerance, on_grazing)
    core = scene.core.simulate(start.position, start.velocity, start.combination, *settings)
    run = Trajectory(scene, start, core)
    if run.stop_reason in ("failed", "chattering"):
        raise RunError(core.stop_message, run)
    if run.stop_reason == "interrupted":
        raise RunInterrupted(run)
    return run


#: duration, method, max_events, time_limit, accumulation_tolerance, on_grazing
RunSettings = tuple[
    float, Literal["auto", "modal", "taylor"], int | None, float | None, float, Literal["keep", "stop"]
]


def run_settings(
    duration: Any,
    method: Any,
    max_events: Any,
    time_limit: Any,
    accumulation_tolerance: Any,
    on_grazing: Any,
) -> RunSettings:
    """Return what a run takes besides scene and start, as the core takes it.

    Raises
    ------
    InputError
        If one of them has the wrong type or is no known word.
    """
    if method not in ("auto", "modal", "taylor"):
        raise InputError(f"method: expected 'auto', 'modal' or 'taylor', got {method!r}")
    if on_grazing not in ("keep", "stop"):
        raise InputError(f"on_grazing: expected 'keep' or 'stop', got {on_grazing!r}")
    return (
        real_number("duration", duration),
        method,
        count("max_events", max_events, least=0),
        None if time_limit is None else real_number("time_limit", time_limit),
        real_number("accumulation_tolerance", accumulation_tolerance),
        on_grazing,
    )


def count(argument: str, value: Any, *, least: int) -> int | None:
    """Return a number of things, or None.

    Raises
    ------
    InputError
        If it is no integer, less than `least`, or beyond 64 bits.
    """
    return None if value is None else whole_number(argument, value, least)
