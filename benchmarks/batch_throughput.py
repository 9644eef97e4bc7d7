"""Throughput of `simulate_many` on one thread and on two.

The scenes are random two-subsystem models, each followed over 0.6 s from a disturbed equilibrium. They are
made before the clock runs, in portions; each portion is run on one thread and on two in turn, and every run
must be the same to the last bit.
"""

from __future__ import annotations

import hashlib
import resource
import statistics
import sys
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import stickslip as ss
from report import Report, arguments
from stickslip import types

DURATION = 0.6
KICK = {"x1": 1e-3}
#: Scenes between two looks at the clock.
PORTION = 250


def scenes(seed: int) -> Iterator[ss.Scene]:
    """Random two-subsystem models: the middle half of them lies around the published one."""
    rng = np.random.default_rng(seed)
    while True:
        yield ss.models.two_subsystems(
            friction=rng.uniform(0.6, 2.4, 2),
            slider_speed=rng.uniform(0.01, 0.1),
            preload_displacement=rng.uniform(5e-4, 2e-3, 2),
            damping=rng.uniform(5e-5, 2e-4),
        )


#: Of one portion, or of all: time, processor time, processor time of the thread that hands out the runs; s.
Clocks = NDArray[np.float64]


def clocks() -> Clocks:
    return np.array([time.perf_counter(), time.process_time(), time.thread_time()])


def run(portion: list[ss.Scene], threads: int) -> tuple[Clocks, list[types.Outcome]]:
    """Return the times and the runs."""
    begin = clocks()
    outcomes = list(
        ss.simulate_many(portion, duration=DURATION, velocity=KICK, threads=threads, progress=False)
    )
    return clocks() - begin, outcomes


def digest(outcomes: list[types.Outcome]) -> tuple[str, int]:
    """Return a hash of everything that the runs consist of, and the number of their events."""
    sha, events = hashlib.sha256(), 0
    for outcome in outcomes:
        if outcome.run is None:
            sha.update(str(outcome.error).encode())
            continue
        end = outcome.run.state(outcome.run.duration)
        events += len(outcome.run.events)
        sha.update(outcome.run.events.time.tobytes())
        sha.update("".join(outcome.run.events.combination).encode())
        sha.update(end.position.tobytes() + end.velocity.tobytes())
    return sha.hexdigest(), events


def throughput(count: int, report: Report) -> None:
    """Add the table of throughputs and ratios."""
    source = scenes(1)
    times: dict[int, list[Clocks]] = {1: [], 2: []}
    same, events = True, 0
    run(list(islice(scenes(0), 20)), 2)  # loads what is loaded once
    for turn in range(-(-count // PORTION)):
        portion = list(islice(source, min(PORTION, count - turn * PORTION)))
        found = {}
        for threads in (1, 2) if turn % 2 == 0 else (2, 1):
            taken, outcomes = run([scene.replace() for scene in portion], threads)
            times[threads].append(taken)
            found[threads] = digest(outcomes)
        same = same and found[1] == found[2]
        events += found[1][1]
    table = []
    for threads, portions in times.items():
        elapsed, processor, caller = np.sum(portions, axis=0)
        each = (1e3 * processor / count, 1e3 * caller / count)
        row = [f"{count / elapsed:.0f}", f"{events / elapsed:.3g}", f"{elapsed:.1f}"]
        table.append([str(threads), *row, *(f"{ms:.3f}" for ms in each)])
    report.table(
        ("threads", "runs/s", "events/s", "s", "processor time per run, ms", "of these in Python, ms"), table
    )
    ratios = [one[0] / two[0] for one, two in zip(times[1], times[2], strict=True)]
    total = sum(one[0] for one in times[1]) / sum(two[0] for two in times[2])
    report.text(
        f"{count} scenes, {events} events; results {'identical' if same else 'DIFFERENT'}.",
        "Two threads over one:",
        f"{total:.2f} in total, {statistics.median(ratios):.2f} in the median portion of {PORTION}",
        f"and {max(ratios):.2f} in the best (target >= 1.8).",
    )
    if not same:
        raise SystemExit("results depend on the number of threads")


def peak() -> float:
    """Return the peak memory of this process, MB."""
    status = Path("/proc/self/status")
    if status.exists():  # Linux hands the peak of a parent process on in getrusage
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024 / 1e6
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used / (1e6 if sys.platform == "darwin" else 1e3)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--scenes", type=int, default=10_000)
    parser.add_argument("--quick", action="store_true", help="a tenth of the scenes")
    options = parser.parse_args()
    part = 10 if options.quick else 1
    report = Report("batch-throughput")
    throughput(options.scenes // part, report)
    report.finish(options.into, "stickslip", "numpy")


if __name__ == "__main__":
    main()
