"""Motions with springs and dampers beside closed forms, scipy and other people's numbers."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

import stickslip as ss
from element_peer import Peer


def free(law, offset=0.0, mass=1.0, stiffness=0.0, **changes):
    """Return a mass on one spring."""
    springs = [ss.Spring("x", law, offset, name="spring")]
    return ss.Scene([mass], [[stiffness]], dofs=["x"], elements=springs, **changes)


def end_of(run):
    sample = run.sample([run.duration])
    return np.concatenate([sample.position.to_numpy()[0], sample.velocity.to_numpy()[0]])


@pytest.mark.parametrize(("g", "a"), [(1.0, 1.0), (0.1, 2.0), (0.5, 1.0), (1e4, 0.3)])
def test_a_free_duffing_oscillator_has_its_period(g, a):
    # T = 4 K(m) / sqrt(1 + g A^2) with m = g A^2 / (2 (1 + g A^2)).
    hardening = g * a**2
    period = 4.0 * ellipk(hardening / (2.0 * (1.0 + hardening))) / np.sqrt(1.0 + hardening)
    start = ss.State(position=[a], velocity=[0.0], combination="")
    run = ss.simulate(free(ss.spring.Polynomial(1.0, 0.0, g)), period, start)
    fastest = a * np.sqrt(1.0 + hardening)
    np.testing.assert_allclose(end_of(run), [a, 0.0], atol=1e-13 * max(a, fastest**2))
    assert abs(run.balance().residual) < 1e-13 * (0.5 * a**2 + 0.25 * g * a**4)


def test_published_periods_of_duffing_oscillators():
    for g, a, period in ((1.0, 1.0, 4.7680220291024608), (0.1, 2.0, 5.5168518881042943)):
        start = ss.State(position=[a], velocity=[0.0], combination="")
        run = ss.simulate(free(ss.spring.Law(lambda u, g=g: u + g * u**3)), period, start)
        np.testing.assert_allclose(end_of(run), [a, 0.0], atol=4e-14)


def test_a_mass_on_an_elastic_stop_has_its_period():
    # Code_Aster, sdnd122a: m = 1, k = 10, a stop of 50 N/m at 0.01 m, energy 0.00650108331626 J.
    k, stop, gap, energy = 10.0, 50.0, 0.01, 0.00650108331626
    amplitude, stiff = np.sqrt(2.0 * energy / k), np.sqrt(k + stop)
    middle = stop * gap / (k + stop)
    at_stop = np.sqrt(2.0 * energy - k * gap**2)
    period = (2.0 * np.pi - 2.0 * np.arccos(gap / amplitude)) / np.sqrt(k)
    period += 2.0 * np.arctan2(at_stop / stiff, gap - middle) / stiff
    scene = free(ss.spring.Gap(stop, gap), stiffness=k)
    start = ss.State(position=[-amplitude], velocity=[0.0], combination="")
    run = ss.simulate(scene, period, start)
    np.testing.assert_allclose(end_of(run), [-amplitude, 0.0], atol=1e-14)
    assert abs(run.balance().residual) < 1e-15


def test_a_mass_falls_on_an_elastic_stop():
    # Code_Aster, sdnd108a: m = 1, g = 10, v = -1, a stop of 100 N/m 2 m below.
    scene = free(ss.spring.Gap(100.0, 2.0), force=[10.0])
    start = ss.State(position=[0.0], velocity=[1.0], combination="")
    run = ss.simulate(scene, 1.5, start)
    found = run.sample([1.0, 1.1]).position.to_numpy()[:, 0]
    np.testing.assert_allclose(found, [1.332162981855, 0.856394405035], atol=1e-12)


def test_springs_and_dampers_of_every_law_are_those_of_scipy():
    table = ss.spring.Tabulated([-0.1, 0.0, 0.05, 0.2], [-3.0, 0.0, 2.0, 10.0])
    gap = ss.spring.Gap(500.0, 0.02)
    mount = ss.spring.Law(lambda u, most=50.0, rate=5.0: most * np.tanh(rate * u))
    damper = ss.spring.Polynomial(0.3, 0.0, 2.0)
    scene = ss.Scene(
        [1.0, 2.0],
        [[100.0, -20.0], [-20.0, 80.0]],
        elements=[
            ss.Spring({"x1": 1.0, "x2": -1.0}, gap),
            ss.Spring("x2", table, offset=0.03),
            ss.Spring([0.5, 0.5], mount),
            ss.Damper("x1", damper),
        ],
    )

    def field(_, y):
        x, u = y[:2], y[2:]
        middle = 0.5 * mount.force(0.5 * (x[0] + x[1]))
        between, alone = gap.force(x[0] - x[1]), table.force(x[1] - 0.03)
        force = -scene.stiffness @ x - [between + middle + damper.force(u[0]), alone - between + middle]
        return np.concatenate([u, force / scene.mass])

    start = ss.State(position=[0.3, -0.1], velocity=[0.1, 0.0], combination="")
    run = ss.simulate(scene, 2.0, start)
    expected = solve_ivp(field, (0.0, 2.0), [0.3, -0.1, 0.1, 0.0], "DOP853", rtol=1e-12, atol=1e-13)
    # The steps of scipy go across the knots of table and gap.
    np.testing.assert_allclose(end_of(run), expected.y[:, -1], atol=1e-8)
    assert abs(run.balance().residual) < 1e-14 * abs(run.balance().stored)


@pytest.mark.parametrize("seed", range(8))
def test_events_beside_springs_are_those_of_scipy(seed):
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.5, 2.0, 3)
    roots = rng.normal(size=(3, 3))
    stiffness = 30.0 * roots @ roots.T + np.diag(rng.uniform(50.0, 200.0, 3))
    damping = 0.002 * stiffness + 0.1 * np.diag(mass)
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.5, 0.3, -1.0]])
    directions = directions[: rng.integers(1, 5)]
    count = len(directions)
    k1, k2, k3 = rng.uniform(0, 50, count), rng.uniform(-100, 100, count), rng.uniform(0, 3e4, count)
    force = np.array([rng.uniform(-2.0, 2.0), -rng.uniform(5.0, 12.0), rng.uniform(-3.0, 3.0)])
    friction = rng.uniform(0.2, 0.6)
    belt = ss.Contact(
        tangential=0,
        normal=1,
        friction=friction,
        static_friction=friction * rng.choice([1.0, 1.4]),
        slider_speed=0.3,
    )
    laws = [ss.spring.Polynomial(*numbers) for numbers in zip(k1, k2, k3, strict=True)]
    elements = [ss.Spring(d, law) for d, law in zip(directions, laws, strict=True)]
    scene = ss.Scene(mass, stiffness, damping, force, [belt], elements=elements)
    position = [rng.uniform(-0.05, 0.05), 0.0, rng.uniform(-0.05, 0.05)]
    velocity = [rng.uniform(-1.0, 0.2), 0.0, rng.uniform(-1.0, 1.0)]
    run = ss.simulate(scene, 1.0, ss.State(position=position, velocity=velocity, combination="+"))
    peer = Peer(
        mass,
        stiffness,
        damping,
        force,
        directions,
        lambda u: k1 * u + k2 * u**2 + k3 * u**3,
        friction,
        belt.holding,
        0.3,
    )
    events, end = peer.run([*position, *velocity], "+", 1.0)
    assert [event.kind for event in run.events] == [kind for _, kind in events]
    assert len(events) > 1
    np.testing.assert_allclose([event.time for event in run.events], [at for at, _ in events], atol=2e-12)
    np.testing.assert_allclose(end_of(run), end, atol=1e-11)
    assert abs(run.balance().residual) < 1e-13


def test_a_law_that_ends_stops_the_run_with_its_element():
    # A root has no power series where the stretch comes to zero.

    scene = free(ss.spring.Law("k * sqrt(0.1 + u)", k=10.0))
    start = ss.State(position=[0.5], velocity=[0.0], combination="")
    with pytest.raises(ss.RunError, match=r"element 0 at t = .* no finite value, slope or bound"):
        ss.simulate(scene, 5.0, start)
    with pytest.raises(ss.InputError, match="element 0 has no finite force"):
        ss.simulate(scene, 1.0, ss.State(position=[-0.2], velocity=[0.0], combination=""))


def test_a_decaying_motion_is_known_to_come_to_rest():
    belt = ss.Contact(tangential=0, normal=1, friction=0.4, slider_speed=0.5)
    scene = ss.Scene(
        [1.0, 1.0],
        [[300.0, 50.0], [50.0, 400.0]],
        ss.Rayleigh(0.5, 1e-3),
        [0.0, -20.0],
        [belt],
        elements=[ss.Spring(0, ss.spring.Polynomial(200.0, 0.0, 4e4), offset=0.01)],
    )
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": -0.3})
    with pytest.raises(ss.NotPeriodicError, match="settles to an equilibrium"):
        ss.simulate(scene, 3.0, start).limit_cycle(further=50.0)
