"""Datasets in files: netCDF, JSON, CSV, zarr.

The first three do not know complex numbers, so a complex variable ``z`` becomes ``z_real`` and ``z_imag``,
whose attribute ``complex`` names z; `read_dataset` joins them again. NetCDF files are of version 3 (64-bit
offset), which everything reads. JSON has the layout of ``xarray.Dataset.to_dict``, nan as null and infinity
as a text. A zarr folder is of format 3.

CSV is one table below a head of lines that begin with ``#``, which other programs skip (``comment="#"`` of
pandas). In the table, what has more dimensions than its rows gets a column per label. The head says what a
table cannot: one line of JSON for the dataset and one for each variable, with dimensions, type and units,
and the numbers of what has none of the dimensions of the rows.

A file appears when it is complete: it is written under another name first and then renamed.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import StringIO
from numbers import Number
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import package

if TYPE_CHECKING:
    import xarray as xr

SUFFIXES = (".nc", ".json", ".csv", ".zarr")


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
    file = Path(path)
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
        replace_file(file, (_csv_head(labelled, rows) + csv_text(labelled, rows)).encode())
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

    file = Path(path)
    if file.suffix not in SUFFIXES:
        raise InputError(f"{file.name}: expected a file {', '.join(SUFFIXES)}")
    if not file.exists():
        raise InputError(f"no such file: {file}")
    if file.suffix == ".zarr":
        package("zarr", file.name)
    # A broken file makes its reader fail in any way.
    try:
        if file.suffix == ".nc":
            return join_complex(_native(xr.load_dataset(file, engine="scipy")))
        if file.suffix == ".zarr":
            return _native(xr.open_zarr(file, chunks=None, consolidated=False).load())
        if file.suffix == ".csv":
            return join_complex(_from_csv(file.read_text(encoding="utf-8")))
        record = json.loads(file.read_text(encoding="utf-8"))
        for kind in ("coords", "data_vars"):
            for variable in record[kind].values():
                variable["data"] = _numbers(variable["data"], variable.pop("dtype"))
        return join_complex(xr.Dataset.from_dict(record))
    except Exception as error:
        raise InputError(f"{file}: not readable: {error}") from error


def replace_file(path: str | Path, content: bytes | memoryview) -> None:
    """Write a file under another name beside it and then rename it; a device or pipe is written to."""
    file = Path(os.path.realpath(path))
    if file.exists() and not file.is_file():
        file.write_bytes(content)
        return
    with _draft(file) as draft:
        draft.write_bytes(content)
        draft.replace(file)


@contextmanager
def _draft(path: Path) -> Iterator[Path]:
    """Give a name beside a path; what is there at the end is removed."""
    draft = path.with_name(f"{path.name}.{uuid.uuid4().hex}.partial")
    try:
        yield draft
    finally:
        if draft.is_dir():
            shutil.rmtree(draft, ignore_errors=True)
        else:
            draft.unlink(missing_ok=True)


def _netcdf(dataset: xr.Dataset) -> bytes | memoryview:
    # Without a path xarray returns what it would write.
    content: bytes | memoryview = split_complex(dataset).to_netcdf(engine="scipy", format="NETCDF3_64BIT")
    return content


def _write_zarr(dataset: xr.Dataset, path: Path) -> None:
    package("zarr", path.name)
    folder = Path(os.path.realpath(path))
    if folder.exists() and (not (folder / "zarr.json").is_file() or (folder / "complete").exists()):
        raise InputError(f"{path}: expected a new folder or a dataset to replace, it holds something else")
    with _draft(folder) as draft, _draft(folder) as replaced:
        texts = {
            name: variable.astype(object)
            for name, variable in dataset.variables.items()
            if _is_text(variable)
        }
        dataset.drop_encoding().assign(texts).to_zarr(draft, mode="w-", zarr_format=3, consolidated=False)
        if folder.exists():
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
        if kind not in "biufcUTO" or (kind == "O" and not _is_text(variable)):
            expected = "numbers, truth values or texts"
            raise InputError(f"dataset: {name}: expected {expected}, got {variable.dtype}")
    return value


def _is_plain(entry: Any) -> bool:
    if isinstance(entry, np.ndarray):
        return entry.dtype.kind in "biufU"
    if isinstance(entry, list | tuple):
        return all(map(_is_plain, entry))
    return isinstance(entry, str | Number | np.bool_) and not isinstance(entry, complex)


def _is_text(variable: Any) -> bool:
    kind = variable.dtype.kind
    return kind in "UT" or (kind == "O" and all(isinstance(entry, str) for entry in variable.to_numpy().flat))


def _native(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset with numpy's texts and whole numbers of 64 bits, whatever a format makes of them."""
    changed = {}
    for name, variable in dataset.variables.items():
        if _is_text(variable):
            changed[name] = variable.astype(object).astype(np.str_)
        elif variable.dtype.kind == "i":
            changed[name] = variable.astype(np.int64)
    return dataset.assign(changed).drop_encoding()


def split_complex(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset with a real and an imaginary part for every complex variable."""
    split = dataset.copy()
    for name, variable in dataset.data_vars.items():
        if np.iscomplexobj(variable):
            split = split.drop_vars(str(name))
            for part, values in (("real", variable.real), ("imag", variable.imag)):
                split[f"{name}_{part}"] = values.assign_attrs(variable.attrs, complex=str(name))
    return split


def join_complex(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset whose complex variables were split, as it was."""
    joined = dataset.copy()
    for part, variable in dataset.data_vars.items():
        name = variable.attrs.get("complex")
        if name is not None and part == f"{name}_real":
            # A sum would lose the sign of zeros.
            value = variable.astype(complex)
            value.values.imag = dataset[f"{name}_imag"].to_numpy()
            attrs = {key: text for key, text in variable.attrs.items() if key != "complex"}
            value.attrs = attrs
            joined = joined.drop_vars([f"{name}_real", f"{name}_imag"]).assign({name: value})
    return joined


def json_text(dataset: xr.Dataset) -> str:
    """Return a dataset as JSON: attrs, dims, coords, data_vars."""
    record = split_complex(dataset).to_dict()
    for kind in ("coords", "data_vars"):
        for name, variable in record[kind].items():
            variable["dtype"] = _kind(dataset, name)
    return json.dumps(_plain(record), indent=1, allow_nan=False) + "\n"


def csv_text(dataset: xr.Dataset, rows: Sequence[str] | None = None) -> str:
    """Return one table of a dataset, of one row if it has no dimension; numbers have all their digits.

    Raises
    ------
    InputError
        If a dimension of `rows` is unknown.
    """
    from pandas import DataFrame

    split = split_complex(dataset)
    dims = _rows(split, rows)
    length = math.prod(split.sizes[dim] for dim in dims)
    names: list[str] = []
    columns: list[Any] = []
    for name in _tabled(split, dims):
        variable = split[name]
        others = [dim for dim in variable.dims if dim not in dims]
        lacking = {dim: split.sizes[dim] for dim in dims if dim not in variable.dims}
        whole = variable.variable.set_dims({**lacking, **variable.sizes}).transpose(*dims, *others)
        # Not -1, which a table without rows leaves open.
        values = whole.to_numpy().reshape(length, math.prod(split.sizes[dim] for dim in others))
        names += [f"{name}{label}" for label in _labels(split, [str(dim) for dim in others])]
        columns += list(values.T)
    # By number, since a name may be there twice.
    table = DataFrame(dict(enumerate(columns)), index=range(length))
    text: str = table.to_csv(header=names, index=False, na_rep="nan", lineterminator="\n")
    return text


def _rows(dataset: xr.Dataset, rows: Sequence[str] | None) -> list[Any]:
    dims = list(dataset.sizes)[:1] if rows is None else list(rows)
    for dim in dims:
        if dim not in dataset.sizes:
            raise InputError(f"rows: the dataset has no dimension {dim!r}")
    return dims


def _tabled(dataset: xr.Dataset, dims: list[Any]) -> list[Any]:
    """Return the variables that a table with these dimensions as rows holds."""
    return [
        name
        for name in [*dataset.coords, *dataset.data_vars]
        if not dims or set(dataset[name].dims) & set(dims)
    ]


def _csv_head(dataset: xr.Dataset, rows: Sequence[str] | None) -> str:
    """Return what `csv_text` leaves out, as lines that begin with ``#``."""
    split = split_complex(dataset)
    dims = _rows(split, rows)
    tabled = _tabled(split, dims)
    lines: list[dict[str, Any]] = []
    for name in [*split.coords, *split.data_vars]:
        variable = split[name]
        # Without rows the table holds nothing, also not of what lacks the dimension that has no entries.
        lost = any(split.sizes[dim] == 0 for dim in dims if dim not in variable.dims)
        line = {
            "name": name,
            "dims": variable.dims,
            "type": "str" if _is_text(variable) else variable.dtype.name,
            "coordinate": name in split.coords,
            "attrs": variable.attrs,
        }
        if name not in tabled or lost:
            line["data"] = variable.to_numpy().ravel()
        lines.append(line)
    top = {"lines": 1 + len(lines), "rows": dims, "sizes": dict(split.sizes), "attrs": split.attrs}
    return "".join(f"# {json.dumps(_plain(line), allow_nan=False)}\n" for line in [top, *lines])


def _from_csv(text: str) -> xr.Dataset:
    import xarray as xr
    from pandas import read_csv

    count = json.loads(text.split("\n", 1)[0].removeprefix("# "))["lines"]
    *head, body = text.split("\n", count)
    top, *lines = (json.loads(line.removeprefix("# ")) for line in head)
    sizes, dims = top["sizes"], top["rows"]
    tabled = any("data" not in line for line in lines)
    reading: dict[str, Any] = {"header": None, "dtype": str, "na_filter": False, "skip_blank_lines": False}
    # Below the names of its columns.
    table = read_csv(StringIO(body), **reading).to_numpy()[1:] if tabled else np.empty((0, 0))
    variables: dict[bool, dict[str, Any]] = {True: {}, False: {}}
    column = 0
    for line in lines:
        others = [dim for dim in line["dims"] if dim not in dims]
        if "data" in line:
            kept, cells = line["dims"], np.array(line["data"])
        else:
            kept = [dim for dim in dims if dim in line["dims"]] + others
            width = math.prod(sizes[dim] for dim in others)
            cells = table[:, column : column + width].reshape([sizes[dim] for dim in dims + others])
            # What lacks a dimension of the rows stands there once for each of its entries.
            cells = np.asarray(cells[tuple(slice(None) if dim in kept else 0 for dim in dims)])
        if set(line["dims"]) & set(dims) or not dims:
            column += math.prod(sizes[dim] for dim in others)
        values = _parsed(cells.ravel(), line["type"]).reshape([sizes[dim] for dim in kept])
        variable = xr.Variable(kept, values, line["attrs"]).transpose(*line["dims"])
        variables[line["coordinate"]][line["name"]] = variable
    return xr.Dataset(variables[False], variables[True], top["attrs"])


def _parsed(cells: Any, kind: str) -> Any:
    """Return entries of a table or of JSON as what they were."""
    if kind == "str":
        return cells.astype(np.str_)
    if kind == "bool":
        return np.array([str(cell) == "True" for cell in cells], dtype=bool)
    convert = float if kind.startswith("float") else int
    return np.array([math.nan if cell is None else convert(cell) for cell in cells], dtype=kind)


def _labels(dataset: xr.Dataset, dims: list[str]) -> list[str]:
    labels = [""]
    for dim in dims:
        entries = dataset[dim].to_numpy() if dim in dataset.coords else np.arange(dataset.sizes[dim])
        labels = [f"{label}_{entry}" for label in labels for entry in entries]
    return labels


def _kind(dataset: xr.Dataset, name: str) -> str:
    kind = dataset[name].dtype.kind if name in dataset.variables else "f"
    return {"b": "bool", "i": "int", "u": "int", "U": "str", "O": "str", "T": "str"}.get(kind, "float")


def _numbers(data: Any, kind: str) -> Any:
    if kind == "float":
        # None becomes nan.
        return np.array(data, dtype=float)
    return np.array(data, dtype={"bool": bool, "int": np.int64, "str": np.str_}[kind])


def _plain(value: Any) -> Any:
    """Replace what JSON does not have: nan by null, infinity by a text, numpy's numbers by Python's."""
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value
