"""Figures of motions.

Statuses differ in lightness and in line style or hatching, so that a figure printed in grey still reads.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol, TypeVar

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.motion.energy_figures import PARTS, energies, leading_contacts
from stickslip.motion.events import Events
from stickslip.motion.spectrum import Sampled
from stickslip.scene.checks import Names, Real
from stickslip.scene.contact import contact_index, dof_index
from stickslip.scene.state import State
from stickslip.show.plots import Plots, axes_of, figure_of, panels_of
from stickslip.show.style import COLOURS, CONTACT, HATCHES, NAMES, OVERLAY, STYLES
from stickslip.show.units import MICROMETRES

#: Samples of a history: some thirty per period of the fastest visible line.
HISTORY = 6001
#: Samples of a curve, and of an energy: some hundred per period of the cycle of ten of them.
SAMPLES, ENERGY = 4001, 2001
#: Bars of one status of a contact up to which they are hatched: narrower ones would only show moiré.
HATCHED = 24
#: Smallest amplitude drawn, of the largest.
FLOOR = 1e-6

#: What is drawn as zero of a displacement.
Origin = Literal["mean", "start"]


class Moving(Sampled, Protocol):
    """What can be drawn as a motion: a `Motion`, a `Trajectory`."""

    @property
    def start(self) -> State:
        """Where the motion starts."""

    @property
    def events(self) -> Events:
        """The events."""

    def energy(self, times: ArrayLike) -> xr.Dataset:
        """Return energies and powers."""

    def spectrum(
        self, dof: str | None = None, *, begin: float | None = None, end: float | None = None
    ) -> xr.Dataset:
        """Return amplitudes over frequency."""


Owner = TypeVar("Owner", covariant=True)


class MovingPlots(Plots[Owner]):
    """Pictures of what moves."""

    #: Samples of a phase plane.
    _fine = 4 * HISTORY

    def __init__(self, result: Owner, run: Moving) -> None:
        super().__init__(result)
        self._run = run

    def history(
        self,
        dofs: Sequence[str] | None = None,
        *,
        origin: Origin = "start",
        samples: int = HISTORY,
        figure: FigureBase | None = None,
    ) -> Figure:
        """Return a Figure of displacements over time, a panel for each dof.

        Parameters
        ----------
        dofs
            Names of dofs; None: the four that move most.
        origin
            What is drawn as zero.
        samples
            Points of each curve.
        figure
            Where to draw, with a panel for each dof or none; None: in a new one.

        Raises
        ------
        InputError
            If a dof is unknown.
        """
        run = self._run
        position = run.sample(np.linspace(0.0, run.duration, samples)).position.to_numpy()
        if dofs is None:
            extent = np.ptp(position, axis=0)
            dofs = [run.scene.dofs[k] for k in sorted(np.argsort(-extent, kind="stable")[:4])]
        indices = [dof_index("dofs", dof, run.scene.dofs) for dof in dofs]
        drawn, panels = panels_of(figure, (len(dofs), 1), (9.0, 1.7 * len(dofs)), sharex=True)
        for axes, dof, index in zip(panels, dofs, indices, strict=True):
            _displacement(axes, run, dof, position[:, index], origin, COLOURS["+"])
            axes.set_xlabel("time, s" if axes is panels[-1] else "")
        if figure is None and origin == "start":
            drawn.suptitle("Displacement from steady sliding")
        return figure_of(drawn)

    def phase(
        self,
        *,
        contact: int | str = 0,
        begin: float = 0.0,
        samples: int = SAMPLES,
        ax: Axes | None = None,
    ) -> Axes:
        """Draw tangential velocity over displacement of a contact, by status; return the Axes.

        The speed of the slider is dashed.

        Parameters
        ----------
        contact
            Name or index of the contact.
        begin
            Where the curve begins, s.
        samples
            Points of the curve, to which the instants about events are added.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If there is no such contact.
        """
        index = contact_index("contact", contact, self._run.scene.contacts)
        (curve,) = tangential(self._run, [index], samples, begin)
        axes = axes_of(ax)
        _portrait(axes, self._run, index, *curve)
        return axes

    def phase_planes(
        self,
        contacts: Sequence[int | str] | None = None,
        *,
        begin: float = 0.0,
        samples: int | None = None,
        figure: FigureBase | None = None,
    ) -> Figure:
        """Return a Figure of the phase plane of each contact (the paper's Fig. 6), as `phase` draws it.

        Parameters
        ----------
        contacts
            Names or indices of contacts; None: all of them.
        begin
            Where the curves begin, s.
        samples
            Points of each curve; None: 24004, of a cycle 4097.
        figure
            Where to draw, with a panel for each contact or none; None: in a new one.

        Raises
        ------
        InputError
            If a contact is unknown, or the scene has none.
        """
        run, labels = self._run, self._run.scene.contact_labels()
        if not labels:
            raise InputError(
                "motion: a scene without contacts has no phase plane of contacts; draw displacements"
            )
        given = range(len(labels)) if contacts is None else contacts
        chosen = [contact_index("contacts", contact, run.scene.contacts) for contact in given]
        drawn, panels = panels_of(figure, (1, len(chosen)), (4.8 * len(chosen), 4.4))
        curves = tangential(run, chosen, self._fine if samples is None else samples, begin)
        for axes, contact, curve in zip(panels, chosen, curves, strict=True):
            _portrait(axes, run, contact, *curve)
            axes.set_title(f"contact {labels[contact]}")
        if figure is None:
            drawn.suptitle(self._title())
        return figure_of(drawn)

    def _title(self) -> str:
        return "Phase plane of the contact masses"

    def statuses(self, contacts: Sequence[int | str] | None = None, *, ax: Axes | None = None) -> Axes:
        """Draw the status of contacts over time as bars; return the Axes.

        Parameters
        ----------
        contacts
            Names or indices of contacts; None: all of them.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If a contact is unknown.
        """
        run, every = self._run, self._run.scene.contacts
        given = range(len(every)) if contacts is None else contacts
        shown = [contact_index("contacts", contact, every) for contact in given]
        axes = axes_of(ax)
        _statuses(axes, run, shown)
        return axes

    def energy(
        self, *, begin: float = 0.0, end: float | None = None, figure: FigureBase | None = None
    ) -> Figure:
        """Return a Figure of stored energy, its rate, powers and statuses over time (Figs. 13 to 15).

        The rate comes from the state equation; the dashed line over it is the sum of the powers. Of more than
        four contacts the three of largest power are drawn, and the sum of the others.

        Parameters
        ----------
        begin, end
            The interval, s; None: to the end of the motion.
        figure
            Where to draw, with four panels or none; None: in a new one.

        Raises
        ------
        InputError
            If the interval lies outside the motion.
        """
        run, last = self._run, self._run.duration if end is None else end
        flow = run.energy(np.linspace(begin, last, ENERGY))
        rows = [3.0, 2.0, 3.0, 0.35 * min(len(run.scene.contacts), len(CONTACT)) + 0.3]
        drawn, panels = panels_of(figure, (4, 1), (9.0, 8.0), sharex=True, height_ratios=rows)
        for part, axes in zip(PARTS, panels, strict=False):
            energies(flow, part, ax=axes)
        status = panels[3]
        if run.scene.contacts:
            _statuses(status, run, leading_contacts(flow))
        status.set_xlabel("time, s")
        status.set_xlim(begin, last)
        return figure_of(drawn)


class MotionPlots(MovingPlots[Moving]):
    """Pictures of a motion. A dof is named by its name."""

    def __init__(self, run: Moving) -> None:
        super().__init__(run, run)

    def __call__(
        self,
        dof: str | None = None,
        *,
        origin: Origin = "start",
        label: str | None = None,
        samples: int = SAMPLES,
        ax: Axes | None = None,
    ) -> Axes:
        """Draw the displacement of a dof over time; return the Axes.

        Parameters
        ----------
        dof
            Name of the dof; None: the one that moves most.
        origin
            What is drawn as zero.
        label
            Name of the curve for a legend.
        samples
            Points of the curve.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If the dof is unknown.
        """
        run = self._run
        position = run.sample(np.linspace(0.0, run.duration, samples)).position.to_numpy()
        most = run.scene.dofs[int(np.ptp(position, axis=0).argmax())] if dof is None else dof
        index = dof_index("dof", most, run.scene.dofs)
        axes = axes_of(ax)
        _displacement(axes, run, most, position[:, index], origin, OVERLAY[0][0], label)
        axes.set_xlim(0.0, run.duration)
        return axes

    def spectrum(
        self,
        dof: str | None = None,
        *,
        begin: float | None = None,
        end: float | None = None,
        label: str | None = None,
        ax: Axes | None = None,
    ) -> Axes:
        """Draw the spectrum of a dof over six decades, as ``run.spectrum`` returns it; return the Axes.

        Parameters
        ----------
        dof
            Name of the dof; None: the one that moves most.
        begin, end
            The stretch to sample, s. Without them a `Trajectory` has the lines of its limit cycle.
        label
            Name of the curve for a legend.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If the dof is unknown, or the stretch lies outside the motion.
        NotPeriodicError
            If lines of a limit cycle are drawn and the motion settles to none.
        """
        return spectrum(self._run.spectrum(dof, begin=begin, end=end), label=label, ax=ax)


def spectrum(
    lines: xr.Dataset, dof: str | None = None, *, label: str | None = None, ax: Axes | None = None
) -> Axes:
    """Draw a spectrum over six decades, stems for exact lines and a curve for a sampled stretch."""
    axes = axes_of(ax)
    if "dof" in lines.dims:
        index = None if dof is None else dof_index("dof", dof, lines.dof.to_numpy().tolist())
        lines = _largest(lines) if index is None else lines.isel(dof=index)
    frequency = lines.frequency.to_numpy()
    amplitude = MICROMETRES * lines.amplitude.to_numpy()
    moving = frequency > 0.0
    floor = FLOOR * amplitude[moving].max()
    seen = moving & (amplitude >= floor)
    if lines.attrs.get("method") == "exact" or "harmonic" in lines.dims:
        axes.vlines(frequency[seen], floor, amplitude[seen], color=OVERLAY[0][0], linewidth=1.0)
        axes.plot(frequency[moving], amplitude[moving], "o", markersize=3, color=OVERLAY[0][0], label=label)
    else:
        axes.plot(frequency[moving], amplitude[moving], color=OVERLAY[1][0], linewidth=0.9, label=label)
    axes.set(xlabel="frequency, Hz", ylabel="amplitude, µm", yscale="log")
    axes.set_xlim(0.0, 1.03 * frequency[seen].max())
    axes.set_ylim(bottom=floor)
    return axes


def _largest(lines: xr.Dataset) -> xr.Dataset:
    """Return the lines of the dof with the largest amplitude beside the mean."""
    moving = lines.amplitude.where(lines.frequency > 0.0, 0.0)
    return lines.isel(dof=int(moving.max(lines.frequency.dims[0]).argmax("dof")))


def _displacement(
    axes: Axes, run: Moving, dof: str, x: Real, origin: Origin, colour: str, label: str | None = None
) -> None:
    zero = x[0] if origin == "start" else x.mean()
    times = np.linspace(0.0, run.duration, x.size)
    axes.plot(times, MICROMETRES * (x - zero), color=colour, linewidth=0.8, label=label)
    axes.set(xlabel="time, s", ylabel=f"{dof}, µm")


def _portrait(axes: Axes, run: Moving, contact: int, status: Names, displaced: Real, velocity: Real) -> None:
    for letter in [letter for letter in COLOURS if (status == letter).any()]:
        axes.plot(
            np.where(status == letter, displaced, np.nan),
            velocity,
            color=COLOURS[letter],
            linestyle=STYLES[letter],
            linewidth=1.3,
            label=f"{letter}  {NAMES[letter]}",
        )
    speed = run.scene.contacts[contact].slider_speed
    axes.axhline(speed, color="black", linewidth=0.6, linestyle=(0, (4, 2)), label="slider")
    axes.set(xlabel="tangential displacement, µm", ylabel="tangential velocity, m/s")
    axes.legend(frameon=False, fontsize="small")


def _statuses(axes: Axes, run: Moving, contacts: Sequence[int]) -> None:
    by_contact = [status_spans(run, contact) for contact in contacts]
    most = max((len(bars) for spans in by_contact for bars in spans.values()), default=0)
    for letter, colour in COLOURS.items():
        rows = [
            (begin, begin + width, place)
            for place, spans in enumerate(by_contact)
            for begin, width in spans.get(letter, ())
        ]
        if rows:
            begin, end, middle = np.array(rows).T
            low, high = middle - 0.4, middle + 0.4
            corners = np.stack([begin, low, end, low, end, high, begin, high], axis=1)
            # One path, added as it is: thousands of bars are drawn as fast as a few.
            bars = PathPatch(
                Path.make_compound_path_from_polys(corners.reshape(-1, 4, 2)),
                facecolor=colour,
                hatch=HATCHES[letter] if most <= HATCHED else None,
                edgecolor="white",
                linewidth=0.0,
                label=f"{letter}  {NAMES[letter]}",
            )
            axes.add_artist(bars)
    labels = [f"contact {run.scene.contact_labels()[contact]}" for contact in contacts]
    axes.set(xlabel="time, s", xlim=(0.0, run.duration), yticks=range(len(labels)))
    axes.set_yticklabels(labels)
    if labels:
        axes.set_ylim(len(labels) - 0.5, -0.5)
        axes.legend(frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))


def status_spans(run: Moving, contact: int) -> dict[str, list[tuple[float, float]]]:
    """Return the stretches of every status of a contact that occurs, as (begin, width), s."""
    letters = [run.start.combination[contact], *(found[contact] for found in run.events.combination)]
    begins = np.concatenate([[0.0], run.events.time])
    changes = [0, *(k for k in range(1, len(letters)) if letters[k] != letters[k - 1])]
    ends = np.append(begins[changes[1:]], run.duration)
    spans: dict[str, list[tuple[float, float]]] = {status: [] for status in COLOURS}
    for k, end in zip(changes, ends, strict=True):
        if end > begins[k]:
            spans[letters[k]].append((float(begins[k]), float(end - begins[k])))
    return {status: found for status, found in spans.items() if found}


def instants(run: Moving, samples: int, contacts: Sequence[int] | None = None, begin: float = 0.0) -> Real:
    """Return equidistant times from `begin` on, and the instants just before and after every event, s.

    A curve through them shows each status from its first to its last instant; of some contacts their own
    events are enough.
    """
    events = run.events.time
    if contacts is not None:
        events = events[np.isin(run.events.contact, list(contacts))]
    events = events[events > begin]
    return np.unique(
        np.concatenate([np.linspace(begin, run.duration, samples), events, np.nextafter(events, 0.0)])
    )


def tangential(
    run: Moving, contacts: Sequence[int], samples: int = SAMPLES, begin: float = 0.0
) -> list[tuple[Names, Real, Real]]:
    """Return statuses, displacement in µm and velocity in m/s along the tangent of each contact."""
    motion = run.sample(instants(run, samples, contacts, begin))
    position, velocity, status = (motion[name].to_numpy() for name in ("position", "velocity", "status"))
    directions = [run.scene.tangential_direction(contact) for contact in contacts]
    return [
        (status[:, contact], MICROMETRES * (position @ direction), velocity @ direction)
        for contact, direction in zip(contacts, directions, strict=True)
    ]
