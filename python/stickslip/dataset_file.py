"""Datasets in files: netCDF, JSON, CSV.

None of the three knows complex numbers, so a complex variable ``z`` becomes ``z_real`` and ``z_imag``, whose
attribute ``complex`` names z; `read_dataset` joins them again. NetCDF files are of version 3 (64-bit offset),
which everything reads. JSON has the layout of ``xarray.Dataset.to_dict``, nan as null. CSV is one table: what
has more dimensions than its rows gets a column per label, what has none of them is left out.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

SUFFIXES = (".nc", ".json", ".csv")


def write_dataset(dataset: xr.Dataset, path: str | Path, rows: Sequence[str] | None = None) -> None:
    """Write a dataset as `.nc`, `.json` or `.csv`; the first two read back by `read_dataset`.

    Parameters
    ----------
    dataset
        Of numbers, truth values and texts.
    path
        The file; its suffix says what it is.
    rows
        Dimensions of the rows of a CSV table; None: the first dimension.

    Raises
    ------
    InputError
        If the suffix is another, or a dimension of `rows` is unknown.
    OSError
        If the file cannot be written.
    """
    file = Path(path)
    if file.suffix == ".nc":
        split = split_complex(dataset)
        split.to_netcdf(file, engine="scipy", format="NETCDF3_64BIT")
    elif file.suffix == ".json":
        file.write_text(json_text(dataset), encoding="utf-8")
    elif file.suffix == ".csv":
        file.write_text(csv_text(dataset, rows), encoding="utf-8", newline="")
    else:
        raise InputError(f"{file.name}: expected a file {', '.join(SUFFIXES)}")


def read_dataset(path: str | Path) -> xr.Dataset:
    """Return a dataset that `write_dataset` wrote as `.nc` or `.json`.

    Raises
    ------
    InputError
        If the suffix is another, or the file is none that can be read.
    """
    import xarray as xr

    file = Path(path)
    if file.suffix not in (".nc", ".json"):
        raise InputError(f"{file.name}: expected a file .nc or .json")
    try:
        if file.suffix == ".nc":
            return join_complex(xr.load_dataset(file, engine="scipy"))
        record = json.loads(file.read_text(encoding="utf-8"))
        for kind in ("coords", "data_vars"):
            for variable in record[kind].values():
                variable["data"] = _numbers(variable["data"], variable.pop("dtype"))
        return join_complex(xr.Dataset.from_dict(record))
    except FileNotFoundError:
        raise InputError(f"no such file: {file}") from None
    except (ValueError, TypeError, KeyError, OSError) as error:
        raise InputError(f"{file}: not readable: {error}") from None


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
            value = variable + 1j * dataset[f"{name}_imag"]
            # The sum would turn -0 of the imaginary part into 0.
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
    """Return one table of a dataset; numbers have all their digits.

    Raises
    ------
    InputError
        If a dimension of `rows` is unknown.
    """
    split = split_complex(dataset)
    dims = list(split.sizes)[:1] if rows is None else list(rows)
    for dim in dims:
        if dim not in split.sizes:
            raise InputError(f"rows: the dataset has no dimension {dim!r}")
    shape = [split.sizes[dim] for dim in dims]
    columns: dict[str, Any] = {}
    for name in [*split.coords, *split.data_vars]:
        variable = split[name]
        if not set(variable.dims) & set(dims):
            continue
        others = [dim for dim in variable.dims if dim not in dims]
        lacking = {dim: split.sizes[dim] for dim in dims if dim not in variable.dims}
        whole = variable.variable.set_dims({**lacking, **variable.sizes}).transpose(*dims, *others)
        values = whole.to_numpy().reshape(int(np.prod(shape)), -1)
        for column, label in enumerate(_labels(split, [str(dim) for dim in others])):
            columns[f"{name}{label}"] = values[:, column]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(map(_cell, values.tolist()) for values in columns.values()), strict=True))
    return text.getvalue()


def _labels(dataset: xr.Dataset, dims: list[str]) -> list[str]:
    labels = [""]
    for dim in dims:
        entries = dataset[dim].to_numpy() if dim in dataset.coords else np.arange(dataset.sizes[dim])
        labels = [f"{label}_{entry}" for label in labels for entry in entries]
    return labels


def _cell(value: Any) -> Any:
    return repr(value) if isinstance(value, float) else value


def _kind(dataset: xr.Dataset, name: str) -> str:
    kind = dataset[name].dtype.kind if name in dataset.variables else "f"
    return {"b": "bool", "i": "int", "u": "int", "U": "str", "O": "str", "T": "str"}.get(kind, "float")


def _numbers(data: Any, kind: str) -> Any:
    if kind == "float":
        # None becomes nan.
        return np.array(data, dtype=float)
    return np.array(data, dtype={"bool": bool, "int": np.int64, "str": np.str_}[kind])


def _plain(value: Any) -> Any:
    """Replace what JSON does not have: nan and infinity by null, numpy's numbers by Python's."""
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
