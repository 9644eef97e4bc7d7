"""The energy of every mode of a combination over time, as a figure."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from stickslip.motion.energy_figures import DAMPING
from stickslip.show.plots import axes_of
from stickslip.show.style import CONTACT


def modal_shares(energy: xr.Dataset, combination: str, *, ax: Axes | None = None) -> Axes:
    """Draw the energy of every mode while a combination holds, and that of the whole; return the Axes."""
    axes, held = axes_of(ax, (9.0, 3.8)), energy.combination == combination
    axes.semilogy(energy.time, 1e3 * energy.total.where(held), color="black", linewidth=1.4, label="all")
    frequencies = energy.frequency.where(held).max("time").to_numpy()
    order = np.argsort(-np.nan_to_num(energy.energy.where(held).mean("time").to_numpy()))[:5]
    styles = itertools.cycle(("-", "--", ":", "-."))
    for r, colour in zip(order, itertools.cycle((*CONTACT, DAMPING))):
        if np.isnan(frequencies[r]):
            continue
        label = f"{frequencies[r]:.1f} Hz"
        curve = 1e3 * energy.energy[:, r].where(held)
        axes.semilogy(energy.time, curve, color=colour, linestyle=next(styles), label=label)
    ends = (float(energy.time[0]), float(energy.time[-1]))
    axes.set(xlabel="time, s", ylabel=f"energy in the modes of {combination}, mJ", xlim=ends)
    # Eight decades show every mode that matters and leave rounding out.
    axes.set_ylim(bottom=1e-8 * axes.get_ylim()[1])
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return axes
