"""Which of several unstable modes survives: the energy that each mode gains in one cycle, over its amplitude.

Steady sliding is set in motion in the shape of one unstable mode, at an amplitude and a phase, and followed
exactly, with every stick, slip and lift-off, for one period of the mode. Its energy is that of the deviation
d from the equilibrium,

    e = 1/2 d'^T M d' + 1/2 d^T K d,
    change of e = integral of (T_i - T_i0) (t_i . d') dt - N_i0 [n_i . d] + circulatory - damping - impacts,

(K with the symmetric part of a circulatory H, whose other part H_a works ``-integral of d'^T H_a d dt``),
where T_i0 and N_i0 are the contact forces of steady sliding, whose work the constant forces take up. A small
motion gains ``(e^{2 Re(lambda) T} - 1) e``. A larger one sticks, detaches and scatters into other modes,
gains less, and loses beyond the amplitude at which absorbed and released energy balance. A mode that grows
fast but closes its balance at little energy is overtaken by one that closes later: the latter carries the
limit cycle (section 6 of Brunetti, Massi, D'Ambrogio, Berthier leaves open which one does).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle
from typing import TYPE_CHECKING, Literal

import numpy as np
import scipy.optimize
import xarray as xr
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.modes.complex_modes import complex_modes
from stickslip.scene.checks import Complex, Real, real_array, whole_number
from stickslip.scene.contact import steady_slips
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, steady_sliding
from stickslip.scene.structure import Structure
from stickslip.show.summary import Shown, Summary, Table
from stickslip.transient.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Terms of the gain of one cycle.
TERMS = ("energy", "contact", "circulatory", "damping", "impact", "net")
#: Ratio of amplitudes in the search for the closed balance, and how often it is taken: eight octaves.
STEP, STEPS = 2.0**0.25, 32
#: The closed amplitude to this relative accuracy; the average over phases makes more meaningless.
CLOSED = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class ModeSelection(Shown):
    """Energy balance over amplitude of every unstable mode of steady sliding.

    Amplitudes are those of the largest displacement of a mode, m; works are per period of the mode, J,
    averaged over equidistant starting phases.

    Attributes
    ----------
    combination
        Status combination of steady sliding.
    modes
        Dims (mode,): ``frequency`` Hz, ``growth_rate`` Re(lambda) 1/s, ``amplitude`` at which the balance
        closes, nan if it does not, and mean ``energy`` of a motion in the shape of the mode there, J.
    gains
        Dims (mode, amplitude): ``energy`` at the start; ``contact``, the work of the fluctuating contact
        forces; ``circulatory``, the work of circulatory forces; ``damping`` and ``impact``, the losses;
        ``net``, the energy gained, from the states: ``contact + circulatory - damping - impact`` to rounding.
    """

    combination: str
    modes: xr.Dataset
    gains: xr.Dataset

    @property
    def dominant(self) -> int | None:
        """Index of the mode that closes its balance at the largest energy; None if none closes."""
        energy = self.modes.energy.to_numpy()
        return None if np.isnan(energy).all() else int(np.nanargmax(energy))

    def to_dataset(self) -> xr.Dataset:
        """Return `gains` and `modes`; of these ``closed_amplitude`` and ``closed_energy``."""
        closed = self.modes.rename(amplitude="closed_amplitude", energy="closed_energy")
        return self.gains.merge(closed).assign_attrs(combination=self.combination)

    def summary(self) -> Summary:
        """Return a table of the modes and where their balances close."""
        names = ("frequency", "growth_rate", "amplitude", "energy")
        rows = [
            (str(number), *map(float, row), "dominant" if k == self.dominant else "")
            for k, (number, *row) in enumerate(
                zip(self.modes.mode.to_numpy(), *(self.modes[name].to_numpy() for name in names), strict=True)
            )
        ]
        headings = ("mode", "frequency, Hz", "growth rate, 1/s", "closes at, m", "with, J", "")
        return Summary(tables=[Table(f"Unstable modes of {self.combination}", headings, rows)])

    def plot(self, *, over: Literal["amplitude", "energy"] = "amplitude", ax: Axes | None = None) -> Axes:
        """Draw the energy that every mode gains per period, part of its own; return the Axes.

        Parameters
        ----------
        over
            The abscissa: amplitude of the mode, or energy at the start.
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.show.plots import axes_of
        from stickslip.show.style import CONTACT

        axes = axes_of(ax)
        factor, label = {"amplitude": (1e6, "amplitude of the mode, µm"), "energy": (1e3, "energy, mJ")}[over]
        for j, (colour, style) in zip(
            range(self.modes.sizes["mode"]), cycle(zip(CONTACT, ("-", "--", ":", "-."), strict=True))
        ):
            mode, gain = self.modes.isel(mode=j), self.gains.isel(mode=j)
            name = f"{float(mode.frequency):.1f} Hz, growth rate {float(mode.growth_rate):.1f} 1/s"
            axes.plot(factor * gain[over], gain.net / gain.energy, style, color=colour, label=name)
            axes.plot(factor * float(mode[over]), 0.0, "o", color=colour)
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set(xlabel=label, ylabel="energy gained per period, part of its own")
        if over == "amplitude":
            axes.legend(frameon=False, fontsize=8)
        return axes

    def __repr__(self) -> str:
        return f"ModeSelection({self.combination!r})\n{self.summary()}"


def mode_selection(scene: Scene, amplitudes: ArrayLike | None = None, *, phases: int = 16) -> ModeSelection:
    """Return the energy gained per cycle over the amplitude of every oscillating unstable mode.

    Parameters
    ----------
    scene
        The scene; mass must not couple its contacts.
    amplitudes
        (k,), m, > 0: where gains are tabulated; None: 24 values up to twice the largest closed amplitude.
    phases
        Starting phases to average over, >= 1.

    Raises
    ------
    InputError
        If there is no sliding equilibrium, no mode oscillates and grows, mass couples the contacts, or an
        argument is out of range.
    """
    phases = whole_number("phases", phases, 1)
    given = None if amplitudes is None else np.atleast_1d(real_array("amplitudes", amplitudes, 0, 1))
    if given is not None and not (np.isfinite(given) & (given > 0.0)).all():
        raise InputError(f"amplitudes: must be positive and finite, got {given}")
    equilibrium = steady_sliding(scene)
    modes = complex_modes(scene, equilibrium.combination)
    chosen = np.flatnonzero((modes.eigenvalues.imag != 0.0) & modes.unstable)
    if chosen.size == 0:
        raise InputError("scene: steady sliding has no oscillating unstable mode")
    kicks = [
        Kick(scene, equilibrium, Structure.dense(scene), modes.eigenvalues[r], modes.shapes[:, r], phases)
        for r in chosen
    ]
    closed = np.array([kick.closed_amplitude() for kick in kicks])
    onset = np.array([kick.onset for kick in kicks])
    if given is None:
        given = 2.0 * np.nanmax(np.append(closed, onset)) * np.arange(1, 25) / 24.0
    table = np.array([[kick.gain(amplitude) for amplitude in given] for kick in kicks])
    energy = [kick.gain(amplitude)[0] for kick, amplitude in zip(kicks, closed, strict=True)]
    return ModeSelection(
        equilibrium.combination,
        xr.Dataset(
            {
                "frequency": ("mode", modes.frequencies[chosen], {"units": "Hz"}),
                "growth_rate": ("mode", modes.eigenvalues[chosen].real, {"units": "1/s"}),
                "amplitude": ("mode", closed, {"units": "m"}),
                "energy": ("mode", energy, {"units": "J"}),
            },
            coords={"mode": chosen},
        ),
        xr.Dataset(
            {term: (("mode", "amplitude"), table[:, :, k], {"units": "J"}) for k, term in enumerate(TERMS)},
            coords={"mode": chosen, "amplitude": ("amplitude", given, {"units": "m"})},
        ),
    )


@dataclass(frozen=True, eq=False)
class Kick:
    """Steady sliding, set in motion in the shape of one mode."""

    scene: Scene
    equilibrium: State
    structure: Structure
    rate: complex
    shape: Complex
    phases: int

    @property
    def period(self) -> float:
        """``2 pi / Im(lambda)``, s."""
        return 2.0 * np.pi / float(self.rate.imag)

    @property
    def onset(self) -> float:
        """Amplitude up to which no slip velocity and no normal force changes sign in the cycle, m."""
        structure, contacts = self.structure, self.scene.contacts
        slip = np.abs(structure.directions[:, ::2].T @ (self.rate * self.shape))
        # In a plane slip ends where both of its directions have lost it.
        beside = [k if one.beside is None else one.beside for k, one in enumerate(contacts)]
        in_plane = np.array([one.beside is not None for one in contacts])
        slip = np.hypot(slip, np.where(in_plane, slip[beside], 0.0))
        normal = self._reactions(self.shape, self.rate * self.shape)[1::2]
        load = self._static_forces()[1::2]
        # A given normal force does not change.
        with np.errstate(divide="ignore", invalid="ignore"):
            largest = np.array([steady_slips(contacts) / slip, load / np.abs(normal)])
        return float(np.nanmin(largest))

    def _reactions(self, position: Complex | Real, velocity: Complex | Real) -> Complex | Real:
        """Contact forces that springs and dampers call for, (2c,)."""
        structure = self.structure
        load = structure.stiffness @ position + structure.damping @ velocity
        forces: Complex | Real = structure.impulse_response.T @ load
        return forces

    def _static_forces(self) -> Real:
        structure = self.structure
        static = structure.stiffness @ self.equilibrium.position - structure.force
        forces: Real = structure.impulse_response.T @ static
        return forces

    def start(self, amplitude: float, phase: float) -> State:
        """Return the equilibrium with the mode added; the statuses follow from slips and forces."""
        turned = amplitude * np.exp(1j * phase)
        displacement, velocity = (self.shape * turned).real, (self.shape * self.rate * turned).real
        slip = self.structure.directions[:, ::2].T @ velocity
        forces = (self._static_forces() + self._reactions(displacement, velocity))[1::2]
        letters = [
            "d" if force < 0.0 else "o" if one.beside is not None else "+" if rate < one.slider_speed else "-"
            for force, rate, one in zip(forces, slip, self.scene.contacts, strict=True)
        ]
        for k, one in enumerate(self.scene.contacts):
            # Both directions of a plane open by the normal force of the first.
            if one.beside is not None and "d" in (letters[k], letters[one.beside]):
                letters[k] = letters[one.beside] = "d"
        position = self.equilibrium.position + displacement
        return State(position, velocity, "".join(letters), self.scene.dofs)

    def gain(self, amplitude: float) -> Real:
        """Return `TERMS` of one period, averaged over the phases, (5,); nan at the amplitude nan."""
        if np.isnan(amplitude):
            return np.full(len(TERMS), np.nan)
        turns = 2.0 * np.pi * np.arange(self.phases) / self.phases
        mean: Real = np.mean([self._gain(self.start(amplitude, phase)) for phase in turns], axis=0)
        return mean

    def _gain(self, start: State) -> Real:
        run = simulate(self.scene, self.period, start)
        end = run.state(run.duration)
        balance = run.balance()
        structure = self.structure
        # Positions and works relative to steady sliding.
        before, after = (
            (state.position - self.equilibrium.position, state.velocity) for state in (start, end)
        )
        change = after[0] - before[0]
        contact = balance.contact - self._static_forces() @ (structure.directions.T @ change)
        circulatory = balance.circulatory
        circulatory += (structure.circulatory @ self.equilibrium.position) @ change
        net = 0.5 * (after[0] + before[0]) @ structure.elastic @ change
        net += 0.5 * (after[1] + before[1]) @ structure.mass @ (after[1] - before[1])
        energy = 0.5 * before[0] @ structure.elastic @ before[0]
        energy += 0.5 * before[1] @ structure.mass @ before[1]
        return np.array([energy, contact, circulatory, balance.damping, balance.impact, net])

    def closed_amplitude(self) -> float:
        """Return the smallest amplitude at which nothing is gained, m; nan if none is found."""

        def net(amplitude: float) -> float:
            return float(self.gain(amplitude)[-1])

        low = 0.5 * self.onset
        for _ in range(STEPS):
            high = low * STEP
            if net(high) <= 0.0:
                return float(scipy.optimize.brentq(net, low, high, rtol=CLOSED, xtol=CLOSED * low))
            low = high
        return float("nan")
