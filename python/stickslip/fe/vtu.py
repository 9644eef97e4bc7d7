"""Displacements on the mesh as VTK files: motions, and complex modes as they move."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import xarray as xr

from stickslip.faults import InputError
from stickslip.modes.modes import Modes
from stickslip.scene.checks import described, package, real_number, whole_number
from stickslip.scene.scene import Scene, checked
from stickslip.scene.state import State
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
    mesh = checked(scene).mesh
    if mesh is None:
        raise InputError("scene: it has no points; make it by stickslip.fe.assemble of bodies with points")
    times, frames_of = _frames(scene, mesh, displacements, mode, frames, scale)
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
    scene: Scene, mesh: Mesh, given: Any, mode: int, frames: int, scale: float | None
) -> tuple[Sequence[float], list[dict[str, Any]]]:
    """Return times and fields over the points, one dictionary per file."""
    if isinstance(given, Modes):
        given = given.to_dataset()
    if isinstance(given, xr.Dataset) and "position" in given:
        positions = _fitting(scene, given.position.transpose(..., "dof").to_numpy())
        positions = positions.reshape(-1, scene.size)
        fields = [{"displacement": mesh.displacements(one)} for one in positions]
        if "velocity" in given:
            speeds = given.velocity.transpose(..., "dof").to_numpy().reshape(-1, scene.size)
            for of, one in zip(fields, speeds, strict=True):
                of["velocity"] = mesh.displacements(one)
        times = np.atleast_1d(given.time.to_numpy()) if "time" in given.coords else np.zeros(len(fields))
        return [float(time) for time in times], fields
    if isinstance(given, State):
        moved = {
            "displacement": mesh.displacements(_fitting(scene, given.position)),
            "velocity": mesh.displacements(given.velocity),
        }
        return [0.0], [moved]
    if isinstance(given, xr.Dataset) and "shape" in given:
        count = given.sizes.get("mode", 1)
        number = whole_number("mode", mode, 0)
        if number >= count:
            raise InputError(f"mode: expected a mode in 0..{count - 1}, got {mode}")
        shape = given["shape"].isel(mode=number) if "mode" in given["shape"].dims else given["shape"]
        value = given.eigenvalue.isel(mode=number) if "mode" in given.eigenvalue.dims else given.eigenvalue
        return _moving(scene, mesh, shape.to_numpy(), abs(complex(value.item()).imag), frames, scale)
    try:
        array = np.asarray(given)
    except ValueError:
        array = np.zeros(0)
    if array.dtype.kind == "c" and array.ndim == 1:
        return _moving(scene, mesh, array, 0.0, frames, scale)
    if array.dtype.kind in "iuf" and array.ndim == 1:
        return [0.0], [{"displacement": mesh.displacements(_fitting(scene, array.astype(float)))}]
    raise InputError(
        "displacements: expected what sample, expand or complex_modes return, a State, or a vector, got "
        f"{described(given)}"
    )


def _moving(
    scene: Scene, mesh: Mesh, shape: Any, rate: float, frames: int, scale: float | None
) -> tuple[Sequence[float], list[dict[str, Any]]]:
    """Return a period of a mode: times, s (of a shape alone: parts of the period), and its frames."""
    count = whole_number("frames", frames, 2)
    moved = mesh.displacements(_fitting(scene, shape))
    length = np.sqrt((np.abs(moved) ** 2).sum(axis=-1))
    if not length.max() > 0.0:
        raise InputError("displacements: the shape of the mode is zero at all points")
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    factor = SHOWN * size / length.max() if scale is None else real_number("scale", scale)
    parts = np.arange(count) / count
    period = 2.0 * np.pi / rate if rate > 0.0 else 1.0
    fields = []
    for part in parts:
        now = (factor * moved * np.exp(2j * np.pi * part)).real
        fields.append({"displacement": now, "amplitude": factor * length})
    return [float(period * part) for part in parts], fields


def _fitting(scene: Scene, values: Any) -> Any:
    if values.shape[-1] != scene.size:
        raise InputError(
            f"displacements: expected {scene.size} dofs of the scene, got shape {values.shape}; "
            "those of a reduced scene go through expand first"
        )
    if not np.isfinite(values).all():
        raise InputError("displacements: must be finite")
    return values


def _in_space(values: Any) -> Any:
    """Return vectors of the plane as vectors of space: VTK knows no others."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    return values
