"""Matrices and vectors in files: `.npz`, `.mat` (MATLAB, up to version 7), `.mtx` (Matrix Market).

Sparse matrices stay sparse, and numbers keep their last bit (`.mtx` loses the sign of zero). Nothing in a
file is executed: pickled objects are refused.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.contact import nearest

#: What a file is named by.
FORMATS = ("npz", "mat", "mtx")
#: Digits that determine a double.
DIGITS = 17


class Header(NamedTuple):
    """What a file says of one of its arrays before that is read: shape, and at most how many entries."""

    shape: tuple[int, ...]
    entries: float


def matrix_header(path: Path, name: str | None = None, default: str | None = None) -> Header:
    """Return what a file says of an array, without reading it.

    Without a `name` it is the array `default` if there is one, or the only one.
    """
    return _chosen(path, name, default)[1]


def read_matrix(path: Path, name: str | None = None, default: str | None = None) -> Any:
    """Return an array of real numbers of a file: dense, or `scipy.sparse.csr_array`.

    Arguments and errors as in `matrix_header`; an array of other entries is refused, too.
    """
    chosen, _ = _chosen(path, name, default)
    return _plain(path, chosen, read_array(path, chosen))


def read_array(path: Path, name: str) -> Any:
    """Return an array of a file, whatever its entries, as its reader gives it; its others are not read."""
    with readable(path):
        if _kind(path) == "mtx":
            return scipy.io.mmread(path)
        if _kind(path) == "mat":
            return scipy.io.loadmat(path, variable_names=[name])[name]
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            return scipy.sparse.load_npz(path) if _is_sparse(archive.files) else archive[name]


def array_headers(path: Path) -> dict[str, Header]:
    """Return what a file says of its arrays, by name; the only one of a file without names has its stem."""
    kind = _kind(path)
    if not path.is_file():
        raise InputError(f"no such file: {path}")
    with readable(path):
        return {"npz": _npz_headers, "mat": _mat_headers, "mtx": _mtx_headers}[kind](path)


def _chosen(path: Path, name: str | None, default: str | None) -> tuple[str, Header]:
    """Return name and header of the array that is asked for."""
    if _kind(path) == "mtx" and name is not None:
        raise InputError(f"{path.name}: a Matrix Market file has no names, got name {name!r}")
    headers = array_headers(path)
    chosen = name
    if chosen is None:
        chosen = default if default in headers else next(iter(headers)) if len(headers) == 1 else None
    if chosen is None:
        raise InputError(f"{path.name}: holds {', '.join(headers) or 'nothing'}; say which by name = ...")
    if chosen not in headers:
        raise InputError(f"{path.name}: holds no {chosen!r}{nearest(chosen, list(headers))}")
    return chosen, headers[chosen]


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn whatever a reader raises at a damaged file into an `InputError`."""
    try:
        yield
    except NotImplementedError:
        raise InputError(f"{path.name}: MATLAB version 7.3; save it with '-v7'") from None
    except InputError:
        raise
    except Exception as error:  # A damaged file makes the readers raise anything.
        raise InputError(f"{path.name}: not readable as .{_kind(path)}: {error}") from None


def write_matrix(path: Path, name: str, array: Any) -> None:
    """Write one array, dense or sparse, to a file of the kind that its suffix names."""
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


def _is_sparse(names: Iterable[str]) -> bool:
    """Return whether these are the names that `scipy.sparse.save_npz` gives to parts of a matrix."""
    return {"format", "shape"} <= set(names)


def _npz_headers(path: Path) -> dict[str, Header]:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise InputError(f"{path.name}: a single array, not an archive of arrays")
        zipped: Any = archive.zip
        headers = {name: _npy_header(zipped, name) for name in archive.files}
        if not _is_sparse(headers):
            return headers
        if headers["shape"].shape != (2,):
            raise InputError(f"{path.name}: expected a matrix, got one of shape {headers['shape'].shape}")
        rows, columns = (int(length) for length in archive["shape"])
        largest = max(math.prod(header.shape) for header in headers.values())
        # Stored by diagonals, a full matrix has twice its entries.
        if largest > 2 * rows * columns + max(rows, columns) + 1:
            raise InputError(f"{path.name}: holds {largest} entries of a matrix {rows} x {columns}")
        return {path.stem: Header((rows, columns), largest)}


def _npy_header(archive: zipfile.ZipFile, name: str) -> Header:
    info = archive.getinfo(name if name in archive.namelist() else f"{name}.npy")
    with archive.open(info) as file:
        version = np.lib.format.read_magic(file)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        shape, _, kind = read[version](file)
    return Header(shape, min(math.prod(shape), info.file_size // max(1, kind.itemsize)))


def _mat_headers(path: Path) -> dict[str, Header]:
    return {
        name: Header(shape, math.inf if kind == "sparse" else math.prod(shape))
        for name, shape, kind in scipy.io.whosmat(path)
    }


def _mtx_headers(path: Path) -> dict[str, Header]:
    rows, columns, entries, *_ = scipy.io.mminfo(path)
    if entries > path.stat().st_size:
        raise InputError(f"{path.name}: {entries} entries announced, more than the file has bytes")
    return {path.stem: Header((rows, columns), entries)}


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
