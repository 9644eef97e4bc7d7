"""The standard run by this program and by scipy's DOP853 restarted at events: time and error.

Errors are against the 220-bit reference solution: the largest error of an event time, and of the state at the
end, relative to the largest displacement and velocity. Both programs start from scratch in every repetition.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy
from rich.console import Console
from rich.table import Table

import stickslip as ss

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from conftest import reference_solution
from peer_integrator import integrate

#: Longest steps of the peer, s: what decides its error (and whether it sees every event).
LONGEST_STEPS = (4e-4, 1e-4)


def best_of(repetitions: int, run: Callable[[], object]) -> tuple[float, object]:
    """Return the shortest time, s, and the last result."""
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        result = run()
        times.append(time.perf_counter() - begin)
    return min(times), result


def errors(reference, event_times, end_state) -> tuple[str, str]:
    """Return the error of the event times and of the state at the end, or what events are missing."""
    if len(event_times) != len(reference.time):
        return f"{len(event_times)} of {len(reference.time)} events", "-"
    n = reference.scene.size
    scale = np.repeat([np.abs(part).max() for part in np.split(reference.end_state, 2)], n)
    state = np.abs((end_state - reference.end_state) / scale).max()
    return f"{np.abs(event_times - reference.time).max():.1e}", f"{state:.1e}"


def main() -> None:
    reference = reference_solution("paper-mu1.5-v0.025")
    table = Table(title="Standard run: 0.6 s, 312 events")
    for heading in ("program", "time", "event times, s", "end state, relative"):
        table.add_column(heading, justify="left" if heading == "program" else "right")

    def ours(method: str) -> ss.Trajectory:
        # A replaced scene remembers no combination: all decompositions are part of the time.
        return ss.simulate(reference.scene.replace(), reference.start, reference.duration, method=method)

    for method in ("modal", "taylor"):
        seconds, run = best_of(20, lambda method=method: ours(method))
        end = run.state(run.duration)
        end_state = np.concatenate([end.position, end.velocity])
        name = f"stickslip {ss.__version__}, {method}"
        table.add_row(name, f"{1e3 * seconds:.2f} ms", *errors(reference, run.events.time, end_state))
    for step in LONGEST_STEPS:
        seconds, motion = best_of(
            3, lambda step=step: integrate(reference.scene, reference.start, 0.6, longest_step=step)
        )
        name = f"scipy {scipy.__version__}, DOP853, steps up to {step:g} s"
        found = errors(reference, np.array(motion.time), motion.end_state)
        table.add_row(name, f"{1e3 * seconds:.0f} ms", *found)
    Console().print(table)


if __name__ == "__main__":
    main()
