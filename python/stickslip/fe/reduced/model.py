"""A reduced model: its matrices, and the maps from the full model to it and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from stickslip.scene.checks import Real

#: What becomes of the inertia at the contacts.
Boundary = Literal["lumped", "consistent", "massless"]


@dataclass(frozen=True, eq=False)
class Model:
    """Reduced matrices over contact coordinates, then modes, named as in `Matrices`."""

    #: Squares of the angular frequencies of the modes
    squares: Real
    #: x = offset + basis y
    basis: Real
    offset: Real
    #: y = dual (x - offset)
    dual: Real
    mass: Real
    damping: Real
    gyroscopic: Real | None
    stiffness: Real
    circulatory: Real | None
    force: Real
    lumping: str


def projected(basis: Real, matrix: Any, sign: float) -> Real:
    """Return ``basis' A basis`` without the rounding of its symmetry (sign 1) or skew symmetry (-1)."""
    return symmetric(basis.T @ (matrix @ basis), sign)


def symmetric(matrix: Real, sign: float = 1.0) -> Real:
    """Return the symmetric part of a matrix, or the skew symmetric one (sign -1)."""
    part: Real = 0.5 * (matrix + sign * matrix.T)
    return part


def dual(scene: Any, directions: Any, shapes: Real) -> Real:
    """Return what takes the contact coordinates and the modes out of a displacement."""
    weighted = scene.mass[:, None] * shapes if np.ndim(scene.mass) == 1 else scene.mass @ shapes
    return np.vstack([directions.T.toarray(), weighted.T])
