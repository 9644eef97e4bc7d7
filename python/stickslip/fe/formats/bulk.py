"""Constraints of the bulk data of Nastran: MPC, RBE2, RBE3, RBAR, and local systems of displacements.

After the MSC Nastran Quick Reference Guide, of the cards' names. Displacements and matrices of a node are
along the axes of its system CD.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.fe.formats.constraints import Constraints, Dof, Relation, axes_of, cylinder_axes, place_of
from stickslip.fe.formats.punch import fields_of, number_of
from stickslip.scene.checks import Real

#: Names of files of bulk data.
BULK = (".bdf", ".nas", ".fem")
#: Cards that make displacements functions of others and are not read.
UNREAD = ("MPCADD", "RBE1", "RROD", "RTRPLT", "RSPLINE", "RSSCON", "RJOINT", "GRDSET")
#: A weighted mean of displacements has no rotation where this part of its matrix is singular.
SINGULAR = 1e-10


def bulk_constraints(path: Path, points: Mapping[int, Any], dofs: Set[Dof]) -> Constraints:
    """Return the constraints of bulk data, and what of it is not covered.

    `points` are in the basic system, by node; `dofs` are the displacements that the matrices have.

    Raise `InputError` if the points of the file are in another system than the basic one, or a card is
    damaged.
    """
    return _Bulk(list(_cards(path)), points, dofs).found


class _Bulk:
    """Relations of the cards of bulk data."""

    def __init__(
        self, cards: list[tuple[str, str, list[str]]], points: Mapping[int, Any], dofs: Set[Dof]
    ) -> None:
        self.points, self.dofs, self.found = points, dofs, Constraints()
        self.systems = {
            _whole(place, fields[0]): (place, head, fields)
            for place, head, fields in cards
            if head.startswith("CORD")
        }
        for place, head, fields in cards:
            if head == "GRID":
                self.grid(place, fields)
        sets = {fields[0] for _, head, fields in cards if head == "MPC"}
        readers = {"MPC": self.mpc, "RBE2": self.rbe2, "RBE3": self.rbe3, "RBAR": self.rbar}
        for place, head, fields in cards:
            if head in ("SPC", "SPC1"):
                self.found.held |= set(_held(place, head, fields))
            try:
                if head in UNREAD or (head == "MPC" and len(sets) > 1):
                    reason = (
                        "has several sets; keep the one in use" if head == "MPC" else "is not read; write MPC"
                    )
                    raise InputError(f"{place} {reason}")
                if head in readers:
                    self.found.relations += list(readers[head](place, fields))
            except InputError as error:
                self.found.uncovered.append(str(error))

    def grid(self, place: str, fields: list[str]) -> None:
        node, system, own = (_whole(place, fields[k] or "0") for k in (0, 1, 5))
        if system:
            raise InputError(
                f"{place}: its point is in the system {system}; write points in the basic system"
            )
        if own:
            self.found.axes[node] = self.axes_of_system(place, own, node)
        self.found.held |= {(node, int(k)) for k in fields[6]}

    def axes_of_system(self, place: str, number: int, node: int) -> Real:
        """Return the axes of a node in a system of displacements, (3, 3) as rows."""
        where, head, fields = self.systems.get(number, (place, "", []))
        if head not in ("CORD2R", "CORD2C") or fields[1] not in ("", "0"):
            raise InputError(
                f"{place}: its system of displacements {number} is not read; write CORD2R or CORD2C, "
                "relative to the basic system"
            )
        a, b, c = np.array([number_of(where, one or "0") for one in fields[2:11]]).reshape(3, 3)
        if head == "CORD2C":
            return cylinder_axes(place, a, b, place_of(self.points, place, node))
        # Rows along z, x and y.
        return axes_of(where, b - a, c - a)[[1, 2, 0]]

    def axes(self, node: int) -> Real:
        return self.found.axes.get(node, np.eye(3))

    def arm(self, place: str, node: int, reference: int) -> Real:
        return place_of(self.points, place, node) - place_of(self.points, place, reference)

    def mpc(self, place: str, fields: list[str]) -> Iterator[Relation]:
        # Node, direction and factor, two of them in every eight fields, which begin and end with others.
        parts = [fields[k : k + 3] for first in range(0, len(fields), 8) for k in (first + 1, first + 4)]
        terms = [
            ((_whole(place, node), max(1, _whole(place, direction or "0"))), number_of(place, factor))
            for node, direction, factor in (part for part in parts if part and part[0])
        ]
        yield Relation(place, tuple(terms))

    def rbe2(self, place: str, fields: list[str]) -> Iterator[Relation]:
        for node in _numbers(place, fields[3:]):
            yield from self.rigid(place, node, _whole(place, fields[1]), fields[2])

    def rbar(self, place: str, fields: list[str]) -> Iterator[Relation]:
        first, second, *components = fields[1:7]
        if components[:2] != ["123456", ""]:
            raise InputError(f"{place}: its independent directions are not those of one node; write MPC")
        yield from self.rigid(place, _whole(place, second), _whole(place, first), components[3] or "123456")

    def rigid(self, place: str, node: int, reference: int, components: str) -> Iterator[Relation]:
        """Give the relations of a node that moves with a reference node as a rigid body."""
        arm = self.arm(place, node, reference)
        for dof, row in self.rows(node, arm, components):
            yield Relation(place, ((dof, 1.0), *self.terms(reference, -row)))

    def rows(self, node: int, arm: Real, components: str) -> Iterator[tuple[Dof, Real]]:
        """Give displacements of a node as (6,) factors of those of a rigid body at the end of its arm."""
        for k in map(int, components):
            if k <= 3:
                axis = self.axes(node)[k - 1]
                yield (node, k), np.concatenate([axis, np.cross(arm, axis)])
            elif (node, k) in self.dofs:
                yield (node, k), np.concatenate([np.zeros(3), self.axes(node)[k - 4]])

    def terms(self, node: int, factors: Real) -> list[tuple[Dof, float]]:
        """Return (6,) factors of displacements and rotations along global axes, along those of a node."""
        own = np.concatenate([self.axes(node) @ factors[:3], self.axes(node) @ factors[3:]])
        return [((node, k + 1), float(factor)) for k, factor in enumerate(own) if abs(factor) > 1e-14]

    def rbe3(self, place: str, fields: list[str]) -> Iterator[Relation]:
        """Give the relations of a node that moves as the weighted mean of others.

        ``A q = sum of w s' u`` with ``A = sum of w s' s``, where ``u = s q`` were the others rigid.
        """
        reference, components = _whole(place, fields[2]), fields[3]
        matrix, loads = np.zeros((6, 6)), dict[Dof, Any]()
        for weight, which, nodes in _groups(place, fields[4:]):
            if set(which) - set("123"):
                raise InputError(f"{place}: means of rotations are not read; write directions 1 to 3 alone")
            for node in nodes:
                for dof, row in self.rows(node, self.arm(place, node, reference), which):
                    matrix += weight * np.outer(row, row)
                    loads[dof] = loads.get(dof, 0.0) + weight * row
        scale = np.sqrt(np.diag(matrix))
        if not scale.all() or np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0] < SINGULAR:
            raise InputError(f"{place}: its nodes say no rotation; write MPC")
        parts = {dof: np.linalg.solve(matrix, load) for dof, load in loads.items()}
        for dof, row in self.rows(reference, np.zeros(3), components):
            yield Relation(place, ((dof, 1.0), *((one, -float(row @ part)) for one, part in parts.items())))


def _cards(path: Path) -> Iterator[tuple[str, str, list[str]]]:
    """Give file, line and name of every card, its name, and its fields, at least eight."""
    lines = path.read_text(encoding="utf-8", errors="replace").upper().splitlines()
    begin = next((k + 1 for k, line in enumerate(lines) if line.startswith("BEGIN")), 0)
    card: tuple[str, str, list[str]] | None = None
    for k, line in enumerate([*lines[begin:], "ENDDATA"], begin + 1):
        line = line.partition("$")[0].expandtabs(8)
        if not line.strip():
            continue
        head, fields = fields_of(line)
        # A line of wide fields has four of them.
        fields = fields[: 4 if "*" in line.split(",")[0][:8] else 8]
        if head[:1] in ("", "+", "*") and card:
            card[2].extend(fields)
            continue
        if card:
            card[2].extend([""] * (-len(card[2]) % 8))
            yield card
        card = f"{path.name}, line {k}: {head}", head, fields


def _groups(place: str, fields: list[str]) -> Iterator[tuple[float, str, list[int]]]:
    """Give weight, directions and nodes of the groups of an RBE3."""
    kept = [one for one in fields if one]
    if {"UM"} & set(kept):
        raise InputError(f"{place}: UM is not read; let the reference node depend")
    kept = kept[: kept.index("ALPHA")] if "ALPHA" in kept else kept
    starts = [k for k, one in enumerate(kept) if "." in one]
    for start, end in zip(starts, [*starts[1:], len(kept)], strict=True):
        nodes = _numbers(place, kept[start + 2 : end])
        yield number_of(place, kept[start]), kept[start + 1], list(nodes)


def _held(place: str, head: str, fields: list[str]) -> Iterator[Dof]:
    if head == "SPC1":
        nodes, directions = _numbers(place, fields[2:]), fields[1]
        yield from ((node, max(1, int(k))) for node in nodes for k in directions or "0")
        return
    for node, directions in (fields[1:3], fields[4:6]):
        if node:
            yield from ((_whole(place, node), max(1, int(k))) for k in directions or "0")


def _numbers(place: str, fields: Iterable[str]) -> Iterator[int]:
    """Give node numbers, "THRU" between two of them standing for all; a real number ends them."""
    found: list[int] = []
    through = False
    for one in fields:
        if "." in one:
            break
        if one == "THRU":
            through = True
        elif one:
            number = _whole(place, one)
            found += range(found[-1] + 1, number + 1) if through else [number]
            through = False
    yield from found


def _whole(place: str, text: str) -> int:
    if not text.isdecimal():
        raise InputError(f"{place}: expected a whole number, got {text!r}")
    return int(text)
