"""Motions under friction over slip speed, against 45 digits, an integrator, and their own energy."""

import numpy as np
import pytest
from mpmath import mpf
from scipy.integrate import solve_ivp

import stickslip as ss
from friction_peer import Peer
from fuzz_laws import beside_a_faster_mass
from fuzz_scenes import fuzz_scene
from stickslip.scene.laws.friction import FrictionLaw, Linear, Rational, Stribeck, Tabulated

TABLE = Tabulated([0.0, 0.05, 0.1, 0.2, 0.4], [0.5, 0.4, 0.35, 0.3, 0.29])
LAWS = [Stribeck(0.5, 0.3, 0.1), Stribeck(0.5, 0.3, 0.1, 0.1), Rational(0.5, 0.3, 0.1), Linear(0.4, -0.3)]


def block(law: FrictionLaw | float, damping: float = 0.7) -> tuple[ss.Scene, ss.State]:
    """Return a block on a belt under a given normal force, and a start that grows."""
    contact = ss.Contact(tangential=0, normal_force=10.0, friction=law, slider_speed=0.2)
    scene = ss.Scene([1.0], [[100.0]], damping=[[damping]], contacts=[contact])
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})


def stop_and_friction() -> tuple[ss.Scene, ss.State]:
    """Return Modelica.Mechanics.Translational.Examples.Friction with stops, all on one dof."""
    # v + sign(v) (3 + 5 exp(-2 |v|)) N, static 8 N
    law = Stribeck(8.0, 3.0, 0.5, viscous=1.0)
    contacts = [
        ss.Contact(tangential="x1", normal_force=1.0, friction=law),
        ss.Contact(normal={"x1": 1.0}, gap=0.4),
        ss.Contact(normal={"x1": -1.0}, gap=0.4),
    ]
    scene = ss.Scene([1.0], [[500.0]], force=[-125.0], contacts=contacts, dofs=["x1"])
    return scene, ss.State([0.0], [-5.0], "+dd", dofs=scene.dofs)


def two_subsystems(law: FrictionLaw | list[FrictionLaw]) -> tuple[ss.Scene, ss.State]:
    """Return the reference model under a law at both contacts, or one at each."""
    scene = ss.models.two_subsystems(friction=law, slider_speed=0.025, preload_displacement=1e-3)
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})


def skew_block(law: FrictionLaw) -> ss.Scene:
    """Return a mass on an inclined normal that is not orthogonal to the direction of slip: W couples them."""
    contact = ss.Contact(tangential=[1.0, 0.0], normal=[0.3, 1.0], friction=law, slider_speed=0.3)
    stiffness = [[400.0, -60.0], [-60.0, 900.0]]
    return ss.Scene(
        [1.0, 1.5],
        stiffness,
        damping=[[0.4, 0.0], [0.0, 0.6]],
        force=[0.0, -20.0],
        contacts=[contact],
        impact_friction=True,
    )


def test_friction_and_stops_of_the_modelica_library():
    scene, start = stop_and_friction()
    run = ss.simulate(scene, 2.0, start)
    times = [0.060597095609, 0.060597095609, 0.201105952, 0.341617058]
    assert run.events.time[:4] == pytest.approx(times, abs=1e-9)
    assert run.events.time[0] == pytest.approx(times[0], abs=1e-12)
    assert run.state(np.nextafter(run.events.time[0], 0.0)).velocity[0] == pytest.approx(
        -6.10565384, abs=5e-9
    )
    places = [run.state(time).position[0] for time in run.events.time]
    assert places[:4] == pytest.approx([-0.4, -0.4, -0.12232672, -0.35661463], abs=5e-9)
    assert run.events.time[-1] == pytest.approx(1.045973749, abs=1e-9)
    assert run.events.combination[-1] == "sdd"
    assert places[-1] == pytest.approx(-0.24751399, abs=5e-9)
    # Energies of some 30 J, in 9 phases.
    assert abs(run.balance().residual) < 1e-12


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_events_of_a_block_agree_with_45_digits(law):
    compare(*block(law), events=16, until=8.0)


@pytest.mark.parametrize("law", [Stribeck(1.5, 1.2, 0.1), Rational(1.5, 1.2, 0.1)], ids=repr)
def test_events_of_two_contacts_agree_with_45_digits(law):
    compare(*two_subsystems(law), events=10, until=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("events", [20, pytest.param(100, marks=pytest.mark.nightly)])
def test_events_of_two_laws_agree_with_45_digits(events):
    laws = [Stribeck(1.5, 1.2, 0.1), Rational(1.5, 1.2, 0.1)]
    compare(*two_subsystems(laws), events=events, until=1.0)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("events", [20, 100])
def test_events_of_three_contacts_agree_with_45_digits(events):
    part = ss.models.Subsystem(
        upper_mass=0.3,
        contact_mass=0.7,
        inclination=0.3,
        vertical_stiffness=4.5e5,
        horizontal_stiffness=3e5,
        ceiling_stiffness=6e4,
        preload_displacement=1e-3,
        external_force=0.0,
    )
    link = ss.models.Link(horizontal_stiffness=1.5e6, vertical_stiffness=2.4e5)
    scene = ss.models.chain(
        [part] * 3,
        [link] * 2,
        wall_stiffness=1.8e6,
        slider_speed=0.025,
        friction=[Stribeck(1.6, 1.2, 0.1), Rational(1.5, 1.2, 0.1), 1.4],
    )
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    compare(scene, start, events=events, until=1.0)


def compare(scene: ss.Scene, start: ss.State, events: int, until: float) -> None:
    run = ss.simulate(scene, until, start, max_events=events)
    expected = Peer(scene, start).run(events, until)
    found = run.events
    assert len(expected) == events
    assert [(contact, letters) for _, contact, letters in expected] == [
        (int(contact), str(letters))
        for contact, letters in zip(found.contact, found.combination, strict=True)
    ]
    errors = [abs(float(mpf(float(t)) - time)) for t, (time, _, _) in zip(found.time, expected, strict=True)]
    assert max(errors) < 1e-13


@pytest.mark.parametrize("law", [*LAWS, TABLE], ids=repr)
def test_energy_closes(law):
    scene, start = block(law)
    run = ss.simulate(scene, 10.0, start)
    assert run.stop_reason == "duration"
    assert len(run.events.time) > 20
    balance = run.balance()
    # Works of order 1 J, over some 50 phases.
    assert abs(balance.residual) < 1e-13
    sample = run.energy(np.linspace(0.0, 10.0, 50))
    powers = sample.contact_power.sum("contact") + sample.external_power - sample.damping_power
    np.testing.assert_allclose(sample.energy_rate, powers, atol=1e-13)


@pytest.mark.parametrize("law", [*LAWS, TABLE], ids=repr)
def test_forces_follow_the_law(law):
    scene, start = block(law)
    run = ss.simulate(scene, 5.0, start)
    sample = run.sample(np.linspace(0.0, 5.0, 200))
    slip = sample.velocity.values[:, 0] - 0.2
    sliding = sample.status.values[:, 0] == "+"
    expected = [10.0 * law.coefficient(-s) for s in slip[sliding]]
    np.testing.assert_allclose(sample.friction_force.values[sliding, 0], expected, rtol=1e-12)


def test_a_table_ends_series_at_its_speeds():
    scene, start = block(TABLE)
    run = ss.simulate(scene, 1.2, start)

    def rate(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -100.0 * y[0] - 0.7 * y[1] + 10.0 * TABLE.coefficient(0.2 - y[1])]

    path = solve_ivp(rate, (0.0, 1.2), [start.position[0], 0.05], rtol=1e-12, atol=1e-14, max_step=1e-3)
    # An integrator steps over the speeds of the table, where the third derivative jumps.
    assert run.state(1.2).position[0] == pytest.approx(path.y[0, -1], abs=1e-11)


@pytest.mark.parametrize("law", [Stribeck(0.5, 0.3, 0.1), Linear(0.4, -0.3)], ids=repr)
def test_slip_that_mass_couples_with_pressure_agrees_with_an_integrator(law):
    scene = skew_block(law)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.02, "x2": -0.006})
    run = ss.simulate(scene, 3.0, start)
    mass, damping = np.diag([1.0, 1.5]), np.diag([0.4, 0.6])
    t, n, force = np.array([1.0, 0.0]), np.array([0.3, 1.0]), np.array([0.0, -20.0])

    def forces(y: np.ndarray) -> tuple[np.ndarray, float, float]:
        load = force - np.asarray(scene.stiffness) @ y[:2] - damping @ y[2:]
        mu = law.coefficient(0.3 - y[2])
        # n' M^-1 (load + (n + mu t) N) = 0
        inverse = np.linalg.inv(mass)
        pressed = -(n @ inverse @ load) / (n @ inverse @ (n + mu * t))
        return inverse @ (load + (n + mu * t) * pressed), pressed, mu

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        return np.r_[y[2:], forces(y)[0]]

    def slip(_: float, y: np.ndarray) -> float:
        return 0.3 - y[2]

    slip.terminal = True
    y0 = np.r_[start.position, start.velocity]
    path = solve_ivp(rate, (0.0, 3.0), y0, method="DOP853", rtol=1e-13, atol=1e-15, events=slip)
    end = path.t[-1]
    if path.t_events[0].size:
        assert run.events.time[0] == pytest.approx(end, abs=1e-11)
        assert run.events.kind[0] == "velocity"
    middle = 0.5 * end
    expected = solve_ivp(rate, (0.0, middle), y0, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    state = run.state(middle)
    np.testing.assert_allclose([*state.position, *state.velocity], expected, atol=1e-11)
    sample = run.sample([middle])
    assert sample.normal_force.values[0, 0] == pytest.approx(forces(expected)[1], rel=1e-9)
    assert abs(run.balance().residual) < 1e-12


def test_constant_laws_move_as_numbers_do():
    scene, start = block(Linear(0.4, 0.0), damping=0.0)
    plain = scene.replace(friction=0.4)
    found = ss.simulate(scene, 3.0, start)
    expected = ss.simulate(plain, 3.0, start)
    np.testing.assert_allclose(found.state(3.0).position, expected.state(3.0).position, atol=1e-13)


def test_a_law_that_reaches_zero_stops_the_run():
    scene, start = block(Linear(0.4, -1.0))
    with pytest.raises(ss.RunError, match="its friction reaches 0 at this slip speed") as stopped:
        ss.simulate(scene, 50.0, start)
    partial = stopped.value.partial
    end = partial.state(partial.duration if hasattr(partial, "duration") else partial.end)
    assert 0.2 - end.velocity[0] == pytest.approx(0.4, abs=1e-12)


def test_what_needs_linear_phases_is_refused():
    scene, start = block(LAWS[0])
    with pytest.raises(ss.InputError, match="method 'modal'"):
        ss.simulate(scene, 1.0, start, method="modal")


def test_impacts_rub_by_the_friction_of_their_slip_velocity():
    law = Stribeck(0.5, 0.3, 0.1)
    contact = ss.Contact(tangential=0, normal=1, friction=law, slider_speed=2.0)
    scene = ss.Scene(
        [1.0, 1.0], [1.0, 1.0] * np.eye(2), force=[0.0, -10.0], contacts=[contact], impact_friction=True
    )
    run = ss.simulate(scene, 0.2, ss.State([0.0, 0.1], [0.0, 0.0], "d"))
    before = run.state(np.nextafter(run.events.time[0], 0.0)).velocity
    after = run.state(run.events.time[0]).velocity
    # p_t = mu(|s-|) p_n
    assert after[0] - before[0] == pytest.approx(law.coefficient(2.0 - before[0]) * -before[1], rel=1e-9)


def test_a_motion_goes_on_from_where_contacts_stick_beside_others_that_slide_by_tables():
    """Where mass couples contacts, the friction of one follows from that of all at their slip speeds."""
    scene, start = fuzz_scene(22, 1935, ["tables"])
    run = ss.simulate(scene, 0.1, start, max_events=650)
    begin = np.concatenate([[0.0], run.events.time])
    places = (begin[:-1] + 0.5 * np.diff(begin))[np.diff(begin) > 0.0]
    states = [run.state(float(place)) for place in places]
    held = [state for state in states if "s" in state.combination and set(state.combination) & {"+", "-"}]
    assert len(held) > 10
    for state in held:
        ss.simulate(scene, 1e-9, state)


def test_a_root_that_a_panel_leaves_within_its_error_is_found_before_the_next_one():
    """A contact is released 1e-9 s before the end of a panel; panels of half the width have it inside."""
    scene, start = fuzz_scene(32, 2145, ["tables"])
    run = ss.simulate(scene, 0.1, start, max_events=12)
    narrow = beside_a_faster_mass(scene, start, 1.6e-6)
    other = ss.simulate(narrow[0], 0.1, narrow[1], method="taylor", max_events=12)
    assert other.counters["panels"] > 1.1 * run.counters["panels"]
    assert run.events.kind[9] == other.events.kind[9] == "release"
    np.testing.assert_allclose(run.events.time, other.events.time, rtol=0.0, atol=1e-14)
