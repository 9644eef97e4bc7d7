"""The matrices of a scene over its dofs, and the directions of its contacts, for energies of motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.scene.checks import Complex, Real
from stickslip.scene.scene import Proportional, Scene


@dataclass(frozen=True, eq=False)
class Structure:
    """``M x'' + C x' + K x = F + D f``, with the contact forces f = (T_1, N_1, T_2, ...).

    Attributes
    ----------
    mass, damping, stiffness
        M, C, K, (n, n), sparse where they are given so, or dense.
    force
        F, (n,).
    directions
        D, (n, 2c): tangential and normal direction of every contact.
    impulse_response
        ``P = M^-1 D (D' M^-1 D)^-1``, (n, 2c), from the core: ``P' r`` are the contact forces that balance
        r = D f.
    """

    mass: Any
    damping: Any
    stiffness: Any
    force: Real
    directions: Any
    impulse_response: Any

    @classmethod
    def of(cls, scene: Scene) -> Structure:
        """Return the matrices of a scene."""
        mass = scipy.sparse.diags_array(scene.mass).tocsr() if scene.mass.ndim == 1 else scene.mass
        damping = scene.damping
        if damping is None:
            damping = scipy.sparse.csr_array((scene.size, scene.size))
        elif isinstance(damping, Proportional):
            damping = damping.mass * mass + damping.stiffness * scene.stiffness
        columns = [
            direction(i)
            for i in range(len(scene.contacts))
            for direction in (scene.tangential_direction, scene.normal_direction)
        ]
        directions = scipy.sparse.csr_array(np.reshape(columns, (len(columns), scene.size)).T)
        basis = scipy.sparse.csr_array(scene.core.contact_basis().T)
        return cls(mass, damping, scene.stiffness, scene.force, directions, basis)

    @classmethod
    def dense(cls, scene: Scene) -> Structure:
        """Return the matrices of a scene as dense arrays."""
        return cls(*(dense(part) for part in vars(cls.of(scene)).values()))


def dense(matrix: Any) -> Real:
    """Return a matrix of a scene, dense or sparse, as an array."""
    dense: Real = matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix)
    return dense


def times(matrix: Any, vectors: Complex) -> Complex:
    """Return a real matrix times complex columns; numpy would make the matrix complex first."""
    product: Complex = matrix @ vectors.real + 1j * (matrix @ vectors.imag)
    return product
