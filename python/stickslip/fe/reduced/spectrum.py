"""Eigenvalues of sparse and of reduced quadratic pencils: how a reduction is told right."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
from scipy.optimize import linear_sum_assignment
from scipy.sparse.linalg import LinearOperator, eigs, splu

from stickslip.scene.checks import Complex, Real

#: Eigenvalues that one shift is asked for.
PER_SHIFT = 24


def full_eigenvalues(mass: Any, damping: Any, stiffness: Any, band: tuple[float, float]) -> Complex:
    """Return the eigenvalues of ``l^2 M + l C + K`` of modulus in a band, Hz, and imaginary part >= 0.

    Arnoldi's method on the companion form, with one sparse factorization per shift on the imaginary axis;
    shifts go up from the lower end of the band, each where the one before has found all that is around it.
    """
    size = mass.shape[0]
    low, high = (2.0 * np.pi * end for end in band)
    found = np.zeros(0, dtype=complex)
    reached, width = low, (high - low) / 8.0
    while reached < high:
        # In units of the shift, so that x and x' are of one size.
        unit = reached + width
        inertia, rate = unit**2 * mass, unit * damping
        factor = splu(scipy.sparse.csc_array(-inertia + 1j * rate + stiffness))

        def applied(
            vector: Complex, inertia: Any = inertia, rate: Any = rate, factor: Any = factor
        ) -> Complex:
            # The inverse of the companion form x' = v, M v' = -K x - C v, less its shift j.
            x, v = vector[:size], vector[size:]
            moved = factor.solve(-(inertia @ (v + 1j * x) + rate @ x))
            return np.concatenate([moved, 1j * moved + x])

        operator = LinearOperator((2 * size, 2 * size), applied, dtype=complex)
        start = np.random.default_rng(0).standard_normal(2 * size).astype(complex)
        inverse = eigs(operator, min(PER_SHIFT, 2 * size - 2), v0=start, return_eigenvectors=False)
        values = unit * (1j + 1.0 / inverse)
        found = np.concatenate([found, values[values.imag >= -1e-9 * np.abs(values)]])
        # Everything within the largest distance is found.
        radius = 0.9 * np.abs(values - 1j * unit).max()
        if unit - radius <= reached:
            reached = unit + radius
        width = radius
    inside = (np.abs(found) >= low) & (np.abs(found) <= high)
    return _distinct(found[inside])


def reduced_eigenvalues(mass: Real, damping: Real, stiffness: Real) -> Complex:
    """Return the eigenvalues of a small pencil with imaginary part >= 0."""
    size = mass.shape[0]
    accelerated = np.linalg.solve(mass, np.hstack([-stiffness, -damping]))
    companion = np.vstack([np.hstack([np.zeros((size, size)), np.eye(size)]), accelerated])
    values: Complex = np.linalg.eigvals(companion).astype(complex)
    return values[values.imag >= 0.0]


def matched(wanted: Complex, offered: Complex) -> tuple[Complex, Real]:
    """Return the eigenvalue that stands for each wanted one, none of them twice, and relative distances.

    Where there are too few, nan and an infinite distance.
    """
    distance = np.abs(wanted[:, None] - offered[None, :]) / np.abs(wanted)[:, None]
    rows, columns = linear_sum_assignment(distance)
    values, errors = np.full(wanted.size, complex(np.nan, np.nan)), np.full(wanted.size, np.inf)
    values[rows], errors[rows] = offered[columns], distance[rows, columns]
    return values, errors


def _distinct(values: Complex) -> Complex:
    """Return eigenvalues once each, where neighbouring shifts found the same; ascending in modulus."""
    kept: list[complex] = []
    for value in values[np.argsort(np.abs(values))]:
        if not any(abs(value - other) <= 1e-8 * abs(value) for other in kept[-8:]):
            kept.append(complex(value))
    return np.array(kept, dtype=complex)
