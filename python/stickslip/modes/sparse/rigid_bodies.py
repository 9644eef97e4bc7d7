"""Eigenvalues of rigid-body motions: their vectors are the null space of the stiffness.

Without damping or with damping in proportion to the stiffness such a motion has the double eigenvalue zero
with one vector. A search finds it split by the root of rounding, another way at each shift and on each side,
and a start of few vectors finds few of several. So the null spaces are found first, by inverse iteration.
Within them

    lambda (lambda v' M x + v' C x) = 0

gives zero once, or twice where ``v' C x`` is zero, and ``-v' C x / v' M x`` where this pair solves the whole
problem, as under damping in proportion to the mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from stickslip.scene.checks import Complex, Real

#: Vectors of the first start, and steps of the iteration.
_VECTORS, _STEPS = 8, 6
#: Shift of the iteration, relative to the largest stiffness over mass.
_SHIFT = 1e-12
#: Forces, relative to the terms that cancel in them, up to which they are zero.
_ZERO = 1e-13
#: Residual, relative to its terms, up to which a pair solves the whole problem; condition of usable vectors.
_SOLVED, _CONDITION = 1e-10, 1e8
#: How far from its place a search may find a known eigenvalue: relative to the distance of the shift, by the
#: root of the tolerance of a Krylov space, and in what rounding splits; both with some margin.
_AWAY, _SPLIT = 1e-4, 10.0


@dataclass(frozen=True)
class RigidBodies:
    """Known eigenvalues, each as often as it counts, those of the upper half plane; vectors (m, k)."""

    eigenvalues: Complex
    right: Complex
    left: Complex
    #: Dimension of the null space
    number: int
    #: How far rounding of the stiffness may split a double zero, 1/s
    split: float

    def among(self, values: Complex, shift: complex) -> Any:
        """Return which values that a shift has found are the known ones, as a mask (k,)."""
        known = np.concatenate([self.eigenvalues, self.eigenvalues[self.eigenvalues.imag > 0.0].conj()])
        mask = np.zeros(values.size, dtype=bool)
        for value in np.unique(known):
            distance = np.where(mask, np.inf, np.abs(values - value))
            near = np.argsort(distance, kind="stable")[: np.count_nonzero(known == value)]
            reach = _AWAY * abs(shift - value) + _SPLIT * self.split
            mask[near[distance[near] <= reach]] = True
        return mask


def rigid_bodies(pencil: Any) -> RigidBodies:
    """Return what the null space of a stiffness tells of the eigenvalues of a `SparsePencil`."""
    right, left = (_null_space(pencil, side) for side in "NT")
    none = np.zeros((pencil.stiffness.shape[0], 0), dtype=complex)
    nothing = RigidBodies(np.zeros(0, dtype=complex), none, none, 0, 0.0)
    if right.shape[1] == 0 or right.shape != left.shape:
        return nothing
    inertia = left.T @ (pencil.mass @ right)
    if np.linalg.cond(inertia) > _CONDITION:
        return nothing
    rates, mix = scipy.linalg.eig(-np.linalg.solve(inertia, left.T @ (pencil.damping @ right)))
    if np.linalg.cond(mix) > _CONDITION:
        return nothing
    x: Complex = right @ mix
    v: Complex = (left @ np.linalg.inv(inertia).T @ np.linalg.inv(mix).T).astype(complex)
    # Of v' M x = 1: what rounding of the entries adds to v' K x and v' C x.
    stiffness, damping = (
        (abs(v) * (abs(matrix) @ abs(x))).sum(axis=0) for matrix in (pencil.stiffness, pencil.damping)
    )
    split = float(2.0 * np.sqrt(np.finfo(float).eps * stiffness.max()))
    rates = np.where(np.abs(rates.imag) <= 1e-9 * np.abs(rates), rates.real + 0.0j, rates)
    twice = np.abs(rates) <= np.maximum(_ZERO * damping, split)
    rates[twice] = 0.0
    # Of a conjugate pair one.
    chosen = twice | (rates.imag >= 0.0) & _solve(pencil, rates, x, "N") & _solve(pencil, rates, v, "T")
    values = np.concatenate([np.zeros(rates.size, dtype=complex), rates[chosen]])
    return RigidBodies(
        values,
        np.concatenate([x, x[:, chosen]], axis=1),
        np.concatenate([v, v[:, chosen]], axis=1),
        rates.size,
        split,
    )


def _solve(pencil: Any, values: Complex, vectors: Complex, side: str) -> Any:
    """Return which eigenvalues solve the problem with these vectors that the stiffness leaves at rest."""
    mass, damping = (m if side == "N" else m.T for m in (pencil.mass, pencil.damping))
    inertia, drag = values**2 * (mass @ vectors), values * (damping @ vectors)
    size = np.linalg.norm(inertia, axis=0) + np.linalg.norm(drag, axis=0)
    return np.linalg.norm(inertia + drag, axis=0) <= _SOLVED * size


def _null_space(pencil: Any, side: str) -> Real:
    """Return an orthonormal basis of the null space of the stiffness, or of its transpose: side "T"."""
    size = pencil.stiffness.shape[0]
    stiffness = pencil.stiffness if side == "N" else pencil.stiffness.T
    largest = float(np.abs(pencil.stiffness.diagonal()).max(initial=0.0)) or 1.0
    solve = pencil.static_solver(_SHIFT * largest, side)
    random, count = np.random.default_rng(0), min(_VECTORS, size)
    while True:
        vectors = random.standard_normal((size, count))
        for _ in range(_STEPS):
            vectors = np.linalg.qr(solve(vectors))[0]
        _, sizes, turns = np.linalg.svd(stiffness @ vectors, full_matrices=False)
        vectors = vectors @ turns.T
        terms = np.linalg.norm(abs(stiffness) @ abs(vectors), axis=0)
        null = sizes <= _ZERO * terms
        if count == size or not null.all():
            return np.ascontiguousarray(vectors[:, null])
        count = min(2 * count, size)
