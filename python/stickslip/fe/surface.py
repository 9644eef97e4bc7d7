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


class Meshed(Protocol):
    """What a surface asks of its body: names of dofs, and the mesh."""

    nodes: NDArray[np.int64]
    points: Real | None
    cells: dict[str, NDArray[np.int64]]

    def dof_name(self, place: str, node: int, direction: int) -> str | None:
        """Return the name in a scene of a displacement of a node; None: it is held."""


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
        Places of facet nodes among these nodes, (f, 2 to 4); None: only nodes are known.
    normals
        Outward unit normals at the nodes, (k, d), means of those of the facets by their areas.
    """

    def __init__(self, body: Meshed, name: str, nodes: NDArray[np.int64]) -> None:
        assert body.points is not None
        self.body, self.name = body, name
        places, local = np.unique(nodes, return_inverse=True)
        self.numbers = body.nodes[places]
        self.points: Real = body.points[places]
        self.facets: NDArray[np.int64] | None = None
        if nodes.ndim == 2:
            dimension = self.points.shape[1]
            if nodes.shape[1] not in ((2,) if dimension == 2 else (3, 4)):
                raise InputError(
                    f"surface {name!r}: expected facets of {'2' if dimension == 2 else '3 or 4'} nodes, "
                    f"got {nodes.shape[1]}"
                )
            facets = local.reshape(nodes.shape)
            self.facets = self._outward(facets, nodes)

    def _outward(self, facets: NDArray[np.int64], nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return facets turned so that their normals point out of the cells that they bound."""
        normals = area_vectors(self.points, facets)
        area = np.linalg.norm(normals, axis=1)
        if not (area > 0.0).all():
            k = int(np.flatnonzero(~(area > 0.0))[0])
            raise InputError(
                f"surface {self.name!r}: the facet of nodes {self.body.nodes[nodes[k]]} has no area"
            )
        assert self.body.points is not None
        if not self.body.cells:
            self._check_edges(nodes)
            return facets
        owners: dict[int, list[tuple[str, int]]] = {}
        for kind, cells in self.body.cells.items():
            wanted = np.isin(cells, nodes)
            for cell, corner in np.argwhere(wanted):
                owners.setdefault(int(cells[cell, corner]), []).append((kind, int(cell)))
        turned = facets.copy()
        for k, corners in enumerate(nodes):
            shared = Counter(cell for node in corners for cell in owners.get(int(node), ()))
            cells_there = [cell for cell, count in shared.items() if count == len(corners)]
            if len(cells_there) != 1:
                raise InputError(
                    f"surface {self.name!r}: the facet of nodes {self.body.nodes[corners]} bounds "
                    f"{len(cells_there)} cells, expected one"
                )
            kind, cell = cells_there[0]
            if kind[-1].isdigit():
                self._refuse_quadratic(corners, f"they bound a cell {kind}")
            inside = self.body.points[self.body.cells[kind][cell]].mean(axis=0)
            if normals[k] @ (self.points[facets[k]].mean(axis=0) - inside) < 0.0:
                turned[k] = facets[k, ::-1]
        return turned

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
            f"{why}; facets of quadratic elements are not known here"
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
        # A held dof takes no force: its support does.
        return {
            name: float(force)
            for node, row in zip(self.numbers, forces, strict=True)
            for k, force in enumerate(row)
            if force and (name := self.body.dof_name(argument, int(node), k + 1)) is not None
        }

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
