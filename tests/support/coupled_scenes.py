"""Scenes whose contacts are coupled by mass: an impact of one lifts the others, which strike in turn."""

from __future__ import annotations

import numpy as np

import stickslip as ss


def masses_on_a_belt(
    count: int, coupling: float, restitution: float, height: float = 1e-4
) -> tuple[ss.Scene, ss.State]:
    """Return masses pressed on a belt, at different heights; W is 1, and ``coupling`` off its diagonal."""
    inverse = np.eye(count) + coupling * (1.0 - np.eye(count))
    mass = np.zeros((2 * count, 2 * count))
    mass[:count, :count] = np.eye(count)
    mass[count:, count:] = np.linalg.inv(inverse)
    contacts = [
        ss.Contact(tangential=i, normal=count + i, friction=0.1, slider_speed=1.0, restitution=restitution)
        for i in range(count)
    ]
    scene = ss.Scene(
        mass=mass,
        stiffness=1e2 * np.eye(2 * count),
        damping=ss.Rayleigh(stiffness=1e-6),
        force=np.r_[np.zeros(count), np.full(count, -10.0)],
        contacts=contacts,
        impact_friction=True,
    )
    position = np.r_[np.zeros(count), height * np.arange(1, count + 1) / count]
    return scene, ss.State(position, np.zeros(2 * count), "d" * count, dofs=scene.dofs)


def elastic_block(
    contacts: int = 6, elements: tuple[int, int] = (10, 5), modes: int = 20, restitution: float = 0.0
) -> ss.Scene:
    """Return a block of bilinear quadrilaterals on a belt, clamped on top, reduced after Craig and Bampton.

    Plane strain, 40 x 20 x 10 mm, 10 GPa, 2500 kg/m3, pressed 1 um into the belt. The consistent mass couples
    the contacts, which are spread over the lower edge.
    """
    nx, ny = elements
    length, height, thickness, modulus, poisson, density = 0.04, 0.02, 0.01, 10e9, 0.3, 2500.0
    dx, dy = length / nx, height / ny
    factor = modulus / ((1 + poisson) * (1 - 2 * poisson))
    elasticity = factor * np.array(
        [[1 - poisson, poisson, 0], [poisson, 1 - poisson, 0], [0, 0, 0.5 - poisson]]
    )
    stiffness, mass = np.zeros((8, 8)), np.zeros((8, 8))
    point = 1.0 / np.sqrt(3.0)
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for xi, eta in ((sx * point, sy * point) for sx in (-1, 1) for sy in (-1, 1)):
        shape = 0.25 * (1 + signs[:, 0] * xi) * (1 + signs[:, 1] * eta)
        along_x = 0.25 * signs[:, 0] * (1 + signs[:, 1] * eta) * 2 / dx
        along_y = 0.25 * signs[:, 1] * (1 + signs[:, 0] * xi) * 2 / dy
        strain = np.zeros((3, 8))
        strain[0, 0::2], strain[1, 1::2] = along_x, along_y
        strain[2, 0::2], strain[2, 1::2] = along_y, along_x
        volume = 0.25 * dx * dy * thickness
        stiffness += volume * strain.T @ elasticity @ strain
        mass += volume * density * np.kron(np.outer(shape, shape), np.eye(2))
    size = 2 * (nx + 1) * (ny + 1)
    whole_k, whole_m = np.zeros((size, size)), np.zeros((size, size))
    for row in range(ny):
        for column in range(nx):
            first = row * (nx + 1) + column
            nodes = np.array([first, first + 1, first + nx + 2, first + nx + 1])
            dofs = np.column_stack([2 * nodes, 2 * nodes + 1]).ravel()
            whole_k[np.ix_(dofs, dofs)] += stiffness
            whole_m[np.ix_(dofs, dofs)] += mass
    free = 2 * (nx + 1) * ny
    whole_k, whole_m = whole_k[:free, :free], whole_m[:free, :free]
    nodes = np.linspace(0, nx, contacts).round().astype(int)
    kept = np.concatenate([2 * nodes, 2 * nodes + 1])
    inner = np.setdiff1d(np.arange(free), kept)
    static = -np.linalg.solve(whole_k[np.ix_(inner, inner)], whole_k[np.ix_(inner, kept)])
    root = np.linalg.inv(np.linalg.cholesky(whole_m[np.ix_(inner, inner)]))
    _, vectors = np.linalg.eigh(root @ whole_k[np.ix_(inner, inner)] @ root.T)
    transform = np.zeros((free, kept.size + modes))
    transform[kept, : kept.size] = np.eye(kept.size)
    transform[inner, : kept.size] = static
    transform[inner, kept.size :] = root.T @ vectors[:, :modes]
    reduced_k, reduced_m = (transform.T @ matrix @ transform for matrix in (whole_k, whole_m))
    return ss.Scene(
        mass=0.5 * (reduced_m + reduced_m.T),
        stiffness=0.5 * (reduced_k + reduced_k.T),
        damping=ss.Rayleigh(stiffness=1e-7),
        contacts=[
            ss.Contact(
                tangential=i,
                normal=contacts + i,
                friction=0.3,
                slider_speed=1.0,
                gap=-1e-6,
                restitution=restitution,
            )
            for i in range(contacts)
        ],
        impact_friction=True,
    )
