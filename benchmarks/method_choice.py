"""`method="auto"` beside the two methods it chooses from, over the size of a chain.

Three motions of the chains of `chains.py`, each followed for short and for long, since how often a
combination comes back is what the choice depends on:

* *cycles*: every contact sticks and slips; with many contacts no combination returns.
* *one contact*: friction at the first contact only; a few combinations, again and again.
* *quiet*: steady sliding, disturbed by less than it takes for an event; one phase.

And elastic blocks on a belt, of `quad_block.py` in `tests/support`: *coupled masses*, a mesh with consistent
mass of 110 and 420 dofs and two contacts, and *eleven contacts*, a reduced model of 62 dofs where every
tenth event meets a new combination.

The work of `auto` is to stay within 1.5 of the better method.
"""

from __future__ import annotations

import math
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Literal

import numpy as np
from chains import on_cycles, scene_of, settled

import stickslip as ss
from report import Report, arguments

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
from quad_block import quad_block, reduced_block

SIZES = (10, 20, 50, 100, 200)
Method = Literal["modal", "taylor", "auto"]
METHODS: tuple[Method, ...] = ("modal", "taylor", "auto")
#: Events of the motions that have some, and s of the quiet one.
EVENTS = (20, 200, 2000)
QUIET = (0.01, 0.1, 1.0)
#: Repetitions, of which the quickest counts, while they take less than this in sum, s.
REPEATS, PATIENCE = 3, 2.0
#: s; a method that needs more is not waited for.
LIMIT = 5.0


def one_contact(count: int) -> tuple[ss.Scene, ss.State]:
    """Return a chain in which friction acts on the first contact only."""
    scene = scene_of(count).replace(friction=[1.5] + [0.5] * (count - 1))
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-2})


def quiet(count: int) -> tuple[ss.Scene, ss.State]:
    """Return a chain that slides, stable and barely disturbed."""
    scene = scene_of(count).replace(friction=0.5)
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-6})


def blocks(quick: bool) -> list[tuple[int, str, ss.Scene, ss.State, float, int | None]]:
    """Return dofs, name, scene, start, duration and most events of the elastic blocks."""

    def kicked(scene: ss.Scene) -> ss.State:
        return ss.steady_sliding(scene).perturbed(velocity={scene.dofs[0]: 0.5})

    meshes = [(10, 5)] if quick else [(10, 5), (20, 10)]
    scenes = [("coupled masses", quad_block(*mesh, mesh[0], lumped=False), 1e-3, None) for mesh in meshes]
    scenes.append(("eleven contacts", reduced_block(20, 10, 2, 40), 1e-2, 2000))
    return [(len(scene.dofs), name, scene, kicked(scene), *limits) for name, scene, *limits in scenes]


def seconds(scene: ss.Scene, start: ss.State, method: Method, duration: float, events: int | None) -> float:
    """Return the processor time of a run whose scene knows no combination; infinite if it fails."""
    least, total = math.inf, 0.0
    for _ in range(REPEATS):
        fresh = scene.replace()
        # Threads of numpy that wait after the set-up are not the run's.
        begin = time.thread_time()
        try:
            run = ss.simulate(fresh, duration, start, method=method, max_events=events, time_limit=LIMIT)
        except ss.StickslipError:
            return math.inf
        took = time.thread_time() - begin
        if run.stop_reason == "time_limit":
            return math.inf
        least, total = min(least, took), total + took
        if total > PATIENCE:
            break
    return least


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller chains")
    options = parser.parse_args()
    report = Report("method-choice")
    cycle = settled()
    rows, ratios, of_motion = [], [], defaultdict[str, list[tuple[int, float, float]]](list)
    cases: list[tuple[int, str, ss.Scene, ss.State, float, int | None]] = []
    for count in SIZES[:3] if options.quick else SIZES:
        cycles = scene_of(count), on_cycles(cycle, count)
        cases += [(count, "cycles", *cycles, 1e3, most) for most in EVENTS]
        cases += [(count, "one contact", *one_contact(count), 1e3, most) for most in EVENTS]
        cases += [(count, "quiet", *quiet(count), length, None) for length in QUIET]
    for count, name, scene, start, duration, most in [*cases, *blocks(options.quick)]:
        took = [seconds(scene, start, method, duration, most) for method in METHODS]
        ratios.append(took[2] / min(took[:2]))
        of_motion[name].append((count, max(took[:2]) / took[2], ratios[-1]))
        print(count, name, most or duration, *took, f"{ratios[-1]:.2f}", file=sys.stderr)
    for name, found in of_motion.items():
        sizes, gains, losses = zip(*found, strict=True)
        numbers = [len(found), f"{min(sizes)} to {max(sizes)}", f"{np.median(gains):.3g}"]
        rows.append(
            [name, *(str(number) for number in numbers), *(f"{f(losses):.2f}" for f in (np.median, max))]
        )
    headings = (
        "motion",
        "runs",
        "subsystems or dofs",
        "worse / auto, median",
        "auto / better, median",
        "largest",
    )
    report.table(headings, rows)
    report.text(
        f"auto over the better of the two: largest {np.max(ratios):.2f}, median {np.median(ratios):.2f};",
        f"at most 1.5 in {np.mean(np.array(ratios) <= 1.5):.0%}.",
        f"A method that fails or takes over {LIMIT:g} s is the worse one.",
    )
    report.finish(options.into, "stickslip", "numpy")


if __name__ == "__main__":
    main()
