"""Figures of complex modes: loci, shapes, orbits, and a mode in motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from stickslip.faults import InputError
from stickslip.modes.modes import Modes
from stickslip.modes.shape import orbit
from stickslip.scene.checks import Complex, described, shown_statuses
from stickslip.scene.contact import dof_index
from stickslip.show.style import STABLE, UNSTABLE

#: Line styles that tell masses apart without colour.
COLOURS = ("#4477aa", "#cc3311", "#228833", "#aa3377", "#66ccee", "#ccbb44")
#: Modes that are drawn unasked, and dofs up to which each has a bar and its name.
MOST, NAMED = 9, 24

#: Masses as name: (horizontal, vertical) or (tangential, normal) dof.
Masses = Mapping[str, tuple[int | str, int | str]]


def shapes(modes: Modes, numbers: Sequence[int] | None = None) -> Figure:
    """Return the shape of modes as displacement of each dof at its largest (the paper's Fig. 2).

    Complex shapes are shown by their modulus, with the sign of the displacement at the instant at which the
    largest dof is at its peak.

    Parameters
    ----------
    modes
        The modes.
    numbers
        Numbers of the modes, their places among all eigenvalues from 0 on; None: one of each conjugate pair,
        at most the 9 with the largest growth rates.

    Raises
    ------
    InputError
        If a number is none of a mode, or there is no number.
    """
    known = np.flatnonzero(modes.eigenvalues.imag >= 0.0)
    if numbers is None:
        chosen = known[np.sort(np.argsort(-modes.eigenvalues[known].real, kind="stable")[:MOST])].tolist()
        omitted = f": {MOST} of {known.size}, those with the largest growth" if known.size > MOST else ""
    else:
        wrong = [number for number in numbers if number not in range(len(modes))]
        if wrong or not numbers:
            raise InputError(f"numbers: expected modes in 0..{len(modes) - 1}, got {wrong or list(numbers)}")
        chosen = list(numbers)
        omitted = ""
    columns = min(3, len(chosen))
    rows = -(-len(chosen) // columns)
    figure = Figure(figsize=(3.0 * columns, 2.3 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes, mode in zip(panels, chosen, strict=False):
        draw_shape(axes, modes, mode)
        axes.set_title(f"mode {mode}: {modes.frequencies[mode]:.2f} Hz", fontsize="medium")
    for axes in panels[len(chosen) :]:
        axes.set_visible(False)
    panels[0].set_ylim(-1.1, 1.1)
    figure.supylabel("displacement, largest = 1")
    figure.suptitle(f"Modes of status {shown_statuses(modes.combination)}{omitted}")
    return figure


def draw_shape(axes: Axes, modes: Modes, mode: int) -> None:
    """Draw what `shapes` shows of one mode on your axes.

    Parameters
    ----------
    axes
        Where to draw.
    modes, mode
        The modes and the index of one of them.
    """
    shape = modes.shapes[:, mode]
    signed = np.abs(shape) * np.where(shape.real < 0.0, -1.0, 1.0)
    colour = UNSTABLE if modes.unstable[mode] else STABLE
    if len(modes.dofs) <= NAMED:
        axes.bar(modes.dofs, signed, color=colour)
    else:
        # A bar of each dof is an artist of its own: a thousand of them take seconds.
        axes.vlines(np.arange(signed.size), 0.0, signed, color=colour, linewidth=0.8)
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        axes.xaxis.set_major_formatter(
            lambda place, _: modes.dofs[int(place)] if 0 <= place < len(modes.dofs) else ""
        )
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_title(f"{modes.frequencies[mode]:.2f} Hz", fontsize="medium")


def orbits(modes: Modes, mode: int, masses: Masses, *, periods: float = 3.0) -> Figure:
    """Return the orbit of each mass in one mode: a spiral (the paper's Fig. 4), all on one scale.

    Parameters
    ----------
    modes, mode
        The modes and the index of one of them.
    masses
        For each mass its two dofs: abscissa and ordinate, of a contact mass along and across its slider.
    periods
        Length of the orbit in periods.

    Raises
    ------
    InputError
        If there are no masses, or the mode or a dof does not exist.
    """
    _check_masses(masses)
    if not masses:
        raise InputError("masses: expected at least one, got none")
    figure = Figure(figsize=(3.2 * len(masses), 3.9), layout="constrained")
    panels = figure.subplots(1, len(masses), squeeze=False)[0]
    paths = [orbit(modes, mode, dofs, periods=periods).to_numpy() for dofs in masses.values()]
    reach = 1.1 * max(float(np.abs(path).max()) for path in paths)
    for axes, (name, dofs), path in zip(panels, masses.items(), paths, strict=True):
        axes.plot(path[:, 0], path[:, 1], color=UNSTABLE if modes.unstable[mode] else STABLE, linewidth=1.2)
        axes.plot(*path[0], marker="o", color="black", markersize=4)
        abscissa, ordinate = (modes.dofs[dof_index("masses", dof, modes.dofs)] for dof in dofs)
        axes.set(title=name, xlabel=abscissa, ylabel=ordinate, xlim=(-reach, reach), ylim=(-reach, reach))
        axes.set_aspect("equal")
    figure.suptitle(f"{modes.described(mode)} (dot: start)")
    return figure


def animated(
    modes: Modes,
    mode: int,
    masses: Masses,
    *,
    places: Sequence[tuple[float, float]] | None = None,
    frames: int = 48,
) -> FuncAnimation:
    """Return one period of a mode as an animation, repeated without growth or decay.

    Parameters
    ----------
    modes, mode
        The modes and the index of one of them.
    masses
        For each mass its two dofs: abscissa and ordinate.
    places
        Where each mass rests in the figure; None: in a row. Displacements are drawn at most 0.35 long.
    frames
        Pictures per period.

    Returns
    -------
    matplotlib.animation.FuncAnimation
        Save it with ``.save("mode.gif", writer="pillow")``, or show it with ``.to_jshtml()``.

    Raises
    ------
    InputError
        If numbers of places and masses differ, or the mode or a dof does not exist.
    """
    _check_masses(masses)
    rest = [(float(k), 0.0) for k in range(len(masses))] if places is None else list(places)
    if not masses or len(rest) != len(masses):
        raise InputError(
            f"places: expected one for each of {len(masses)} masses (at least one), got {len(rest)}"
        )
    if not 0 <= mode < modes.eigenvalues.size:
        raise InputError(f"mode: expected an index in 0..{modes.eigenvalues.size - 1}, got {mode!r}")
    indices = np.array([[dof_index("masses", dof, modes.dofs) for dof in dofs] for dofs in masses.values()])
    motion: Complex = modes.shapes[indices, mode]
    motion = 0.35 * motion / (np.abs(motion).max() or 1.0)
    phases = np.exp(2j * np.pi * np.arange(frames) / frames)
    positions = np.array(rest) + (phases[:, None, None] * motion).real
    figure = Figure(figsize=(1.0 + 1.6 * len(masses), 2.8), layout="constrained")
    axes: Axes = figure.subplots()
    for mass, (colour, name) in enumerate(zip(_cycled(len(masses)), masses, strict=True)):
        closed = np.append(positions[:, mass], positions[:1, mass], axis=0)
        axes.plot(*closed.T, color=colour, linewidth=0.8, alpha=0.5)
        axes.annotate(name, rest[mass], xytext=(0, 30), textcoords="offset points", ha="center")
    points = axes.scatter(positions[0, :, 0], positions[0, :, 1], c=_cycled(len(masses)), s=60, zorder=3)
    axes.set(title=modes.described(mode), xticks=[], yticks=[])
    axes.margins(0.2)
    axes.set_aspect("equal", adjustable="datalim")

    def draw(frame: int) -> tuple[Artist, ...]:
        points.set_offsets(positions[frame])
        return (points,)

    return FuncAnimation(figure, draw, frames=frames, interval=40, blit=False)


def _check_masses(masses: Masses) -> None:
    if not isinstance(masses, Mapping):
        raise InputError(f"masses: expected the two dofs of each mass by its name, got {described(masses)}")


def _cycled(count: int) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(count)]
