"""Sparse matrices of a body: checked to be square, finite, symmetric or not, and made of rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.checks import real_matrix

#: Relative difference of two entries that mirror each other above which a matrix is not symmetric.
SYMMETRY = 1e-10


def square(argument: str, value: Any, size: int | None, sign: int) -> scipy.sparse.csr_array:
    """Return a sparse square matrix that is finite and symmetric (sign 1), skew (-1), or any (0).

    Raise `InputError` naming the first entry that is wrong.
    """
    rows = scipy.sparse.csr_array(real_matrix(argument, value), dtype=np.float64, copy=True)
    rows.sum_duplicates()
    if not rows.shape[0] or (size is not None and rows.shape != (size, size)):
        raise InputError(f"{argument}: expected shape ({size or 'n'}, {size or 'n'}), got {rows.shape}")
    entries = rows.tocoo()
    if not np.isfinite(entries.data).all():
        k = int(np.flatnonzero(~np.isfinite(entries.data))[0])
        i, j = int(entries.coords[0][k]), int(entries.coords[1][k])
        raise InputError(f"{argument}: must be finite, got {entries.data[k]} at ({i}, {j})")
    if sign:
        mirrored = (sign * rows.T).tocsr()
        wrong = (rows - mirrored).tocoo()
        if wrong.nnz and np.abs(wrong.data).max() > SYMMETRY * np.abs(rows.data).max(initial=0.0):
            k = int(np.abs(wrong.data).argmax())
            i, j = int(wrong.coords[0][k]), int(wrong.coords[1][k])
            kind = "symmetric" if sign > 0 else "skew-symmetric"
            hint = ""
            if argument in ("stiffness", "damping"):
                other = "circulatory" if argument == "stiffness" else "gyroscopic"
                hint = f"; split A as {argument}=(A + A.T) / 2, {other}=(A - A.T) / 2"
            raise InputError(
                f"{argument}: must be {kind}, got {rows[i, j]:g} at ({i}, {j}) and {rows[j, i]:g} at "
                f"({j}, {i}){hint}"
            )
        rows = (0.5 * (rows + mirrored)).tocsr()
    rows.sort_indices()
    return rows


def of_rows(rows: Sequence[Mapping[int, float]], width: int) -> scipy.sparse.csr_array:
    """Return the matrix of rows that hold entries by column."""
    pointers = np.cumsum([0, *map(len, rows)])
    columns, values = [k for row in rows for k in row], [entry for row in rows for entry in row.values()]
    return scipy.sparse.csr_array((values, columns, pointers), shape=(len(rows), width))
