"""Linear constraints of a model as one transformation ``x = T x_free`` of its displacements.

A relation is ``sum of c u = 0`` over displacements u of nodes. Some files have matrices in which the solver
has eliminated what depends on others; then T only says where the nodes go. Otherwise the matrices become
``T' K T`` and ``T' M T`` (Cook, Malkus, Plesha, Witt, Concepts and Applications of Finite Element Analysis,
2002, section 13.2). A file whose displacements are along local axes comes to global ones by the same T.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.fe.matrices import of_rows
from stickslip.scene.checks import Real

#: Node and direction: 1 to 3 are displacements, 4 to 6 rotations.
Dof = tuple[int, int]
Weights = dict[Dof, float]
#: A coefficient below this part of the largest of its relation is rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Relation:
    """``sum of c u = 0`` along the axes of the nodes."""

    #: File, line and card.
    place: str
    #: Displacements and coefficients; the first displacement depends on the others.
    terms: tuple[tuple[Dof, float], ...]
    #: It is of a tie, which leaves out nodes too far from the master surface, and held ones.
    tie: bool = False


@dataclass
class Constraints:
    """Relations of a model and the axes of its nodes."""

    #: The relations.
    relations: list[Relation] = field(default_factory=list)
    #: Local axes of nodes as rows, (3, 3): `held` and the relations are along them.
    axes: dict[int, Real] = field(default_factory=dict)
    #: Node and direction of what is held.
    held: set[Dof] = field(default_factory=set)
    #: What is not read, with file, line, card and remedy.
    uncovered: list[str] = field(default_factory=list)
    #: What a user has to know of what is read.
    notes: list[str] = field(default_factory=list)

    @property
    def some(self) -> bool:
        """Whether a displacement depends on others, or a node has axes of its own."""
        return bool(self.relations or self.axes or self.uncovered)


@dataclass(frozen=True)
class Elimination:
    """Free displacements, what depends on them, and the matrices' displacements in terms of them."""

    #: Displacements along global axes that stay, n of them.
    free: tuple[Dof, ...]
    #: Weights of free displacements in each other one; none of them: it is held.
    dependent: dict[Dof, Weights]
    #: T of the matrices, (m, n); None: they have the free displacements already.
    basis: scipy.sparse.csr_array | None
    #: Whether the matrices lack the first displacements of the relations: the solver has eliminated them.
    by_solver: bool


def eliminate(
    constraints: Constraints, dofs: Sequence[Dof], *, local: bool, by_solver: bool | None = None
) -> Elimination:
    """Return the free displacements of a model, by Gaussian elimination of its relations.

    The matrices have the m displacements `dofs`, along the axes of their nodes if `local`, else along global
    ones. `by_solver`: whether the solver has eliminated the relations; None: it has, if the first
    displacement of one is missing among `dofs` and not held.

    Raise `InputError` if the solver has eliminated only some relations, a relation contradicts others, or a
    displacement is neither in the matrices nor held, and no relation says what it is.
    """
    return _Rows(constraints, dofs, local).eliminated(by_solver)


def constrained(
    constraints: Constraints,
    nodes: Sequence[int],
    cells: Mapping[str, Any],
    names: Sequence[str],
    matrices: Mapping[str, scipy.sparse.csr_array],
    *,
    local: bool,
    by_solver: bool | None,
) -> tuple[tuple[str, ...], dict[str, Any], dict[str, dict[str, float] | None], list[str]]:
    """Return names of free dofs, their matrices, what depends on them, and what was done.

    `cells` are nodes of elements by kind, `names` "node.direction" of the m dofs of the matrices, (m, m)
    each; `local` and `by_solver` as in `eliminate`.

    Raise `InputError` as `eliminate`, or if a constraint is not covered and the solver has not eliminated it.
    """
    dofs = [(int(node), int(k)) for node, k in (name.split(".") for name in names)]
    found = eliminate(constraints, dofs, local=local, by_solver=by_solver)
    directions = {k for _, k in found.free if k <= 3}
    lacking = {(node, k) for node in nodes for k in directions} - set(found.free) - constraints.held
    unknown = sorted(lacking - found.dependent.keys())
    strange = {node for node, _ in dofs}.difference(nodes)
    elastic = {node for own in cells.values() for node in np.unique(own).tolist()}
    lost = found.by_solver or any(node in elastic for node, _ in unknown)
    if constraints.uncovered and (strange or not lost):
        raise InputError(constraints.uncovered[0])
    reduced = dict(matrices)
    if found.basis is not None:
        reduced = {key: (found.basis.T @ one @ found.basis).tocsr() for key, one in matrices.items()}
    weights: dict[str, dict[str, float] | None] = {_name(dof): None for dof in unknown}
    for dof, parts in found.dependent.items():
        if dof not in constraints.held or dof[0] in constraints.axes:
            weights[_name(dof)] = {_name(one): weight for one, weight in parts.items()}
    notes = [*constraints.notes, *(f"not read: {one}" for one in constraints.uncovered)]
    if constraints.relations:
        first, count = constraints.relations[0].place, sum(any(one) for one in found.dependent.values())
        who = "the solver has eliminated them" if found.by_solver else "eliminated here"
        notes.append(f"dependent displacements from {first} on: {count}, {who}")
    if constraints.axes:
        where = "local" if local else "global"
        notes.append(f"nodes with local axes: {len(constraints.axes)}; the matrices are along {where} ones")
    if unknown:
        notes.append(f"dependent displacements of which the weights are not known: {len(unknown)}")
    return tuple(map(_name, found.free)), reduced, weights, notes


def axes_of(place: str, first: Real, second: Real) -> Real:
    """Return axes as rows, (3, 3): along a vector, in the plane with a second one, and across both.

    Raise `InputError` if the vectors are parallel.
    """
    across = np.cross(first, second)
    length = np.linalg.norm(first) * np.linalg.norm(second)
    if not np.linalg.norm(across) > 1e-9 * length > 0.0:
        raise InputError(f"{place}: {first} and {second} give no axes")
    rows = np.array([first, np.cross(across, first), across])
    axes: Real = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return axes


def cylinder_axes(place: str, start: Real, end: Real, point: Real) -> Real:
    """Return radial, tangential and axial direction, as rows, at a point about the axis from start to end.

    Raise `InputError` if the point lies on the axis.
    """
    axis, arm = end - start, point - start
    return axes_of(place, arm - arm @ axis / (axis @ axis) * axis, np.cross(axis, arm))


def place_of(points: Mapping[int, Any], place: str, node: int) -> Real:
    """Return where a node lies, (3,); a plane model lies at z = 0.

    Raise `InputError` if there is no such node.
    """
    if node not in points:
        raise InputError(f"{place}: there is no node {node}")
    where = np.asarray(points[node], dtype=float)
    return np.pad(where, (0, 3 - where.size))


def _name(dof: Dof) -> str:
    return f"{dof[0]}.{dof[1]}"


class _Rows:
    """Gaussian elimination over displacements along global axes."""

    def __init__(self, constraints: Constraints, dofs: Sequence[Dof], local: bool) -> None:
        self.constraints, self.dofs, self.present = constraints, dofs, frozenset(dofs)
        #: Axes of nodes whose displacements in the matrices are along them.
        self.turned = constraints.axes if local else {}
        self.expressions: dict[Dof, Weights] = {}
        #: How many displacements of a group the matrices lack and no relation has given yet.
        self.room: dict[Dof, int] = {}

    def eliminated(self, by_solver: bool | None) -> Elimination:
        relations = self.constraints.relations
        for place, terms in self._supports():
            self._solve(place, terms, by_solver=True, optional=True, first=terms)
        rows = [self._global(relation.terms) for relation in relations]
        firsts = [self._global(relation.terms[:1]) for relation in relations]
        if by_solver is None:
            by_solver = any(self._absent(dof) for first in firsts for dof in self._substituted(first))
        for relation, row, first in zip(relations, rows, firsts, strict=True):
            # A tie leaves out what is held, or depends on others already.
            again = relation.terms[0][0] not in self.present or any(dof in self.expressions for dof in first)
            if by_solver or not (relation.tie and again):
                self._solve(relation.place, row, by_solver, relation.tie, first)
        for relation, row in zip(relations, rows, strict=True):
            left = [dof for dof in self._substituted(row) if self._absent(dof)]
            if left and by_solver:
                node, direction = left[0]
                raise InputError(
                    f"{relation.place}: displacement {node}.{direction} is neither a dof of the matrices nor "
                    "held in the deck; give the deck of the run that wrote the matrices"
                )
        dependent: dict[Dof, Weights] = {}
        for dof in reversed(self.expressions):
            dependent[dof] = self._substituted(self.expressions[dof], dependent)
        rows = [self._substituted(self._global([(dof, 1.0)], self.turned), dependent) for dof in self.dofs]
        own = [one for dof in self.dofs for one in self._alike(dof)]
        # A reference node without stiffness of its own has no row.
        own += [dof for row in rows for dof in row]
        free = tuple(dict.fromkeys(dof for dof in own if dof not in dependent))
        return Elimination(free, dependent, self._basis(rows, free), by_solver)

    def _basis(self, rows: list[Weights], free: tuple[Dof, ...]) -> scipy.sparse.csr_array | None:
        if free == tuple(self.dofs) and not any(node in self.turned for node, _ in self.dofs):
            return None
        place = {dof: k for k, dof in enumerate(free)}
        return of_rows([{place[dof]: weight for dof, weight in row.items()} for row in rows], len(free))

    def _supports(self) -> Iterator[tuple[str, Weights]]:
        """Give what is held along the axes of nodes, and what the matrices lack there without a relation."""
        related = {dof for relation in self.constraints.relations for dof, _ in relation.terms}
        for node in self.constraints.axes:
            displacements, rotations = ([(node, first + k) for k in range(3)] for first in (1, 4))
            # Nodes of solid elements have no rotations.
            for dof in displacements + ([] if self.present.isdisjoint(rotations) else rotations):
                lacking = node in self.turned and dof not in self.present and dof not in related
                held = dof in self.constraints.held and not (node in self.turned and dof in self.present)
                if held or lacking:
                    yield f"support {node}.{dof[1]}", self._global([(dof, 1.0)])

    def _global(self, terms: Iterable[tuple[Dof, float]], axes: dict[int, Real] | None = None) -> Weights:
        """Return a sum along the axes of nodes as one along global axes, without what is held."""
        axes = self.constraints.axes if axes is None else axes
        parts = []
        for dof, factor in terms:
            node, direction = dof
            if node in axes:
                first = 1 if direction < 4 else 4
                own = axes[node][direction - first].tolist()
                parts += [((node, first + k), factor * component) for k, component in enumerate(own)]
            elif dof in self.present or dof not in self.constraints.held:
                parts.append((dof, factor))
        return _sum(parts)

    def _group(self, dof: Dof) -> Dof:
        return (dof[0], 1 if dof[1] < 4 else 4) if dof[0] in self.turned else dof

    def _alike(self, dof: Dof) -> list[Dof]:
        """Return the displacements, or rotations, of a node along local axes that belong together."""
        if dof[0] not in self.turned:
            return [dof]
        node, first = self._group(dof)
        return [(node, first + k) for k in range(3)]

    def _absent(self, dof: Dof) -> bool:
        """Say whether the matrices lack a displacement that no relation has given yet."""
        group = self._group(dof)
        if group not in self.room:
            self.room[group] = sum(one not in self.present for one in self._alike(dof))
        return self.room[group] > 0

    def _solve(self, place: str, row: Weights, by_solver: bool, optional: bool, first: Weights) -> None:
        """Solve a relation for a displacement, the first one or of its node; by a solver: one that lacks."""
        terms = self._substituted(row)
        if not terms:
            return
        choice = [dof for dof in terms if self._absent(dof)] if by_solver else [*terms]
        if not choice and optional:
            return
        if not choice:
            raise InputError(
                f"{place}: the matrices have all its displacements, although their solver eliminates "
                "constraints; give the deck of the run that wrote them"
            )
        choice = [dof for dof in choice if dof in first] or choice
        chosen = max(choice, key=lambda dof: abs(terms[dof]))
        factor = -1.0 / terms.pop(chosen)
        self.expressions[chosen] = {dof: factor * weight for dof, weight in terms.items()}
        if by_solver:
            self.room[self._group(chosen)] -= 1

    def _substituted(self, row: Weights, known: dict[Dof, Weights] | None = None) -> Weights:
        """Return a sum in which no displacement depends on others."""
        expressions = self.expressions if known is None else known
        while any(dof in expressions for dof in row):
            parts = (
                (other, factor * weight)
                for dof, factor in row.items()
                for other, weight in expressions.get(dof, {dof: 1.0}).items()
            )
            row = _sum(parts)
        return row


def _sum(parts: Iterable[tuple[Dof, float]]) -> Weights:
    """Return the sum of terms, without what is rounding beside the largest of them."""
    found: defaultdict[Dof, float] = defaultdict(float)
    largest = 0.0
    for dof, factor in parts:
        found[dof] += factor
        largest = max(largest, abs(factor))
    return {dof: factor for dof, factor in found.items() if abs(factor) > ROUNDING * largest}
