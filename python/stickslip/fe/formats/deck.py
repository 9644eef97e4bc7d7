"""Meshes of other programs with the numbers of their nodes, and which dofs of a deck depend on others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import package

#: Cards of a deck that make dofs of some nodes functions of those of others.
DEPENDENCES = ("EQUATION", "MPC", "TIE", "RIGID BODY", "COUPLING", "KINEMATIC COUPLING")
#: Directions that a boundary condition of Abaqus holds by its name.
CONDITIONS = {
    "ENCASTRE": (1, 2, 3, 4, 5, 6),
    "PINNED": (1, 2, 3),
    "XSYMM": (1, 5, 6),
    "YSYMM": (2, 4, 6),
    "ZSYMM": (3, 4, 5),
}


@dataclass
class Deck:
    """Nodes of a CalculiX or Abaqus deck, and what holds or ties them.

    Attributes
    ----------
    numbers
        Node numbers in the order of the file.
    held
        Node and direction of what `*BOUNDARY` holds.
    dependence
        The first card that ties dofs to others, with its line; None: there is none.
    rotations
        Node and direction of the dofs of a `ROT NODE`, which are rotations.
    """

    numbers: list[int] = field(default_factory=list)
    held: set[tuple[int, int]] = field(default_factory=set)
    dependence: str | None = None
    rotations: set[tuple[int, int]] = field(default_factory=set)

    def dependent(self, dofs: tuple[str, ...]) -> list[str]:
        """Return the displacements that neither are among the dofs nor held: they depend on others."""
        if self.dependence is None:
            return []
        known, held = set(dofs), self.held
        missing = ((node, k) for node in self.numbers for k in (1, 2, 3) if f"{node}.{k}" not in known)
        return [f"{node}.{k}" for node, k in (*(one for one in missing if one not in held), *self.rotations)]


def read_deck(path: Path) -> Deck:
    """Return node numbers, boundary conditions and dependences of a deck.

    Raises
    ------
    InputError
        If a node has no number or comes twice.
    """
    deck, sets = Deck(), defaultdict[str, list[int]](list)
    for number, card, options, rows in _cards(path):
        if card == "NODE":
            nodes = [_number(path, number, row[0]) for row in rows]
            deck.numbers += nodes
            sets[options.get("NSET", "")] += nodes
        elif card == "NSET":
            for row in rows:
                if "GENERATE" in options:
                    first, last, *step = [_number(path, number, one) for one in row]
                    sets[options["NSET"]] += range(first, last + 1, *step)
                else:
                    sets[options["NSET"]] += [node for one in row for node in _nodes(path, number, one, sets)]
        elif card == "BOUNDARY":
            for where, *what in rows:
                directions = _directions(path, number, what)
                deck.held |= {(node, k) for node in _nodes(path, number, where, sets) for k in directions}
        elif card in DEPENDENCES:
            deck.dependence = deck.dependence or f"{path.name}, line {number}: *{card}"
            if node := options.get("ROT NODE"):
                deck.rotations |= {(_number(path, number, node), k) for k in (1, 2, 3)}
    if len(set(deck.numbers)) < len(deck.numbers):
        twice = next(node for k, node in enumerate(deck.numbers) if node in deck.numbers[:k])
        raise InputError(f"{path}: node {twice} comes twice")
    return deck


def numbered_mesh(mesh: Any) -> tuple[dict[int, Any], dict[str, Any], Deck | None]:
    """Return points by node number, cells as node numbers, and the deck of a mesh of meshio.

    Raises
    ------
    InputError
        If there is no such file, or meshio reads other nodes than the deck has.
    """
    deck = None
    if isinstance(mesh, str | Path):
        path = Path(mesh)
        meshio = package("meshio", f"{mesh}", "fe")
        if not path.is_file():
            raise InputError(f"{mesh}: no such file")
        mesh = meshio.read(path)
        if path.suffix.lower() == ".inp":
            deck = read_deck(path)
            if len(deck.numbers) != len(mesh.points):
                raise InputError(
                    f"{path}: the deck has {len(deck.numbers)} nodes, meshio reads {len(mesh.points)}; write "
                    "all nodes into one block *NODE of the deck itself"
                )
    points = np.asarray(mesh.points, dtype=float)
    # meshio keeps the numbers of Nastran; those of other formats are lost.
    numbers = np.array(deck.numbers if deck else getattr(mesh, "points_id", np.arange(1, len(points) + 1)))
    cells: dict[str, Any] = {}
    for block in mesh.cells:
        nodes = numbers[np.asarray(block.data)]
        cells[block.type] = np.concatenate([cells[block.type], nodes]) if block.type in cells else nodes
    return dict(zip(numbers.tolist(), points, strict=True)), cells, deck


def _cards(path: Path) -> Iterator[tuple[int, str, dict[str, str], list[list[str]]]]:
    """Give line, keyword, options and fields of the lines of every card, in capitals."""
    held: tuple[int, str, dict[str, str], list[list[str]]] | None = None
    lines = path.read_text(encoding="utf-8", errors="replace").upper().splitlines()
    for k, line in enumerate(lines):
        if line.startswith("**") or not line.strip():
            continue
        fields = [one.strip() for one in line.split(",")]
        if line.lstrip().startswith("*"):
            if held:
                yield held
            options = {
                name.strip(): value.strip() for name, _, value in (one.partition("=") for one in fields[1:])
            }
            held = (k + 1, fields[0].lstrip("*").strip(), options, [])
        elif held:
            held[3].append(fields if fields[-1] else fields[:-1])
    if held:
        yield held


def _directions(path: Path, line: int, what: list[str]) -> Iterable[int]:
    """Return the directions of a boundary condition: a name, or the first and the last one."""
    if what and what[0] in CONDITIONS:
        return CONDITIONS[what[0]]
    ends = [_number(path, line, one) for one in what[:2] if one]
    return range(ends[0], ends[-1] + 1) if ends else ()


def _nodes(path: Path, line: int, where: str, sets: dict[str, list[int]]) -> list[int]:
    return sets[where] if where in sets else [_number(path, line, where)]


def _number(path: Path, line: int, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(
            f"{path}, line {line}: expected the number of a node or a set, got {text!r}"
        ) from None
