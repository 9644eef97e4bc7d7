"""Limit cycles of reduced models beside those of the full ones: period, and time that contacts are detached.

A block of lumped mass on a belt, six of its lower nodes in contact: a wave of separation runs over its face.
The full model has its mass at the contacts too, and impacts there lose energy, or the mass of the contacts is
with their neighbours and nothing impacts. A reduced model comes near the full one with the same boundary.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
from block_cycles import lumped_block, pulse, reduced_block
from report import Report, arguments

#: Columns and rows of the mesh; one in how many lower nodes is in contact.
MESHES = {"420": (20, 10, 4), "1640": (40, 20, 8)}
MODES = (40, 160)
#: Boundaries of the full model and of the reduced one.
BOUNDARIES = ("lumped", "massless")


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--sizes", nargs="+", default=["420"], choices=MESHES)
    chosen = parser.parse_args()
    rows = []
    for size in chosen.sizes:
        for boundary in BOUNDARIES:
            scene = lumped_block(*MESHES[size], boundary)
            # No modes: the full model, first.
            for modes in (0, *MODES):
                begin = time.process_time()
                reduced = reduced_block(scene, boundary, modes or MODES[0])
                if not modes:
                    # The full model takes its start from a reduced one, no time.
                    begin = time.process_time()
                period, share, run = pulse(scene, reduced, full=not modes)
                if not modes:
                    exact = period
                off = f"{100.0 * abs(period / exact - 1.0):.2f}" if modes else ""
                cells = [
                    size,
                    boundary,
                    str(modes or "full"),
                    f"{1e6 * period:.3f}",
                    off,
                    f"{100.0 * share:.1f}",
                ]
                rows.append([*cells, f"{run.balance().impact:.2g}", f"{time.process_time() - begin:.1f}"])
                print(*rows[-1], file=sys.stderr)
    report = Report("reduced-cycles")
    headings = ["dofs", "boundary", "modes", "period, us", "difference, %", "detached, %"]
    headings += ["lost in impacts, J", "CPU, s"]
    report.table(headings, rows)
    report.finish(chosen.into, "stickslip", "scipy")


if __name__ == "__main__":
    main()
