"""Limit cycles: exact periodic orbits, their stability, and how they change with a parameter."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import xarray as xr

from stickslip import _core
from stickslip.arrays import Complex, Real
from stickslip.contact import dof_index
from stickslip.energy import Balance
from stickslip.errors import InputError, NotPeriodicError
from stickslip.harmonic_energy import harmonic_energy
from stickslip.modes import Modes, complex_modes
from stickslip.scene import Scene, checked
from stickslip.state import State
from stickslip.transient import Trajectory

#: What the core says a motion settles to: kind, cycle, Lyapunov exponent and the time it was measured over,
#: last stretch of the motion.
Settled: TypeAlias = "tuple[str, _core.Cycle | None, tuple[float, float], _core.Trajectory | None]"

#: Harmonics of a series unless told otherwise.
HARMONICS = 64
#: Harmonics among which the main one is looked for.
MAIN = 32
#: Growth of neighbours, as a power of e, above which a motion is chaotic; below its
#: negative it still settles.
DECIDED = 2.0


class CyclePhase(NamedTuple):
    """One phase of a cycle."""

    combination: str
    #: start within the period, s
    start: float
    #: s
    duration: float


class Margin(NamedTuple):
    """How close an event function that ends no phase comes to zero: what would change the sequence."""

    #: index into `Cycle.phases`
    phase: int
    #: index of the contact
    contact: int
    #: the event that would happen
    kind: str
    #: lowest value in the unit of the event function (m/s, N or m); negative: not a motion of the scene
    value: float
    #: where in the period, s
    time: float
    #: whether it is a local minimum (a touch there), or lies at the end of the phase (two events that meet)
    interior: bool


@dataclass(frozen=True, eq=False, repr=False)
class Cycle:
    """A periodic orbit, refined by Newton's method on the exact return map.

    The section t = 0 lies just after the event at which the sequence of combinations comes first in the
    alphabet. Multipliers are the eigenvalues of the derivative of the flow over one period, phase by phase
    ``exp(A tau)`` times the saltation matrix of the event (Aizerman and Gantmakher 1958; Leine and Nijmeijer
    2004, ch. 7).
    """

    scene: Scene
    core: _core.Cycle = field(repr=False)

    @property
    def period(self) -> float:
        """Smallest period, s."""
        return self.core.period

    @property
    def frequency(self) -> float:
        """Inverse of the period, Hz."""
        return 1.0 / self.core.period

    @cached_property
    def phases(self) -> tuple[CyclePhase, ...]:
        """The phases of one period, in order."""
        durations = self.core.durations
        starts = np.concatenate([[0.0], np.cumsum(durations)[:-1]])
        rows = zip(self.core.combinations, starts, durations, strict=True)
        return tuple(CyclePhase(name, float(start), float(length)) for name, start, length in rows)

    @property
    def combinations(self) -> tuple[str, ...]:
        """The status combinations of one period, in order; those that last no time are left out."""
        return tuple(phase.combination for phase in self.phases if phase.duration > 0.0)

    @property
    def durations(self) -> Real:
        """Durations of `combinations`, s."""
        return np.array([phase.duration for phase in self.phases if phase.duration > 0.0])

    @cached_property
    def multipliers(self) -> Complex:
        """Floquet multipliers on the admissible space at the section, complex, descending in modulus.

        Two per coordinate left free and one per sticking contact. One equals 1: a shift along the motion.
        """
        return self.core.multipliers

    @property
    def structural_zeros(self) -> int:
        """Number of multipliers that are zero exactly.

        The dimension of the admissible space at the section less the smallest one on the way: one for each
        contact that slides at the section and sticks there, two for each that is open at the section and
        closed there; or, where that is more, one for a plastic impact that leaves the contact open.
        """
        return self.core.structural_zeros

    @cached_property
    def transverse_multipliers(self) -> Complex:
        """The multipliers without the one of the phase of the motion, which is 1."""
        return np.delete(self.multipliers, np.argmin(np.abs(self.multipliers - 1.0)))

    @property
    def stable(self) -> bool:
        """Whether all multipliers but the one of the phase lie inside the unit circle."""
        return self.core.is_stable

    @property
    def residual(self) -> float:
        """Largest mismatch between phases, relative to the range of the orbit."""
        return self.core.residual

    @property
    def minimum(self) -> xr.DataArray:
        """Smallest displacement of every dof, (dof,), m."""
        return self._of_dofs("minimum", self.core.minimum)

    @property
    def maximum(self) -> xr.DataArray:
        """Largest displacement of every dof, (dof,), m."""
        return self._of_dofs("maximum", self.core.maximum)

    @property
    def amplitude(self) -> xr.DataArray:
        """Half the difference of largest and smallest displacement of every dof, (dof,), m."""
        return self._of_dofs("amplitude", 0.5 * (self.core.maximum - self.core.minimum))

    def _of_dofs(self, name: str, values: Real) -> xr.DataArray:
        coords = {"dof": list(self.scene.dofs)}
        return xr.DataArray(values, dims="dof", coords=coords, name=name, attrs={"units": "m"})

    @cached_property
    def run(self) -> Trajectory:
        """One period as a motion from 0 to `period`, to be sampled, drawn, and balanced like any other."""
        core = self.core.trajectory()
        position, velocity, combination = core.state(0.0)
        start = State(position, velocity, combination, self.scene.dofs)
        return Trajectory(self.scene, start, core)

    def balance(self) -> Balance:
        """Return where the energy of one period comes from and goes: `Trajectory.balance` over the orbit.

        On a limit cycle nothing is stored: contact and external work equal damping and impact losses.
        """
        return self.run.balance()

    def harmonic_energy(self, count: int = HARMONICS) -> xr.Dataset:
        """Return mean energies and works per period of every harmonic.

        Parameters
        ----------
        count
            Highest harmonic, >= 1.

        Returns
        -------
        xarray.Dataset
            (harmonic,) J: ``kinetic`` and ``elastic``, means over the period (their sums over all harmonics
            are the mean energies); ``damping``, dissipated per period. (harmonic, contact) J per period, into
            the structure positive: ``friction_work`` and ``normal_work``, the latter the impact losses with
            minus sign when summed over all harmonics. In each harmonic both together equal the damping.
            Coordinate ``frequency`` (harmonic), Hz.

        Raises
        ------
        InputError
            If `count` is no integer >= 1.

        Notes
        -----
        Where impacts make velocities jump, works decay as 1 / harmonic^2.
        """
        return harmonic_energy(self, count)

    @cached_property
    def modes(self) -> dict[str, Modes]:
        """The complex modes of every combination of the cycle."""
        return {name: complex_modes(self.scene, name) for name in dict.fromkeys(self.combinations)}

    def table(self) -> xr.Dataset:
        """Return combinations, durations and the frequencies of their modes, as the paper's Table 2.

        Returns
        -------
        xarray.Dataset
            ``duration`` (phase), s; ``frequency`` (phase, mode), Hz, and ``growth`` (phase, mode), 1/s, one
            of each conjugate pair, nan beyond the modes of a combination; coordinate ``combination`` (phase).
        """
        upper = {name: modes.eigenvalues[modes.eigenvalues.imag >= 0.0] for name, modes in self.modes.items()}
        width = max(values.size for values in upper.values())
        rows = np.full((len(self.combinations), width), complex(np.nan, np.nan))
        for row, name in zip(rows, self.combinations, strict=True):
            row[: upper[name].size] = upper[name]
        return xr.Dataset(
            {
                "duration": ("phase", self.durations, {"units": "s"}),
                "frequency": (("phase", "mode"), np.abs(rows) / (2.0 * np.pi), {"units": "Hz"}),
                "growth": (("phase", "mode"), rows.real, {"units": "1/s"}),
            },
            coords={"combination": ("phase", list(self.combinations))},
        )

    def harmonics(self, count: int = HARMONICS) -> xr.Dataset:
        """Return the Fourier series of the displacement, in closed form.

        ``x(t) = c_0 + 2 Re sum_k c_k exp(2 pi i k t / period)``, t = 0 at the section: every phase is a sum
        of exponentials, whose integrals are exact; nothing is sampled.

        Parameters
        ----------
        count
            Highest harmonic, >= 1.

        Returns
        -------
        xarray.Dataset
            ``coefficient`` (harmonic, dof), complex, m, from harmonic 0; ``amplitude`` of the cosine of each
            harmonic, ``2 |c_k|`` (``|c_0|`` for the mean), m; coordinate ``frequency`` (harmonic), Hz.

        Raises
        ------
        InputError
            If `count` is no integer >= 1.
        """
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
            raise InputError(f"count: expected an integer >= 1, got {count!r}")
        coefficients = self.core.harmonics(int(count))
        amplitude = np.abs(coefficients) * np.where(np.arange(count + 1) == 0, 1.0, 2.0)[:, None]
        order = np.arange(count + 1)
        return xr.Dataset(
            {
                "coefficient": (("harmonic", "dof"), coefficients, {"units": "m"}),
                "amplitude": (("harmonic", "dof"), amplitude, {"units": "m"}),
            },
            coords={
                "harmonic": order,
                "frequency": ("harmonic", order * self.frequency, {"units": "Hz"}),
                "dof": list(self.scene.dofs),
            },
        )

    def dataset(self, samples: int = 513) -> xr.Dataset:
        """Return what a file of the cycle holds.

        Parameters
        ----------
        samples
            Number of instants of one period, both ends included, >= 2.

        Returns
        -------
        xarray.Dataset
            ``duration`` (phase), ``mode_frequency`` and ``mode_growth`` (phase, mode) of `table`;
            ``multiplier`` (order), complex; ``coefficient`` and ``amplitude`` (harmonic, dof) of
            `harmonics`; one period as `Trajectory.sample` gives it (time). The attributes
            ``period`` s, ``stable``, ``structural_zeros``.

        Raises
        ------
        InputError
            If `samples` is no integer >= 2.
        """
        motion = self.run.dataset(samples)
        modes = self.table().rename(frequency="mode_frequency", growth="mode_growth")
        motion = motion.drop_vars([str(name) for name in motion.data_vars if "event" in motion[name].dims])
        motion.attrs = {
            "period": self.period,
            "stable": int(self.stable),
            "structural_zeros": self.structural_zeros,
        }
        return (
            motion.merge(modes)
            .merge(self.harmonics())
            .assign(multiplier=("order", self.multipliers, {"units": "1"}))
        )

    def main_harmonic(self, dof: str | None = None) -> int:
        """Return the harmonic with the largest amplitude in a dof, or in the root sum square over all dofs.

        Raises
        ------
        InputError
            If the dof is unknown.
        """
        size = self._lines
        if dof is not None:
            size = size[:, [dof_index("dof", dof, self.scene.dofs)]]
        return int(1 + np.argmax((size**2).sum(axis=1)))

    @cached_property
    def _lines(self) -> Real:
        """|c_k| of every dof, from the first harmonic to `MAIN`."""
        return np.abs(self.core.harmonics(MAIN)[1:])

    def main_frequency(self, dof: str | None = None) -> float:
        """Return the frequency of the main harmonic of a dof, or of all motion, Hz."""
        return self.main_harmonic(dof) * self.frequency

    @property
    def period_doubled(self) -> bool:
        """Whether the main line is the second harmonic: there are subharmonics at half its frequency."""
        return self.main_harmonic() == 2

    def margins(self) -> tuple[Margin, ...]:
        """Return how close every event function that ends no phase comes to zero."""
        return tuple(Margin(*margin) for margin in self.core.margins())

    def continued(self, scene: Scene) -> Cycle:
        """Return the orbit with the same sequence of events in another scene, stable there or not.

        It solves the equations of the sequence; whether the scene follows it says `is_followed`.

        Raises
        ------
        OrbitError
            If Newton's method does not find one: past a fold, or too far.
        InputError
            If the scene has other dofs or contacts.
        """
        return Cycle(scene, self.core.continued(checked(scene).core))

    def is_followed(self) -> bool:
        """Whether a run from the orbit keeps to its sequence of events: its contact laws all hold."""
        return self.core.is_followed()

    def __repr__(self) -> str:
        largest = np.abs(self.transverse_multipliers).max(initial=0.0)
        verdict = "stable" if self.stable else "unstable"
        lines = f"period {1e3 * self.period:.9g} ms, {self.frequency:.6g} Hz, {' '.join(self.combinations)}"
        return f"Cycle({lines}, {verdict}, largest multiplier {largest:.4g})"

    def _repr_html_(self) -> str:
        from stickslip.notebook import cycle_html

        return cycle_html(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.scene, self.core.record())


def _restored(scene: Scene, record: dict[str, Any]) -> Cycle:
    return Cycle(scene, scene.core.cycle(record))


def limit_cycle(run: Trajectory, further: float = 10.0) -> Cycle:
    """Return the periodic orbit that a run settles to; see `Trajectory.limit_cycle`.

    Raises
    ------
    NotPeriodicError
        If it settles to none.
    """
    kind, core, growth, last = run.core.attractor(further)
    if core is not None:
        return Cycle(run.scene, core)
    ended = run if last is None else Trajectory(run.scene, run.state(run.duration), last)
    label, message = described(kind, growth, ended.core.stop_message)
    raise NotPeriodicError(message, ended, label, growth[0])


def described(kind: str, growth: tuple[float, float], stop_message: str) -> tuple[str, str]:
    """Return what a motion without limit cycle is, and that in a sentence; `growth` is exponent and time."""
    if kind == "equilibrium":
        return kind, "the motion settles to an equilibrium: every mode decays and no event can follow"
    if kind == "unbounded":
        return kind, "the motion grows without bound"
    if kind == "stopped":
        return kind, f"the run could not go on: {stop_message}"
    exponent, time = growth
    shown = f"largest Lyapunov exponent {exponent:.4g} 1/s over {time:g} s"
    if exponent * time > DECIDED:
        return "chaotic", f"the motion is chaotic: {shown}"
    if exponent * time > -DECIDED:
        return (
            "quasi-periodic",
            f"the motion does not recur, and its neighbours neither part nor meet: {shown}",
        )
    return "unsettled", f"the motion has not settled yet ({shown}); simulate longer"
