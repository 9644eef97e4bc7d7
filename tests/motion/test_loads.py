"""Loads in time: closed forms, both methods, energy, switched loads, names, files and mistakes."""

import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from forced_scenes import scene_of

EPS = 2.0**-52


def oscillator(rate=7.0, frequency=1.7, phase=0.0):
    """A mass of 1 kg on a spring, without damping, under 2 N."""
    load = ss.Harmonic({"x1": 2.0}, frequency=frequency, phase=phase)
    return ss.Scene([1.0], [[rate**2]], loads=[load])


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_resonance_grows_as_its_closed_form(method):
    """``x = a t sin(w t) / (2 w)``: modes cannot be told apart there, and series take over."""
    frequency, duration = 1.25, 16.0
    rate = 2.0 * np.pi * frequency
    scene = oscillator(rate, frequency)
    run = ss.simulate(scene, duration, ss.State([0.0], [0.0], ""), method=method)
    times = np.linspace(0.0, duration, 501)
    exact = times * np.sin(rate * times) / rate
    found = run.sample(times).position.to_numpy()[:, 0]
    # 20 periods: rate times time is rounded to some ulp of 126.
    assert np.abs(found - exact).max() <= 1e-13 * duration / rate
    assert run.counters["taylor_phases"] == 1


def test_modes_refuse_resonance_by_name():
    scene = oscillator(2.0 * np.pi * 1.25, 1.25)
    with pytest.raises(ss.InputError, match="taylor"):
        ss.simulate(scene, 1.0, ss.State([0.0], [0.0], ""), method="modal")


@pytest.mark.parametrize("method", ["modal", "taylor"])
@pytest.mark.parametrize("phase", [0.0, 0.7, -2.0])
def test_a_load_off_resonance_has_its_closed_form(method, phase):
    rate, frequency, duration = 7.0, 1.7, 10.0
    run = ss.simulate(oscillator(rate, frequency, phase), duration, ss.State([0.0], [0.0], ""), method=method)
    drive = 2.0 * np.pi * frequency
    times = np.linspace(0.0, duration, 301)
    answer = 2.0 / (rate**2 - drive**2)
    exact = answer * (
        np.cos(drive * times + phase)
        - np.cos(phase) * np.cos(rate * times)
        + drive / rate * np.sin(phase) * np.sin(rate * times)
    )
    # The argument of the cosine is rounded too.
    rounding = 8 * EPS * drive * duration * abs(answer)
    assert np.abs(run.sample(times).position.to_numpy()[:, 0] - exact).max() <= rounding


@pytest.mark.parametrize("damping", [1e-1, 1e-3, 1e-5, 1e-9])
def test_close_to_resonance_no_digits_are_lost(damping):
    """Modes, as far as the program takes them, and series find the same motion."""
    rate = 7.0
    load = ss.Harmonic({"x1": 2.0}, frequency=rate / (2.0 * np.pi))
    scene = ss.Scene([1.0], [[rate**2]], damping=[[damping]], loads=[load])
    start = ss.State([0.0], [0.0], "")
    times = np.linspace(0.0, 12.0, 200)
    one, other = (
        ss.simulate(scene, 12.0, start, method=method).sample(times).position.to_numpy()
        for method in ("auto", "taylor")
    )
    assert np.abs(one - other).max() <= 1e-12 * np.abs(other).max()


@pytest.mark.parametrize("tie", [1e6, 1e9, 1e12])
@pytest.mark.parametrize("detuning", [0.3, 0.03, 0.01])
def test_forced_motion_beside_fast_modes_begins_where_it_was_left(tie, detuning):
    """Close to resonance the slow mode and the forced motion cancel each other, down to their errors."""
    springs = [[1.0, -1.0, 0.0], [-1.0, 1.7, -0.7], [0.0, -0.7, 0.7]]
    stiffness = tie * np.array(springs) + np.diag([4e3, 0.0, 1e3])
    scene = ss.Scene([1.0, 1.3, 0.6], stiffness, damping=ss.Rayleigh(1e-2, 1e-9))
    slowest = np.abs(ss.complex_modes(scene, "").eigenvalues).min()
    load = ss.Harmonic({"x2": 3e3}, frequency=slowest * (1.0 + detuning) / (2.0 * np.pi), phase=0.4)
    start = ss.State([1.0, 1.0, 1.0], [1.0, 2.0, -1.0], "")
    # Within this time a velocity of 2 m/s moves a mass by an ulp of its place.
    brief = 1e-16
    state = ss.simulate(scene.replace(loads=[load]), brief, start, method="modal").state(brief)
    # What cancels is larger than the motion by 1 / detuning.
    assert np.abs(state.position - start.position).max() <= 4.0 * EPS / detuning


@pytest.mark.parametrize("seed", range(8))
def test_modes_and_series_find_the_same_motion(seed):
    scene, start = scene_of(seed)
    runs = [ss.simulate(scene, 1.5, start, method=method) for method in ("modal", "taylor")]
    one, other = (run.events for run in runs)
    assert one.kind.tolist() == other.kind.tolist()
    assert {"load", "velocity"} <= set(one.kind)
    assert np.abs(one.time - other.time).max() <= 1e-12
    times = np.linspace(0.0, 1.5, 200)
    positions = [run.sample(times).position.to_numpy() for run in runs]
    assert np.abs(positions[0] - positions[1]).max() <= 1e-12 * np.abs(positions[1]).max()


@given(st.integers(0, 10**6))
def test_energy_closes_to_rounding(seed):
    scene, start = scene_of(seed)
    run = ss.simulate(scene, 1.0, start)
    balance = run.balance()
    assert abs(balance.residual) <= 1e-12 * balance.turnover
    sample = run.energy(np.linspace(0.0, 1.0, 23)[1:-1])
    flow = sample.contact_power.sum("contact") + sample.external_power - sample.damping_power
    scale = np.abs(sample.external_power).max() + np.abs(sample.contact_power).max()
    assert np.abs(sample.energy_rate - flow).max() <= 1e-11 * scale
    assert (sample.wear_power >= -1e-12 * scale).all()


def test_every_switch_is_an_event_of_no_contact():
    scene, start = scene_of(0)
    events = ss.simulate(scene, 1.0, start).events
    switched = events.kind == "load"
    assert events.time[switched].tolist() == [0.3, 0.7]
    assert events.contact[switched].tolist() == [-1, -1]
    assert events[int(np.flatnonzero(switched)[0])].name == "load"
    assert events.to_dataset().contact.to_numpy()[switched].tolist() == ["load", "load"]


def test_a_switch_breaks_what_sticks_and_opens_what_is_pressed():
    floor = ss.Contact(tangential="x", normal="y", friction=0.5)
    push = ss.Switched({"x": 1.0}, times=[1.0, 2.0], values=[0.0, 6.0, 0.0], name="push")
    pull = ss.Switched({"y": 20.0}, times=[3.0], values=[0.0, 1.0])
    scene = ss.Scene(
        [1.0, 1.0],
        np.zeros((2, 2)),
        force=[0.0, -10.0],
        contacts=[floor],
        dofs=["x", "y"],
        loads=[push, pull],
    )
    run = ss.simulate(scene, 3.5, ss.State([0.0, 0.0], [0.0, 0.0], "s"))
    # 6 N against 5 N of friction for a second: slip 0.5 m, and it stops by friction after 0.2 s.
    assert run.events.kind.tolist() == ["load", "slip-", "load", "velocity", "load", "release"]
    assert run.events.combination.tolist() == ["-", "-", "-", "s", "d", "d"]
    assert run.events.time == pytest.approx([1.0, 1.0, 2.0, 2.2, 3.0, 3.0], abs=1e-14)
    assert run.state(2.5).position[0] == pytest.approx(0.6, abs=1e-14)
    assert run.state(3.5).position[1] == pytest.approx(1.25, abs=1e-14)


def test_steady_sliding_knows_the_first_value_of_a_switched_load_alone():
    scene, _ = scene_of(0)
    still = scene.replace(loads=[], force=scene.force + 0.5 * 10.0 * np.eye(5)[2])
    assert ss.steady_sliding(scene).position == pytest.approx(ss.steady_sliding(still).position)
    assert ss.complex_modes(scene).eigenvalues.tolist() == ss.complex_modes(still).eigenvalues.tolist()


def test_a_slider_that_vibrates_is_felt_as_its_inertia():
    """A mass that sticks to it on a spring: the friction force is what that motion takes."""
    rate, amplitude, stiffness = 2.0 * np.pi * 3.0, 0.2, 40.0
    carrier = ss.Contact(
        tangential="x", normal="y", friction=10.0, slider_vibration=ss.Harmonic(amplitude, 3.0, phase=0.4)
    )
    scene = ss.Scene(
        [2.0, 1.0],
        np.diag([stiffness, 0.0]),
        damping=np.diag([0.5, 0.0]),
        force=[0.0, -10.0],
        contacts=[carrier],
        dofs=["x", "y"],
    )
    begun = amplitude * np.cos(0.4)
    run = ss.simulate(scene, 1.0, ss.State([0.0, 0.0], [begun, 0.0], "s"))
    assert len(run.events) == 0
    times = np.linspace(0.0, 1.0, 50)
    sample = run.sample(times)
    x = amplitude / rate * (np.sin(rate * times + 0.4) - np.sin(0.4))
    v = amplitude * np.cos(rate * times + 0.4)
    a = -amplitude * rate * np.sin(rate * times + 0.4)
    force = 2.0 * a + 0.5 * v + stiffness * x
    assert sample.position.to_numpy()[:, 0] == pytest.approx(x, abs=1e-15)
    assert sample.friction_force.to_numpy()[:, 0] == pytest.approx(force, abs=1e-13)


def test_uncoupled_parts_share_a_load():
    """Each part runs by itself, and a switch of both is one event."""
    floors = [
        ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=0.1),
        ss.Contact(tangential=2, normal=3, friction=0.3, slider_speed=0.1),
    ]
    loads = [
        ss.Harmonic([4.0, 0.0, -3.0, 0.0], frequency=2.0, phase=0.3),
        ss.Switched([1.0, 0.0, 1.0, 0.0], times=[0.5], values=[0.0, 2.0]),
    ]
    whole = ss.Scene(
        np.ones(4), np.diag([900.0, 4e3, 400.0, 5e3]), force=[0.0, -20.0] * 2, contacts=floors, loads=loads
    )
    run = ss.simulate(whole, 2.0, ss.State(ss.steady_sliding(whole).position, np.zeros(4), "++"))
    assert run.events.kind.tolist().count("load") == 1
    for part in (slice(0, 2), slice(2, 4)):
        law = dataclasses.replace(floors[0], tangential=0, normal=1)
        own = [
            ss.Harmonic(np.array(loads[0].amplitude)[part], 2.0, 0.3),
            ss.Switched([1.0, 0.0], times=[0.5], values=[0.0, 2.0]),
        ]
        scene = ss.Scene(
            np.ones(2), np.diag([900.0, 4e3, 400.0, 5e3][part]), force=[0.0, -20.0], contacts=[law], loads=own
        )
        alone = ss.simulate(scene, 2.0, ss.State(ss.steady_sliding(scene).position, np.zeros(2), "+"))
        times = np.linspace(0.0, 2.0, 101)
        together = run.sample(times).position.to_numpy()[:, part]
        assert np.abs(together - alone.sample(times).position.to_numpy()).max() <= 1e-14


def test_a_motion_comes_back_from_its_pickle():
    scene, start = scene_of(1)
    run = ss.simulate(scene, 1.0, start)
    again = pickle.loads(pickle.dumps(run))
    times = np.linspace(0.0, 1.0, 50)
    assert again.sample(times).equals(run.sample(times))
    assert again.events.kind.tolist() == run.events.kind.tolist()


def test_numbers_of_loads_are_parameters():
    scene, _ = scene_of(0)
    changed = scene.replace(
        shaker_frequency=3.0,
        load_0_phase=0.5,
        slider_vibration_0_amplitude=0.7,
        load_2_amplitude=4.0,
        friction=0.2,
    )
    assert changed.loads[1].frequency == 3.0
    assert changed.loads[0].phase == 0.5
    assert changed.loads[2].amplitude == {"x3": 4.0}
    assert changed.contacts[0].slider_vibration.amplitude == 0.7
    assert changed.contacts[0].friction == 0.2
    assert scene.replace(shaker_amplitude=5.0).loads[1].amplitude == (0.0, 5.0, 0.0, 0.0, 0.0)
    with pytest.raises(ss.InputError, match="load_0_amplitude: the load acts on 2 dofs"):
        scene.replace(load_0_amplitude=1.0)
    with pytest.raises(ss.InputError, match="shaker_speed"):
        scene.replace(shaker_speed=1.0)


def test_a_scene_file_keeps_its_loads(tmp_path):
    scene, start = scene_of(0)
    ss.save(scene, tmp_path / "scene.toml")
    again = ss.load(tmp_path / "scene.toml").scene
    assert [type(load) for load in again.loads] == [type(load) for load in scene.loads]
    assert again.contacts[0].slider_vibration == scene.contacts[0].slider_vibration
    runs = [ss.simulate(one, 1.0, start) for one in (scene, again)]
    assert runs[0].events.time.tolist() == runs[1].events.time.tolist()


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (ss.Harmonic({"x1": 1.0}, frequency=0.0), "load_0: frequency: must be positive"),
        (ss.Harmonic({"x1": 1.0}, frequency=1.0, phase=np.nan), "load_0: phase: must be finite"),
        (ss.Harmonic({"x9": 1.0}, frequency=1.0), "unknown dof 'x9'"),
        (ss.Harmonic(1.0, frequency=1.0), "expected forces by dof or a vector"),
        (ss.Harmonic([1.0, 2.0], frequency=1.0), r"expected shape \(1,\)"),
        (ss.Switched({"x1": 1.0}, times=[1.0], values=[1.0]), "values: expected 2, one more than times"),
        (ss.Switched({"x1": 1.0}, times=[2.0, 1.0], values=[1.0, 0.0, 1.0]), "ascending, got 1 after 2"),
        (ss.Switched({"x1": 1.0}, times=[0.0], values=[1.0, 0.0]), "positive and ascending"),
        (3.0, "expected Harmonic or Switched"),
    ],
)
def test_mistakes_are_named(load, message):
    with pytest.raises(ss.InputError, match=message):
        ss.Scene([1.0], [[1.0]], loads=[load])


def test_two_loads_of_one_name_are_refused():
    loads = [ss.Harmonic({"x1": 1.0}, 1.0, name="a"), ss.Harmonic({"x1": 1.0}, 2.0, name="a")]
    with pytest.raises(ss.InputError, match="'a' names more than one load"):
        ss.Scene([1.0], [[1.0]], loads=loads)


def test_studies_of_other_loads_are_other_studies():
    scene, _ = scene_of(0)
    others = [scene, scene.replace(load_0_phase=0.1), scene.replace(slider_vibration_0_phase=0.1)]
    others.append(scene.replace(loads=scene.loads[:2]))
    studies = [ss.Study(one, {"friction": [0.1, 0.2]}, outputs=["growth_rate"]).identity for one in others]
    assert all(a != b for k, a in enumerate(studies) for b in studies[:k])
