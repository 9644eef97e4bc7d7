"""Meshes of other programs with the numbers of their nodes; ties, sets and surfaces of a deck."""

from __future__ import annotations

import contextlib
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import package
from stickslip.show.mesh import FACES, boundary_faces

#: Cards of a deck that make dofs of some nodes functions of those of others, or turn their axes.
DEPENDENCES = ("EQUATION", "MPC", "TIE", "RIGID BODY", "COUPLING", "KINEMATIC COUPLING", "TRANSFORM")
#: Directions that a boundary condition of Abaqus holds by its name.
CONDITIONS = {
    "ENCASTRE": (1, 2, 3, 4, 5, 6),
    "PINNED": (1, 2, 3),
    "XSYMM": (1, 5, 6),
    "YSYMM": (2, 4, 6),
    "ZSYMM": (3, 4, 5),
}
#: Solid elements of Abaqus and CalculiX by their number of nodes: corners of the faces S1, S2, ..., which are
#: those of meshio, run around the other way.
SOLIDS = {
    size: {f"S{k + 1}": (first, *rest[::-1]) for k, (first, *rest) in enumerate(FACES[kind])}
    for kind, sizes in {"tetra": (4, 10), "wedge": (6, 15), "hexahedron": (8, 20)}.items()
    for size in sizes
}


class Card(NamedTuple):
    """A card of a deck."""

    #: File, line and keyword.
    place: str
    #: Its keyword, in capitals like all of it.
    keyword: str
    #: What stands beside the keyword.
    options: dict[str, str]
    #: The fields of its lines.
    rows: list[list[str]]


@dataclass
class Deck:
    """Nodes of a CalculiX or Abaqus deck, what holds or ties them, and what is named in it."""

    #: Node numbers in the order of the file.
    numbers: list[int] = field(default_factory=list)
    #: Node and direction of what `*BOUNDARY` holds.
    held: set[tuple[int, int]] = field(default_factory=set)
    #: The cards that tie dofs to others or turn the axes of nodes.
    constraints: list[Card] = field(default_factory=list)
    #: Node and direction of the dofs of a `ROT NODE`, which are rotations.
    rotations: set[tuple[int, int]] = field(default_factory=set)
    #: Nodes by the name of their set.
    sets: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    #: Facets, as node numbers, by the name of a surface of solid elements.
    faces: dict[str, list[tuple[int, ...]]] = field(default_factory=dict)
    #: Names of surfaces that are neither of nodes nor of faces of solid elements of the deck.
    unread: list[str] = field(default_factory=list)

    def nodes(self, place: str, name: str) -> list[int]:
        """Return the nodes of a set, or the node of a number.

        Raise `InputError` if there is no such set.
        """
        if name in self.sets:
            return self.sets[name]
        if not name.isdecimal():
            raise InputError(f"{place}: there is no set of nodes {name!r}")
        return [int(name)]

    def surfaces(self, cells: Mapping[str, Any]) -> dict[str, list[Any]]:
        """Return parts of the boundary of a mesh by name, as facets of one kind, or else as nodes.

        The facets of a set of nodes are the faces of the boundary that have all their corners in the set.
        """
        found: dict[str, list[Any]] = {}
        known = set(self.numbers)
        named = {name: known.intersection(nodes) for name, nodes in self.sets.items() if name}
        boundary = [face.tolist() for face in boundary_faces(cells)] if named else []
        for name, within in named.items():
            facets = [face for face in boundary if within.issuperset(face)]
            alike = len({len(face) for face in facets}) == 1
            found[name] = facets if alike else sorted(within)
        return {name: nodes for name, nodes in (found | self.faces).items() if nodes}


def read_deck(path: Path) -> Deck:
    """Return node numbers, boundary conditions, constraints, sets and surfaces of a deck.

    Raise `InputError` if a node has no number or comes twice, or an element has too few nodes.
    """
    deck = Deck()
    sets, solids, groups = deck.sets, dict[int, list[int]](), defaultdict[str, list[int]](list)
    for number, card, options, rows in _cards(path):
        if card == "NODE":
            nodes = [_number(path, number, row[0]) for row in rows]
            deck.numbers += nodes
            sets[options.get("NSET", "")] += nodes
        elif card == "NSET":
            sets[options.get("NSET", "")] += _members(path, number, options, rows, sets)
        elif card == "ELEMENT":
            new = _solids(path, number, options.get("TYPE", ""), rows)
            solids |= new
            groups[options.get("ELSET", "")] += new
        elif card == "ELSET":
            groups[options.get("ELSET", "")] += _members(path, number, options, rows, groups)
        elif card == "SURFACE" and "NAME" in options:
            kind = "COMBINE" if "COMBINE" in options else options.get("TYPE", "ELEMENT")
            nodes, facets = [], []
            # Members may have names of instances, which are not known here.
            with contextlib.suppress(InputError):
                if kind == "NODE":
                    nodes = [node for row in rows for node in _nodes(path, number, row[0], sets)]
                elif kind == "ELEMENT":
                    facets = _facets(path, number, rows, solids, groups)
            if nodes:
                sets[options["NAME"]] += nodes
            elif facets:
                deck.faces[options["NAME"]] = facets
            else:
                deck.unread.append(options["NAME"])
        elif card == "BOUNDARY":
            for where, *what in rows:
                directions = _directions(path, number, what)
                deck.held |= {(node, k) for node in _nodes(path, number, where, sets) for k in directions}
        elif card in DEPENDENCES:
            deck.constraints.append(Card(f"{path.name}, line {number}: *{card}", card, options, rows))
            if node := options.get("ROT NODE"):
                deck.rotations |= {(_number(path, number, node), k) for k in (1, 2, 3)}
    if len(set(deck.numbers)) < len(deck.numbers):
        twice = next(node for k, node in enumerate(deck.numbers) if node in deck.numbers[:k])
        raise InputError(f"{path}: node {twice} comes twice")
    return deck


def numbered_mesh(mesh: Any) -> tuple[dict[int, Any], dict[str, Any], Deck | None]:
    """Return points by node number, cells as node numbers, and the deck of a mesh of meshio.

    Raise `InputError` if there is no such file, meshio cannot read it, or it reads other nodes than the deck
    has.
    """
    deck = None
    if isinstance(mesh, str | Path):
        path = Path(mesh)
        meshio = package("meshio", f"{mesh}", "fe")
        if not path.is_file():
            raise InputError(f"{mesh}: no such file")
        try:
            mesh = meshio.read(path)
        except (Exception, SystemExit) as error:  # meshio ends the process where no reader of it succeeds.
            raise InputError(f"{path}: meshio cannot read it: {error!r}") from error
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


def _members(
    path: Path, line: int, options: dict[str, str], rows: list[list[str]], sets: dict[str, list[int]]
) -> list[int]:
    """Return the numbers in a set of nodes or elements: each by itself or by a set, or generated."""
    if "GENERATE" not in options:
        return [one for row in rows for text in row for one in _nodes(path, line, text, sets)]
    ends = ([_number(path, line, one) for one in row] for row in rows)
    return [one for first, last, *step in ends for one in range(first, last + 1, *step)]


def _solids(path: Path, line: int, kind: str, rows: list[list[str]]) -> dict[int, list[int]]:
    """Return the nodes of solid elements by their number; an element may go on in the next line."""
    # C3D15V has a varying number of nodes.
    match = re.match(r"C3D(\d+)(?!V)", kind)
    if not match or int(match[1]) not in SOLIDS:
        return {}
    numbers = [_number(path, line, one) for row in rows for one in row]
    size = int(match[1]) + 1
    if len(numbers) % size:
        raise InputError(f"{path}, line {line}: expected a number and {size - 1} nodes of each {kind}")
    return {numbers[k]: numbers[k + 1 : k + size] for k in range(0, len(numbers), size)}


def _facets(
    path: Path,
    line: int,
    rows: list[list[str]],
    solids: Mapping[int, list[int]],
    groups: dict[str, list[int]],
) -> list[tuple[int, ...]]:
    """Return the corners of the faces in a surface; none where it has other elements, or unlike faces."""
    found: list[tuple[int, ...]] = []
    for where, *side in rows:
        for element in _nodes(path, line, where, groups):
            nodes = solids.get(element, [])
            corners = SOLIDS.get(len(nodes), {}).get(side[0] if side else "")
            if corners is None:
                return []
            found.append(tuple(nodes[k] for k in corners))
    return found if len({len(face) for face in found}) == 1 else []


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
            f"{path}, line {line}: expected the number of a node, of an element or a set, got {text!r}"
        ) from None
