"""Eigenvalues of a large pencil by scipy's search, refined by quotients in extended precision."""

import numpy as np
import scipy.sparse.linalg
from threadpoolctl import threadpool_limits


def reference_eigenvalues(mass, damping, stiffness, highest):
    """Return the eigenvalues of the upper half plane up to a frequency, Hz, and some more."""
    # The many small blocks of SuperLU suffer from BLAS that splits them among threads.
    with threadpool_limits(1, user_api="blas"):
        return _searched(mass, damping, stiffness, highest)


def _searched(mass, damping, stiffness, highest):
    size, unit = mass.shape[0], 2.0 * np.pi * highest
    found = []
    for shift in (0.21j, 0.52j, 0.83j):
        sigma = shift * unit
        factors = scipy.sparse.linalg.splu(
            (sigma * (sigma * mass + damping) + stiffness).tocsc(), permc_spec="MMD_AT_PLUS_A",
            options={"SymmetricMode": True}, diag_pivot_thresh=0.1,
        )  # fmt: skip

        def inverted(y, transpose="N", sigma=sigma, factors=factors):
            m, c = (mass, damping) if transpose == "N" else (mass.T, damping.T)
            w = -factors.solve(unit * (m @ y[size:]) + c @ y[:size] + sigma * (m @ y[:size]), transpose)
            return np.concatenate([w, (y[:size] + sigma * w) / unit])

        # theta = 1 / (lambda - sigma)
        sides = []
        for transpose in "NT":
            operator = scipy.sparse.linalg.LinearOperator(
                (2 * size, 2 * size), matvec=lambda y, t=transpose: inverted(y, t), dtype=complex
            )
            theta, vectors = scipy.sparse.linalg.eigs(operator, k=30, tol=1e-12, v0=np.ones(2 * size) + 0j)
            sides.append((sigma + 1.0 / theta, vectors[:size]))
        (values, right), (others, left) = sides
        for k, value in enumerate(values):
            partner = int(np.argmin(np.abs(others - value)))
            if abs(others[partner] - value) < 1e-6 * abs(value):
                found.append(refined(mass, damping, stiffness, value, right[:, k], left[:, partner]))
    found = np.array([value for value in found if value.imag > 0.0])
    found = found[np.argsort(np.abs(found))]
    keep = np.ones(found.size, dtype=bool)
    for k in range(1, found.size):
        keep[k] = np.abs(found[:k] - found[k]).min() > 1e-9 * abs(found[k])
    return found[keep]


def refined(mass, damping, stiffness, value, right, left):
    """Return the eigenvalue less its quotient, summed in extended precision."""
    x, v, value = (np.asarray(z, dtype=np.clongdouble) for z in (right, left, value))

    def form(matrix):
        entries = matrix.tocoo()
        return np.sum(v[entries.coords[0]] * entries.data.astype(np.longdouble) * x[entries.coords[1]])

    m, c, k = form(mass), form(damping), form(stiffness)
    for _ in range(3):
        value = value - (value * (value * m + c) + k) / (2.0 * value * m + c)
    return complex(value)
