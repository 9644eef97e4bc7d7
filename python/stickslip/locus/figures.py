"""Figures of eigenvalues along parameters: loci over one, a map of stability over two."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure, FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from stickslip.faults import InputError
from stickslip.locus.points import CriticalPoint
from stickslip.modes.modes import shown_growth
from stickslip.show.plots import figure_of, panels_of
from stickslip.show.style import STABLE, UNSTABLE, quantity

#: Shades of growth, and as many of decay, in a map of stability.
LEVELS = 12


def loci(
    branches: xr.Dataset,
    *,
    slow: bool = True,
    critical: Sequence[CriticalPoint] = (),
    figure: FigureBase | None = None,
) -> Figure:
    """Return a Figure of growth rates and frequencies of branches over their parameter (the paper's Fig. 3).

    Unstable parts are red and thick; rings mark the Hopf points of `critical`. Unless `slow`, growth rates
    far below those of the least damped branches are left out; with them these would lie on one line.
    """
    (name,) = _parameters(branches)
    drawn, (growth, frequency) = panels_of(figure, (1, 2), (9.0, 4.2))
    order = np.argsort(branches[name].to_numpy())
    values = branches[name].to_numpy()[order]
    eigenvalue = branches.eigenvalue.transpose(name, "branch").to_numpy()[order]
    unstable = branches.unstable.transpose(name, "branch").to_numpy()[order]
    # Lines bear the names of the legend, by which a page hides them; all but the first after a bar.
    bar = ""
    for branch, growing in zip(eigenvalue.T, unstable.T, strict=True):
        if (branch.imag < 0.0).all():
            continue
        for axes, ordinate in ((growth, branch.real), (frequency, np.abs(branch) / (2.0 * np.pi))):
            grows = np.where(growing, ordinate, np.nan)
            axes.plot(values, ordinate, color=STABLE, linewidth=1.2, label=f"{bar}stable")
            axes.plot(values, grows, color=UNSTABLE, linewidth=1.8, label=f"{bar}unstable")
        bar = "_"
    growth.axhline(0.0, color="black", linewidth=0.6)
    handles = [Line2D([], [], color=STABLE, label="stable"), Line2D([], [], color=UNSTABLE, label="unstable")]
    hopf = [point for point in critical if point.kind == "hopf"]
    for axes, ordinates in ((growth, [0.0] * len(hopf)), (frequency, [point.frequency for point in hopf])):
        if hopf:
            places = [point.value for point in hopf]
            rings = axes.plot(places, ordinates, "o", color="black", fillstyle="none", label="Hopf point")
            handles = [*handles[:2], *rings]
    if slow:
        top = eigenvalue.real.max()
        reach = max(top, np.abs(eigenvalue.real.max(axis=1)).max())
        if reach > 0.0:
            growth.set_ylim(-2.2 * reach, 1.1 * max(top, 0.2 * reach))
    growth.set(xlabel=quantity(name), ylabel="growth rate, 1/s")
    frequency.set(xlabel=quantity(name), ylabel="|eigenvalue| / 2π, Hz")
    drawn.legend(handles=handles, frameon=False, loc="outside upper center", ncols=3)
    return figure_of(drawn)


def _parameters(branches: xr.Dataset) -> list[str]:
    return [str(name) for name in branches.eigenvalue.dims if name != "branch"]


def stability_map(branches: xr.Dataset, *, figure: FigureBase | None = None) -> Figure:
    """Return a Figure of the largest growth rate and the number of unstable modes over two parameters.

    The border of stability, where the largest growth rate is zero, is the black line of both panels. It is
    interpolated linearly between the values of the sweep, so a finer sweep makes it smoother. If no more than
    one mode is unstable anywhere, there is no panel of the number: it would repeat the border.
    """
    names = _parameters(branches)
    if len(names) != 2 or min(branches.sizes[name] for name in names) < 2:
        sizes = {name: branches.sizes[name] for name in names}
        raise InputError(
            f"data: expected a sweep over one or two parameters, two values of each of two, got {sizes}"
        )
    # The second parameter, along which branches are continuous, is the horizontal axis.
    upward, across = names
    ordered = branches[["eigenvalue", "unstable"]].sortby(names).transpose(*names, "branch")
    eigenvalue = ordered.eigenvalue.to_numpy()
    rates = shown_growth(eigenvalue.real, ordered.unstable.to_numpy())
    growth = rates.max(axis=-1)
    grid = (ordered[across].to_numpy(), ordered[upward].to_numpy())
    reach = float(np.abs(growth).max()) or 1.0
    # At least k modes are unstable where the k-th largest real part, one of each pair, is positive.
    one_of_pair = np.where(eigenvalue.imag >= 0.0, rates, -reach)
    ranked = np.moveaxis(-np.sort(-one_of_pair, axis=-1), -1, 0)
    most = int((ranked > 0.0).any(axis=(1, 2)).sum())
    panels = 1 if most < 2 else 2
    size = (0.8 + 4.1 * panels, 4.2)
    drawn, (left, *right) = panels_of(figure, (1, panels), size, sharex=True, sharey=True)
    levels = MaxNLocator(2 * LEVELS, symmetric=True).tick_values(-reach, reach)
    shades = left.contourf(*grid, growth, levels=levels, cmap="RdBu_r")
    ticks = MaxNLocator(8, symmetric=True)
    drawn.colorbar(shades, ax=left, label="largest growth rate, 1/s", ticks=ticks)
    shade = colormaps["Reds"].resampled(most + 2)
    for axes in right:
        for rank, real in enumerate(ranked[:most], start=1):
            axes.contourf(*grid, real, levels=[0.0, 2.0 * reach], colors=[shade(rank)])
        edges = BoundaryNorm(np.arange(most + 2) - 0.5, most + 1)
        number = ScalarMappable(edges, ListedColormap(shade(range(most + 1))))
        drawn.colorbar(number, ax=axes, label="number of unstable modes", ticks=np.arange(most + 1))
        axes.set_facecolor(shade(0))
    for axes in (left, *right):
        if growth.min() < 0.0 < growth.max():
            axes.contour(*grid, growth, levels=[0.0], colors="black", linewidths=1.2)
        axes.set_xlabel(quantity(across, branches[across].attrs.get("units", "")))
    left.set_ylabel(quantity(upward, branches[upward].attrs.get("units", "")))
    drawn.suptitle("Stability of sliding (black: its border)")
    return figure_of(drawn)
