"""Cost per event over the size of a chain, and a chain of a thousand subsystems.

The chains alternate the two published subsystems. Every contact starts on the cycle that it settles to: a
chain of ten is followed until all its contacts stick and slip in turn, and longer chains are ten after ten at
random times of that motion. What does not fit at the seams makes some events early on.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import time
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from batch_throughput import peak

import stickslip as ss
from report import Report, arguments

#: The published subsystems and the springs between and before them.
SUBSYSTEMS = (
    ss.models.Subsystem(
        upper_mass=0.3,
        contact_mass=0.3,
        inclination=0.3,
        vertical_stiffness=4.5e5,
        horizontal_stiffness=3e5,
        ceiling_stiffness=6e4,
        preload_displacement=1e-3,
    ),
    ss.models.Subsystem(
        upper_mass=0.7,
        contact_mass=0.7,
        inclination=0.75,
        vertical_stiffness=3e4,
        horizontal_stiffness=2.4e6,
        ceiling_stiffness=1.8e5,
        preload_displacement=1e-3,
    ),
)
LINK = ss.models.Link(horizontal_stiffness=1.5e6, vertical_stiffness=2.4e5)
WALL = 1.8e6
#: Subsystems of the chain whose motion the others start from, and from when on it is on its cycle, s.
TILE, SETTLED = 10, (0.5, 1.0)
SIZES = (10, 20, 50, 100, 200, 500, 1000)
METHODS: tuple[Literal["taylor", "auto"], ...] = ("taylor", "auto")
#: Events of a run whose cost is taken, and how often it is repeated.
EVENTS, REPEATS = 200, 3
#: The large run: subsystems, motion in s, and the time it may take, s.
LARGE, MOTION, LIMIT = 1000, 0.05, 60.0
#: s; a run that takes longer than this says how far it came.
PATIENCE = 240.0


def scene_of(count: int) -> ss.Scene:
    """Return a chain of `count` subsystems."""
    parts = [SUBSYSTEMS[i % 2] for i in range(count)]
    links = [LINK] * (count - 1)
    return ss.models.chain(parts, links, wall_stiffness=WALL, friction=1.5, slider_speed=0.025)


def settled() -> ss.Trajectory:
    """Return the motion that all start from."""
    scene = scene_of(TILE)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-2})
    run = ss.simulate(scene, SETTLED[1], start, method="taylor")
    moving = np.unique(run.events.contact[run.events.time > SETTLED[0]])
    if moving.size < TILE:
        raise SystemExit(f"only {moving.size} of {TILE} contacts are on a cycle")
    return run


def on_cycles(run: ss.Trajectory, count: int, seed: int = 0) -> ss.State:
    """Return a start for `count` subsystems."""
    times = np.random.default_rng([count, seed]).uniform(*SETTLED, -(-count // TILE))
    states = [run.state(at) for at in times]
    return ss.State(
        np.concatenate([state.position for state in states])[: 4 * count],
        np.concatenate([state.velocity for state in states])[: 4 * count],
        "".join(state.combination for state in states)[:count],
    )


def cost(run: ss.Trajectory, count: int, method: Literal["taylor", "auto"]) -> tuple[float, ss.Trajectory]:
    """Return the processor time per event, s, of a scene that knows no combination yet."""
    scene, start = scene_of(count), on_cycles(run, count)
    begin = time.process_time()
    found = ss.simulate(scene, 1.0, start, method=method, max_events=EVENTS)
    return (time.process_time() - begin) / len(found.events), found


def scaling(run: ss.Trajectory, sizes: tuple[int, ...], report: Report) -> None:
    """Add the table of costs and the exponents."""
    least: dict[Any, float] = {}
    counters: dict[Any, dict[str, int]] = {}
    for _ in range(REPEATS):
        for count in sizes:
            for method in METHODS:
                seconds, found = cost(run, count, method)
                least[count, method] = min(seconds, least.get((count, method), math.inf))
                counters[count, method] = found.counters
    rows = []
    for count in sizes:
        work = counters[count, "taylor"]
        rows.append(
            [
                str(count),
                *(f"{1e3 * least[count, method]:.3f}" for method in METHODS),
                f"{1e6 * least[count, 'taylor'] / count:.2f}",
                f"{work['refinements'] / work['phases']:.0f}",
                str(counters[count, "auto"]["combinations"]),
                str(counters[count, "auto"]["taylor_phases"]),
            ]
        )
    report.table(
        (
            "subsystems",
            "Taylor, ms per event",
            "auto, ms per event",
            "Taylor, us per event and subsystem",
            "functions looked at per phase",
            "combinations met",
            f"Taylor phases of auto, of {EVENTS}",
        ),
        rows,
    )
    logs = np.log(np.array(sizes, dtype=float))
    text = []
    for method in METHODS:
        costs = np.log([least[count, method] for count in sizes])
        local = [(b - a) / (y - x) for (a, b), (x, y) in zip(pairwise(costs), pairwise(logs), strict=True)]
        fitted = np.polyfit(logs, costs, 1)[0]
        text.append(f"{method} {fitted:.2f} (steepest between two sizes {max(local):.2f})")
    report.text(f"Exponent of the cost per event over the size: {', '.join(text)}; target <= 1.1.")


def only_large(motion: float) -> None:
    """Run the large chain, and print what it took."""
    run = settled()
    scene, start = scene_of(LARGE), on_cycles(run, LARGE)
    before, begin, clock = peak(), time.process_time(), time.perf_counter()
    found = ss.simulate(scene, motion, start, time_limit=PATIENCE)
    answer = {
        "events": len(found.events),
        "contacts": len(np.unique(found.events.contact)),
        "reached": found.duration,
        "stopped": found.stop_reason,
        "processor": time.process_time() - begin,
        "elapsed": time.perf_counter() - clock,
        "memory": peak() - before,
        **found.counters,
    }
    print(json.dumps(answer))


def large(motion: float, report: Report) -> None:
    """Add what the large chain took, in a process of its own."""
    command = [sys.executable, __file__, "--only-large", repr(motion)]
    got = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    stopped = f" (stopped by {got['stopped']} at {1e3 * got['reached']:g} ms)"
    reached = "" if got["stopped"] == "duration" else stopped
    report.text(
        f"{LARGE} subsystems ({4 * LARGE} dofs), {1e3 * motion:g} ms of motion{reached}:",
        f"{got['events']} events of {got['contacts']} contacts in {got['processor']:.1f} s of processor time",
        f"({got['elapsed']:.1f} s elapsed; target {LIMIT:g} s for {1e3 * MOTION:g} ms),",
        f"{got['memory']:.0f} MB; {got['panels']} panels, {got['refinements']} functions looked at,",
        f"{got['combinations']} combinations.",
    )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller chains, a hundredth of the motion")
    parser.add_argument("--only-large", type=float, default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.only_large is not None:
        only_large(options.only_large)
        return
    report = Report("chain-scaling")
    scaling(settled(), SIZES[:5] if options.quick else SIZES, report)
    large(MOTION / 100 if options.quick else MOTION, report)
    report.finish(options.into, "stickslip", "numpy")


if __name__ == "__main__":
    main()
