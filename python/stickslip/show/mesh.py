"""Where the dofs of a scene lie: points and cells on which displacements are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

#: Corners of the faces of a cell by the name that meshio gives its kind; of a plane cell it is one.
#: Abaqus numbers the faces of tetrahedron, hexahedron and wedge in this order.
FACES = {
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2, 3),),
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}


@dataclass(frozen=True, eq=False)
class Mesh:
    """Points of a scene, the dofs that move them, and the cells between them."""

    #: Positions at rest, (p, d) with d = 2 or 3, m.
    points: NDArray[np.float64]
    #: (p, d): which dof of the scene displaces a point in a direction, -1: none, it is held there. From n on
    #: it is a row of `dependent`.
    dofs: NDArray[np.int64]
    #: Node places of the cells by meshio's name of their kind, (m, k) each; none: only points are known.
    cells: Mapping[str, NDArray[np.int64]]
    #: Displacements that are sums of dofs, (k, n) weights; None: there are none.
    dependent: scipy.sparse.csr_array | None = None

    def displacements(self, position: NDArray[Any]) -> NDArray[Any]:
        """Return the displacements (..., p, d) of the points for displacements (..., n) of the dofs, m."""
        held = np.zeros((*position.shape[:-1], 1), dtype=position.dtype)
        parts = [position, held]
        if self.dependent is not None:
            rows = position.reshape(-1, position.shape[-1])
            parts.insert(1, (self.dependent @ rows.T).T.reshape(*position.shape[:-1], -1))
        # The place -1 is the last one: a dof that does not move.
        return np.concatenate(parts, axis=-1)[..., self.dofs]

    def weights(self, place: int) -> list[tuple[int, float]]:
        """Return the dofs, and their weights, of a place in `dofs`."""
        if self.dependent is None or place < self.dependent.shape[1]:
            return [(place, 1.0)] if place >= 0 else []
        row = place - self.dependent.shape[1]
        own = slice(*self.dependent.indptr[row : row + 2])
        return list(zip(self.dependent.indices[own].tolist(), self.dependent.data[own].tolist(), strict=True))

    def faces(self) -> list[NDArray[np.int64]]:
        """Return the faces that bound the cells, of plane cells the cells, as node places around each."""
        return boundary_faces(self.cells)


def boundary_faces(cells: Mapping[str, NDArray[np.int64]]) -> list[NDArray[np.int64]]:
    """Return the faces of one cell alone as nodes around each, by meshio's names of the kinds of cells."""
    found: dict[frozenset[int], NDArray[np.int64] | None] = {}
    for kind, nodes in cells.items():
        for corners in FACES.get(kind, ()):
            for face in nodes[:, list(corners)]:
                key = frozenset(face.tolist())
                # A face of two cells lies inside.
                found[key] = None if key in found else face
    return [face for face in found.values() if face is not None]
