"""Figures of motions.

Statuses differ in lightness and in line style or hatching, so that a figure printed in grey still reads.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol, runtime_checkable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from stickslip.faults import InputError
from stickslip.motion.events import Events
from stickslip.motion.spectrum import Sampled
from stickslip.scene.checks import Names, Real
from stickslip.scene.contact import contact_index, dof_index
from stickslip.scene.state import State
from stickslip.show.style import COLOURS, HATCHES, NAMES, OVERLAY, STYLES
from stickslip.show.units import MICROMETRES

#: Samples of a history: some thirty per period of the fastest visible line.
HISTORY = 6001
#: Samples of a curve.
SAMPLES = 4001
#: Bars of one status of a contact up to which they are hatched: narrower ones would only show moiré.
HATCHED = 24
#: Smallest amplitude drawn, of the largest.
FLOOR = 1e-6


class Moving(Sampled, Protocol):
    """What can be drawn as a motion: a `Motion`, a `Trajectory`."""

    @property
    def start(self) -> State:
        """Where the motion starts."""

    @property
    def events(self) -> Events:
        """The events."""


@runtime_checkable
class Periodic(Protocol):
    """What has one period as a motion: a `Cycle`."""

    @property
    def run(self) -> Moving:
        """One period."""


def history(run: Moving, dofs: Sequence[str] | None = None) -> Figure:
    """Return displacements over time, relative to the start.

    Parameters
    ----------
    run
        The motion.
    dofs
        Names of dofs; None: the four that move most.

    Raises
    ------
    InputError
        If a dof is unknown.
    """
    motion = run.sample(np.linspace(0.0, run.duration, HISTORY))
    if dofs is None:
        extent = np.ptp(motion.position.to_numpy(), axis=0)
        dofs = [run.scene.dofs[k] for k in sorted(np.argsort(-extent, kind="stable")[:4])]
    for dof in dofs:
        dof_index("dofs", dof, run.scene.dofs)
    figure = Figure(figsize=(9.0, 1.7 * len(dofs)), layout="constrained")
    panels = figure.subplots(len(dofs), 1, sharex=True, squeeze=False)[:, 0]
    for axes, dof in zip(panels, dofs, strict=True):
        displacement = motion.position.sel(dof=dof)
        axes.plot(motion.time, 1e6 * (displacement - displacement[0]), color=COLOURS["+"], linewidth=0.7)
        axes.set_ylabel(f"{dof}, µm")
    panels[-1].set_xlabel("time, s")
    figure.suptitle("Displacement from steady sliding")
    return figure


def phase_plane(run: Moving) -> Figure:
    """Return slip motion of every contact in its phase plane, from the start on (the paper's Fig. 6)."""
    return phase_planes(run, 4 * HISTORY, "Phase plane of the contact masses")


def displacement(
    axes: Axes,
    motion: Moving | Periodic,
    dof: str,
    label: str | None = None,
    *,
    origin: Literal["mean", "start"] = "mean",
    samples: int = SAMPLES,
) -> Axes:
    """Draw the displacement of a dof over time, about its mean or from the start.

    Parameters
    ----------
    axes
        Where to draw.
    motion
        A run, or a cycle, of which one period is drawn.
    dof
        Name of the dof.
    label
        For the legend.
    origin
        What is drawn as zero.
    samples
        Points of the curve.

    Raises
    ------
    InputError
        If the dof is unknown.
    """
    displacements([axes], motion, [dof], [label], origin=origin, samples=samples)
    return axes


def displacements(
    panels: Sequence[Axes],
    motion: Moving | Periodic,
    dofs: Sequence[str],
    labels: Sequence[str | None] | None = None,
    *,
    origin: Literal["mean", "start"] = "mean",
    samples: int = SAMPLES,
) -> None:
    """Draw several dofs as `displacement` does, one on each of some axes; the motion is sampled once.

    Parameters
    ----------
    panels
        The axes to draw on, one for each dof.
    motion, origin, samples
        As for `displacement`.
    dofs
        Names of the dofs.
    labels
        Names of the curves for a legend, one for each dof.
    """
    run = motion_of(motion)
    indices = [dof_index("dof", dof, run.scene.dofs) for dof in dofs]
    times = np.linspace(0.0, run.duration, samples)
    position = run.sample(times).position.to_numpy()
    names = [None] * len(dofs) if labels is None else labels
    for axes, dof, index, label in zip(panels, dofs, indices, names, strict=True):
        x = position[:, index]
        zero = x[0] if origin == "start" else x.mean()
        axes.plot(times, MICROMETRES * (x - zero), color=OVERLAY[0][0], linewidth=0.8, label=label)
        axes.set(xlabel="time, s", ylabel=f"{dof}, µm", xlim=(0.0, run.duration))


def phase_portrait(
    axes: Axes, motion: Moving | Periodic, contact: int | str = 0, samples: int = SAMPLES
) -> Axes:
    """Draw tangential velocity over displacement of a contact, by status; the slider's speed is dashed.

    Parameters
    ----------
    axes
        Where to draw.
    motion
        A run, or a cycle.
    contact
        Name or index of the contact.
    samples
        Points of the curve.
    """
    phase_portraits([axes], motion, [contact], samples)
    return axes


def phase_portraits(
    panels: Sequence[Axes],
    motion: Moving | Periodic,
    contacts: Sequence[int | str],
    samples: int = SAMPLES,
    begin: float = 0.0,
) -> None:
    """Draw several contacts as `phase_portrait` does, one on each of some axes, from one sampling.

    Parameters
    ----------
    panels
        The axes to draw on, one for each contact.
    motion, samples
        As for `phase_portrait`.
    contacts
        Names or indices of the contacts.
    begin
        Where the curves begin, s.
    """
    run = motion_of(motion)
    chosen = [contact_index("contact", contact, run.scene.contacts) for contact in contacts]
    curves = tangential(run, chosen, samples, begin)
    for axes, contact, curve in zip(panels, chosen, curves, strict=True):
        _portrait(axes, run, contact, *curve)


def _portrait(axes: Axes, run: Moving, contact: int, status: Names, displaced: Real, velocity: Real) -> None:
    present = [letter for letter in COLOURS if (status == letter).any()]
    for letter in present:
        axes.plot(
            np.where(status == letter, displaced, np.nan),
            velocity,
            color=COLOURS[letter],
            linestyle=STYLES[letter],
            linewidth=1.3,
            label=f"{letter}  {NAMES[letter]}",
        )
    axes.axhline(
        run.scene.contacts[contact].slider_speed,
        color="black",
        linewidth=0.6,
        linestyle=(0, (4, 2)),
        label="slider",
    )
    axes.set(xlabel="tangential displacement, µm", ylabel="tangential velocity, m/s")
    axes.legend(frameon=False, fontsize="small")


def contact_status(
    axes: Axes, motion: Moving | Periodic, contacts: Sequence[int | str] | None = None
) -> Axes:
    """Draw the status of contacts over time as bars.

    Parameters
    ----------
    axes
        Where to draw.
    motion
        A run, or a cycle.
    contacts
        Names or indices of contacts; None: all of them.
    """
    run = motion_of(motion)
    every = run.scene.contacts
    given = range(len(every)) if contacts is None else contacts
    shown = [contact_index("contacts", contact, every) for contact in given]
    labels = [run.scene.contact_labels()[contact] for contact in shown]
    by_contact = [status_spans(run, contact) for contact in shown]
    most = max((len(bars) for spans in by_contact for bars in spans.values()), default=0)
    for letter, colour in COLOURS.items():
        rows = [
            (begin, begin + width, contact)
            for contact, spans in enumerate(by_contact)
            for begin, width in spans.get(letter, ())
        ]
        if rows:
            begin, end, middle = np.array(rows).T
            low, high = middle - 0.4, middle + 0.4
            corners = np.stack([begin, low, end, low, end, high, begin, high], axis=1)
            # One path, whose extent is not asked for: thousands of bars are drawn as fast as a few.
            bars = Path.make_compound_path_from_polys(corners.reshape(-1, 4, 2))
            axes.add_artist(
                PathPatch(
                    bars,
                    facecolor=colour,
                    hatch=HATCHES[letter] if most <= HATCHED else None,
                    edgecolor="white",
                    linewidth=0.0,
                    label=f"{letter}  {NAMES[letter]}",
                )
            )
    axes.set(xlabel="time, s", xlim=(0.0, run.duration), yticks=range(len(labels)))
    axes.set_yticklabels([f"contact {label}" for label in labels])
    if not labels:
        return axes
    axes.set_ylim(len(labels) - 0.5, -0.5)
    axes.legend(frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return axes


def spectrum(axes: Axes, lines: xr.Dataset, label: str | None = None) -> Axes:
    """Draw a spectrum of one dof: stems for the exact lines of a cycle, a curve for a sampled stretch.

    Parameters
    ----------
    axes
        Where to draw; amplitudes are on a logarithmic scale of six decades.
    lines
        From `Trajectory.spectrum` of one dof.
    label
        For the legend.
    """
    frequency = lines.frequency.to_numpy()
    amplitude = MICROMETRES * lines.amplitude.to_numpy()
    moving = frequency > 0.0
    floor = FLOOR * amplitude[moving].max()
    seen = moving & (amplitude >= floor)
    if lines.attrs.get("method") == "exact":
        axes.vlines(frequency[seen], floor, amplitude[seen], color=OVERLAY[0][0], linewidth=1.0)
        axes.plot(frequency[moving], amplitude[moving], "o", markersize=3, color=OVERLAY[0][0], label=label)
    else:
        axes.plot(frequency[moving], amplitude[moving], color=OVERLAY[1][0], linewidth=0.9, label=label)
    axes.set(xlabel="frequency, Hz", ylabel="amplitude, µm", yscale="log")
    axes.set_xlim(0.0, 1.03 * frequency[seen].max())
    axes.set_ylim(bottom=floor)
    return axes


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


def phase_planes(run: Moving, samples: int, title: str) -> Figure:
    """Return tangential velocity over displacement of every contact, a panel for each, by status."""
    labels = run.scene.contact_labels()
    if not labels:
        raise InputError(
            "motion: a scene without contacts has no phase plane of contacts; draw displacements"
        )
    figure = Figure(figsize=(4.8 * len(labels), 4.4), layout="constrained")
    panels = figure.subplots(1, len(labels), squeeze=False)[0]
    phase_portraits(panels, run, range(len(labels)), samples)
    for axes, label in zip(panels, labels, strict=True):
        axes.set_title(f"contact {label}")
    figure.suptitle(title)
    return figure


def motion_of(motion: Moving | Periodic) -> Moving:
    """Return a motion as it is, of a cycle one period."""
    return motion.run if isinstance(motion, Periodic) else motion


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
