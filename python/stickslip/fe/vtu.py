"""Displacements on the mesh as VTK files: motions, and complex modes as they move."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import package, real_number, whole_number
from stickslip.scene.drawing.displacements import Instants, ModeShape, displacements_of, mesh_of
from stickslip.scene.scene import Scene, checked
from stickslip.show.mesh import Mesh

#: Displacements that are drawn unasked are this part of the mesh's size.
SHOWN = 0.05


def write_vtu(
    path: str | Path,
    scene: Scene,
    displacements: Any,
    *,
    mode: int = 0,
    frames: int = 24,
    scale: float | None = None,
) -> list[Path]:
    """Write displacements on the mesh of a scene: a ``.vtu`` file per instant, a ``.pvd`` that lists them.

    Paraview opens the ``.pvd``; its filter "Warp By Vector" moves the mesh by ``displacement``.

    Parameters
    ----------
    path
        The ``.pvd`` file. The others lie beside it: ``squeal_0000.vtu``, ... Missing folders
        are made.
    scene
        A scene of meshed bodies, as `assemble` returns it.
    displacements
        What `Motion.sample` or `Reduction.expand` return (one file per time), a `State` or a vector (n,)
        (one file), or complex modes: `Modes`, the Dataset that `Modes.to_dataset` or `Reduction.expand`
        return, or one shape, a complex vector (n,). A mode moves through one period,
        ``Re(shape e^{j phase})``, without growth or decay.
    mode
        Number of the mode, if there are several.
    frames
        Instants of the period of a mode.
    scale
        Factor of the displacements of a mode; None: its largest is 0.05 of the size of the mesh. Motions are
        written as they are.

    Returns
    -------
    list of pathlib.Path
        The files, the ``.pvd`` first.

    Raises
    ------
    InputError
        If meshio is missing, the scene has no points, the displacements are not of its dofs, or the path is
        no ``.pvd``.
    OSError
        If a file cannot be written.
    """
    meshio = package("meshio", "write_vtu", "fe")
    target = Path(path)
    if target.suffix != ".pvd":
        raise InputError(f"path: expected a file .pvd, got {str(path)!r}")
    mesh = mesh_of(checked(scene))
    given = displacements_of(displacements, scene.dofs, whole_number("mode", mode, 0))
    times, frames_of = _frames(mesh, given, frames, scale)
    cells = [(kind, nodes) for kind, nodes in mesh.cells.items()]
    if not cells:
        cells = [("vertex", np.arange(len(mesh.points))[:, None])]
    points = _in_space(mesh.points)
    target.parent.mkdir(parents=True, exist_ok=True)
    written = [target]
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>"]
    for k, (time, fields) in enumerate(zip(times, frames_of, strict=True)):
        file = target.with_name(f"{target.stem}_{k:04d}.vtu")
        data = {name: _in_space(values) for name, values in fields.items()}
        meshio.Mesh(points, cells, point_data=data).write(file)
        lines.append(f'    <DataSet timestep="{float(time)!r}" file="{escape(file.name)}"/>')
        written.append(file)
    target.write_text("\n".join([*lines, "  </Collection>", "</VTKFile>", ""]), encoding="utf-8")
    return written


def _frames(
    mesh: Mesh, given: Instants | ModeShape, frames: int, scale: float | None
) -> tuple[Sequence[float], list[dict[str, Any]]]:
    """Return times and fields over the points, one dictionary per file."""
    if isinstance(given, ModeShape):
        return _moving(mesh, given, frames, scale)
    fields = [{"displacement": mesh.displacements(one)} for one in given.position]
    if given.velocity is not None:
        for of, one in zip(fields, given.velocity, strict=True):
            of["velocity"] = mesh.displacements(one)
    times = [0.0] * len(fields) if given.times is None else given.times.tolist()
    return times, fields


def _moving(
    mesh: Mesh, shape: ModeShape, frames: int, scale: float | None
) -> tuple[Sequence[float], list[dict[str, Any]]]:
    """Return a period of a mode: times, s (of a shape alone: parts of the period), and its frames."""
    count = whole_number("frames", frames, 2)
    moved = mesh.displacements(shape.values)
    length = np.sqrt((np.abs(moved) ** 2).sum(axis=-1))
    if not length.max() > 0.0:
        raise InputError("displacements: the shape of the mode is zero at all points")
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    factor = SHOWN * size / length.max() if scale is None else real_number("scale", scale)
    parts = np.arange(count) / count
    rate = 0.0 if shape.eigenvalue is None else abs(shape.eigenvalue.imag)
    period = 2.0 * np.pi / rate if rate > 0.0 else 1.0
    fields = []
    for part in parts:
        now = (factor * moved * np.exp(2j * np.pi * part)).real
        fields.append({"displacement": now, "amplitude": factor * length})
    return [float(period * part) for part in parts], fields


def _in_space(values: Any) -> Any:
    """Return vectors of the plane as vectors of space: VTK knows no others."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    return values
