"""Friction across the sliding direction, as modes of steady sliding feel it.

Friction opposes the slip velocity, ``T = -mu N s / |s|``. In steady sliding ``s = -v t``; a small motion
``b . x'`` across it turns the force by ``b . x' / |v|`` and leaves its size alone:

    T_b = -(mu N_0 / |v|) b . x'

a damping matrix ``sum mu N_0 / |v| b b'`` over the sliding contacts, N_0 their normal forces at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from stickslip.faults import InputError
from stickslip.modes.sparse.pencil import sparse_array
from stickslip.scene.checks import described
from stickslip.scene.contact import entries_of
from stickslip.scene.laws.damping import Rayleigh, rayleigh_matrix
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.scene import Scene


def with_transverse_friction(scene: Scene, combination: str, transverse: Sequence[Any]) -> Scene:
    """Return the scene with the friction damping across sliding of one combination.

    Parameters
    ----------
    scene
        The scene.
    combination
        Letters ``+`` and ``-`` slide.
    transverse
        One direction b per contact, by dof such as ``{"12.2": 1.0}`` or a vector (n,); None or empty: none.

    Raises
    ------
    InputError
        If there is not one per contact, one is ill-posed, a contact that slides would pull or its slider is
        at rest, or the stiffness is singular.
    """
    if isinstance(transverse, str) or not isinstance(transverse, Sequence | np.ndarray):
        raise InputError(f"transverse: expected one direction per contact, got {described(transverse)}")
    if len(transverse) != len(scene.contacts):
        raise InputError(
            f"transverse: expected {len(scene.contacts)} directions, one per contact, got {len(transverse)}"
        )
    wanted = [
        (k, entries)
        for k, direction in enumerate(transverse)
        if direction is not None
        and (entries := entries_of(f"transverse[{k}]", direction, scene.dofs))
        and combination[k] in "+-"
    ]
    if not wanted:
        return scene
    pressed = _normal_forces(scene, combination)
    rows, columns, values = [], [], []
    for k, entries in wanted:
        contact, normal_force = scene.contacts[k], pressed[k]
        speed = abs(contact.slider_speed)
        if not normal_force >= 0.0 or speed == 0.0:
            what = "its slider is at rest" if speed == 0.0 else f"its normal force is {normal_force:.6g} N"
            raise InputError(f"transverse: contact {k} does not slide steadily in {combination!r}: {what}")
        law = contact.friction
        friction = law.coefficient(speed) if isinstance(law, FrictionLaw) else law
        factor = np.sqrt(friction * normal_force / speed)
        rows += [dof for dof, _ in entries]
        columns += [k] * len(entries)
        values += [factor * entry for _, entry in entries]
    across = scipy.sparse.csr_array((values, (rows, columns)), shape=(scene.size, len(scene.contacts)))
    before: Any = scene.damping
    if isinstance(before, Rayleigh):
        before = rayleigh_matrix(before, _sparse(scene.mass), _sparse(scene.stiffness))
    added = across @ across.T
    return scene.replace(damping=added if before is None else _sparse(before) + added)


def _sparse(matrix: Any) -> scipy.sparse.csr_array:
    return scipy.sparse.csr_array(scipy.sparse.diags_array(matrix) if np.ndim(matrix) == 1 else matrix)


def _normal_forces(scene: Scene, combination: str) -> Any:
    """Return the normal forces of the closed contacts at rest, gaps of the open ones."""
    load, rows, offsets, _ = scene.core.statics(combination)
    stiffness = sparse_array(scene.core.sparse_pencil(combination)[2]).tocsc()
    try:
        rest = scipy.sparse.linalg.splu(stiffness).solve(load.ravel())
    except RuntimeError:
        raise InputError(
            f"transverse: the stiffness of {combination!r} is singular; normal forces are not known"
        ) from None
    return rows @ rest - offsets.ravel()
