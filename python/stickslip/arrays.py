"""Real arrays from whatever a user hands over: read-only, contiguous, float64.

Only type and rank are looked at here; sizes, finiteness and everything physical are checked by the core.
"""

from __future__ import annotations

import numbers
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray

from stickslip.errors import InputError

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Names = NDArray[np.str_]
#: A matrix in compressed rows as the core takes and gives it: data, column indices, row pointers.
SparseData = tuple[Real, Index, Index]


def real_array(argument: str, value: ArrayLike, *ranks: int) -> Real:
    """Return `value` as a read-only float64 array of one of the given ranks.

    Raises
    ------
    InputError
        If `value` is ragged, not made of real numbers, or of another rank.
    """
    try:
        given = np.asarray(value)
    except ValueError:
        raise InputError(
            f"{argument}: expected an array of numbers, got a ragged sequence {value!r}"
        ) from None
    if given.dtype.kind not in "iuf":
        raise InputError(
            f"{argument}: expected real numbers, got {_described(given)}",
        )
    if given.ndim not in ranks:
        expected = " or ".join(f"{rank}-dimensional" for rank in ranks)
        raise InputError(f"{argument}: expected a {expected} array, got shape {given.shape}")
    array = np.array(given, dtype=np.float64, order="C", copy=True)
    array.flags.writeable = False
    return array


def real_number(argument: str, value: Any) -> float:
    """Return `value` as a float.

    Raises
    ------
    InputError
        If `value` is not one real number.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        return float(value)
    raise InputError(f"{argument}: expected a real number, got {value!r}")


def whole_number(argument: str, value: Any, least: int) -> int:
    """Return `value` as an int.

    Raises
    ------
    InputError
        If `value` is no integer or less than `least`.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{argument}: expected an integer >= {least}, got {value!r}")
    return int(value)


def real_matrix(argument: str, value: Any) -> Real | scipy.sparse.csr_array:
    """Return `value` as a read-only square-to-be matrix, kept sparse (compressed rows) if it came so.

    Raises
    ------
    InputError
        If `value` is not two-dimensional or not real.
    """
    if not scipy.sparse.issparse(value):
        return real_array(argument, value, 2)
    if value.dtype.kind not in "iuf":
        raise InputError(f"{argument}: expected real numbers, got dtype {value.dtype}")
    if value.shape[0] != value.shape[1]:
        raise InputError(f"{argument}: expected a square matrix, got shape {value.shape}")
    rows = scipy.sparse.csr_array(value, dtype=np.float64, copy=True)
    rows.sum_duplicates()
    for part in (rows.data, rows.indices, rows.indptr):
        part.flags.writeable = False
    return rows


def core_matrix(matrix: Real | scipy.sparse.csr_array) -> Real | SparseData:
    """Return a matrix in the form the compiled core takes."""
    if isinstance(matrix, np.ndarray):
        return matrix
    return matrix.data, matrix.indices.astype(np.int64), matrix.indptr.astype(np.int64)


def _described(given: np.ndarray[Any, Any]) -> str:
    text = np.array2string(given, threshold=6, edgeitems=2).replace("\n", "")
    return f"{text} (dtype {given.dtype})"
