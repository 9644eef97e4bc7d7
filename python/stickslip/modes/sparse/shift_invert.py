"""Eigenpairs nearest to a shift, right and left, by block Arnoldi with one sparse LU.

With ``y = (x, lambda x)`` the pencil is the companion problem ``[[0, 1], [-K, -C]] y = lambda [[1, 0], [0,
M]] y``. Shifted by sigma and inverted it takes one solution with ``P(sigma)`` a step:

    w_1 = -P(sigma)^-1 (M y_2 + (C + sigma M) y_1),   w_2 = y_1 + sigma w_1,

with eigenvalues ``theta = 1 / (lambda - sigma)``, the largest of which a Krylov space finds first (Saad 2011,
chapters 6 and 8). Left vectors are right ones of the transposed pencil, with the transposed LU. The start is
a block, because one vector finds one copy only of a multiple eigenvalue.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.csgraph

from stickslip.modes.sparse.orthonormal import Orthonormal
from stickslip.modes.sparse.pencil import SparsePencil
from stickslip.scene.checks import Complex

#: Residual of a Ritz pair, relative to its theta, up to which it counts as converged; the eigenvalue of a
#: right and a left vector has about the square as its error.
_CONVERGED = 1e-10
#: Relative distance up to which a right and a left Ritz value are the same eigenvalue.
_SAME = 1e-6
#: Relative distance up to which eigenvalues are a cluster, whose vectors are told apart together.
_CLUSTER = 1e-4
#: Distance of an eigenvalue, in units of the shift, at which P is singular within rounding, so that no other
#: one is found; and to where the shift is moved then: what is nearest to it stays so.
_SINGULAR, _ASIDE = 1e-8, 1e-5
#: Power of the distance from the shift with which right vectors make up the start for left ones.
_WEIGHT = 4
#: Entries of the factors per row from which left vectors share those of the right ones.
_SHARED = 500
#: Vectors of a block, dimensions of the largest Krylov space per wanted pair, and dimensions added at least.
_BLOCK, _DIMENSIONS, _ROUND = 2, 12, 24


@dataclass(frozen=True)
class Found:
    """Eigenpairs that one shift has found: all within its `radius` that a Krylov space shows.

    Eigenvalues (k,), vectors over the coordinates of the pencil (m, k).
    """

    shift: complex
    radius: float
    eigenvalues: Complex
    right: Complex
    left: Complex

    def kept(self, chosen: Any) -> Found:
        """Return the pairs that an index or a mask chooses."""
        return Found(
            self.shift, self.radius, self.eigenvalues[chosen], self.right[:, chosen], self.left[:, chosen]
        )


def search_near(
    pencil: SparsePencil,
    shift: complex,
    count: int,
    radius: float = np.inf,
    *,
    seed: int = 0,
    block: int = _BLOCK,
    moves: int = 2,
) -> Found:
    """Return the `count` eigenpairs nearest to a shift, fewer if those within `radius` are fewer.

    Those of rigid bodies, which are known, are left out.

    Parameters
    ----------
    pencil
        The pencil.
    shift
        1/s.
    count
        Largest number of pairs; `Found.radius` is then smaller than `radius`.
    radius
        Distance from the shift within which all pairs are wanted, 1/s.
    seed
        Of the random start.
    block
        Number of vectors of the start: the largest multiplicity that is found for sure.
    moves
        How often the shift may be moved aside where P is singular.
    """
    size = pencil.size
    # In such units both halves of a state have the same size.
    unit = abs(shift) or pencil.frequency
    aside = shift + _ASIDE * (1.0 + 1.0j) * unit
    try:
        krylov = _Krylov(pencil, shift, unit, "N")
    except RuntimeError:
        if moves == 0:
            raise
        return search_near(pencil, aside, count, radius, seed=seed, block=block, moves=moves - 1)
    random = np.random.default_rng(seed)
    block = max(block, pencil.rigid_bodies.number)
    start = random.standard_normal((2 * size, block)) + 1j * random.standard_normal((2 * size, block))
    values, states, reach, dimensions = krylov.nearest(start, count, radius)
    # With an eigenvalue at the shift that one alone converges, or none.
    if np.abs(values - shift).min(initial=0.0 if values.size == 0 else np.inf) <= _SINGULAR * unit and moves:
        return search_near(pencil, aside, count, radius, seed=seed, block=block, moves=moves - 1)
    if values.size == 0:
        empty = np.zeros((size, 0), dtype=complex)
        return Found(shift, reach, values, empty, empty)
    # SuperLU solves with the factors of a transposed matrix one vector after the other, slower than a block
    # with its own; making these takes longer only where many entries fill in.
    factors = krylov.factors if krylov.factors.nnz > _SHARED * size else None
    del krylov
    distance = np.abs(values - shift)
    mix = random.standard_normal((values.size, block)) + 1j * random.standard_normal((values.size, block))
    # On the imaginary axis P(lambda)' = conj(P(lambda)) without damping and friction, whatever the gyroscopic
    # matrix: left vectors are conjugate right ones. What converges last has the largest part of the start.
    mix *= ((distance / (distance.max() or 1.0)) ** _WEIGHT)[:, None]
    shapes = states[:size].conj()
    others, duals, *_ = _Krylov(pencil, shift, unit, "T", factors).nearest(
        np.concatenate([shapes @ mix, shapes @ (values[:, None] / unit * mix)]),
        values.size,
        float(distance.max()) * (1.0 + 1e-9),
        3 * dimensions // 4,
    )
    mine, theirs = (~pencil.rigid_bodies.among(found, shift) for found in (values, others))
    values, states, others, duals = values[mine], states[:, mine], others[theirs], duals[:, theirs]
    pairs = _matched(values, others, unit)
    lost = np.setdiff1d(np.arange(values.size), [i for i, _ in pairs])
    missed = float(np.abs(values[lost] - shift).min(initial=np.inf))
    chosen, partners = (
        np.array(side, dtype=int) for side in (zip(*pairs, strict=True) if pairs else ((), ()))
    )
    values, right, left = _biorthogonal(pencil, values[chosen], states[:, chosen], duals[:, partners], unit)
    return Found(shift, min(reach, missed), values, right, left)


class _Krylov:
    """Block Arnoldi of the inverted companion problem, or of that of the transposed pencil (side "T").

    `factors`: those of ``P(shift)``, if its own are not worth making.
    """

    def __init__(
        self, pencil: SparsePencil, shift: complex, unit: float, side: str, factors: Any = None
    ) -> None:
        self.shift, self.unit, self.size = shift, unit, pencil.size
        mass, damping = pencil.mass, pencil.damping
        if side == "T":
            mass, damping = mass.T, damping.T
        # In units of time in which `unit` is 1.
        self.moved = scipy.sparse.csr_array(
            scipy.sparse.hstack([-unit * (damping + shift * mass), -(unit**2) * mass])
        )
        self.trans = "N" if factors is None else side
        self.factors = pencil.factors(shift, side) if factors is None else factors

    def nearest(
        self, start: Complex, count: int, radius: float, begin: int = 0
    ) -> tuple[Complex, Complex, float, int]:
        """Return eigenvalues, companion vectors (2m, k), the radius that holds no others, and dimensions.

        Both halves of all Krylov vectors lie in one space that is half as long, and grows by w_1 alone (Lu,
        Su, Bai, SIAM J. Matrix Anal. Appl. 37, 2016): kept are a basis of that and coordinates in it.

        `begin`: the dimension at which convergence is looked at first; 0: unknown.
        """
        size, block = self.size, start.shape[1]
        limit = min(2 * size, _DIMENSIONS * count + 10 * _ROUND)
        space = Orthonormal(size, 2 * count + 2 * _ROUND)
        # Coordinates of upper and lower halves in turns: of a longer space, both follow.
        krylov = Orthonormal(2 * min(size, limit + 2 * block), limit + block)
        projected = np.zeros((limit + block + 1, limit), dtype=complex)

        def put(upper: Complex, lower: Complex) -> Complex:
            coordinates = np.empty((2 * len(upper), upper.shape[1]), dtype=complex, order="F")
            coordinates[::2], coordinates[1::2] = upper, lower
            components: Complex = krylov.append(coordinates)
            return components

        both = space.append(np.concatenate([start[:size], start[size:]], axis=1))
        put(both[:, :block], both[:, block:])
        done, check = 0, begin or (_ROUND if np.isfinite(radius) else max(_ROUND, 2 * count + count // 2))
        while True:
            stop = min(krylov.count, done + block, limit)
            if stop > done:
                rows = 2 * space.count
                last = krylov.columns[:rows, done:stop]
                # One state a row, its upper before its lower half: the space is read once for all of them.
                halves = last.reshape(space.count, 2, -1).transpose(2, 1, 0).reshape(-1, space.count)
                states = (halves @ space.columns.T).reshape(-1, 2 * size)
                # By columns: scipy's product with several at once takes three times as long.
                moved = np.stack([self.moved @ state for state in states], axis=1)
                added = space.append(self.factors.solve(moved, self.trans))
                follows = self.shift / self.unit * added
                follows[: len(last) // 2] += last[::2]
                parts = put(added, follows)
                projected[: len(parts), done:stop] = parts
            # Nothing new: the space is invariant, and no more is to be had from this start.
            ends = stop in (done, limit) or krylov.count == stop
            done = stop
            if ends or done >= check:
                whole = krylov.count == done == 2 * size
                theta, shapes, reach, settled = self._ritz(
                    projected[:done, :done], projected[done : krylov.count, :done], count, radius, whole
                )
                if settled or ends:
                    coordinates = krylov.columns[: 2 * space.count, :done] @ shapes
                    vectors = [space.columns @ coordinates[half::2] for half in (0, 1)]
                    with np.errstate(divide="ignore", invalid="ignore"):
                        values = self.shift + self.unit / theta
                    return values, np.concatenate(vectors), reach, done
                check = done + max(_ROUND // 4, done // 16)

    def _ritz(
        self, projected: Complex, rest: Complex, count: int, radius: float, whole: bool
    ) -> tuple[Complex, Complex, float, bool]:
        """Return theta and shapes so far, the radius, and whether all that is wanted has converged."""
        theta, shapes = scipy.linalg.eig(projected)
        order = np.argsort(-np.abs(theta))
        theta, shapes = theta[order], shapes[:, order]
        with np.errstate(divide="ignore"):
            distance = self.unit / np.abs(theta)
        failed = np.linalg.norm(rest @ shapes, axis=0) > _CONVERGED * np.abs(theta)
        first = theta.size if whole or not failed.any() else int(np.argmax(failed))
        # That an eigenvalue beyond the radius has converged shows that the space has got so far.
        inside = int(np.count_nonzero(distance <= radius))
        settled = whole or first >= min(count, inside + 1)
        kept = min(first, count)
        reach = float(distance[kept - 1]) if kept else 0.0
        if whole and kept == theta.size:
            reach = np.inf
        return theta[:kept], shapes[:, :kept], reach, settled


def _matched(values: Complex, others: Complex, unit: float) -> list[tuple[int, int]]:
    """Return pairs of equal right and left eigenvalues, each used once."""
    free = np.ones(others.size, dtype=bool)
    pairs = []
    for i, value in enumerate(values):
        distance = np.where(free, np.abs(others - value), np.inf)
        k = int(np.argmin(distance)) if others.size else 0
        if others.size and distance[k] <= _SAME * max(abs(value), 1e-3 * unit):
            free[k] = False
            pairs.append((i, k))
    return pairs


def clusters(values: Complex, distance: float, unit: float) -> list[Any]:
    """Return indices of eigenvalues, those that a chain of steps below a relative distance joins together."""
    close = np.abs(values[:, None] - values) <= distance * np.maximum(np.abs(values), 1e-3 * unit)[:, None]
    count, labels = scipy.sparse.csgraph.connected_components(scipy.sparse.csr_array(close), directed=False)
    return [np.flatnonzero(labels == k) for k in range(count)]


def _biorthogonal(
    pencil: SparsePencil, values: Complex, states: Complex, duals: Complex, unit: float
) -> tuple[Complex, Complex, Complex]:
    """Return eigenvalues, right and left displacements; within a cluster v_i' (C + (l_i + l_j) M) x_j = 0.

    The cluster is solved again between its left and right space: ``(Y' A X)^-1 Y' B X`` with the symmetric
    companion matrices ``A = [[C, M], [M, 0]]``, ``B = [[K, 0], [0, -M]]``.
    """
    size = pencil.size
    values, right, left = values.copy(), states[:size].copy(), duals[:size].copy()
    for group in clusters(values, _CLUSTER, unit):
        if group.size == 1:
            continue
        x, v = states[:size, group], duals[:size, group]
        dx, dv = unit * states[size:, group], unit * duals[size:, group]
        moved = pencil.mass @ dx
        gram = v.T @ (pencil.damping @ x + moved) + dv.T @ (pencil.mass @ x)
        form = v.T @ (pencil.stiffness @ x) - dv.T @ moved
        # A defective cluster has no such vectors; it keeps those of the two searches.
        if np.linalg.cond(gram) > 1e8:
            continue
        small, mix = scipy.linalg.eig(-np.linalg.solve(gram, form))
        if np.linalg.cond(mix) > 1e8:
            continue
        values[group] = small
        right[:, group] = x @ mix
        left[:, group] = v @ np.linalg.inv(gram).T @ np.linalg.inv(mix).T
    return values, right, left
