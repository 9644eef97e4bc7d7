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
    """``M x'' + (C + G) x' + (K + H) x = F + D f``, with the contact forces f = (T_1, N_1, T_2, ...).

    Attributes
    ----------
    mass, damping, stiffness
        M, C + G, K + H, (n, n), sparse where they are given so, or dense.
    elastic, circulatory
        ``K + (H + H') / 2``, the matrix of the elastic energy, and ``H_a = (H - H') / 2``, whose power on the
        structure is ``-x'' H_a x`` (transposed velocity); G does no work.
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
    elastic: Any
    circulatory: Any
    force: Real
    directions: Any
    impulse_response: Any

    @classmethod
    def of(cls, scene: Scene) -> Structure:
        """Return the matrices of a scene."""
        mass = scipy.sparse.diags_array(scene.mass).tocsr() if scene.mass.ndim == 1 else scene.mass
        damping = scene.damping
        none = scipy.sparse.csr_array((scene.size, scene.size))
        if damping is None:
            damping = none
        elif isinstance(damping, Proportional):
            damping = damping.mass * mass + damping.stiffness * scene.stiffness
        if scene.gyroscopic is not None:
            damping = damping + scene.gyroscopic
        stiffness = elastic = scene.stiffness
        circulatory: Any = none
        if scene.circulatory is not None:
            stiffness = stiffness + scene.circulatory
            elastic = elastic + 0.5 * (scene.circulatory + scene.circulatory.T)
            circulatory = 0.5 * (scene.circulatory - scene.circulatory.T)
        columns = [
            direction(i)
            for i in range(len(scene.contacts))
            for direction in (scene.tangential_direction, scene.normal_direction)
        ]
        directions = scipy.sparse.csr_array(np.reshape(columns, (len(columns), scene.size)).T)
        basis = scipy.sparse.csr_array(scene.core.contact_basis().T)
        return cls(mass, damping, stiffness, elastic, circulatory, scene.force, directions, basis)

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
