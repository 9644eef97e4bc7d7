"""Figures of energy: what is stored, how it changes, powers, shares of modes, where an interval's goes."""

from __future__ import annotations

import itertools
from typing import Protocol

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from stickslip.faults import InputError
from stickslip.show.plots import Plots, axes_of, figure_of, panels_of
from stickslip.show.style import COLOURS, CONTACT
from stickslip.show.units import ENERGIES, TIMES, measured

#: Colours that differ in lightness too, for print without colour.
KINETIC, ELASTIC = "#ddaa33", "#bbccee"
EXTERNAL, DAMPING, RATE = "#228833", "#882255", "black"
IMPACTS = "#777777"
#: Half the width of the box in the middle of a flow diagram, of half its width: its words fit.
BOX = 0.2

#: What flows, J, under which name and in which colour.
Flow = tuple[str, float, str]


class Balanced(Protocol):
    """What can be drawn as a balance: a `Balance`."""

    @property
    def start(self) -> float:
        """Where the interval begins, s."""

    @property
    def end(self) -> float:
        """Where it ends, s."""

    def rows(self) -> list[tuple[str, float, str]]:
        """Return the terms as name, J, remark."""

    def to_dataset(self) -> xr.Dataset:
        """Return the terms."""


class BalancePlots(Plots[Balanced]):
    """Pictures of an energy balance."""

    def __call__(self, *, ax: Axes | None = None) -> Axes:
        """Draw every work as a bar, positive into the structure; return the Axes.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        axes, rows = axes_of(ax), self._result.rows()
        # Indented rows are the contacts, parts of the row above them: thinner bars with their own name.
        parts = [name.startswith(" ") for name, *_ in rows]
        names = [
            f"of contact {name.strip()}" if part else name
            for (name, *_), part in zip(rows, parts, strict=True)
        ]
        values = 1e3 * np.array([value for _, value, _ in rows])
        places = np.arange(values.size)
        colours = np.where(values < 0.0, COLOURS["s"], COLOURS["+"]).tolist()
        axes.barh(places, values, np.where(parts, 0.3, 0.8), color=colours)
        axes.set_yticks(places, names)
        axes.invert_yaxis()
        axes.axvline(0.0, color="black", linewidth=0.6)
        axes.set(xlabel="work, mJ", title=self._title())
        return axes

    def flow(self, *, ax: Axes | None = None) -> Axes:
        """Draw the flow of the energy, arrows as wide as the energy that they carry; return the Axes.

        Sliders are on the left; friction heat, dampers and impacts on the right. Each contact has a colour,
        and so has each other term. If there are more than four contacts, the three with most friction heat
        are shown, and the others as one. The work of constant forces and the stored energy stand on the side
        on which they count; flows below 1e-9 of the largest are left out.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        sides = _flows(self._result.to_dataset())
        scale = max(sum(value for _, value, _ in side) for side in sides)
        axes = axes_of(ax, (9.0, 5.0))
        if scale > 0.0:
            inputs, outputs = ([flow for flow in side if flow[1] > 1e-9 * scale] for side in sides)
            _bands(axes, inputs, outputs, scale)
        axes.axis("off")
        axes.set_title(self._title(), fontsize=10)
        return axes

    def _title(self) -> str:
        begin, end = (measured(time, TIMES) for time in (self._result.start, self._result.end))
        return f"Energy from {begin} to {end}"


def _flows(balance: xr.Dataset) -> tuple[list[Flow], list[Flow]]:
    """Return what flows in and out, by the terms of a balance."""
    labels = [f"contact {label}" for label in balance.contact.to_numpy()]
    slider = (balance.slider.sum("status") + balance.impact_slider).to_numpy()
    heat = (balance.friction_heat.sum("status") + balance.impact_friction).to_numpy()
    if len(labels) > len(CONTACT):
        most = np.sort(np.argsort(-heat, kind="stable")[: len(CONTACT) - 1])
        others = np.setdiff1d(np.arange(len(labels)), most)
        labels = [*(labels[i] for i in most), f"{others.size} other contacts"]
        slider, heat = (np.append(works[most], works[others].sum()) for works in (slider, heat))
    terms = {str(name): float(balance[name]) for name in ("external", "circulatory", "damping", "stored")}
    lost, stored = float(balance.impact_normal.sum()), terms["stored"]
    store = "stored" if stored > 0.0 else "from the store"
    brought = [
        *(
            (f"slider of {label}", work, colour)
            for label, work, colour in zip(labels, slider, CONTACT, strict=False)
        ),
        ("constant forces", terms["external"], EXTERNAL),
        ("circulatory forces", terms["circulatory"], KINETIC),
    ]
    taken = [
        *(
            (f"friction heat of {label}", work, colour)
            for label, work, colour in zip(labels, heat, CONTACT, strict=False)
        ),
        ("dampers", terms["damping"], DAMPING),
        ("impacts", lost, IMPACTS),
        (store, stored, ELASTIC),
    ]
    signed = [*brought, *((name, -value, colour) for name, value, colour in taken)]
    return (
        [(name, float(value), colour) for name, value, colour in signed if value > 0.0],
        [(name, float(-value), colour) for name, value, colour in signed if value <= 0.0],
    )


def _bands(axes: Axes, inputs: list[Flow], outputs: list[Flow], scale: float) -> None:
    """Draw bands from the left to a common trunk and from there to the right."""
    gap = 0.12
    for side, flows in ((-1.0, inputs), (1.0, outputs)):
        total = sum(value for _, value, _ in flows) / scale
        outer = 0.5 * (total + gap * (len(flows) - 1))
        inner = 0.5 * total
        for name, value, colour in flows:
            width, half = value / scale, 0.5 * side
            upper = [(side, outer), (half, outer), (half, inner), (BOX * side, inner)]
            curve = [*upper, *((x, y - width) for x, y in reversed(upper))]
            codes = [Path.MOVETO, *[Path.CURVE4] * 3, Path.LINETO, *[Path.CURVE4] * 3]
            axes.add_patch(PathPatch(Path(curve, codes), facecolor=colour, alpha=0.75, linewidth=0.0))
            axes.text(
                1.03 * side,
                outer - 0.5 * width,
                f"{name}\n{measured(value, ENERGIES, 4)}",
                ha="right" if side < 0.0 else "left",
                va="center",
                fontsize=9,
            )
            outer -= width + gap
            inner -= width
    trunk = sum(value for _, value, _ in inputs) / scale
    axes.add_patch(Rectangle((-BOX, -0.5 * trunk), 2.0 * BOX, trunk, facecolor="#dddddd", linewidth=0.0))
    axes.text(0.0, 0.0, "structure\nand\ncontacts", ha="center", va="center", fontsize=9)
    axes.set(xlim=(-1.75, 1.75), ylim=(-0.95, 0.95))


def _stored(flow: xr.Dataset, axes: Axes) -> None:
    """Stack elastic and kinetic energy over time."""
    axes.stackplot(
        flow.time,
        1e3 * flow.elastic,
        1e3 * flow.kinetic,
        labels=["elastic", "kinetic"],
        colors=[ELASTIC, KINETIC],
    )
    lowest = float((flow.elastic + flow.kinetic).min())
    # The preload stores far more than what moves: leave it out below.
    axes.set(ylabel="energy, mJ", ylim=(1e3 * 0.9 * lowest, None))
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def _rate(flow: xr.Dataset, axes: Axes) -> None:
    """Draw dE/dt from the state equation, and dashed the sum of the powers."""
    total = flow.contact_power.sum("contact") + flow.external_power - flow.damping_power
    total = total + flow.circulatory_power
    axes.plot(flow.time, flow.energy_rate, color=RATE, linewidth=1.0, label="dE/dt")
    axes.plot(flow.time, total, color=COLOURS["s"], linewidth=1.0, linestyle="--", label="sum of powers")
    axes.axhline(0.0, color="black", linewidth=0.4)
    axes.set_ylabel("rate, W")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def _powers(flow: xr.Dataset, axes: Axes) -> None:
    """Draw the powers through contacts, of constant forces and of dampers.

    Of more than four contacts the three of largest power are drawn, and the sum of the others.
    """
    labels, powers = flow.contact.to_numpy(), flow.contact_power.transpose("contact", "time").to_numpy()
    shown = leading_contacts(flow)
    curves = [(f"contact {labels[i]}", powers[i]) for i in shown]
    if len(shown) < labels.size:
        others = np.setdiff1d(np.arange(labels.size), shown)
        curves.append((f"{others.size} other contacts", powers[others].sum(axis=0)))
    for (name, power), colour in zip(curves, CONTACT, strict=False):
        axes.plot(flow.time, power, color=colour, linewidth=1.2, label=name)
    axes.plot(flow.time, flow.external_power, color=EXTERNAL, linewidth=0.9, linestyle="-.", label="external")
    if (flow.circulatory_power != 0.0).any():
        axes.plot(flow.time, flow.circulatory_power, color=KINETIC, linewidth=0.9, label="circulatory")
    damping = "\N{MINUS SIGN}damping"
    axes.plot(flow.time, -flow.damping_power, color=DAMPING, linewidth=0.9, linestyle=":", label=damping)
    axes.axhline(0.0, color="black", linewidth=0.4)
    axes.set_ylabel("power, W")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


#: Pictures of the energies of a motion by name.
PARTS = {"stored": _stored, "rate": _rate, "powers": _powers}


def energies(
    flow: xr.Dataset,
    part: str | None = None,
    *,
    ax: Axes | None = None,
    figure: FigureBase | None = None,
) -> Axes | Figure:
    """Draw what `Motion.energy` returns: one of `PARTS` on axes, or all of them in a Figure."""
    if part is None:
        drawn, panels = panels_of(figure, (3, 1), (9.0, 7.0), sharex=True, height_ratios=[3.0, 2.0, 3.0])
        for name, axes in zip(PARTS, panels, strict=True):
            PARTS[name](flow, axes)
        panels[-1].set(xlabel="time, s", xlim=(float(flow.time[0]), float(flow.time[-1])))
        return figure_of(drawn)
    if part not in PARTS:
        raise InputError(f"what: expected one of {list(PARTS)}, got {part!r}")
    axes = axes_of(ax)
    PARTS[part](flow, axes)
    return axes


def leading_contacts(flow: xr.Dataset) -> list[int]:
    """Return all contacts, of more than four the three of largest power, in their order."""
    power = np.abs(flow.contact_power.transpose("contact", "time").to_numpy()).max(axis=1)
    if power.size <= len(CONTACT):
        return list(range(power.size))
    return sorted(int(i) for i in np.argsort(-power, kind="stable")[: len(CONTACT) - 1])


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
