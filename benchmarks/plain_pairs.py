"""Two milliseconds of a pad on an elastic disc, from two meshes and their facing nodes: 2140 dofs, 28 pairs.

A disc of cast iron, held at its hub, and a lining whose back is guided, with the nodes of one mesh opposite
to those of the other. Every node of both bodies begins with a velocity across the disc, so that contacts
open and close. With lumped masses (`Body.lumped`) an impact stays with its pair; with consistent ones it
moves other pairs, which strike in turn.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
import stickslip as ss
from meshed import elastic
from report import Report, arguments

THICKNESS, HALF_ANGLE = 0.019, np.radians(30.0)
DAMPING = ss.Rayleigh(stiffness=1e-7)
#: Largest velocity of the start, m/s, and its waves round the disc.
KICK, WAVES = 0.1, 7


def pad_on_disc(lumped: bool) -> ss.Scene:
    """Return the scene from plain pairs."""
    top, sector = THICKNESS, (-HALF_ANGLE, HALF_ANGLE)
    disc_mesh = ss.fe.ring((6, 36, 2), (0.06, 0.18), (0.0, 2.0 * np.pi), (0.0, top))
    pad_mesh = ss.fe.ring((3, 6, 2), (0.10, 0.16), sector, (top, 2.0 * top))
    disc = elastic(disc_mesh, 120e9, 0.25, 7200.0, damping=DAMPING, name="disc")
    pad = elastic(pad_mesh, 0.9e9, 0.3, 2500.0, damping=DAMPING, name="pad")
    if lumped:
        disc, pad = disc.lumped(), pad.lumped()
    disc = disc.held(disc.surface("inner"))
    pad = pad.held(pad.surface("top"), directions=(1, 2))
    turning = ss.fe.Rotation(5.0)
    pairs = ss.fe.contact_pairs(
        pad.surface("bottom"), disc.surface("top"), velocity=turning, friction=0.3, plane=False
    )
    pressure = pad.surface("top").pressure(1e5)
    return ss.fe.assemble([pad, disc], pairs, force=pressure, impact_friction=not lumped)


def kicked(scene: ss.Scene) -> ss.State:
    """Return steady sliding with waves of velocity across the disc."""
    assert scene.mesh is not None
    x, y, _ = scene.mesh.points.T
    waves = KICK * np.cos(WAVES * np.arctan2(y, x)) * (x**2 + y**2) / 0.18**2
    velocity, across = np.zeros(scene.size), scene.mesh.dofs[:, 2]
    velocity[across[across >= 0]] = waves[across >= 0]
    return ss.steady_sliding(scene).perturbed(velocity=velocity)


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--duration", type=float, default=2e-3, help="s (default: %(default)s)")
    parser.add_argument("--masses", nargs="+", default=["lumped"], choices=["lumped", "consistent"])
    chosen = parser.parse_args()
    rows = []
    for mass in chosen.masses:
        begin = time.process_time()
        scene = pad_on_disc(mass == "lumped")
        start = kicked(scene)
        ready = time.process_time()
        run = ss.simulate(scene, chosen.duration, start)
        done = time.process_time()
        combinations = len(set(run.events.combination))
        cells = [scene.size, len(scene.contacts), mass, f"{1e3 * chosen.duration:g}", len(run.events)]
        cells += [combinations, f"{ready - begin:.1f}", f"{done - ready:.1f}"]
        cells.append(f"{abs(run.balance().residual):.0e}")
        rows.append([str(cell) for cell in cells])
        print(*rows[-1], file=sys.stderr)
    report = Report("plain-pairs")
    headings = ["dofs", "pairs", "mass", "motion, ms", "events", "combinations"]
    headings += ["set-up, CPU s", "motion, CPU s", "balance, J"]
    report.table(headings, rows)
    report.finish(chosen.into, "stickslip", "scipy")


if __name__ == "__main__":
    main()
