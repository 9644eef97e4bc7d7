"""Memory of a run that meets a new combination at every event."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

#: 80 modes, 100 contact dofs without mass, and a load that moves the slip of 50 contacts about.
RUN = """
import re
from pathlib import Path

import numpy as np

import stickslip as ss

rng = np.random.default_rng(1)
modes, pairs = 80, 50
dofs = modes + 2 * pairs
shapes = 0.3 * rng.normal(size=(2 * pairs, modes))
springs = 10.0 ** rng.uniform(6.0, 7.0, 2 * pairs)
stiffness = np.diag(np.append((2.0 * np.pi * np.linspace(500.0, 2e4, modes)) ** 2, springs))
stiffness[:modes, :modes] += shapes.T @ (springs[:, None] * shapes)
stiffness[:modes, modes:] = -shapes.T * springs
stiffness[modes:, :modes] = stiffness[:modes, modes:].T
force = np.zeros(dofs)
force[modes + 1 :: 2] = -50.0
law = {"friction": 0.4, "static_friction": 0.6}
contacts = [
    ss.Contact(tangential=k, normal=k + 1, slider_speed=0.1 + 0.001 * (k - modes), **law)
    for k in range(modes, dofs, 2)
]
scene = ss.Scene(
    np.append(np.ones(modes), np.zeros(2 * pairs)),
    stiffness,
    damping=ss.Rayleigh(stiffness=1e-9),
    force=force,
    contacts=contacts,
    loads=[ss.Harmonic({k: 3000.0 for k in range(6)}, 700.0)],
)
start = ss.steady_sliding(scene)
start = start.perturbed(velocity={k: 0.005 * rng.normal() for k in range(modes)})
run = ss.simulate(scene, 0.2, start, max_events=1000)
# The peak of getrusage may be that of the process that began this one.
peak = re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]
print(len(run.events), run.counters["combinations"], peak)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells the peak of memory of a process by itself")
def test_combinations_that_do_not_return_leave_the_memory():
    """Each combination holds a megabyte; without a bound, 1000 of them and their factors took 50 GB."""
    told = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, check=True)
    events, combinations, peak = map(int, told.stdout.split())
    assert events == 1000
    assert combinations > 900
    assert peak < 2_000_000, "kB"
