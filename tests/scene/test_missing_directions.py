"""Stops, which have no tangential direction, and friction under a given normal force."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from peer_integrator import Mechanics, assert_same_motion
from random_scenes import drawn_scenes
from return_map import assert_multipliers

EPS = np.finfo(float).eps
DRAWN = drawn_scenes(
    min_friction=0.2, max_contacts=3, restitution=(0.0, 0.5), kinds=("both", "stop", "friction")
)


def dropped(**law):
    """A mass that falls onto a stop at 0."""
    return ss.Scene([2.0], [[0.0]], force=[-20.0], contacts=[ss.Contact(normal=0, **law)])


def rubbed(friction=0.5, **law):
    """A mass on a spring of 100 N/m that rubs under 10 N."""
    law = {"tangential": 0, "friction": friction, "normal_force": 10.0, **law}
    return ss.Scene([1.0], [[100.0]], contacts=[ss.Contact(**law)])


def test_a_ball_bounces_to_rest():
    """Dropped from h it strikes at t (1 + 2 e + .. + 2 e^k), t = sqrt(2 h / g); rest: t (1 + e) / (1 - e)."""
    for method in ("auto", "taylor"):
        run = ss.simulate(dropped(restitution=0.5), 4.0, ss.State([5.0], [0.0], "d"), method=method)
        assert set(run.events.kind) == {"impact", "accumulation"}
        expected = 1.0 + 2.0 * np.cumsum(np.concatenate([[0.0], 0.5 ** np.arange(1, 12)]))
        assert run.events.time[:12] == pytest.approx(expected, rel=1e-13)
        assert run.events.time[-1] == pytest.approx(3.0, rel=1e-13)
        assert run.events.combination[-1] == "+"
        rest = run.sample([3.5])
        assert float(rest.normal_force.squeeze()) == pytest.approx(20.0, rel=1e-15)
        assert float(rest.friction_force.squeeze()) == 0.0
        assert float(rest.position.squeeze()) == 0.0


def test_friction_under_a_given_force_takes_off_the_same_from_every_swing():
    """mu N / k = 0.05 m: the middle of a swing is that far away, so every turn is 0.1 m nearer."""
    scene = rubbed()
    for method in ("auto", "taylor"):
        run = ss.simulate(scene, 5.0, ss.State([0.53], [0.0], "+"), method=method)
        assert run.events.time == pytest.approx(np.pi / 10.0 * np.arange(1, 6), rel=1e-13)
        assert list(run.events.combination) == ["-", "+", "-", "+", "s"]
        turns = run.event_states()[0][:, 0]
        assert turns == pytest.approx([-0.43, 0.33, -0.23, 0.13, -0.03], rel=1e-13)
        sample = run.sample([1.0, 4.0])
        assert sample.normal_force.values[:, 0] == pytest.approx([10.0, 10.0])
        # Sticking at -0.03 m: friction holds the 3 N of the spring.
        assert sample.friction_force.values[1, 0] == pytest.approx(-3.0, rel=1e-12)


def test_modes_reduction_and_equilibrium():
    scene = rubbed(slider_speed=0.1)
    assert ss.steady_sliding(scene).combination == "+"
    assert ss.steady_sliding(scene).position == pytest.approx([0.05])
    assert ss.complex_modes(scene).eigenvalues == pytest.approx([10j])
    assert ss.equations_of(scene, "+").force_constant == pytest.approx([5.0])
    assert ss.equations_of(scene, "s").stiffness.shape == (0, 0)
    assert ss.steady_sliding(dropped(gap=0.3)).position == pytest.approx([-0.3])
    two = ss.Scene(
        [1.0, 1.0],
        np.diag([100.0, 50.0]),
        contacts=[ss.Contact(normal=0, gap=0.1), ss.Contact(normal=1, gap=-0.1)],
    )
    assert ss.steady_sliding(two).combination == "d+"
    assert ss.complex_modes(two).eigenvalues == pytest.approx([10j])
    assert ss.complex_modes(two).shapes.shape == (2, 1)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({}, "contact 0: must have a tangential or a normal direction"),
        (
            {"normal": 0, "friction": 0.3},
            "contact 0: friction: must be 0 without a tangential direction, got 0.3",
        ),
        ({"normal": 0, "static_friction": 0.3}, "static_friction: must be 0 without a tangential direction"),
        ({"normal": 0, "slider_speed": 0.3}, "slider_speed: must be 0 without a tangential direction"),
        ({"tangential": 0, "friction": 0.3}, "normal_force: must be > 0 without a normal direction, got 0"),
        ({"tangential": 0, "friction": 0.3, "normal_force": -1.0}, "normal_force: must be > 0 .* got -1"),
        ({"tangential": 0, "friction": 0.3, "normal_force": np.nan}, "normal_force: must be finite"),
        (
            {"tangential": 0, "friction": 0.3, "normal_force": 1.0, "gap": 0.1},
            "gap: must be 0 without a normal",
        ),
        (
            {"tangential": 0, "friction": 0.3, "normal_force": 1.0, "restitution": 0.1},
            "restitution: must be 0 without a normal direction",
        ),
        (
            {"tangential": 0, "normal": 1, "friction": 0.3, "normal_force": 1.0},
            "normal_force: must be 0 with a normal",
        ),
        ({"normal": [0.0, 0.0]}, "contact 0: normal: must not be zero"),
        ({"tangential": {}, "friction": 0.3, "normal_force": 1.0}, "contact 0: tangential: must not be zero"),
        ({"tangential": 0, "normal": 1}, "friction: missing"),
    ],
)
def test_what_is_refused(law, message):
    with pytest.raises(ss.InputError, match=message):
        ss.Scene([1.0, 1.0], np.eye(2), contacts=[ss.Contact(**law)])


def test_statuses_that_a_contact_cannot_have():
    for letter in "-s":
        with pytest.raises(
            ss.InputError, match=f"no tangential direction, so its status is .* got '{letter}'"
        ):
            ss.complex_modes(dropped(), letter)
    with pytest.raises(
        ss.InputError, match=r"contact 0 has no normal direction, so its status is .* got 'd'"
    ):
        ss.simulate(rubbed(), 1.0, ss.State([0.1], [0.0], "d"))
    assert set(ss.status_table(dropped()).data.combination.values) == {"+", "d"}
    assert set(ss.status_table(rubbed()).data.combination.values) == {"+", "-", "s"}


def test_numbers_for_all_contacts_go_to_those_that_they_are_about():
    scene = ss.Scene(
        np.ones(4),
        np.eye(4),
        contacts=[
            ss.Contact(tangential=0, normal=1, friction=0.1, name="pad"),
            ss.Contact(normal=2, name="stop"),
            ss.Contact(tangential=3, friction=0.2, normal_force=5.0, name="brake"),
        ],
    )
    other = scene.replace(friction=0.4, gap=0.01, normal_force=7.0, slider_speed=0.2)
    assert [c.friction for c in other.contacts] == [0.4, 0.0, 0.4]
    assert [c.gap for c in other.contacts] == [0.01, 0.01, 0.0]
    assert [c.normal_force for c in other.contacts] == [None, None, 7.0]
    assert [c.slider_speed for c in other.contacts] == [0.2, 0.0, 0.2]
    assert other.replace(normal_force_brake=8.0).contacts[2].normal_force == 8.0
    with pytest.raises(ss.InputError, match="contact 1: friction: must be 0 without a tangential direction"):
        scene.replace(friction_stop=0.1)
    with pytest.raises(ss.InputError, match="no contact of the scene takes 'normal_force'"):
        dropped().replace(normal_force=2.0)
    shown = repr(scene)
    assert "stop (none / x3)" in shown
    assert "normal force 5 N" in shown
    assert repr(scene.contacts[1]) == "Contact(normal=2, friction=0.0, name='stop')"


def test_files_and_pickles_keep_them(tmp_path):
    scene = rubbed(slider_speed=0.3)
    for one in (scene, dropped(restitution=0.3, gap=0.1)):
        ss.save(one, tmp_path / "scene.toml")
        for copy in (ss.load(tmp_path / "scene.toml").scene, pickle.loads(pickle.dumps(one))):
            assert copy.contacts[0].normal_force == one.contacts[0].normal_force
            assert (copy.contacts[0].tangential is None) == (one.contacts[0].tangential is None)
    run = ss.simulate(scene, 5.0, ss.State([0.55], [0.0], "+"))
    again = pickle.loads(pickle.dumps(run))
    assert (again.events.time == run.events.time).all()
    (tmp_path / "bad.toml").write_text(
        "[scene]\nmass = [1.0]\nstiffness = [[1.0]]\n[[scene.contact]]\ntangential = 'x1'\n"
    )
    with pytest.raises(ss.InputError, match="contact 0: friction is missing"):
        ss.load(tmp_path / "bad.toml")
    (tmp_path / "bad.toml").write_text(
        "[scene]\nmass = [1.0]\nstiffness = [[1.0]]\n[[scene.contact]]\nfriction = 0.0\n"
    )
    with pytest.raises(ss.InputError, match="contact 0: normal is missing"):
        ss.load(tmp_path / "bad.toml")


def test_a_belt_with_a_given_normal_force_is_the_one_with_a_normal_direction():
    """The same stick-slip cycle and multipliers as a mass that is pressed by its weight."""
    given = ss.Scene(
        [1.0],
        [[100.0]],
        damping=ss.Rayleigh(mass=0.05),
        contacts=[
            ss.Contact(tangential=0, friction=0.3, static_friction=0.6, slider_speed=0.1, normal_force=10.0)
        ],
    )
    pressed = ss.Scene(
        [1.0, 1.0],
        np.diag([100.0, 1e6]),
        damping=np.diag([0.05, 0.05]),
        force=[0.0, -10.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.3, static_friction=0.6, slider_speed=0.1)],
    )
    one = ss.simulate(given, 5.0, ss.State([0.0], [0.1], "s")).limit_cycle()
    other = ss.simulate(pressed, 5.0, ss.State([0.0, 0.0], [0.1, 0.0], "s")).limit_cycle()
    assert one.period == pytest.approx(other.period, rel=1e-13)
    assert one.multipliers == pytest.approx(other.multipliers, abs=1e-12)
    sliding = [phase.combination for phase in one.phases].index("+")
    assert_multipliers(one, phase=sliding)
    assert one.balance().contact == pytest.approx(other.balance().contact, rel=1e-12)


def test_parameters_sweeps_and_studies():
    scene = rubbed(slider_speed=0.3, static_friction=0.8)
    branches = ss.sweep(scene, {"friction": [0.1, 0.2, 0.3]})
    assert branches.eigenvalue.values.imag.max() == pytest.approx(10.0)
    assert branches.steady_sliding.values.all()
    answers = ss.Study(scene, {"normal_force_0": [5.0, 10.0]}, outputs=["growth_rate", "normal_force"]).run()
    assert answers.normal_force.values.squeeze().tolist() == [5.0, 10.0]


@given(DRAWN, st.data())
def test_modes_and_series_give_the_same_events(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.3, 3.0), label="strength"))
    one, other = (
        ss.simulate(drawn.scene, 0.03, start, method=method, max_events=200) for method in ("auto", "taylor")
    )
    count = min(len(one.events), len(other.events), 20)
    assert list(one.events.kind[:count]) == list(other.events.kind[:count])
    assert one.events.time[:count] == pytest.approx(other.events.time[:count], abs=1e-9)


@given(DRAWN, st.data())
def test_energy_closes(drawn, data):
    run = ss.simulate(drawn.scene, 0.03, drawn.kicked(data.draw(st.floats(0.3, 3.0))), max_events=100)
    balance = run.balance()
    stored = (
        np.abs(run.state(0.0).position)
        @ np.abs(Mechanics(drawn.scene).stiffness)
        @ np.abs(run.state(0.0).position)
    )
    assert abs(balance.residual) <= 1e-12 * balance.turnover + 40 * EPS * (1 + run.events.time.size) * stored
    mechanics = Mechanics(drawn.scene)
    for time in np.linspace(0.0, run.duration, 7):
        state = run.state(time)
        sample = run.sample([time])
        y = np.concatenate([state.position, state.velocity])
        for contact, law in enumerate(drawn.scene.contacts):
            normal, friction = mechanics.contact_force(state.combination, y, contact)
            scale = 1e-9 * (1.0 + abs(normal) + abs(friction)) + 1e-7 * np.abs(mechanics.force).max()
            assert abs(sample.normal_force.values[0, contact] - normal) <= scale
            assert abs(sample.friction_force.values[0, contact] - friction) <= scale
            if law.normal is None:
                assert sample.normal_force.values[0, contact] == pytest.approx(law.normal_force, rel=1e-15)
            elif state.combination[contact] == "d":
                gap = drawn.scene.normal_direction(contact) @ state.position + law.gap
                assert gap >= -1e-13


@given(drawn_scenes(min_friction=0.2, kinds=("stop", "friction")), st.data())
def test_against_an_independent_integrator(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.3, 3.0), label="strength"))
    # Without events the peer takes the same steps twice, and does not see what they leave.
    assert_same_motion(drawn.scene, start, 0.02, floor=1e-9)
