"""A spinning disc between two pads: gyroscopic, circulatory, damped, of as many dofs as wanted."""

import numpy as np
import scipy.sparse

import stickslip as ss

YOUNG, POISSON, DENSITY = 110e9, 0.28, 7200.0
INNER, OUTER, THICKNESS = 0.05, 0.15, 0.012
#: Speed of rotation, 1/s, stiffness of a pad, N/m, and its friction.
SPEED, PAD, FRICTION = 60.0, 4e7, 0.5


def disc_matrices(radial, around, layers, speed=SPEED, friction=FRICTION):
    """Return M (n,), K, G and H of a disc of bricks held inside, n = 3 radial around layers.

    Displacements are those of the points of space through which the material runs (Euler): its velocity is
    ``x' + speed dx/dtheta``. With ``D = integral of density N' dN/dtheta``, skew round a whole turn, that
    gives ``G = 2 speed D`` and takes ``speed^2 integral of density dN/dtheta' dN/dtheta`` off the stiffness.
    Masses are lumped by row sums. A pad on either side, at the nodes of the outer half of an eighth of a
    turn, is a spring across; its friction, `friction` times its force along the rotation, makes H.
    """
    radii = np.linspace(INNER, OUTER, radial + 1)
    angles = 2.0 * np.pi * np.arange(around) / around
    heights = np.linspace(0.0, THICKNESS, layers)
    r, theta, z = np.meshgrid(radii, angles, heights, indexing="ij")
    points = np.stack([r * np.cos(theta), r * np.sin(theta), z], axis=-1).reshape(-1, 3)
    number = np.arange(points.shape[0]).reshape(r.shape)
    steps = np.array([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    cells = np.stack(
        [
            number[a : radial + a][:, (np.arange(around) + b) % around][:, :, c : layers - 1 + c]
            for a, b, c in steps
        ],
        axis=-1,
    ).reshape(-1, 8)
    corners = 2.0 * steps - 1.0
    lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    shear = YOUNG / (2.0 * (1.0 + POISSON))
    law = np.diag([2.0 * shear] * 3 + [shear] * 3)
    law[:3, :3] += lame
    count = cells.shape[0]
    stiffness, spun = np.zeros((count, 24, 24)), np.zeros((count, 8, 8))
    drift, mass = np.zeros((count, 8, 8)), np.zeros((count, 8))
    for place in corners / np.sqrt(3.0):
        factors = 1.0 + corners * place
        shape = factors.prod(axis=1) / 8.0
        slopes = np.stack(
            [corners[:, k] * factors[:, (k + 1) % 3] * factors[:, (k + 2) % 3] / 8.0 for k in range(3)]
        )
        jacobian = slopes @ points[cells]
        volume = np.linalg.det(jacobian)
        gradient = np.linalg.solve(jacobian, np.broadcast_to(slopes, (count, 3, 8)))
        strain = np.zeros((count, 6, 24))
        for axis in range(3):
            strain[:, axis, axis::3] = gradient[:, axis]
        for row, (i, j) in enumerate(((0, 1), (1, 2), (2, 0)), start=3):
            strain[:, row, i::3], strain[:, row, j::3] = gradient[:, j], gradient[:, i]
        stiffness += volume[:, None, None] * (strain.transpose(0, 2, 1) @ law @ strain)
        here = np.einsum("a,cax->cx", shape, points[cells])
        turned = here[:, :1] * gradient[:, 1] - here[:, 1:2] * gradient[:, 0]
        weight = DENSITY * volume[:, None, None]
        drift += weight * shape[None, :, None] * turned[:, None, :]
        spun += weight * turned[:, :, None] * turned[:, None, :]
        mass += weight[:, 0] * shape
    size = 3 * points.shape[0]
    dofs = (3 * cells[:, :, None] + np.arange(3)).reshape(count, 24)

    def assembled(parts, places):
        rows = np.repeat(places, places.shape[1], axis=1).ravel()
        columns = np.tile(places, (1, places.shape[1])).ravel()
        return scipy.sparse.coo_array((parts.ravel(), (rows, columns)), shape=(size, size)).tocsr()

    def per_direction(parts):
        return sum(assembled(parts, 3 * cells + axis) for axis in range(3))

    k = assembled(stiffness, dofs) - speed**2 * per_direction(spun)
    g = 2.0 * speed * per_direction(drift)
    m = np.repeat(np.bincount(cells.ravel(), mass.ravel(), points.shape[0]), 3)
    pad = np.flatnonzero(
        ((z == 0.0) | (z == THICKNESS)).ravel() & (r.ravel() > 0.5 * (INNER + OUTER)) & (theta.ravel() < 0.8)
    )
    along = (
        np.stack([-points[pad, 1], points[pad, 0]], axis=1)
        / np.hypot(points[pad, 0], points[pad, 1])[:, None]
    )
    spring = PAD / pad.size
    side = np.where(points[pad, 2] > 0.0, 1.0, -1.0)
    k = k + scipy.sparse.coo_array((np.full(pad.size, spring), (3 * pad + 2, 3 * pad + 2)), shape=k.shape)
    # The pad presses with spring times x . side, and drags along the rotation with friction times that.
    entries = friction * spring * side[:, None] * along
    rows, columns = (3 * pad[:, None] + np.arange(2)).ravel(), np.repeat(3 * pad + 2, 2)
    h = -scipy.sparse.coo_array((entries.ravel(), (rows, columns)), shape=k.shape)
    kept = np.flatnonzero(np.repeat(r.ravel() > INNER, 3))
    k, g, h = (scipy.sparse.csr_array(matrix)[kept][:, kept] for matrix in (k, g, h))
    return m[kept], 0.5 * (k + k.T), 0.5 * (g - g.T), h


def spinning_disc(radial=5, around=84, layers=4, *, damping=2e-9, **options):
    """Return the scene of the disc, without contacts."""
    mass, stiffness, gyroscopic, circulatory = disc_matrices(radial, around, layers, **options)
    return ss.Scene(
        mass,
        stiffness,
        damping=ss.Rayleigh(stiffness=damping),
        gyroscopic=gyroscopic,
        circulatory=circulatory,
    )
