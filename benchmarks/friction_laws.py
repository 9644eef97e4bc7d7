"""The reference model under Stribeck friction: beside heyoka, and beside constant friction.

The programs follow the same scene from the same start and take turns, round by round. Times are processor
time, the least over all rounds and the median. The error is the largest of the times of the first events
against 45 digits.
"""

from __future__ import annotations

import importlib.util
import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from clock import in_turns
from mpmath import mpf

import stickslip as ss
from report import Report, arguments, left_out
from stickslip.scene.laws.friction import FrictionLaw

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))
from friction_peer import Peer

#: s
DURATION = 0.6
#: Events whose error counts.
COUNTED = 40
LAW = ss.friction.Stribeck(static=1.5, kinetic=1.2, speed=0.1)


def reference_model(friction: FrictionLaw | float) -> tuple[ss.Scene, ss.State]:
    """Return the scene of the standard run under a friction, and its start."""
    scene = ss.models.two_subsystems(friction=friction, slider_speed=0.025, preload_displacement=1e-3)
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})


def error(found: Any, expected: list[tuple[mpf, int, str]]) -> str:
    """Return the largest error of the times; the contacts and combinations have to agree."""
    events = list(zip(found.time, found.contact, found.combination, strict=True))[: len(expected)]
    if [(int(i), str(c)) for _, i, c in events] != [(i, c) for _, i, c in expected]:
        return "other events"
    return f"{max(abs(float(mpf(float(e[0])) - t[0])) for e, t in zip(events, expected, strict=True)):.1e}"


def main() -> None:
    """Print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=100)
    options = parser.parse_args()
    scene, start = reference_model(LAW)
    constant, from_there = reference_model(LAW.static)
    runs: dict[str, Callable[[], Any]] = {
        "constant friction": lambda: ss.simulate(constant, DURATION, from_there).events,
        "Stribeck": lambda: ss.simulate(scene, DURATION, start).events,
        "Stribeck, cold": lambda: ss.simulate(scene.replace(), DURATION, start).events,
    }
    if importlib.util.find_spec("heyoka") is None:
        left_out("heyoka", "the comparison")
    else:
        from peers.taylor import prepare

        for name, tolerance in (("tol = eps", 0.0), ("tol 1e-12", 1e-12), ("tol 1e-9", 1e-9)):
            runs[f"heyoka, {name}"] = prepare(scene, start, DURATION, tolerance)
    found = {name: run() for name, run in runs.items()}
    expected = Peer(scene, start).run(COUNTED, DURATION)
    times = in_turns(runs, options.rounds)
    least = {name: min(own) for name, own in times.items()}
    rows = [
        [
            name,
            str(len(found[name].time)),
            f"{1e3 * least[name]:.3g}",
            f"{1e3 * statistics.median(own):.3g}",
            f"{1e6 * least[name] / len(found[name].time):.2f}",
            f"{least[name] / least['Stribeck']:.2f}",
            "-" if name == "constant friction" else error(found[name], expected),
        ]
        for name, own in times.items()
    ]
    report = Report("friction-laws")
    report.table(("run", "events", "ms", "median ms", "us per event", "x Stribeck", "error, s"), rows)
    used = ["stickslip", "numpy", "mpmath", *(["heyoka"] if "heyoka, tol = eps" in runs else [])]
    report.finish(options.into, *used)


if __name__ == "__main__":
    main()
