"""Elastic bodies meshed by scikit-fem: a block on a belt, a pad on a disc."""

import numpy as np
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import stickslip as ss


def elastic(mesh, element, young=10e9, poisson=0.3, density=2500.0, thickness=1.0, **options):
    """Return the body of a mesh of one elastic material."""
    basis = skfem.Basis(mesh, skfem.ElementVector(element), intorder=2)
    stiffness = thickness * linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    mass = thickness * density * skfem.BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis)
    return ss.fe.Body.from_skfem(basis, mass, stiffness, **options)


def block(columns, rows, damping=1e-7):
    """Return a block of 40 x 20 x 10 mm in plane strain, its top held; surface "low" is on the belt."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 0.04, columns + 1), np.linspace(0, 0.02, rows + 1))
    mesh = mesh.with_boundaries({"low": lambda x: x[1] < 1e-9, "top": lambda x: x[1] > 0.02 - 1e-9})
    body = elastic(mesh, skfem.ElementQuad1(), thickness=0.01, damping=ss.Proportional(stiffness=damping))
    return body.held(body.surface("top"))


def plate(counts, size, low, **options):
    """Return a box whose lowest corner is `low`, with its faces "bottom" and "top"."""
    axes = [np.linspace(a, a + s, n + 1) for a, s, n in zip(low, size, counts, strict=True)]
    mesh = skfem.MeshHex.init_tensor(*axes).with_boundaries(
        {
            "bottom": lambda x: x[2] < low[2] + 1e-9,
            "top": lambda x: x[2] > low[2] + size[2] - 1e-9,
        }
    )
    return elastic(mesh, skfem.ElementHex1(), **options)


def ring(counts, radii, heights, angles):
    """Return a mesh of a part of a ring: cylindrical coordinates (r, angle, z) of a box, made round.

    A full turn closes: its first and last nodes are the same.
    """
    axes = [np.linspace(*ends, n + 1) for ends, n in zip((radii, angles, heights), counts, strict=True)]
    mesh = skfem.MeshHex.init_tensor(*axes)
    r, angle, z = mesh.p
    points, cells = np.stack([r * np.cos(angle), r * np.sin(angle), z]), mesh.t
    if np.isclose(angles[1] - angles[0], 2 * np.pi):
        rounded = np.round(points / 1e-9).astype(np.int64)
        _, first, place = np.unique(rounded, axis=1, return_index=True, return_inverse=True)
        points, cells = points[:, first], place.ravel()[cells]
    return skfem.MeshHex(points, cells)
