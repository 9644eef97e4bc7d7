"""Matrices that Nastran punches: DMIG cards in small, large or free fields.

A card ``DMIG name 0 form type`` announces a matrix, square or symmetric (forms 1 and 6), real in single or
double precision (types 1 and 2). Every other card has one column: its node and direction, and then node,
direction and value of its rows. Of a symmetric matrix one half stands there (MSC Nastran Quick Reference
Guide, DMIG).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.fe.formats.entries import Entries, read_lines
from stickslip.scene.checks import described

#: Forms of the matrices that are read.
SQUARE, SYMMETRIC = "1", "6"
#: Types of real matrices.
REAL = ("1", "2")
#: A number of Nastran, whose exponent may lack its letter.
_NUMBER = re.compile(r"^([+-]?(?:\d+\.?\d*|\.\d+))(?:[EDed]?([+-]\d+)|[EDed](\d+))?$")


@dataclass
class _Matrix:
    form: str
    columns: list[tuple[int, int]] = field(default_factory=list)
    rows: list[tuple[int, int]] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)


def read_punch(path: Path) -> dict[str, tuple[scipy.sparse.csr_array, tuple[str, ...], str]]:
    """Return for each matrix of a file its entries, the names of its dofs, and what was mirrored.

    A scalar point, whose direction is 0, has the direction 1.

    Raise `InputError` if a matrix is complex, rectangular or not announced, or a card is damaged. It names
    file and line.
    """
    matrices: dict[str, _Matrix] = {}
    current: tuple[_Matrix, tuple[int, int]] | None = None
    for number, line in enumerate(read_lines(path), 1):
        place = f"{path}, line {number}"
        if not line.strip() or line.startswith("$"):
            continue
        head, fields = fields_of(line)
        if head == "DMIG":
            name, second = fields[0].upper(), fields[1]
            if second == "0":
                current, matrices[name] = None, _announced(place, matrices, name, fields)
                continue
            if name not in matrices:
                raise InputError(f"{place}: no card before announces the matrix {described(name)}")
            current = matrices[name], _dof(place, fields[1:3])
            fields = fields[4:]
        elif head not in ("", "*", "+") or current is None:
            # Another card, and what continues it.
            current = None
            continue
        matrix, column = current
        for k in range(0, len(fields) - 2, 4):
            node, direction, value = fields[k : k + 3]
            if node or direction or value:
                matrix.columns.append(column)
                matrix.rows.append(_dof(place, [node, direction]))
                matrix.values.append(number_of(place, value))
                matrix.lines.append(number)
    return {name: _assembled(path, name, matrix) for name, matrix in matrices.items()}


def fields_of(line: str) -> tuple[str, list[str]]:
    """Return the first field without its star, and the others, at least eight."""
    if "," in line:
        first, *others = line.split(",")
    else:
        first, width = line[:8], 16 if "*" in line[:8] else 8
        others = [line[k : k + width] for k in range(8, 72, width)]
    head = first.strip().upper()
    found = [one.strip() for one in others]
    return head.rstrip("*") or head, found + [""] * (8 - len(found))


def _announced(place: str, matrices: dict[str, _Matrix], name: str, fields: list[str]) -> _Matrix:
    if name in matrices:
        raise InputError(f"{place}: the matrix {name} came before")
    form, kind = fields[2:4]
    if form not in (SQUARE, SYMMETRIC) or kind not in REAL:
        raise InputError(
            f"{place}: expected a square or symmetric real matrix (forms 1, 6; types 1, 2), got form"
            f" {described(form)}, type {described(kind)}"
        )
    return _Matrix(form)


def _dof(place: str, fields: list[str]) -> tuple[int, int]:
    node, direction = fields
    if not node.isdecimal() or direction not in ("", *"0123456"):
        raise InputError(
            f"{place}: expected node and direction 0 to 6, got {described(node)} and {described(direction)}"
        )
    return int(node), max(int(direction or 0), 1)


def number_of(place: str, told: str) -> float:
    """Return a number of Nastran, whose exponent may lack its letter."""
    match = _NUMBER.match(told)
    if match is None:
        raise InputError(f"{place}: expected a number, got {described(told)}")
    return float(f"{match[1]}e{match[2] or match[3] or 0}")


def _assembled(path: Path, name: str, matrix: _Matrix) -> tuple[scipy.sparse.csr_array, tuple[str, ...], str]:
    if not matrix.values:
        raise InputError(f"{path}: the matrix {name} has no entries")
    ends = np.array([matrix.rows, matrix.columns]).transpose(1, 0, 2)
    entries, names = Entries.of_dofs(path, ends, np.array(matrix.values), np.array(matrix.lines))
    size = len(names)
    if matrix.form == SYMMETRIC:
        found, note = entries.either(size)
        return found, names, note.replace(path.name, f"{path.name}, {name}")
    return entries.full(size), names, f"{path.name}, {name}: all entries of {size} x {size}, nothing mirrored"
