"""The lowest modes of an undamped structure, a few more whenever they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

from stickslip.faults import InputError
from stickslip.fe.reduced.orthonormal import Orthonormal
from stickslip.scene.checks import Real

#: Residual of a mode, relative to its theta, up to which it counts as found.
_CONVERGED = 1e-12
#: Vectors of a block, the largest multiplicity that is found for sure; by how much the space grows between
#: two looks at what has converged.
_BLOCK, _GROWTH = 4, 1.15


class LowestModes:
    """``K phi = w^2 M phi``, ``phi' M phi = 1``, by block Lanczos on the inverse of ``K + shift M``.

    The space of ``(K + shift M)^-1 M``, with eigenvalues ``theta = 1 / (w^2 + shift)``, is kept and goes on
    where more modes are asked for.

    Raise `RuntimeError` if ``K + shift M`` is singular.
    """

    def __init__(self, stiffness: Any, mass: Any, shift: float) -> None:
        self.stiffness, self.mass = scipy.sparse.csc_array(stiffness), scipy.sparse.csc_array(mass)
        self.shift = shift
        moved = self.stiffness + shift * self.mass if shift else self.stiffness
        self.factor = splu(
            scipy.sparse.csc_array(moved), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        )
        size = self.mass.shape[0]
        self._random = np.random.default_rng(0)
        self._space = Orthonormal(size, 32 * _BLOCK, scipy.sparse.csr_array(self.mass))
        #: The operator in the space, for the columns of it that were multiplied
        self._projected = np.zeros((0, 0))
        self._massless = not self.mass.diagonal().all()
        self._squares, self._shapes = np.zeros(0), np.zeros((size, 0))

    def __call__(self, count: int) -> tuple[Real, Real]:
        """Return squares of angular frequencies, ascending, and shapes (n, count).

        Raise `InputError` if there are fewer.
        """
        self._extend(lambda squares: squares.size >= count)
        if self._squares.size < count:
            raise InputError(f"modes: the structure has {self._squares.size}, not {count}")
        return self._squares[:count], self._shapes[:, :count]

    def below(self, frequency: float, most: int) -> int:
        """Return the number of modes up to a frequency, Hz, at least one and not above `most`."""
        square = (2.0 * np.pi * frequency) ** 2
        self._extend(lambda squares: squares.size >= most or bool((squares > square).any()))
        return min(most, max(1, int((self._squares <= square).sum())))

    def _extend(self, enough: Callable[[Real], bool]) -> None:
        """Extend the space until enough modes are found, or all."""
        space, done = self._space, self._projected.shape[1]
        while not enough(self._squares):
            if done == space.count:
                # The space holds all that follows from its start; a new start is orthogonal to it.
                start = self._random.standard_normal((self.mass.shape[0], _BLOCK))
                space.append(self._follows(start))
                if done == space.count:
                    return
            goal = max(done + 8 * _BLOCK, int(_GROWTH * done))
            # Threads gain nothing on blocks so narrow, and on a busy machine wait for each other.
            with threadpool_limits(1, user_api="blas"):
                while done < min(goal, space.count):
                    stop = min(done + _BLOCK, space.count)
                    parts = space.append(self._follows(space.columns[:, done:stop]))
                    wider = np.zeros((len(parts), stop))
                    wider[: self._projected.shape[0], :done] = self._projected
                    wider[:, done:] = parts
                    self._projected, done = wider, stop
                theta, mix = scipy.linalg.eigh(self._projected[:done])
            # A free motion has an infinite theta, by rounding of either sign.
            order = np.argsort(-np.abs(theta))
            theta, mix = theta[order], mix[:, order]
            left = np.linalg.norm(self._projected[done:] @ mix, axis=0)
            failed = ~(left <= _CONVERGED * np.abs(theta))
            count = int(np.argmax(failed)) if failed.any() else done
            self._squares = 1.0 / theta[:count] - self.shift
            self._shapes = space.columns[:, :done] @ mix[:, :count]
            if self._massless:
                # Products with M do not see dofs without mass, where rounding of the space adds up; they
                # follow from the others (Nour-Omid et al., Numerical Methods in Engineering 24, 1987).
                self._shapes = self._follows(self._shapes) / theta[:count]

    def _follows(self, vectors: Real) -> Real:
        solved: Real = self.factor.solve(np.asarray(self.mass @ vectors))
        return solved
