"""Figures of complex modes: loci, shapes, orbits, and a mode in motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from stickslip.scene.checks import Complex
from stickslip.scene.contact import dof_index
from stickslip.errors import InputError
from stickslip.modes.shape import orbit
from stickslip.modes.modes import Modes

#: Stable and unstable, as in the figures of motions.
STABLE, UNSTABLE = "#4477aa", "#cc3311"
#: Line styles that tell masses apart without colour.
COLOURS = ("#4477aa", "#cc3311", "#228833", "#aa3377", "#66ccee", "#ccbb44")
#: Modes that are drawn unasked, and dofs up to which each has a bar and its name.
MOST, NAMED = 9, 24

#: Shades of growth, and as many of decay, in a map of stability.
LEVELS = 12

#: Masses as name: (horizontal, vertical) or (tangential, normal) dof.
Masses = Mapping[str, tuple[int | str, int | str]]


def loci(branches: xr.Dataset, *, slow: bool = True) -> Figure:
    """Return growth rates and frequencies of tracked branches over their parameter (the paper's Fig. 3).

    Parameters
    ----------
    branches
        A sweep over one parameter.
    slow
        Whether to leave out growth rates far below the least damped branches, which would put these on one
        line.

    Raises
    ------
    InputError
        If the sweep is over more than one parameter.
    """
    parameters = [name for name in branches.eigenvalue.dims if name != "branch"]
    if len(parameters) != 1:
        raise InputError(f"loci: expected a sweep over one parameter, got {parameters}")
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    growth, frequency = figure.subplots(1, 2)
    draw_loci(growth, frequency, branches, slow)
    figure.suptitle("Complex eigenvalues (red: unstable)")
    return figure


def draw_loci(growth: Axes, frequency: Axes, branches: xr.Dataset, slow: bool = True) -> None:
    """Draw what `loci` shows on your axes; thick where unstable.

    Parameters
    ----------
    growth, frequency
        Where to draw real parts and frequencies.
    branches, slow
        As for `loci`.
    """
    (name,) = (str(name) for name in branches.eigenvalue.dims if name != "branch")
    order = np.argsort(branches[name].to_numpy())
    values = branches[name].to_numpy()[order]
    eigenvalue = branches.eigenvalue.transpose(name, "branch").to_numpy()[order]
    for branch in eigenvalue.T:
        if (branch.imag < 0.0).all():
            continue
        for axes, ordinate in ((growth, branch.real), (frequency, np.abs(branch) / (2.0 * np.pi))):
            axes.plot(values, ordinate, color=STABLE, linewidth=1.2)
            axes.plot(values, np.where(branch.real > 0.0, ordinate, np.nan), color=UNSTABLE, linewidth=1.8)
    growth.axhline(0.0, color="black", linewidth=0.6)
    if slow:
        top = eigenvalue.real.max()
        reach = max(top, np.abs(eigenvalue.real.max(axis=1)).max())
        if reach > 0.0:
            growth.set_ylim(-2.2 * reach, 1.1 * max(top, 0.2 * reach))
    growth.set(xlabel=_words(name), ylabel="real part, 1/s")
    frequency.set(xlabel=_words(name), ylabel="|eigenvalue| / 2π, Hz")


def stability_map(branches: xr.Dataset) -> Figure:
    """Return where sliding is stable over two parameters: largest growth rate and number of unstable modes.

    The border of stability, where the largest growth rate is zero, is the black line of both panels.

    Parameters
    ----------
    branches
        A sweep over two parameters, at least two values of each.

    Raises
    ------
    InputError
        If the sweep is over one parameter, or over a single value of one.
    """
    names = [str(name) for name in branches.eigenvalue.dims if name != "branch"]
    if len(names) != 2 or min(branches.sizes[name] for name in names) < 2:
        sizes = {name: branches.sizes[name] for name in names}
        raise InputError(
            f"stability_map: expected a sweep over two parameters, two values of each at least, got {sizes}"
        )
    # The second parameter, along which branches are continuous, is the horizontal axis.
    upward, across = names
    ordered = branches.sortby(names).eigenvalue.transpose(*names, "branch")
    eigenvalue = ordered.to_numpy()
    growth = eigenvalue.real.max(axis=-1)
    grid = (ordered[across].to_numpy(), ordered[upward].to_numpy())
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    reach = float(np.abs(growth).max()) or 1.0
    levels = np.linspace(-reach, reach, 2 * LEVELS + 1)
    shades = left.contourf(*grid, growth, levels=levels, cmap="RdBu_r")
    figure.colorbar(shades, ax=left, label="largest real part, 1/s")
    # At least k modes are unstable where the k-th largest real part, one of each pair, is positive.
    one_of_pair = np.where(eigenvalue.imag >= 0.0, eigenvalue.real, -reach)
    ranked = np.moveaxis(-np.sort(-one_of_pair, axis=-1), -1, 0)
    most = int((ranked > 0.0).any(axis=(1, 2)).sum())
    shade = colormaps["Reds"].resampled(most + 2)
    for rank, real in enumerate(ranked[:most], start=1):
        right.contourf(*grid, real, levels=[0.0, 2.0 * reach], colors=[shade(rank)])
    edges = BoundaryNorm(np.arange(most + 2) - 0.5, most + 1)
    number = ScalarMappable(edges, ListedColormap(shade(range(most + 1))))
    figure.colorbar(number, ax=right, label="number of unstable modes", ticks=np.arange(most + 1))
    right.set_facecolor(shade(0))
    for axes in (left, right):
        if growth.min() < 0.0 < growth.max():
            axes.contour(*grid, growth, levels=[0.0], colors="black", linewidths=1.2)
        axes.set_xlabel(_with_unit(branches, across))
    left.set_ylabel(_with_unit(branches, upward))
    figure.suptitle("Stability of sliding (black: its border)")
    return figure


def shapes(modes: Modes, numbers: Sequence[int] | None = None) -> Figure:
    """Return the shape of modes as displacement of each dof at its largest (the paper's Fig. 2).

    Complex shapes are shown by their modulus, with the sign of the displacement at the instant at which the
    largest dof is at its peak.

    Parameters
    ----------
    modes
        The modes.
    numbers
        Which modes, numbered from 1 in the order of their eigenvalues, one of each conjugate pair; None: at
        most 9, those with the largest growth rates.

    Raises
    ------
    InputError
        If a number is none of a mode, or there is no number.
    """
    known = np.flatnonzero(modes.eigenvalues.imag >= 0.0)
    if numbers is None:
        places = np.sort(np.argsort(-modes.eigenvalues[known].real, kind="stable")[:MOST])
        omitted = f": {MOST} of {known.size}, those with the largest growth" if known.size > MOST else ""
    else:
        wrong = [number for number in numbers if number not in range(1, known.size + 1)]
        if wrong or not numbers:
            raise InputError(f"numbers: expected modes in 1..{known.size}, got {wrong or list(numbers)}")
        places = np.array(numbers) - 1
        omitted = ""
    columns = min(3, places.size)
    rows = -(-places.size // columns)
    figure = Figure(figsize=(3.0 * columns, 2.3 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes, place in zip(panels, places, strict=False):
        mode = int(known[place])
        draw_shape(axes, modes, mode)
        axes.set_title(f"mode {place + 1}: {modes.frequencies[mode]:.2f} Hz", fontsize="medium")
    for axes in panels[places.size :]:
        axes.set_visible(False)
    panels[0].set_ylim(-1.1, 1.1)
    figure.supylabel("displacement, largest = 1")
    status = modes.combination
    if len(status) > NAMED:
        status = f"{status[:NAMED]}… ({len(status)} contacts)"
    figure.suptitle(f"Modes of status {status}{omitted}")
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
    """Return the orbit of each mass in one mode: a spiral (the paper's Fig. 4).

    Parameters
    ----------
    modes, mode
        The modes and the index of one of them.
    masses
        For each mass its two dofs: abscissa and ordinate.
    periods
        Length of the orbit in periods.

    Raises
    ------
    InputError
        If there are no masses, or the mode or a dof does not exist.
    """
    if not masses:
        raise InputError("masses: expected at least one, got none")
    figure = Figure(figsize=(3.2 * len(masses), 3.4), layout="constrained")
    panels = figure.subplots(1, len(masses), squeeze=False)[0]
    for axes, (name, dofs) in zip(panels, masses.items(), strict=True):
        path = orbit(modes, mode, dofs, periods=periods).to_numpy()
        axes.plot(path[:, 0], path[:, 1], color=UNSTABLE if modes.unstable[mode] else STABLE, linewidth=1.2)
        axes.plot(*path[0], marker="o", color="black", markersize=4)
        abscissa, ordinate = (modes.dofs[dof_index("masses", dof, modes.dofs)] for dof in dofs)
        axes.set(title=name, xlabel=abscissa, ylabel=ordinate)
        axes.set_aspect("equal", adjustable="datalim")
    figure.suptitle(f"{_described(modes, mode)} (dot: start)")
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
    axes.set(title=_described(modes, mode), xticks=[], yticks=[])
    axes.margins(0.2)
    axes.set_aspect("equal", adjustable="datalim")

    def draw(frame: int) -> tuple[Artist, ...]:
        points.set_offsets(positions[frame])
        return (points,)

    return FuncAnimation(figure, draw, frames=frames, interval=40, blit=False)


def _cycled(count: int) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(count)]


def _words(name: str) -> str:
    return "friction coefficient" if name == "friction" else name.replace("_", " ")


def _with_unit(branches: xr.Dataset, name: str) -> str:
    unit = branches[name].attrs.get("units", "1")
    return _words(name) if unit == "1" else f"{_words(name)}, {unit}"


def _described(modes: Modes, mode: int) -> str:
    value = modes.eigenvalues[mode]
    kind = "grows" if value.real > 0.0 else "decays"
    return f"{modes.frequencies[mode]:.2f} Hz, {kind} at {abs(value.real):.3g} 1/s"
