"""A run for whose events or matrices there is no memory keeps what it had."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import resource
from pathlib import Path
import stickslip as ss

scene = ss.models.two_subsystems(friction=1.5)
start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
ss.simulate(scene, 0.1, start).sample([0.05])
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
_, most = resource.getrlimit(resource.RLIMIT_AS)
resource.setrlimit(resource.RLIMIT_AS, (used + 30_000_000, most))
try:
    ss.simulate(scene, 1e6, start)
except ss.RunError as error:
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    assert "no memory for the record of more than" in str(error), error
    kept = error.partial
    times = [0.0, 0.5 * kept.duration, kept.duration]
    print(len(kept.events), kept.sample(times).position.shape[0], kept.events[-1].time == kept.duration)
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform != "linux", reason="the limit of memory is that of Linux")
@pytest.mark.nightly
def test_a_run_ends_with_its_motion_so_far_where_memory_ends():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    events, sampled, last = done.stdout.split()
    assert int(events) > 10_000
    assert (sampled, last) == ("3", "True")


#: The allocator takes memory in pieces small enough to meet the limit.
PIECES = {"MIMALLOC_ARENA_RESERVE": "8192"}
MATRICES = """
import resource, sys
from pathlib import Path
import numpy as np
import stickslip as ss

scene = ss.models.burridge_knopoff(blocks=100)
start = ss.steady_sliding(scene).perturbed(
    position=0.3 * np.cos(7.0 * np.arange(100)), velocity=np.full(100, 5e-3)
)
ss.simulate(scene, 1e-3, start, method="modal").sample([5e-4])
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
_, most = resource.getrlimit(resource.RLIMIT_AS)
resource.setrlimit(resource.RLIMIT_AS, (used + int(sys.argv[1]) * 1_000_000, most))
try:
    ss.simulate(scene, 100.0, start, method="modal", max_events=600)
except ss.RunError as error:
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    assert "the matrices by which a combination is propagated" in str(error), error
    kept = error.partial
    again = ss.simulate(scene, kept.duration, start, method="modal")
    # The last event may be at the end; a shorter run takes other panels.
    shown = len(kept.events) - 1
    same = np.allclose(again.events.time[:shown], kept.events.time[:-1], rtol=1e-12, atol=0.0)
    same &= list(again.events.combination[:shown]) == list(kept.events.combination[:-1])
    print(len(kept.events), kept.sample([0.0, kept.duration]).position.shape[0], same)
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform != "linux", reason="the limit of memory is that of Linux")
@pytest.mark.parametrize("megabytes", [20, 40])
def test_a_run_ends_with_its_motion_so_far_where_matrices_do_not_fit(megabytes):
    """Such a matrix ended the process before."""
    done = subprocess.run(
        [sys.executable, "-c", MATRICES, str(megabytes)],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | PIECES,
    )
    assert done.returncode == 0, done.stderr
    events, sampled, same = done.stdout.split()
    assert int(events) > 5
    assert (sampled, same) == ("2", "True")
