"""Figures of studies, each drawn from the dataset of one result."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.patches import Ellipse

from stickslip.faults import InputError
from stickslip.show.plots import axes_of, figure_of, panels_of
from stickslip.show.style import quantity
from stickslip.study.statistics import BINS, sample_values
from stickslip.study.statistics import probability as chance

#: Distance of the labels of points, in parts of the highest.
APART = 0.05
DARK, LIGHT, ACCENT = "#222255", "#bbccee", "#cc3311"


def probability(estimate: xr.Dataset, *, label: str | None = None, ax: Axes | None = None) -> Axes:
    """Draw a probability over its parameter, with the confidence band; return the Axes."""
    over = estimate.attrs.get("over")
    if over is None:
        raise InputError("estimate: expected a probability over a parameter")
    axes = axes_of(ax)
    edges = np.append(estimate.left.to_numpy(), estimate.right.to_numpy()[-1])
    axes.stairs(
        estimate.upper.to_numpy(), edges, baseline=estimate.lower.to_numpy(), fill=True, color=LIGHT, zorder=1
    )
    axes.stairs(estimate.probability.to_numpy(), edges, baseline=None, color=DARK, linewidth=1.3, label=label)
    axes.set(xlabel=quantity(over), ylabel="probability", ylim=(-0.02, 1.02), xlim=(edges[0], edges[-1]))
    _few_ticks(axes)
    return axes


def distribution(
    results: xr.Dataset,
    output: str,
    *,
    bins: int | None = None,
    label: str | None = None,
    ax: Axes | None = None,
    **labels: Any,
) -> Axes:
    """Draw the density of an output, one of its dofs, contacts or modes chosen by `labels`; return the Axes.

    None for `bins`: the root of the number of samples, 8 to 60.
    """
    values = sample_values(results, output, labels)
    values = values[~np.isnan(values)]
    if bins is None:
        bins = int(np.clip(np.sqrt(values.size), 8, 60))
    axes = axes_of(ax)
    axes.hist(values, bins=bins, density=True, color=LIGHT, edgecolor=DARK, linewidth=0.4, label=label)
    units = results[output].attrs.get("units", "")
    reciprocal = {"": "", "1": "", "1/s": "s"}.get(units, f"1/({units})" if "/" in units else f"1/{units}")
    axes.set(xlabel=quantity(output, units), ylabel=quantity("density", reciprocal))
    _few_ticks(axes)
    return axes


def sobol_indices(indices: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw first-order and total Sobol' indices with their bands, the largest on top; return the Axes."""
    axes = axes_of(ax)
    ordered = indices.sortby("total")
    places = np.arange(ordered.sizes["parameter"])
    for name, shift, colour, hatch in (("total", -0.2, LIGHT, ""), ("first", 0.2, DARK, "")):
        axes.barh(
            places + shift,
            ordered[name].to_numpy(),
            xerr=ordered[f"{name}_band"].to_numpy(),
            height=0.38,
            color=colour,
            edgecolor=DARK,
            hatch=hatch,
            error_kw={"linewidth": 0.8, "ecolor": "#777777"},
            label="total" if name == "total" else "first order",
        )
    axes.set_yticks(places, [quantity(name) for name in ordered.parameter.to_numpy()])
    axes.set(xlabel=f"Sobol' index of {quantity(indices.attrs['output'])}", xlim=(0.0, None))
    axes.legend(frameon=False, fontsize="small", loc="lower right")
    return axes


def morris_effects(effects: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw the deviation of the elementary effects over their mean absolute value; return the Axes."""
    axes = axes_of(ax)
    x, y = effects.absolute_effect.to_numpy(), effects.deviation.to_numpy()
    axes.errorbar(x, y, xerr=effects.band.to_numpy(), fmt="o", color=DARK, ecolor="#777777", elinewidth=0.8)
    # Effects of a linear output deviate by nothing.
    top, lowest = y.max() or 1.0, -np.inf
    for k in np.argsort(y, kind="stable"):
        # Labels of points close together stand above each other.
        lowest = max(y[k] / top, lowest + APART)
        right = x[k] > 0.6 * x.max()
        axes.annotate(
            quantity(effects.parameter.to_numpy()[k]),
            (x[k], y[k]),
            (x[k] + (-0.06 if right else 0.06) * x.max(), lowest * top),
            fontsize="small",
            horizontalalignment="right" if right else "left",
            verticalalignment="center",
            arrowprops={"arrowstyle": "-", "color": "#999999", "linewidth": 0.5},
        )
    unit = effects.attrs["units"]
    axes.set(
        xlabel=quantity(f"mean absolute effect on {effects.attrs['output']}", unit),
        ylabel=quantity("deviation", unit),
        xlim=(0.0, 1.1 * x.max() or None),
        ylim=(0.0, 1.1 * max(1.0, lowest) * top),
    )
    return axes


def convergence(estimates: xr.Dataset, *, label: str | None = None, ax: Axes | None = None) -> Axes:
    """Draw an estimate over the number of samples, with the band of independent samples; return the Axes."""
    axes = axes_of(ax)
    count = estimates["samples"].to_numpy()
    axes.fill_between(
        count, estimates.lower.to_numpy(), estimates.upper.to_numpy(), color=LIGHT, linewidth=0.0
    )
    axes.plot(count, estimates.estimate.to_numpy(), color=DARK, linewidth=1.3, label=label)
    axes.set(
        xscale="log",
        xlabel="samples",
        ylabel=quantity(estimates.attrs["output"], estimates.attrs["units"]),
        xlim=(count[0], count[-1]),
    )
    return axes


def eigenvalue_moments(
    moments: xr.Dataset,
    *,
    results: xr.Dataset,
    mode: int = 0,
    most: int = 5000,
    ax: Axes | None = None,
) -> Axes:
    """Draw one eigenvalue of the samples, and two first-order deviations as an ellipse; return the Axes."""
    if "eigenvalues" not in results:
        raise InputError("results: expected the output 'eigenvalues'")
    axes = axes_of(ax)
    samples = results.eigenvalues.to_numpy()[:most]
    # Of each conjugate pair one, as modes are counted.
    places = np.argsort(samples.imag < 0.0, axis=1, kind="stable")[:, [mode]]
    samples = np.take_along_axis(samples, places, axis=1)[:, 0]
    axes.plot(samples.real, samples.imag / (2.0 * np.pi), ",", color=DARK, label="samples")
    chosen = moments.isel(mode=mode)
    centre = complex(chosen.eigenvalue.item())
    scale = np.diag([1.0, 1.0 / (2.0 * np.pi)])
    sizes, directions = np.linalg.eigh(scale @ chosen.covariance.to_numpy() @ scale)
    axes.add_patch(
        Ellipse(
            (centre.real, centre.imag / (2.0 * np.pi)),
            *(4.0 * np.sqrt(np.maximum(sizes, 0.0))),
            angle=float(np.degrees(np.arctan2(directions[1, 0], directions[0, 0]))),
            fill=False,
            edgecolor=ACCENT,
            linewidth=1.3,
            label="first order, two deviations",
        )
    )
    axes.set(xlabel="growth rate, 1/s", ylabel="Im, Hz")
    axes.legend(frameon=False, fontsize="small")
    return axes


#: Panels of an overview, and samples per bin of its probabilities.
PANELS, PER_BIN = 8, 40


def study(results: xr.Dataset, *, figure: FigureBase | None = None) -> Figure:
    """Return a Figure of a study: instability over every parameter, and the density of every output."""
    parameters = [str(name) for name, coord in results.coords.items() if coord.dims == ("sample",)]
    verdict = bool({"growth_rate", "eigenvalue", "unstable_modes"} & set(results.data_vars))
    panels: list[Callable[..., Any]] = []
    for name in parameters if verdict else []:
        if np.ptp(results[name].to_numpy()) > 0.0:
            bins = int(np.clip(results.sizes["sample"] / PER_BIN, 5, BINS))
            panels.append(partial(probability, chance(results, name, bins=bins)))
    for key, column in results.data_vars.items():
        if column.dtype.kind != "f" or not column.notnull().any():
            continue
        if column.dims == ("sample",):
            panels.append(partial(distribution, results, str(key)))
        elif len(column.dims) == 2:
            panels.append(partial(_largest, results, column))
    shown = panels[:PANELS]
    columns = min(2, max(len(shown), 1))
    rows = -(-max(len(shown), 1) // columns)
    drawn, places = panels_of(figure, (rows, columns), (4.6 * columns, 3.2 * rows))
    for axes, draw in zip(places, shown, strict=False):
        draw(ax=axes)
    for axes in places[len(shown) :]:
        axes.set_axis_off()
    return figure_of(drawn)


def _largest(results: xr.Dataset, column: xr.DataArray, *, ax: Axes) -> None:
    """Draw the entry of an output that is largest on average."""
    dim = str(column.dims[1])
    most = int(np.nanargmax(np.abs(np.nanmean(column.to_numpy(), axis=0))))
    label = results[dim].to_numpy()[most] if dim in results.coords else most
    labels: dict[str, Any] = {dim: label}
    distribution(results, str(column.name), ax=ax, **labels)
    ax.set_xlabel(f"{ax.get_xlabel()} ({label})")


def _few_ticks(axes: Axes) -> None:
    axes.locator_params(axis="x", nbins=6)
    axes.ticklabel_format(axis="x", scilimits=(-2, 4), useMathText=True)
