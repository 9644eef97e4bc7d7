"""Datasets as CSV.

CSV is one table below a head of lines that begin with ``#``, which other programs skip (``comment="#"`` of
pandas). In the table, what has more dimensions than its rows gets a column per label. The head says what a
table cannot: one line of JSON for the dataset and one for each variable, with dimensions, type and units,
and the numbers of what has none of the dimensions of the rows.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.faults import InputError
from stickslip.files.plain_dataset import is_text, plain, split_complex

if TYPE_CHECKING:
    import xarray as xr


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


def csv_head(dataset: xr.Dataset, rows: Sequence[str] | None) -> str:
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
            "type": "str" if is_text(variable) else variable.dtype.name,
            "coordinate": name in split.coords,
            "attrs": variable.attrs,
        }
        if name not in tabled or lost:
            line["data"] = variable.to_numpy().ravel()
        lines.append(line)
    top = {"lines": 1 + len(lines), "rows": dims, "sizes": dict(split.sizes), "attrs": split.attrs}
    return "".join(f"# {json.dumps(plain(line), allow_nan=False)}\n" for line in [top, *lines])


def from_csv(text: str) -> xr.Dataset:
    """Return the dataset of a head and its table."""
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
