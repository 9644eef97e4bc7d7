"""A user's script is checked by mypy in strict mode: hints are complete, and wrong use is seen."""

import subprocess
import sys

import pytest

SCRIPT = """
from typing import assert_type

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

import stickslip as ss


def model(friction: float) -> ss.Scene:
    return ss.Scene(
        mass=[1.0, 1.0],
        stiffness=np.diag([100.0, 200.0]),
        damping=ss.Proportional(stiffness=1e-3),
        force=np.array([0.0, -10.0]),
        contacts=[ss.Contact(tangential="x1", normal=1, friction=friction, slider_speed=0.1)],
    )


scene = model(0.5).replace(friction=0.6)
modes = ss.complex_modes(scene, "+")
assert_type(modes.frequencies, NDArray[np.float64])
assert_type(modes.unstable, NDArray[np.bool_])
assert_type(modes.combination, str)
assert_type(ss.sweep(model, friction=np.linspace(0.0, 1.0, 5)), xr.Dataset)
assert_type([p.value for p in ss.critical_points(scene, friction=(0.0, 1.0))], list[float])
start = ss.sliding_equilibrium(scene).perturbed(velocity={"x1": 1e-3})
assert_type(start, ss.State)
try:
    run = ss.simulate(scene, start, duration=0.6, max_events=100)
except ss.RunError as error:
    assert_type(error.partial, ss.types.Motion | None)
    raise
assert_type(run, ss.Trajectory)
assert_type(run.events.time, NDArray[np.float64])
assert_type(run.stop_reason, str)
assert_type(run.counters, dict[str, int])
assert_type(run.sample([0.1, 0.2]), xr.Dataset)
assert_type(run.balance().residual, float)
cycle = run.limit_cycle()
assert_type(cycle.period, float)
assert_type(cycle.combinations, tuple[str, ...])
assert_type(cycle.multipliers, NDArray[np.complex128])
assert_type([phase.duration for phase in cycle.phases], list[float])
for outcome in ss.simulate_many((model(mu) for mu in (0.1, 0.2)), duration=1.0, velocity={"x1": 1e-3}):
    assert_type(outcome.run, ss.Trajectory | None)
assert_type(ss.plot.history(run), Figure)
assert_type(ss.reference.figures.figure_3(), Figure)
assert_type(ss.load_scene("scene.toml"), ss.Scene)
"""

WRONG = {
    "ss.simulate(scene, start)": "Missing positional argument",
    'ss.simulate(scene, start, 0.6, method="modl")': "incompatible type",
    "run.duratoin": "has no attribute",
    "scene.friction = 3.0": "has no attribute",
    "cycle.period = 3.0": "read-only",
    "ss.complex_modes(scene, 3)": "incompatible type",
}


HEAD = "import stickslip as ss\nfrom script import cycle, run, scene, start\n"


@pytest.mark.process
def test_a_script_passes_strictly_and_mistakes_are_seen(tmp_path):
    pytest.importorskip("mypy")
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    (tmp_path / "wrong.py").write_text(HEAD + "\n".join(WRONG) + "\n", encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "script.py", "wrong.py"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    complaints = done.stdout.splitlines()[:-1]
    assert [text for text in complaints if not text.startswith("wrong.py")] == [], done.stderr
    for number, (line, complaint) in enumerate(WRONG.items(), start=1 + HEAD.count("\n")):
        found = [text for text in complaints if text.startswith(f"wrong.py:{number}:")]
        assert any(complaint in text for text in found), (line, found)
