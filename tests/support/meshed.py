"""Elastic bodies meshed by scikit-fem: blocks and plates."""

import numpy as np
import skfem

import stickslip as ss


def elastic(mesh, young=10e9, poisson=0.3, density=2500.0, **options):
    """Return the body of a mesh of friction material."""
    return ss.fe.Body.elastic(mesh, young=young, poisson=poisson, density=density, **options)


def block(columns, rows, damping=1e-7):
    """Return a block of 40 x 20 x 10 mm in plane strain, its top held; surface "low" is on the belt."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 0.04, columns + 1), np.linspace(0, 0.02, rows + 1))
    mesh = mesh.with_boundaries({"low": lambda x: x[1] < 1e-9, "top": lambda x: x[1] > 0.02 - 1e-9})
    body = elastic(mesh, thickness=0.01, damping=ss.Rayleigh(stiffness=damping))
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
    return elastic(mesh, **options)
