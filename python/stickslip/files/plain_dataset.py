"""Datasets of plain numbers: complex variables in two parts, values that JSON can hold."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def is_text(variable: Any) -> bool:
    """Return whether a variable holds texts."""
    kind = variable.dtype.kind
    return kind in "UT" or (kind == "O" and all(isinstance(entry, str) for entry in variable.to_numpy().flat))


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


def plain(value: Any) -> Any:
    """Replace what JSON does not have: nan by null, infinity by a text, numpy's numbers by Python's."""
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value
