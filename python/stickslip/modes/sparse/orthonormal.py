"""Orthonormal columns that grow by blocks: what Krylov spaces are made of."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import get_blas_funcs

#: Share of its length that a vector keeps, from which it is orthogonal to the space without a second round.
#: Where less is enough, what is not orthogonal grows with every vector: at 0.1 some directions come twice.
_KEPT = 0.7
#: What is left of a vector, relative to before, below which it lies in the space already.
_DEPENDENT = 1e-12


class Orthonormal:
    """Columns with ``V* W V = 1``, and room for more; the weight W is 1 unless given."""

    def __init__(self, rows: int, room: int, dtype: Any = complex, weight: Any = None) -> None:
        self.rows, self.count, self.weight = rows, 0, weight
        self._store = np.zeros((rows, room), dtype=dtype, order="F")
        self._gemm = get_blas_funcs("gemm", dtype=dtype)

    @property
    def columns(self) -> Any:
        """The columns so far, (rows, count)."""
        return self._store[:, : self.count]

    def append(self, vectors: Any) -> Any:
        """Append what is new in some vectors; return their components along all columns, (count, k).

        Columns and vectors may be shorter than all rows: the rest is zero.
        """
        vectors = np.asfortranarray(vectors)
        before, (rows, width) = self.count, vectors.shape
        if before + width > self._store.shape[1]:
            wider = np.zeros((self.rows, 2 * (before + width)), dtype=self._store.dtype, order="F")
            wider[:, :before] = self.columns
            self._store = wider
        columns = self._store[:rows, :before]
        components = np.zeros((before + width, width), dtype=self._store.dtype)
        weighed = self._weighed(vectors)
        lengths = left = self._lengths(vectors, weighed)
        for _ in range(2):
            # Without a copy of the columns for their conjugate.
            parts = self._gemm(1.0, columns, weighed, trans_a=2)
            vectors = self._gemm(-1.0, columns, parts, beta=1.0, c=vectors, overwrite_c=True)
            components[:before] += parts
            weighed = self._weighed(vectors)
            kept = self._lengths(vectors, weighed)
            if (kept > _KEPT * left).all():
                break
            left = kept
        for k in range(width):
            vector, fresh = vectors[:, k], self._store[:rows, before : self.count]
            for _ in range(2):
                parts = fresh.conj().T @ self._weighed(vector)
                vector = vector - fresh @ parts
                components[before : self.count, k] += parts
            length = self._lengths(vector, self._weighed(vector))
            if self.count < self.rows and length > _DEPENDENT * lengths[k]:
                self._store[:rows, self.count] = vector / length
                components[self.count, k] = length
                self.count += 1
        return components[: self.count]

    def _weighed(self, vectors: Any) -> Any:
        return vectors if self.weight is None else self.weight @ vectors

    def _lengths(self, vectors: Any, weighed: Any) -> Any:
        if self.weight is None:
            return np.linalg.norm(vectors, axis=0)
        return np.sqrt(np.maximum(np.sum(vectors.conj() * weighed, axis=0).real, 0.0))
