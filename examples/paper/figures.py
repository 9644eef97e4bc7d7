"""The figures of the paper, 2 to 15, each by one function, drawn for one column of a journal.

Brunetti, Massi, D'Ambrogio, Berthier, "Dynamic and energy analysis of frictional contact instabilities on a
lumped system". Widths are those of a column; statuses, branches and cases differ by line style, width or
hatching as well as by colour, so that a print in grey reads the same. `FIGURES` maps numbers to functions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Decimal
from functools import cache, wraps
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from paper.comparison import FRICTIONS, UPPER_VERTICAL, attractor, standard_run
from stickslip import plot
from stickslip.cycles.cycle import Cycle
from stickslip.locus.critical import critical_points
from stickslip.locus.sweep import sweep
from stickslip.modes.complex_modes import complex_modes
from stickslip.motion.figures import ENERGY as ENERGY_SAMPLES
from stickslip.motion.motion import Motion
from stickslip.scene.models import two_subsystems
from stickslip.show.style import STABLE, UNSTABLE

#: Width of a column, inches.
COLUMN = 85.0 / 25.4
#: The smallest letters are 6 points high.
STYLE: Any = {
    "font.size": 7.0,
    "axes.titlesize": 7.0,
    "axes.labelsize": 7.0,
    "xtick.labelsize": 6.0,
    "ytick.labelsize": 6.0,
    "legend.fontsize": 6.0,
    "axes.linewidth": 0.5,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "hatch.linewidth": 0.4,
    "figure.constrained_layout.h_pad": 0.05,
    "figure.constrained_layout.w_pad": 0.02,
}
#: The masses with their dofs and the inclination of these, rad: a contact mass has the axes of its slider.
MASSES = {
    "m1": (("x1", "x2"), 0.0),
    "m2": (("x3", "x4"), 0.3),
    "m3": (("x5", "x6"), 0.0),
    "m4": (("x7", "x8"), 0.75),
}
#: The contact masses, whose tangential displacements are drawn.
CONTACTS = ("m2", "m4")
#: Highest frequency of the spectra, Hz: above lies less than a hundredth of the main line.
HIGHEST = 1000.0
SAMPLES = 24001

#: Number of each figure to the function that draws it.
FIGURES: dict[int, Callable[[], Figure]] = {}
Drawing = Callable[[], Figure]


def _figure(number: int) -> Callable[[Drawing], Drawing]:
    def registered(draw: Drawing) -> Drawing:
        @wraps(draw)
        def styled() -> Figure:
            with matplotlib.rc_context(STYLE):
                figure = draw()
                figure.align_ylabels()
                return figure

        FIGURES[number] = styled
        return styled

    return registered


@_figure(2)
def figure_2() -> Figure:
    """Mode shapes without friction, with their frequencies."""
    modes = complex_modes(two_subsystems(friction=0.0))
    figure = _sized(90.0)
    panels = figure.subplots(3, 2, sharex=True, sharey=True)
    for axes, mode in zip(panels.ravel(), modes, strict=True):
        modes.plot.shape(mode.number, ax=axes)
        axes.set_title(f"{mode.frequency:.2f} Hz", fontsize="medium")
    panels[0, 0].set_ylim(-1.15, 1.15)
    figure.supylabel("displacement, largest = 1", fontsize=7.0)
    return figure


@_figure(3)
def figure_3() -> Figure:
    """Eigenvalues of steady sliding over friction: growth rates and frequencies, thick where unstable."""
    figure = _sized(110.0)
    growth, frequency = figure.subplots(2, 1, sharex=True)
    scene = two_subsystems()
    plot(sweep(scene, {"friction": np.linspace(*FRICTIONS, 301)}), figure=figure)
    growth.set_xlabel("")
    figure.legends.clear()
    hopf = [point.value for point in critical_points(scene, {"friction": FRICTIONS}, kinds=("hopf",))]
    (dots,) = growth.plot(hopf, np.zeros(len(hopf)), "o", color="black", markersize=3)
    red, blue = (Line2D([], [], color=colour) for colour in (UNSTABLE, STABLE))
    _legend(
        figure, [red, blue, dots], ["unstable", "stable", "Hopf point"], loc="outside upper center", ncols=3
    )
    for axes in (growth, frequency):
        axes.set_xlim(*FRICTIONS)
    return figure


@_figure(4)
def figure_4() -> Figure:
    """Orbits of the four masses in the unstable mode at friction 1.5, three periods from the dot on."""
    modes = complex_modes(two_subsystems())
    leading = int(np.argmax(modes.eigenvalues.real))
    figure = _sized(80.0)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, (name, (dofs, inclination)) in zip(panels.ravel(), MASSES.items(), strict=True):
        motion = modes.orbit(leading, dofs).to_numpy()
        turn = np.array(
            [
                [np.cos(inclination), -np.sin(inclination)],
                [np.sin(inclination), np.cos(inclination)],
            ]
        )
        path = motion @ turn.T
        axes.plot(*path.T, color=UNSTABLE, linewidth=0.8)
        axes.plot(*path[0], marker="o", color="black", markersize=3)
        axes.set_title(name)
        axes.set_aspect("equal")
        axes.label_outer()
    figure.supxlabel("horizontal displacement (largest of the mode = 1 at the dot)", fontsize=7.0)
    figure.supylabel("vertical displacement", fontsize=7.0)
    return figure


@_figure(5)
def figure_5() -> Figure:
    """Displacements in the standard run, from steady sliding."""
    run = standard_run()
    figure = _sized(100.0)
    panels = figure.subplots(4, 1, sharex=True)
    for axes, dof in zip(panels, ("x1", "x2", "x3", "x7"), strict=True):
        run.plot(dof, samples=SAMPLES, ax=axes)
        axes.lines[0].set_linewidth(0.4)
        axes.label_outer()
    return figure


@_figure(6)
def figure_6() -> Figure:
    """Phase planes of both contact masses in the standard run, from steady sliding to the limit cycle."""
    figure = _sized(115.0)
    run = standard_run()
    panels = figure.subplots(2, 1)
    for contact, (axes, mass) in enumerate(zip(panels, CONTACTS, strict=True)):
        run.plot.phase(contact=contact, samples=SAMPLES, ax=axes)
        # All but the many rounds of sliding stays as wide as it is.
        axes.lines[0].set_linewidth(0.4)
        axes.set_title(mass)
    _common_legend(figure, panels)
    return figure


@_figure(7)
def figure_7() -> Figure:
    """Contact status in the standard run, and in its last two periods."""
    run = standard_run()
    figure = _sized(60.0)
    panels = figure.subplots(2, 1)
    for axes, begin in zip(panels, (0.0, run.duration - 0.0178), strict=True):
        _status(axes, run, begin, run.duration)
    panels[0].set_xlabel("")
    _common_legend(figure, panels)
    return figure


@_figure(8)
def figure_8() -> Figure:
    """Spectrum of the vertical of m1 in the standard run: while it grows, and in the limit cycle."""
    run = standard_run()
    figure = _sized(85.0)
    growing, settled = figure.subplots(2, 1, sharex=True)
    run.plot.spectrum(UPPER_VERTICAL, end=float(run.events.time[0]), ax=growing)
    growing.set_title("up to the first status change")
    _lines(settled, run.limit_cycle(), "limit cycle")
    _decades(growing, settled)
    growing.set_xlim(0.0, HIGHEST)
    growing.label_outer()
    return figure


@_figure(9)
def figure_9() -> Figure:
    """Limit cycles of both contact masses at friction 1.5, 2.2 and 3, slider speed 0.025 m/s."""
    cycles = _over_friction()
    figure = _sized(115.0)
    panels = figure.subplots(2, 1)
    for contact, (axes, mass) in enumerate(zip(panels, CONTACTS, strict=True)):
        for name, cycle in cycles.items():
            cycle.plot.outline(contact=contact, label=name, ax=axes)
        axes.set_title(mass)
    panels[0].set_xlabel("")
    _common_legend(figure, panels)
    return figure


@_figure(10)
def figure_10() -> Figure:
    """Spectra of the vertical of m1 in the limit cycles at friction 1.5, 2.2 and 3."""
    return _spectra(_over_friction())


@_figure(11)
def figure_11() -> Figure:
    """Limit cycles of both contact masses at four slider speeds, friction 2.2; each on its own scale."""
    cycles = _over_speed()
    figure = _sized(150.0)
    grid = figure.subplots(len(cycles), 2)
    for row, (name, cycle) in zip(grid, cycles.items(), strict=True):
        for contact, (axes, mass) in enumerate(zip(row, CONTACTS, strict=True)):
            cycle.plot.outline(contact=contact, ax=axes)
            # Short flights between impacts lie side by side.
            axes.lines[0].set_linewidth(0.6)
            axes.set(title=f"{mass}, {name}", xlabel="", ylabel="")
    figure.supxlabel("tangential displacement about its middle, µm", fontsize=7.0)
    figure.supylabel("tangential velocity, m/s", fontsize=7.0)
    return figure


@_figure(12)
def figure_12() -> Figure:
    """Spectra of the vertical of m1 in the limit cycles at four slider speeds, friction 2.2."""
    return _spectra(_over_speed())


@_figure(13)
def figure_13() -> Figure:
    """Energy of the standard run: stored, its rate, powers, contact status."""
    run = standard_run()
    return _energy(run, 0.0, run.duration)


@_figure(14)
def figure_14() -> Figure:
    """Energy over one period of the limit cycle of the standard run."""
    run = standard_run().limit_cycle().run
    return _energy(run, 0.0, run.duration)


@_figure(15)
def figure_15() -> Figure:
    """Energy in the standard run while the unstable mode grows, up to the first status changes."""
    run = standard_run()
    onset = float(run.events.time[0])
    return _energy(run, onset - 0.03, onset + 0.01)


def _sized(height: float) -> Figure:
    """Return an empty figure of a column's width and a height in mm."""
    return Figure(figsize=(COLUMN, height / 25.4), layout="constrained")


@cache
def _over_friction() -> Mapping[str, Cycle]:
    return {f"friction {mu}": attractor(Decimal(mu), Decimal("0.025"))[1] for mu in ("1.5", "2.2", "3.0")}


@cache
def _over_speed() -> Mapping[str, Cycle]:
    speeds = ("0.025", "0.05", "0.3", "0.9")
    return {f"{speed} m/s": attractor(Decimal("2.2"), Decimal(speed))[1] for speed in speeds}


def _spectra(cycles: Mapping[str, Cycle]) -> Figure:
    figure = _sized(20.0 + 28.0 * len(cycles))
    panels = figure.subplots(len(cycles), 1, sharex=True, sharey=True)
    for axes, (name, cycle) in zip(panels, cycles.items(), strict=True):
        _lines(axes, cycle, name)
        axes.label_outer()
    panels[0].set_xlim(0.0, HIGHEST)
    _decades(*panels)
    return figure


def _lines(axes: Axes, cycle: Cycle, title: str) -> None:
    lines = cycle.harmonics().swap_dims(harmonic="frequency").assign_attrs(method="exact")
    plot(lines.sel(dof=UPPER_VERTICAL, frequency=slice(0.0, HIGHEST)), ax=axes)
    axes.set_title(f"{title}, main line {cycle.main_frequency(UPPER_VERTICAL):.2f} Hz")


def _decades(*panels: Axes) -> None:
    """Show six decades below the highest line, as long as stems are."""
    highest = max(np.max(line.get_ydata()) for axes in panels for line in axes.lines)
    for axes in panels:
        axes.set_ylim(1e-6 * highest, 3.0 * highest)


def _energy(run: Motion, begin: float, end: float) -> Figure:
    flow = run.energy(np.linspace(begin, end, ENERGY_SAMPLES))
    figure = _sized(140.0)
    panels = figure.subplots(4, 1, sharex=True, height_ratios=[3.0, 2.0, 3.0, 1.2])
    stored, rate, powers, status = panels
    plot(flow, "stored", ax=stored)
    plot(flow, "rate", ax=rate)
    plot(flow.assign_coords(contact=list(CONTACTS)), "powers", ax=powers)
    _status(status, run, begin, end)
    for axes in panels:
        for line in axes.lines:
            line.set_linewidth(0.8 if end - begin < 0.1 else 0.3)
        _legend_above(axes)
    return figure


def _status(axes: Axes, run: Motion, begin: float, end: float) -> None:
    run.plot.statuses(ax=axes)
    axes.set_xlim(begin, end)
    axes.set_yticklabels(CONTACTS)


def _without_legend(axes: Axes) -> None:
    legend = axes.get_legend()
    if legend is not None:
        legend.remove()


def _legend_above(axes: Axes) -> None:
    """Put the legend of a panel above it."""
    handles, labels = axes.get_legend_handles_labels()
    _legend(axes, handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.1)


def _common_legend(figure: Figure, panels: Iterable[Axes]) -> None:
    """Name above all panels what is drawn in any of them."""
    found: dict[str, Artist] = {}
    for axes in panels:
        _without_legend(axes)
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    _legend(figure, list(found.values()), list(found), loc="outside upper center", ncols=len(found))


def _legend(owner: Axes | Figure, handles: Sequence[Artist], labels: Sequence[str], **place: Any) -> None:
    legend = owner.legend(
        handles, labels, frameon=False, handlelength=1.9, columnspacing=0.8, handletextpad=0.4, **place
    )
    # Thin curves have to tell their style here.
    for line in legend.get_lines():
        line.set_linewidth(1.2)
