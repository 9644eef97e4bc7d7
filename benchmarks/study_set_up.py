"""What a run of a Monte Carlo study takes: how much of it is set-up.

The study draws friction and nine stiffnesses of the reference model, as `studies.py` does, and follows each
sample over 0.6 s from disturbed sliding. *Scene and start* is the same study over a motion in which nothing
happens: it draws, makes the scene, finds its equilibrium and begins. The rest is divided as runs of some of
the scenes are: *motion* is what a second run takes, which knows the modes of its combinations, and
*combinations* what a first run takes beyond it. Times are processor times of one thread.
"""

from __future__ import annotations

import numpy as np
from clock import clocked
from uncertain_model import parameters

import stickslip as ss
from report import Report, arguments

SAMPLES = 100_000
#: Samples whose scenes are run twice.
TWICE = 2000
#: s; within the shorter one nothing happens.
DURATION, INSTANT = 0.6, 1e-9
KICK = {"x1": 1e-3}


def study(samples: int, duration: float) -> ss.Study:
    """Return the study of numbers of events."""
    return ss.Study(
        ss.models.two_subsystems,
        parameters(),
        outputs=["events"],
        samples=samples,
        seed=1,
        duration=duration,
        velocity=KICK,
    )


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="a hundredth of the samples")
    options = parser.parse_args()
    samples = SAMPLES // 100 if options.quick else SAMPLES
    twice = min(samples, TWICE)
    study(100, DURATION).run(threads=1, progress=False)  # loads what is loaded once
    begun, _ = clocked(lambda: study(samples, INSTANT).run(threads=1, progress=False))
    asked = study(samples, DURATION)
    whole, answers = clocked(lambda: asked.run(threads=1, progress=False))
    first = later = 0.0
    for row in asked.design[:twice]:
        scene = asked.scene_of(row)
        try:
            start = ss.steady_sliding(scene).perturbed(velocity=KICK)
        except ss.StickslipError:
            continue
        # The first combination belongs to the start.
        ss.simulate(scene, INSTANT, start)
        first += clocked(lambda: ss.simulate(scene, DURATION, start))[0]  # noqa: B023
        later += clocked(lambda: ss.simulate(scene, DURATION, start))[0]  # noqa: B023
    followed = whole - begun
    parts = {
        "scene and start": begun,
        "combinations": followed * (first - later) / first,
        "motion": followed * later / first,
        "in all": whole,
    }
    report = Report("study-set-up")
    rows = [
        [name, f"{1e6 * seconds / samples:.1f}", f"{seconds / whole:.0%}"] for name, seconds in parts.items()
    ]
    report.table(("part of a run", "us", "share"), rows)
    events = int(np.maximum(answers["events"].values, 0).sum())
    report.text(f"{samples} samples, {events} events, {whole:.1f} s of processor time.")
    report.finish(options.into, "stickslip", "numpy")


if __name__ == "__main__":
    main()
