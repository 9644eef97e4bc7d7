"""The explorer's server: it shows what the package computes, and answers nobody but its own page."""

import base64
import dataclasses
import http.client
import io
import itertools
import json
import os
import signal
import subprocess
import sys
import threading
import time
import wave
from functools import partial

import numpy as np
import pytest
from click.testing import CliRunner

import stickslip as ss
from equal_chain import PART, equal_chain
from quad_block import quad_block
from stickslip import types
from stickslip.cli import main
from stickslip.explorer import curves, picture, sound
from stickslip.explorer.curves import incomplete
from stickslip.explorer.knobs import joint, knobs, ordinates
from stickslip.scene.parameters.family import Family


@pytest.fixture(scope="module")
def page():
    with ss.explore() as page:
        yield page


def sent(page, path, message=None, method="POST", **headers):
    """Return status and body of one message; headers that are None are left out."""
    host = page.url.removeprefix("http://").strip("/")
    given = {"Host": host, "Origin": f"http://{host}", "Content-Type": "application/json"}
    body = message if isinstance(message, bytes) else json.dumps(message).encode()
    given |= {"Content-Length": str(len(body))}
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    connection = http.client.HTTPConnection(host, timeout=60)
    connection.putrequest(method, path, skip_host=True)
    for name, value in given.items():
        if value is not None:
            connection.putheader(name, value)
    connection.endheaders(body if method == "POST" else None)
    answer = connection.getresponse()
    found = answer.status, answer.read()
    connection.close()
    return found


def asked(page, path, **message):
    status, body = sent(page, path, message)
    assert status == 200, body
    return json.loads(body)


def unpacked(text, width=1):
    return np.frombuffer(base64.b64decode(text), dtype="<f4").reshape(-1, width)


def motion_of(page, **values):
    return asked(page, "/motion", values=values, dof=0, patience=2.0, start={"kind": "file"})


@pytest.mark.parametrize(("friction", "speed"), [(1.5, 0.025), (2.0, 0.06), (0.9, 0.02)])
def test_the_shown_cycle_is_the_limit_cycle_of_the_point(page, friction, speed):
    values = {
        f"{name}_{k}": one for name, one in (("friction", friction), ("slider_speed", speed)) for k in "01"
    }
    shown = motion_of(page, **values)
    scene = ss.models.two_subsystems(friction=friction, slider_speed=speed)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    cycle = ss.simulate(scene, 0.6, start).limit_cycle()
    assert shown["cycle"]["combinations"] == list(cycle.combinations)
    # Both are refined to rounding, from runs of different length.
    assert shown["cycle"]["period"] == pytest.approx(cycle.period, rel=1e-9)
    times = unpacked(shown["motion"]["time"])[:, 0].astype(float)
    exact = cycle.run.core.sample(np.minimum(times, cycle.period))
    tangential = np.stack([scene.tangential_direction(k) for k in (0, 1)], axis=1)
    slip = unpacked(shown["motion"]["slip"], 2)
    # Times go over in single precision: away from events by so much times the acceleration.
    away = np.min(np.abs(times[:, None] - cycle.run.events.time), axis=1) > 1e-6
    scale = np.abs(slip).max()
    assert away.sum() > 200
    assert np.abs(slip - exact[1] @ tangential)[away].max() < 1e-3 * scale
    status = np.frombuffer(base64.b64decode(shown["motion"]["status"]), np.uint8).reshape(-1, 2)
    assert np.array_equal(status[away], exact[4][away])
    balance = cycle.balance()
    works = (balance.contacts.work.sum("status") - balance.contacts.impact_normal).to_numpy()
    for row, work in zip(shown["energy"], works, strict=False):
        assert sum(row["parts"].values()) == pytest.approx(1e3 * work, rel=1e-3, abs=1e-6)


def test_the_first_picture_is_that_of_the_scene_as_given(page):
    shown = motion_of(page)
    assert shown["error"] is None
    assert shown["cycle"]["combinations"] == ["++", "+d", "++", "s+", "ss", "s+"]
    assert "limit cycle of 8.9085 ms" in shown["sentence"]
    assert "contact 0 sticks 57 %" in shown["sentence"]
    assert shown["lines"]["frequency"][0] == pytest.approx(112.2524, rel=1e-6)


def test_a_stable_point_says_so_and_an_ill_posed_one_why(page):
    stable = motion_of(page, friction_0=0.3, friction_1=0.3)
    assert stable["sentence"] == "Steady sliding is stable. Disturbed, it comes to rest again."
    assert stable["cycle"] is None
    assert "static_friction: must be >= friction" in motion_of(page, static_friction_0=0.1)["sentence"]
    resting = motion_of(page, slider_speed_0=0.0)
    assert resting["sentence"].startswith("There is no steady sliding: ")
    assert "slider_speed" in resting["sentence"]


def test_loci_and_map_are_those_of_the_package(page):
    found = asked(page, "/loci", values={}, x=["friction", 0.0, 3.0], count=31, critical=True)
    sweep = ss.sweep(ss.models.two_subsystems, {"friction": np.linspace(0.0, 3.0, 31)}, progress=False)
    growth = unpacked(found["growth"]).reshape(found["branches"], 31)
    assert growth.max() == pytest.approx(float(sweep.eigenvalue.to_numpy().real.max()), rel=1e-6)
    grows = unpacked(found["unstable"]).reshape(growth.shape)
    assert grows.sum(axis=0).tolist() == (sweep.unstable.sum("branch") / 2).values.tolist()
    assert [point["value"] for point in found["hopf"]] == pytest.approx([0.70156717308523, 2.1002056016114])
    answer = asked(
        page, "/map", values={}, x=["friction", 0.0, 3.0], y=["inclination_0", 0.1, 0.5], columns=7, rows=5
    )
    x, y = np.meshgrid(np.linspace(0.0, 3.0, 7), np.linspace(0.1, 0.5, 5))
    verdicts = ss.stability(ss.models.two_subsystems, {"friction": x.ravel(), "inclination_0": y.ravel()})
    expected = np.where(verdicts.steady_sliding, verdicts.growth_rate, np.nan)
    assert unpacked(answer["unstable"])[:, 0].tolist() == (verdicts.unstable_modes > 0).values.tolist()
    assert unpacked(answer["growth"])[:, 0] == pytest.approx(expected, rel=1e-6, nan_ok=True)


PLANE = {"x": ["friction", 0.0, 3.0], "y": ["vertical_stiffness_0", 5e4, 2e6], "cells": 8}


def test_curves_are_those_of_the_package(page):
    answer = asked(page, "/curves", values={}, **PLANE)
    ranges = {"friction": (0.0, 3.0), "vertical_stiffness_0": (5e4, 2e6)}
    boundary = ss.stability_boundary(ss.models.two_subsystems, ranges, cells=8)
    assert answer["whole"] is True
    assert answer["said"] == "2 Hopf curves; counts of modes agree at 32 x 32 places."
    drawn = np.concatenate(
        [np.hstack([unpacked(piece["x"]), unpacked(piece["y"])]) for piece in answer["pieces"]]
    )
    for curve in boundary:
        # Places go over in single precision.
        gaps = np.abs(curve.values[:, None] / boundary.spans - drawn / boundary.spans).max(axis=2)
        assert gaps.min(axis=1).max() < 1e-6
    assert {(piece["line"], piece["look"]) for piece in answer["pieces"]} == {("-", 1), ("-", 2)}
    assert len(answer["pieces"]) == 4
    (double,) = (point for point in answer["points"] if point["name"])
    assert double["told"] == "double Hopf at 2.2016, 156688: 112.905 Hz, 195.564 Hz"
    assert sum("degenerate, extreme of friction" in point["told"] for point in answer["points"]) == 2
    moved = asked(page, "/curves", values={"damping": 2e-4, "friction_0": 0.2}, **PLANE)
    assert moved["pieces"][0]["x"] != answer["pieces"][0]["x"]


def test_what_has_no_curves_says_why(page):
    undamped = asked(page, "/curves", values={"damping": 0.0}, **PLANE)
    assert undamped["error"].startswith(
        "No curves: model: a mode neither grows nor decays over all of the map"
    )
    same = asked(page, "/curves", values={}, **{**PLANE, "y": ["friction_0", 0.0, 1.0]})
    assert "set the same number" in same["error"]
    calm = asked(page, "/curves", values={}, **{**PLANE, "x": ["friction", 0.0, 0.1]})
    assert calm["said"] == "No curves; counts of modes agree at 32 x 32 places."
    for change in ({"cells": 1}, {"cells": 33}, {"cells": 8.0}, {"x": ["friction", 1.0, 0.0]}, {"y": None}):
        assert sent(page, "/curves", {"values": {}, **PLANE, **change})[0] == 400, change
    with ss.explore(equal_chain(16, friction=0.5)) as large:
        grid = {"x": ["friction", 0.1, 1.0], "y": ["damping_stiffness", 1e-5, 1e-4], "cells": 8}
        left_out = asked(large, "/curves", values={}, **grid)
    assert left_out == {"error": "Curves are left out for 64 dofs; they need a band of frequencies."}


def test_a_search_for_curves_ends_in_time_and_says_what_that_means(page, monkeypatch):
    monkeypatch.setattr(curves, "LONGEST", 0.0)
    cut = asked(page, "/curves", values={}, **PLANE)
    assert cut["error"] is None
    assert cut["whole"] is False
    assert "; one may be missing: " in cut["said"]
    assert cut["said"].endswith("stopped after 1 of 48 lines, 0 s.")


def test_motions_are_answered_while_curves_are_searched(page, monkeypatch):
    lines = []
    search = curves.search_over

    def slow(*arguments):
        found = search(*arguments)
        run = found.run

        def one_by_one():
            for step in run():
                lines.append(step)
                time.sleep(0.03)
                yield step

        found.run = one_by_one
        return found

    monkeypatch.setattr(curves, "search_over", slow)
    answers = []
    asking = threading.Thread(target=lambda: answers.append(asked(page, "/curves", values={}, **PLANE)))
    asking.start()
    while not lines:
        time.sleep(0.01)
    assert motion_of(page)["error"] is None
    assert not answers
    asking.join()
    assert answers[0]["whole"]
    assert len(lines) >= 48


def test_a_search_for_curves_ends_where_its_page_has_gone(page, monkeypatch, capfd):
    lines, ended = [], threading.Event()
    search = curves._searched

    def watched(found, wanted, patience):
        run = found.run

        def endless():
            for step in itertools.cycle(run()):
                lines.append(step)
                time.sleep(0.01)
                yield step

        found.run = endless
        try:
            return search(found, wanted, 60.0)
        finally:
            ended.set()

    monkeypatch.setattr(curves, "_searched", watched)
    host = page.url.removeprefix("http://").strip("/")
    connection = http.client.HTTPConnection(host, timeout=60)
    headers = {"Origin": f"http://{host}", "Content-Type": "application/json"}
    connection.request("POST", "/curves", json.dumps({"values": {}, **PLANE}), headers)
    while not lines:
        time.sleep(0.01)
    connection.close()
    assert ended.wait(20.0)
    assert motion_of(page)["error"] is None
    assert "Traceback" not in capfd.readouterr().err


def test_a_motion_goes_on_from_the_one_before(page):
    before = motion_of(page)
    on = asked(
        page,
        "/motion",
        values={"friction_0": 1.52},
        dof=0,
        patience=2.0,
        start={"kind": "on", **before["state"]},
    )
    assert on["error"] is None
    assert np.isclose(unpacked(on["way"]["position"], 9)[0, 0], before["state"]["position"][0])
    # It is on a cycle from the start: no growth from small motion.
    way = unpacked(on["way"]["slip"], 2)[:, 0]
    assert np.ptp(way[:200]) > 0.5 * np.ptp(way)


def test_copies_compute_the_cycle_that_is_shown(page, tmp_path):
    values = {"friction_0": 1.8, "friction_1": 1.8, "vertical_stiffness_1": 3.3e4}
    shown = motion_of(page, **values)
    copied = asked(page, "/text", values=values, start={"kind": "file"})
    (tmp_path / "scene.toml").write_text(copied["toml"], encoding="utf-8")
    case = ss.load(tmp_path / "scene.toml")
    assert case.simulate().limit_cycle().period == pytest.approx(shown["cycle"]["period"], rel=1e-9)
    names = {}
    exec(compile(copied["python"], "copied", "exec"), names)
    assert names["cycle"].period == pytest.approx(shown["cycle"]["period"], rel=1e-9)
    for path, begins in (("/figure", b"%PDF-"), ("/sound", b"RIFF")):
        status, body = sent(
            page, path, {"values": values, "start": {"kind": "file"}, "seconds": 0.3, "contact": 0}
        )
        assert status == 200
        assert body.startswith(begins)


def test_a_sound_has_the_main_line_of_the_cycle():
    scene = ss.models.two_subsystems()
    run = ss.simulate(scene, 2.0, ss.disturbed_sliding(scene))
    with wave.open(io.BytesIO(sound(run)), "rb") as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (1, 2, 44100)
        heard = np.frombuffer(file.readframes(file.getnframes()), "<i2")
    assert heard.size == 2 * 44100
    late = heard[44100:].astype(float)
    lines = np.abs(np.fft.rfft(late * np.hanning(late.size)))
    assert np.argmax(lines) == pytest.approx(run.limit_cycle().main_frequency("x3"), abs=1.0)
    assert np.abs(heard).max() == pytest.approx(0.8 * 32767, rel=1e-3)
    with pytest.raises(ss.InputError, match="contact: expected an index below 2, got 2"):
        sound(run, 2)


def test_the_command_line_writes_a_sound(tmp_path):
    file = tmp_path / "brake.toml"
    ss.save(ss.models.two_subsystems(), file)
    options = ["--duration", "0.25", "--contact", "1", "-o", str(tmp_path / "squeal.wav")]
    told = CliRunner().invoke(main, ["listen", str(file), *options])
    assert told.exit_code == 0, told.output
    with wave.open(str(tmp_path / "squeal.wav"), "rb") as heard:
        assert heard.getnframes() == pytest.approx(0.25 * 44100, abs=1)


FOREIGN = [
    {"Origin": "http://evil.example"},
    {"Origin": None},
    {"Origin": "null"},
    {"Host": "evil.example"},
    {"Content_Type": "text/plain"},
    {"Content_Type": None},
]


@pytest.mark.parametrize("headers", FOREIGN, ids=str)
def test_no_other_page_is_answered(page, headers):
    status, body = sent(page, "/motion", {"values": {}}, **headers)
    assert (status, json.loads(body)) == (403, {"error": "Forbidden"})


def test_nothing_but_the_page_is_read(page):
    for path in ("/", "/page.js", "/plots.js", "/panels.js", "/page.css", "/scene"):
        assert sent(page, path, method="GET")[0] == 200
    for path in (
        "/../server.py",
        "/page/page.js",
        "/%2e%2e/server.py",
        "//etc/passwd",
        "/page.js?x=/etc/passwd",
    ):
        assert sent(page, path, method="GET")[0] == 404
    assert sent(page, "/", method="GET", Host="evil.example")[0] == 403
    assert sent(page, "/", method="DELETE")[0] == 501


HOSTILE = [
    b"",
    b"[]",
    b"null",
    b"{",
    b"\xff\xfe",
    b"[" * 100_000,
    b'{"values": {"friction_0": NaN}}',
    b'{"values": {"friction_0": 1e999}}',
    {"values": {"friction_0": 10**400}, "dof": 0, "patience": 1, "start": {"kind": "file"}},
    b'{"values": {"friction_0": ' + b"1" * 5000 + b"}}",
    {"values": []},
    {"values": {"friction_0": "1.5"}},
    {"values": {"friction_0": True}},
    {"values": {"friction_0": [1.0]}},
    {"values": {"__class__": 1.0}},
    {"values": {"friction": 1.5}},
    {"values": {}, "dof": -1},
    {"values": {}, "dof": 10**30},
    {"values": {}, "dof": 0.0},
    {"values": {}, "dof": 0, "patience": "long"},
    {"values": {}, "dof": 0, "patience": 1, "start": {"kind": "../x"}},
    {"values": {}, "dof": 0, "patience": 1, "start": {"kind": ["file"]}},
    {"values": {}, "dof": 0, "patience": 1, "start": {"kind": "kick", "dof": 99, "velocity": 1.0}},
    {"values": {}, "dof": 0, "patience": 1, "start": {"kind": "on", "position": [1.0], "velocity": []}},
]


@pytest.mark.parametrize("message", HOSTILE, ids=lambda message: str(message)[:60])
def test_hostile_messages_are_refused_and_change_nothing(page, message):
    status, body = sent(page, "/motion", message)
    assert status == 400, body
    assert "error" in json.loads(body)


def test_hostile_ranges_are_refused(page):
    grid = {"x": ["friction", 0.0, 1.0], "y": ["slider_speed", 0.01, 0.1], "columns": 4, "rows": 4}
    assert sent(page, "/map", {"values": {}, **grid})[0] == 200
    for change in (
        {"columns": 10**6},
        {"rows": 1},
        {"rows": 4.0},
        {"x": ["friction", 1.0, 0.0]},
        {"x": ["friction"]},
        {"x": ["os", 0.0, 1.0]},
        {"y": "friction"},
    ):
        assert sent(page, "/map", {"values": {}, **grid, **change})[0] == 400, change
    # Two names of one number, and what is ill-posed, are errors of the question: they are told in words.
    status, body = sent(page, "/map", {"values": {}, **grid, "y": ["friction_0", 0.0, 1.0]})
    assert status == 200
    assert "set the same number" in json.loads(body)["error"]


def test_too_long_a_message_is_not_read(page):
    for length in ("1000001", "-1", "ten"):
        assert sent(page, "/motion", b"{}", Content_Length=length)[0] == 413
    assert motion_of(page)["cycle"]["period"] == pytest.approx(8.908492605779e-3, rel=1e-9)


def test_what_may_wait_is_bounded(page):
    server = page._server
    for _ in range(8):
        assert server.room.acquire(timeout=30.0)
    try:
        assert sent(page, "/motion", {})[0] == 503
    finally:
        for _ in range(8):
            server.room.release()
    assert motion_of(page)["error"] is None


def test_every_parameter_has_a_slider():
    family = Family(partial(ss.models.two_subsystems, static_friction=2.0, friction=[1.5, 1.2]))
    known = knobs(family)
    assert {name: known[name].value for name in ("friction_1", "static_friction_0", "damping")} == {
        "friction_1": 1.2,
        "static_friction_0": 2.0,
        "damping": 1e-4,
    }
    assert len(known) == 28
    assert all(knob.low < knob.high for knob in known.values())
    assert all(knob.value is None or knob.low <= knob.value <= knob.high for knob in known.values())
    # What stands at different values is not moved by one slider.
    assert "static_friction" in joint(family, known)
    assert "friction" not in joint(family, known)


def test_numbers_of_formulas_have_sliders_in_scenes_and_models():
    law = ss.friction.Law("level + rise * exp(-s / scale)", level=0.3, rise=-2e-4, scale=0.1)
    scene = ss.models.two_subsystems(friction=[law, 0.4])
    for model in (scene, partial(ss.models.two_subsystems, friction=[law, 0.4])):
        known = knobs(Family(model))
        named = {name: knob for name, knob in known.items() if name.startswith("friction")}
        assert {name: knob.value for name, knob in named.items()} == {
            "friction_level_0": 0.3,
            "friction_rise_0": -2e-4,
            "friction_scale_0": 0.1,
            "friction_1": 0.4,
        }
        # A slider keeps the sign, for a formula may divide by its numbers.
        assert (named["friction_rise_0"].low, named["friction_rise_0"].high) == (4.0 * -2e-4, 0.04 * -2e-4)
        assert named["friction_scale_0"].low > 0.0


@pytest.mark.parametrize("friction", [0.3, ss.friction.Stribeck(0.5, 0.3, 0.1)], ids=["constant", "law"])
@pytest.mark.parametrize("speed", [0.1, -0.1])
def test_maps_and_loci_over_the_ranges_of_sliders_are_those_of_scenes_that_exist(friction, speed):
    """No slider of steady sliding begins at rest, none of static friction below friction at rest."""
    contact = ss.Contact(tangential=0, normal=1, friction=friction, slider_speed=speed)
    scene = ss.Scene([1.0, 1.0], np.diag([100.0, 200.0]) + 10.0, force=[0.0, -10.0], contacts=[contact])
    known = knobs(Family(scene))
    names = [name for name, knob in known.items() if knob.value is not None or name == "static_friction"]
    assert {"slider_speed", "static_friction"} < set(names)
    with ss.explore(scene) as page:
        for name in names:
            x = [name, known[name].low, known[name].high]
            assert asked(page, "/loci", x=x, count=11)["error"] is None
            y = ["slider_speed" if name != "slider_speed" else "static_friction"]
            y += [known[y[0]].low, known[y[0]].high]
            assert asked(page, "/map", x=x, y=y, columns=5, rows=5)["error"] is None


@pytest.mark.parametrize("law", [False, True])
def test_the_ordinate_of_the_first_map_moves_eigenvalues(law):
    """Slider speed does under a law of friction; under constant friction no eigenvalue depends on it."""
    friction = ss.friction.Stribeck(0.5, 0.3, 0.1) if law else 0.3
    contact = ss.Contact(tangential=0, normal=1, friction=friction, slider_speed=0.1)
    scene = ss.Scene([1.0, 1.0], np.diag([100.0, 200.0]) + 10.0, force=[0.0, -10.0], contacts=[contact])
    known = knobs(Family(scene))
    first = ordinates(Family(scene), known)[0]
    assert first == ("slider_speed" if law else "damping_stiffness")

    def change(name):
        swept = ss.sweep(scene, {name: [known[name].low, known[name].high]})
        return np.ptp(swept.eigenvalue.values.real, axis=0).max()

    assert change(first) > 0.01
    assert (change("slider_speed") > 0.01) == law


def test_a_mass_of_almost_nothing_does_not_hold_up_the_page(page):
    """Its fastest mode decays within 1e-11 s; the lines are then those of samples of the period."""
    begun = time.perf_counter()
    moved = {"values": {"upper_mass_0": 1e-9}, "patience": 5.0, "dof": 2, "start": {"kind": "mode"}}
    found = asked(page, "/motion", **moved)
    assert time.perf_counter() - begun < 60.0
    assert found["lines"]["exact"] is False
    light = ss.models.two_subsystems(upper_mass=(1e-4, 0.3))
    cycle = ss.simulate(light, 0.6, ss.disturbed_sliding(light)).limit_cycle()
    exact = cycle.harmonics(3).amplitude.isel(dof=2).to_numpy()[1:]
    # One period without a window: what aliases falls with the square of the harmonic.
    sampled = cycle.run.spectrum("x3", begin=0.0, samples=2048, window="boxcar").amplitude.to_numpy()[1:4]
    np.testing.assert_allclose(sampled, exact, rtol=1e-3)


@pytest.mark.parametrize("kind", ["scene", "chain", "function", "law"])
def test_any_model_can_be_explored(kind):
    def block(mu=0.3, stiffness=(100.0, 1e4)):
        contact = ss.Contact(tangential=0, normal=1, friction=mu, slider_speed=0.1, name="pad")
        return ss.Scene([1.0, 1.0], np.diag(stiffness), force=[0.0, -10.0], contacts=[contact])

    models = {
        "scene": block(),
        "function": block,
        "chain": partial(
            ss.models.chain,
            [PART],
            [],
            wall_stiffness=1e6,
            friction=0.4,
            slider_speed=0.02,
        ),
        "law": ss.models.two_subsystems(
            friction=ss.friction.Stribeck(1.5, 1.2, 0.1), slider_speed=0.025, preload_displacement=1e-3
        ),
    }
    if kind == "chain":
        models["chain"] = models["chain"]()
    with ss.explore(models[kind]) as page:
        scene = json.loads(sent(page, "/scene", method="GET")[1])
        names = [knob["name"] for knob in scene["knobs"]]
        moved = {"function": "mu", "law": "friction_kinetic_0"}.get(kind, "friction")
        assert moved in names
        if kind == "function":
            assert {"stiffness_0", "slider_speed"} <= set(names)
        assert scene["bodies"]
        values = {knob["name"]: knob["value"] for knob in scene["knobs"]}
        shown = asked(page, "/motion", values=values, dof=0, patience=1.0, start={"kind": "mode"})
        assert shown["sentence"]
        verdicts = asked(
            page, "/map", values={}, x=[moved, 0.1, 0.5], y=["slider_speed", 0.01, 0.2], columns=3, rows=3
        )
        assert verdicts["error"] is None


def test_what_cannot_be_explored_is_refused():
    with pytest.raises(ss.InputError, match="the scene has no contact"):
        ss.explore(ss.Scene([1.0], [[1.0]]))
    with pytest.raises(ss.InputError, match="port: expected a number from 0 to 65535, got 70000"):
        ss.explore(port=70000)
    with pytest.raises(ss.InputError, match="expected a Scene or a function"):
        ss.explore(3)
    with ss.explore() as page, pytest.raises(OSError, match="in use"):
        ss.explore(port=int(page.url.rstrip("/").rpartition(":")[2]))
    assert repr(page) == "Explorer(closed)"


@pytest.mark.process
def test_ctrl_c_ends_the_command(tmp_path):
    command = [sys.executable, "-c", "from stickslip.cli import main; main()", "explore", "--no-browser"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    ) as run:
        line = run.stdout.readline()
        assert line.startswith("http://127.0.0.1:")
        assert line.rstrip().endswith("(Ctrl-C ends it)")
        run.send_signal(signal.SIGINT)
        _, told = run.communicate(timeout=30)
    assert run.returncode == 130
    assert "Traceback" not in told


def forced_joint():
    """Return a mass on a joint: friction under a given normal force, and a harmonic load."""
    joint = ss.Contact(
        tangential="x", friction=0.3, normal_force=100.0, tangential_stiffness=2e4, name="joint"
    )
    shaker = ss.Harmonic({"x": 60.0}, 20.0, name="shaker")
    return ss.Scene([1.0], [[1e4]], [[5.0]], [0.0], contacts=[joint], dofs=["x"], loads=[shaker])


def test_a_forced_joint_is_shown_without_modes():
    scene = forced_joint()
    with ss.explore(scene) as page:
        shown = asked(page, "/motion", values={}, dof=0, patience=5.0, start={"kind": "mode"})
        assert shown["error"] is None
        assert shown["modes"] is None
        assert shown["sentence"].startswith(
            "There is no steady sliding: contact 0: slider_speed is 0, so steady sliding has no direction"
        )
        assert shown["cycle"]["frequency"] == pytest.approx(20.0)
        cycle = ss.simulate(scene, 2.0, ss.State([0.0], [0.0], "s")).limit_cycle()
        assert np.ptp(unpacked(shown["motion"]["position"], 2)[:, 1]) == pytest.approx(
            float(np.ptp(cycle.run.sample(np.linspace(0.0, cycle.period, 2001)).position.to_numpy())),
            rel=1e-3,
        )
        friction = next(row for row in shown["energy"] if row["name"] == "contact joint")
        work = float(cycle.balance().contacts.work.sum())
        assert work < 0.0
        assert sum(friction["parts"].values()) == pytest.approx(1e3 * work, rel=1e-6)
        assert shown["way"]["end"] > shown["way"]["begin"]
        text = asked(page, "/text", values={}, start={"kind": "mode"})
        assert "ss.State([0.0], [0.0], 's', scene.dofs)" in text["python"]
        assert sent(page, "/figure", {"values": {}, "start": {"kind": "mode"}})[1].startswith(b"%PDF")
        assert (
            "slider_speed is 0"
            in asked(page, "/loci", values={}, x=["friction", 0.0, 3.0], count=31, critical=True)["error"]
        )


def test_a_joint_slides_both_ways_in_words():
    with ss.explore(forced_joint()) as page:
        said = asked(page, "/motion", values={}, dof=0, patience=5.0, start={"kind": "mode"})["sentence"]
    cycle = ss.simulate(forced_joint(), 2.0, ss.State([0.0], [0.0], "s")).limit_cycle()
    share = 100.0 * cycle.durations[[name == "+" for name in cycle.combinations]].sum() / cycle.period
    assert f"slides forwards {share:.0f} % and slides backwards {share:.0f} %" in said


@pytest.mark.parametrize("speed", [0.1, -0.1])
def test_steady_sliding_is_not_called_backwards(speed):
    belt = ss.Contact(
        tangential="x", friction=0.2, static_friction=0.4, normal_force=10.0, slider_speed=speed
    )
    scene = ss.Scene([1.0], [[100.0]], [[0.0]], [0.0], contacts=[belt], dofs=["x"])
    with ss.explore(scene) as page:
        start = {"kind": "kick", "dof": 0, "velocity": -5.0 * speed}
        said = asked(page, "/motion", values={}, dof=0, patience=5.0, start=start)["sentence"]
    assert "contact 0 sticks " in said
    assert " and " not in said.partition("contact 0 sticks")[2]


@pytest.mark.parametrize("seconds", [5e-6, 0.5, 60.0])
def test_a_period_has_the_unit_that_suits_it(seconds):
    rate = 2.0 * np.pi / seconds
    scene = ss.Scene(
        [1.0],
        [[rate**2]],
        [[0.5 * rate]],
        [0.0],
        dofs=["x"],
        contacts=[],
        loads=[ss.Harmonic({"x": rate**2}, 1.0 / seconds)],
    )
    cycle = ss.simulate(scene, 40.0 * seconds, ss.State([0.0], [0.0], "")).limit_cycle()
    unit = {5e-6: "5 µs", 0.5: "500 ms", 60.0: "60 s"}[seconds]
    assert f"limit cycle of {unit} " in picture._told(cycle)


def test_a_given_normal_force_is_a_slider_only_where_a_contact_has_one():
    assert "normal_force" in knobs(Family(forced_joint()))
    joint_and_pad = [
        ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=0.1),
        ss.Contact(tangential=1, friction=0.3, slider_speed=0.1, normal_force=2.0),
        ss.Contact(normal=0, gap=0.1),
    ]
    scene = ss.Scene([1, 1], [[100, 20], [20, 80]], force=[0, -10], contacts=joint_and_pad)
    assert [name for name in knobs(Family(scene)) if "normal_force" in name] == ["normal_force_1"]


@pytest.mark.nightly
def test_a_band_of_a_large_scene_has_curves_and_a_map():
    mesh, band = quad_block(10, 6, 2, sparse=True), (38e3, 45e3)
    plane = {"x": ["friction", 0.0, 0.5], "y": ["stiffness", 0.95, 1.05], "cells": 4}
    with ss.explore(mesh, band=band) as page:
        assert json.loads(sent(page, "/scene", method="GET")[1])["band"] == list(band)
        answer = asked(page, "/curves", values={}, **plane)
        picture = motion_of(page)
        loci = asked(page, "/loci", values={}, x=["friction", 0.0, 0.5], count=5)
    assert (answer["error"], answer["whole"]) == (None, True)
    ranges = {name: tuple(ends) for name, *ends in (plane["x"], plane["y"])}
    boundary = ss.stability_boundary(mesh, ranges, band=band, cells=4)
    assert boundary.doubts == ()
    missing = dict(boundary.summary().facts)["eigenvalues missing"]
    assert f"; eigenvalues missing {missing}; counts of modes agree at 16 x 16 places." in answer["said"]
    assert len(answer["pieces"]) >= len(boundary) >= 1
    assert answer["map"]["cells"] == 16
    growth = unpacked(answer["map"]["growth"]).reshape(16, 16)
    rates = boundary.map.growth_rate.transpose("stiffness", "friction").to_numpy()
    np.testing.assert_allclose(growth, rates, rtol=1e-5, atol=1e-2)
    assert len(picture["modes"]["frequency"]) < 10
    assert ", by the modes from 38000 to 45000 Hz." in picture["sentence"]
    assert 0 < loci["branches"] < 10
    with ss.explore(mesh) as page:
        left_out = asked(page, "/curves", values={}, **plane)
    assert left_out["error"].endswith("132 dofs; they need a band of frequencies.")


def test_a_band_without_modes_says_so_and_an_ill_posed_one_is_refused():
    with ss.explore(band=(1.0, 2.0)) as page:
        sentence = motion_of(page)["sentence"]
    assert sentence == "There is nothing to show: no mode lies in the band of frequencies."
    with pytest.raises(ss.InputError, match="band: expected"):
        ss.explore(band=(2.0, 1.0))


def test_a_point_at_which_eigenvalues_are_missing_is_a_point_of_the_page():
    plane = {"friction": (0.0, 3.0), "damping": (1e-5, 2e-4)}
    boundary = ss.stability_boundary(ss.models.two_subsystems, plane)
    missing = np.full(len(boundary[0].values), np.nan)
    missing[[0, 2]] = 0.0, 1.0
    curve = dataclasses.replace(boundary[0], missing=missing)
    rest = boundary.points, boundary.map, boundary.resolution, boundary.doubts
    (point,) = incomplete(types.StabilityBoundary(boundary.parameters, [curve], *rest))
    assert (point["x"], point["y"]) == tuple(curve.values[2])
    assert point["told"].startswith("1.00 eigenvalues missing at ")
