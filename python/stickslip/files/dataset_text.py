"""Datasets as text, which has no complex numbers: ``z`` becomes ``z_real`` and ``z_imag``."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.faults import InputError

if TYPE_CHECKING:
    import xarray as xr


def csv_text(dataset: xr.Dataset, rows: Sequence[str] | None = None) -> str:
    """Return one table of a dataset, of one row if it has no dimension; numbers have all their digits.

    What has more dimensions than the `rows` gets a column per label; what has none of them is left out.
    """
    import xarray as xr

    split = split_complex(dataset)
    dims: list[Any] = list(split.sizes)[:1] if rows is None else list(rows)
    for dim in dims:
        if dim not in split.sizes:
            raise InputError(f"rows: the dataset has no dimension {dim!r}")
    names: list[str] = []
    columns: dict[str, Any] = {}
    for name in [*split.coords, *split.data_vars]:
        variable = split[name].variable
        if dims and not set(variable.dims) & set(dims):
            continue
        others = [dim for dim in variable.dims if dim not in dims]
        for places in np.ndindex(*(split.sizes[dim] for dim in others)):
            labels = [split[dim].to_numpy()[k] for dim, k in zip(others, places, strict=True)]
            names.append("_".join(map(str, [name, *labels])))
            # By number, since a name may be there twice.
            columns[str(len(columns))] = variable.isel(dict(zip(others, places, strict=True)))
    table = xr.Dataset(columns) if dims else xr.Dataset(columns).expand_dims("row")
    text: str = table.to_dataframe(dim_order=dims or None)[list(columns)].to_csv(
        header=names, index=False, na_rep="nan", lineterminator="\n"
    )
    return text


def json_text(dataset: xr.Dataset) -> str:
    """Return a dataset as JSON: attrs, dims, coords, data_vars; nan is null, infinity a text."""
    return json.dumps(_plain(split_complex(dataset).to_dict()), indent=1, allow_nan=False) + "\n"


def split_complex(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset with a real and an imaginary part for every complex variable."""
    split = dataset.copy()
    for name, variable in dataset.data_vars.items():
        if np.iscomplexobj(variable):
            split = split.drop_vars(str(name))
            for part, values in (("real", variable.real), ("imag", variable.imag)):
                split[f"{name}_{part}"] = values.assign_attrs(variable.attrs)
    return split


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
