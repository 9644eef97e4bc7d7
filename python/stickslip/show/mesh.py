"""Where the dofs of a scene lie: points and cells on which displacements are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Nodes of the edges of a cell, by the name that meshio gives it, of its corners alone.
EDGES = {
    "line": ((0, 1),),
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hexahedron": (
        (0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7),
    ),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "pyramid": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Mesh:
    """Points of a scene, the dofs that move them, and the cells between them.

    Attributes
    ----------
    points
        Positions at rest, (p, d) with d = 2 or 3, m.
    dofs
        (p, d): which dof of the scene displaces a point in a direction, -1: none, it is held there.
    cells
        Node places of the cells by meshio's name of their kind, (m, k) each; none: only points are known.
    """

    points: NDArray[np.float64]
    dofs: NDArray[np.int64]
    cells: Mapping[str, NDArray[np.int64]]

    def displacements(self, position: NDArray[Any]) -> NDArray[Any]:
        """Return the displacements (..., p, d) of the points for displacements (..., n) of the dofs, m."""
        held = np.zeros((*position.shape[:-1], 1), dtype=position.dtype)
        # The place -1 is the last one: a dof that does not move.
        return np.concatenate([position, held], axis=-1)[..., self.dofs]

    def edges(self) -> NDArray[np.int64]:
        """Return the edges of the cells as pairs of node places, (e, 2), each once."""
        found = [np.zeros((0, 2), dtype=np.int64)]
        for kind, cells in self.cells.items():
            found += [np.sort(cells[:, list(edge)], axis=1) for edge in EDGES.get(kind, ())]
        return np.unique(np.concatenate(found), axis=0)
