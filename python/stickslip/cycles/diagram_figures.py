"""Figures of how motions change with a parameter or a start; branches differ in marker and shade."""

from __future__ import annotations

import re
from itertools import cycle as endless
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap

from stickslip.cycles.attractors import UNKNOWN
from stickslip.scene.checks import Real
from stickslip.scene.contact import dof_index
from stickslip.scene.parameters.values import parameter_of
from stickslip.show.plots import axes_of
from stickslip.show.style import MARKERS, quantity
from stickslip.show.units import MICROMETRES, TIMES, measured


def bifurcation(data: xr.Dataset, dof: str | None = None, *, ax: Axes | None = None) -> Axes:
    """Draw the amplitude of a dof over the parameter, a marker and shade per sequence; return the Axes.

    Unstable orbits are hollow markers, orbits of unknown stability are half filled, and values without a
    cycle are crosses at zero. Without `dof` it is the one with the largest amplitude.
    """
    if dof is None:
        largest = data.amplitude.fillna(0.0).to_numpy().max(axis=0, initial=0.0)
        dof = str(data.dof.to_numpy()[largest.argmax()])
    index = dof_index("dof", dof, data.dof.to_numpy().tolist())
    axes = axes_of(ax)
    parameter = parameter_of(data.period)
    values = data[parameter].to_numpy()
    amplitude = MICROMETRES * data.amplitude.isel(dof=index).to_numpy()
    sequences = data.sequence.to_numpy()
    stability = data.stability.to_numpy()
    known = {"stable": "full", "unstable": "none"}
    fills = np.array([known.get(verdict, "left") for verdict in stability])
    named = [name for name in dict.fromkeys(sequences) if name]
    shades = [0.75 * k / max(len(named) - 1, 1) for k in range(len(named))]
    style: dict[str, Any] = {"markersize": 3.5, "linestyle": "none", "markerfacecoloralt": "none"}
    for name, shade, marker in zip(named, shades, endless(MARKERS), strict=False):
        here = sequences == name
        colour = (0.1 + 0.6 * shade, 0.1 + 0.75 * shade, 0.35 + 0.5 * shade)
        label: str | None = _shortened(name)
        for fill in ("full", "none", "left"):
            chosen = here & (fills == fill)
            if chosen.any():
                points = values[chosen], amplitude[chosen], marker
                axes.plot(*points, color=colour, fillstyle=fill, label=label, **style)
                label = None
    if "left" in fills[sequences != ""]:
        axes.plot([], [], "o", color="black", fillstyle="left", label="stability not known", **style)
    other = sequences == ""
    if other.any():
        axes.plot(values[other], np.zeros(other.sum()), "x", color="black", markersize=4, label="no cycle")
    axes.set(xlabel=quantity(parameter), ylabel=f"amplitude of {dof}, µm")
    # From zero on, with room above amplitudes that hardly change.
    axes.set_ylim(0.0, 1.05 * axes.get_ylim()[1])
    axes.legend(frameon=False, fontsize="x-small", loc="lower right")
    return axes


def basins(data: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw the attractor that each start reaches, with a colour bar that names them; return the Axes.

    White cells have no start, because it would violate its combination; hatched cells were not computed,
    because the search was interrupted. With a boundary, its cycles are lines and its bisected segments dots.
    """
    reached = data.reached
    first, second = (str(name) for name in reached.dims)
    count = data.sizes["attractor"]
    labels = [
        kind if kind != "cycle" else f"{measured(period, TIMES, 4)}: {_shortened(sequence)}"
        for kind, period, sequence in zip(
            data.kind.to_numpy(), data.period.to_numpy(), data.sequence.to_numpy(), strict=True
        )
    ]
    axes = axes_of(ax)
    across, upward = _edges(reached[first].to_numpy()), _edges(reached[second].to_numpy())
    place = reached.to_numpy().T.astype(float)
    shades = [
        (0.1 + 0.75 * k / max(count - 1, 1),) * 2 + (0.5 + 0.45 * k / max(count - 1, 1),)
        for k in range(count)
    ]
    if count:
        drawn = axes.pcolormesh(
            across,
            upward,
            np.ma.masked_less(place, 0.0),
            cmap=ListedColormap(shades),
            norm=BoundaryNorm(np.arange(count + 1) - 0.5, count),
        )
        bar = axes.figure.colorbar(drawn, ax=axes, ticks=np.arange(count))
        bar.ax.set_yticklabels(labels, fontsize="x-small")
    if (place == UNKNOWN).any():
        missing = np.ma.masked_not_equal(place, UNKNOWN)
        axes.pcolor(across, upward, missing, hatch="///", alpha=0.0)
    if "inside" in data:
        for number in range(data.sizes["cycle"]):
            curve = data[[f"curve_{first}", f"curve_{second}"]].isel(cycle=number)
            axes.plot(curve[f"curve_{first}"], curve[f"curve_{second}"], color="black", linewidth=1.0)
        middles = [data[f"segment_{name}"].mean("end") for name in (first, second)]
        axes.plot(*middles, ".", color="black", markersize=3.0)
        # A cycle may lead out of the starts.
        axes.set(xlim=across[[0, -1]], ylim=upward[[0, -1]])
    abscissa, ordinate = (
        quantity(re.sub(r"^(position|velocity)_", r"\1 of ", name), reached[name].attrs.get("units", ""))
        for name in (first, second)
    )
    axes.set(xlabel=abscissa, ylabel=ordinate)
    return axes


def _edges(values: Real) -> Real:
    """Return the borders of the cells about some values; a single one has a cell of its size."""
    if values.size == 1:
        half = 0.5 * (abs(values[0]) or 1.0)
        return np.array([values[0] - half, values[0] + half])
    middles = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2.0 * values[0] - middles[0]], middles, [2.0 * values[-1] - middles[-1]]])


def _shortened(sequence: str) -> str:
    return sequence if len(sequence) <= 40 else f"{sequence[:37]}..."
