"""The standard eigenproblem of a small dense pencil, also where coordinates have no mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.scene.checks import Complex, Flags, Real


@dataclass(frozen=True)
class States:
    """``P(lambda) x = 0`` over the states ``(unit x_r, x_r', x_s)``: slip x_s without mass has no x_s'.

    With s the coordinates whose column of M is zero, ``P(lambda)`` times lambda in these columns is
    ``lambda^2 [M_r, C_s] + lambda [C_r, K_s] + [K_r, 0]``; the zeros that this adds have states of their own,
    left out.
    """

    matrix: Real
    #: ``[M_r, C_s]``
    leading: Real
    #: Which coordinates have mass.
    second: Flags
    #: In units of the fastest eigenvalue places and velocities have the same size, 1/s.
    unit: float

    @classmethod
    def of(cls, mass: Real, damping: Real, stiffness: Real) -> States:
        """Return the states of M, C and K, (r, r) each."""
        second: Flags = np.abs(mass).max(axis=0) > 0.0
        leading = np.where(second, mass, damping)
        rates = np.where(second, damping, stiffness)
        inverse = np.linalg.solve(leading, np.concatenate([-stiffness[:, second], -rates], axis=1))
        unit = float(np.sqrt(np.linalg.norm(stiffness) / np.linalg.norm(mass))) or 1.0
        count = np.count_nonzero(second)
        inverse[:, :count] /= unit
        upper = np.concatenate([np.zeros((count, count)), unit * np.eye(second.size)[second]], axis=1)
        return cls(np.concatenate([upper, inverse]), leading, second, unit)

    def shapes(self, vectors: Complex) -> Complex:
        """Return x, (r, k), of right vectors by columns."""
        count = np.count_nonzero(self.second)
        shapes: Complex = np.array(vectors[count:], dtype=complex)
        shapes *= self.unit
        shapes[self.second] = vectors[:count]
        return shapes

    def lefts(self, duals: Complex) -> Complex:
        """Return v, (r, k), of left vectors by rows."""
        count = np.count_nonzero(self.second)
        return np.asarray(np.linalg.solve(self.leading.T, duals[:, count:].T), dtype=complex)
