"""Anything in a file: scenes and cases, results with labelled numbers, figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.faults import InputError
from stickslip.files.case import Case, load_case, save_case
from stickslip.files.dataset_file import REMEDIES, Labelled, read_dataset, write_dataset
from stickslip.files.result_file import kept, restored
from stickslip.files.scene_file import Matrices
from stickslip.scene.checks import described, file_path, real_number
from stickslip.scene.scene import Scene

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.scene.drawing.view import View

#: Width of the largest figure, m.
LARGEST = 10.0


def save(
    what: Scene | Case | Labelled | xr.Dataset | xr.DataArray | Figure | Axes | View,
    path: str | Path,
    *,
    matrices: Matrices | None = None,
    rows: Sequence[str] | None = None,
    dpi: int | None = None,
    width: float | None = None,
) -> None:
    """Write a scene, a case, a result or a figure; `load` reads back all but figures.

    A file that exists is replaced once the new one is complete; an error leaves it as it was.

    Parameters
    ----------
    what
        A `Scene`, or a `Case`, which is a scene with a start, settings of a run and parameter values: written
        as TOML. A scene that a function of `stickslip.models` made is written as that model and its
        arguments, also after `replace` of what the model takes; any other scene, or with `matrices`, by its
        matrices.

        A dataset or array of xarray, or a result with a method `to_dataset`: written in the form that the
        suffix names. Numbers, truth values and texts can be written.

        A figure, or axes of matplotlib, which stand for their whole figure: written in the form that the
        suffix names; the same figure gives the same bytes. If the figure has several panels, they bear
        letters. Axes have units that suit what they show. If the figure has no layout engine and its border
        would cut a legend or label, the layout becomes "constrained".

        A 3D view of a mesh, ``scene.plot.view(...)``: a picture is written as ``.png``, a film as ``.gif`` or
        ``.mp4``.
    path
        The file: for a scene or a case ``.toml``; for a result ``.nc``, ``.zarr``, which is a folder and
        needs zarr (``stickslip[study]``), or a table ``.csv``, which `load` does not read back; for a figure
        ``.pdf``, ``.svg``, ``.png`` or ``.eps``.
    matrices
        Of a scene or case, where matrices and vectors go: ``inline``, into the file itself; ``npz``, ``mat``
        or ``mtx``, into files beside it, ``<name of the file>.<argument>.<suffix>``; ``auto``, into ``npz``
        where they are large. None: ``auto``.
    rows
        Of a CSV table, the dimensions of its rows; None: the first dimension. What has more dimensions gets a
        column per label, what has none of them is left out, and complex numbers have two columns.
    dpi
        Of a figure, pixels per inch of a ``.png``, and of the parts that other forms hold as pixels; None:
        300.
    width
        Of a figure, its width on paper, m, such as 0.085 for a column of a journal; None: as it was drawn.
        Height, text and lines change in the same ratio, text not below 6 points.

    Raises
    ------
    InputError
        If `what` is none of these, an option does not concern it, `matrices` is none of these words, the
        suffix is another, a dimension of `rows` is unknown, a model is a function that a file cannot name,
        zarr is missing, or the folder holds something else.
    OSError
        If the file cannot be written.
    """
    options = {"matrices": matrices, "rows": rows, "dpi": dpi, "width": width}
    if isinstance(what, Scene | Case):
        _refuse(options, what, "matrices")
        save_case(what, path, "auto" if matrices is None else matrices)
        return
    if hasattr(what, "to_dataset") or hasattr(what, "data_vars"):
        _refuse(options, what, "rows")
        whole = hasattr(what, "to_dataset") and file_path(path).suffix != ".csv"
        write_dataset(kept(what) if whole else what, path, rows)
        return
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.scene.drawing.view import View, save_view

    if isinstance(what, View):
        _refuse(options, what)
        save_view(what, path)
        return
    if not isinstance(what, Figure | Axes):
        expected = "a Scene, a Case, a result with to_dataset, an xarray dataset or array, a figure or axes"
        raise InputError(f"what: expected {expected}, got {described(what)}")
    from stickslip.show import style

    _refuse(options, what, "dpi", "width")
    if width is not None and not 0.0 < (width := real_number("width", width)) < LARGEST:
        raise InputError(f"width: must be positive and below {LARGEST:g} m, got {width!r}")
    style.save(what, path, style.DPI if dpi is None else dpi, width=width)


def load(path: str | Path) -> Any:
    """Return what a file holds that `save` wrote.

    Parameters
    ----------
    path
        A scene file, ``.toml``, or a dataset, ``.nc`` or ``.zarr``.

    Returns
    -------
    Case, CriticalPoints, Bifurcation, Branch, Basins, BasinBoundary or xarray.Dataset
        Of a scene file a `Case`, whose ``scene`` is the `Scene`, with start, settings of a run and parameter
        values where the file has them. Critical points, bifurcations, branches, basins and their boundaries
        are read back whole, with their orbits. Of any other result its dataset.

    Raises
    ------
    InputError
        If the suffix is another, there is no such file, or anything in it is ill-posed: the message names the
        file, and in a scene file key and value.
    """
    file = file_path(path)
    if file.suffix in (".nc", ".zarr", *REMEDIES):
        return restored(file, read_dataset(file))
    if file.suffix == ".toml" or file.is_dir():
        return load_case(file)
    raise InputError(f"{file.name}: expected a file .toml, .nc, .zarr")


def _refuse(options: dict[str, Any], what: Any, *allowed: str) -> None:
    for name, value in options.items():
        if name not in allowed and value is not None:
            raise InputError(f"{name}: does not concern {type(what).__name__}, got {value!r}")
