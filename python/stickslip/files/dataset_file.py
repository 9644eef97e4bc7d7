"""Datasets in files: netCDF, JSON, CSV, zarr.

The first three do not know complex numbers, so a complex variable ``z`` becomes ``z_real`` and ``z_imag``,
whose attribute ``complex`` names z; `read_dataset` joins them again. NetCDF files are of version 3 (64-bit
offset), which everything reads. JSON has the layout of ``xarray.Dataset.to_dict``, nan as null and infinity
as a text. A zarr folder is of format 3: format 2 knows filters that run code of the folder.

A file appears when it is complete: it is written under another name first and then renamed.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping, Sequence
from numbers import Number
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from stickslip.faults import InputError
from stickslip.files.csv_dataset import csv_head, csv_text, from_csv
from stickslip.files.plain_dataset import is_text, join_complex, plain, split_complex
from stickslip.scene.checks import file_path, package
from stickslip.show.replaced_file import draft_of, replace_file

if TYPE_CHECKING:
    import xarray as xr

SUFFIXES = (".nc", ".json", ".csv", ".zarr")
#: Attribute of a netCDF variable without entries: the lengths of its dimensions.
SIZES = "sizes_of_empty"


class Labelled(Protocol):
    """A result with labelled numbers."""

    def to_dataset(self) -> xr.Dataset:
        """Return the numbers of the result."""


def write_dataset(
    dataset: xr.Dataset | xr.DataArray | Labelled, path: str | Path, rows: Sequence[str] | None = None
) -> None:
    """Write labelled numbers as `.nc`, `.json`, `.csv` or `.zarr`, which `read_dataset` reads.

    A file that exists is replaced once the new one is complete; an error leaves it as it was.

    Parameters
    ----------
    dataset
        A dataset or array of numbers, truth values and texts, or a result with a method `to_dataset`.
    path
        The file; its suffix says what it is. `.zarr` is a folder and needs zarr (``stickslip[study]``).
    rows
        Dimensions of the rows of a CSV table; None: the first dimension.

    Raises
    ------
    InputError
        If the suffix is another, a dimension of `rows` is unknown, a variable or an attribute holds something
        else than numbers, truth values and texts, zarr is missing, or the folder holds something else.
    OSError
        If the file cannot be written.
    """
    file = file_path(path)
    if file.suffix not in SUFFIXES:
        raise InputError(f"{file.name}: expected a file {', '.join(SUFFIXES)}")
    labelled = _labelled(dataset)
    # Both formats keep variables in a tree of folders.
    slashed = next((name for name in labelled.variables if "/" in str(name)), None)
    if slashed is not None and file.suffix in (".nc", ".zarr"):
        raise InputError(f"dataset: {slashed}: expected a name without / for a file {file.suffix}")
    if file.suffix == ".nc":
        replace_file(file, _netcdf(labelled))
    elif file.suffix == ".json":
        replace_file(file, json_text(labelled).encode())
    elif file.suffix == ".csv":
        replace_file(file, (csv_head(labelled, rows) + csv_text(labelled, rows)).encode())
    else:
        _write_zarr(labelled, file)


def read_dataset(path: str | Path) -> xr.Dataset:
    """Return a dataset that `write_dataset` wrote as `.nc`, `.json`, `.csv` or `.zarr`.

    Raises
    ------
    InputError
        If the suffix is another, the file is none that can be read, or zarr is missing.
    """
    import xarray as xr

    file = file_path(path)
    if file.suffix not in SUFFIXES:
        raise InputError(f"{file.name}: expected a file {', '.join(SUFFIXES)}")
    if not file.exists():
        raise InputError(f"no such file: {file}")
    if not (file.is_file() or file.is_dir()):
        raise InputError(f"{file}: expected a regular file")
    if file.suffix == ".zarr":
        package("zarr", file.name)
    # A broken file makes its reader fail in any way.
    try:
        if file.suffix == ".nc":
            return join_complex(_with_empty(_native(xr.load_dataset(file, engine="scipy"))))
        if file.suffix == ".zarr":
            from stickslip.study.run.zarr_folder import check_zarr

            check_zarr(file)
            return _native(xr.open_zarr(file, chunks=None, consolidated=False, zarr_format=3).load())
        if file.suffix == ".csv":
            return join_complex(from_csv(file.read_text(encoding="utf-8")))
        record = json.loads(file.read_text(encoding="utf-8"))
        for kind in ("coords", "data_vars"):
            for variable in record[kind].values():
                sizes = [record["dims"][dim] for dim in variable["dims"]]
                variable["data"] = _numbers(variable["data"], variable.pop("dtype")).reshape(sizes)
        return join_complex(xr.Dataset.from_dict(record))
    except Exception as error:
        raise InputError(f"{file}: not readable: {error}") from error


def _netcdf(dataset: xr.Dataset) -> bytes | memoryview:
    # Without a path xarray returns what it would write.
    single = _without_empty(split_complex(dataset))
    content: bytes | memoryview = single.to_netcdf(engine="scipy", format="NETCDF3_64BIT")
    return content


def _without_empty(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset whose variables without entries are one entry each, with their sizes as attribute.

    In netCDF a dimension of length 0 is the one that has no limit, and must come first.
    """
    empty = {
        name: (
            (),
            " " if is_text(variable) else np.zeros((), variable.dtype)[()],
            variable.attrs | {SIZES: json.dumps(dict(variable.sizes))},
        )
        for name, variable in dataset.variables.items()
        if variable.size == 0
    }
    return _replaced(dataset, empty)


def _with_empty(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset of which `_without_empty` made this one."""
    empty = {}
    for name, variable in dataset.variables.items():
        attrs = dict(variable.attrs)
        if (text := attrs.pop(SIZES, None)) is not None:
            sizes = json.loads(text)
            kind = np.str_ if is_text(variable) else variable.dtype
            empty[name] = (tuple(sizes), np.empty(tuple(sizes.values()), kind), attrs)
    return _replaced(dataset, empty)


def _replaced(dataset: xr.Dataset, variables: Mapping[Any, Any]) -> xr.Dataset:
    """Return a dataset with other variables of these names; coordinates stay coordinates."""
    coordinates = {name: variable for name, variable in variables.items() if name in dataset.coords}
    data = {name: variable for name, variable in variables.items() if name not in coordinates}
    return dataset.drop_vars(variables).assign_coords(coordinates).assign(data)


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
        dataset.drop_encoding().assign(texts).to_zarr(draft, mode="w-", zarr_format=3, consolidated=False)
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
    holders = {"": value.attrs} | {f"{name}.": variable.attrs for name, variable in value.variables.items()}
    for holder, attrs in holders.items():
        for name, entry in attrs.items():
            if not _is_plain(entry):
                got = type(entry).__name__
                raise InputError(f"dataset: attribute {holder}{name}: expected numbers or texts, got {got}")
    for name, variable in value.variables.items():
        kind = variable.dtype.kind
        if kind not in "biufcUTO" or (kind == "O" and not is_text(variable)):
            expected = "numbers, truth values or texts"
            raise InputError(f"dataset: {name}: expected {expected}, got {variable.dtype}")
    return value


def _is_plain(entry: Any) -> bool:
    if isinstance(entry, np.ndarray):
        return entry.dtype.kind in "biufU"
    if isinstance(entry, list | tuple):
        return all(map(_is_plain, entry))
    return isinstance(entry, str | Number | np.bool_) and not isinstance(entry, complex)


def _native(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset with numpy's texts and whole numbers of 64 bits, whatever a format makes of them."""
    changed = {}
    for name, variable in dataset.variables.items():
        if is_text(variable):
            changed[name] = variable.astype(object).astype(np.str_)
        elif variable.dtype.kind == "i":
            changed[name] = variable.astype(np.int64)
    return dataset.assign(changed).drop_encoding()


def json_text(dataset: xr.Dataset) -> str:
    """Return a dataset as JSON: attrs, dims, coords, data_vars."""
    record = split_complex(dataset).to_dict()
    for kind in ("coords", "data_vars"):
        for name, variable in record[kind].items():
            variable["dtype"] = _kind(dataset, name)
    return json.dumps(plain(record), indent=1, allow_nan=False) + "\n"


def _kind(dataset: xr.Dataset, name: str) -> str:
    kind = dataset[name].dtype.kind if name in dataset.variables else "f"
    return {"b": "bool", "i": "int", "u": "int", "U": "str", "O": "str", "T": "str"}.get(kind, "float")


def _numbers(data: Any, kind: str) -> Any:
    if kind == "float":
        # None becomes nan.
        return np.array(data, dtype=float)
    return np.array(data, dtype={"bool": bool, "int": np.int64, "str": np.str_}[kind])
