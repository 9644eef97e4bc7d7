"""Limit cycles: exact periodic orbits and their stability."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stickslip import _core
from stickslip.cycles.harmonics import fourier_series, harmonic_energy
from stickslip.cycles.phases import CyclePhase, Margin, phases_of
from stickslip.faults import NoSteadyStateError
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.motion.energy import Balance
from stickslip.motion.motion import Motion, undetermined_facts
from stickslip.scene.checks import Complex, Real, check_memory, whole_number
from stickslip.scene.contact import dof_index
from stickslip.scene.scene import Scene, checked
from stickslip.scene.state import State
from stickslip.show.summary import Shown, Summary, Table
from stickslip.show.units import TIMES, measured, suited

if TYPE_CHECKING:
    from stickslip.cycles.figures import CyclePlots

#: Harmonics of a series unless told otherwise.
HARMONICS = 64
#: Combinations that a representation shows, and their letters, at most; it shows one of any length.
SHOWN, LETTERS = 24, 240
#: Harmonics among which the main one is looked for.
MAIN = 32
#: Multipliers, and frequencies of the modes of a phase, that a summary shows.
MULTIPLIERS, LINES = 6, 12


@dataclass(frozen=True, eq=False, repr=False)
class Cycle(Shown):
    """A periodic orbit, refined by Newton's method on the exact return map.

    The section t = 0 lies just after the event at which the sequence of combinations comes first in the
    alphabet. Under loads that oscillate it lies where these begin; the period is a whole number of theirs.
    Multipliers are the eigenvalues of the derivative of the flow over one period, phase by phase
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
    def load_periods(self) -> int:
        """Length of the period in periods of the loads that oscillate; 0 without such loads."""
        return self.core.load_periods

    @property
    def frequency(self) -> float:
        """Inverse of the period, Hz."""
        return 1.0 / self.core.period

    @cached_property
    def phases(self) -> tuple[CyclePhase, ...]:
        """The phases of one period, in order."""
        return phases_of(self.core, self.scene.contact_labels())

    def _name(self, contact: int) -> str:
        return str(self.scene.contact_labels()[contact])

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

        There are as many as the space has dimensions (`CyclePhase.dimension` of the first phase). One
        multiplier equals 1, that of a shift along the motion, unless loads that oscillate set the phase. The
        last `structural_zeros` are zero exactly; at a `corner` the others are nan.
        """
        return self.core.multipliers

    @property
    def entries(self) -> int:
        """Number of times in one period that a contact begins to stick, plus those that one begins to touch.

        A contact that goes from flight to sticking counts twice. A bounce does not count.
        """
        names = self.combinations
        changes = ((a, b) for k, name in enumerate(names) for a, b in zip(names[k - 1], name, strict=True))
        return sum((a != "s" == b) + (a == "d" != b) for a, b in changes)

    @property
    def structural_zeros(self) -> int:
        """Number of multipliers that are zero exactly, whatever the numbers of the scene.

        An event that lets a contact stick or touch forgets directions of the state, `CyclePhase.loss`. The
        derivative of the flow over a period then has at most the rank r = min(dimension - loss) over the
        phases, and a section of dimension d has d - r zeros. Derivation and examples: docs/limit-cycles.md.
        """
        return self.core.structural_zeros

    @cached_property
    def transverse_multipliers(self) -> Complex:
        """The multipliers of the return map: all but the one of a shift along the motion, which is 1.

        Under loads that oscillate these are all multipliers. They are computed from the return map, so that
        they keep their digits at a fold, where the multiplier 1 is defective.
        """
        return self.core.transverse

    @property
    def corner(self) -> bool:
        """Whether events coincide in the orbit whose order matters to its neighbours.

        The return map then has a derivative of its own for each order, and multipliers are nan where they are
        not zero. Slip and its end change the acceleration of their own contact alone, so that their saltation
        matrices commute; an impact changes the forces on others, and mass that couples contacts does.
        """
        return self.core.is_corner

    @property
    def stable(self) -> bool | None:
        """Whether all multipliers but that of the phase lie inside the unit circle; None: not known.

        It is not known at a `corner`, where an event function only touches zero, and where rounding decides
        whether the largest multiplier is above 1.
        """
        return self.core.is_stable

    @property
    def stability(self) -> str:
        """``stable``, ``unstable``, or ``stability not known`` and why, in words."""
        return self.core.stability

    @property
    def largest_multiplier(self) -> float:
        """Largest modulus of `transverse_multipliers`; nan if one of them is not known."""
        return self.core.largest_multiplier

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
    def run(self) -> Motion:
        """One period as a motion from 0 to `period`, to be sampled, drawn, and balanced like any other."""
        core = self.core.trajectory()
        position, velocity, combination, *held = core.state(0.0)
        start = State(position, velocity, combination, self.scene.dofs, *held)
        return Motion(self.scene, start, core)

    def balance(self) -> Balance:
        """Return the energy balance of one period, `Motion.balance` over the orbit.

        On a limit cycle nothing is stored: contact, external and circulatory work equal damping and impact
        losses.
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
        return harmonic_energy(self.scene, self.period, self.harmonics(count))

    @cached_property
    def modes(self) -> dict[str, Modes]:
        """The complex modes of every combination of the cycle in which small motions are linear.

        They are not where one contact slides by a law of friction while another one sticks.
        """
        found = {}
        for name in dict.fromkeys(self.combinations):
            with contextlib.suppress(NoSteadyStateError):
                found[name] = complex_modes(self.scene, name)
        return found

    def table(self) -> xr.Dataset:
        """Return combinations, durations and the frequencies of their modes, as the paper's Table 2.

        Returns
        -------
        xarray.Dataset
            ``duration`` (phase), s; ``frequency`` (phase, pair), Hz, ``growth_rate`` (phase, pair), 1/s, and
            ``unstable`` (phase, pair), see `Modes.unstable`, nan and False beyond
            the modes of a combination; coordinate ``combination`` (phase).
        """
        width = max(map(len, self.modes.values()), default=0)
        rows = np.full((len(self.combinations), width), complex(np.nan, np.nan))
        unstable = np.zeros(rows.shape, dtype=bool)
        for k, name in enumerate(self.combinations):
            if (modes := self.modes.get(name)) is not None:
                rows[k, : len(modes)], unstable[k, : len(modes)] = modes.eigenvalues, modes.unstable
        return xr.Dataset(
            {
                "duration": ("phase", self.durations, {"units": "s"}),
                "frequency": (("phase", "pair"), np.abs(rows) / (2.0 * np.pi), {"units": "Hz"}),
                "growth_rate": (("phase", "pair"), rows.real, {"units": "1/s"}),
                "unstable": (("phase", "pair"), unstable),
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
            If `count` is no integer >= 1, or the series would not fit into memory.
        """
        highest = whole_number("count", count, 1)
        # Coefficients in the core and here, and amplitudes.
        check_memory("count", 5.0 * highest * self.scene.size, count)
        return fourier_series(self.scene, self.period, self.core.harmonics(highest))

    def to_dataset(self, samples: int = 513) -> xr.Dataset:
        """Return what a file of the cycle holds.

        Parameters
        ----------
        samples
            Number of instants of one period, both ends included, >= 2.

        Returns
        -------
        xarray.Dataset
            ``duration`` (phase), ``mode_frequency``, ``growth_rate`` and ``unstable`` (phase, pair) of
            `table`; ``multiplier`` (order), complex; ``coefficient`` and ``amplitude`` (harmonic, dof) of
            `harmonics`; one period as `Motion.sample` gives it (time). The attributes
            ``period`` s, ``stable`` (-1: not known), ``stability``, ``structural_zeros``.

        Raises
        ------
        InputError
            If `samples` is no integer >= 2.
        """
        motion = self.run.to_dataset(samples)
        modes = self.table().rename(frequency="mode_frequency")
        motion = motion.drop_vars([str(name) for name in motion.data_vars if "event" in motion[name].dims])
        motion.attrs = {
            "period": self.period,
            "stable": -1 if self.stable is None else int(self.stable),
            "stability": self.stability,
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
        """Whether the main line is the second harmonic: there are subharmonics at half its frequency.

        Under loads that oscillate: whether the period is an even number of theirs.
        """
        if self.load_periods:
            return self.load_periods % 2 == 0
        return self.main_harmonic() == 2

    def margins(self) -> tuple[Margin, ...]:
        """Return how close every event function that ends no phase comes to zero."""
        return tuple(Margin(*margin, self._name(margin[1])) for margin in self.core.margins())

    def continued(self, scene: Scene) -> Cycle:
        """Return the orbit with the same sequence of events in another scene, stable there or not.

        The orbit solves the equations of the sequence; `is_followed` says whether the scene follows the
        orbit.

        Raises
        ------
        OrbitError
            If Newton's method does not find one: past a fold, or too far.
        InputError
            If the scene has other dofs or contacts.
        """
        return Cycle(scene, self.core.continued(checked(scene).core))

    def is_followed(self) -> bool:
        """Whether a run from the orbit follows its sequence of events, so that all contact laws hold."""
        return self.core.is_followed()

    def __repr__(self) -> str:
        names = self.combinations
        shown = max(1, min(SHOWN, LETTERS // max(1, len(self.scene.contacts))))
        sequence = " ".join(names) if len(names) <= shown else f"{' '.join(names[:shown])} ... ({len(names)})"
        lines = f"period {measured(self.period, TIMES, 9)}, {self.frequency:.6g} Hz, {sequence}"
        known = (
            "" if np.isnan(self.largest_multiplier) else f", largest multiplier {self.largest_multiplier:.4g}"
        )
        return f"Cycle({lines}, {self.stability}{known})"

    @property
    def plot(self) -> CyclePlots:
        """Pictures: ``cycle.plot(contact=0)``, a phase plane; ``cycle.plot.energy()`` and others."""
        from stickslip.cycles.figures import CyclePlots

        return CyclePlots(self)

    def summary(self) -> Summary:
        """Return period, stability, multipliers, and a table of the phases with the lines of their modes."""
        multipliers = self.transverse_multipliers[:MULTIPLIERS]
        listed = ", ".join(f"{abs(m):.6g} ∠ {np.degrees(np.angle(m)):.1f}°" for m in multipliers)
        doubled = ", period-doubled" if self.period_doubled else ""
        facts = [
            ("period", measured(self.period, TIMES, 9)),
            ("frequency", f"{self.frequency:.6g} Hz"),
            ("main line", f"{self.main_frequency():.6g} Hz{doubled}"),
            ("stability", self.stability),
            ("largest multipliers", "not known" if np.isnan(self.largest_multiplier) else listed),
            ("zero by structure", str(self.structural_zeros)),
            *undetermined_facts(self.run),
        ]
        rows = []
        unit, count = suited(self.period, TIMES)
        for phase in self.phases:
            if phase.duration > 0.0:
                modes = self.modes.get(phase.combination)
                lines = () if modes is None else modes.frequencies
                shown = " ".join(f"{line:.2f}" for line in lines[:LINES]) + (
                    " ..." if len(lines) > LINES else ""
                )
                rows.append((phase.combination, count * phase.start, count * phase.duration, shown))
        headings = ("combination", f"start, {unit}", f"duration, {unit}", "frequencies of its modes, Hz")
        return Summary(facts, [Table("Phases of one period", headings, rows)])

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.scene, self.core.record())


def _restored(scene: Scene, record: bytes) -> Cycle:
    return Cycle(scene, _core.Cycle.from_record(scene.core, record))
