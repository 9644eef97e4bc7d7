"""A part of the boundary of a body: nodes, facets, outward normals, and the load of a pressure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stickslip.faults import InputError
from stickslip.scene.checks import Real, real_array, real_number

#: Corners of a quadrilateral, and Gauss points that integrate its bilinear shape functions exactly.
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
GAUSS = CORNERS / np.sqrt(3.0)
#: Part of an edge within which a node counts as lying in its middle.
MIDDLE = 1e-3
#: Edges of quadratic cells in the order of their middle nodes, which follow the corners.
EDGES = {
    "triangle6": [(0, 1), (1, 2), (2, 0)],
    "quad8": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "tetra10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "wedge15": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    "hexahedron20": [
        *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ],
}
#: Corners of facets in a plane and in space, by the number of their nodes.
FACETS = {2: {2: 2, 3: 2}, 3: {3: 3, 4: 4, 6: 3, 8: 4}}
#: Linear parts of a quadratic facet by its corners; the middles of its edges follow these.
PARTS = {
    2: [[0, 2], [2, 1]],
    3: [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    4: [[0, 4, 7], [4, 1, 5], [5, 2, 6], [6, 3, 7], [4, 5, 7], [5, 6, 7]],
}


class Meshed(Protocol):
    """What a surface asks of its body: names of dofs, and the mesh."""

    nodes: NDArray[np.int64]
    points: Real | None
    cells: dict[str, NDArray[np.int64]]

    def displacement(self, place: str, node: int, direction: int) -> dict[str, float]:
        """Return a displacement of a node as weights of dofs by their names in a scene; none: it is held."""


class Surface:
    """Nodes of a body with their facets; made by `Body.surface`.

    Attributes
    ----------
    body, name
        The body of which the surface is a part, and the name of the surface.
    numbers
        Node numbers, (k,), ascending in their places.
    points
        Where they lie, (k, d), m.
    facets
        Places of facet nodes among these nodes, (f, 2 to 4); None: only nodes are known. A facet of a
        quadratic element stands there as its linear parts between corners and middles.
    normals
        Outward unit normals at the nodes, (k, d), means of those of the facets by their areas.
    """

    def __init__(self, body: Meshed, name: str, nodes: NDArray[np.int64]) -> None:
        assert body.points is not None
        self.body, self.name = body, name
        corners, cells = 0, []
        if nodes.ndim == 2:
            known = FACETS[body.points.shape[1]]
            if nodes.shape[1] not in known:
                raise InputError(
                    f"surface {name!r}: expected facets of {', '.join(map(str, known))} nodes, "
                    f"got {nodes.shape[1]}"
                )
            corners = known[nodes.shape[1]]
            cells = self._cells(nodes[:, :corners])
            nodes = self._with_middles(nodes, corners, cells)
        places, local = np.unique(nodes, return_inverse=True)
        self.numbers = body.nodes[places]
        self.points: Real = body.points[places]
        self.facets: NDArray[np.int64] | None = None
        if nodes.ndim == 2:
            self.facets = self._outward(local.reshape(nodes.shape), nodes, corners, cells)

    def _outward(
        self,
        facets: NDArray[np.int64],
        nodes: NDArray[np.int64],
        corners: int,
        cells: list[tuple[str, int]],
    ) -> NDArray[np.int64]:
        """Return facets, or their linear parts, with normals that point out of the cells that they bound."""
        parts = [np.arange(corners)] if facets.shape[1] == corners else PARTS[corners]
        found = np.stack([facets[:, part] for part in parts], axis=1)
        area = np.linalg.norm(area_vectors(self.points, found.reshape(-1, found.shape[2])), axis=1)
        if not (area > 0.0).all():
            k = int(np.flatnonzero(~(area > 0.0))[0]) // len(parts)
            raise InputError(
                f"surface {self.name!r}: the facet of nodes {self.body.nodes[nodes[k]]} has no area"
            )
        assert self.body.points is not None
        normals = area_vectors(self.points, facets[:, :corners])
        for k, (kind, cell) in enumerate(cells):
            inside = self.body.points[self.body.cells[kind][cell]].mean(axis=0)
            if normals[k] @ (self.points[facets[k, :corners]].mean(axis=0) - inside) < 0.0:
                found[k] = found[k, :, ::-1]
        return found.reshape(-1, found.shape[2])

    def _cells(self, nodes: NDArray[np.int64]) -> list[tuple[str, int]]:
        """Return kind and place of the cell that each facet bounds; none where the body has no cells."""
        if not self.body.cells:
            return []
        owners: dict[int, list[tuple[str, int]]] = {}
        for kind, cells in self.body.cells.items():
            wanted = np.isin(cells, nodes)
            for cell, corner in np.argwhere(wanted):
                owners.setdefault(int(cells[cell, corner]), []).append((kind, int(cell)))
        found = []
        for corners in nodes:
            shared = Counter(cell for node in corners for cell in owners.get(int(node), ()))
            cells_there = [cell for cell, count in shared.items() if count == len(corners)]
            if len(cells_there) != 1:
                raise InputError(
                    f"surface {self.name!r}: the facet of nodes {self.body.nodes[corners]} bounds "
                    f"{len(cells_there)} cells, expected one"
                )
            found.append(cells_there[0])
        return found

    def _with_middles(
        self, nodes: NDArray[np.int64], corners: int, cells: list[tuple[str, int]]
    ) -> NDArray[np.int64]:
        """Return facets of quadratic cells with the middle nodes of their edges behind their corners."""
        if nodes.shape[1] > corners:
            return nodes
        if not cells:
            self._check_edges(nodes)
            return nodes
        quadratic = [kind[-1].isdigit() for kind, _ in cells]
        if not any(quadratic):
            return nodes
        if not all(quadratic):
            raise InputError(
                f"surface {self.name!r}: some of its facets bound linear cells, others quadratic ones"
            )
        found = []
        for facet, (kind, cell) in zip(nodes, cells, strict=True):
            if kind not in EDGES:
                self._refuse_quadratic(facet, f"they bound a cell {kind}")
            own = self.body.cells[kind][cell]
            first = len(own) - len(EDGES[kind])
            middle = {frozenset(own[list(edge)]): own[first + k] for k, edge in enumerate(EDGES[kind])}
            ends = zip(facet, np.roll(facet, -1), strict=True) if corners > 2 else [tuple(facet)]
            found.append([*facet, *(middle[frozenset(pair)] for pair in ends)])
        return np.array(found)

    def _check_edges(self, nodes: NDArray[np.int64]) -> None:
        """Refuse facets with a node of the body in the middle of an edge."""
        assert self.body.points is not None
        starts, ends = nodes.ravel(), np.roll(nodes, -1, axis=1).ravel()
        middles = 0.5 * (self.body.points[starts] + self.body.points[ends])
        distance, nearest = cKDTree(self.body.points).query(middles)
        length = np.linalg.norm(self.body.points[ends] - self.body.points[starts], axis=1)
        between = np.flatnonzero(distance < MIDDLE * length)
        if between.size:
            k = between[0]
            middle = f"node {self.body.nodes[nearest[k]]} lies in the middle of an edge"
            self._refuse_quadratic(nodes[k // nodes.shape[1]], middle)

    def _refuse_quadratic(self, corners: NDArray[np.int64], why: str) -> None:
        raise InputError(
            f"surface {self.name!r}: the facet of nodes {self.body.nodes[corners]} has corners only, but "
            f"{why}; give all nodes of its facets, corners first"
        )

    @cached_property
    def areas(self) -> Real:
        """Integrals of the shape functions of the nodes times the outward normal, (k, d), m2."""
        if self.facets is None:
            raise InputError(f"surface {self.name!r}: it has nodes only; its facets are needed")
        found = np.zeros(self.points.shape)
        for corner, part in enumerate(shares(self.points, self.facets)):
            np.add.at(found, self.facets[:, corner], part)
        return found

    @cached_property
    def normals(self) -> Real:
        """Outward unit normals at the nodes, (k, d)."""
        length = np.linalg.norm(self.areas, axis=1, keepdims=True)
        if not (length > 0.0).all():
            node = self.numbers[int(length.argmin())]
            raise InputError(f"surface {self.name!r}: node {node} has no normal, its facets face each other")
        normals: Real = self.areas / length
        return normals

    def pressure(self, pressure: float, thickness: float = 1.0) -> dict[str, float]:
        """Return the forces of a pressure on the surface, by the names of dofs: what `assemble` takes.

        Parameters
        ----------
        pressure
            Pa, positive towards the body.
        thickness
            Thickness of a plane body, m.

        Raises
        ------
        InputError
            If the surface has no facets, or a number is not finite.
        """
        return self._loaded("pressure", -self.areas * self._scaled("pressure", pressure, thickness))

    def traction(self, traction: Sequence[float], thickness: float = 1.0) -> dict[str, float]:
        """Return the forces of a traction, a vector (d,) in Pa, by the names of dofs.

        Raises
        ------
        InputError
            If the surface has no facets, or the traction is not d finite numbers.
        """
        areas, given = self.areas, real_array("traction", traction, 1)
        if given.shape != areas.shape[1:]:
            raise InputError(f"traction: expected {areas.shape[1]} components, got {given.size}")
        vector = np.array([self._scaled("traction", one, thickness) for one in given.tolist()])
        return self._loaded("traction", np.linalg.norm(areas, axis=1)[:, None] * vector)

    def _scaled(self, argument: str, value: Any, thickness: float) -> float:
        number = real_number(argument, value) * real_number("thickness", thickness)
        if not np.isfinite(number):
            raise InputError(f"{argument}: must be finite, got {value!r} times a thickness of {thickness!r}")
        return number

    def _loaded(self, argument: str, forces: Real) -> dict[str, float]:
        # A held dof takes no force: its support does. The force on a dependent one acts on those of its sum.
        loads: dict[str, float] = {}
        for node, row in zip(self.numbers, forces, strict=True):
            for k, force in enumerate(row):
                if force:
                    for name, weight in self.body.displacement(argument, int(node), k + 1).items():
                        loads[name] = loads.get(name, 0.0) + weight * float(force)
        return loads

    def __len__(self) -> int:
        return len(self.numbers)

    def __repr__(self) -> str:
        facets = "no facets" if self.facets is None else f"{len(self.facets)} facets"
        return f"Surface({self.name!r}, {len(self)} nodes, {facets})"


def area_vectors(points: Real, facets: NDArray[np.int64]) -> Real:
    """Return normals of facets times their areas, (f, d), by the order of their nodes."""
    corners = points[facets]
    if points.shape[1] == 2:
        along = corners[:, 1] - corners[:, 0]
        return np.stack([along[:, 1], -along[:, 0]], axis=1)
    if facets.shape[1] == 3:
        return 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])


def shares(points: Real, facets: NDArray[np.int64]) -> list[Real]:
    """Return for each corner the integral of its shape function times the normal, (f, d) each."""
    if facets.shape[1] < 4:
        whole = area_vectors(points, facets)
        return [whole / facets.shape[1]] * facets.shape[1]
    corners, found = points[facets], [np.zeros((len(facets), 3)) for _ in range(4)]
    for r, s in GAUSS:
        along = np.einsum("k,fkd->fd", 0.25 * CORNERS[:, 0] * (1.0 + s * CORNERS[:, 1]), corners)
        across = np.einsum("k,fkd->fd", 0.25 * CORNERS[:, 1] * (1.0 + r * CORNERS[:, 0]), corners)
        normal = np.cross(along, across)
        for part, value in zip(found, bilinear(r, s), strict=True):
            part += value * normal
    return found


def bilinear(r: float, s: float) -> Real:
    """Return the four shape functions of a quadrilateral, (4,)."""
    return 0.25 * (1.0 + r * CORNERS[:, 0]) * (1.0 + s * CORNERS[:, 1])
