"""The quadratic pencil of a large scene, scaled, and its sparse factorizations."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import scipy.sparse
import scipy.sparse.csgraph
import scipy.sparse.linalg
from threadpoolctl import threadpool_limits

from stickslip.modes.sparse.dissection import dissected
from stickslip.modes.sparse.rigid_bodies import RigidBodies, rigid_bodies
from stickslip.scene.checks import Complex, Real
from stickslip.scene.scene import Scene

_Item = TypeVar("_Item")
_Made = TypeVar("_Made")

#: Entries of both factors per row from which nested dissection is tried, too: where fewer fill in, the order
#: takes longer than what it saves.
_DISSECTED = 600
#: A pivot on the diagonal is taken down to this share of the largest entry of its column: fill against
#: accuracy.
_PIVOT = 0.01


@dataclass(frozen=True)
class SparsePencil:
    """``P(lambda) = lambda^2 M + lambda C + K`` over scaled and reordered coordinates.

    Coordinates of the scene are ``q[order] = q_new``, each times its `scaling`. Scaled by the roots of its
    masses, so that vectors are weighed by kinetic energy. The order keeps the fill of a symmetric
    factorization low (minimum degree on A + A', or nested dissection) and is found once.
    """

    mass: Any
    damping: Any
    stiffness: Any
    scaling: Real
    order: Any
    #: Where any of the matrices or their transposes has an entry; its data: where the transpose has it.
    pattern: Any
    #: Entries of M, C and K there, (3, nnz)
    entries: Real

    @classmethod
    def of(cls, scene: Scene, combination: str) -> SparsePencil:
        """Return the pencil of a scene in one status combination."""
        return cls.of_matrices(*(sparse_array(parts) for parts in scene.core.sparse_pencil(combination)))

    @classmethod
    def of_matrices(cls, mass: Any, damping: Any, stiffness: Any) -> SparsePencil:
        """Return the pencil of M, C and K."""
        inertia = np.abs(mass.diagonal())
        scaling = 1.0 / np.sqrt(np.where(inertia > 0.0, inertia, 1.0))
        pattern = abs(mass) + abs(damping) + abs(stiffness)
        pattern = pattern + pattern.T
        # Only the pattern counts; a dominant diagonal keeps the pivots where they are.
        shifted = pattern + scipy.sparse.diags_array(1.0 + pattern.sum(axis=0))
        order = _order(scipy.sparse.csc_array(shifted))
        scale = scipy.sparse.diags_array(scaling)

        def prepared(matrix: Any) -> Any:
            return scipy.sparse.csc_array((scale @ matrix @ scale).tocsc()[order][:, order])

        mass, damping, stiffness = matrices = [prepared(matrix) for matrix in (mass, damping, stiffness)]
        pattern = scipy.sparse.csc_array(shifted[order][:, order])
        pattern.sort_indices()
        pattern.data = np.arange(pattern.nnz)
        places = _places(pattern)
        entries = np.zeros((3, pattern.nnz))
        for row, matrix in zip(entries, matrices, strict=True):
            row[np.searchsorted(places, _places(matrix))] = matrix.data
        pattern.data = scipy.sparse.csc_array(pattern.T).data
        return cls(mass, damping, stiffness, scaling, order, pattern, entries)

    @property
    def size(self) -> int:
        """Number of coordinates, m."""
        return int(self.order.size)

    @property
    def frequency(self) -> float:
        """A frequency of the problem, 1/s: the root of mean stiffness over mass."""
        return float(np.sqrt(np.abs(self.stiffness.diagonal()).mean())) or 1.0

    def at(self, value: complex, side: str = "N") -> Any:
        """Return ``P(value)``, or its transpose: side "T"."""
        mass, damping, stiffness = self.entries
        data = value * (value * mass + damping) + stiffness
        pattern = self.pattern
        data = data if side == "N" else data[pattern.data]
        return scipy.sparse.csc_array((data, pattern.indices, pattern.indptr), shape=pattern.shape)

    def factors(self, value: complex, side: str = "N") -> Any:
        """Return the sparse LU of ``P(value)``, or of its transpose: side "T"."""
        return _factors(self.at(value, side), "NATURAL")

    def static_solver(self, shift: float, side: str = "N") -> Callable[[Real], Real]:
        """Return what solves with ``K + shift``, or with its transpose: side "T"."""
        moved = scipy.sparse.csc_array(self.stiffness + shift * scipy.sparse.eye_array(self.size))
        factors = _factors(moved, "NATURAL")
        return lambda vectors: np.asarray(factors.solve(vectors, side))

    @cached_property
    def rigid_bodies(self) -> RigidBodies:
        """The eigenvalues of rigid-body motions."""
        return rigid_bodies(self)

    def log_determinant(self, value: complex) -> complex:
        """Return ``log det P(value)``, its imaginary part up to a multiple of 2 pi."""
        factors = self.factors(value)
        pivots: Complex = factors.U.diagonal()
        odd = _is_odd(factors.perm_r) != _is_odd(factors.perm_c)
        return complex(np.log(pivots).sum()) + (1j * np.pi if odd else 0.0)

    def unscaled(self, vectors: Complex) -> Complex:
        """Return vectors (m, k) over the coordinates of the scene's combination."""
        restored = np.empty_like(vectors)
        restored[self.order] = vectors
        restored *= self.scaling[:, None]
        return restored


def sparse_array(parts: tuple[Any, Any, Any]) -> Any:
    """Return a matrix of the core."""
    size = parts[2].size - 1
    return scipy.sparse.csr_array(parts, shape=(size, size))


def on_all_cores(make: Callable[[_Item], _Made], items: Iterable[_Item]) -> list[_Made]:
    """Return what is made of each item, one thread per processor.

    The blocks of a sparse factorization are small: BLAS that splits each of them among threads takes many
    times as long as one factorization per thread, so it is held to one.
    """
    listed = list(items)
    with threadpool_limits(1, user_api="blas"), ThreadPoolExecutor(max(1, os.cpu_count() or 1)) as pool:
        return list(pool.map(make, listed))


def _order(matrix: Any) -> Any:
    """Return an order of a symmetric matrix with a dominant diagonal in which few entries fill in."""
    factors = _factors(matrix, "MMD_AT_PLUS_A")
    order, fill = np.argsort(factors.perm_c), factors.nnz
    if fill > _DISSECTED * order.size:
        del factors
        other = dissected(scipy.sparse.csr_array(matrix))
        if _factors(scipy.sparse.csc_array(matrix[other][:, other]), "NATURAL").nnz < fill:
            return other
    return order


def _factors(matrix: Any, order: str) -> Any:
    return scipy.sparse.linalg.splu(
        matrix, permc_spec=order, diag_pivot_thresh=_PIVOT, options={"SymmetricMode": True}
    )


def _places(matrix: Any) -> Any:
    """Return a number for the place of each entry of a matrix by columns, ascending."""
    size = matrix.shape[0]
    return np.repeat(np.arange(size) * size, np.diff(matrix.indptr)) + matrix.indices


def _is_odd(permutation: Any) -> bool:
    """Return whether a permutation is odd: its length less the number of its cycles is."""
    size = permutation.size
    graph = scipy.sparse.csr_array(
        (np.ones(size, dtype=bool), (np.arange(size), permutation)), shape=(size, size)
    )
    cycles = scipy.sparse.csgraph.connected_components(graph, directed=False, return_labels=False)
    return bool((size - cycles) % 2)
