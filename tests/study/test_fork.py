"""Work on all processors after a fork: the child has the memory of its parent, and none of its threads."""

import multiprocessing
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy import stats

import stickslip as ss

MODEL = ss.models.two_subsystems(friction=1.5, slider_speed=0.025, preload_displacement=1e-3)


def basins():
    start = {"x1": [1e-4, 1e-3]}
    return ss.basins(MODEL, {"friction": [1.0, 1.5]}, start=ss.steady_sliding, velocity=start)


def study():
    inputs = {"friction": stats.uniform(0.5, 2)}
    return ss.Study(MODEL, inputs, outputs=["growth_rate"], samples=16).run()


CALLS = {
    "sweep": lambda: ss.sweep(MODEL, {"friction": np.linspace(0.1, 3, 20)}),
    "stability": lambda: ss.stability(MODEL, {"friction": np.linspace(0.1, 3, 2000)}),
    "critical_points": lambda: [
        point.value for point in ss.critical_points(MODEL, {"friction": (0, 3)}, kinds=("hopf",))
    ],
    "bifurcation": lambda: ss.bifurcation(MODEL, {"friction": [1.0, 1.5]}).data,
    "basins": basins,
    "study": study,
}


def send(name, queue):
    queue.put(repr(CALLS[name]()))


@pytest.mark.process
@pytest.mark.skipif(sys.platform != "linux", reason="fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize("name", CALLS)
def test_a_forked_child_computes_what_its_parent_did(name):
    expected = repr(CALLS[name]())
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=send, args=(name, queue))
    child.start()
    try:
        assert queue.get(timeout=20.0) == expected
        child.join(20.0)
        assert child.exitcode == 0
    finally:
        child.kill()


#: Two sweeps, then one that Ctrl-C stops where its work is done on the thread that hears signals.
ALONE = """
import signal
import numpy as np
import stickslip as ss
scene = ss.models.two_subsystems()
for _ in range(2):
    print(len(ss.sweep(scene, {"friction": np.linspace(0.1, 3.0, 50)}).friction))
print(len(ss.stability(scene, {"friction": np.linspace(0.1, 3.0, 2000)}).sample))
signal.signal(signal.SIGALRM, signal.default_int_handler)
signal.setitimer(signal.ITIMER_REAL, 0.3)
try:
    ss.sweep(scene, {"friction": np.linspace(0.1, 3.0, 2_000_000)})
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="a timer that signals")
def test_one_thread_does_the_work_where_the_system_starts_no_others():
    # No address space holds stacks of this size.
    environment = os.environ | {"RUST_MIN_STACK": str(2**50)}
    done = subprocess.run(
        [sys.executable, "-c", ALONE],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )
    assert done.stdout == "50\n50\n2000\nstopped\n", done.stderr
