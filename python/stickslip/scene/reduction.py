"""The equations of motion that a status combination leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.scene.checks import Real
from stickslip.scene.scene import Scene, checked_combination


@dataclass(frozen=True, eq=False, repr=False)
class Reduced:
    """``M_s q'' + C_s q' + K_s q = F0 + F1 t`` in the m coordinates q that a combination leaves free.

    ``M_s = L' M R``, ``C_s = L' C R``, ``K_s = L' K R``: R holds the motions that are allowed, L how the
    equations combine. In L the normal row of a sliding contact is merged into its tangential row with factor
    -friction in ``+`` and +friction in ``-``, which makes the matrices asymmetric. Displacements are R q plus
    the prescribed ones: a sticking contact moves with its slider, and the normal displacement of a closed one
    is ``-gap``. The deflection of bristles is a coordinate without mass, of which no displacement is a part.

    Attributes
    ----------
    combination
        The status combination.
    mass, damping, stiffness
        (m, m).
    force_constant, force_linear
        F0, N, and F1, N/s: (m,). Only sticking contacts, which move with their sliders, contribute to F1;
        F0 is for zero tangential displacement of every one of them, and contains the clearances of closed
        contacts.
    right_basis, left_basis
        R and L, (n, m).
    """

    combination: str
    mass: Real
    damping: Real
    stiffness: Real
    force_constant: Real
    force_linear: Real
    right_basis: Real
    left_basis: Real

    def __repr__(self) -> str:
        n, m = self.right_basis.shape
        bent = int(np.count_nonzero(~self.right_basis.any(axis=0)))
        beside = f", {bent} deflections of bristles" if bent else ""
        return f"Reduced({self.combination!r}, {m - bent} of {n} coordinates free{beside})"


def equations_of(scene: Scene, combination: str) -> Reduced:
    """Return the equations of motion while the contacts keep a status combination.

    Raises
    ------
    InputError
        If `combination` is not one of ``+ - s d`` per contact, or lets a frictionless contact stick.
    """
    core = scene.core.reduced(checked_combination(scene, combination))
    return Reduced(
        combination,
        core.mass,
        core.damping,
        core.stiffness,
        core.force_constant,
        core.force_linear,
        core.right_basis,
        core.left_basis,
    )
