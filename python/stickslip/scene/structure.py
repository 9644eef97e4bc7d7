"""The matrices of a scene over its dofs, and the directions of its contacts, for energies of motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Real
from stickslip.scene.contact import direction_entries
from stickslip.scene.elements import Spring
from stickslip.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Structure:
    """``M x'' + (C + G) x' + (K + H) x = F + D f``, with the contact forces f = (T_1, N_1, T_2, ...).

    All from the core.
    """

    #: M, C + G, K + H, (n, n), sparse or dense.
    mass: Any
    damping: Any
    stiffness: Any
    #: ``K + (H + H') / 2``, the matrix of the elastic energy, and the rest of H, ``H_a = (H - H') / 2``,
    #: whose power on the structure is ``-u' H_a x`` at velocities u; G does no work.
    elastic: Any
    circulatory: Any
    #: D, (n, 2c), sparse or dense: tangential and normal direction of every contact.
    directions: Any
    #: ``P = M^-1 D (D' M^-1 D)^-1``, (n, 2c): contact forces ``P' r`` balance r = D f.
    impulse_response: Any
    #: F, (n,).
    force: Real

    @classmethod
    def of(cls, scene: Scene, combination: str | None = None) -> Structure:
        """Return the sparse matrices of a scene, about steady sliding of a combination if one is given."""
        needed = "mass on every dof and rigid contacts" if scene.core.has_massless else ""
        if not needed and scene.elements and combination is None:
            needed = "a linear structure, without elements"
        if needed:
            raise InputError(
                f"scene: energies of modes and harmonics need {needed};"
                " Trajectory.energy and Trajectory.balance have those of a motion"
            )
        core = scene.core
        mass, damping, stiffness, elastic, circulatory = core_matrices(scene)
        directions, basis = (
            scipy.sparse.csr_array(rows.T) for rows in (core.contact_directions(), core.contact_basis())
        )
        force = scene.force
        if scene.elements and combination is not None:
            springs, dampers, constant = tangent(scene, combination)
            damping, force = damping + dampers, force + constant
            stiffness, elastic = stiffness + springs, elastic + springs
        return cls(mass, damping, stiffness, elastic, circulatory, directions, basis, force)

    @classmethod
    def dense(cls, scene: Scene) -> Structure:
        """Return the matrices of a scene as arrays."""
        sparse = cls.of(scene)
        matrices = {name: part.toarray() for name, part in vars(sparse).items() if name != "force"}
        return cls(**matrices, force=sparse.force)


def core_matrices(scene: Scene) -> list[Any]:
    """Return M, C + G, K + H, the matrix of the elastic energy and H_a, see `Structure`, sparse."""
    return [scipy.sparse.csr_array(parts, shape=(scene.size, scene.size)) for parts in scene.core.matrices()]


def times(matrix: Any, vectors: Complex) -> Complex:
    """Return a real matrix times complex columns; numpy would make the matrix complex first."""
    product: Complex = matrix @ vectors.real + 1j * (matrix @ vectors.imag)
    return product


def directions(scene: Scene) -> Any:
    """Return the directions of the elements of a scene by row, (e, n), sparse."""
    entries = [direction_entries("direction", one.direction, scene.dofs) for one in scene.elements]
    places = [(k, dof) for k, row in enumerate(entries) for dof, _ in row]
    values = [entry for row in entries for _, entry in row]
    shape = (len(entries), scene.size)
    return scipy.sparse.csr_array((values, np.array(places).reshape(-1, 2).T), shape=shape)


def tangent(scene: Scene, combination: str) -> tuple[Any, Any, Real]:
    """Return what the elements of a scene add to K, C and F for small motions about rest in a combination."""
    # Behind them are the springs of contacts, which are no part of K.
    found = np.array(scene.core.elements_at_rest(combination)).reshape(-1, 5)[: len(scene.elements)]
    along = directions(scene)
    springs = np.array([isinstance(one, Spring) for one in scene.elements], dtype=bool)
    offsets = np.array([getattr(one, "offset", 0.0) for one in scene.elements])
    argument, force, slope = found[:, 0], found[:, 1], found[:, 2]
    constant = np.where(springs, slope * (argument + offsets) - force, -force)
    stiffness, damping = (
        along.T @ scipy.sparse.diags_array(np.where(kind, slope, 0.0)) @ along for kind in (springs, ~springs)
    )
    return stiffness, damping, np.asarray(along.T @ constant)
