"""Scenes under loads in time from the command line."""

import numpy as np
from click.testing import CliRunner

import stickslip as ss
from stickslip.cli import main


def scene_file(folder):
    floor = ss.Contact(tangential="x", normal="y", friction=0.2, slider_vibration=ss.Harmonic(0.1, 0.05))
    loads = [
        ss.Harmonic({"x": 1.0}, frequency=0.8 / (2.0 * np.pi), name="shaker"),
        ss.Switched({"x": 0.1}, times=[5.0], values=[0.0, 1.0]),
    ]
    scene = ss.Scene([1.0, 1.0], np.eye(2), force=[0.0, -1.0], contacts=[floor], dofs=["x", "y"], loads=loads)
    start = {"position": [0.0, 0.0], "velocity": [0.0, 0.0], "combination": "+"}
    path = folder / "shaken.toml"
    ss.save(ss.Case(scene, start=start, run={"duration": 20.0}), path)
    return path


def test_a_run_names_the_switch_of_a_load(tmp_path):
    shown = CliRunner().invoke(main, ["simulate", str(scene_file(tmp_path))])
    assert shown.exit_code == 0, shown.output
    assert "load" in shown.output


def test_numbers_of_loads_are_set_by_name(tmp_path):
    path = scene_file(tmp_path)
    runs = [
        CliRunner().invoke(main, ["simulate", str(path), *given]).output
        for given in ([], ["--set", "shaker_amplitude=2.0"], ["--set", "slider_vibration_0_amplitude=0.1"])
    ]
    assert runs[0] != runs[1]
    assert runs[0] == runs[2]
    wrong = CliRunner().invoke(main, ["simulate", str(path), "--set", "shaker_volume=2.0"])
    assert wrong.exit_code != 0
