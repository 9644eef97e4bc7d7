"""Loads in time and vibrating sliders where contacts have no mass."""

from dataclasses import replace

import numpy as np
import pytest
from test_massless_boundary import ULP, assert_same_events, boundary
from tests.support.quasi_static import QuasiStatic

import stickslip as ss


@pytest.mark.parametrize(
    ("seed", "contacts", "static"),
    [(0, 1, False), (1, 2, False), (2, 2, True), (5, 2, False), (7, 3, False)],
)
def test_harmonic_loads_against_brute_force(seed: int, contacts: int, static: bool) -> None:
    """The load is the place of one more mass on a spring, which nothing acts back on."""
    scene, plain, start = boundary(seed, contacts, static=static)
    rng = np.random.default_rng(seed)
    inner, rate, phase = plain.m, 2.0 * np.pi * 23.0, 0.7
    size = scene.size
    amplitude = rng.uniform(-15.0, 15.0, size)
    loaded = scene.replace(loads=[ss.Harmonic(dict(enumerate(amplitude)), frequency=23.0, phase=phase)])
    with_carrier = np.insert(np.insert(plain.stiffness, inner, 0.0, 0), inner, 0.0, 1)
    with_carrier[inner, inner] = rate**2
    with_carrier[:, inner] -= np.insert(amplitude, inner, 0.0)
    damping = np.zeros((inner + 1, inner + 1))
    damping[:inner, :inner] = plain.damping
    nodes = [
        replace(node, t=np.insert(node.t, inner, 0.0), n=np.insert(node.n, inner, 0.0))
        for node in plain.nodes
    ]
    reference = QuasiStatic(
        np.append(plain.mass, 1.0), damping, with_carrier, np.insert(plain.force, inner, 0.0), nodes
    )
    duration = 0.12
    state = [*start.position[:inner], np.cos(phase), *start.velocity[:inner], -rate * np.sin(phase)]
    end = reference.run(state, start.combination, duration, [0.0] * contacts)
    for method in ("modal", "taylor"):
        run = ss.simulate(loaded, duration, start, method=method)
        assert_same_events(run, reference)
        last = run.state(duration)
        np.testing.assert_allclose(last.position[:inner], end[:inner], atol=1e-8)
        np.testing.assert_allclose(last.velocity[:inner], end[inner + 1 : -1], atol=1e-7)
        balance = run.balance()
        terms = abs(balance.contact) + abs(balance.external) + abs(balance.damping)
        assert abs(balance.residual) <= 500.0 * ULP * terms


@pytest.mark.parametrize("static", [0.3, 0.4])
def test_a_vibrating_slider_is_a_load_in_its_frame(static: float) -> None:
    """Seen from the slider, inertia, dashpot and spring to the ground load a mass on a compliant contact."""
    mass, dashpot, spring, amplitude, frequency, phase = 1.3, 2.0, 900.0, 0.08, 6.0, 0.4
    contact = ss.Contact(
        tangential=0,
        normal=1,
        friction=0.3,
        static_friction=static,
        slider_speed=0.05,
        normal_stiffness=3e4,
        tangential_stiffness=8e3,
    )
    base = ss.Scene(
        [mass, mass],
        np.diag([spring, 100.0]),
        damping=np.diag([dashpot, 5.0]),
        force=[0.0, -12.0],
        contacts=[contact],
    )
    shaken = base.replace(
        contacts=[replace(contact, slider_vibration=ss.Harmonic(amplitude, frequency, phase))]
    )
    rate = 2.0 * np.pi * frequency
    # y = a / w sin(w t + p): the loads -(k - m w^2) y and -c y'.
    place = amplitude / rate
    loaded = base.replace(
        loads=[
            ss.Harmonic({0: -(spring - mass * rate**2) * place}, frequency, phase - np.pi / 2),
            ss.Harmonic({0: -dashpot * amplitude}, frequency, phase),
        ]
    )
    down = -12.0 / (100.0 + 3e4)
    start = ss.State([0.002, down], [0.01, 0.0], "s", friction_force=[0.5])
    moved = np.array([place * np.sin(phase), 0.0]), np.array([amplitude * np.cos(phase), 0.0])
    for method in ("modal", "taylor"):
        one = ss.simulate(
            shaken,
            1.0,
            ss.State(start.position + moved[0], start.velocity + moved[1], "s", friction_force=[0.5]),
            method=method,
        )
        other = ss.simulate(loaded, 1.0, start, method=method)
        assert len(one.events) > 10
        assert list(one.events.kind) == list(other.events.kind)
        np.testing.assert_allclose(one.events.time, other.events.time, atol=1e-11)
        times = np.linspace(0.0, 1.0, 97)
        np.testing.assert_allclose(
            one.sample(times).friction_force, other.sample(times).friction_force, atol=1e-9
        )
        for run in (one, other):
            balance = run.balance()
            assert abs(balance.residual) <= 500.0 * ULP * balance.turnover


def test_a_switched_load_moves_a_dof_without_mass_at_once() -> None:
    """A node on a spring k goes where ``k x = F -+ mu N``, and holds while ``|F - k x| <= mu N``."""
    k, mu, pressed = 2e4, 0.4, 50.0
    forces = [0.0, 30.0, 10.0, -8.0, 45.0, 0.0]
    times = [0.01, 0.02, 0.03, 0.04, 0.05]
    scene = ss.Scene(
        [1.0, 0.0, 0.0],
        np.diag([1e4, k, 1e5]),
        force=[0.0, 0.0, -pressed],
        contacts=[ss.Contact(tangential=1, normal=2, friction=mu)],
        loads=[ss.Switched({1: 1.0}, times=times, values=forces)],
    )
    start = ss.State([1e-4, 0.0, 0.0], np.zeros(3), "s")
    run = ss.simulate(scene, 0.06, start)
    place = 0.0
    for begin, force in zip([0.0, *times], forces, strict=True):
        place = np.clip(place, (force - mu * pressed) / k, (force + mu * pressed) / k)
        state = run.state(begin + 0.005)
        assert state.position[1] == pytest.approx(place, abs=1e-18)
        assert float(run.sample([begin + 0.005]).friction_force.squeeze()) == pytest.approx(
            k * place - force, abs=1e-10
        )
    assert (run.events.kind == "load").sum() == 5
    balance = run.balance()
    assert abs(balance.residual) <= 100.0 * ULP * balance.turnover
    assert balance.impact > 0.0
