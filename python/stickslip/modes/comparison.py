"""Modes of two scenes side by side: how alike their shapes are, and which belongs to which."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import scipy.optimize
import xarray as xr

from stickslip.faults import InputError
from stickslip.modes.modes import Modes
from stickslip.scene.checks import Complex, Index, described


def mac(a: Modes, b: Modes) -> xr.DataArray:
    """Return the modal assurance criterion of every mode of one set with every mode of another.

    ``MAC = |x* y|^2 / (x* x) (y* y)`` over the displacements x, y of the dofs that both have, told by their
    names (Allemang and Brown 1982): 1 where one shape is a complex multiple of the other, 0 where they are
    orthogonal.

    Parameters
    ----------
    a, b
        Modes, of one scene or of two, such as a full and a reduced model.

    Returns
    -------
    xarray.DataArray
        (first, second), one of each conjugate pair, by the numbers of the modes; nan where a mode does not
        move these dofs.

    Raises
    ------
    InputError
        If an argument is no `Modes`, or no dof is common to both.
    """
    dofs = _shared(a, b)
    (rows, first), (columns, second) = (_upper(modes, dofs) for modes in (a, b))
    with np.errstate(invalid="ignore"):
        alike = np.abs(_unit(first).conj().T @ _unit(second)) ** 2
    return xr.DataArray(
        alike,
        dims=("first", "second"),
        coords={"first": rows, "second": columns},
        name="mac",
        attrs={"units": "1", "long_name": "modal assurance criterion"},
    )


def pairing(a: Modes, b: Modes) -> xr.Dataset:
    """Return which mode of one set is which of another: the pairs whose MAC values have the largest sum.

    No mode is in two pairs; as many pairs are formed as the smaller set has modes, one of each conjugate
    pair (Kuhn 1955, by `scipy.optimize.linear_sum_assignment`).

    Parameters
    ----------
    a, b
        As for `mac`.

    Returns
    -------
    xarray.Dataset
        Over ``pair``, by the number of the first: ``first`` and ``second``, numbers of the modes, their
        ``mac``, ``frequency`` Hz, ``eigenvalue`` 1/s (pair, side), and ``shift``, the second frequency less
        the first, Hz.

    Raises
    ------
    InputError
        As `mac`.
    """
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


def _shared(a: Any, b: Any) -> list[str]:
    for name, modes in (("a", a), ("b", b)):
        if not isinstance(modes, Modes):
            hint = "; complex_modes(scene) has its modes" if hasattr(modes, "contacts") else ""
            raise InputError(f"{name}: expected Modes, got {described(modes)}{hint}")
    found = [dof for dof in a.dofs if dof in set(b.dofs)]
    if not found:
        raise InputError(f"b: expected a dof that a has too, such as {a.dofs[0]!r}, got {b.dofs[0]!r}, ...")
    return found


def _upper(modes: Modes, dofs: list[str]) -> tuple[Index, Complex]:
    """Return the numbers of one mode of each pair, and their displacements of some dofs."""
    place = {dof: k for k, dof in enumerate(modes.dofs)}
    numbers = np.flatnonzero(modes.eigenvalues.imag >= 0.0)
    return numbers, modes.shapes[np.array([place[dof] for dof in dofs])][:, numbers]


def _unit(shapes: Complex) -> Complex:
    return cast(Complex, shapes / np.linalg.norm(shapes, axis=0))
