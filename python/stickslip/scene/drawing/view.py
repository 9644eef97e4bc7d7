"""A mesh in space, displaced and coloured by pyvista: a picture of one instant, a film of several."""

from __future__ import annotations

import base64
import io
import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Real, file_path, finite, package, whole_number
from stickslip.scene.drawing.displacements import ModeShape, displacements_of, mesh_of
from stickslip.scene.drawing.schematic import PART, Structured
from stickslip.show.mesh import Mesh
from stickslip.show.replaced_file import replace_file

#: Pictures per second of a film, and the size of a picture, pixels: multiples of 16, as codecs want them.
RATE, SIZE = 24, (1024, 768)
#: Cells that VTK draws, by meshio's name of their kind: the name that pyvista gives them.
CELLS = {
    "vertex": "VERTEX",
    "line": "LINE",
    "line3": "QUADRATIC_EDGE",
    "triangle": "TRIANGLE",
    "triangle6": "QUADRATIC_TRIANGLE",
    "quad": "QUAD",
    "quad8": "QUADRATIC_QUAD",
    "quad9": "BIQUADRATIC_QUAD",
    "tetra": "TETRA",
    "tetra10": "QUADRATIC_TETRA",
    "hexahedron": "HEXAHEDRON",
    "hexahedron20": "QUADRATIC_HEXAHEDRON",
    "wedge": "WEDGE",
    "wedge15": "QUADRATIC_WEDGE",
    "pyramid": "PYRAMID",
    "pyramid13": "QUADRATIC_PYRAMID",
}


@dataclass(frozen=True, eq=False, repr=False)
class View:
    """A displaced mesh in space: a picture of one instant, a film of several; made by ``scene.plot.view()``.

    A notebook shows it. `save` writes a picture as ``.png``, a film of 24 instants per second as ``.gif`` or
    ``.mp4``. Neither needs a screen.

    Attributes
    ----------
    mesh
        Points at rest, m, and cells.
    position
        Displacements of the dofs at k instants, (k, n), m; of a mode those of its shape.
    scale
        Factor by which displacements are drawn larger than they are.
    largest
        Where the colours end, m: the largest displacement of a point over all instants; of a mode the largest
        amplitude, the root of the sum of ``|u|^2`` over the directions, whatever the phase.
    titles
        What stands above the mesh at each instant, (k,).
    quantity
        What the colours are, with its unit.
    """

    mesh: Mesh
    position: Real
    scale: float
    largest: float
    titles: tuple[str, ...]
    quantity: str

    def __len__(self) -> int:
        return len(self.position)

    def __repr__(self) -> str:
        kind = "picture" if len(self) == 1 else f"film of {len(self)} instants"
        return f"View({kind}, {len(self.mesh.points)} points, scale {self.scale:.4g})"

    def grid(self, instant: int = 0) -> Any:
        """Return the displaced mesh of an instant as a ``pyvista.UnstructuredGrid``.

        Its points are displaced by `scale`; the point data are ``displacement``, (p, 3), as it is, and
        ``size``, its length, (p,), m. Meshes of the plane lie at z = 0.

        Raises
        ------
        InputError
            If there is no such instant.
        """
        pyvista = package("pyvista", "view", "pyvista")
        points, moved = self._moved(instant)
        cells = {getattr(pyvista.CellType, CELLS[kind]): nodes for kind, nodes in self.mesh.cells.items()}
        if not cells:
            cells = {pyvista.CellType.VERTEX: np.arange(len(points))[:, None]}
        grid = pyvista.UnstructuredGrid(cells, points)
        grid.point_data["displacement"], grid.point_data["size"] = moved, np.linalg.norm(moved, axis=1)
        return grid

    def plotter(self, instant: int = 0, **options: Any) -> Any:
        """Return a ``pyvista.Plotter`` of an instant, for a window of one's own, another camera, other files.

        Parameters
        ----------
        instant
            Which of the k instants, from 0 on.
        **options
            Options of ``pyvista.Plotter``, such as ``window_size`` or ``off_screen``.

        Raises
        ------
        InputError
            If there is no such instant.
        """
        return self._drawn(self.grid(instant), self.titles[instant], options)

    def _drawn(self, grid: Any, title: str, options: dict[str, Any]) -> Any:
        plotter = package("pyvista", "view", "pyvista").Plotter(**{"window_size": SIZE, **options})
        plotter.add_mesh(
            grid,
            scalars="size",
            clim=(0.0, self.largest or 1.0),
            cmap="viridis",
            lighting=self.mesh.points.shape[1] == 3,
            show_edges=bool(self.mesh.cells),
            edge_opacity=0.3,
            point_size=8.0,
            scalar_bar_args={"title": f"{self.quantity}\n", "fmt": "%.3g"},
        )
        plotter.add_text(title, name="title", font_size=10)
        if self.mesh.points.shape[1] == 2:
            plotter.enable_parallel_projection()
            plotter.view_xy()
        else:
            plotter.view_isometric()
        # The camera stays while the mesh moves.
        rest, reach = _in_space(self.mesh.points), abs(self.scale) * self.largest
        ends = np.column_stack([rest.min(axis=0) - reach, rest.max(axis=0) + reach])
        plotter.reset_camera(bounds=tuple(ends.ravel().tolist()))
        return plotter

    def _moved(self, instant: int) -> tuple[Real, Real]:
        """Return displaced points and displacements, (p, 3) each, m."""
        if whole_number("instant", instant, 0) >= len(self):
            raise InputError(f"instant: expected one in 0..{len(self) - 1}, got {instant}")
        moved = _in_space(self.mesh.displacements(self.position[instant]))
        return _in_space(self.mesh.points) + self.scale * moved, moved

    def _content(self, suffix: str) -> bytes:
        """Return the bytes of a file ``.png``, ``.gif`` or ``.mp4``."""
        if suffix != ".png":
            package("imageio", "view", "pyvista")
        if suffix == ".mp4":
            package("imageio_ffmpeg", "view", "pyvista")
        grid, options = self.grid(0), {"off_screen": True, "notebook": False}
        with closing(self._drawn(grid, self.titles[0], options)) as plotter:
            if suffix == ".png":
                return _png(plotter.screenshot(return_img=True))
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / f"film{suffix}"
                if suffix == ".gif":
                    plotter.open_gif(str(file), fps=RATE)
                else:
                    plotter.open_movie(str(file), framerate=RATE)
                for instant, title in enumerate(self.titles):
                    points, moved = self._moved(instant)
                    grid.points = points
                    grid.point_data["size"] = np.linalg.norm(moved, axis=1)
                    plotter.add_text(title, name="title", font_size=10)
                    plotter.write_frame()
                plotter.close()
                return file.read_bytes()

    def _repr_png_(self) -> bytes | None:
        return self._content(".png") if len(self) == 1 else None

    def _repr_html_(self) -> str | None:
        if len(self) == 1:
            return None
        film = base64.b64encode(self._content(".gif"))
        return f'<img src="data:image/gif;base64,{film.decode()}">'


def view_of(
    scene: Structured,
    displacements: Any,
    mode: int | None,
    phase: float,
    frames: int | None,
    scale: float | None,
) -> View:
    """Return the view of displacements on the mesh of a scene; see `ScenePlots.view`."""
    package("pyvista", "view", "pyvista")
    mesh = mesh_of(scene)
    if unknown := sorted(set(mesh.cells) - set(CELLS)):
        raise InputError(f"scene: its mesh has cells {unknown[0]!r}, expected some of {', '.join(CELLS)}")
    moved = displacements_of(displacements, scene.dofs, mode)
    start = finite("phase", phase)
    count = None if frames is None else whole_number("frames", frames, 2)
    if isinstance(moved, ModeShape):
        if mode is not None and moved.number is None:
            raise InputError(f"mode: the displacements are one shape without a number, got {mode!r}")
        turns = np.exp(1j * (start + 2.0 * np.pi * np.arange(count or 1) / (count or 1)))
        position = (turns[:, None] * moved.values).real
        extent: Any = moved.values
        titles, quantity = [_mode_title(moved)] * len(turns), "displacement in the shape"
    else:
        for name, value in (("mode", mode), ("frames", frames), ("phase", phase or None)):
            if value is not None:
                raise InputError(f"{name}: displacements that are no complex mode have none, got {value!r}")
        extent = position = moved.position
        if not len(position):
            raise InputError("displacements: expected at least one instant, got none")
        times = [None] * len(position) if moved.times is None else moved.times.tolist()
        titles, quantity = ["" if time is None else f"t = {time:.6g} s" for time in times], "displacement, m"
    length = np.sqrt((np.abs(mesh.displacements(extent)) ** 2).sum(axis=-1))
    largest = float(length.max())
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    factor = PART * size / (largest or 1.0) if scale is None else finite("scale", scale)
    return View(mesh, position, factor, largest, tuple(titles), quantity)


def save_view(view: View, path: str | Path) -> None:
    """Write a picture as ``.png``, a film as ``.gif`` or ``.mp4``; a file is replaced once it is drawn."""
    file = file_path(path)
    forms, what = ((".png",), "a picture") if len(view) == 1 else ((".gif", ".mp4"), "a film")
    if file.suffix.lower() not in forms:
        raise InputError(f"path: expected {' or '.join(forms)} for {what}, got {str(path)!r}")
    replace_file(file, view._content(file.suffix.lower()))


def _mode_title(shape: ModeShape) -> str:
    if shape.eigenvalue is None:
        return ""
    return f"mode {shape.number}: {abs(shape.eigenvalue) / (2.0 * np.pi):.2f} Hz"


def _in_space(values: Real) -> Real:
    """Return vectors (p, 2) or (p, 3) as vectors of space: VTK knows no others."""
    return values if values.shape[1] == 3 else np.column_stack([values, np.zeros(len(values))])


def _png(pixels: Any) -> bytes:
    from matplotlib.image import imsave

    file = io.BytesIO()
    imsave(file, pixels, format="png")
    return file.getvalue()
