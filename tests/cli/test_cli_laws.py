"""Scenes with friction over slip speed from the command line."""

import pytest
from click.testing import CliRunner

import stickslip as ss
from stickslip.cli import main

LAW = {"law": "stribeck", "static": 1.5, "kinetic": 1.2, "speed": 0.1}
OWN = {
    "law": "formula",
    "formula": "kinetic + (static - kinetic) * exp(-s / speed)",
    **{name: LAW[name] for name in ("static", "kinetic", "speed")},
}


@pytest.fixture(params=[LAW, OWN], ids=["stribeck", "formula"])
def brake(tmp_path, request):
    scene = ss.models.two_subsystems(friction=request.param, slider_speed=0.025, preload_displacement=1e-3)
    path = tmp_path / "brake.toml"
    ss.save(ss.Case(scene, start={"velocity": {"x1": 1e-3}}, run={"duration": 0.6}), path)
    return path


def run(*arguments):
    shown = CliRunner().invoke(main, list(map(str, arguments)))
    assert shown.exit_code == 0, shown.output
    return shown.output


def test_every_verb_takes_a_law(brake):
    assert 'law = "' in brake.read_text()
    assert "unstable" in run("modes", brake)
    assert "slip" in run("simulate", brake)
    assert "s+" in run("cycle", brake)
    assert "falling friction" in run("sweep", brake, "--over", "slider_speed=0.025:1:5")
    run("study", brake, "--over", "friction_static=[1.4, 1.5]")


@pytest.mark.nightly
def test_a_report_takes_a_law(brake, tmp_path):
    run("report", brake, "-o", tmp_path / "report.html")
    assert "s+" in (tmp_path / "report.html").read_text()


def test_numbers_of_laws_are_set_by_name(brake):
    outputs = [run("modes", brake, "--set", f"friction_kinetic={value}") for value in (1.2, 1.3)]
    assert outputs[0] == run("modes", brake)
    assert outputs[0] != outputs[1]


def test_a_number_that_would_replace_a_law_is_refused(brake):
    shown = CliRunner().invoke(main, ["modes", str(brake), "--set", "friction=0.3"])
    assert shown.exit_code == 2
    assert "friction_kinetic_0" in shown.output
