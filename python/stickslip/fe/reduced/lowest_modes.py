"""The lowest modes of an undamped structure, a few more whenever they are asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh, splu

from stickslip.faults import InputError
from stickslip.scene.checks import Real


class LowestModes:
    """``K phi = w^2 M phi``, ``phi' M phi = 1``, by Lanczos on the inverse of ``K + shift M``.

    Raises
    ------
    RuntimeError
        If ``K + shift M`` is singular.
    """

    def __init__(self, stiffness: Any, mass: Any, shift: float) -> None:
        self.stiffness, self.mass = scipy.sparse.csc_array(stiffness), scipy.sparse.csc_array(mass)
        self.shift = shift
        moved = self.stiffness + shift * self.mass if shift else self.stiffness
        self.factor = splu(
            scipy.sparse.csc_array(moved), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        )
        self._squares, self._shapes = np.zeros(0), np.zeros((self.mass.shape[0], 0))

    def __call__(self, count: int) -> tuple[Real, Real]:
        """Return squares of angular frequencies, ascending, and shapes (n, count).

        Raises
        ------
        InputError
            If they are not found.
        """
        if count > self._squares.size:
            size = self.mass.shape[0]
            inverse = LinearOperator((size, size), self.factor.solve, dtype=float)
            start = np.random.default_rng(0).standard_normal(size)
            try:
                squares, shapes = eigsh(
                    self.stiffness, count, self.mass, sigma=-self.shift, OPinv=inverse, v0=start
                )
            except ArpackNoConvergence:
                raise InputError(f"modes: the {count} lowest modes of the structure are not found") from None
            order = np.argsort(squares)
            self._squares, self._shapes = squares[order], shapes[:, order]
        return self._squares[:count], self._shapes[:, :count]

    def below(self, frequency: float, most: int) -> int:
        """Return the number of modes up to a frequency, Hz, at least one and not above `most`."""
        count, square = min(most, 20), (2.0 * np.pi * frequency) ** 2
        while self(count)[0][-1] <= square and count < most:
            count = min(most, 2 * count)
        return max(1, int((self(count)[0] <= square).sum()))
