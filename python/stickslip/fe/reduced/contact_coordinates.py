"""Contact coordinates of a sparse scene, and its matrices in them.

New coordinates ``y = (p, z)``: p the displacements along the contact directions (the columns of B, so that
``p = B' x``), z the dofs that are left after as many have given way, x_g. With ``B' x = B_g' x_g + B_z' z``

    x_g = B_g'^-1 (p - B_z' z).

The dofs that give way are, where possible, those that one contact alone moves: the nodes of one of two meshes
in contact. Then the rows of ``B_g'^-1`` have few entries, and the matrices in y are as sparse as before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from stickslip.faults import InputError
from stickslip.scene.contact import core_contact
from stickslip.scene.laws.damping import Rayleigh, rayleigh_matrix
from stickslip.scene.scene import Scene

#: Directions whose smallest part that is independent of the others is below this are dependent.
INDEPENDENT = 1e-10


@dataclass(frozen=True)
class Coordinate:
    """One contact coordinate: of which contact, and "tangential" or "normal"."""

    contact: int
    kind: str


@dataclass(frozen=True, eq=False)
class Matrices:
    """The matrices of a scene in contact coordinates y; the first ones are those of `kinds`."""

    kinds: tuple[Coordinate, ...]
    #: x = transform y
    transform: scipy.sparse.csc_array
    #: Indices of the dofs z
    left: NDArray[np.int64]
    #: p = directions' x
    directions: scipy.sparse.csc_array
    #: M, C, G, K and H; G and H are None where the scene has none.
    mass: Any
    damping: Any
    gyroscopic: Any
    stiffness: Any
    circulatory: Any

    @property
    def count(self) -> int:
        """Number of contact coordinates."""
        return len(self.kinds)


def contact_matrices(scene: Scene) -> Matrices:
    """Return the matrices of a scene in contact coordinates.

    Raise `InputError` if directions of contacts depend on one another.
    """
    kinds, directions = contact_directions(scene)
    transform, left = _transform(directions)

    def changed(matrix: Any) -> Any:
        return scipy.sparse.csc_array(transform.T @ sparse(matrix, scene.size) @ transform)

    mass, stiffness = changed(scene.mass), changed(scene.stiffness)
    if isinstance(scene.damping, Rayleigh):
        damping = rayleigh_matrix(scene.damping, mass, stiffness)
    else:
        damping = scipy.sparse.csc_array(mass.shape) if scene.damping is None else changed(scene.damping)
    gyroscopic, circulatory = (
        None if matrix is None else changed(matrix) for matrix in (scene.gyroscopic, scene.circulatory)
    )
    return Matrices(kinds, transform, left, directions, mass, damping, gyroscopic, stiffness, circulatory)


def contact_directions(scene: Scene) -> tuple[tuple[Coordinate, ...], scipy.sparse.csc_array]:
    """Return the contact coordinates of a scene and B, (n, b), whose columns are their directions."""
    kinds: list[Coordinate] = []
    rows, columns, values = [], [], []
    for i, contact in enumerate(scene.contacts):
        core = core_contact(contact, i, scene.dofs)
        for kind, direction in zip(("tangential", "normal"), core[:2], strict=True):
            if direction is None:
                continue
            if isinstance(direction, np.ndarray):
                entries = [(int(k), float(direction[k])) for k in np.flatnonzero(direction)]
            else:
                entries = direction if isinstance(direction, list) else [(direction, 1.0)]
            for dof, value in entries:
                rows.append(dof)
                columns.append(len(kinds))
                values.append(value)
            kinds.append(Coordinate(i, kind))
    shape = (scene.size, len(kinds))
    return tuple(kinds), scipy.sparse.csc_array((values, (rows, columns)), shape=shape)


def sparse(matrix: Any, size: int) -> scipy.sparse.csc_array:
    """Return a matrix, dense, sparse or the diagonal of one, as columns."""
    if not scipy.sparse.issparse(matrix) and np.ndim(matrix) == 1:
        return scipy.sparse.csc_array(scipy.sparse.diags_array(matrix, shape=(size, size)))
    return scipy.sparse.csc_array(matrix)


def _transform(directions: scipy.sparse.csc_array) -> tuple[scipy.sparse.csc_array, NDArray[np.int64]]:
    """Return ``x = transform (p, z)`` and the dofs z."""
    size, count = directions.shape
    entries = directions.tocoo()
    graph = scipy.sparse.coo_array(
        (np.ones(entries.nnz), (entries.coords[0], entries.coords[1] + size)), shape=(size + count,) * 2
    )
    _, label = connected_components(graph, directed=False)
    by_rows, gives_way = scipy.sparse.csr_array(directions), np.zeros(size, dtype=bool)
    parts: list[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]] = []
    for group in np.unique(label[size:]):
        rows, columns = np.flatnonzero(label[:size] == group), np.flatnonzero(label[size:] == group)
        block = by_rows[rows][:, columns].toarray()
        # The fewer contacts move a dof, the sooner it gives way.
        moved_by = np.maximum(np.count_nonzero(block, axis=1), 1)
        r, order = scipy.linalg.qr((block / moved_by[:, None]).T, mode="r", pivoting=True)
        diagonal = np.abs(np.diag(r))
        if columns.size > rows.size or diagonal.min() < INDEPENDENT * diagonal.max():
            raise InputError("contacts: their directions depend on one another; they cannot be coordinates")
        chosen = order[: columns.size]
        gives_way[rows[chosen]] = True
        parts.append((rows[chosen], columns, np.linalg.inv(block[chosen].T)))
    left = np.flatnonzero(~gives_way)
    rows = np.concatenate([np.repeat(r, c.size) for r, c, _ in parts])
    columns = np.concatenate([np.tile(c, r.size) for r, c, _ in parts])
    values = np.concatenate([block.ravel() for _, _, block in parts])
    caused = scipy.sparse.csc_array((values, (rows, columns)), shape=(size, count))
    caused.eliminate_zeros()
    stays = scipy.sparse.csc_array(
        (np.ones(left.size), (left, np.arange(left.size))), shape=(size, left.size)
    )
    followed = caused @ scipy.sparse.csc_array(by_rows[left].T)
    return scipy.sparse.csc_array(scipy.sparse.hstack([caused, stays - followed])), left
