"""The clock of a benchmark."""

import time
from collections.abc import Callable
from typing import Any


def clocked(run: Callable[[], Any]) -> tuple[float, Any]:
    """Return processor time, s, and what the run returns."""
    begin = time.process_time()
    found = run()
    return time.process_time() - begin, found


def in_turns(runs: dict[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Return the processor times of each run, s; the runs take turns."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            times[name].append(clocked(run)[0])
    return times
