"""The command line: what it prints, what it writes, and what it exits with."""

import csv
import io
import json
import os
import re
import signal
import struct
import subprocess
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from scipy import stats

import stickslip as ss
from stickslip.cli import main
from stickslip.files.study_file import distribution
from stickslip.modes.modes import signed
from stickslip.motion.events import KINDS
from stickslip.show.summary import Summary, Table
from stickslip.study.run import store

COMMAND = [sys.executable, "-c", "from stickslip.cli import main; main(prog_name='stickslip')"]
VERBS = sorted(main.commands)


def run(*arguments, code=0):
    """Standard output of a command that exits with `code`; what went to standard error as well."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(scope="module")
def brake(tmp_path_factory):
    path = tmp_path_factory.mktemp("cli") / "brake.toml"
    run("init", path)
    return path


def test_help_has_an_example_of_every_verb():
    listed = run("--help").stdout
    for verb in VERBS:
        assert f"  {verb} " in listed
        shown = run(verb, "--help").stdout
        assert f"Example:\n    stickslip {verb}" in shown
    assert "130  interrupted" in listed


def test_an_undamped_scene_is_marginal_in_a_sweep_as_in_its_modes(tmp_path):
    path = tmp_path / "undamped.toml"
    contact = ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=0.1)
    scene = ss.Scene([1.0, 1.0], np.diag([100.0, 1e4]), force=[0.0, -10.0], contacts=[contact])
    ss.save(scene, path)
    assert "marginal" in run("modes", path).stdout
    assert ": 0 stable, 0 unstable, 5 marginal" in run("sweep", path, "--over", "friction=0:1:5").stdout
    damping = np.diag([1e-9, 0.0])
    ss.save(scene.replace(damping=damping), path)
    assert ": 5 stable, 0 unstable\n" in run("sweep", path, "--over", "friction=0:1:5").stdout


def test_a_motion_that_was_followed_too_short_has_no_answer(brake):
    told = run("cycle", brake, "--set", "friction=2.2", "--duration", "0.05", "--further", "0", code=3)
    assert "no limit cycle" not in told.stderr
    assert run("cycle", brake, "--set", "friction=0.3", code=1).stderr.startswith("no limit cycle (equil")


def test_init_writes_the_published_model_with_comments(brake):
    case = ss.load(brake)
    defaults = ss.models.two_subsystems()
    assert (case.scene.stiffness != defaults.stiffness).nnz == 0
    assert np.array_equal(case.scene.force, defaults.force)
    assert np.array_equal(case.scene.mass, defaults.mass)
    assert [vars(c) for c in case.scene.contacts] == [vars(c) for c in defaults.contacts]
    assert brake.read_text().count("#") > 20
    refused = run("init", brake, code=2)
    assert "exists; --force replaces it" in refused.stderr
    run("init", brake, "--force")


def test_the_oscillator_sticks_and_slips(tmp_path):
    path = tmp_path / "belt.toml"
    run("init", path, "--model", "oscillator")
    motion = ss.load(path).simulate()
    # The spring pulls with static friction after 0.5 N / 100 N/m / 0.1 m/s.
    assert motion.events.time[0] == pytest.approx(0.5 * 10.0 / 100.0 / 0.1, rel=1e-14)
    assert set(motion.events.kind) == {"slip+", "velocity"}


def test_modes(brake):
    printed = run("modes", brake).stdout
    assert "119.3580" in printed
    assert "+49.8657" in printed
    assert printed.count("unstable") == 1
    record = json.loads(run("modes", brake, "--json", "--set", "friction=[2.2,2.2]", "-c", "+s").stdout)
    assert record["attrs"]["combination"] == "+s"
    frequency = np.unique(np.round(record["data_vars"]["frequency"]["data"], 2))
    assert frequency[0] == pytest.approx(130.46, abs=0.01)
    rows = list(csv.DictReader(io.StringIO(run("modes", brake, "--csv").stdout)))
    modes = ss.complex_modes(ss.load(brake).scene)
    assert [float(row["eigenvalue_real"]) for row in rows] == modes.eigenvalues.real.tolist()
    assert [float(row["shape_imag_x3"]) for row in rows] == modes.shapes[2].imag.tolist()
    table = run("modes", brake, "--all").stdout
    assert "ss      113.14 258.47 326.10 582.02" in " ".join(table.split()).replace("ss 1", "ss      1")


def test_modes_are_drawn_as_asked(brake, tmp_path):
    target = tmp_path / "modes.png"
    sizes = {}
    for dpi in (100, 300):
        run("modes", brake, "--plot", target, "--modes", "0,2", "--dpi", dpi)
        # Width and height stand in the header of a PNG.
        sizes[dpi] = struct.unpack(">II", target.read_bytes()[16:24])
    assert sizes[300] == pytest.approx(3.0 * np.array(sizes[100]), abs=3)
    run("modes", brake, "--plot", target)
    assert struct.unpack(">II", target.read_bytes()[16:24])[0] == 2700
    assert "--modes goes with --plot" in run("modes", brake, "--modes", "1", code=2).stderr
    refused = run("modes", brake, "--plot", target, "--modes", "1,99", code=2).stderr
    assert "the scene has the modes 0 to 5, got [99]" in refused
    assert "expected numbers of modes" in run("modes", brake, "--modes", "-1", code=2).stderr


def test_sweep(brake, tmp_path):
    printed = run("sweep", brake, "-o", tmp_path / "loci.nc", "--plot", tmp_path / "loci.svg").stdout
    assert "301 scenes over friction: 71 stable, 230 unstable" in printed
    assert "0.701567173085" in printed
    branches = ss.sweep(ss.load(brake).model, {"friction": np.linspace(0.0, 3.0, 301)})
    found = ss.load(tmp_path / "loci.nc")
    assert found.eigenvalue.values.tobytes() == branches.eigenvalue.values.tobytes()
    assert found.eigenvalue.attrs["units"] == "1/s"
    assert "<svg" in (tmp_path / "loci.svg").read_text()
    two = run("sweep", brake, "--over", "inclination=[0.2,0.4]", "--over", "friction=0:3:3", "--csv").stdout
    rows = list(csv.DictReader(io.StringIO(two)))
    assert len(rows) == 2 * 3 * 12
    assert {row["inclination"] for row in rows} == {"0.2", "0.4"}


def test_a_sweep_of_chosen_modes_says_where_stability_changes(brake):
    options = ["sweep", brake, "--over", "friction=0:3:31", "--modes", 2]
    printed = run(*options).stdout
    assert "31 scenes over friction: 8 stable, 23 unstable" in printed
    assert re.search(r"0\.7 +. +0\.8 +. +lost", printed)
    rows = list(csv.DictReader(io.StringIO(run(*options, "--csv").stdout)))
    assert len(rows) == 31 * 4
    assert (
        "--modes follows modes over one parameter"
        in run(*options, "--over", "slider_speed=[0.01,0.02]", code=2).stderr
    )
    assert "is not a valid integer." in run("sweep", brake, "--modes", "x", code=2).stderr


def test_a_sweep_over_two_parameters_draws_where_sliding_is_stable(brake, tmp_path):
    drawn = tmp_path / "map.svg"
    over = ("--over", "inclination=[0.2,0.4]", "--over", "friction=0:3:7")
    run("sweep", brake, *over, "--plot", drawn)
    assert "<svg" in drawn.read_text()[:1000]
    one = ("--over", "inclination=[0.2]", "--over", "friction=0:3:7")
    assert "--plot needs at least two values" in run("sweep", brake, *one, "--plot", drawn, code=2).stderr


def test_a_run_starts_and_is_computed_as_the_options_say(brake, tmp_path):
    belt, target = tmp_path / "belt.toml", tmp_path / "run.nc"
    run("init", belt, "--model", "oscillator")
    scene = ss.load(brake).scene
    start = ss.steady_sliding(scene).perturbed({"x4": 1e-6}, {"x1": 2e-3, "x2": 1e-3})
    given = ("--start", "position.x4=1e-6", "--start", "velocity.x1=2e-3", "--start", "velocity.x2=1e-3")
    refused = run("simulate", brake, *given, "--duration", 0.05, code=2)
    # It lifts the contact mass off its slider: the start is the one that was asked for, and checked.
    assert "position: contact 0" in refused.stderr
    with pytest.raises(ss.InputError, match="position: contact 0"):
        ss.simulate(scene, 0.05, start)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 2e-3, "x2": 1e-3})
    for method in ("modal", "taylor"):
        run("simulate", brake, *given[2:], "--duration", 0.05, "--method", method, "-o", target)
        expected = ss.simulate(scene, 0.05, start, method=method).to_dataset()
        xr.testing.assert_identical(ss.load(target), expected)
    # With a combination, position and velocity are the start itself: with the belt, from rest of the spring.
    stuck = ("-c", "s", "--start", "velocity.along=0.1", "--start", "position.along=0.01")
    printed = run("simulate", belt, *stuck, "--csv", "--events").stdout
    first = next(csv.DictReader(io.StringIO(printed)))
    # The spring pulls with static friction after (0.5 N / 100 N/m 10 - 0.01 m) / 0.1 m/s.
    assert float(first["event_time"]) == pytest.approx((0.05 - 0.01) / 0.1, rel=1e-12)
    studied = ("--over", "friction=[0.5,1.5]", "--ask", "attractor", "--duration", 0.2)
    near = run("study", brake, *studied, "--start", "velocity.x1=1e-3", "--csv").stdout
    assert [row["attractor"] for row in csv.DictReader(io.StringIO(near))] == ["equilibrium", "cycle"]


def test_tables_say_what_is_missing_and_what_kinds_mean(brake, tmp_path):
    still = run("simulate", brake, "--duration", 0.001).stdout
    assert "Events: none" in still
    assert "Kinds" not in still
    assert "Critical points: none" in run("sweep", brake, "--over", "friction=0:0.1:3").stdout
    printed = run("simulate", brake).stdout
    assert re.search(r"velocity +│ +the slip velocity reaches zero", printed)
    assert set(KINDS) >= set(ss.load(brake).simulate().events.kind.tolist())


def test_an_undamped_mode_is_marginal(brake):
    printed = run("modes", brake, "--set", "damping=0.0", "--set", "friction=0.5").stdout
    assert printed.count("marginal") == 6
    assert "stable" not in printed
    assert "-0.000000" not in printed


def test_no_zero_has_a_minus_sign(tmp_path):
    """Nothing dissipates or moves along: damping ratios, growth rates and works are zeros of either sign."""
    contact = ss.Contact(tangential=0, normal=1, friction=0.0, slider_speed=-0.1)
    scene = ss.Scene([1.0, 1.0], np.diag([100.0, 1e4]), force=[0.0, -10.0], contacts=[contact])
    path = tmp_path / "free.toml"
    ss.save(scene, path)
    modes, motion = ss.complex_modes(scene), ss.simulate(scene, 1.0, ss.steady_sliding(scene))
    assert np.signbit(modes.damping_ratios).all()
    assert not modes.damping_ratios.any()
    balance = replace(motion.balance(), damping=-0.0, residual=-0.0)
    mixed = Summary(tables=[Table("zeros", ("either", "sign"), [(-0.0, 0.0), (0.0, -0.0)])])
    printed = [run("modes", path).stdout, repr(modes), repr(balance), str(mixed)]
    printed += [shown.summary()._repr_html_() for shown in (modes, balance)]
    for text in [*printed, mixed._repr_html_()]:
        assert re.search(r"(?<![\d.])0(\.0+)?(?![\d.])", text)
        assert not re.search(r"[-\u2212]0(\.0+)?(e[-+]\d+)?(?![\d.])", text), text
    # What is small is no zero.
    assert signed(-1e-9, 6) == "-1.0e-09"


def test_files_without_a_run_or_a_study_need_options(brake, tmp_path):
    bare, belt = tmp_path / "bare.toml", tmp_path / "belt.toml"
    # The head of the file says what may be left out: all but the name of the model.
    bare.write_text('[model]\nname = "two_subsystems"\n')
    scene = ss.load(bare).scene
    assert (scene.stiffness != ss.load(brake).scene.stiffness).nnz == 0
    for verb in ("simulate", "cycle"):
        assert "no duration in [run]; say --duration" in run(verb, bare, code=2).stderr
    run("simulate", bare, "--duration", 0.01)
    for verb in ("sweep", "study"):
        assert "say --over NAME=" in run(verb, bare, code=2).stderr
    run("init", belt, "--model", "oscillator")
    assert "has no [study.parameters]; say --over NAME=LAW" in run("study", belt, code=2).stderr
    assert "may be left out where the command line says" in brake.read_text()


def test_simulate(brake, tmp_path):
    printed = run("simulate", brake, "-o", tmp_path / "run.nc", "--plot", tmp_path / "run.pdf").stdout
    assert "0 to 0.6 s, stopped by duration" in printed
    assert "Events 301 to 312" in printed
    motion = ss.load(brake).simulate()
    found = ss.load(tmp_path / "run.nc")
    xr.testing.assert_identical(found, motion.to_dataset())
    assert (tmp_path / "run.pdf").read_bytes().startswith(b"%PDF")
    rows = list(csv.DictReader(io.StringIO(run("simulate", brake, "--samples", "11", "--csv").stdout)))
    assert [float(row["time"]) for row in rows] == np.linspace(0.0, 0.6, 11).tolist()
    expected = motion.sample(np.linspace(0.0, 0.6, 11))
    assert [float(row["velocity_x3"]) for row in rows] == expected.velocity.sel(dof="x3").values.tolist()
    assert [row["status_1"] for row in rows] == expected.status.sel(contact=1).values.tolist()
    events = list(csv.DictReader(io.StringIO(run("simulate", brake, "--events", "--csv").stdout)))
    assert [float(row["event_time"]) for row in events] == motion.events.time.tolist()
    assert run("simulate", brake, "--max-events", "5").stdout.startswith("motion ")


def test_cycle(brake, tmp_path):
    printed = run("cycle", brake, "-o", tmp_path / "cycle.nc").stdout
    for fact in ("period +8.90849261 ms", "main line +112.252 Hz", "stability +stable"):
        assert re.search(fact, printed)
    cycle = ss.load(brake).simulate().limit_cycle()
    found = ss.load(tmp_path / "cycle.nc")
    assert found.attrs["period"] == cycle.period
    assert found.multiplier.values.tobytes() == cycle.multipliers.tobytes()
    assert found.combination.values.tolist() == list(cycle.combinations)
    assert found.coefficient.values.tobytes() == cycle.harmonics().coefficient.values.tobytes()
    none = run("cycle", brake, "--set", "friction=0.5", code=1)
    assert "no limit cycle (equilibrium)" in none.stderr


def test_curve(brake, tmp_path):
    plane = ("--over", "friction=1.3:1.7", "--over", "slider_speed=0.0245:0.0255")
    done = run(
        "curve", brake, *plane, "--points", 4, "-o", tmp_path / "curve.nc", "--plot", tmp_path / "c.pdf"
    )
    assert re.search(r"kind +switching of contact 0", done.stdout)
    # At the nearer point a flight vanishes: its curve is that of the orbits without the flight.
    assert done.stderr.startswith(
        "passed over, friction = 1.61181: cycle: the grazing is not found at the point"
    )
    cycle = ss.load(brake).simulate().limit_cycle()
    (point,) = ss.continuation(cycle, {"friction": (1.5, 1.3)}, step=0.1).points
    ranges = {"friction": (1.3, 1.7), "slider_speed": (0.0245, 0.0255)}
    found = ss.continuation(point, ranges, step=0.1, points=4)
    xr.testing.assert_identical(ss.load(tmp_path / "curve.nc"), found.to_dataset())
    assert (tmp_path / "c.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.nightly
def test_a_curve_that_is_not_there(brake):
    near, across = ("--over", "friction=1.49:1.51"), ("--over", "slider_speed=0.02:0.03")
    none = run("curve", brake, *near, *across, code=1)
    assert none.stderr == "no bifurcation of the limit cycle for friction from 1.49 to 1.51\n"
    none = run("curve", brake, *near, *across, "--kind", "period_doubling", code=1)
    assert none.stderr.startswith("no period doubling of the limit cycle")
    assert "--over: expected two parameters, got 1" in run("curve", brake, *near, code=2).stderr
    only = ("--over", "friction=1.55:1.7", *across)
    assert "the grazing is not found at the point" in run("curve", brake, *only, code=3).stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["modes", "none.toml"], "does not exist"),
        (["modes", "SCENE", "--set", "frcition=1"], "nearest: friction"),
        (["modes", "SCENE", "--set", "friction"], "expected NAME=VALUE"),
        (["modes", "SCENE", "--set", "friction=" + "[" * 20_000], "expected NAME=VALUE"),
        (["modes", "SCENE", "--set", "friction=" + "1" * 5000], "expected NAME=VALUE"),
        (["modes", "SCENE", "--set", "friction=-1"], "friction: must be >= 0, got -1"),
        (["modes", "SCENE", "-c", "+x"], "+x"),
        (["modes", "SCENE", "-o", "modes.xls"], "expected a file .nc, .csv"),
        (["modes", "SCENE", "-o", "no/where.nc"], "no such folder: no"),
        (["modes", "SCENE", "--plot", "modes.doc"], "expected a file .pdf"),
        (["modes", "SCENE", "--json", "--csv"], "exclude each other"),
        (["sweep", "SCENE", "--over", "friction=0:1:x"], "expected NAME=FROM:TO:COUNT"),
        (["sweep", "SCENE", "--over", "friction=0:3"], "expected NAME=FROM:TO:COUNT or NAME=[values]"),
        (["sweep", "SCENE", "--over", "friction=0.3"], "expected NAME=FROM:TO:COUNT or NAME=[values]"),
        (["sweep", "SCENE", "--over", "friction=0:inf:31"], "FROM and TO must be finite"),
        (["sweep", "SCENE", "--over", "friction=nan:1:31"], "FROM and TO must be finite"),
        (
            ["sweep", "SCENE", "--over", "friction=0:1:3", "--over", "friction=0:2:3"],
            "friction is given twice",
        ),
        (["study", "SCENE", "--over", "friction=[0,1]", "--over", "friction=[2]"], "friction is given twice"),
        (["modes", "SCENE", "--set", "friction=1", "--set", "friction=2"], "friction is given twice"),
        (
            ["modes", "SCENE", "--set", "vertical_stiffness_2=3e4"],
            "vertical_stiffness_2: the model has no such",
        ),
        (
            ["sweep", "SCENE", "--over", "vertical_stiffness_2=1:2:3"],
            "vertical_stiffness_2: the model has no",
        ),
        (["modes", "SCENE", "--set", "friction=inf"], "friction: must be finite, got inf"),
        (["modes", "SCENE", "--set", "upper_mass=[0.3,-0.7]"], "subsystems[1].upper_mass: must be positive"),
        (["simulate", "SCENE", "--samples", "abc"], "'abc' is not a valid integer."),
        (["simulate", "SCENE", "--dof", "x9", "--plot", "OUT.pdf"], "--dof: unknown dof 'x9'"),
        (["simulate", "SCENE", "--dof", "x1"], "--dof goes with --plot"),
        (["simulate", "SCENE", "--events"], "--events goes with --csv"),
        (["simulate", "SCENE", "--events", "-o", "OUT.nc"], "--events goes with --csv"),
        (["simulate", "SCENE", "--start", "speed.x1=1"], "expected position.DOF=METRES or velocity.DOF"),
        (
            ["simulate", "SCENE", "--start", "velocity.x1=fast"],
            "expected position.DOF=METRES or velocity.DOF",
        ),
        (["simulate", "SCENE", "--start", "velocity.x9=1"], "velocity: unknown dof 'x9'"),
        (["simulate", "SCENE", "--method", "rk4"], "'rk4' is not one of 'auto', 'modal', 'taylor'"),
        (["simulate", "SCENE", "--max-events", "1" + 30 * "0"], "max_events: expected an integer <="),
        (["sweep", "SCENE", "--over", "mu=0:1:5"], "mu: the model has no such parameter"),
        (["simulate", "SCENE", "--duration", "-1"], "duration"),
        (["simulate", "SCENE", "--dof", "y", "--plot", "OUT.pdf"], "unknown dof 'y'"),
    ],
)
def test_wrong_usage_exits_with_2_and_says_why(brake, tmp_path, monkeypatch, arguments, message):
    # No motion is computed first.
    monkeypatch.setattr(ss.Trajectory, "__init__", None)
    given = [
        str(brake) if a == "SCENE" else str(tmp_path / a) if a.startswith("OUT") else a for a in arguments
    ]
    refused = run(*given, code=2)
    assert message in refused.stderr
    assert "Traceback" not in refused.output


def test_a_run_that_cannot_go_on_exits_with_3_and_writes_what_it_has(brake, tmp_path, monkeypatch):
    partial = ss.load(brake).simulate(duration=0.1)

    def stopped(case, **changes):
        raise ss.RunError("contact 0 changes status without end at one instant", partial)

    monkeypatch.setattr(ss.Case, "simulate", stopped)
    result = run("simulate", brake, "-o", tmp_path / "part.nc", code=3)
    assert "changes status without end" in result.stderr
    assert ss.load(tmp_path / "part.nc").attrs["duration"] == 0.1


@pytest.mark.slow
def test_an_interrupted_run_exits_with_130_and_writes_what_it_has(brake, tmp_path):
    target = tmp_path / "part.nc"
    interrupt = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    interrupt.start()
    result = run("simulate", brake, "--duration", "1e7", "-o", target, "--csv", "--samples", "2", code=130)
    interrupt.join()
    assert "interrupted" in result.stderr
    assert 0.0 < ss.load(target).attrs["duration"] < 1e7


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts(shell):
    assert "_STICKSLIP_COMPLETE" in run("completion", shell).stdout


@pytest.mark.process
def test_completion_completes_verbs():
    words = {"_STICKSLIP_COMPLETE": "bash_complete", "COMP_WORDS": "stickslip si", "COMP_CWORD": "1"}
    done = subprocess.run(COMMAND, env={**os.environ, **words}, capture_output=True, text=True)
    assert done.stdout.split() == ["plain,simulate"]


@pytest.mark.process
def test_help_loads_nothing_heavy():
    code = "import sys; from stickslip.cli import main; main(['--help'], standalone_mode=False)"
    code += "; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert not {"xarray", "matplotlib", "pandas", "scipy.optimize"} & set(done.stdout.split())


@pytest.mark.slow
def test_study(brake, tmp_path):
    """What it prints, writes and draws is what `ss.Study` gives."""
    data, drawn = tmp_path / "study.nc", tmp_path / "study.svg"
    printed = run("study", brake, "--samples", 400, "-o", data, "--plot", drawn).stdout
    found = ss.load(data)
    table = ss.load(brake).study["parameters"]
    law = stats.uniform(0.3, 2.2)
    assert table["friction"] == {"uniform": [0.3, 2.5]}
    expected = ss.Study(
        ss.models.two_subsystems,
        {
            "friction": law,
            "wall_stiffness": stats.norm(1.8e6, 9e4),
            "vertical_stiffness_1": stats.norm(3e4, 1.5e3),
        },
        outputs=["growth_rate", "frequency", "unstable_modes"],
        samples=400,
        seed=1,
    ).run()
    for name in ("friction", "growth_rate", "unstable_modes"):
        assert found[name].values.tolist() == expected[name].values.tolist()
    chance = ss.study.probability(expected)
    assert (
        f"unstable with probability {chance.probability.item():.4f} ({chance.lower.item():.4f} to" in printed
    )
    assert "400 ok" in printed
    assert f"{expected.growth_rate.mean().item():.6g}" in printed
    # One panel for each of three parameters, two of outputs: bars and bands.
    assert drawn.read_text().count("axes_") >= 5
    rows = list(csv.DictReader(io.StringIO(run("study", brake, "--samples", 400, "--csv").stdout)))
    assert [float(row["growth_rate"]) for row in rows] == expected.growth_rate.values.tolist()
    assert rows[0].keys() >= {"friction", "status", "reason"}


def test_study_of_motions_goes_on_in_its_store(brake, tmp_path):
    given = (
        "study",
        brake,
        "--over",
        "friction=[0.5,1.5]",
        "--store",
        tmp_path / "x.zarr",
        "--set",
        "damping=2e-4",
    )
    asked = ("--ask", "amplitude", "--ask", "attractor", "--ask", "period", "--duration", 0.2)
    record = json.loads(run(*given, *asked, "--json").stdout)
    # A grid needs no number of samples.
    assert "samples" in run(*given, *asked, "--samples", 2, code=2).stderr
    assert record["data_vars"]["attractor"]["data"] == ["equilibrium", "cycle"]
    scene = ss.models.two_subsystems(friction=1.5, damping=2e-4)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    cycle = ss.simulate(scene, 0.2, start).limit_cycle(2.0)
    assert record["data_vars"]["period"]["data"][1] == pytest.approx(cycle.period, rel=1e-9)
    assert json.loads(run(*given, *asked, "--json").stdout) == record
    refused = run(*given, *asked, "--json", "--seed", 3, code=2)
    assert "holds another study; seed: 3 here, 1 there" in refused.stderr


def test_a_study_that_is_interrupted_exits_with_130_and_writes_what_it_has(brake, tmp_path, monkeypatch):
    target, write = tmp_path / "part.nc", store.MemoryStore.write

    def write_and_interrupt(self, chunk, columns):
        write(self, chunk, columns)
        if chunk == 1:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(store.MemoryStore, "write", write_and_interrupt)
    asked = ("--ask", "events", "--samples", 1000, "--duration", 0.01, "-o", target)
    result = run("study", brake, *asked, "--over", "friction={uniform=[0.3,2.5]}", code=130)
    assert "interrupted" in result.stderr
    left = ss.load(target).status == "pending"
    assert 256 <= (~left).sum() < 1000
    assert left[-1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--over", "fricton={uniform=[0,1]}"],
            "fricton: the model has no such parameter",
        ),
        (["--over", "friction={uniform=[1,0]}"], "friction: uniform: got [1.0, 0.0], expected lower < upper"),
        (["--over", "friction={unifrom=[0,1]}"], "nearest: uniform"),
        (["--over", "friction={normal=[1.0]}"], "friction: normal: expected [mean, deviation], got [1.0]"),
        (["--over", "friction={normal=[1.0,-1.0]}"], "expected a positive deviation"),
        (["--over", "friction={distribution='weibul'}"], "scipy.stats has no distribution 'weibul'"),
        (["--over", "friction={distribution='weibull_min',k=2}"], "friction: weibull_min"),
        (["--over", "friction=0.5"], "expected values"),
        (["--ask", "growth"], "unknown output 'growth'"),
        (["--samples", "0"], "samples: expected an integer >= 1, got 0"),
        (["--sampler", "halton"], "sampler: expected one of"),
    ],
)
def test_wrong_studies_exit_with_2_and_say_why(brake, arguments, message):
    assert message in run("study", brake, *arguments, code=2).stderr


def test_distributions_of_a_file_have_the_moments_they_say():
    for law, mean, deviation in (
        ({"uniform": [1.0, 4.0]}, 2.5, 3.0 / np.sqrt(12.0)),
        ({"normal": [2.0, 0.3]}, 2.0, 0.3),
        ({"lognormal": [1.8e6, 9e4]}, 1.8e6, 9e4),
        ({"triangular": [0.0, 1.0, 5.0]}, 2.0, np.sqrt((25.0 + 1.0 - 5.0) / 18.0)),
        ({"distribution": "gamma", "a": 4.0, "scale": 0.5}, 2.0, 1.0),
    ):
        found = distribution("x", law)
        assert found.mean() == pytest.approx(mean, rel=1e-12)
        assert found.std() == pytest.approx(deviation, rel=1e-12)


def test_modes_of_a_band_and_near_frequencies(brake):
    every = ss.complex_modes(ss.models.two_subsystems(friction=1.5))
    wanted = (every.frequencies >= 100.0) & (every.frequencies <= 400.0) & (every.eigenvalues.real >= -100.0)
    fixed = ("--set", "friction=[1.5,1.5]", "--csv")
    band = run("modes", brake, *fixed, "--band", 100, 400, "--growth", -100, "none").stdout
    assert len(list(csv.DictReader(io.StringIO(band)))) == np.count_nonzero(wanted) > 0
    near = run("modes", brake, *fixed, "--near", 120, "--near", 300, "--count", 1).stdout
    assert len(list(csv.DictReader(io.StringIO(near)))) == 2
    assert "growth: needs a band" in run("modes", brake, "--growth", 0, "none", code=2).stderr
    assert "expected two numbers" in run("modes", brake, "--band", 0, 9, "--growth", 0, "x", code=2).stderr
    assert "--all goes with neither" in run("modes", brake, "--all", "--band", 0, 9, code=2).stderr
