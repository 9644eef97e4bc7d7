"""Orthonormal columns that grow by blocks: what Krylov spaces are made of."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg.blas import dgemm

from stickslip.scene.checks import Real

#: Share of its length that a vector keeps, from which it is orthogonal to the space without a second round.
#: Where less is enough, what is not orthogonal grows with every vector: at 0.1 some directions come twice.
_KEPT = 0.7
#: What is left of a vector, relative to before, below which it lies in the space already.
_DEPENDENT = 1e-12


class Orthonormal:
    """Columns with ``V' W V = 1`` for a weight W, and room for more."""

    def __init__(self, rows: int, room: int, weight: Any) -> None:
        self.rows, self.count, self.weight = rows, 0, weight
        self._store = np.zeros((rows, room), order="F")

    @property
    def columns(self) -> Real:
        """The columns so far, (rows, count)."""
        return self._store[:, : self.count]

    def append(self, vectors: Real) -> Real:
        """Append what is new in some vectors; return their components along all columns, (count, k)."""
        vectors = np.asfortranarray(vectors)
        before, width = self.count, vectors.shape[1]
        if before + width > self._store.shape[1]:
            wider = np.zeros((self.rows, 2 * (before + width)), order="F")
            wider[:, :before] = self.columns
            self._store = wider
        columns = self._store[:, :before]
        components = np.zeros((before + width, width))
        weighed = self.weight @ vectors
        lengths = left = _lengths(vectors, weighed)
        for _ in range(2):
            parts = columns.T @ weighed
            # In place.
            vectors = dgemm(-1.0, columns, parts, beta=1.0, c=vectors, overwrite_c=True)
            components[:before] += parts
            weighed = self.weight @ vectors
            kept = _lengths(vectors, weighed)
            if (kept > _KEPT * left).all():
                break
            left = kept
        for k in range(width):
            vector, fresh = vectors[:, k], self._store[:, before : self.count]
            for _ in range(2):
                parts = fresh.T @ (self.weight @ vector)
                vector = vector - fresh @ parts
                components[before : self.count, k] += parts
            length = _lengths(vector, self.weight @ vector)
            if self.count < self.rows and length > _DEPENDENT * lengths[k]:
                self._store[:, self.count] = vector / length
                components[self.count, k] = length
                self.count += 1
        return components[: self.count]


def _lengths(vectors: Real, weighed: Real) -> Any:
    return np.sqrt(np.maximum(np.sum(vectors * weighed, axis=0), 0.0))
