"""Chains of 2, 8 and 32 subsystems beside heyoka, and of 1000 beside CVODE.

The chains and their starts are those of `chains.py`. heyoka compiles an integrator for each
combination that comes: *compile* is what its first run takes beyond a later one, and *run* what that one
takes. *First* is a run of this program whose scene knows no combination, *later* one whose scene knows them
all. CVODE has sparse products and one solver with a band matrix for all combinations. Every program follows
the motion to the time of the last event asked for; the difference is the largest in the time of an event,
after events are sorted by contact.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from chains import on_cycles, scene_of, settled
from clock import clocked

import stickslip as ss
from report import Report, arguments, left_out

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

#: Subsystems beside heyoka, events of each run, and whether heyoka compiles in compact mode, without which an
#: integrator of 8 subsystems takes two seconds. With many contacts nearly every event asks for another one.
BESIDE_HEYOKA = ((2, 400, False), (2, 400, True), (8, 100, True), (32, 40, True))
#: Subsystems and events beside CVODE.
LARGE, LARGE_EVENTS = 1000, 100
#: Relative tolerances of CVODE.
TOLERANCES = (1e-6, 1e-9)
#: s; CVODE is not followed for longer.
PATIENCE = 300.0
#: Part of a mean time between events by which the motion is followed beyond the last.
BEYOND = 1e-3
#: Repetitions of a later run, of which the quickest counts.
REPEATS = 5


def quickest(run: Callable[[], Any]) -> float:
    """Return the least processor time of some runs, s."""
    return min(clocked(run)[0] for _ in range(REPEATS))


def difference(ours: Any, theirs: Any) -> str:
    """Return how far events of the same contacts are apart, s."""
    count = min(len(ours.time), len(theirs.time))
    times, contacts = zip(
        *((np.array(run.time)[:count], np.array(run.contact)[:count]) for run in (ours, theirs)), strict=True
    )
    order = [np.lexsort((at, contact)) for at, contact in zip(times, contacts, strict=True)]
    if not np.array_equal(contacts[0][order[0]], contacts[1][order[1]]):
        return "other events"
    return f"{np.abs(times[0][order[0]] - times[1][order[1]]).max(initial=0.0):.1e}"


def until(run: ss.Trajectory) -> float:
    """Return a time just after the last event."""
    times = run.events.time
    return float(times[-1] + BEYOND * times[-1] / len(times))


def beside_heyoka(cycle: ss.Trajectory, sizes: tuple[tuple[int, int, bool], ...], report: Report) -> None:
    """Add the table of small chains."""
    from peers.taylor import prepare

    rows = []
    for count, most, compact in sizes:
        scene, start = scene_of(count), on_cycles(cycle, count)
        duration = until(ss.simulate(scene, 1e3, start, max_events=most))
        first, ours = clocked(lambda: ss.simulate(scene.replace(), duration, start))  # noqa: B023
        ss.simulate(scene, duration, start)
        later = quickest(lambda: ss.simulate(scene, duration, start))  # noqa: B023
        peer = prepare(scene, start, duration, 0.0, compact=compact)
        cold, theirs = clocked(peer)
        warm = quickest(peer)
        met = len({start.combination, *theirs.combination})
        numbers = [str(count), str(len(ours.events)), str(met)]
        took = [f"{1e3 * t:.3g}" for t in (first, later, cold - warm, warm)]
        mode = "compact" if compact else "default"
        rows.append([*numbers, mode, *took, f"{warm / later:.1f}", difference(ours.events, theirs)])
        print(*rows[-1], file=sys.stderr, flush=True)
    headings = ("subsystems", "events", "combinations", "heyoka compiles")
    times = ("first, ms", "later, ms", "heyoka: compile, ms", "run, ms", "run / later", "difference, s")
    report.table((*headings, *times), rows)


def beside_cvode(cycle: ss.Trajectory, count: int, most: int, report: Report) -> None:
    """Add the table of the large chain."""
    from peers.cvode_chain import prepare

    scene, start = scene_of(count), on_cycles(cycle, count)
    duration = until(ss.simulate(scene, 1e3, start, max_events=most))
    took, ours = clocked(lambda: ss.simulate(scene.replace(), duration, start))
    rows = [
        ["stickslip", str(len(ours.events)), f"{1e3 * took:.3g}", f"{1e3 * took / len(ours.events):.3g}", ""]
    ]
    for method in ("Adams", "BDF"):
        for rtol in TOLERANCES:
            run = prepare(scene, start, duration, method, rtol, PATIENCE)
            took, theirs = clocked(run)
            events = len(theirs.time)
            each = 1e3 * took / events if events else math.inf
            name = f"CVODE {method}, rtol {rtol:.0e}"
            rows.append(
                [name, str(events), f"{1e3 * took:.3g}", f"{each:.3g}", difference(ours.events, theirs)]
            )
            print(*rows[-1], file=sys.stderr, flush=True)
    report.text(f"{count} subsystems ({4 * count} dofs), {1e3 * duration:.2g} ms of motion:")
    report.table(("program", "events", "ms", "ms per event", "difference, s"), rows)


def main() -> None:
    """Print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="shorter runs, a smaller chain beside CVODE")
    options = parser.parse_args()
    report = Report("peers-over-size")
    cycle, used = settled(), ["stickslip", "numpy"]
    try:
        small = BESIDE_HEYOKA[:3] if options.quick else BESIDE_HEYOKA
        beside_heyoka(cycle, small, report)
        used.append("heyoka")
    except ModuleNotFoundError:
        left_out("heyoka", "the chains of 2 to 32 subsystems")
    try:
        beside_cvode(cycle, *((50, 20) if options.quick else (LARGE, LARGE_EVENTS)), report)
        used.append("scikit-sundae")
    except ModuleNotFoundError:
        left_out("scikit-sundae", "the large chain")
    report.finish(options.into, *used)


if __name__ == "__main__":
    main()
