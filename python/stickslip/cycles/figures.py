"""Figures of limit cycles and of how they change with a parameter; branches differ in marker and shade."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle as endless

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip.cycles.bifurcation import Bifurcation
from stickslip.cycles.branch import Branch
from stickslip.cycles.cycle import Cycle
from stickslip.motion.figures import phase_planes, tangential
from stickslip.show.style import MARKERS, MICROMETRES, OVERLAY

#: Samples of one period.
PERIOD = 4097


def limit_cycle(cycle: Cycle) -> Figure:
    """Return the slip motion of every contact over one period of the limit cycle."""
    sequence = " → ".join(cycle.combinations)
    title = f"Limit cycle, period {1e3 * cycle.period:.4f} ms: {sequence}"
    return phase_planes(cycle.run, PERIOD, title)


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
        ((_, displaced, velocity),) = tangential(cycle.run, [contact])
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
