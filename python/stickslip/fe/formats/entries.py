"""Entries of a matrix from the lines of a text file, each refused with its line where it is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from stickslip.faults import InputError
from stickslip.scene.checks import Real, described
from stickslip.show.summary import is_number

#: Relative difference of entries that mirror each other up to which a file of limited digits is symmetric.
ROUNDING = 1e-10


def read_lines(path: Path) -> list[str]:
    """Return the lines of a text file.

    Raise `InputError` if there is no such file, it is none (a pipe) or no text, or it ends in the middle of a
    line: it was cut off.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"{path}: expected a regular file")
    try:
        text = path.read_bytes().decode("ascii")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: no text: byte {error.start} is {error.object[error.start]:#04x}") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    lines = text.split("\n")
    if lines.pop().strip():
        raise InputError(f"{path}, line {len(lines) + 1}: the file ends in the middle of a line")
    return lines


@dataclass(frozen=True)
class Entries:
    """Rows, columns (from 0) and values of a matrix, and the line of the file that each stands in."""

    path: Path
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: Real
    lines: NDArray[np.int64]

    @classmethod
    def of_dofs(
        cls, path: Path, ends: NDArray[np.int64], values: Real, lines: NDArray[np.int64]
    ) -> tuple[Entries, tuple[str, ...]]:
        """Return entries given by node and direction of row and column, (k, 2, 2), and names of the dofs."""
        dofs, at = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
        rows, columns = at.reshape(-1, 2).T
        return cls(path, rows, columns, values, lines), tuple(f"{node}.{k}" for node, k in dofs)

    def refuse(self, which: NDArray[np.bool_], what: str) -> None:
        """Raise an error at the first entry that is chosen, if there is one."""
        if which.any():
            k = int(np.flatnonzero(which)[0])
            entry = f"row {self.rows[k] + 1}, column {self.columns[k] + 1}"
            raise InputError(f"{self.path}, line {self.lines[k]}: {what}: {entry}, value {self.values[k]:g}")

    def checked(self, size: int) -> Entries:
        """Return the entries of a matrix of so many rows.

        Raise `InputError` if one is outside, not finite, or comes twice.
        """
        outside = (self.rows < 0) | (self.columns < 0) | (self.rows >= size) | (self.columns >= size)
        self.refuse(outside, f"outside a matrix of {size} rows")
        self.refuse(~np.isfinite(self.values), "not finite")
        _, first = np.unique(self.rows * size + self.columns, return_index=True)
        again = np.ones(self.rows.size, dtype=bool)
        again[first] = False
        self.refuse(again, "an entry that came before")
        return self

    def triangle(self, size: int, which: str) -> tuple[scipy.sparse.csr_array, str]:
        """Return a symmetric matrix of which the file holds one triangle, and what was mirrored.

        Raise `InputError` if an entry of the other triangle is there, or one is wrong.
        """
        self.checked(size)
        other = self.rows > self.columns if which == "upper" else self.rows < self.columns
        told = "lower" if which == "upper" else "upper"
        self.refuse(other, f"in the {told} triangle of a file that holds the {which} one")
        off = self.rows != self.columns
        matrix = scipy.sparse.coo_array(
            (
                np.concatenate([self.values, self.values[off]]),
                (
                    np.concatenate([self.rows, self.columns[off]]),
                    np.concatenate([self.columns, self.rows[off]]),
                ),
            ),
            shape=(size, size),
        )
        note = f"{self.path.name}: {which} triangle of {size} x {size} mirrored, {int(off.sum())} entries"
        return matrix.tocsr(), note

    def full(self, size: int) -> scipy.sparse.csr_array:
        """Return the matrix of all entries that the file holds.

        Raise `InputError` if an entry is wrong.
        """
        self.checked(size)
        return scipy.sparse.coo_array((self.values, (self.rows, self.columns)), shape=(size, size)).tocsr()

    def either(self, size: int) -> tuple[scipy.sparse.csr_array, str]:
        """Return the matrix of a file that holds one triangle or all entries, told by what is there.

        Raise `InputError` if some entries have a mirrored one and others have none, or an entry is wrong.
        """
        self.checked(size)
        off = self.rows != self.columns
        keys = self.rows * size + self.columns
        paired = np.isin(self.columns * size + self.rows, keys)
        if paired[off].any():
            self.refuse(off & ~paired, "without its mirrored entry, where others of this file have theirs")
            return self.full(size), f"{self.path.name}: all entries of {size} x {size}, nothing mirrored"
        low, high = np.minimum(self.rows, self.columns), np.maximum(self.rows, self.columns)
        matrix, _ = Entries(self.path, low, high, self.values, self.lines).triangle(size, "upper")
        sides = "one triangle" if np.unique(np.sign(self.rows - self.columns)[off]).size < 2 else "one half"
        return matrix, f"{self.path.name}: {sides} of {size} x {size} mirrored, {int(off.sum())} entries"


def table(
    path: Path, lines: Sequence[str], first: int, columns: int, delimiter: str | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return numbers, (k, columns), of lines from the place `first` on, and the number of each line.

    Empty lines are left out.

    Raise `InputError` if a line has another number of fields, or one that is no number.
    """
    kept = [(k + 1, line) for k, line in enumerate(lines) if k >= first and line.strip()]
    numbers = np.array([k for k, _ in kept], dtype=np.int64)
    if not kept:
        return np.zeros((0, columns)), numbers
    try:
        found = np.loadtxt([line for _, line in kept], delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        found = np.zeros((0, 0))
    if found.shape == (len(kept), columns):
        return found, numbers
    for number, line in kept:
        fields = line.split(delimiter)
        if len(fields) != columns or not all(map(is_number, fields)):
            raise InputError(
                f"{path}, line {number}: expected {columns} numbers, got {described(line.strip())}"
            )
    raise InputError(f"{path}: not readable as lines of {columns} numbers")


def whole(path: Path, column: Real, lines: NDArray[np.int64], what: str) -> NDArray[np.int64]:
    """Return a column of whole numbers.

    Raise `InputError` naming the line of one that is none.
    """
    wrong = ~(np.abs(column) < 2.0**53) | (column != np.round(column))
    if wrong.any():
        k = int(np.flatnonzero(wrong)[0])
        raise InputError(f"{path}, line {lines[k]}: expected a whole number as {what}, got {column[k]:g}")
    return column.astype(np.int64)


def coordinates(path: Path, lines: Sequence[str], first: int) -> Entries:
    """Return the entries of lines ``row column value`` from the place `first` on, counted from 1.

    Raise `InputError` if a line is something else.
    """
    found, numbers = table(path, lines, first, 3)
    rows = whole(path, found[:, 0], numbers, "row")
    columns = whole(path, found[:, 1], numbers, "column")
    return Entries(path, rows - 1, columns - 1, found[:, 2], numbers)


def check_triangles(place: str, matrix: scipy.sparse.csr_array) -> None:
    """Refuse a matrix all of whose coupling is in one triangle: the other one was not written.

    Raise `InputError` beginning with `place`.
    """
    entries = matrix.tocoo()
    sides = np.sign(entries.coords[1] - entries.coords[0])[entries.data != 0.0]
    if (sides != 0).any() and not ((sides > 0).any() and (sides < 0).any()):
        triangle = "upper" if sides.max() > 0 else "lower"
        raise InputError(
            f"{place} is one triangle: it has entries in the {triangle} one alone, in a file of all entries; "
            "write the other triangle too, as A + A.T without the second diagonal"
        )


def symmetric_parts(
    name: str, matrix: scipy.sparse.csr_array
) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array | None, str | None]:
    """Return the symmetric part, the skew one where it is more than rounding, and what was done."""
    skew = (0.5 * (matrix - matrix.T)).tocsr()
    size = np.abs(skew.data).max(initial=0.0)
    whole_part = (0.5 * (matrix + matrix.T)).tocsr()
    if size <= ROUNDING * np.abs(matrix.data).max(initial=0.0):
        return whole_part, None, None
    skew.eliminate_zeros()
    return (
        whole_part,
        skew,
        f"{name}: unsymmetric, split into symmetric and skew part (largest entry {size:.3g})",
    )
