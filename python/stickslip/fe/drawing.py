"""Displacements drawn on the mesh of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from stickslip.faults import InputError
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
