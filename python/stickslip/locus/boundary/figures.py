"""Figures of boundaries of stability."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from stickslip.faults import InputError
from stickslip.scene.checks import described
from stickslip.show.plots import axes_of
from stickslip.show.style import quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.locus.boundary.curves import StabilityBoundary

#: Line of every kind of curve.
LINES: dict[str, Any] = {"hopf": "-", "divergence": "-.", "separation": "--"}
#: Colour and width without steady sliding, beside other growing modes, and where stability ends.
STYLES = (("0.5", 0.7), ("black", 0.7), ("black", 1.6))
#: Marker of every kind of point of codimension two; a degenerate one is only where a curve turns.
MARKERS = {"double_hopf": "o", "zero_hopf": "s", "zero_frequency": "D", "separation": "^"}


def stability_boundary(boundary: StabilityBoundary, *, growth: bool = True, ax: Axes | None = None) -> Axes:
    """Draw the curves on the map of growth; return the Axes.

    The second parameter is the horizontal axis, as in `stability_map`. Curves at which a stable region ends
    are black and thick, those beyond which other modes grow are thin, and those without steady sliding grey.

    Parameters
    ----------
    boundary
        Result of `ss.stability_boundary`.
    growth
        Whether to draw the map; without it curves are drawn on what the axes show.
    ax
        Where to draw; None: on axes of its own.
    """
    if not hasattr(boundary, "resolution"):
        raise InputError(f"boundary: expected what stability_boundary returns, got {described(boundary)}")
    axes = axes_of(ax)
    upward, across = boundary.parameters
    if growth:
        rates = boundary.map.growth_rate.transpose(upward, across)
        reach = float(np.nanmax(np.abs(rates.to_numpy()), initial=0.0)) or 1.0
        grid = boundary.map[across].to_numpy(), boundary.map[upward].to_numpy()
        shades = axes.pcolormesh(*grid, rates, cmap="RdBu_r", vmin=-reach, vmax=reach, rasterized=True)
        axes.figure.colorbar(shades, ax=axes, label="largest growth rate, 1/s")
    handles: dict[str, Line2D] = {}
    for curve in boundary:
        drawn = curve.drawn(boundary.spans)
        parts = (len(drawn) - 1) // max(len(curve.values) - 1, 1)
        steady = curve.steady_sliding[:-1] & curve.steady_sliding[1:]
        thick = steady & (np.minimum(curve.unstable_modes[:-1], curve.unstable_modes[1:]) == 0)
        look = steady.astype(int) + thick
        # Pieces that look alike are one line, so that its dashes go on.
        begins = [0, *(np.flatnonzero(np.diff(look)) + 1), len(look)]
        for first, last in pairwise(begins):
            piece = drawn[first * parts : last * parts + 1]
            colour, width = STYLES[look[first]]
            axes.plot(piece[:, 1], piece[:, 0], LINES[curve.kind], color=colour, linewidth=width, label="_")
        handles[curve.kind] = Line2D([], [], color="black", linestyle=LINES[curve.kind], label=curve.kind)
    for point in boundary.points:
        if point.kind in MARKERS:
            label = point.kind.replace("_", " ") + (" on a Hopf curve" if point.kind == "separation" else "")
            (handles[label],) = axes.plot(
                point.values[across],
                point.values[upward],
                MARKERS[point.kind],
                color="black",
                markerfacecolor="white",
                label=label,
                linestyle="none",
            )
    (left, right), (low, high) = boundary.parameters[across], boundary.parameters[upward]
    units = {name: boundary.map[name].attrs.get("units", "") for name in (across, upward)}
    axes.set(
        xlim=(left, right),
        ylim=(low, high),
        xlabel=quantity(across, units[across]),
        ylabel=quantity(upward, units[upward]),
    )
    axes.ticklabel_format(scilimits=(-3, 4), useMathText=True)
    if handles:
        axes.legend(handles=list(handles.values()), fontsize="small")
    return axes
