"""Laws of friction in scenes with compliant contacts and dofs without mass, where slip itself has mass."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss
from return_map import assert_multipliers
from stickslip import NotPeriodicError
from stickslip.scene.laws.friction import FrictionLaw, Linear, Rational, Stribeck

LAWS = [Stribeck(0.5, 0.3, 0.1), Rational(0.5, 0.3, 0.1), Linear(0.5, -0.2), Linear(0.4, 0.3)]
STIFFNESS = np.array([[100.0, -40.0], [-40.0, 300.0]])
DAMPING = np.diag([0.4, 0.8])
FORCE = np.array([0.0, -12.0])
SPEED, SPRING = 0.2, 700.0


def pressed_by_a_spring(law: FrictionLaw, damping: float = 0.4) -> ss.Scene:
    """Return a mass that a spring without mass presses on a belt."""
    contact = ss.Contact(tangential=0, normal=1, friction=law, slider_speed=SPEED, normal_stiffness=SPRING)
    return ss.Scene([1.0, 1.5], STIFFNESS, damping=np.diag([damping, 0.8]), force=FORCE, contacts=[contact])


def beside_a_node(law: FrictionLaw, other: float = 0.6) -> ss.Scene:
    """Return a mass on a belt under a given normal force, tied to a mass on a compliant contact."""
    contacts = [
        ss.Contact(tangential=0, normal_force=10.0, friction=law, slider_speed=SPEED),
        ss.Contact(
            tangential=1, normal_force=5.0, friction=other, slider_speed=0.1, tangential_stiffness=SPRING
        ),
    ]
    return ss.Scene([1.0, 1.5], STIFFNESS, damping=DAMPING, contacts=contacts)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_slip_under_the_force_of_a_spring_agrees_with_an_integrator(law):
    scene = pressed_by_a_spring(law)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.03, "x2": -0.05})
    run = ss.simulate(scene, 3.0, start)

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        force = FORCE - STIFFNESS @ y[:2] - DAMPING @ y[2:]
        pressed = -SPRING * y[1]
        return np.r_[y[2:], (force + pressed * np.array([law.coefficient(SPEED - y[2]), 1.0])) / [1.0, 1.5]]

    def slip(_: float, y: np.ndarray) -> float:
        return SPEED - y[2]

    slip.terminal = True
    given = np.r_[start.position, start.velocity]
    options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
    path = solve_ivp(rate, (0.0, 3.0), given, events=slip, **options)
    if path.t_events[0].size:
        assert run.events.kind[0] == "velocity"
        assert run.events.time[0] == pytest.approx(path.t[-1], abs=1e-11)
    else:
        assert run.events.time.size == 0
    middle = 0.7 * path.t[-1]
    expected = solve_ivp(rate, (0.0, middle), given, **options).y[:, -1]
    state = run.state(middle)
    np.testing.assert_allclose([*state.position, *state.velocity], expected, atol=1e-11)
    sample = run.sample([middle])
    assert sample.normal_force.values[0, 0] == pytest.approx(-SPRING * expected[1], rel=1e-10)
    friction = law.coefficient(SPEED - expected[2]) * -SPRING * expected[1]
    assert sample.friction_force.values[0, 0] == pytest.approx(friction, rel=1e-10)


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("scene_of", [pressed_by_a_spring, beside_a_node])
def test_energy_closes(scene_of, law):
    scene = scene_of(law)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.15, "x2": -0.05})
    run = ss.simulate(scene, 8.0, start)
    assert run.events.time.size > 2 or law == LAWS[3]
    # Works of some joules.
    assert abs(run.balance().residual) < 1e-12
    sample = run.energy(np.linspace(0.01, 8.0, 60))
    powers = sample.contact_power.sum("contact") + sample.external_power - sample.damping_power
    np.testing.assert_allclose(sample.energy_rate, powers, atol=1e-12)


def test_a_linear_law_beside_a_node_goes_by_modes():
    """A law of one value moves as the number, and a linear one by modes as by series."""
    scene = beside_a_node(Linear(0.5, -0.2))
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.15})
    modal, series = (ss.simulate(scene, 8.0, start, method=method) for method in ("modal", "taylor"))
    assert modal.events.time.size > 4
    assert list(modal.events.combination) == list(series.events.combination)
    np.testing.assert_allclose(modal.events.time, series.events.time, rtol=0.0, atol=1e-11)
    one = beside_a_node(Linear(0.5, 0.0))
    start = ss.steady_sliding(one).perturbed(velocity={"x1": 0.15})
    found, expected = (ss.simulate(of, 8.0, start) for of in (one, beside_a_node(0.5)))
    np.testing.assert_allclose(found.events.time, expected.events.time, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("law", LAWS[:3], ids=repr)
@pytest.mark.parametrize("scene_of", [pressed_by_a_spring, beside_a_node])
def test_multipliers_are_those_of_differenced_runs(scene_of, law):
    scene = scene_of(law)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.15})
    cycle = ss.simulate(scene, 60.0, start).limit_cycle()
    assert len(cycle.combinations) > 1
    assert_multipliers(cycle, 1e-6)


@pytest.mark.parametrize("law", [LAWS[0], LAWS[3]], ids=repr)
def test_growth_of_sliding_is_that_of_its_linear_equations(law):
    scene = pressed_by_a_spring(law)
    rest = ss.steady_sliding(scene)
    pressed = -SPRING * rest.position[1]
    slope = (law.coefficient(SPEED + 1e-6) - law.coefficient(SPEED - 1e-6)) / 2e-6
    damping = DAMPING + np.diag([pressed * slope, 0.0])
    stiffness = STIFFNESS + np.array([[0.0, law.coefficient(SPEED) * SPRING], [0.0, SPRING]])
    inverse = np.diag([1.0, 1.0 / 1.5])
    first_order = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])
    expected = np.linalg.eigvals(first_order)
    found = ss.complex_modes(scene).eigenvalues
    found = np.r_[found, found.conj()]
    assert max(np.abs(found - value).min() for value in expected) < 1e-7


def test_motion_that_comes_to_rest_is_an_equilibrium():
    scene = pressed_by_a_spring(Stribeck(0.5, 0.3, 0.1), damping=12.0)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})
    with pytest.raises(NotPeriodicError) as found:
        ss.simulate(scene, 20.0, start).limit_cycle()
    assert found.value.kind == "equilibrium"


@pytest.mark.parametrize(
    ("law", "reason"),
    [
        (LAWS[0], "no quasi-static motion follows"),
        (LAWS[2], "no quasi-static motion follows"),
    ],
    ids=repr,
)
def test_laws_where_slip_has_no_mass_are_refused_with_the_reason(law, reason):
    contact = ss.Contact(
        tangential=0,
        normal=1,
        friction=law,
        slider_speed=SPEED,
        normal_stiffness=1e3,
        tangential_stiffness=1e3,
    )
    with pytest.raises(ss.InputError, match="contact 0: friction") as refused:
        ss.Scene([1.0, 1.0], STIFFNESS, force=FORCE, contacts=[contact])
    assert reason in str(refused.value)
    assert "tangential_stiffness" in str(refused.value)
