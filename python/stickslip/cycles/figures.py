"""Figures of motions and limit cycles: every function draws on the axes it is given and returns them.

Statuses differ in lightness and in line style or hatching, branches in marker, so that a figure printed in
grey still reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle as endless
from typing import Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from stickslip.scene.checks import Names, Real
from stickslip.cycles.bifurcation import Bifurcation
from stickslip.cycles.branch import Branch
from stickslip.scene.contact import dof_index
from stickslip.cycles.cycle import Cycle
from stickslip.motion.figures import COLOURS, NAMES, instants, status_spans
from stickslip.transient.trajectory import Trajectory

#: Line style and hatching of each status.
STYLES = {"+": "-", "-": "-.", "s": ":", "d": "--"}
HATCHES = {"+": "", "-": "\\\\\\\\", "s": "....", "d": "////"}
#: From dark to light, each with a line style of its own.
OVERLAY = (("#222255", "-"), ("#cc3311", "--"), ("#228833", "-."), ("#ddaa33", ":"), ("#77aadd", "-"))
MARKERS = "osD^v<>P"
#: Samples of a curve.
SAMPLES = 4001
MICROMETRES = 1e6
#: Smallest amplitude drawn, of the largest.
FLOOR = 1e-6


def displacement(
    axes: Axes,
    motion: Trajectory | Cycle,
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
    motion: Trajectory | Cycle,
    dofs: Sequence[str],
    labels: Sequence[str | None] | None = None,
    *,
    origin: Literal["mean", "start"] = "mean",
    samples: int = SAMPLES,
) -> None:
    """Draw several dofs as `displacement` does, one on each of some axes; the motion is sampled once."""
    run = _run(motion)
    indices = [dof_index("dof", dof, run.scene.dofs) for dof in dofs]
    times = np.linspace(0.0, run.duration, samples)
    position = run.sample(times).position.to_numpy()
    names = [None] * len(dofs) if labels is None else labels
    for axes, dof, index, label in zip(panels, dofs, indices, names, strict=True):
        x = position[:, index]
        zero = x[0] if origin == "start" else x.mean()
        axes.plot(times, MICROMETRES * (x - zero), color=OVERLAY[0][0], linewidth=0.8, label=label)
        axes.set(xlabel="time, s", ylabel=f"{dof}, µm", xlim=(0.0, run.duration))


def phase_portrait(axes: Axes, motion: Trajectory | Cycle, contact: int = 0, samples: int = SAMPLES) -> Axes:
    """Draw tangential velocity over displacement of a contact, by status; the slider's speed is dashed.

    Parameters
    ----------
    axes
        Where to draw.
    motion
        A run, or a cycle.
    contact
        Index of the contact.
    samples
        Points of the curve.
    """
    run = _run(motion)
    status, displaced, velocity = _tangential(run, contact, samples)
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
        run.scene.contacts[contact].slider_speed, color="black", linewidth=0.6, linestyle=(0, (6, 3))
    )
    axes.set(xlabel="tangential displacement, µm", ylabel="tangential velocity, m/s")
    axes.legend(frameon=False, fontsize="small")
    return axes


def contact_status(axes: Axes, motion: Trajectory | Cycle, contacts: Sequence[int] | None = None) -> Axes:
    """Draw the status of contacts over time as bars.

    Parameters
    ----------
    axes
        Where to draw.
    motion
        A run, or a cycle.
    contacts
        Indices of contacts; None: all of them.
    """
    run = _run(motion)
    shown = range(len(run.scene.contacts)) if contacts is None else contacts
    labels = [run.scene.contact_labels()[contact] for contact in shown]
    by_contact = [status_spans(run, contact) for contact in shown]
    for letter, colour in COLOURS.items():
        named = f"{letter}  {NAMES[letter]}"
        for contact, spans in enumerate(by_contact):
            if letter in spans:
                axes.broken_barh(
                    spans[letter],
                    (contact - 0.4, 0.8),
                    facecolors=colour,
                    hatch=HATCHES[letter],
                    edgecolor="white",
                    linewidth=0.0,
                    label=named,
                )
                named = "_"
    axes.set(xlabel="time, s", xlim=(0.0, run.duration), yticks=range(len(labels)))
    axes.set_yticklabels([f"contact {label}" for label in labels])
    axes.invert_yaxis()
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


def overlay(axes: Axes, cycles: Mapping[str, Cycle], contact: int = 0) -> Axes:
    """Draw the limit cycles of several cases in one phase plane of a contact.

    Parameters
    ----------
    axes
        Where to draw.
    cycles
        By the name of the case, such as ``"friction 1.5"``.
    contact
        Index of the contact.
    """
    for (name, cycle), (colour, style) in zip(cycles.items(), endless(OVERLAY), strict=False):
        _, displaced, velocity = _tangential(cycle.run, contact)
        centred = displaced - 0.5 * (displaced.max() + displaced.min())
        axes.plot(centred, velocity, color=colour, linestyle=style, linewidth=1.2, label=name)
    axes.set(xlabel="tangential displacement about its middle, µm", ylabel="tangential velocity, m/s")
    axes.legend(frameon=False, fontsize="small")
    return axes


def bifurcation_diagram(axes: Axes, diagram: Bifurcation | Branch, dof: str) -> Axes:
    """Draw the amplitude of a dof over the parameter, one marker and shade per sequence of combinations.

    Parameters
    ----------
    axes
        Where to draw.
    diagram
        From `bifurcation` or `follow_branch`: unstable orbits are hollow, those whose stability is not known
        are filled half; what is no cycle is a cross at zero.
    dof
        Name of the dof.
    """
    data = diagram.data
    parameter = str(data.amplitude.dims[0])
    values = data[parameter].to_numpy()
    amplitude = MICROMETRES * data.amplitude.sel(dof=dof).to_numpy()
    sequences = data.sequence.to_numpy()
    stability = data.stability.to_numpy()
    known = {"stable": "full", "unstable": "none"}
    fills = np.array([known.get(verdict, "left") for verdict in stability])
    named = [name for name in dict.fromkeys(sequences) if name]
    shades = [0.75 * k / max(len(named) - 1, 1) for k in range(len(named))]
    for name, shade, marker in zip(named, shades, endless(MARKERS), strict=False):
        here = sequences == name
        colour = (0.1 + 0.6 * shade, 0.1 + 0.75 * shade, 0.35 + 0.5 * shade)
        label: str | None = name if len(name) <= 40 else f"{name[:37]}..."
        for fill in ("full", "none", "left"):
            chosen = here & (fills == fill)
            if chosen.any():
                axes.plot(
                    values[chosen],
                    amplitude[chosen],
                    marker,
                    markersize=3.5,
                    color=colour,
                    fillstyle=fill,
                    markerfacecoloralt="none",
                    linestyle="none",
                    label=label,
                )
                label = None
    if "left" in fills[sequences != ""]:
        axes.plot(
            [],
            [],
            "o",
            color="black",
            fillstyle="left",
            markerfacecoloralt="none",
            markersize=3.5,
            linestyle="none",
            label="stability not known",
        )
    other = sequences == ""
    if other.any():
        axes.plot(values[other], np.zeros(other.sum()), "x", color="black", markersize=4, label="no cycle")
    axes.set(xlabel=parameter.replace("_", " "), ylabel=f"amplitude of {dof}, µm", ylim=(0.0, None))
    axes.legend(frameon=False, fontsize="x-small", loc="lower right")
    return axes


def _run(motion: Trajectory | Cycle) -> Trajectory:
    return motion.run if isinstance(motion, Cycle) else motion


def _tangential(run: Trajectory, contact: int, samples: int = SAMPLES) -> tuple[Names, Real, Real]:
    """Return statuses, displacement in µm and velocity in m/s along the tangent of a contact."""
    motion = run.sample(instants(run, samples))
    direction = run.scene.tangential_direction(contact)
    displaced = MICROMETRES * (motion.position.to_numpy() @ direction)
    return motion.status.to_numpy()[:, contact], displaced, motion.velocity.to_numpy() @ direction
