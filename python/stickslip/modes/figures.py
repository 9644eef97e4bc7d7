"""Figures of complex modes: eigenvalues, shapes, orbits, and a mode in the drawing of its scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.ticker import MaxNLocator

from stickslip.faults import InputError
from stickslip.modes.shape import Computed, spiral
from stickslip.scene.checks import Complex, described, shown_statuses, whole_number
from stickslip.scene.contact import dof_index
from stickslip.scene.drawing.figures import draw_mesh, draw_moved, draw_orbits, draw_rest
from stickslip.scene.drawing.schematic import Column, Schematic, schematic, structure
from stickslip.show.plots import Plots, axes_of, figure_of, panels_of
from stickslip.show.style import STABLE, UNSTABLE

#: Modes whose shapes are drawn if none are named, dofs up to which each has a bar and its name, and modes
#: whose eigenvalues bear their number.
MOST, NAMED, LABELLED = 9, 24, 24

#: Masses as name: (abscissa, ordinate), two dofs each.
Masses = Mapping[str, tuple[int | str, int | str]]


class ModesPlots(Plots[Computed]):
    """Pictures of complex modes; unstable ones are red. A mode is named by its number."""

    def __call__(self, *, ax: Axes | None = None) -> Axes:
        """Draw frequency over growth rate; return the Axes.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        modes, axes = self._result, axes_of(ax)
        growth = modes.eigenvalues.real
        for grows, marker, label in ((False, "o", "stable"), (True, "^", "unstable")):
            chosen = np.flatnonzero(modes.unstable == grows)
            colour = UNSTABLE if grows else STABLE
            axes.plot(growth[chosen], modes.frequencies[chosen], marker, color=colour, label=label)
            for number in chosen[:LABELLED]:
                place = (growth[number], modes.frequencies[number])
                axes.annotate(str(number), place, textcoords="offset points", xytext=(5, 3), fontsize="small")
        axes.axvline(0.0, color="black", linewidth=0.6)
        title = f"Modes of {shown_statuses(modes.combination)}"
        axes.set(xlabel="growth rate, 1/s", ylabel="frequency, Hz", title=title)
        axes.legend(frameon=False, fontsize="small")
        return axes

    def shape(self, number: int, *, ax: Axes | None = None) -> Axes:
        """Draw the largest displacement of every dof in a mode (the paper's Fig. 2); return the Axes.

        Complex shapes are shown by their modulus, with the sign of the displacement at the instant at which
        the largest dof is at its peak.

        Parameters
        ----------
        number
            Number of the mode.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If there is no mode of that number.
        """
        modes, mode, axes = self._result, self._number(number), axes_of(ax)
        values, names = modes.shapes[:, mode], modes.dofs
        signed = np.abs(values) * np.where(values.real < 0.0, -1.0, 1.0)
        if len(names) <= NAMED:
            axes.bar(names, signed, color=self._colour(mode))
        else:
            # A bar of each dof is an artist of its own: a thousand of them take seconds.
            axes.vlines(np.arange(signed.size), 0.0, signed, color=self._colour(mode), linewidth=0.8)
            axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
            axes.xaxis.set_major_formatter(
                lambda place, _: names[int(place)] if 0 <= place < len(names) else ""
            )
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_title(f"mode {mode}: {modes.frequencies[mode]:.2f} Hz", fontsize="medium")
        return axes

    def shapes(self, numbers: Sequence[int] | None = None, *, figure: FigureBase | None = None) -> Figure:
        """Return a Figure of the shapes of modes, each as `shape` draws it.

        Parameters
        ----------
        numbers
            Numbers of the modes; None: at most the 9 with the largest growth.
        figure
            Where to draw, with as many panels or none; None: in a new one.

        Raises
        ------
        InputError
            If there is no mode of a number, or no number.
        """
        modes = self._result
        chosen = [self._number(number, "numbers") for number in (() if numbers is None else numbers)]
        omitted = ""
        if numbers is None:
            known = modes.eigenvalues.size
            chosen = np.sort(np.argsort(-modes.eigenvalues.real, kind="stable")[:MOST]).tolist()
            omitted = f": {MOST} of {known}, those with the largest growth" if known > MOST else ""
        elif not chosen:
            raise InputError("numbers: expected at least one mode, got none")
        columns = min(3, len(chosen))
        rows = -(-len(chosen) // columns)
        size = (3.0 * columns, 2.3 * rows)
        drawn, panels = panels_of(figure, (rows, columns), size, sharex=True, sharey=True)
        for axes, mode in zip(panels, chosen, strict=False):
            self.shape(mode, ax=axes)
        for axes in panels[len(chosen) :]:
            axes.set_visible(False)
        panels[0].set_ylim(-1.1, 1.1)
        drawn.supylabel("displacement, largest = 1")
        if figure is None:
            drawn.suptitle(f"Modes of status {shown_statuses(modes.combination)}{omitted}")
        return figure_of(drawn)

    def structure(
        self, number: int | None = None, *, columns: Sequence[Column] = (), ax: Axes | None = None
    ) -> Axes:
        """Draw a mode in its scene: on the mesh, or on bodies and springs with their orbits; return the Axes.

        Of a mesh the real part of the shape displaces the points and the modulus colours them. A scene
        without a mesh is drawn as by ``scene.plot()``.

        Parameters
        ----------
        number
            Number of the mode; None: the least stable one.
        columns
            Places of the masses, if they are known, see ``scene.plot()``.
        ax
            Where to draw, a mesh in space on axes of ``projection="3d"``; None: on axes of its own.

        Raises
        ------
        InputError
            If there is no mode of that number, or the axes are not of the dimension of the mesh.
        """
        modes, mode = self._result, self._number(number)
        title = f"mode {mode}: {modes.described(mode)}"
        if modes.scene.mesh is not None and modes.scene.mesh.faces():
            return draw_mesh(modes.scene, modes.shapes[:, mode], None, title, ax)
        axes, drawing = axes_of(ax), schematic(modes.scene, columns)
        motion = self._moving(axes, drawing, mode)
        draw_moved(axes, drawing, motion.real, self._colour(mode))
        return axes

    def orbits(
        self, number: int, masses: Masses, *, periods: float = 3.0, figure: FigureBase | None = None
    ) -> Figure:
        """Return a Figure of the orbit of each mass in a mode, a spiral (the paper's Fig. 4), on one scale.

        Parameters
        ----------
        number
            Number of the mode.
        masses
            For each mass its two dofs: abscissa and ordinate, of a contact mass along and across its slider.
        periods
            Length of the orbit in periods.
        figure
            Where to draw, with a panel for each mass or none; None: in a new one.

        Raises
        ------
        InputError
            If there are no masses, or the mode or a dof does not exist.
        """
        if not isinstance(masses, Mapping) or not masses:
            given = described(masses)
            raise InputError(f"masses: expected the two dofs of at least one mass by its name, got {given}")
        modes, mode = self._result, self._number(number)
        drawn, panels = panels_of(figure, (1, len(masses)), (3.2 * len(masses), 3.9))
        indices = [[dof_index("masses", dof, modes.dofs) for dof in dofs] for dofs in masses.values()]
        eigenvalue, shape = complex(modes.eigenvalues[mode]), modes.shapes[:, mode]
        paths = [spiral(eigenvalue, shape[pair], periods, 601)[1] for pair in indices]
        reach = 1.1 * max(float(np.abs(path).max()) for path in paths)
        for axes, name, pair, path in zip(panels, masses, indices, paths, strict=True):
            axes.plot(path[:, 0], path[:, 1], color=self._colour(mode), linewidth=1.2)
            axes.plot(*path[0], marker="o", color="black", markersize=4)
            abscissa, ordinate = (modes.dofs[k] for k in pair)
            axes.set(title=name, xlabel=abscissa, ylabel=ordinate, xlim=(-reach, reach), ylim=(-reach, reach))
            axes.set_aspect("equal")
        drawn.suptitle(f"{modes.described(mode)} (dot: start)")
        return figure_of(drawn)

    def animate(
        self, number: int | None = None, *, columns: Sequence[Column] = (), frames: int = 48
    ) -> FuncAnimation:
        """Return a FuncAnimation of one period of a mode, every body or point of the mesh in its own phase.

        Growth and decay are left out. A mesh in space is seen from above at an angle. Save the animation with
        ``.save("mode.gif", writer="pillow")``, or show it with ``.to_jshtml()``.

        Parameters
        ----------
        number
            Number of the mode; None: the least stable one.
        columns
            Places of the masses, if they are known, see ``scene.plot()``.
        frames
            Pictures of the period, >= 2.

        Raises
        ------
        InputError
            If there is no mode of that number, or there are too few frames.
        """
        count, mode = whole_number("frames", frames, 2), self._number(number)
        drawing = structure(self._result.scene, columns)
        wide = 6.4 if drawing.faces else 2.2 + 1.3 * max(body.x for body in drawing.bodies)
        figure = Figure(figsize=(max(wide, 4.0), 3.6), layout="constrained")
        axes: Axes = figure.subplots()
        motion = self._moving(axes, drawing, mode)
        parts: list[Artist] = []

        def draw(frame: int) -> tuple[Artist, ...]:
            for part in parts:
                part.remove()
            moved = (motion * np.exp(2j * np.pi * frame / count)).real
            parts[:] = draw_moved(axes, drawing, moved, self._colour(mode))
            return tuple(parts)

        return FuncAnimation(figure, draw, frames=count, interval=40, blit=False)

    def _moving(self, axes: Axes, drawing: Schematic, mode: int) -> Complex:
        """Draw what rests, the orbits of the bodies and a title; return the motion of the bodies."""
        motion = drawing.motion(self._result.shapes[:, mode])
        draw_rest(axes, drawing)
        if drawing.faces:
            # The axes keep their limits while the mesh moves: collections do not extend them.
            axes.update_datalim([(body.x, body.y) for body in drawing.bodies])
        else:
            draw_orbits(axes, drawing, motion, self._colour(mode))
        axes.set_title(f"mode {mode}: {self._result.described(mode)}")
        return motion

    def _number(self, number: int | None, name: str = "number") -> int:
        count = self._result.eigenvalues.size
        if number is None:
            return int(np.argmax(self._result.eigenvalues.real))
        if number not in range(count):
            raise InputError(f"{name}: expected a mode in 0..{count - 1}, got {number!r}")
        return number

    def _colour(self, mode: int) -> str:
        return UNSTABLE if self._result.unstable[mode] else STABLE
