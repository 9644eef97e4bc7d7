"""A mesh drawn with displacements on it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from stickslip.faults import InputError
from stickslip.show.mesh import Mesh


def draw_mesh(mesh: Mesh, position: Any, ax: Axes | None, scale: float | None, title: str) -> Axes:
    """Draw the surface of a mesh displaced, coloured by the length of the displacement.

    Parameters
    ----------
    mesh, position
        The mesh, and displacements of the dofs of its scene, (n,); of complex ones the real part is the place
        and the modulus the colour.
    ax
        Where to draw: of a mesh in space axes of projection "3d"; None: on axes of its own.
    scale
        Factor of the displacements; None: the largest is 0.08 of the size of the mesh.
    title
        Title of the axes.

    Raises
    ------
    InputError
        If the mesh has no cells to draw, or the axes are not of its dimension.
    """
    faces = mesh.faces()
    if not faces:
        raise InputError("scene: its mesh has no cells that can be drawn")
    moved = mesh.displacements(np.asarray(position))
    length = np.sqrt((np.abs(moved) ** 2).sum(axis=-1))
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    factor = 0.08 * size / (length.max() or 1.0) if scale is None else scale
    points = mesh.points + factor * moved.real
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
    if space:
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        axes: Any = ax
        axes.add_collection3d(Poly3DCollection(polygons, **options))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(high - low)
        axes.set_axis_off()
    else:
        ax.add_collection(PolyCollection(polygons, **options))
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[])
        ax.set_aspect("equal")
    ax.set_title(title)
    return ax
