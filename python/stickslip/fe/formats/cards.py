"""Constraints of an Abaqus or CalculiX deck: equations, ties, rigid bodies and local axes of nodes.

After the Abaqus Keywords Reference Guide and the CalculiX CrunchiX User's Manual, of the cards' names.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.faults import InputError
from stickslip.fe.formats.constraints import Constraints, Dof, Relation, axes_of, cylinder_axes, place_of
from stickslip.fe.formats.deck import Card, Deck
from stickslip.fe.pairs import feet
from stickslip.fe.surface import Surface
from stickslip.scene.checks import Real

#: Without another tolerance, nodes are tied that lie off the master by less than this part of a facet's size.
TOLERANCE = 0.05
#: A tied node that lies off the master surface by more than this part of the facet's size is told.
OFF = 1e-6


@dataclass
class _Mesh:
    """What a surface asks of its body."""

    nodes: NDArray[np.int64]
    points: Real | None
    cells: dict[str, NDArray[np.int64]]

    def displacement(self, place: str, node: int, direction: int) -> dict[str, float]:
        return {f"{node}.{direction}": 1.0}


class _Cards:
    """Relations of the cards of a deck with points by node and cells of node numbers."""

    def __init__(
        self, deck: Deck, points: Mapping[int, Any], cells: Mapping[str, Any], dofs: Set[Dof]
    ) -> None:
        self.deck, self.points, self.dofs = deck, points, dofs
        self.found = Constraints(held=set(deck.held))
        # A plane model has no displacements across its plane.
        self.directions = sorted({k for _, k in dofs if k <= 3})
        self.places = {node: k for k, node in enumerate(points)}
        numbers, where = np.array(list(points)), np.array(list(points.values()))
        own = {kind: self._places(nodes) for kind, nodes in cells.items()}
        self.mesh = _Mesh(numbers, where, own)

    def _places(self, nodes: Any) -> NDArray[np.int64]:
        found: NDArray[np.int64] = np.vectorize(self.places.__getitem__, otypes=[np.int64])(nodes)
        return found

    def one(self, place: str, name: str) -> int:
        nodes = self.deck.nodes(place, name)
        if len(nodes) != 1:
            raise InputError(f"{place}: {name!r} has {len(nodes)} nodes; write a line per node")
        return nodes[0]

    def equation(self, card: Card) -> Iterator[Relation]:
        """Read the number of terms and then node, direction and factor of each, four in a line."""
        fields = iter([one for row in card.rows for one in row])
        for count in fields:
            terms = []
            for _ in range(int(_number(card.place, count))):
                where, direction, factor = (next(fields, "") for _ in range(3))
                terms.append(
                    (
                        (self.one(card.place, where), int(_number(card.place, direction))),
                        _number(card.place, factor),
                    )
                )
            if wrong := next((dof for dof, _ in terms if not 1 <= dof[1] <= 6), None):
                raise InputError(f"{card.place}: direction {wrong[1]} of node {wrong[0]} is no displacement")
            yield Relation(card.place, tuple(terms))

    def tie(self, card: Card) -> Iterator[Relation]:
        """Read pairs of a slave surface and a master surface, on which the slave's nodes are projected."""
        if turned := {"CYCLIC SYMMETRY", "MULTISTAGE"} & card.options.keys():
            raise InputError(f"{card.place}: {min(turned)} is not read; export the whole body")
        for row in card.rows:
            slave, master = (self.surface(card.place, name) for name in row[:2])
            if master.facets is None:
                raise InputError(f"{card.place}: the master surface {row[1]} has no faces of solid elements")
            if set(master.numbers) - {node for face in self.deck.faces[row[1]] for node in face}:
                raise InputError(
                    f"{card.place}: the master surface {row[1]} is of quadratic elements; let the surface of "
                    "linear ones be the master, or write the tie as *EQUATION"
                )
            yield from self.projected(card, slave, master)

    def projected(self, card: Card, slave: Surface, master: Surface) -> Iterator[Relation]:
        assert master.facets is not None
        corners = master.points[master.facets]
        sizes = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
        tolerance = card.options.get("POSITION TOLERANCE")
        reach = _number(card.place, tolerance) if tolerance else TOLERANCE * float(sizes.mean())
        weights, _, gaps = feet(slave, master, reach)
        own = set(master.numbers.tolist())
        for node, parts in zip(slave.numbers.tolist(), weights, strict=True):
            if parts and node not in own:
                terms = [(int(master.numbers[k]), -weight) for k, weight in parts]
                for k in self.directions:
                    others = [((other, k), weight) for other, weight in terms]
                    yield Relation(card.place, (((node, k), 1.0), *others), tie=True)
        untied = int(np.isnan(gaps).sum())
        if untied:
            self.found.notes.append(f"{card.place}: {untied} nodes lie farther than {reach:.3g} and are free")
        off = float(np.nanmax(np.abs(gaps), initial=0.0))
        if off > OFF * sizes.mean():
            self.found.notes.append(
                f"{card.place}: nodes lie up to {off:.3g} off the master surface, which hinders rotations of "
                "the whole"
            )

    def surface(self, place: str, name: str) -> Surface:
        if name in self.deck.faces:
            return Surface(self.mesh, name, self._places(self.deck.faces[name]))
        return Surface(self.mesh, name, self._places(sorted(self.deck.nodes(place, name))))

    def rigid_body(self, card: Card) -> Iterator[Relation]:
        """Read a rigid body: nodes follow a reference node and the rotation of a node, or of itself."""
        missing = {"NSET", "REF NODE"} - card.options.keys()
        if missing:
            raise InputError(f"{card.place}: name the nodes by {min(missing)}=")
        reference = self.one(card.place, card.options["REF NODE"])
        rotations = [(reference, k) for k in (4, 5, 6)]
        if "ROT NODE" in card.options:
            rotations = [(self.one(card.place, card.options["ROT NODE"]), k) for k in (1, 2, 3)]
        elif self.dofs.isdisjoint(rotations):
            raise InputError(
                f"{card.place}: no dofs rotate the reference node {reference}; name its ROT NODE"
            )
        for node in self.deck.nodes(card.place, card.options["NSET"]):
            if node != reference:
                yield from self.rigid(card.place, node, reference, rotations)

    def rigid(self, place: str, node: int, reference: int, rotations: Sequence[Dof]) -> Iterator[Relation]:
        arm = place_of(self.points, place, node) - place_of(self.points, place, reference)
        for relation in rigid_relations(place, node, reference, rotations, arm):
            direction = relation.terms[0][0][1]
            if direction in self.directions or (node, direction) in self.dofs:
                yield relation

    def mpc(self, card: Card) -> Iterator[Relation]:
        """Read PIN, TIE, LINEAR and BEAM."""
        for kind, *names in card.rows:
            others = [self.one(card.place, name) for name in names[1:]]
            if kind not in ("PIN", "TIE", "LINEAR", "BEAM") or len(others) != 1 + (kind == "LINEAR"):
                raise InputError(f"{card.place}: {', '.join([kind, *names])} is not read; write *EQUATION")
            for node in self.deck.nodes(card.place, names[0]):
                if kind == "BEAM":
                    rotations = [(others[0], k) for k in (4, 5, 6)]
                    yield from self.rigid(card.place, node, others[0], rotations)
                    continue
                parts = [1.0]
                if kind == "LINEAR":
                    start, end = (place_of(self.points, card.place, other) for other in others)
                    line = end - start
                    along = float((place_of(self.points, card.place, node) - start) @ line / (line @ line))
                    parts = [1.0 - along, along]
                for k in range(1, 7):
                    if k in self.directions or (node, k) in self.dofs:
                        terms = [((other, k), -part) for other, part in zip(others, parts, strict=True)]
                        yield Relation(card.place, (((node, k), 1.0), *terms))

    def transform(self, card: Card) -> Iterator[Relation]:
        """Read the axes of nodes: rectangular, or cylindrical with radial, tangential and axial ones."""
        numbers = np.array([_number(card.place, one) for row in card.rows for one in row])
        kind = card.options.get("TYPE", "R")
        if kind not in ("R", "C") or numbers.shape != (6,) or "NSET" not in card.options:
            raise InputError(f"{card.place}: expected NSET=, TYPE=R or C, and six numbers")
        first, second = numbers[:3], numbers[3:]
        for node in self.deck.nodes(card.place, card.options["NSET"]):
            if kind == "C":
                point = place_of(self.points, card.place, node)
                self.found.axes[node] = cylinder_axes(card.place, first, second, point)
            else:
                self.found.axes[node] = axes_of(card.place, first, second)
        return iter(())


#: How each card is read.
READERS = {
    "EQUATION": _Cards.equation,
    "TIE": _Cards.tie,
    "RIGID BODY": _Cards.rigid_body,
    "MPC": _Cards.mpc,
    "TRANSFORM": _Cards.transform,
}


def deck_constraints(
    deck: Deck, points: Mapping[int, Any], cells: Mapping[str, Any], dofs: Set[Dof]
) -> Constraints:
    """Return the constraints of a deck, and what of it is not covered.

    `numbered_mesh` returns deck, points and cells; `dofs` are the displacements that the matrices have.
    """
    cards = _Cards(deck, points, cells, dofs)
    for card in deck.constraints:
        try:
            if card.keyword not in READERS:
                raise InputError(f"{card.place} is not read; write *EQUATION or *RIGID BODY instead")
            cards.found.relations += list(READERS[card.keyword](cards, card))
        except InputError as error:
            if card.keyword == "TRANSFORM":
                raise
            cards.found.uncovered.append(str(error))
    return cards.found


def rigid_relations(
    place: str, node: int, reference: int, rotations: Sequence[Dof], arm: Real
) -> Iterator[Relation]:
    """Give the relations ``u = u_reference + theta x arm`` of a node, and those of its rotations theta."""
    for k in range(3):
        # The k-th component of theta x arm.
        after, before = (k + 1) % 3, (k + 2) % 3
        terms = [
            ((reference, k + 1), -1.0),
            (rotations[after], -arm[before]),
            (rotations[before], arm[after]),
        ]
        yield Relation(place, (((node, k + 1), 1.0), *((dof, float(c)) for dof, c in terms if c)))
    for k in range(3):
        yield Relation(place, (((node, k + 4), 1.0), (rotations[k], -1.0)))


def _number(place: str, text: str) -> float:
    try:
        return float(text.upper().replace("D", "E"))
    except ValueError:
        raise InputError(f"{place}: expected a number, got {text!r}") from None
