"""The clock of a benchmark."""

import time
from collections.abc import Callable
from typing import Any


def clocked(run: Callable[[], Any]) -> tuple[float, Any]:
    """Return processor time, s, and what the run returns."""
    begin = time.process_time()
    found = run()
    return time.process_time() - begin, found
