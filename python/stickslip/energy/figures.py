"""Figures of energy: what is stored, how it changes, what flows, and which mode gains."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from stickslip.energy.modal import modal_energy
from stickslip.energy.selection import ModeSelection
from stickslip.motion.energy import Balance
from stickslip.motion.figures import contact_status
from stickslip.motion.motion import Motion
from stickslip.show.style import COLOURS, CONTACT

#: Samples of an interval: some hundred per period of the cycle of ten of them.
SAMPLES = 2001
#: Colours that differ in lightness too, for print without colour.
KINETIC, ELASTIC = "#ddaa33", "#bbccee"
EXTERNAL, DAMPING, RATE = "#228833", "#882255", "black"
IMPACTS = "#777777"
#: Half the width of the box in the middle of a flow diagram, of half its width: its words fit.
BOX = 0.2

#: What flows, J, under which name and in which colour.
Flow = tuple[str, float, str]


def energy_history(run: Motion, t0: float = 0.0, t1: float | None = None) -> Figure:
    """Return stored energy, its rate, powers and contact status over time (the paper's Figs. 13 to 15).

    The rate comes from the state equation; the dashed line over it is the sum of the powers.

    Parameters
    ----------
    run
        The motion.
    t0, t1
        The interval, s; None: to the end of the motion.
    """
    end = run.duration if t1 is None else t1
    times = np.linspace(t0, end, SAMPLES)
    flow = run.energy(times)
    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    heights = [3.0, 2.0, 3.0, 0.35 * min(len(run.scene.contacts), len(CONTACT)) + 0.3]
    stored, rate, powers, status = figure.subplots(4, 1, sharex=True, height_ratios=heights)
    stored_energy(stored, flow)
    energy_rate(rate, flow)
    power_terms(powers, flow)
    if run.scene.contacts:
        contact_status(status, run, leading_contacts(flow))
    status.set_xlabel("time, s")
    stored.set_xlim(t0, end)
    return figure


def stored_energy(axes: Axes, flow: xr.Dataset) -> Axes:
    """Stack elastic and kinetic energy over time; returns the axes."""
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
    return axes


def energy_rate(axes: Axes, flow: xr.Dataset) -> Axes:
    """Draw dE/dt from the state equation and the sum of the powers; returns the axes."""
    total = flow.contact_power.sum("contact") + flow.external_power - flow.damping_power
    total = total + flow.circulatory_power
    axes.plot(flow.time, flow.energy_rate, color=RATE, linewidth=1.0, label="dE/dt")
    axes.plot(flow.time, total, color=COLOURS["s"], linewidth=1.0, linestyle="--", label="sum of powers")
    axes.axhline(0.0, color="black", linewidth=0.4)
    axes.set_ylabel("rate, W")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return axes


def power_terms(axes: Axes, flow: xr.Dataset) -> Axes:
    """Draw the powers through contacts, of constant forces and of dampers; returns the axes.

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
    return axes


def leading_contacts(flow: xr.Dataset) -> list[int]:
    """Return all contacts, of more than four the three of largest power, in their order."""
    power = np.abs(flow.contact_power.transpose("contact", "time").to_numpy()).max(axis=1)
    if power.size <= len(CONTACT):
        return list(range(power.size))
    return sorted(int(i) for i in np.argsort(-power, kind="stable")[: len(CONTACT) - 1])


def energy_flow(balance: Balance) -> Figure:
    """Return the flow diagram of the energy of an interval: arrows as wide as the energy that they carry.

    Sliders are on the left; friction heat, dampers and impacts on the right. Each contact has a colour, and
    so has each other term. If there are more than four contacts, the three with most friction heat are shown,
    and the others as one. The work of constant forces and the stored energy stand on the side on which they
    count; flows below 1e-9 of the largest are left out.
    """
    contacts = balance.contacts
    labels = [f"contact {label}" for label in contacts.contact.to_numpy()]
    slider = contacts.slider.sum("status").to_numpy() + contacts.impact_slider.to_numpy()
    heat = contacts.friction_heat.sum("status").to_numpy() + contacts.impact_friction.to_numpy()
    if len(labels) > len(CONTACT):
        most = np.sort(np.argsort(-heat, kind="stable")[: len(CONTACT) - 1])
        others = np.setdiff1d(np.arange(len(labels)), most)
        labels = [*(labels[i] for i in most), f"{others.size} other contacts"]
        slider, heat = (np.append(works[most], works[others].sum()) for works in (slider, heat))
    inputs: list[Flow] = []
    outputs: list[Flow] = []

    def add(name: str, value: float, colour: str, brings: bool = True) -> None:
        side = inputs if (value > 0.0) == brings else outputs
        side.append((name, abs(value), colour))

    for label, work, colour in zip(labels, slider, CONTACT, strict=False):
        add(f"slider of {label}", float(work), colour)
    add("constant forces", balance.external, EXTERNAL)
    add("circulatory forces", balance.circulatory, KINETIC)
    for label, lost, colour in zip(labels, heat, CONTACT, strict=False):
        add(f"friction heat of {label}", float(lost), colour, False)
    add("dampers", balance.damping, DAMPING, False)
    add("impacts", balance.impact_loss, IMPACTS, False)
    add("stored" if balance.stored > 0.0 else "from the store", balance.stored, ELASTIC, False)
    scale = max(sum(value for _, value, _ in side) for side in (inputs, outputs))
    visible = [[flow for flow in side if flow[1] > 1e-9 * scale] for side in (inputs, outputs)]
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.subplots()
    if scale > 0.0:
        _bands(axes, visible[0], visible[1], scale)
    axes.axis("off")
    axes.set_title(f"Energy from {balance.start:.6g} s to {balance.end:.6g} s", fontsize=10)
    return figure


def _bands(axes: Axes, inputs: list[Flow], outputs: list[Flow], scale: float) -> None:
    """Draw bands from the left to a common trunk and from there to the right."""
    gap = 0.12
    for side, x, flows in ((-1.0, -1.0, inputs), (1.0, 1.0, outputs)):
        total = sum(value for _, value, _ in flows) / scale
        outer = 0.5 * (total + gap * (len(flows) - 1))
        inner = 0.5 * total
        for name, value, colour in flows:
            width = value / scale
            ends = [(x, outer), (BOX * side, inner)]
            curve = [
                (ends[0][0], ends[0][1]),
                (0.5 * x, ends[0][1]),
                (0.5 * x, ends[1][1]),
                ends[1],
                (ends[1][0], ends[1][1] - width),
                (0.5 * x, ends[1][1] - width),
                (0.5 * x, ends[0][1] - width),
                (ends[0][0], ends[0][1] - width),
            ]
            codes = [Path.MOVETO, *[Path.CURVE4] * 3, Path.LINETO, *[Path.CURVE4] * 3]
            axes.add_patch(PathPatch(Path(curve, codes), facecolor=colour, alpha=0.75, linewidth=0.0))
            axes.text(
                x + 0.03 * side,
                outer - 0.5 * width,
                f"{name}\n{_joules(value)}",
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


def _joules(value: float) -> str:
    for factor, unit in ((1.0, "J"), (1e3, "mJ"), (1e6, "µJ"), (1e9, "nJ")):
        if value * factor >= 1.0:
            return f"{value * factor:.4g} {unit}"
    return f"{value:.3g} J"


def gain_over_amplitude(selection: ModeSelection) -> Figure:
    """Return the energy gained per cycle over amplitude and over energy, for every unstable mode."""
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    over_amplitude, over_energy = figure.subplots(1, 2, sharey=True)
    selection.plot(ax=over_amplitude)
    selection.plot("energy", over_energy)
    over_energy.set(ylabel="", xscale="log")
    return figure


def modal_shares(run: Motion, t0: float, t1: float, combination: str) -> Figure:
    """Return the energy of every mode over time while a combination holds, and the whole of the deviation.

    Parameters
    ----------
    run
        The motion.
    t0, t1
        The interval, s.
    combination
        The combination whose modes are drawn; gaps elsewhere.
    """
    energy = modal_energy(run, np.linspace(t0, t1, SAMPLES))
    held = energy.combination == combination
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    axes = figure.subplots()
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
    axes.set(xlabel="time, s", ylabel=f"energy in the modes of {combination}, mJ", xlim=(t0, t1))
    # Eight decades show every mode that matters and leave rounding out.
    axes.set_ylim(bottom=1e-8 * axes.get_ylim()[1])
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure
