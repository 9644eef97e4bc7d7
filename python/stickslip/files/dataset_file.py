"""Datasets in files: netCDF and zarr, which are read back whole, and CSV tables.

NetCDF files are of version 4, by h5netcdf. A zarr folder is of format 3: format 2 knows filters that run code
of the folder. A file appears when it is complete: it is written under another name first and then renamed.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from numbers import Number
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from stickslip.faults import InputError
from stickslip.files.dataset_text import csv_text
from stickslip.scene.checks import FORMAT_KEY, FORMAT_VERSION, check_format_version, file_path, package
from stickslip.show.replaced_file import draft_of, replace_file

if TYPE_CHECKING:
    import xarray as xr

#: What to do about a file of a kind that is not read or written, by its suffix.
REMEDIES = {
    ".csv": "pandas.read_csv reads a table; a .nc or .zarr file is read back whole",
    ".json": "write .nc or .zarr; --json prints JSON for other programs",
}


class Labelled(Protocol):
    """A result with labelled numbers."""

    def to_dataset(self) -> xr.Dataset:
        """Return the numbers of the result."""


def write_dataset(
    dataset: xr.Dataset | xr.DataArray | Labelled, path: str | Path, rows: Sequence[str] | None = None
) -> None:
    """Write labelled numbers as `.nc` or `.zarr`, which `read_dataset` reads, or as a `.csv` table.

    A file that exists is replaced once the new one is complete; an error leaves it as it was. `rows` are the
    dimensions of the rows of a table, see `csv_text`.
    """
    file = _file(path, (".nc", ".zarr", ".csv"))
    labelled = _labelled(dataset)
    if file.suffix == ".csv":
        replace_file(file, csv_text(labelled, rows).encode())
        return
    # Both formats keep variables in a tree of folders.
    slashed = next((name for name in labelled.variables if "/" in str(name)), None)
    if slashed is not None:
        raise InputError(f"dataset: {slashed}: expected a name without / for a file {file.suffix}")
    whole = labelled.drop_encoding().assign_attrs({FORMAT_KEY: FORMAT_VERSION})
    if file.suffix == ".nc":
        replace_file(file, lambda draft: whole.to_netcdf(draft, engine="h5netcdf"))
    else:
        _write_zarr(whole, file)


def read_dataset(path: str | Path) -> xr.Dataset:
    """Return a dataset that `write_dataset` wrote as `.nc` or `.zarr`."""
    import xarray as xr

    file = _file(path, (".nc", ".zarr"))
    if not file.exists():
        raise InputError(f"no such file: {file}")
    if not (file.is_file() or file.is_dir()):
        raise InputError(f"{file}: expected a regular file")
    if file.suffix == ".zarr":
        package("zarr", file.name)
    # A broken file makes its reader fail in any way.
    try:
        if file.suffix == ".nc":
            found = xr.load_dataset(file, engine="h5netcdf")
        else:
            from stickslip.study.run.zarr_folder import check_zarr

            check_zarr(file)
            found = xr.open_zarr(file, chunks=None, consolidated=False, zarr_format=3).load()
        check_format_version(found.attrs.pop(FORMAT_KEY, None))
        texts = {
            name: variable.astype(object).astype(np.str_)
            for name, variable in found.variables.items()
            if is_text(variable)
        }
        return found.assign(texts).drop_encoding()
    except Exception as error:
        raise InputError(f"{file}: not readable: {error}") from error


def _file(path: str | Path, suffixes: Sequence[str]) -> Path:
    file = file_path(path)
    if file.suffix not in suffixes:
        remedy = f"; {REMEDIES[file.suffix]}" if file.suffix in REMEDIES else ""
        raise InputError(f"{file.name}: expected a file {', '.join(suffixes)}{remedy}")
    return file


def is_text(variable: Any) -> bool:
    """Return whether a variable holds texts."""
    kind = variable.dtype.kind
    return kind in "UT" or (kind == "O" and all(isinstance(entry, str) for entry in variable.to_numpy().flat))


def _write_zarr(dataset: xr.Dataset, path: Path) -> None:
    from stickslip.study.run.zarr_folder import is_store

    package("zarr", path.name)
    folder = Path(os.path.realpath(path))
    if folder.exists() and (not (folder / "zarr.json").is_file() or is_store(folder)):
        raise InputError(f"{path}: expected a new folder or a dataset to replace, it holds something else")
    with draft_of(folder) as draft, draft_of(folder) as replaced:
        texts = {
            name: variable.astype(object) for name, variable in dataset.variables.items() if is_text(variable)
        }
        dataset.assign(texts).to_zarr(draft, mode="w-", zarr_format=3, consolidated=False)
        if folder.exists():
            shutil.copymode(folder, draft)
            folder.rename(replaced)
        try:
            draft.rename(folder)
        except BaseException:
            if replaced.exists():
                replaced.rename(folder)
            raise


def _labelled(value: Any) -> xr.Dataset:
    """Return a dataset of numbers, truth values and texts."""
    import xarray as xr

    if isinstance(value, xr.DataArray):
        value = value.to_dataset(name="value" if value.name is None else value.name)
    elif not isinstance(value, xr.Dataset):
        convert = getattr(value, "to_dataset", None)
        value = convert() if callable(convert) else value
    if not isinstance(value, xr.Dataset):
        got = type(value).__name__
        raise InputError(f"dataset: expected a Dataset, a DataArray or a result with to_dataset(), got {got}")
    plain = value.copy()
    plain.attrs = _attributes("", value.attrs)
    for name, variable in value.variables.items():
        kind = variable.dtype.kind
        if kind not in "biufcUTO" or (kind == "O" and not is_text(variable)):
            expected = "numbers, truth values or texts"
            raise InputError(f"dataset: {name}: expected {expected}, got {variable.dtype}")
        plain[name].attrs = _attributes(f"{name}.", variable.attrs)
    return plain


def _attributes(holder: str, attrs: dict[Any, Any]) -> dict[Any, Any]:
    """Return attributes without truth values and texts of numpy, which netCDF does not have."""
    found = {}
    for name, entry in attrs.items():
        array = np.asarray(entry) if isinstance(entry, str | Number | np.generic | list | tuple) else entry
        if not isinstance(array, np.ndarray) or array.dtype.kind not in "biufU":
            got = type(entry).__name__
            raise InputError(f"dataset: attribute {holder}{name}: expected numbers or texts, got {got}")
        kind = array.dtype.kind
        found[name] = array.astype(np.int8)[()] if kind == "b" else array.tolist() if kind == "U" else entry
    return found
