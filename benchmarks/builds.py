"""Two builds of the package side by side: the same work in turns, each turn in a process of its own.

``python benchmarks/builds.py OLD NEW`` with two checkouts, each with its compiled core in place. The work is
the standard run, a sweep of 1000 points, a million verdicts, ten thousand limit cycles, and a chain of a
thousand subsystems. Of every build the least processor time on one thread counts.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from report import Report, machine

#: How often each piece of work is repeated within one process.
REPEATS = {"standard run": 40, "sweep of 1000 points": 5, "10^5 verdicts of stability": 5}
#: Work that takes seconds: a hundredth of it with --quick.
VERDICTS, CYCLES, MOTION = 1_000_000, 10_000, 0.05


def work(name: str, part: float) -> Callable[[], object]:
    """Return the work of a name, prepared; of the large pieces only `part`."""
    import stickslip as ss

    model = ss.models.two_subsystems
    if name == "standard run":
        scene = model()
        start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
        return lambda: ss.simulate(scene, 0.6, start)
    if name == "sweep of 1000 points":
        return lambda: ss.sweep(model, {"friction": np.linspace(0.0, 3.0, 1000)})
    if name == "10^5 verdicts of stability":
        return lambda: ss.stability(model, {"friction": np.linspace(0.0, 3.0, 100_000)})
    if name.endswith("subsystems"):
        from chains import LARGE, on_cycles, scene_of, settled

        scene, start = scene_of(LARGE), on_cycles(settled(), LARGE)
        return lambda: ss.simulate(scene, part * MOTION, start)
    from uncertain_model import parameters

    if name == "10^6 verdicts of a study":
        outputs, samples, further = ["growth_rate", "frequency", "unstable_modes"], VERDICTS, {}
    else:
        outputs, samples = ["attractor", "amplitude", "period"], CYCLES
        further = {"duration": 0.6}
    study = ss.Study(model, parameters(), outputs=outputs, samples=round(part * samples), seed=1, **further)
    return lambda: study.run(threads=1, progress=False)


WORK = (
    *REPEATS,
    "10^6 verdicts of a study",
    "10^4 limit cycles",
    "50 ms of a chain of 1000 subsystems",
)


def timed(name: str, part: float) -> None:
    """Print the least processor time of one process, s."""
    job = work(name, part)
    least = float("inf")
    for _ in range(REPEATS.get(name, 1)):
        begin = time.process_time()
        job()
        least = min(least, time.process_time() - begin)
    print(least)


def turn(checkout: Path, name: str, part: float) -> float:
    """Return what one process of a build took, s."""
    environment = os.environ | {"PYTHONPATH": str(checkout / "python"), "RAYON_NUM_THREADS": "1"}
    command = [sys.executable, __file__, "--only", name, "--part", repr(part)]
    answer = subprocess.run(command, check=True, env=environment, capture_output=True, text=True)
    return float(answer.stdout.split()[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "checkouts", nargs="*", type=Path, metavar="CHECKOUT", help="the old one, the new one"
    )
    parser.add_argument("--turns", type=int, default=3, help="processes per build")
    parser.add_argument("--part", type=float, default=1.0, help="part of the large pieces of work")
    parser.add_argument("--only", default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.only is not None:
        timed(options.only, options.part)
        return
    old, new = (path.resolve() for path in options.checkouts)
    rows = []
    for name in WORK:
        times: dict[Path, list[float]] = {old: [], new: []}
        for _ in range(options.turns):
            for checkout, found in times.items():
                found.append(turn(checkout, name, options.part))
        before, after = (min(found) for found in times.values())
        spread = max(max(found) / min(found) for found in times.values()) - 1.0
        rows.append([name, f"{before:.4g}", f"{after:.4g}", f"{after / before:.2f}", f"{spread:.0%}"])
        print(*rows[-1], file=sys.stderr)
    report = Report("builds")
    report.table(("work", "old, s", "new, s", "new / old", "spread of a build"), rows)
    report.text(f"{machine()}; large pieces of work: {options.part:g} of them.")


if __name__ == "__main__":
    main()
