"""The Craig-Bampton basis in contact coordinates, and the reduced matrices for each kind of boundary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.linalg
import scipy.sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh, splu

from stickslip.faults import InputError
from stickslip.fe.reduced.contact_coordinates import Coordinate, Matrices
from stickslip.scene.checks import Real
from stickslip.scene.scene import Proportional, Scene

Boundary = Literal["lumped", "consistent", "massless"]
#: A mode whose stiffness is below this part of the largest one, by mass, is a free motion.
STIFFLESS = 1e-13
FREE = "scene: with its contacts held, the structure can still move freely; hold it somewhere, or by springs"


class Held:
    """The structure with held contacts: what contact coordinates cause statically, and its lowest modes."""

    def __init__(self, scene: Scene, matrices: Matrices) -> None:
        self.matrices, b = matrices, matrices.count
        self.stiffness = scipy.sparse.csc_array(matrices.stiffness[b:, b:])
        self.mass = scipy.sparse.csc_array(matrices.mass[b:, b:])
        try:
            self.factor = splu(self.stiffness, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        except RuntimeError:
            raise InputError(FREE) from None
        side = matrices.stiffness[b:, :b].toarray()
        self.static: Real = np.vstack([np.eye(b), -self.factor.solve(side)])
        force = matrices.transform.T @ scene.force
        #: How constant forces displace it, over contact coordinates and over the dofs of the scene.
        self.moved: Real = np.concatenate([np.zeros(b), self.factor.solve(force[b:])])
        self.offset: Real = matrices.transform @ self.moved
        self._squares, self._shapes = np.zeros(0), np.zeros((self.mass.shape[0], 0))

    def modes(self, count: int) -> tuple[Real, Real]:
        """Return squares of angular frequencies and mass-normalised shapes of the lowest modes.

        Raises
        ------
        InputError
            If one of them is a free motion, or they are not found.
        """
        if count > self._squares.size:
            size = self.mass.shape[0]
            inverse = LinearOperator((size, size), self.factor.solve, dtype=float)
            start = np.random.default_rng(0).standard_normal(size)
            try:
                squares, shapes = eigsh(self.stiffness, count, self.mass, sigma=0.0, OPinv=inverse, v0=start)
            except ArpackNoConvergence:
                raise InputError(f"modes: {count} modes with held contacts are not found") from None
            order = np.argsort(squares)
            self._squares, self._shapes = squares[order], shapes[:, order]
            largest = np.abs(self.stiffness.diagonal()).max() / np.abs(self.mass.diagonal()).max()
            if not self._squares[0] > STIFFLESS * largest:
                raise InputError(FREE)
        return self._squares[:count], self._shapes[:, :count]

    def below(self, frequency: float, most: int) -> int:
        """Return the number of modes up to a frequency, Hz, at least one and not above `most`."""
        count, square = min(most, 20), (2.0 * np.pi * frequency) ** 2
        while self.modes(count)[0][-1] <= square and count < most:
            count = min(most, 2 * count)
        return max(1, int((self.modes(count)[0] <= square).sum()))


@dataclass(frozen=True, eq=False)
class Model:
    """Reduced matrices over (p, r), named as in `Matrices`, and what leads to them and back."""

    squares: Real
    #: x = offset + basis y
    basis: Real
    #: y = dual (x - offset)
    dual: Real
    mass: Real
    damping: Real
    gyroscopic: Real | None
    stiffness: Real
    circulatory: Real | None
    force: Real
    lumping: str


def reduced_model(held: Held, scene: Scene, boundary: Boundary, count: int) -> Model:
    """Return the reduced matrices with so many modes.

    Raises
    ------
    InputError
        If the inertia left at the contacts is not positive.
    """
    matrices, b = held.matrices, held.matrices.count
    squares, shapes = held.modes(count)
    modal = np.vstack([np.zeros((b, count)), shapes])
    coupling = modal.T @ (matrices.mass @ held.static)
    local = np.hstack([held.static - modal @ coupling, modal])
    left = held.static.T @ (matrices.mass @ held.static) - coupling.T @ coupling
    inertia, lumping = _inertia(0.5 * (left + left.T), boundary, matrices.kinds)
    mass = scipy.linalg.block_diag(inertia, np.eye(count))
    bound = held.static.T @ (matrices.stiffness @ held.static) + coupling.T @ (squares[:, None] * coupling)
    side = -coupling.T * squares
    stiffness = np.block([[0.5 * (bound + bound.T), side], [side.T, np.diag(squares)]])

    def projected(matrix: Any, sign: float) -> Real:
        small = local.T @ (matrix @ local)
        both: Real = 0.5 * (small + sign * small.T)
        return both

    if isinstance(scene.damping, Proportional):
        # Of the reduced matrices, so that it stays proportional.
        damping = scene.damping.mass * mass + scene.damping.stiffness * stiffness
    else:
        damping = projected(matrices.damping, 1.0)
    gyroscopic = None if matrices.gyroscopic is None else projected(matrices.gyroscopic, -1.0)
    force = matrices.transform.T @ scene.force - matrices.stiffness @ held.moved
    circulatory = None
    if matrices.circulatory is not None:
        circulatory = local.T @ (matrices.circulatory @ local)
        force = force - matrices.circulatory @ held.moved
    basis = matrices.transform @ local
    weight = scene.mass[:, None] if np.ndim(scene.mass) == 1 else None
    weighted = basis[:, b:] * weight if weight is not None else scene.mass @ basis[:, b:]
    dual = np.vstack([matrices.directions.T.toarray(), weighted.T])
    return Model(
        squares, basis, dual, mass, damping, gyroscopic, stiffness, circulatory, local.T @ force, lumping
    )


def _inertia(left: Real, boundary: Boundary, kinds: tuple[Coordinate, ...]) -> tuple[Real, str]:
    """Return the inertia at the contacts that is kept, and how it was lumped.

    Raises
    ------
    InputError
        If it is not positive.
    """
    if boundary == "consistent":
        if not np.linalg.eigvalsh(left).min() > 0.0:
            raise InputError("boundary: the inertia left at the contacts is not positive; use fewer modes")
        return left, ""
    lumped, told = np.zeros(len(left)), []
    for kind in ("tangential", "normal"):
        chosen = np.array([one.kind == kind for one in kinds])
        part = left[np.ix_(chosen, chosen)]
        if not part.size:
            continue
        sums, how = part.sum(axis=1), "row sums"
        if not (sums > 0.0).all():
            sums, how = np.diag(part) * (part.sum() / np.trace(part)), "scaled diagonal"
        if not (sums > 0.0).all():
            raise InputError(
                f"boundary: the inertia left at the contacts along their {kind} directions is not positive; "
                "use fewer modes, or boundary='consistent'"
            )
        lumped[chosen] = sums
        told.append(f"{kind} by {how}")
    return np.diag(lumped), f", {', '.join(told)}"
