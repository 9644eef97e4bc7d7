"""Matrices in Harwell-Boeing files, real and assembled: symmetric (lower triangle) and unsymmetric.

Ansys writes them by ``HBMAT``, with the dofs of its equations in a file of their own.

I. S. Duff, R. G. Grimes, J. G. Lewis, Users' Guide for the Harwell-Boeing Sparse Matrix Collection, 1992.
`scipy.io.hb_read` refuses symmetric ones.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from stickslip.faults import InputError
from stickslip.fe.formats.entries import Entries, read_lines
from stickslip.scene.checks import described

#: A Fortran format of equal fields: (1P,5E16.8), (16I5), (4D20.12).
FORMAT = re.compile(r"^\((?:\d*P,?)?(\d*)([IEDFG])(\d+)(?:\.\d+(?:E\d+)?)?\)$")


#: Directions of the dofs of Ansys.
LABELS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6}


def read_mapping(path: Path) -> tuple[str, ...]:
    """Return the names of the dofs of a mapping file of Ansys: a head, and lines ``equation node label``.

    Raise `InputError` if a line is another one, or an equation comes out of order.
    """
    found: list[str] = []
    for number, line in enumerate(read_lines(path)[1:], 2):
        if not (fields := line.split()):
            continue
        equation, *others = fields
        node, label = others if len(others) == 2 else ("", "")
        if equation != str(len(found) + 1) or not node.isdecimal() or label not in LABELS:
            raise InputError(
                f"{path}, line {number}: expected equation {len(found) + 1}, a node and one of"
                f" {', '.join(LABELS)}, got {described(line.strip())}"
            )
        found.append(f"{node}.{LABELS[label]}")
    return tuple(found)


def read_harwell_boeing(path: Path) -> tuple[scipy.sparse.csr_array, str]:
    """Return the matrix of a file, and what was mirrored.

    Raise `InputError` if the file is damaged, has another number of lines or entries than its head says, is
    complex, rectangular or elemental, or holds an entry twice or in the other triangle.
    """
    lines = read_lines(path)
    while lines and not lines[-1].strip():
        lines.pop()
    if len(lines) < 4:
        raise InputError(f"{path}: a Harwell-Boeing file has a head of four lines, got {len(lines)} lines")
    counts = _integers(path, lines, 1, [14] * 5, 4)
    pointer_lines, index_lines, value_lines = counts[1:4]
    right_lines = counts[4] if len(counts) > 4 else 0
    kind = lines[2][:3].strip().upper()
    if kind not in ("RSA", "RUA"):
        raise InputError(
            f"{path}, line 3: expected a real assembled matrix, RSA or RUA, got {described(kind)}"
        )
    rows, columns, entries = _integers(path, [lines[2][14:]], 0, [14] * 3, 3, 3)
    if rows != columns or rows < 1:
        raise InputError(f"{path}, line 3: expected a square matrix, got {rows} rows and {columns} columns")
    head = 5 if right_lines else 4
    expected = head + pointer_lines + index_lines + value_lines + right_lines
    if len(lines) != expected:
        raise InputError(f"{path}: its head announces {expected} lines, it has {len(lines)}")
    fields = [lines[3][:16], lines[3][16:32], lines[3][32:52]]
    starts = np.cumsum([head, pointer_lines, index_lines])
    pointers, _ = _fields(path, lines, starts[0], pointer_lines, fields[0], columns + 1)
    indices, _ = _fields(path, lines, starts[1], index_lines, fields[1], entries)
    values, places = _fields(path, lines, starts[2], value_lines, fields[2], entries)
    at = pointers.astype(np.int64) - 1
    if at[0] != 0 or at[-1] != entries or (np.diff(at) < 0).any():
        raise InputError(
            f"{path}, line {head + 1}: pointers of columns must ascend from 1 to {entries + 1}, "
            f"got {at[0] + 1} to {at[-1] + 1}"
        )
    found = Entries(
        path, indices.astype(np.int64) - 1, np.repeat(np.arange(columns), np.diff(at)), values, places
    )
    if kind == "RSA":
        return found.triangle(rows, "lower")
    return found.full(rows), f"{path.name}: all entries of {rows} x {rows}, nothing mirrored"


def _integers(
    path: Path, lines: Sequence[str], line: int, widths: Sequence[int], least: int, number: int | None = None
) -> list[int]:
    """Return integers of a fixed width each from one line of the head."""
    found: list[int] = []
    at = 0
    for width in widths:
        text = lines[line][at : at + width].strip()
        at += width
        if not text and len(found) >= least:
            break
        if not text.isdecimal():
            raise InputError(f"{path}, line {number or line + 1}: expected a count, got {described(text)}")
        found.append(int(text))
    return found


def _fields(
    path: Path, lines: Sequence[str], first: int, count: int, text: str, expected: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the numbers of lines in a Fortran format, and the line of each."""
    match = FORMAT.match(text.strip().upper().replace(" ", ""))
    if match is None or int(match[3]) < 1:
        raise InputError(
            f"{path}, line 4: expected a format such as (16I5) or (4E20.12), got {described(text)}"
        )
    width = int(match[3])
    each = int(match[1] or 1)
    numbers: list[float] = []
    places: list[int] = []
    for k in range(first, first + count):
        line = lines[k].rstrip()
        if len(line) > width * each:
            raise InputError(f"{path}, line {k + 1}: longer than {each} fields of {width} letters")
        for at in range(0, len(line), width):
            field = line[at : at + width].strip()
            try:
                # Fortran writes exponents with D, and leaves the letter out where they have three digits.
                plain = re.sub(r"(?<=[\d.])([+-]\d{3})$", r"E\1", field.upper().replace("D", "E"))
                numbers.append(float(int(plain)) if match[2] == "I" else float(plain))
            except ValueError:
                raise InputError(f"{path}, line {k + 1}: expected a number, got {described(field)}") from None
            places.append(k + 1)
    if len(numbers) != expected:
        raise InputError(
            f"{path}, line {first + count}: its head announces {expected} numbers in {text.strip()}, "
            f"it has {len(numbers)}"
        )
    return np.array(numbers), np.array(places, dtype=np.int64)
