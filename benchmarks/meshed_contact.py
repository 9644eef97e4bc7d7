"""Steps of a meshed model beside scipy: a pad on a rotating disc, meshes that do not match.

A ring of hexahedra, held at its inner rim, and a pad of tetrahedra pressed on it by 1 MPa; every node of the
pad's face is paired with a point of the disc's. Processor seconds.

scipy's steady sliding: the same dofs, normal forces as Lagrange multipliers, friction proportional to them,
and `splu`; contacts that would pull are opened and those that would penetrate closed, until none does.
scipy's modes: `eigs` round the middle of the band with the same constraints, without vectors and count.
"""

from __future__ import annotations

import resource
import sys

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from clock import clocked

import stickslip as ss
from report import Report, arguments

#: Cells of the disc along radius, angle and height, and of the pad.
SIZES = {
    "2300": ((4, 50, 2), (5, 12, 2)),
    "10900": ((6, 99, 4), (8, 16, 4)),
    "28000": ((8, 140, 7), (5, 7, 4)),
    "50000": ((10, 180, 8), (6, 12, 4)),
    "100000": ((14, 238, 9), (6, 12, 4)),
    "200000": ((18, 310, 11), (6, 12, 4)),
}
FRICTION, PRESSURE, SPEED = 0.4, 1e6, 5.0
#: Hz
BAND = (500.0, 8000.0)


def bodies(disc_cells, pad_cells, *, lumped: bool) -> tuple[ss.fe.Body, ss.fe.Body]:
    """Return disc and pad."""
    full, quarter = (0.0, 2.0 * np.pi), np.deg2rad((0.7, 50.7))
    disc = ss.fe.Body.elastic(
        ss.fe.ring(disc_cells, (0.03, 0.075), full, (0.0, 0.01)),
        young=120e9, poisson=0.25, density=7200.0, damping=ss.Rayleigh(stiffness=1e-8), name="disc",
    )  # fmt: skip
    pad = ss.fe.ring(pad_cells, (0.042, 0.071), quarter, (0.01, 0.022)).to_meshtet()
    pad = pad.with_boundaries({"face": lambda x: x[2] < 0.01 + 1e-9, "back": lambda x: x[2] > 0.022 - 1e-9})
    pad = ss.fe.Body.elastic(
        pad, young=10e9, poisson=0.3, density=2500.0, damping=ss.Rayleigh(stiffness=1e-7), name="pad"
    )
    disc, pad = (body.lumped() if lumped else body for body in (disc, pad))
    return disc.held(disc.surface("inner")), pad.held(pad.surface("back"), (1, 2))


def model(name: str, *, lumped: bool = False) -> tuple[dict[str, float], ss.Scene, ss.fe.Pairs]:
    """Return processor times of the steps, the scene and its pairs."""
    times = {}
    times["bodies"], (disc, pad) = clocked(lambda: bodies(*SIZES[name], lumped=lumped))
    turning = ss.fe.Rotation(SPEED)
    times["pairs"], pairs = clocked(
        lambda: ss.fe.contact_pairs(
            pad.surface("face"), disc.surface("top"), velocity=turning, friction=FRICTION, plane=False
        )
    )
    force = pad.surface("back").pressure(PRESSURE)
    times["scene"], scene = clocked(lambda: ss.fe.assemble([disc, pad], pairs, force=force))
    return times, scene, pairs


def scipy_steady(scene: ss.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and normal forces of steady sliding, by a saddle-point matrix and splu."""
    directions = [
        scipy.sparse.csc_array(np.stack([direction(k) for k in range(len(scene.contacts))], axis=1))
        for direction in (scene.normal_direction, scene.tangential_direction)
    ]
    normal, tangential = directions
    friction = np.array([contact.friction for contact in scene.contacts])
    gaps = np.array([contact.gap for contact in scene.contacts])
    closed = np.ones(friction.size, dtype=bool)
    for _ in range(20):
        count = np.count_nonzero(closed)
        # A slider that moves along +t pulls the body along with it.
        forces = normal + tangential * friction
        matrix = scipy.sparse.block_array(
            [
                [scene.stiffness, -forces[:, closed]],
                [normal[:, closed].T, scipy.sparse.csc_array((count, count))],
            ]
        )
        found = scipy.sparse.linalg.splu(scipy.sparse.csc_array(matrix)).solve(
            np.concatenate([scene.force, -gaps[closed]])
        )
        x, pressed = found[: scene.size], np.zeros(closed.size)
        pressed[closed] = found[scene.size :]
        wrong = np.where(closed, pressed < 0.0, normal.T @ x + gaps < 0.0)
        if not wrong.any():
            break
        closed ^= wrong
    return x, pressed


def scipy_modes(scene: ss.Scene, combination: str, count: int) -> np.ndarray:
    """Return eigenvalues round the middle of the band, contacts held closed by Lagrange multipliers."""
    closed = [k for k, status in enumerate(combination) if status != "d"]
    normal, tangential = (
        scipy.sparse.csc_array(np.stack([direction(k) for k in closed], axis=1))
        for direction in (scene.normal_direction, scene.tangential_direction)
    )
    friction = np.array([scene.contacts[k].friction for k in closed])
    mass, damping, stiffness = (
        scipy.sparse.csc_array(parts, shape=(scene.size, scene.size)) for parts in scene.core.matrices()[:3]
    )
    one, none = scipy.sparse.eye_array(scene.size), scipy.sparse.csc_array((len(closed), len(closed)))
    left = scipy.sparse.block_array(
        [
            [None, one, None],
            [-stiffness, -damping, normal + tangential * friction],
            [normal.T, None, none],
        ],
        format="csc",
    )
    right = scipy.sparse.block_diag([one, mass, none], format="csc")
    shift = 1j * np.pi * (BAND[0] + BAND[1])
    solved = scipy.sparse.linalg.splu(scipy.sparse.csc_array(left - shift * right))
    inverse = scipy.sparse.linalg.LinearOperator(
        left.shape, lambda x: solved.solve(right @ x.astype(complex)), dtype=complex
    )
    found = scipy.sparse.linalg.eigs(inverse, count, which="LM", return_eigenvectors=False)
    return shift + 1.0 / found


def memory() -> float:
    """Return the most memory that this process has taken, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    """Print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--size", default="10900", choices=SIZES)
    parser.add_argument("--lumped", action="store_true")
    parser.add_argument("--steps", nargs="+", default=["steady", "modes", "reduction"])
    chosen = parser.parse_args()
    report = Report("meshed-contact")
    times, scene, pairs = model(chosen.size, lumped=chosen.lumped)
    print(scene.size, len(pairs), times, f"{memory():.0f} MB", file=sys.stderr)
    rows = [[step, f"{time:.2f}", "", ""] for step, time in times.items()]
    if "steady" in chosen.steps:
        own, equilibrium = clocked(lambda: ss.steady_sliding(scene))
        print("steady", own, f"{memory():.0f} MB", file=sys.stderr)
        peer, (x, pressed) = clocked(lambda: scipy_steady(scene))
        distance = np.abs(equilibrium.position - x).max() / np.abs(x).max()
        print("peer", peer, distance, np.count_nonzero(pressed), pressed.sum(), file=sys.stderr)
        rows.append(["steady sliding", f"{own:.2f}", f"{peer:.2f}", f"{distance:.1e}"])
    if "modes" in chosen.steps:
        combination = equilibrium.combination if "steady" in chosen.steps else None
        own, modes = clocked(lambda: ss.complex_modes(scene, combination, band=BAND))
        peer, values = clocked(lambda: scipy_modes(scene, modes.combination, len(modes) + 5))
        off = [np.abs(values - one).min() / abs(one) for one in modes.eigenvalues]
        rows.append([f"{len(modes)} modes of a band", f"{own:.2f}", f"{peer:.2f}", f"{max(off):.1e}"])
        print("modes", own, peer, modes.missing, max(off), f"{memory():.0f} MB", file=sys.stderr)
    if "reduction" in chosen.steps:
        combination = ss.steady_sliding(scene).combination
        modes = ss.complex_modes(scene, combination, band=BAND, certify=False)
        own, small = clocked(lambda: ss.fe.reduce(scene, BAND, combination=combination))
        rows.append([f"reduction to {small.scene.size} dofs", f"{own:.2f}", "", ""])
        own, small = clocked(lambda: ss.fe.reduce(scene, BAND, full_modes=modes))
        rows.append(["the same, modes of the band given", f"{own:.2f}", "", ""])
        print("reduction", rows[-2:], f"{memory():.0f} MB", file=sys.stderr)
    report.table(["step", "stickslip, CPU s", "scipy, CPU s", "difference"], rows)
    report.finish(chosen.into, "stickslip", "scipy")


if __name__ == "__main__":
    main()
