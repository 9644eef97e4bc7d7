"""Displacements drawn on the mesh of a scene, and quantities of its contact pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.scene.checks import Real, real_array
from stickslip.scene.scene import Scene, checked

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(
    scene: Scene,
    displacement: ArrayLike,
    ax: Axes | None = None,
    *,
    scale: float | None = None,
    title: str = "",
) -> Axes:
    """Draw the surface of the mesh of a scene, displaced, and coloured by the length of the displacement.

    Parameters
    ----------
    scene
        A scene of meshed bodies, as `assemble` returns it.
    displacement
        Displacement of its dofs, (n,), m; the real part of a complex shape displaces the mesh, the modulus
        colours it.
    ax
        Where to draw; a mesh in space needs axes of ``projection="3d"``. None: on axes of its own.
    scale
        Factor of the displacement; None: the largest is 0.08 of the size of the mesh.
    title
        Title of the axes.

    Raises
    ------
    InputError
        If the scene has no points or no cells, the displacement is not of its dofs, or the axes are not of
        the dimension of the mesh.
    """
    from stickslip.show.mesh_figure import draw_mesh

    mesh = checked(scene).mesh
    if mesh is None:
        raise InputError("scene: it has no points; make it by stickslip.fe.assemble of bodies with points")
    values = np.asarray(displacement)
    if values.shape != (scene.size,) or values.dtype.kind not in "iufc":
        raise InputError(f"displacement: expected shape ({scene.size},), got {values.shape}")
    return draw_mesh(mesh, values, ax, scale, title)


def draw_pairs(points: Real, values: ArrayLike, ax: Axes | None, label: str) -> Axes:
    """Draw a quantity of every contact pair where it lies; see `Pairs.plot`.

    Raises
    ------
    InputError
        If it is not one finite number per pair.
    """
    from stickslip.show.style import UNSTABLE, axes_of

    shown = real_array("values", values, 1)
    if shown.shape != (len(points),) or not np.isfinite(shown).all():
        raise InputError(f"values: expected {len(points)} finite numbers, one per pair, got {shown}")
    axes = axes_of(ax)
    # Seen along the axis of space along which the points are least wide.
    wide = np.sort(np.argsort(-np.ptp(points, axis=0), kind="stable")[:2])
    if points.shape[1] == 2:
        wide = wide[np.ptp(points[:, wide], axis=0).argmax()]
        order = np.argsort(points[:, wide])
        axes.plot(1e3 * points[order, wide], shown[order], "o-", color=UNSTABLE)
        axes.set(xlabel=f"{'xy'[wide]}, mm", ylabel=label)
        return axes
    largest = np.abs(shown).max() or 1.0
    x, y = 1e3 * points[:, wide].T
    spots = axes.scatter(x, y, c=shown, cmap="coolwarm", vmin=-largest, vmax=largest, edgecolor="black")
    axes.figure.colorbar(spots, ax=axes, label=label)
    axes.set(xlabel=f"{'xyz'[wide[0]]}, mm", ylabel=f"{'xyz'[wide[1]]}, mm")
    axes.set_aspect("equal", adjustable="datalim")
    return axes
