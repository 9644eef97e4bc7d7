"""A scene as dense matrices over its dofs, for energies of modes and of given motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.scene.checks import Complex, Real
from stickslip.scene.contact import core_contact
from stickslip.modes.modes import Modes
from stickslip.scene.scene import Proportional, Scene

#: T / (mu N) of every status whose friction force Coulomb's law gives.
FRICTION_SIGN = {"+": 1.0, "-": -1.0, "s": 0.0, "d": 0.0}


@dataclass(frozen=True, eq=False)
class Structure:
    """``M x'' + C x' + K x = F + D f``, with the contact forces f = (T_1, N_1, T_2, ...).

    Attributes
    ----------
    mass, damping, stiffness
        M, C, K, (n, n).
    force
        F, (n,).
    directions
        D, (n, 2c): tangential and normal direction of every contact.
    impulse_response
        ``P = M^-1 D (D' M^-1 D)^-1``, (n, 2c): ``P' r`` are the contact forces that balance r = D f.
    """

    mass: Real
    damping: Real
    stiffness: Real
    force: Real
    directions: Real
    impulse_response: Real

    @classmethod
    def of(cls, scene: Scene) -> Structure:
        """Return the matrices of a scene."""
        mass = np.diag(scene.mass) if scene.mass.ndim == 1 else scene.mass
        stiffness = _dense(scene.stiffness)
        if scene.damping is None:
            damping = np.zeros_like(mass)
        elif isinstance(scene.damping, Proportional):
            damping = scene.damping.mass * mass + scene.damping.stiffness * stiffness
        else:
            damping = _dense(scene.damping)
        directions = np.zeros((scene.size, 2 * len(scene.contacts)))
        for i, contact in enumerate(scene.contacts):
            for k, direction in enumerate(core_contact(contact, i, scene.dofs)[:2]):
                directions[:, 2 * i + k] = (
                    np.eye(scene.size)[direction] if isinstance(direction, int) else direction
                )
        response = np.linalg.solve(mass, directions)
        impulse_response = response @ np.linalg.inv(directions.T @ response)
        return cls(mass, damping, stiffness, scene.force, directions, impulse_response)


def mode_friction(structure: Structure, scene: Scene, modes: Modes) -> Complex:
    """Return the phasors of the friction forces T of every mode, (c, m), N per m of displacement.

    The normal forces hold the gaps closed; Coulomb's law gives T from them. A sticking contact does no work
    in a mode, its tangential displacement being prescribed: 0.
    """
    unbalanced = (structure.mass @ modes.shapes) * modes.eigenvalues**2
    unbalanced += (structure.damping @ modes.shapes) * modes.eigenvalues + structure.stiffness @ modes.shapes
    normal = (structure.impulse_response.T @ unbalanced)[1::2]
    pairs = zip(modes.combination, scene.contacts, strict=True)
    factor = np.array([FRICTION_SIGN[status] * contact.friction for status, contact in pairs])
    phasors: Complex = factor[:, None] * normal
    return phasors


def _dense(matrix: Any) -> Real:
    dense: Real = matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix)
    return dense
