"""A drawing of any scene from its matrices: bodies, springs between them, walls, and sliders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.sparse

from stickslip.scene.checks import Complex, Matrix, Real
from stickslip.scene.contact import direction_entries
from stickslip.scene.elements import Element
from stickslip.show.mesh import Mesh

#: Bodies that are drawn at most; contacts go first. Bodies up to which each has its name.
MOST, NAMED = 48, 16
#: Part of a diagonal entry of K below which what its row leaves over is rounding, not a spring to a wall.
ROUNDING = 1e-9
#: Length of the largest displacement in a drawing, half the length of a slider and of a wall, and the length
#: of a spring to a wall, all in distances of neighbouring bodies.
LONG, SLIDER, WALL, REACH = 0.3, 0.22, 0.09, 0.4
#: Length of the largest displacement of a mesh, of its size.
PART = 0.08
#: Dofs up to which a mesh is drawn; the matrices of a finer one are.
FINEST = 1200
#: Where a mesh in space is seen from, 30 degrees above its plane: right and up on the page, and to the eye.
VIEW = (
    np.array([0.8, -0.6, 0.0]),
    np.array([0.3, 0.4, np.sqrt(0.75)]),
    np.array([-0.6 * np.sqrt(0.75), -0.8 * np.sqrt(0.75), 0.5]),
)


class Structured(Protocol):
    """What can be drawn as a structure: a `Scene`."""

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the dofs."""

    @property
    def stiffness(self) -> Matrix:
        """K, (n, n), N/m."""

    @property
    def elements(self) -> tuple[Element, ...]:
        """Springs and dampers beside the matrices."""

    @property
    def mesh(self) -> Mesh | None:
        """Where the dofs lie."""

    @property
    def model(self) -> partial[Any] | None:
        """The model function with the arguments that it was made of."""

    def contact_labels(self) -> list[int] | list[str]:
        """Return the names of the contacts."""

    def tangential_direction(self, contact: int) -> Real:
        """Return t of a contact, (n,)."""

    def normal_direction(self, contact: int) -> Real:
        """Return n of a contact, (n,)."""


class Column(NamedTuple):
    """A mass above a second one that rubs on an inclined slider, as a drawing places them."""

    #: name of the upper mass, indices of its horizontal and vertical dof
    upper: tuple[str, int, int]
    #: name of the lower mass, indices of its dof along the slider and of the one normal to it
    lower: tuple[str, int, int]
    #: of the slider, rad
    inclination: float


class End(NamedTuple):
    """An end of a line: where it rests, and the body that it moves with; None: it stays."""

    x: float
    y: float
    body: int | None


@dataclass(frozen=True)
class Body:
    """What moves as one."""

    #: Name of its dofs, or of the mass.
    name: str
    #: Where it rests in the drawing: columns from 0 on to the right, layers from 0 on upwards.
    x: float
    y: float
    #: (dof, right, up) for every dof that moves it: how far one metre of the dof moves it.
    along: tuple[tuple[int, float, float], ...]
    #: The contact that it rubs in; None: in none.
    contact: int | None = None
    #: Inclination of its slider, rad.
    angle: float = 0.0


@dataclass(frozen=True)
class Schematic:
    """Bodies, springs between two of them (a, b, N/m), and springs to a wall (a, N/m).

    `omitted` dofs move no body of the drawing. Of a mesh the bodies are its points, which span `faces`, those
    in front last.
    """

    bodies: tuple[Body, ...]
    springs: tuple[tuple[int, int, float], ...]
    walls: tuple[tuple[int, float], ...]
    omitted: int
    faces: tuple[tuple[int, ...], ...] = ()

    def moved(self, displacement: Real | Complex) -> Real | Complex:
        """Return how far the bodies move to the right and upwards, (bodies, 2), for displacements (n,)."""
        moved: Any = np.zeros((len(self.bodies), 2), dtype=np.asarray(displacement).dtype)
        for place, body in enumerate(self.bodies):
            for dof, right, up in body.along:
                moved[place] += displacement[dof] * np.array([right, up])
        found: Real | Complex = moved
        return found

    def motion(self, displacement: Real | Complex) -> Complex:
        """Return how far the bodies move, (bodies, 2), in the drawing: the largest one by `LONG`.

        The points of a mesh, whose drawing has its size in m, move by `PART` of its size.
        """
        moved: Complex = self.moved(displacement).astype(complex)
        size = np.hypot(*np.ptp([(body.x, body.y) for body in self.bodies], axis=0)) if self.faces else 0.0
        reach = PART * float(size) if self.faces else LONG
        return moved * (reach / (float(np.abs(moved).max(initial=0.0)) or 1.0))

    def lines(self) -> Iterator[tuple[str, End, End]]:
        """Yield the lines of the drawing by their kind: ``spring``, ``wall`` and ``slider``."""
        ends = [End(body.x, body.y, place) for place, body in enumerate(self.bodies)]
        for a, b, _ in self.springs:
            yield "spring", ends[a], ends[b]
        for place, _ in self.walls:
            body = self.bodies[place]
            # The wall of a contact is at its left, that of another body above it.
            beside = body.contact is not None
            x, y = (body.x - REACH, body.y) if beside else (body.x, body.y + REACH)
            across, along = (0.0, WALL) if beside else (WALL, 0.0)
            yield "spring", ends[place], End(x, y, None)
            yield "wall", End(x - across, y - along, None), End(x + across, y + along, None)
        for body in self.bodies:
            if body.contact is not None:
                cosine, sine = float(np.cos(body.angle)), float(np.sin(body.angle))
                x, y = body.x + 0.14 * sine, body.y - 0.14 * cosine
                h, v = SLIDER * cosine, SLIDER * sine
                yield "slider", End(x - h, y - v, None), End(x + h, y + v, None)


def schematic(scene: Structured, columns: Sequence[Column] = ()) -> Schematic:
    """Return the drawing of a scene.

    Matrices do not say where masses are. So every contact is a body in the bottom row, which moves along its
    tangential and normal direction. Every dof that belongs to no contact is a body of its own, which moves to
    the right, in layers above by the number of springs to the next contact. Two bodies whose dofs K couples
    are tied by a spring, as stiff as the largest of these entries. If a diagonal entry of K is larger than
    all other entries of its row together, a spring with the difference ties the body to the wall. Springs and
    dampers beside the matrices are drawn in the same way. `columns`, or the model that made the scene, say
    more of the masses.
    """
    columns = columns or masses(scene)
    bodies = _known(columns) if columns else _found(scene)
    size = len(scene.dofs)
    owner = np.full(size, -1)
    for place, body in reversed(list(enumerate(bodies))):
        for dof, _, _ in body.along:
            owner[dof] = place
    entries = scipy.sparse.coo_array(scene.stiffness)
    row, column = (np.asarray(part) for part in entries.coords)
    stiffness = np.asarray(entries.data)
    springs: dict[tuple[int, int], float] = {}
    for a, b, k in zip(owner[row], owner[column], np.abs(stiffness), strict=True):
        if 0 <= a < b and k > 0.0:
            springs[int(a), int(b)] = max(springs.get((int(a), int(b)), 0.0), float(k))
    diagonal = np.zeros(size)
    others = np.zeros(size)
    on = row == column
    np.add.at(diagonal, row[on], stiffness[on])
    np.add.at(others, row[~on], np.abs(stiffness[~on]))
    rest = diagonal - others
    walls: dict[int, float] = {}
    for dof in np.flatnonzero((rest > ROUNDING * np.abs(diagonal)) & (owner >= 0)).tolist():
        place = int(owner[dof])
        walls[place] = max(walls.get(place, 0.0), float(rest[dof]))
    for ends in _element_ends(scene, owner):
        if len(ends) > 1:
            springs.setdefault((ends[0], ends[-1]), 1.0)
        elif ends:
            walls.setdefault(ends[0], 1.0)
    if not columns:
        bodies = _layered(bodies, springs)
    return Schematic(
        tuple(bodies),
        tuple((a, b, k) for (a, b), k in springs.items()),
        tuple(walls.items()),
        int((owner < 0).sum()),
    )


def _element_ends(scene: Structured, owner: Any) -> Iterator[list[int]]:
    """Yield the bodies that each spring or damper beside the matrices ties, ascending."""
    for one in scene.elements:
        entries = direction_entries("direction", one.direction, scene.dofs)
        yield sorted({int(owner[dof]) for dof, entry in entries if entry and owner[dof] >= 0})


def masses(scene: Structured) -> Sequence[Column]:
    """Return the masses of the model of two subsystems, whose places are known; of any other scene none."""
    model = scene.model
    if model is None or model.func.__name__ != "two_subsystems":
        return ()
    left, right = np.broadcast_to(model.keywords.get("inclination", (0.3, 0.75)), 2).tolist()
    return Column(("m1", 0, 1), ("m2", 2, 3), left), Column(("m3", 4, 5), ("m4", 6, 7), right)


def structure(scene: Structured, columns: Sequence[Column] = ()) -> Schematic:
    """Return the drawing of the mesh of a scene, or of its matrices if it has none or one with many dofs."""
    drawn = None if scene.mesh is None else meshed(scene.mesh)
    if drawn is not None and sum(len(body.along) for body in drawn.bodies) <= FINEST:
        return drawn
    return schematic(scene, columns)


def meshed(mesh: Mesh) -> Schematic | None:
    """Return the drawing of a mesh, of one in space as seen from above at an angle; None: it has no faces."""
    faces = mesh.faces()
    if not faces:
        return None
    right, up, eye = VIEW if mesh.points.shape[1] == 3 else (*np.eye(2), np.zeros(2))
    shown = sorted({int(node) for face in faces for node in face})
    place = {node: k for k, node in enumerate(shown)}
    bodies = tuple(
        Body(
            "",
            float(mesh.points[node] @ right),
            float(mesh.points[node] @ up),
            tuple(
                (dof, weight * float(r), weight * float(u))
                for place, r, u in zip(mesh.dofs[node], right, up, strict=True)
                for dof, weight in mesh.weights(int(place))
                if r or u
            ),
        )
        for node in shown
    )
    faces.sort(key=lambda face: float((mesh.points[face] @ eye).mean()))
    moving = {dof for body in bodies for dof, _, _ in body.along}
    drawn = {dof for place in mesh.dofs.ravel().tolist() for dof, _ in mesh.weights(place)}
    omitted = len(drawn - moving)
    return Schematic(bodies, (), (), omitted, tuple(tuple(place[int(k)] for k in face) for face in faces))


def _known(columns: Sequence[Column]) -> list[Body]:
    bodies = []
    for k, ((name, horizontal, vertical), (below, tangential, normal), angle) in enumerate(columns):
        a, b = float(np.cos(angle)), float(np.sin(angle))
        bodies.append(Body(name, float(k), 1.0, ((horizontal, 1.0, 0.0), (vertical, 0.0, 1.0))))
        bodies.append(Body(below, float(k), 0.0, ((tangential, a, b), (normal, -b, a)), k, angle))
    return bodies


def _found(scene: Structured) -> list[Body]:
    labels = scene.contact_labels()
    bodies, taken = [], np.zeros(len(scene.dofs), dtype=bool)
    for i in range(min(len(labels), MOST)):
        tangential, normal = scene.tangential_direction(i), scene.normal_direction(i)
        dofs = np.flatnonzero((tangential != 0.0) | (normal != 0.0))
        taken[dofs] = True
        along = tuple((int(k), float(tangential[k]), float(normal[k])) for k in dofs)
        # The dofs of a contact have no body of their own, so its name tells them.
        own = f": {', '.join(scene.dofs[k] for k in dofs)}" if dofs.size <= 2 else ""
        bodies.append(Body(f"contact {labels[i]}{own}", float(i), 0.0, along, i))
    for dof in np.flatnonzero(~taken)[: MOST - len(bodies)].tolist():
        bodies.append(Body(scene.dofs[dof], 0.0, 1.0, ((int(dof), 1.0, 0.0),)))
    return bodies


def _layered(bodies: list[Body], springs: dict[tuple[int, int], float]) -> list[Body]:
    """Return the bodies in layers by their distance from a contact, near those they are tied to."""
    tied: list[set[int]] = [set() for _ in bodies]
    for a, b in springs:
        tied[a].add(b)
        tied[b].add(a)
    layer = [k for k, body in enumerate(bodies) if body.contact is not None] or list(range(len(bodies)))[:1]
    height, depth = dict.fromkeys(layer, 0), 0
    while len(height) < len(bodies):
        reached = sorted({b for a in layer for b in tied[a]} - set(height))
        # What no spring leads to stands in a layer of its own.
        layer = reached or [k for k in range(len(bodies)) if k not in height]
        depth += 1
        height |= dict.fromkeys(layer, depth)
    widest = max(sum(h == level for h in height.values()) for level in range(depth + 1))
    x: dict[int, float] = {}
    y: dict[int, float] = {}
    for level in range(depth + 1):
        row = [k for k in range(len(bodies)) if height[k] == level]

        below = {k: [x[b] for b in tied[k] if b in x] or [float(k)] for k in row}
        row.sort(key=lambda k: float(np.mean(below[k])))
        x |= {k: (place + 0.5) * widest / len(row) - 0.5 for place, k in enumerate(row)}
        # Where a layer holds many, springs along it would hide behind the bodies that they pass.
        many = level > 0 and len(row) > 2
        y |= {k: level + 0.3 * (many and place % 2) for place, k in enumerate(row)}
    return [
        Body(body.name, x[k], y[k], body.along, body.contact, body.angle) for k, body in enumerate(bodies)
    ]
