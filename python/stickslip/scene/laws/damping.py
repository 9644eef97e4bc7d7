"""Damping of a scene: proportional to mass and stiffness, or a matrix."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.checks import Matrix, MatrixLike, core_matrix, described, finite, real_matrix

#: Damping as a user gives it.
DampingLike: TypeAlias = "Rayleigh | MatrixLike"


@dataclass(frozen=True)
class Rayleigh:
    """Damping ``C = mass M + stiffness K``; mass in 1/s, stiffness in s, neither negative."""

    mass: float = 0.0
    stiffness: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "stiffness"):
            object.__setattr__(self, name, finite(f"damping.{name}", getattr(self, name), least=0.0))


def described_damping(damping: Rayleigh | Matrix | None) -> str:
    """Return damping in words."""
    if damping is None:
        return "none"
    if isinstance(damping, Rayleigh):
        parts = [(damping.mass, "1/s times mass"), (damping.stiffness, "s times stiffness")]
        return " + ".join(f"{factor:g} {what}" for factor, what in parts if factor) or "none"
    return "matrix"


def checked_damping(damping: Any) -> Rayleigh | Matrix | None:
    """Return damping as a scene keeps it."""
    if damping is None or isinstance(damping, Rayleigh):
        return damping
    if np.ndim(damping) == 0 and not scipy.sparse.issparse(damping):
        raise InputError(
            f"damping: expected a matrix, Rayleigh or None, got {described(damping)}; for C = beta K "
            "pass Rayleigh(stiffness=beta)"
        )
    return real_matrix("damping", damping)


def core_damping(damping: Rayleigh | Matrix | None) -> Any:
    """Return damping as the core takes it: two coefficients, or a matrix."""
    if damping is None:
        return (0.0, 0.0)
    if isinstance(damping, Rayleigh):
        return (damping.mass, damping.stiffness)
    return core_matrix(damping)


def rayleigh_matrix(damping: Rayleigh, mass: Any, stiffness: Any) -> Any:
    """Return C of matrices M and K, of their kind: dense or sparse."""
    return damping.mass * mass + damping.stiffness * stiffness
