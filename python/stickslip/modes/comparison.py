"""Modes of two scenes side by side: how alike their shapes are, and which belongs to which."""

from __future__ import annotations

from typing import cast

import numpy as np
import scipy.optimize
import xarray as xr

from stickslip.faults import InputError
from stickslip.modes.computed import Computed
from stickslip.scene.checks import Complex


def mac(a: Computed, b: Computed) -> xr.DataArray:
    """Return what `Modes.mac` does."""
    dofs = _shared(a, b)
    first, second = (_unit(modes, dofs) for modes in (a, b))
    alike = np.abs(first.conj().T @ second) ** 2
    return xr.DataArray(
        alike,
        dims=("first", "second"),
        coords={"first": np.arange(first.shape[1]), "second": np.arange(second.shape[1])},
        name="mac",
        attrs={"units": "1", "long_name": "modal assurance criterion"},
    )


def pairing(a: Computed, b: Computed) -> xr.Dataset:
    """Return what `Modes.pairing` does."""
    table = mac(a, b)
    rows, columns = scipy.optimize.linear_sum_assignment(-np.nan_to_num(table.to_numpy()))
    first, second = table.first.to_numpy()[rows], table.second.to_numpy()[columns]
    value = np.stack([a.eigenvalues[first], b.eigenvalues[second]], axis=1)
    frequency = np.abs(value) / (2.0 * np.pi)
    hertz = {"units": "Hz"}
    return xr.Dataset(
        {
            "first": ("pair", first),
            "second": ("pair", second),
            "mac": ("pair", table.to_numpy()[rows, columns], {"units": "1"}),
            "frequency": (("pair", "side"), frequency, hertz),
            "shift": ("pair", frequency[:, 1] - frequency[:, 0], hertz),
            "eigenvalue": (("pair", "side"), value, {"units": "1/s"}),
        },
        coords={"pair": np.arange(first.size), "side": ["first", "second"]},
    )


def _shared(a: Computed, b: Computed) -> list[str]:
    found = [dof for dof in a.dofs if dof in set(b.dofs)]
    if not found:
        raise InputError(
            f"other: expected a dof that these modes have, such as {a.dofs[0]!r}, got {b.dofs[0]!r}, ..."
        )
    return found


def _unit(modes: Computed, dofs: list[str]) -> Complex:
    """Return the displacements of some dofs in every mode, of length 1; nan where none of them moves."""
    place = {dof: k for k, dof in enumerate(modes.dofs)}
    shapes = modes.shapes[[place[dof] for dof in dofs]]
    with np.errstate(invalid="ignore"):
        return cast(Complex, shapes / np.linalg.norm(shapes, axis=0))
