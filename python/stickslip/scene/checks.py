"""Real arrays from whatever a user hands over: read-only, contiguous, float64.

Only type and rank are looked at here; sizes, finiteness and everything physical are checked by the core.
"""

from __future__ import annotations

import numbers
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray

from stickslip.faults import InputError

if TYPE_CHECKING:
    from stickslip._core import _SparseData

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Names = NDArray[np.str_]
Flags = NDArray[np.bool_]
#: A matrix as a scene keeps it: read-only, dense or in compressed rows.
Matrix: TypeAlias = Real | scipy.sparse.csr_array
#: A matrix as a user gives it, dense or sparse.
MatrixLike: TypeAlias = "ArrayLike | scipy.sparse.sparray | scipy.sparse.spmatrix"
#: One number for both directions, or a pair.
Pair: TypeAlias = "float | Sequence[float] | Real"
#: Most threads of a call: more of them take seconds to start, and give no result sooner on any machine.
THREADS = 1024
#: Version of the format of scenes, cases, studies, datasets and stores in files, and its key there.
FORMAT_VERSION, FORMAT_KEY = 1, "format_version"
#: Letters of a value that an error message shows, contacts whose status a title shows.
WIDTH, STATUSES = 160, 24


def real_array(argument: str, value: ArrayLike, *ranks: int) -> Real:
    """Return `value` as a read-only float64 array of one of the given ranks."""
    if np.ma.isMaskedArray(value) and np.ma.getmaskarray(value).any():
        raise InputError(f"{argument}: expected real numbers, got masked entries in {described(value)}")
    try:
        given = np.asarray(value)
    except ValueError:
        raise InputError(
            f"{argument}: expected an array of numbers, got a ragged sequence {described(value)}"
        ) from None
    except TypeError:
        raise InputError(f"{argument}: expected an array of numbers, got {described(value)}") from None
    if given.dtype.kind == "O" and given.size and all(_is_real(one) for one in given.flat):
        # Such as fractions, and integers beyond 64 bits.
        given = np.array([real_number(argument, one) for one in given.flat]).reshape(given.shape)
    if given.dtype.kind in "iuf" and _has_truth_value(value):
        raise InputError(f"{argument}: expected real numbers, got a truth value in {described(value)}")
    if given.dtype.kind not in "iuf":
        raise InputError(f"{argument}: expected real numbers, got {_described_array(given)}")
    if given.ndim not in ranks:
        expected = " or ".join(f"{rank}-dimensional" for rank in ranks)
        raise InputError(f"{argument}: expected a {expected} array, got shape {given.shape}")
    array = np.array(given, dtype=np.float64, order="C", copy=True)
    array.flags.writeable = False
    return array


def real_number(argument: str, value: Any) -> float:
    """Return `value` as a float."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not _is_real(value):
        raise InputError(f"{argument}: expected a real number, got {described(value)}")
    try:
        return float(value)
    except OverflowError:
        raise InputError(
            f"{argument}: expected a number of at most {sys.float_info.max:.3g}, got {described(value)}"
        ) from None


def finite(argument: str, value: Any, *, least: float = -np.inf) -> float:
    """Return a finite number that is at least so large."""
    number = real_number(argument, value)
    if not np.isfinite(number):
        raise InputError(f"{argument}: must be finite, got {number}")
    if number < least:
        raise InputError(f"{argument}: must be >= {least:g}, got {number:g}")
    return number


def positive(argument: str, value: Any) -> float:
    """Return a positive finite number."""
    number = finite(argument, value)
    if number <= 0.0:
        raise InputError(f"{argument}: must be positive, got {number:g}")
    return number


def pair(argument: str, value: Any, *, least: float = -np.inf) -> tuple[float, float]:
    """Return two finite numbers, from one for both or two."""
    values = [value, value] if np.ndim(value) == 0 else real_array(argument, value, 1)
    if len(values) != 2:
        raise InputError(f"{argument}: expected a number or two, got {len(values)}")
    first, second = (finite(argument, one, least=least) for one in values)
    return first, second


def finite_time(argument: str, value: Any, least: float | None = None) -> float:
    """Return a time in s: positive and finite, or also `least`."""
    number = real_number(argument, value)
    if 0.0 < number < np.inf or number == least:
        return number
    expected = "a positive finite time" if least is None else f"a finite time >= {least:g}"
    raise InputError(f"{argument}: expected {expected}, got {number:g}")


def whole_number(argument: str, value: Any, least: int, most: int = sys.maxsize) -> int:
    """Return `value` as an int."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{argument}: expected an integer >= {least}, got {described(value)}")
    if value > most:
        raise InputError(f"{argument}: expected an integer <= {most}, got {described(value)}")
    return int(value)


def file_path(value: Any) -> Path:
    """Return the path of a file."""
    try:
        return Path(value)
    except TypeError:
        raise InputError(f"path: expected the path of a file, got {described(value)}") from None


def check_format_version(version: Any) -> None:
    """Refuse a file of a later version of stickslip; None: a file that states no version."""
    if version is not None and whole_number(FORMAT_KEY, version, 1) > FORMAT_VERSION:
        raise InputError(
            f"{FORMAT_KEY}: this stickslip reads files up to version {FORMAT_VERSION}, got {version}; "
            "pip install --upgrade stickslip"
        )


def check_memory(argument: str, numbers: float, value: Any) -> None:
    """Refuse work whose results alone, so many numbers of 8 bytes, exceed the memory of this machine."""
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        # Where it is not known, as on Windows, nothing of today has more.
        memory = 2**42
    if 8.0 * numbers > memory:
        raise InputError(
            f"{argument}: {described(value)} would take {8.0 * numbers / 2**30:.3g} GiB, "
            f"of {memory / 2**30:.3g} GiB of memory"
        )


def thread_count(value: Any) -> int | None:
    """Return a number of threads; None: one per core."""
    return None if value is None else whole_number("threads", value, 1, THREADS)


def described(value: Any) -> str:
    """Return a value for one line of an error message: the first line of its `repr`, shortened."""
    try:
        first, *more = repr(value).splitlines() or [""]
    except ValueError:
        # Python writes no integer of more than some thousand digits.
        return f"an integer of {value.bit_length()} bits" if isinstance(value, int) else f"a {type(value)}"
    if len(first) > WIDTH:
        first, more = first[:WIDTH], ["..."]
    return first + (" ..." if more else "")


def shown_statuses(combination: str) -> str:
    """Return a status combination for a title: its first letters where it has many contacts."""
    if len(combination) <= STATUSES:
        return combination
    return f"{combination[:STATUSES]}… ({len(combination)} contacts)"


def real_matrix(argument: str, value: Any) -> Real | scipy.sparse.csr_array:
    """Return `value` as a read-only square-to-be matrix, kept sparse (compressed rows) if it came so."""
    if not scipy.sparse.issparse(value):
        array = real_array(argument, value, 2)
        if array.shape[0] != array.shape[1]:
            raise InputError(f"{argument}: expected a square matrix, got shape {array.shape}")
        return array
    if value.dtype.kind not in "iuf":
        raise InputError(f"{argument}: expected real numbers, got dtype {value.dtype}")
    if value.shape[0] != value.shape[1]:
        raise InputError(f"{argument}: expected a square matrix, got shape {value.shape}")
    rows = scipy.sparse.csr_array(value, dtype=np.float64, copy=True)
    rows.sum_duplicates()
    for part in (rows.data, rows.indices, rows.indptr):
        part.flags.writeable = False
    return rows


def core_matrix(matrix: Real | scipy.sparse.csr_array) -> Real | _SparseData:
    """Return a matrix in the form the compiled core takes."""
    if isinstance(matrix, np.ndarray):
        return matrix
    return matrix.data, matrix.indices.astype(np.int64), matrix.indptr.astype(np.int64)


def axis_labels(value: Any) -> list[list[Any] | None]:
    """Return the labels of every axis of a pandas or xarray object; None for an axis that counts 0, 1, ..."""
    if hasattr(value, "dims") and hasattr(value, "indexes"):
        indexes = [value.indexes.get(dim) for dim in value.dims]
    else:
        indexes = value.axes if isinstance(getattr(value, "axes", None), list) else []
    listed = [None if index is None else list(index) for index in indexes]
    return [None if labels == list(range(len(labels or ()))) else labels for labels in listed]


def by_label(value: Any) -> Any:
    """Return a labelled vector as a mapping from its labels to its entries, anything else as it is."""
    match axis_labels(value):
        case [list(labels)]:
            return dict(zip(labels, np.asarray(value).tolist(), strict=True))
    return value


def _is_real(value: Any) -> bool:
    # The abstract class takes ten times as long to ask as the type does.
    return type(value) is float or (
        isinstance(value, numbers.Real) and not isinstance(value, bool | np.timedelta64)
    )


def _has_truth_value(value: Any) -> bool:
    """Return whether there is a truth value in rows of numbers, where numpy makes a number of it."""
    if not isinstance(value, list | tuple):
        return False
    kinds = set(map(type, value))
    return (
        bool in kinds
        or np.bool_ in kinds
        or (bool(kinds & {list, tuple}) and any(map(_has_truth_value, value)))
    )


def _described_array(given: np.ndarray[Any, Any]) -> str:
    text = np.array2string(given, threshold=6, edgeitems=2).replace("\n", "")
    return f"{text} (dtype {given.dtype})"


def mass_array(mass: Any) -> Real | scipy.sparse.csr_array:
    """Return the mass as (n,), (n, n) or sparse; a sparse one is (n,) where it is diagonal."""
    if not scipy.sparse.issparse(mass):
        return real_array("mass", mass, 1, 2)
    rows = cast("scipy.sparse.csr_array", real_matrix("mass", mass))
    entries = rows.tocoo()
    if (entries.coords[0][entries.data != 0.0] == entries.coords[1][entries.data != 0.0]).all():
        return real_array("mass", rows.diagonal(), 1)
    return rows


def default_dofs(size: int) -> tuple[str, ...]:
    """Return the names dofs have unless told otherwise: x1, x2, ..."""
    return tuple(f"x{i + 1}" for i in range(size))


def dof_names(dofs: Sequence[str] | None, size: int) -> tuple[str, ...]:
    """Return the names of the dofs."""
    if dofs is None:
        return default_dofs(size)
    if isinstance(dofs, str) or not np.iterable(dofs):
        raise InputError(f"dofs: expected {size} names, got {described(dofs)}")
    names = tuple(dofs)
    if len(names) != size:
        raise InputError(f"dofs: expected {size} names, got {len(names)}")
    seen: set[str] = set()
    for name in names:
        if not isinstance(name, str):
            raise InputError(f"dofs: expected names, got {described(name)}")
        if not name.strip():
            raise InputError(f"dofs: expected names that are not empty, got {name!r}")
        if name in seen:
            raise InputError(f"dofs: {name!r} names more than one dof")
        seen.add(name)
    return names


def package(name: str, wanted: str, extra: str = "study") -> Any:
    """Return a package of an extra."""
    try:
        return import_module(name)
    except ImportError:
        raise InputError(f"{wanted}: this needs {name}; pip install 'stickslip[{extra}]'") from None
