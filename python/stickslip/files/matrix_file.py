"""Matrices and vectors in files: `.npz`, `.mat` (MATLAB, up to version 7), `.mtx` (Matrix Market).

Sparse matrices stay sparse, and numbers keep their last bit (`.mtx` loses the sign of zero). Nothing in a
file is executed: pickled objects are refused.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.contact import nearest

#: What a file is named by.
FORMATS = ("npz", "mat", "mtx")
#: Digits that determine a double.
DIGITS = 17


def read_matrix(path: Path, name: str | None = None, default: str | None = None) -> Any:
    """Return an array of a file: dense, or `scipy.sparse.csr_array`.

    Parameters
    ----------
    path
        The file; its suffix says what it is.
    name
        Which of its arrays; None: `default` if there is one of that name, or the only one.
    default
        See `name`.

    Raises
    ------
    InputError
        If there is no such file, it is damaged or not of its kind, it holds no array of that name, or an
        array that is not of numbers.
    """
    kind = _kind(path)
    if not path.is_file():
        raise InputError(f"no such file: {path}")
    if kind == "mtx" and name is not None:
        raise InputError(f"{path.name}: a Matrix Market file has no names, got name {name!r}")
    try:
        if kind == "mtx":
            return _plain(path, path.stem, scipy.io.mmread(path))
        arrays = _npz(path) if kind == "npz" else _mat(path)
    except NotImplementedError:
        raise InputError(f"{path.name}: MATLAB version 7.3; save it with '-v7'") from None
    except InputError:
        raise
    except Exception as error:  # A damaged file makes the readers raise anything.
        raise InputError(f"{path.name}: not readable as .{kind}: {error}") from None
    chosen = name
    if chosen is None:
        chosen = default if default in arrays else next(iter(arrays)) if len(arrays) == 1 else None
    if chosen is None:
        raise InputError(f"{path.name}: holds {', '.join(arrays) or 'nothing'}; say which by name = ...")
    if chosen not in arrays:
        raise InputError(f"{path.name}: holds no {chosen!r}{nearest(chosen, list(arrays))}")
    return _plain(path, chosen, arrays[chosen])


def write_matrix(path: Path, name: str, array: Any) -> None:
    """Write one array, dense or sparse, to a file of the kind that its suffix names.

    Raises
    ------
    InputError
        If the suffix is none of `.npz`, `.mat`, `.mtx`.
    """
    kind = _kind(path)
    sparse = scipy.sparse.issparse(array)
    if kind == "npz" and sparse:
        scipy.sparse.save_npz(path, array)
    elif kind == "npz":
        np.savez_compressed(path, **{name: array})
    elif kind == "mat":
        scipy.io.savemat(path, {name: array}, do_compression=True, oned_as="column")
    else:
        column = array if sparse or array.ndim == 2 else array[:, None]
        # A file handle, because a path with another suffix would get one more.
        with path.open("wb") as file:
            scipy.io.mmwrite(file, column, precision=DIGITS, symmetry="general")


def _kind(path: Path) -> str:
    kind = path.suffix.removeprefix(".").lower()
    if kind not in FORMATS:
        raise InputError(f"{path.name}: expected a file .npz, .mat or .mtx")
    return kind


def _npz(path: Path) -> dict[str, Any]:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise InputError(f"{path.name}: a single array, not an archive of arrays")
        if {"format", "shape"} <= set(archive.files):
            return {path.stem: scipy.sparse.load_npz(path)}
        return {name: archive[name] for name in archive.files}


def _mat(path: Path) -> dict[str, Any]:
    found = scipy.io.loadmat(path)
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _plain(path: Path, name: str, array: Any) -> Any:
    """Return rows of a sparse matrix, or an array in which a single column or row is a vector."""
    if not scipy.sparse.issparse(array):
        array = np.asarray(array)
    if array.dtype.kind not in "iuf":
        raise InputError(f"{path.name}: {name!r} does not hold real numbers (dtype {array.dtype})")
    if scipy.sparse.issparse(array):
        return scipy.sparse.csr_array(array)
    if path.suffix.lower() != ".npz" and array.ndim == 2 and 1 in array.shape and array.size > 1:
        return array.ravel()
    return array
