"""An elastic block pressed on a moving belt: plane strain, bilinear quadrilaterals, its top edge held."""

import numpy as np
import scipy.linalg
import scipy.sparse

import stickslip as ss

YOUNG, POISSON, DENSITY = 10e9, 0.3, 2500.0
LENGTH, HEIGHT, THICKNESS = 0.04, 0.02, 0.01


def element(width, height):
    """Return stiffness and mass (8, 8) of a rectangle, corners counterclockwise, by 2 x 2 Gauss points."""
    factor = YOUNG / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    law = factor * np.array(
        [[1.0 - POISSON, POISSON, 0.0], [POISSON, 1.0 - POISSON, 0.0], [0.0, 0.0, 0.5 - POISSON]]
    )
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    stiffness, mass = np.zeros((8, 8)), np.zeros((8, 8))
    for s in corners[:, 0] / np.sqrt(3.0):
        for t in np.array([-1.0, 1.0]) / np.sqrt(3.0):
            shape = 0.25 * (1.0 + corners[:, 0] * s) * (1.0 + corners[:, 1] * t)
            along = 0.25 * corners[:, 0] * (1.0 + corners[:, 1] * t) * 2.0 / width
            across = 0.25 * corners[:, 1] * (1.0 + corners[:, 0] * s) * 2.0 / height
            strain = np.zeros((3, 8))
            strain[0, ::2], strain[1, 1::2] = along, across
            strain[2, ::2], strain[2, 1::2] = across, along
            moved = np.kron(shape, np.eye(2))
            stiffness += strain.T @ law @ strain
            mass += DENSITY * moved.T @ moved
    # Each of the points s, t stands for a quarter; s runs over two points, twice each.
    weight = THICKNESS * width * height / 8.0
    return weight * stiffness, weight * mass


def quad_block(columns, rows, every=1, *, lumped=True, sparse=False, friction=0.3, restitution=0.0):
    """Return the scene of a mesh, one in `every` lower node on the belt; dofs are x and y node by node.

    A mass that is not lumped is the consistent one, dense unless `sparse`; so is the stiffness.
    """
    stiffness_part, mass_part = element(LENGTH / columns, HEIGHT / rows)
    if lumped:
        mass_part = np.diag(mass_part.sum(axis=1))
    across = columns + 1
    count = 2 * across * (rows + 1)
    corner = (np.arange(columns)[:, None] + np.arange(rows) * across).ravel()
    nodes = corner[:, None] + np.array([0, 1, 1 + across, across])
    dofs = np.stack([2 * nodes, 2 * nodes + 1], axis=2).reshape(corner.size, 8)
    at = (np.repeat(dofs, 8, axis=1).ravel(), np.tile(dofs, (1, 8)).ravel())
    stiffness, mass = (
        scipy.sparse.csr_array((np.tile(part.ravel(), corner.size), at), shape=(count, count))
        for part in (stiffness_part, mass_part)
    )
    # The top is lowered by 1 um; what it does to the other nodes is a load.
    held = np.arange(2 * across * rows, count)
    free = np.arange(2 * across * rows)
    lowered = np.where(held % 2 == 1, -1e-6, 0.0)
    force = -stiffness[free][:, held] @ lowered
    stiffness, mass = (matrix[free][:, free] for matrix in (stiffness, mass))
    if not sparse:
        stiffness, mass = stiffness.toarray(), mass.toarray()
    return ss.Scene(
        mass.diagonal() if lumped else mass,
        stiffness,
        damping=ss.Rayleigh(stiffness=1e-7),
        force=force,
        contacts=[
            ss.Contact(
                tangential=2 * k,
                normal=2 * k + 1,
                friction=friction,
                slider_speed=1.0,
                restitution=restitution,
            )
            for k in range(0, across, every)
        ],
        impact_friction=not lumped,
    )


def free_block(columns, rows, every, modes):
    """Return a model of the block by modes without contacts; every contact moves all of them."""
    scene = quad_block(columns, rows, lumped=False)
    squares, shapes = scipy.linalg.eigh(
        np.asarray(scene.stiffness), np.asarray(scene.mass), subset_by_index=(0, modes - 1)
    )
    return ss.Scene(
        np.ones(modes),
        np.diag(squares),
        damping=scene.damping,
        force=shapes.T @ scene.force,
        contacts=[
            ss.Contact(tangential=shapes[2 * k], normal=shapes[2 * k + 1], friction=0.3, slider_speed=1.0)
            for k in range(0, columns + 1, every)
        ],
        impact_friction=True,
    )


def reduced_block(columns, rows, every, modes):
    """Return a Craig-Bampton model of the block with dense stiffness, and masses lumped at its contacts.

    ``S = M_bb - M_bq M_qb``, the inertia that the modes leave at the contacts, is replaced by its row sums.
    """
    scene = quad_block(columns, rows, lumped=False)
    stiffness, mass = np.asarray(scene.stiffness), np.asarray(scene.mass)
    count = mass.shape[0]
    kept = 2 * np.arange(0, columns + 1, every)
    kept = np.concatenate([kept, kept + 1])
    inner = np.setdiff1d(np.arange(count), kept)
    k_inner, m_inner = (matrix[np.ix_(inner, inner)] for matrix in (stiffness, mass))
    shapes = scipy.linalg.eigh(k_inner, m_inner, subset_by_index=(0, modes - 1))[1]
    basis = np.zeros((count, kept.size + modes))
    basis[kept, : kept.size] = np.eye(kept.size)
    basis[inner, : kept.size] = -np.linalg.solve(k_inner, stiffness[np.ix_(inner, kept)])
    basis[inner, kept.size :] = shapes
    coupling = (basis.T @ mass @ basis)[: kept.size, kept.size :]
    left = (basis.T @ mass @ basis)[: kept.size, : kept.size] - coupling @ coupling.T
    # Coordinates in which mass couples modes and contacts no longer.
    basis[:, : kept.size] -= basis[:, kept.size :] @ coupling.T
    reduced = basis.T @ stiffness @ basis
    # The modes are those of the block held at its contacts: what couples them is rounding.
    inner = reduced[kept.size :, kept.size :]
    reduced[kept.size :, kept.size :] = np.diag(inner.diagonal())
    contacts = kept.size // 2
    lumped = np.maximum(left.sum(axis=1), 0.2 * np.diag(left))
    return ss.Scene(
        np.concatenate([lumped, np.ones(modes)]),
        0.5 * (reduced + reduced.T),
        damping=scene.damping,
        force=basis.T @ scene.force,
        contacts=[
            ss.Contact(tangential=k, normal=contacts + k, friction=0.3, slider_speed=1.0)
            for k in range(contacts)
        ],
    )
