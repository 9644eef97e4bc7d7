"""A scene as dense matrices over its dofs, for energies of modes and of given motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.scene.checks import Real
from stickslip.scene.contact import core_contact
from stickslip.scene.scene import Proportional, Scene


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
        stiffness = dense(scene.stiffness)
        if scene.damping is None:
            damping = np.zeros_like(mass)
        elif isinstance(scene.damping, Proportional):
            damping = scene.damping.mass * mass + scene.damping.stiffness * stiffness
        else:
            damping = dense(scene.damping)
        directions = np.zeros((scene.size, 2 * len(scene.contacts)))
        for i, contact in enumerate(scene.contacts):
            for k, direction in enumerate(core_contact(contact, i, scene.dofs)[:2]):
                directions[:, 2 * i + k] = (
                    np.eye(scene.size)[direction] if isinstance(direction, int) else direction
                )
        response = np.linalg.solve(mass, directions)
        impulse_response = response @ np.linalg.inv(directions.T @ response)
        return cls(mass, damping, stiffness, scene.force, directions, impulse_response)


def dense(matrix: Any) -> Real:
    """Return a matrix of a scene, dense or sparse, as an array."""
    dense: Real = matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix)
    return dense
