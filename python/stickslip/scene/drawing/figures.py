"""A scene as a drawing of bodies, springs and sliders, or as its mesh; at rest, displaced, or in motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Real
from stickslip.scene.drawing.displacements import mesh_of
from stickslip.scene.drawing.schematic import NAMED, PART, Column, Schematic, Structured, schematic
from stickslip.scene.drawing.view import View, view_of
from stickslip.show.plots import Plots, axes_of
from stickslip.show.style import STABLE

#: Coils of a spring.
COILS = 6
#: Width of the lines that rest.
WIDTHS = {"wall": 2.0, "slider": 2.5}


class ScenePlots(Plots[Structured]):
    """Pictures of a scene."""

    def __call__(
        self,
        displacement: ArrayLike | None = None,
        *,
        columns: Sequence[Column] = (),
        ax: Axes | None = None,
    ) -> Axes:
        """Draw the scene from its matrices, with walls and sliders; return the Axes.

        Matrices do not say where masses are. So every contact becomes a body in the bottom row, and every
        other dof a body that moves to the right, in layers by the number of springs to the next contact. K
        gives the springs between them.

        Parameters
        ----------
        displacement
            Displacement of the dofs, (n,), in any unit: the largest is drawn 0.3 long. None: at rest.
        columns
            Places of the masses; empty: those of the model of the scene, or each contact in its own
            directions.
        ax
            Where to draw; None: on axes of its own.

        Raises
        ------
        InputError
            If the displacement has not one number per dof.
        """
        drawing = schematic(self._result, columns)
        moved = self._displacement(np.zeros(len(self._result.dofs)) if displacement is None else displacement)
        axes = axes_of(ax)
        draw_rest(axes, drawing)
        draw_moved(axes, drawing, drawing.motion(moved).real, STABLE)
        return axes

    def mesh(
        self, displacement: ArrayLike, *, scale: float | None = None, title: str = "", ax: Axes | None = None
    ) -> Axes:
        """Draw the mesh displaced, coloured by the length of the displacement; return the Axes.

        Parameters
        ----------
        displacement
            Displacement of the dofs, (n,), m; the real part of a complex shape displaces the mesh, the
            modulus colours it.
        scale
            Factor of the displacement; None: the largest is 0.08 of the size of the mesh.
        title
            Title of the axes.
        ax
            Where to draw; a mesh in space needs axes of ``projection="3d"``. None: on axes of its own.

        Raises
        ------
        InputError
            If the scene has no points or no cells, the displacement is not of its dofs, or the axes are not
            of the dimension of the mesh.
        """
        return draw_mesh(self._result, self._displacement(displacement), scale, title, ax)

    def view(
        self,
        displacements: Any,
        *,
        mode: int | None = None,
        phase: float = 0.0,
        frames: int | None = None,
        scale: float | None = None,
    ) -> View:
        """Return a View of the mesh in 3D, by pyvista: a picture of one instant, a film of several.

        The displacement moves the mesh, its length at that instant colours it. A notebook shows the view, and
        `save` writes it: a picture as ``.png``, a film as ``.gif`` or ``.mp4``. No screen is needed, but
        pyvista is: ``pip install 'stickslip[pyvista]'``.

        Parameters
        ----------
        displacements
            Of a motion what `Motion.sample` returns, a film of its k times if there are several, or a
            `State` or a vector (n,), m: a picture. Of complex modes `Modes`, the Dataset that
            `Modes.to_dataset` returns, or one shape, a complex vector (n,). What belongs to a reduced scene
            goes through `Reduction.expand` first, and the scene is the full one.
        mode
            Number of the mode, if there are several; None: the least stable one.
        phase
            Phase at which a mode is shown, or at which its film begins, rad: ``Re(shape e^{j phase})``,
            without growth or decay.
        frames
            Instants of a film of one period of a mode, >= 2; None: a picture.
        scale
            Factor of the displacements; None: the largest is 0.08 of the size of the mesh.

        Raises
        ------
        InputError
            If pyvista is missing, the scene has no points or cells that VTK does not know, the displacements
            are not of its dofs or not finite, there is no such mode, or a phase, frames or a mode are given
            for a motion.
        """
        return view_of(self._result, displacements, mode, phase, frames, scale)

    def _displacement(self, values: ArrayLike) -> Any:
        given, size = np.asarray(values), len(self._result.dofs)
        if given.shape != (size,) or given.dtype.kind not in "iufc":
            raise InputError(f"displacement: expected shape ({size},), got {given.shape}")
        return given


def draw_rest(axes: Axes, drawing: Schematic) -> None:
    """Draw what does not move: walls, sliders, names."""
    for kind, first, last in drawing.lines():
        if kind in WIDTHS:
            axes.plot([first.x, last.x], [first.y, last.y], color="black", linewidth=WIDTHS[kind])
    for body in drawing.bodies if len(drawing.bodies) <= NAMED and not drawing.faces else ():
        axes.annotate(body.name, (body.x + 0.12, body.y + 0.12), fontsize="small")
    if drawing.omitted:
        axes.annotate(f"{drawing.omitted} dofs are left out", (0.0, 1.0), xycoords="axes fraction", va="top")
    axes.set(xticks=[], yticks=[])
    axes.margins(0.15)
    axes.set_aspect("equal", adjustable="datalim")
    for side in axes.spines.values():
        side.set_visible(False)


def draw_orbits(axes: Axes, drawing: Schematic, motion: Complex, colour: str) -> None:
    """Draw the orbits of the bodies in a complex motion (bodies, 2)."""
    turn = np.exp(2j * np.pi * np.arange(49) / 48)
    for body, (right, up) in zip(drawing.bodies, motion, strict=True):
        axes.plot(body.x + (right * turn).real, body.y + (up * turn).real, color=colour, linewidth=0.7)


def draw_moved(axes: Axes, drawing: Schematic, moved: Real, colour: str) -> list[Artist]:
    """Draw what moves, springs and bodies or the faces of a mesh, displaced by (bodies, 2)."""
    places = np.array([(body.x, body.y) for body in drawing.bodies]) + moved
    if drawing.faces:
        faces = [places[list(face)] for face in drawing.faces]
        return [axes.add_collection(PolyCollection(faces, facecolor="0.93", edgecolor=colour, linewidth=0.5))]
    parts: list[Artist] = []
    for kind, *ends in drawing.lines():
        if kind == "spring":
            first, last = (
                np.array([end.x, end.y]) + (0.0 if end.body is None else moved[end.body]) for end in ends
            )
            parts += axes.plot(*_coil(first, last).T, color="0.45", linewidth=0.9, zorder=1)
    parts.append(axes.scatter(places[:, 0], places[:, 1], s=70, color=colour, edgecolor="white", zorder=3))
    return parts


def _coil(first: Real, last: Real) -> Real:
    along = last - first
    across = np.array([-along[1], along[0]]) / (float(np.hypot(*along)) or 1.0)
    inner = np.linspace(0.2, 0.8, 2 * COILS)
    sides = np.where(np.arange(2 * COILS) % 2, 0.035, -0.035)
    zigzag = first + inner[:, None] * along + sides[:, None] * across
    return np.vstack([first, first + 0.2 * along, zigzag, first + 0.8 * along, last])


def draw_mesh(scene: Structured, displacement: Any, scale: float | None, title: str, ax: Axes | None) -> Axes:
    """Draw the mesh of a scene displaced; see `ScenePlots.mesh`."""
    mesh = mesh_of(scene)
    faces = mesh.faces()
    if not faces:
        raise InputError("scene: its mesh has no cells that can be drawn")
    moved = mesh.displacements(displacement)
    length = np.sqrt((np.abs(moved) ** 2).sum(axis=-1))
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    points = mesh.points + (PART * size / (length.max() or 1.0) if scale is None else scale) * moved.real
    space = points.shape[1] == 3
    if ax is None:
        figure = Figure(figsize=(6.4, 4.8), layout="constrained")
        ax = figure.add_subplot(projection="3d" if space else "rectilinear")
    if (ax.name == "3d") != space:
        raise InputError(f"ax: expected axes of {'projection 3d' if space else 'the plane'}")
    shades = np.array([length[face].mean() for face in faces])
    polygons = [points[face] for face in faces]
    options: dict[str, Any] = {"array": shades, "cmap": "viridis", "edgecolor": "black", "linewidth": 0.15}
    low, high = points.min(axis=0), points.max(axis=0)
    axes: Any = ax
    if space:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        axes.add_collection3d(Poly3DCollection(polygons, **options))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(high - low)
        axes.set_axis_off()
    else:
        axes.add_collection(PolyCollection(polygons, **options))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[])
        axes.set_aspect("equal")
    axes.set_title(title)
    return ax
