"""Eigenpairs nearest to a shift, right and left, by ARPACK with one sparse LU.

With ``y = (x, lambda x)`` the pencil is the companion problem ``[[0, 1], [-K, -C]] y = lambda [[1, 0], [0,
M]] y``. Shifted by sigma and inverted it takes one solution with ``P(sigma)`` a step:

    w_1 = -P(sigma)^-1 (M y_2 + (C + sigma M) y_1),   w_2 = y_1 + sigma w_1,

with eigenvalues ``theta = 1 / (lambda - sigma)``, the largest of which a Krylov space finds first (Saad 2011,
chapters 6 and 8). Left vectors are right ones of the transposed pencil, with the transposed LU. Copies of a
multiple eigenvalue come by rounding; where one does not, the certificate tells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.csgraph
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

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
#: Pairs of a first search within a radius, and the margin of the number that its density predicts.
_FIRST, _MORE = 12, 1.2


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
    pencil: SparsePencil, shift: complex, count: int, radius: float = np.inf, *, seed: int = 0, moves: int = 2
) -> Found:
    """Return the `count` eigenpairs nearest to a shift, 1/s, fewer if those within `radius`, 1/s, are fewer.

    Those of rigid bodies, which are known, are left out. If there are more, `Found.radius` is smaller than
    `radius`. Where P is singular the shift is moved aside, `moves` times at most.
    """
    size = pencil.size
    # In such units both halves of a state have the same size.
    unit = abs(shift) or pencil.frequency
    aside = shift + _ASIDE * (1.0 + 1.0j) * unit
    try:
        inverse = _Inverse(pencil, shift, unit)
    except RuntimeError:
        if moves == 0:
            raise
        return search_near(pencil, aside, count, radius, seed=seed, moves=moves - 1)
    random = np.random.default_rng(seed)
    start = random.standard_normal(2 * size) + 1j * random.standard_normal(2 * size)
    # ARPACK finds all but two pairs at most.
    count = min(count, 2 * size - 2)
    number = count if np.isinf(radius) else min(count, _FIRST)
    while True:
        values, states, reach = inverse.nearest("N", number, start)
        if number == count or reach > radius or values.size == 0:
            break
        # As many as lie within the radius where the distances go on as they began.
        number = min(count, max(number + _FIRST // 4, int(_MORE * number * radius / reach)))
    # With an eigenvalue at the shift that one alone converges, or none.
    if np.abs(values - shift).min(initial=np.inf) <= _SINGULAR * unit and moves:
        return search_near(pencil, aside, count, radius, seed=seed, moves=moves - 1)
    if values.size == 0:
        empty = np.zeros((size, 0), dtype=complex)
        return Found(shift, reach, values, empty, empty)
    # On the imaginary axis P(lambda)' = conj(P(lambda)) without damping and friction, whatever the gyroscopic
    # matrix: left vectors are conjugate right ones. What converges last has the largest part of the start.
    mix = random.standard_normal(values.size) + 1j * random.standard_normal(values.size)
    mix *= (np.abs(values - shift) / reach) ** _WEIGHT
    shapes = states[:size].conj()
    others, duals, _ = inverse.nearest(
        "T", values.size, np.concatenate([shapes @ mix, shapes @ (values / unit * mix)])
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


class _Inverse:
    """The inverted companion problem at a shift, and that of the transposed pencil, in units of time."""

    def __init__(self, pencil: SparsePencil, shift: complex, unit: float) -> None:
        self.pencil, self.shift, self.unit = pencil, shift, unit
        self.factors = pencil.factors(shift)

    def nearest(self, side: str, number: int, start: Complex) -> tuple[Complex, Complex, float]:
        """Return eigenvalues by distance, companion vectors (2m, k) and the radius that holds no others."""
        size, shift, unit = self.pencil.size, self.shift, self.unit
        mass, damping = (m if side == "N" else m.T for m in (self.pencil.mass, self.pencil.damping))
        moved = scipy.sparse.csr_array(
            scipy.sparse.hstack([-unit * (damping + shift * mass), -(unit**2) * mass])
        )

        def inverted(state: Complex) -> Complex:
            upper = self.factors.solve(moved @ state, side)
            return np.concatenate([upper, state[:size] + shift / unit * upper])

        operator = LinearOperator((2 * size, 2 * size), inverted, dtype=complex)
        try:
            theta, states = eigs(operator, k=number, v0=start, tol=_CONVERGED)
            complete = True
        except ArpackNoConvergence as error:
            theta, states, complete = error.eigenvalues, error.eigenvectors, False
        order = np.argsort(-np.abs(theta))
        distance = unit / np.abs(theta[order])
        # Of pairs at one distance the last may be one of several.
        reach = float(distance[-1]) * (1.0 - _SAME) if complete else 0.0
        return shift + unit / theta[order], states[:, order], reach


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
