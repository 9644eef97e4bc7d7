"""Nested dissection: an order of elimination with little fill for graphs of meshes.

A set of vertices that separates a graph into two halves comes last, its halves before it in the same manner
(George, SIAM Journal on Numerical Analysis 10, 1973): entries between the halves stay zero. Separators are
levels of a breadth-first search from an end of the graph (George, Liu, Computer Solution of Large Sparse
Positive Definite Systems, 1981, chapter 8), of which a vertex without neighbours beyond goes to its half.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse
import scipy.sparse.csgraph
from numpy.typing import NDArray

#: Vertices of a part that is divided no further: some nodes of a mesh with three directions each.
_PART = 60
#: Share of the vertices that the smaller half has at least, where levels allow it.
_HALF = 0.3
#: Searches for an end of the graph.
_ENDS = 2


def dissected(graph: Any) -> NDArray[np.int64]:
    """Return the vertices of a symmetric graph (n, n), csr, in the order of their elimination."""
    parts: list[NDArray[np.int64]] = []
    # The last in the order come first: a separator is taken before the halves that precede it.
    waiting = [(np.arange(graph.shape[0]), graph)]
    while waiting:
        vertices, edges = waiting.pop()
        lower, upper, separator = _halves(edges) if vertices.size > _PART else (np.zeros(0, int),) * 3
        if not lower.size or not upper.size:
            parts.append(vertices)
            continue
        parts.append(vertices[separator])
        waiting += [(vertices[half], edges[half][:, half]) for half in (lower, upper)]
    return np.concatenate(parts[::-1])


def _halves(edges: Any) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return two sets of vertices that no edge joins, and the set between them."""
    # The searches of scipy 1.13 take no wider indices.
    parts = (edges.data, edges.indices.astype(np.int32), edges.indptr.astype(np.int32))
    edges = scipy.sparse.csr_array(parts, shape=edges.shape)
    root = 0
    for _ in range(_ENDS + 1):
        level = scipy.sparse.csgraph.dijkstra(edges, directed=False, unweighted=True, indices=root)
        reached = np.isfinite(level)
        if not reached.all():
            return np.flatnonzero(reached), np.flatnonzero(~reached), np.zeros(0, dtype=np.int64)
        root = int(level.argmax())
    level = level.astype(np.int64)
    counts = np.bincount(level)
    before = np.cumsum(counts) - counts
    smaller = np.minimum(before, level.size - before - counts)
    fair = smaller >= min(_HALF * level.size, smaller.max())
    chosen = np.flatnonzero(fair)[counts[fair].argmin()]
    between, beyond = np.flatnonzero(level == chosen), level > chosen
    touches = edges[between] @ beyond.astype(float) > 0.0
    lower = np.concatenate([np.flatnonzero(level < chosen), between[~touches]])
    return lower, np.flatnonzero(beyond), between[touches]
