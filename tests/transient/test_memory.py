"""A run for whose events there is no memory keeps what it had."""

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
def test_a_run_ends_with_its_motion_so_far_where_memory_ends():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    events, sampled, last = done.stdout.split()
    assert int(events) > 10_000
    assert (sampled, last) == ("3", "True")
