"""Reduced models: the methods beside each other over coordinates and contacts, on short and on long runs.

The scenes are models of an elastic block on a belt (`quad_block.py` in `tests/support`) of 50 to 300
coordinates with 4 to 40 contacts: masses lumped at the contacts, and modes of the block held there, which
K couples with the contacts and C = beta K damps. *Dense rows* are the better of modes and of series of
the same scene with two modes tied by a spring too weak to be seen, and a load that is switched after the
run: series then multiply with dense matrices. ``python benchmarks/dense_scenes.py OLD`` with a checkout that
has its compiled core in place measures the best method of that build instead, in turns.

A second table has models by modes of the block without its contacts, each of which moves all of them: both
matrices are dense in contact coordinates, and series go in the modes with held contacts.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from method_choice import METHODS, seconds

import stickslip as ss
from report import Report, arguments

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
from quad_block import free_block, reduced_block

#: (coordinates, contacts)
SIZES = tuple((n, c) for n in (50, 100, 200, 300) for c in (4, 10, 20, 40) if 2 * c < n)
#: Elements along the belt, and between two contacts.
MESHES = {4: (39, 13), 10: (36, 4), 20: (38, 2), 40: (39, 1)}
EVENTS = (200, 2000)
#: Elements of blocks by free modes, elements between two contacts, and modes.
FREE = ((12, 6, 4, 60), (12, 6, 4, 100), (12, 6, 2, 100), (20, 10, 3, 200))


def block_of(coordinates: int, contacts: int) -> ss.Scene:
    """Return a reduced block."""
    columns, every = MESHES[contacts]
    return reduced_block(columns, 8, every, coordinates - 2 * contacts)


def scene_of(coordinates: int, contacts: int) -> tuple[ss.Scene, ss.State]:
    """Return a reduced block and its steady sliding, disturbed."""
    scene = block_of(coordinates, contacts)
    return scene, ss.steady_sliding(scene).perturbed(velocity={scene.dofs[0]: 0.5})


def in_dense_rows(scene: ss.Scene) -> ss.Scene:
    """Return the scene with two modes tied by 1e-12 N/m, and a load of 1e-12 N after 1e6 s."""
    stiffness = np.array(scene.stiffness)
    stiffness[-2, -1] = stiffness[-1, -2] = 1e-12
    return scene.replace(stiffness=stiffness, loads=[ss.Switched({scene.dofs[-1]: 1e-12}, [1e6], [0.0, 1.0])])


def free_scene_of(columns: int, rows: int, every: int, modes: int) -> tuple[ss.Scene, ss.State]:
    """Return a block by free modes and its steady sliding, the first contact disturbed."""
    scene = free_block(columns, rows, every, modes)
    directions = np.array([row for one in scene.contacts for row in (one.tangential, one.normal)])
    velocity = np.linalg.lstsq(directions, 0.5 * np.eye(len(directions))[0], rcond=None)[0]
    disturbed = dict(zip(scene.dofs, velocity, strict=True))
    return scene, ss.steady_sliding(scene).perturbed(velocity=disturbed)


def best_of(checkout: Path, start: ss.State, table: str, *size: int) -> float:
    """Return the least time of the methods of another build from the same start, in a new process, s."""
    environment = os.environ | {"PYTHONPATH": str(checkout / "python")}
    command = [sys.executable, __file__, "--only", table, *(str(number) for number in size)]
    state = json.dumps([start.position.tolist(), start.velocity.tolist(), str(start.combination)])
    answer = subprocess.run(command, check=True, env=environment, input=state, capture_output=True, text=True)
    return float(answer.stdout.split()[-1])


def best(table: str, most: int, *size: int) -> float:
    """Return the least time of the methods that choose nothing, from the start on the standard input, s."""
    scene = (block_of if table == "reduced" else free_block)(*size)
    start = ss.State(*json.load(sys.stdin))
    return min(seconds(scene, start, method, 1.0, most) for method in METHODS[:2])


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("old", nargs="?", type=Path, metavar="OLD", help="a checkout to compare with")
    parser.add_argument("--quick", action="store_true", help="small scenes")
    parser.add_argument("--only", nargs="+", default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.only is not None:
        print(best(options.only[0], *(int(number) for number in options.only[1:])))
        return

    def before(table: str, scene: ss.Scene, start: ss.State, most: int, *size: int) -> float:
        if options.old is not None:
            return best_of(options.old.resolve(), start, table, most, *size)
        dense = seconds(in_dense_rows(scene), start, "taylor", 1.0, most)
        return min(dense, seconds(scene, start, "modal", 1.0, most))

    report = Report("dense-scenes")
    times = ["best of the old build, ms" if options.old else "dense rows, ms", *(f"{m}, ms" for m in METHODS)]

    def cells(earlier: float, took: list[float]) -> list[str]:
        """Return times in ms, the gain of auto, and its time over that of the better method."""
        shown = [f"{1e3 * t:.0f}" if math.isfinite(t) else "-" for t in (earlier, *took)]
        return [*shown, f"{earlier / took[2]:.1f}", f"{took[2] / min(took[:2]):.2f}"]

    rows, gains, choices = [], [], []
    for coordinates, contacts in SIZES[:4] if options.quick else SIZES:
        scene, start = scene_of(coordinates, contacts)
        for most in EVENTS:
            earlier = before("reduced", scene, start, most, coordinates, contacts)
            took = [seconds(scene, start, method, 1.0, most) for method in METHODS]
            gains.append((coordinates / contacts, earlier / took[2]))
            choices.append(took[2] / min(took[:2]))
            rows.append([*(str(number) for number in (coordinates, contacts, most)), *cells(earlier, took)])
            print(*rows[-1], file=sys.stderr, flush=True)
    report.table(("coordinates", "contacts", "events", *times, "gain", "auto / better"), rows)
    wide = [gain for ratio, gain in gains if ratio >= 12.0]
    narrow = [gain for ratio, gain in gains if ratio < 12.0]
    report.text(
        f"Gain of auto with 12 coordinates a contact or more: {min(wide):.1f} to {max(wide):.1f}, median",
        f"{np.median(wide):.1f}, at least 5 in {sum(gain >= 5.0 for gain in wide)} of {len(wide)} rows;",
        f"elsewhere {min(narrow):.1f} to {max(narrow):.1f}.",
        f"auto over the better of modal and taylor: largest {max(choices):.2f}.",
    )
    rows = []
    for size in FREE[:2] if options.quick else FREE:
        scene, start = free_scene_of(*size)
        earlier = before("free", scene, start, EVENTS[0], *size)
        took = [seconds(scene, start, method, 1.0, EVENTS[0]) for method in METHODS]
        named = (size[-1], len(scene.contacts), EVENTS[0])
        rows.append([*(str(number) for number in named), *cells(earlier, took)])
        print(*rows[-1], file=sys.stderr, flush=True)
    report.table(("free modes", "contacts", "events", *times, "gain", "auto / better"), rows)
    report.text("A dash: a combination without sound modes.")
    report.finish(options.into, "stickslip", "numpy")


if __name__ == "__main__":
    main()
