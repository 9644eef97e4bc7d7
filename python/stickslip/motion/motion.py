"""A motion of a scene: events are kept, anything between is evaluated on demand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from stickslip import _core
from stickslip.faults import InputError
from stickslip.modes.modes import one_of_each_pair
from stickslip.motion import energy as energetics
from stickslip.motion.events import Accumulation, Events, Grazing, labelled
from stickslip.scene.checks import Names, Real, check_memory, real_array, real_number, whole_number
from stickslip.scene.scene import Scene
from stickslip.scene.state import State
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.motion.figures import MotionPlots


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Shown):
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
        return Events(self.core, self.scene.contact_labels())

    @cached_property
    def grazings(self) -> tuple[Grazing, ...]:
        """Touches of an event function that rounding cannot distinguish from events."""
        labels = self.scene.contact_labels()
        return tuple(Grazing(*touch, str(labels[touch[1]])) for touch in self.core.grazings)

    @cached_property
    def accumulations(self) -> tuple[Accumulation, ...]:
        """The limits of series of bounces, one for each event ``accumulation``."""
        return tuple(Accumulation(*limit) for limit in self.core.accumulations)

    @cached_property
    def undetermined(self) -> dict[str, tuple[int | str, ...]]:
        """Combinations in which single forces are not determined, with the contacts that have them.

        In these combinations the directions of closed contacts depend on each other, as for a rigid pad that
        sticks on two points. The motion depends only on sums of the forces, and slip begins when no
        admissible forces have the sums that are needed. The run shows the forces with the least norm.
        """
        if not self.scene.core.dependent:
            return {}
        labels = self.scene.contact_labels()
        found = {name: self.scene.core.undetermined(name) for name in self.time_by_combination()}
        return {name: tuple(labels[i] for i in contacts) for name, contacts in found.items() if contacts}

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
        """Counts of the work of the run, such as panels and phases; they do not depend on the machine."""
        return dict(self.core.counters)

    def state(self, time: float) -> State:
        """Return the state at a time in [0, duration], s; at an event time, the state after it.

        Raises
        ------
        InputError
            If the time lies outside the computed motion.
        """
        position, velocity, combination, *held = self.core.state(real_number("time", time))
        return State(position, velocity, combination, self.scene.dofs, *held)

    def sample(self, times: ArrayLike | None = None, between: int = 0) -> xr.Dataset:
        """Return motion and contact forces at k times in [0, duration], s; any order.

        Parameters
        ----------
        times
            (k,), s. None: the start, both sides of every event, `between` instants in each phase, and the
            end, ascending. The side before an event is the largest time below its own; the coordinate
            ``instant`` then tells ``start``, ``before``, ``after``, ``between`` or ``end``.
        between
            Without `times`: how many instants evenly inside each phase.

        Returns
        -------
        xarray.Dataset
            ``position`` (time, dof) m, ``velocity`` (time, dof) m/s, ``normal_force`` (time, contact) N,
            compression positive, ``friction_force`` (time, contact) N, on the structure along t, and
            ``status`` (time, contact), one of ``+ - s d``. Values at an event time are those just after the
            event.

        Raises
        ------
        InputError
            If a time lies outside the computed motion, or `between` is no integer >= 0 or given with `times`.
        """
        import xarray as xr

        inside = whole_number("between", between, 0)
        # Positions and velocities, two forces and a letter for each contact.
        width = 2 * self.scene.size + 6 * len(self.scene.contacts)
        check_memory("between", inside * width * (len(self.events) + 1), between)
        if times is None:
            at, instant = self._instants(inside)
        elif inside:
            raise InputError(f"between: expected 0 where times are given, got {between!r}")
        else:
            at, instant = np.atleast_1d(real_array("times", times, 0, 1)), None
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
                **({} if instant is None else {"instant": ("time", instant)}),
            },
        )

    def _instants(self, between: int) -> tuple[Real, Names]:
        """Return times aligned with the events, and what each of them is."""
        after = np.unique(self.events.time)
        inner = after[(after > 0.0) & (after < self.duration)]
        ends = np.array([0.0, *inner, self.duration])
        parts = np.arange(1, between + 1) / (between + 1)
        # Of two names for one time the first counts.
        listed = (
            ("start", np.zeros(1)),
            ("after", after),
            ("before", np.nextafter(after[after > 0.0], 0.0)),
            ("end", np.array([self.duration])),
            ("between", (ends[:-1, None] + parts * np.diff(ends)[:, None]).ravel()),
        )
        names = np.concatenate([np.full(times.size, name) for name, times in listed])
        times, first = np.unique(np.concatenate([times for _, times in listed]), return_index=True)
        return times, names[first]

    def modal_coordinates(self, times: ArrayLike) -> xr.DataArray:
        """Return the modal coordinates z in the modes of each instant's combination.

        ``(q, q') = Xi z`` with the right vectors Xi of `Modes.with_conjugates`: the coordinate of a conjugate
        is the conjugate one.

        Parameters
        ----------
        times
            k times in [0, duration], s, ascending or not.

        Returns
        -------
        xarray.DataArray
            (time, mode), complex, m, by the numbers of the modes of the coordinate ``combination`` (time),
            nan beyond the modes of a combination that has fewer than the largest of these.

        Raises
        ------
        InputError
            If a time lies outside the computed motion, or the modes of a combination are defective.
        """
        import xarray as xr

        at = np.atleast_1d(real_array("times", times, 0, 1))
        runs = [
            (name, rows, coordinates[:, one_of_each_pair(self.scene.core.modes(name)["eigenvalues"])])
            for name, rows, coordinates in self.core.modal_coordinates(at)
        ]
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
            into the structure positive; ``circulatory_power`` ``-x'^T H_a x``, the same sign, 0 without
            circulatory forces (their symmetric part counts in K); ``damping_power`` ``x'^T C x'``,
            dissipated, also by ``damper_power`` (time, damper) for the mass and stiffness part of
            proportional damping; ``energy_rate`` dE/dt = ``x'^T (M x'' + K x)`` with x'' from the state
            equation of the combination, in which no contact force appears. ``combination`` (time). At an
            event time: just after the event.

        Raises
        ------
        InputError
            If a time lies outside the computed motion.

        Notes
        -----
        The caller can check that ``energy_rate = sum(contact_power) + external_power + circulatory_power -
        damping_power``. A preload by an imposed displacement counts as external force: the support's spring
        energy is relative to zero displacement (Brunetti, Massi, D'Ambrogio, Berthier, section 6).
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

    def spectrum(
        self,
        dof: str | None = None,
        *,
        begin: float | None = None,
        end: float | None = None,
        samples: int = 2**14,
        window: Any = "hann",
        detrend: Literal["constant", "linear"] | None = "constant",
    ) -> xr.Dataset:
        """Return the discrete Fourier transform of the displacements of a stretch.

        Parameters
        ----------
        dof
            Name of a dof; None: all of them.
        begin, end
            The stretch to sample, s; None: from 0, up to the end of the motion.
        samples
            Number of equidistant samples, >= 8.
        window
            A window of `scipy.signal.get_window`.
        detrend
            What is subtracted first: the mean, a straight line, or nothing.

        Returns
        -------
        xarray.Dataset
            Over ``frequency`` (Hz), and ``dof`` if none was named: ``coefficient``, complex, and
            ``amplitude`` of the cosine at that frequency, m. The attribute ``method`` is ``sampled``.

        Raises
        ------
        InputError
            If the dof is unknown or an argument is ill-posed.
        """
        from stickslip.motion.spectrum import sampled_spectrum

        return sampled_spectrum(self, dof, begin, end, samples, window, detrend)

    def time_by_combination(self) -> dict[str, float]:
        """Return how long each status combination held, s, in order of first appearance."""
        begins = np.concatenate([[0.0], self.events.time])
        held: dict[str, float] = {}
        names = [self.start.combination, *map(str, self.events.combination)]
        for name, time in zip(names, np.diff(begins, append=self.duration), strict=True):
            held[name] = held.get(name, 0.0) + float(time)
        return held

    def to_dataset(self, samples: int = 2001) -> xr.Dataset:
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
        number = whole_number("samples", samples, 2)
        check_memory("samples", number * (2 * self.scene.size + 6 * len(self.scene.contacts)), samples)
        motion = self.sample(np.linspace(0.0, self.duration, number))
        labels = np.array(self.scene.contact_labels())
        return motion.assign(
            event_time=("event", self.events.time, {"units": "s"}),
            event_contact=("event", labelled(labels, self.events.contact)),
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
        return f"{type(self).__name__}({self.duration:g} s, {counted}, stopped by {self.stop_reason})"

    @property
    def plot(self) -> MotionPlots:
        """Pictures: ``run.plot()``, a displacement; ``run.plot.history()``, ``run.plot.phase()``, ..."""
        from stickslip.motion.figures import MotionPlots

        return MotionPlots(self)

    def summary(self) -> Summary:
        """Return how long each combination held, and the first events."""
        held = self.time_by_combination()
        rows = [(name, time, 100.0 * time / (self.duration or 1.0)) for name, time in held.items()]
        shares = Table("Time by status combination", ("combination", "time, s", "share, %"), rows)
        facts = [
            ("motion", f"0 to {self.duration:g} s, stopped by {self.stop_reason}"),
            ("events", str(len(self.events))),
            ("grazings", str(len(self.grazings))),
            *undetermined_facts(self),
        ]
        return Summary(facts, [shares, *self.events.summary().tables])

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (type(self), self.scene, self.start, self.core.record())


def undetermined_facts(motion: Motion) -> list[tuple[str, str]]:
    """Return which forces of a motion are not determined, as a line of its summary; none if all are."""
    listed = [f"{name}: {', '.join(map(str, contacts))}" for name, contacts in motion.undetermined.items()]
    return [("forces not determined", "of contacts in " + "; ".join(listed))] if listed else []


def _restored(kind: type[Motion], scene: Scene, start: State, record: bytes) -> Motion:
    return kind(scene, start, _core.Trajectory.from_record(scene.core, record))
