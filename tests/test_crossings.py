"""Where two kinds of scene or result meet: each is seen by every view that exists for one of them."""

import dataclasses
import importlib
import json
import re
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import stickslip as ss
from meshed import block
from stickslip.cli import main
from stickslip.explorer import picture, server
from stickslip.explorer.sound import sound
from stickslip.motion.events import KINDS
from stickslip.show.style import UNSTABLE

frequency_response = importlib.import_module("stickslip.cycles.frequency_response")
BELT = {"friction": 0.5, "slider_speed": 0.1}


def compliant():
    """Hoffmann's two dofs on a contact spring, unstable above friction 0.546."""
    contact = ss.Contact(tangential="x", normal="y", friction=0.8, slider_speed=1.0, normal_stiffness=30.0)
    return ss.Scene(
        [1.0, 1.0], [[11.0, -5.0], [-5.0, 10.0]], force=[0, -10.0], dofs=["x", "y"], contacts=[contact]
    )


def bouncing():
    """Return a motion that opens and closes a contact spring."""
    scene = compliant()
    start = ss.steady_sliding(scene)
    return ss.simulate(scene, 20.0, ss.State(start.position + np.array([0.0, 2.0]), start.velocity, "d"))


def with_stop():
    """Return a mass on a belt beside a stop that it does not reach in steady sliding."""
    belt = ss.Contact(tangential="x", normal="y", **BELT)
    stop = ss.Contact(normal={"x": -1.0}, gap=1.0)
    return ss.Scene(
        [1.0, 1.0], [[9.0, 1.0], [1.0, 20.0]], force=[0, -5.0], dofs=["x", "y"], contacts=[belt, stop]
    )


def test_every_kind_of_event_of_the_core_is_explained():
    source = Path(__file__).parents[1] / "rust/core/src/contact/event_kind.rs"
    named = re.findall(r'EventKind::\w+ => "([^"]+)"', source.read_text())
    assert len(named) == 12
    assert set(KINDS) == set(named)


def test_a_run_with_closings_has_a_summary():
    run = bouncing()
    assert "closing" in run.events.kind
    assert KINDS["closing"] in str(run.summary())
    assert KINDS["closing"] in run.events._repr_html_()


def test_sliding_beside_a_stop_is_disturbed_within_the_speed_of_the_belt():
    scene = with_stop()
    start = ss.disturbed_sliding(scene)
    assert start.combination == "+d"
    # The mode as a velocity takes the only moving slider to half of its speed, as the docstring says.
    assert abs(start.velocity[0]) == pytest.approx(0.5 * BELT["slider_speed"], rel=1e-14)


def test_explorer_chooses_contacts_of_a_motion_under_steps():
    push = ss.Switched({"x": 0.1}, times=[0.5, 1.0], values=[0.0, 1.0, 0.0])
    scene = ss.Scene(
        [1.0, 1.0],
        np.diag([9.0, 20.0]),
        force=[0, -5.0],
        dofs=["x", "y"],
        loads=[push],
        contacts=[ss.Contact(tangential="x", normal="y", **BELT)],
    )
    run = ss.simulate(scene, 3.0, ss.disturbed_sliding(scene))
    assert -1 in run.events.contact
    assert picture._contacts(run) == [0]


def test_a_balance_closes_in_its_dataset_too():
    scene = ss.Scene([1.0, 1.0], np.diag([9.0, 20.0]), circulatory=[[0.0, 1.0], [-1.0, 0.0]], dofs=["x", "y"])
    balance = ss.simulate(scene, 3.0, ss.State([1.0, 0.0], [0.0, 0.5], "")).balance()
    data = balance.to_dataset()
    assert abs(float(data.circulatory)) > 1e-3
    works = data.contact_work + data.external + data.circulatory + data.damping + data.impact
    assert float(data.stored - works) == pytest.approx(float(data.residual), abs=1e-13 * balance.turnover)


def test_a_mode_taken_from_its_dataset_keeps_its_period_in_vtk(tmp_path):
    body = block(3, 1)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.5, gap=-1e-6)
    scene = ss.fe.assemble(body, pairs, impact_friction=True)
    modes = ss.complex_modes(scene).to_dataset()
    ends = []
    for name, given in (("all", modes), ("one", modes.isel(mode=2))):
        ss.fe.write_vtu(tmp_path / f"{name}.pvd", scene, given, **({"mode": 2} if name == "all" else {}))
        ends.append(re.findall(r'timestep="([^"]+)"', (tmp_path / f"{name}.pvd").read_text()))
    assert ends[0] == ends[1]


def test_phase_plane_of_a_scene_without_contacts_is_refused_by_name():
    run = ss.simulate(ss.Scene([1.0], [[4.0]]), 1.0, ss.State([1.0], [0.0], ""))
    with pytest.raises(ss.InputError, match="motion: a scene without contacts"):
        run.plot.phase_planes()


def spinning(speed=3.0, tie=1.0):
    """Return an undamped spinning structure of six dofs; some real parts are positive by rounding."""
    draw = np.random.default_rng(5)
    turn, root = draw.normal(size=(6, 6)), draw.normal(size=(6, 6))
    return ss.Scene(np.ones(6), root @ root.T + (5.0 + tie) * np.eye(6), gyroscopic=speed * (turn - turn.T))


def test_nothing_is_red_that_is_not_unstable():
    branches = ss.sweep(spinning, {"speed": np.linspace(1.0, 3.0, 20)})
    assert (branches.eigenvalue.real > 0.0).any()
    assert not branches.unstable.any()
    red = [
        line
        for axes in ss.plot(branches).axes
        for line in axes.lines
        if line.get_color() == UNSTABLE and np.isfinite(line.get_ydata()).any()
    ]
    assert red == []
    both = ss.sweep(spinning, {"speed": np.linspace(1.0, 3.0, 5), "tie": np.linspace(0.0, 1.0, 5)})
    # No mode is unstable, so there is no panel of their number.
    assert [axes.get_label() for axes in ss.plot(both).axes[1:]] == ["<colorbar>"]


def test_a_mode_grows_in_words_only_if_it_is_unstable():
    scene = spinning()
    modes = ss.complex_modes(scene)
    assert modes.eigenvalues.real.max() > 0.0
    assert modes.marginal.all()
    assert modes.plot.structure().get_title().endswith("Hz, neither grows nor decays")
    grows = ss.complex_modes(ss.models.two_subsystems())
    assert "grows at 49.9 1/s" in grows.described(1)
    assert "decays at 104 1/s" in grows.described(0)


def test_a_phase_of_a_cycle_is_unstable_as_its_modes_are(standard):
    cycle = ss.simulate(standard.scene, 0.6, standard.start).limit_cycle()
    told = cycle.table()
    assert told.unstable.any()
    for row in (told.isel(phase=k) for k in range(told.sizes["phase"])):
        modes = cycle.modes.get(str(row.combination.item()))
        growing = [] if modes is None else modes.select(unstable=True)
        assert row.unstable.sum() == len(growing)


def test_the_explorer_tells_its_own_defects(monkeypatch, capfd):
    def broken(_):
        raise KeyError("closing")

    monkeypatch.setitem(server.ANSWERS, "/motion", broken)
    with ss.explore() as page:
        headers = {"Content-Type": "application/json", "Origin": page.url.rstrip("/")}
        asked = urllib.request.Request(page.url + "motion", b"{}", headers)
        with pytest.raises(urllib.error.HTTPError) as answered:
            urllib.request.urlopen(asked, timeout=10)
    assert answered.value.code == 500
    assert "a defect of stickslip, please report it: KeyError" in json.load(answered.value)["error"]
    assert "KeyError: 'closing'" in capfd.readouterr().err


def test_a_contact_is_drawn_and_heard_by_its_name(standard, tmp_path):
    named = [
        dataclasses.replace(contact, name=name)
        for contact, name in zip(standard.scene.contacts, ("inner", "outer"), strict=True)
    ]
    scene = standard.scene.replace(contacts=named)
    run = ss.simulate(scene, 0.6, standard.start)
    cycle = run.limit_cycle()
    drawn = [cycle.plot(contact=contact).lines[0].get_ydata() for contact in ("outer", 1)]
    np.testing.assert_array_equal(*drawn)
    assert len(run.plot.statuses(["outer"], ax=cycle.plot()).get_yticklabels()) == 1
    assert sound(run, "outer") == sound(run, 1) != sound(run, "inner")
    for draw in (lambda: cycle.plot(contact="outr"), lambda: sound(run, "outr")):
        with pytest.raises(ss.InputError, match="contact: unknown contact 'outr'; nearest: outer"):
            draw()
    with pytest.raises(ss.InputError, match="contact: expected an index below 2, got 2"):
        cycle.plot(contact=2)
    ss.save(ss.Case(scene, {"velocity": {"x1": 1e-3}}, {"duration": 0.1}), tmp_path / "scene.toml")
    given = ["listen", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "one.wav"), "--contact"]
    assert "of contact outer" in CliRunner().invoke(main, [*given, "outer"]).stdout
    assert "unknown contact 'no'" in CliRunner().invoke(main, [*given, "no"]).stderr


def test_an_interrupted_frequency_response_keeps_its_orbits(monkeypatch):
    scene = ss.Scene(
        [1.0, 1.0],
        np.diag([100.0, 200.0]),
        damping=ss.Rayleigh(mass=1.0),
        force=[0.0, -5.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.1, slider_speed=5.0)],
        loads=[ss.Harmonic({"x1": 1.0}, frequency=1.0, name="shaker")],
    )
    whole = ss.frequency_response(scene, {"shaker_frequency": [1.0, 1.2, 1.4]})
    settled = frequency_response.settled
    left = iter([True, True])

    def interrupted(*given, **options):
        return settled(*given, **options) if next(left, False) else ([None], KeyboardInterrupt())

    monkeypatch.setattr(frequency_response, "settled", interrupted)
    with pytest.raises(ss.Interrupted, match="after 2 of 6 motions") as stopped:
        ss.frequency_response(scene, {"shaker_frequency": [1.0, 1.2, 1.4]})
    kept = stopped.value.partial
    np.testing.assert_array_equal(kept.data.frequency, [1.0, 1.2])
    np.testing.assert_array_equal(kept.data.response, whole.data.response[:2])


def test_axes_are_saved_as_the_figure_in_which_they_stand(tmp_path):
    axes = bouncing().plot()
    files = [tmp_path / "axes.png", tmp_path / "figure.png"]
    ss.save(axes, files[0])
    ss.save(axes.figure, files[1])
    assert files[0].read_bytes() == files[1].read_bytes() != b""
