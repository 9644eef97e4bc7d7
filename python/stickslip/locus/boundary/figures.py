"""Figures of boundaries of stability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from matplotlib.lines import Line2D

from stickslip.locus.boundary.curves import BoundaryCurve, CodimensionTwo, pieces
from stickslip.show.plots import axes_of
from stickslip.show.style import quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Line of every kind of curve of steady sliding, and of those of periodic orbits.
LINES: dict[str, Any] = {"hopf": "-", "divergence": "-.", "separation": "--"}
OF_ORBITS: dict[str, Any] = {
    "fold": "-",
    "period_doubling": "--",
    "torus": "-.",
    "grazing": ":",
    "switching": (0, (5, 1, 1, 1, 1, 1)),
}
#: Their colours.
SLIDING, ORBITS = "black", "darkgreen"
#: Width without steady sliding, where a curve is grey, beside other growing modes, and where stability ends.
WIDTHS = (0.7, 0.7, 1.6)
#: Marker of every kind of point of codimension two; a degenerate one is only where a curve turns.
MARKERS = {
    "double_hopf": "o",
    "zero_hopf": "s",
    "zero_frequency": "D",
    "separation": "^",
    "cusp": "v",
    "second_multiplier": "o",
    "resonance": "D",
    "sequence": "x",
    "tangency": "+",
}


def stability_boundary(
    curves: Sequence[BoundaryCurve],
    points: Sequence[CodimensionTwo],
    ranges: Mapping[str, tuple[float, float]],
    units: Mapping[str, str],
    *,
    growth: xr.DataArray | None,
    ax: Axes | None,
) -> Axes:
    """Draw curves, and points at which they meet, over two parameters; return the Axes.

    The second parameter is the horizontal axis. The largest `growth` rate, 1/s, lies below the curves.
    """
    axes = axes_of(ax)
    upward, across = ranges
    spans = ranges[upward][1] - ranges[upward][0], ranges[across][1] - ranges[across][0]
    if growth is not None:
        rates = growth.transpose(upward, across)
        reach = float(np.nanmax(np.abs(rates.to_numpy()), initial=0.0)) or 1.0
        grid = growth[across].to_numpy(), growth[upward].to_numpy()
        shades = axes.pcolormesh(*grid, rates, cmap="RdBu_r", vmin=-reach, vmax=reach, rasterized=True)
        axes.figure.colorbar(shades, ax=axes, label="largest growth rate, 1/s")
    drawn = axes.get_legend()
    labels = [] if drawn is None else [text.get_text() for text in drawn.get_texts()]
    handles: dict[str, Any] = dict(zip(labels, [] if drawn is None else drawn.legend_handles, strict=True))
    for curve in curves:
        own = SLIDING if curve.kind in LINES else ORBITS
        line = {**LINES, **OF_ORBITS}[curve.kind]
        # Pieces that look alike are one line, so that its dashes go on.
        for piece, look in pieces(curve, spans, points):
            style: dict[str, Any] = {"color": own if look else "0.5", "linewidth": WIDTHS[look], "label": "_"}
            axes.plot(piece[:, 1], piece[:, 0], linestyle=line, **style)
        label = curve.kind.replace("_", " ")
        handles[label] = Line2D([], [], color=own, linestyle=line, label=label)
    incomplete = np.concatenate([np.zeros((0, 2)), *(curve.values[curve.incomplete] for curve in curves)])
    if len(incomplete):
        label = "eigenvalues missing"
        cross: dict[str, Any] = {"marker": "X", "color": "crimson", "linestyle": "none"}
        (handles[label],) = axes.plot(*incomplete.T[::-1], label=label, **cross)
    for point in points:
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
    axes.set(
        xlim=ranges[across],
        ylim=ranges[upward],
        xlabel=quantity(across, units[across]),
        ylabel=quantity(upward, units[upward]),
    )
    axes.ticklabel_format(scilimits=(-3, 4), useMathText=True)
    if handles:
        axes.legend(handles=list(handles.values()), fontsize="small")
    return axes
