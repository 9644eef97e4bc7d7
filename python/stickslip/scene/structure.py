"""The matrices of a scene over its dofs, and the directions of its contacts, for energies of motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Real
from stickslip.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Structure:
    """``M x'' + (C + G) x' + (K + H) x = F + D f``, with the contact forces f = (T_1, N_1, T_2, ...).

    All from the core.

    Attributes
    ----------
    mass, damping, stiffness
        M, C + G, K + H, (n, n), sparse or dense.
    elastic, circulatory
        ``K + (H + H') / 2``, the matrix of the elastic energy, and the rest of H, ``H_a = (H - H') / 2``,
        whose power on the structure is ``-u' H_a x`` at velocities u; G does no work.
    directions
        D, (n, 2c), the same: tangential and normal direction of every contact.
    impulse_response
        ``P = M^-1 D (D' M^-1 D)^-1``, (n, 2c), the same: ``P' r`` are the contact forces that balance
        r = D f.
    force
        F, (n,).
    """

    mass: Any
    damping: Any
    stiffness: Any
    elastic: Any
    circulatory: Any
    directions: Any
    impulse_response: Any
    force: Real

    @classmethod
    def of(cls, scene: Scene) -> Structure:
        """Return the sparse matrices of a scene.

        Raises
        ------
        InputError
            If some dofs have no mass, or contacts are compliant: their nodes are none of the dofs.
        """
        if scene.core.has_massless:
            raise InputError(
                "scene: energies of modes and harmonics need mass on every dof and rigid contacts;"
                " Trajectory.energy and Trajectory.balance have those of a motion"
            )
        core, shape = scene.core, (scene.size, scene.size)
        mass, damping, stiffness, elastic, circulatory = (
            scipy.sparse.csr_array(parts, shape=shape) for parts in core.matrices()
        )
        directions, basis = (
            scipy.sparse.csr_array(rows.T) for rows in (core.contact_directions(), core.contact_basis())
        )
        return cls(mass, damping, stiffness, elastic, circulatory, directions, basis, scene.force)

    @classmethod
    def dense(cls, scene: Scene) -> Structure:
        """Return the matrices of a scene as arrays."""
        sparse = cls.of(scene)
        matrices = {name: part.toarray() for name, part in vars(sparse).items() if name != "force"}
        return cls(**matrices, force=sparse.force)


def times(matrix: Any, vectors: Complex) -> Complex:
    """Return a real matrix times complex columns; numpy would make the matrix complex first."""
    product: Complex = matrix @ vectors.real + 1j * (matrix @ vectors.imag)
    return product
