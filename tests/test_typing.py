"""A user's script is checked by mypy in strict mode: hints are complete, and wrong use is seen."""

import subprocess
import sys

import pytest

SCRIPT = """
from typing import Literal, assert_type

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import stickslip as ss
from stickslip import types


def model(friction: float) -> ss.Scene:
    return ss.Scene(
        mass=[1.0, 1.0],
        stiffness=np.diag([100.0, 200.0]),
        damping=ss.Rayleigh(stiffness=1e-3),
        force=np.array([0.0, -10.0]),
        contacts=[ss.Contact(tangential="x1", normal=1, friction=friction, slider_speed=0.1)],
    )


scene = model(0.5).replace(friction=0.6)
modes = ss.complex_modes(scene, "+")
assert_type(modes.frequencies, NDArray[np.float64])
assert_type(modes.unstable, NDArray[np.bool_])
assert_type(modes.combination, str)
assert_type(scene.plot.view(modes, frames=8), types.View)
assert_type(ss.sweep(model, {"friction": np.linspace(0.0, 1.0, 5)}), xr.Dataset)
assert_type([p.value for p in ss.critical_points(scene, {"friction": (0.0, 1.0)})], list[float])
start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
assert_type(start, ss.State)
try:
    run = ss.simulate(scene, 0.6, start, max_events=100)
except ss.RunError as error:
    assert_type(error.partial, types.Motion | None)
    raise
except ss.Interrupted as stopped:
    assert isinstance(stopped.partial, types.Motion)
    raise
assert_type(run, ss.Trajectory)
assert_type(run.events.time, NDArray[np.float64])
assert_type(run.stop_reason, str)
assert_type(run.counters, dict[str, int])
assert_type(run.sample([0.1, 0.2]), xr.Dataset)
assert_type(run.balance().residual, float)
try:
    cycle = run.limit_cycle()
except ss.NotPeriodicError as other:
    assert_type(other.kind, str)
    assert_type(other.exponent, float)
    raise
assert_type(cycle.period, float)
assert_type(cycle.combinations, tuple[str, ...])
assert_type(cycle.multipliers, NDArray[np.complex128])
assert_type([phase.duration for phase in cycle.phases], list[float])
for outcome in ss.simulate_many((model(mu) for mu in (0.1, 0.2)), duration=1.0, velocity={"x1": 1e-3}):
    assert_type(outcome.run, ss.Trajectory | None)
assert_type(run.plot.history(), Figure)
assert_type(run.plot.phase(contact=0), Axes)
assert_type(modes.plot.shapes(), Figure)
assert_type(modes.plot.structure(2), Axes)
assert_type(cycle.plot.energy(), Figure)
assert_type(cycle.balance().plot.flow(), Axes)
assert_type(cycle.scene.plot(), Axes)
# every other result
points = ss.critical_points(model, {"friction": (0.0, 1.0)}, kinds=("hopf",))
assert_type(points, types.CriticalPoints)
assert_type(points[:1], types.CriticalPoints)
assert_type(points[0].kind, Literal["hopf", "divergence", "lock_in", "crossing", "separation"])
assert_type(ss.stability(scene, {"friction_0": [0.1, 0.2]}), xr.Dataset)
assert_type(ss.sensitivity(model, {"friction": 0.5}), xr.Dataset)
assert_type(ss.sensitivity(scene, entries="mass"), xr.Dataset)
assert_type(start.contact_forces(scene), xr.Dataset)
assert_type(ss.equations_of(scene, "+"), types.Reduced)
assert_type(ss.status_table(scene), types.StatusTable)
assert_type(ss.complex_modes(scene).power(), xr.Dataset)
assert_type(modes[0], types.Mode)
assert_type([mode.frequency for mode in modes.select(band=(0.0, 2e3), unstable=True)], list[float])
assert_type(modes.mac(modes), xr.DataArray)
assert_type(modes.pairing(modes), xr.Dataset)
assert_type(modes.to_dataset(), xr.Dataset)
assert_type(modes.plot(), Axes)
assert_type(run.events[0], types.Event)
assert_type([event.name for event in run.events], list[str])
run.events.to_dataframe()
assert_type(run.grazings, tuple[types.Grazing, ...])
assert_type(run.sample(between=2), xr.Dataset)
assert_type(run.state(0.1), ss.State)
assert_type(run.balance(), types.Balance)
assert_type(run.energy([0.1]), xr.Dataset)
assert_type(run.spectrum("x1"), xr.Dataset)
assert_type(run.plot(), Axes)
assert_type(cycle.run, types.Motion)
assert_type(cycle.margins(), tuple[types.Margin, ...])
assert_type(cycle.modes["+"], ss.Modes)
diagram = ss.bifurcation(model, {"friction": [0.5, 0.6]})
assert_type(diagram, types.Bifurcation)
assert_type(diagram.cycles, tuple[ss.Cycle | None, ...])
assert_type(diagram.to_dataset(), xr.Dataset)
branch = ss.continuation(cycle, {"friction": (0.5, 0.6)})
assert_type(branch, types.Branch)
assert_type(branch.points, tuple[types.BranchPoint, ...])
assert_type(branch.at(0.6), tuple[ss.Cycle, ...])
curve = ss.continuation(branch.points[0], {"friction": (0.5, 0.6), "slider_speed": (0.1, 0.2)})
assert_type(curve, types.BifurcationCurve)
assert_type(curve.points, tuple[types.CodimensionTwo, ...])
reached = ss.basins(model, {"friction": [0.5]}, start=ss.steady_sliding, velocity={"x1": [0.0]})
assert_type(reached, types.Basins)
assert_type(reached.attractors, tuple[ss.Cycle | str, ...])
assert_type(reached.plot(), Axes)
assert_type(ss.modal_energy(run, [0.1]), xr.Dataset)
assert_type(ss.mode_selection(scene), types.ModeSelection)
study = ss.Study(model, {"friction": [0.1, 0.2]})
assert_type(study.run(), xr.Dataset)
assert_type(study.scene_of([0.1]), ss.Scene)
read: ss.Case = ss.load("scene.toml")
case = read.replace(friction_0=0.3)
assert_type(case, ss.Case)
assert_type(case.simulate(), ss.Trajectory)
assert_type(case.to_study(), ss.Study)
assert_type(case.scene, ss.Scene)
"""

WRONG = {
    "ss.simulate(scene, start)": "incompatible type",
    'ss.simulate(scene, 0.6, start, method="modl")': "incompatible type",
    "run.duratoin": "has no attribute",
    "scene.friction = 3.0": "has no attribute",
    "cycle.period = 3.0": "read-only",
    "ss.complex_modes(scene, 3)": "incompatible type",
    "ss.sweep(scene, [1.0])": "incompatible type",
    "run.events[0].contcat": "has no attribute",
    "types.Motoin": "has no attribute",
    "ss.complex_modes(scene).mac(scene)": "incompatible type",
}


HEAD = "import stickslip as ss\nfrom stickslip import types\nfrom script import cycle, run, scene, start\n"


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
