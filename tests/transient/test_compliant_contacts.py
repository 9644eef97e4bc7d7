"""Compliant contacts: closed forms, an independent brute-force reference, and what must hold in every run."""

from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.support.compliant_scenes import pair, rigid_pad

import stickslip as ss

ULP = np.finfo(float).eps


def block(spring: float = 0.0, **law: float) -> ss.Scene:
    """A mass of 2 kg on a spring along the slider, pressed on by 40 N through one compliant contact."""
    contact = ss.Contact(
        tangential=0, normal=1, normal_stiffness=5e4, tangential_stiffness=2e4, **{"friction": 0.5, **law}
    )
    return ss.Scene([2.0, 2.0], np.diag([spring, 0.0]), force=[0.0, -40.0], contacts=[contact])


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_elastic_stop(method: str) -> None:
    """A mass on a spring runs into a stop of finite stiffness: half a period of both springs, then free."""
    mass, spring, stop, speed = 100.0, 1e4, 1e6, 1.0
    contact = ss.Contact(tangential=1, normal=[-1.0, 0.0], friction=0.0, normal_stiffness=stop)
    scene = ss.Scene([mass, 1.0], np.diag([spring, 1.0]), contacts=[contact])
    run = ss.simulate(scene, 0.4, ss.State([0.0, 0.0], [speed, 0.0], "+"), method=method)
    rate = np.sqrt((spring + stop) / mass)
    assert list(run.events.kind[:2]) == ["release", "closing"]
    np.testing.assert_allclose(run.events.time[0], np.pi / rate, rtol=1e-13)
    np.testing.assert_allclose(run.events.time[1], np.pi / rate + np.pi * np.sqrt(mass / spring), rtol=1e-13)
    largest = run.sample([0.5 * np.pi / rate]).normal_force.item()
    np.testing.assert_allclose(largest, stop * speed / rate, rtol=1e-13)
    assert abs(run.balance().residual) <= 1e-14 * mass * speed**2


def test_jenkins_element() -> None:
    """Pulled to and fro by its slider, a held mass sees T = kt times the drift until it slips at mu N."""
    friction, stiffness, normal_force = 0.5, 2e4, 40.0
    scene = block(slider_speed=1e-3)
    held = ss.State([0.0, -normal_force / 5e4], [0.0, 0.0], "s")
    # A heavy mass stands still; what it sees is the element alone.
    heavy = ss.Scene([2e13, 2e13], np.zeros((2, 2)), force=[0.0, -normal_force], contacts=scene.contacts)
    slip = friction * normal_force / (stiffness * 1e-3)
    run = ss.simulate(heavy, 2.0 * slip, held)
    assert list(run.events.kind) == ["slip+"]
    np.testing.assert_allclose(run.events.time, [slip], rtol=1e-7)
    half = run.sample([0.5 * slip, 1.5 * slip]).friction_force.values.ravel()
    np.testing.assert_allclose(half, [0.5 * friction * normal_force, friction * normal_force], rtol=1e-7)
    # Back again: the loop of the element is 4 mu N (a - mu N / kt), here its half in one turn.
    back = heavy.replace(slider_speed=-1e-3)
    turned = run.state(run.duration)
    start = ss.State(turned.position, turned.velocity, "s", friction_force=[friction * normal_force])
    loop = ss.simulate(back, 4.0 * slip, start)
    assert list(loop.events.kind) == ["slip-"]
    np.testing.assert_allclose(loop.events.time, [2.0 * slip], rtol=1e-7)


@pytest.mark.parametrize("method", ["modal", "taylor"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_node_at_its_limit_on_a_body_that_sticks(method: str, side: float) -> None:
    """Friction holds a body, and a node on it that has its largest force on one side or on the other.

    The spring of the body is stretched until both forces are overcome. Stretched further, the node slips with
    its body in the same instant; else it sticks, and slips once its own spring is stretched the other way.
    """
    spring, speed, given, rubbed, limit = 1e4, 0.01, 20.0, 8.0, 3.0
    contacts = [
        ss.Contact(tangential=0, friction=force / given, normal_force=given, slider_speed=speed, **spring_of)
        for force, spring_of in ((rubbed, {}), (limit, {"tangential_stiffness": 5e3}))
    ]
    scene = ss.Scene([1.0], [[spring]], contacts=contacts)
    start = ss.State([0.0], [speed], "ss", friction_force=[0.0, side * limit])
    run = ss.simulate(scene, 0.3, start, method=method)
    onset = (rubbed + side * limit) / (spring * speed)
    np.testing.assert_allclose(run.events.time[0], onset, rtol=1e-13)
    together = int(np.sum(run.events.time == run.events.time[0]))
    if side > 0.0:
        assert list(run.events.kind[:2]) == ["slip+", "slip+"]
        assert together == 2
    else:
        assert list(run.events.kind[:1]) == ["slip+"]
        assert together == 1
        second = next(k for k in range(len(run.events)) if run.events.contact[k] == 1)
        assert run.events.kind[second] == "slip+"
        moved = run.state(run.events.time[second]).position[0] - run.state(onset).position[0]
        drift = speed * (run.events.time[second] - onset) - moved
        np.testing.assert_allclose(drift, 2.0 * limit / 5e3, rtol=1e-11)


@pytest.mark.parametrize("excess", [1.0, 1.4])
@pytest.mark.parametrize("ratio", [0.999, 1.001])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_closing_sticks_within_the_cone_of_the_rates(excess: float, ratio: float, sign: float) -> None:
    """A node that closes sticks if `|kt (v - x')| <= mu_static kn |y'|`, and else slides."""
    scene = block(static_friction=0.5 * excess)
    fall = 0.3
    slip = sign * ratio * 0.5 * excess * 5e4 * fall / 2e4
    state = ss.State([0.0, 1e-9], [slip, -fall], "d")
    run = ss.simulate(scene, 1e-6, state)
    assert list(run.events.kind) == ["closing"]
    expected = "s" if ratio < 1.0 else "+" if slip < 0.0 else "-"
    assert list(run.events.combination) == [expected]


@pytest.mark.parametrize("method", ["modal", "taylor"])
@pytest.mark.parametrize("amplitude", np.linspace(5e3, 6e3, 21))
def test_a_slip_that_slows_down_fast_ends_once(amplitude: float, method: Literal["modal", "taylor"]) -> None:
    """At the end of half a period the slip velocity changes by 2e-10 m/s in an ulp of time."""
    node = ss.Contact(
        tangential=0, normal_force=1.0, friction=0.3, tangential_stiffness=1e6, slider_speed=1e-3
    )
    scene = ss.Scene([1.0], [[1e4]], contacts=[node])
    run = ss.simulate(scene, 0.04, ss.State([amplitude], [0.0], "+"), method=method)
    assert list(run.events.kind) == ["velocity", "slip-"]
    assert list(run.events.combination) == ["s", "-"]
    assert run.events.time[0] == pytest.approx(0.01 * np.pi, abs=1e-9)


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_a_node_at_its_limit_slips_with_its_body(method: Literal["modal", "taylor"]) -> None:
    """Of a body that slips forward eight times while its slider goes 20 m: places are rounded by 1e-15 m."""
    contacts = [
        ss.Contact(tangential=0, normal=1, friction=0.5, static_friction=0.8, slider_speed=10.0),
        ss.Contact(
            tangential=0, normal_force=1.0, friction=0.3, tangential_stiffness=2.8e5, slider_speed=10.0
        ),
    ]
    push = ss.Harmonic({0: 5.0}, frequency=5.0)
    scene = ss.Scene([1.0, 1.0], np.diag([1e-3, 1e4]), force=[4.5, -10.0], contacts=contacts, loads=[push])
    run = ss.simulate(scene, 2.0, ss.State([0.0, 0.0], [10.5, 0.0], "--"), method=method)
    assert list(run.events.kind[:4]) == ["velocity", "velocity", "slip-", "slip-"]
    assert len(run.events) == 32
    begin = run.events.time[run.events.kind == "slip-"]
    assert np.array_equal(begin[0::2], begin[1::2])


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_a_node_sticks_while_its_body_slips_from_another_slider(method: Literal["auto", "taylor"]) -> None:
    """An impact takes a body to the velocity of one slider, 0.02 m/s ahead of that of its node.

    The friction of 20 N does not hold the body against 40 N and the 10 N of the node, which is left behind as
    ``d'' = -10 - 1e6 d`` and is at its limit again when ``tan(500 t) = 2``.
    """
    contacts = [
        ss.Contact(tangential=0, normal=1, friction=2.0, slider_speed=-0.02),
        ss.Contact(
            tangential=0, normal_force=10.0, friction=1.0, tangential_stiffness=1e6, slider_speed=-0.04
        ),
    ]
    scene = ss.Scene(
        [1.0, 1.0], np.zeros((2, 2)), force=[-40.0, -10.0], contacts=contacts, impact_friction=True
    )
    run = ss.simulate(scene, 0.01, ss.State([0.0, 1e-3], [-0.2, -0.5], "d+"), method=method)
    assert sorted(run.events.kind[:2]) == ["impact", "velocity"]
    assert list(run.events.combination) == ["+s", "+s", "++"]
    assert np.diff(run.events.time) == pytest.approx([0.0, np.arctan(2.0) / 500.0], abs=1e-12)


@pytest.mark.parametrize("letter", ["+", "-"])
def test_a_node_without_friction_stays_out_of_the_slip_of_its_body(letter: str) -> None:
    """A load of 5 N at 5 Hz moves a body that friction of 3 N holds."""
    law = {"tangential": 0, "normal_force": 1.0, "slider_speed": 0.02}
    contacts = [ss.Contact(friction=0.0, tangential_stiffness=1e6, **law), ss.Contact(friction=3.0, **law)]
    load = ss.Harmonic({0: 5.0}, frequency=5.0, phase=-1.5)
    scene = ss.Scene([1.0], [[1.0]], contacts=contacts, loads=[load])
    run = ss.simulate(scene, 1.0, ss.State([0.0], [0.02], letter + "s"))
    assert len(run.events) > 10
    assert {combination[0] for combination in run.events.combination} == {letter}


def test_jump_of_static_friction() -> None:
    """At the onset the node jumps by (mu_static - mu) N / kt, which turns `mean T` times that into heat."""
    friction, static, stiffness = 0.5, 0.8, 2e4
    scene = block(spring=1e6, slider_speed=0.1, static_friction=static)
    start = ss.State([0.0, -40.0 / 5e4], [0.0, 0.0], "s")
    run = ss.simulate(scene, 1.0, start, max_events=1)
    assert list(run.events.kind) == ["jump"]
    assert list(run.events.combination) == ["+"]
    before, after = (
        run.sample([time]).friction_force.item() for time in (np.nextafter(run.duration, 0.0), run.duration)
    )
    np.testing.assert_allclose([before, after], [static * 40.0, friction * 40.0], rtol=1e-12)
    lost = 0.5 * (before + after) * (before - after) / stiffness
    balance = run.balance()
    np.testing.assert_allclose(balance.impact, lost, rtol=1e-11)
    assert abs(balance.residual) <= 1e-14 * abs(balance.external + balance.contact)


@pytest.mark.parametrize(
    ("seed", "points", "static"), [(1, 2, False), (4, 2, True), (0, 3, False), (1, 3, True)]
)
def test_rigid_pad_against_brute_force(seed: int, points: int, static: bool) -> None:
    """A rigid pad on several points meets the reference, whose statuses are tried one by one."""
    scene, reference, start = rigid_pad(seed, points, static=static)
    directions = [np.asarray(contact.tangential) for contact in scene.contacts]
    places = [float(direction @ start.position) for direction in directions]
    duration = 0.03
    end = reference.run([*start.position, *start.velocity], start.combination, duration, places)
    run = ss.simulate(scene, duration, start)
    assert [combination for _, _, combination in reference.events] == list(run.events.combination)
    np.testing.assert_allclose(run.events.time, [event[0] for event in reference.events], atol=1e-10)
    last = run.state(duration)
    np.testing.assert_allclose([*last.position, *last.velocity], end, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), points=st.integers(1, 3), static=st.booleans())
def test_random_pads(seed: int, points: int, static: bool) -> None:
    """Energy closes to rounding, modes and series agree, and no force or gap has the wrong sign."""
    scene, _, start = rigid_pad(seed, points, static=static)
    runs = [ss.simulate(scene, 0.04, start, method=method) for method in ("modal", "taylor")]
    modal, taylor = runs
    assert list(modal.events.kind) == list(taylor.events.kind)
    assert list(modal.events.combination) == list(taylor.events.combination)
    np.testing.assert_allclose(modal.events.time, taylor.events.time, atol=1e-13)
    assert "impact" not in modal.events.kind
    for run in runs:
        balance = run.balance()
        terms = abs(balance.contact) + abs(balance.external) + abs(balance.damping) + abs(balance.impact)
        assert abs(balance.residual) <= 200.0 * ULP * terms
        assert balance.impact >= -ULP * terms
    sample = modal.sample(np.linspace(0.0, modal.duration, 1001))
    normal, friction = sample.normal_force.values, sample.friction_force.values
    scale = normal.max() + 1.0
    assert normal.min() >= -1e-10 * scale
    static_friction = np.array([contact.static_friction for contact in scene.contacts])
    assert np.all(np.abs(friction) <= static_friction * normal + 1e-10 * scale)
    gaps = np.stack(
        [sample.position.values @ np.asarray(contact.normal) for contact in scene.contacts], axis=1
    )
    opened = sample.status.values == "d"
    assert np.all(gaps[opened] >= -1e-12)
    assert np.all(normal[opened] == 0.0)
    stiffness = np.array([contact.normal_stiffness for contact in scene.contacts])
    np.testing.assert_allclose(normal, np.where(opened, 0.0, -gaps * stiffness), atol=1e-9 * scale)


def test_run_goes_on_from_any_of_its_states() -> None:
    """A state keeps what sticking contacts hold, so that a run from it is the rest of the motion."""
    scene, _, start = rigid_pad(3, 3, static=False)
    run = ss.simulate(scene, 0.03, start)
    for time in (*run.events.time[::4], 0.004, 0.011):
        rest = ss.simulate(scene, 0.03 - time, run.state(time))
        assert list(rest.events.combination) == list(run.events.combination[run.events.time > time])
        end, again = run.state(0.03), rest.state(rest.duration)
        np.testing.assert_allclose(again.position, end.position, atol=1e-13)
        np.testing.assert_allclose(again.velocity, end.velocity, atol=1e-10)


def test_kept_and_slipping_mass_mix_with_rigid_contacts() -> None:
    """Contacts with and without mass, and one whose normal alone is compliant, in one scene."""
    rng = np.random.default_rng(5)
    springs = rng.uniform(-1.0, 1.0, (6, 6))
    stiffness = 2e3 * (springs @ springs.T) + np.diag([2e4, 4e4, 2e4, 4e4, 2e4, 4e4])
    law = {"friction": 0.4, "slider_speed": 0.1}
    contacts = [
        ss.Contact(tangential=0, normal=1, restitution=0.5, **law),
        ss.Contact(tangential=2, normal=3, normal_stiffness=1e5, **law),
        ss.Contact(tangential=4, normal=5, normal_stiffness=1e5, tangential_stiffness=5e4, **law),
    ]
    damping = ss.Rayleigh(stiffness=1e-5)
    force = [0.0, -50.0] * 3
    scene = ss.Scene(np.ones(6), stiffness, damping=damping, force=force, contacts=contacts)
    start = ss.steady_sliding(scene).perturbed(velocity={"x2": 0.8, "x4": 0.7, "x6": 0.9})
    start = ss.State(start.position, start.velocity, "d++")
    modal, taylor = (ss.simulate(scene, 0.2, start, method=method) for method in ("modal", "taylor"))
    assert {"impact", "closing", "release"} <= set(modal.events.kind)
    assert list(modal.events.kind) == list(taylor.events.kind)
    np.testing.assert_allclose(modal.events.time, taylor.events.time, atol=1e-11)
    balance = modal.balance()
    assert abs(balance.residual) <= 1e-13 * abs(balance.external)


def test_modes_of_steady_sliding() -> None:
    """In steady sliding a node follows at once: T = mu kn (y), the mass-spring matrix with that one entry."""
    scene, _ = pair(
        [1.0, 2.0],
        np.zeros((2, 2)),
        [[3e4, 1e3], [1e3, 2e4]],
        [0.0, -50.0],
        [{"t": [1.0, 0.0], "n": [0.0, 1.0], "kn": 4e4, "kt": 1e4, "friction": 0.6, "speed": 0.1}],
    )
    matrix = np.array([[3e4, 1e3 + 0.6 * 4e4], [1e3 / 2.0, 6e4 / 2.0]])
    expected = np.sqrt(np.linalg.eigvals(matrix).astype(complex))
    found = ss.complex_modes(scene, "+").eigenvalues
    np.testing.assert_allclose(
        np.sort(np.unique(np.abs(found.imag).round(9))), np.sort(expected.real), rtol=1e-9
    )
    equilibrium = ss.steady_sliding(scene)
    forces = equilibrium.contact_forces(scene)
    np.testing.assert_allclose(forces.normal_force, -4e4 * equilibrium.position[1])
    np.testing.assert_allclose(forces.friction_force, 0.6 * forces.normal_force)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"normal_stiffness": 0.0}, "normal_stiffness: must be > 0"),
        ({"tangential_stiffness": 1e4}, "needs normal_stiffness"),
        ({"normal_stiffness": 1e4, "restitution": 0.5}, "nothing bounces"),
    ],
)
def test_contacts_that_are_refused(given: dict[str, float], message: str) -> None:
    contact = ss.Contact(tangential=0, normal=1, friction=0.5, **given)
    with pytest.raises(ss.InputError, match=message):
        ss.Scene([1.0, 1.0], np.eye(2), contacts=[contact])
