"""Friction laws that vanish at rest: slip reverses without sticking, at an event of kind `velocity`."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.scene.laws.friction import FrictionLaw

LAWS = {
    "square": ss.friction.Law(lambda s: 0.3 * s**2),
    "cube": ss.friction.Law(lambda s: 0.3 * s**3),
    "tanh": ss.friction.Law(lambda s: 0.3 * np.tanh(s / 0.05)),
    "cube of tanh": ss.friction.Law(lambda s: 0.3 * np.tanh(s / 0.05) ** 3),
    "Stribeck": ss.friction.Stribeck(0.0, 0.3, 0.2),
    "table": ss.friction.Tabulated([0.0, 0.1, 0.3, 1.0], [0.0, 0.2, 0.4, 0.5]),
}
Rates = Callable[[float, np.ndarray], np.ndarray]


def integrated(rates: Rates, start: list[float], times: np.ndarray) -> np.ndarray:
    """Return the states at some times, by an integrator whose steps pass the change of sign."""
    way = solve_ivp(
        rates, (0.0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-13, max_step=0.01
    )
    return way.y.T


def force(law: FrictionLaw, slip: float) -> float:
    return -float(np.sign(slip)) * float(law.coefficient(abs(slip)))


def belt(law: FrictionLaw, slider_speed: float, loads: tuple[ss.Harmonic, ...] = ()) -> ss.Scene:
    contact = ss.Contact(tangential=0, normal_force=1.0, friction=law, slider_speed=slider_speed)
    return ss.Scene([1.0], [[2.0]], damping=[[0.0]], contacts=[contact], loads=loads)


@pytest.mark.parametrize("name", LAWS)
def test_slip_reverses_under_a_law_that_vanishes_at_rest(name: str) -> None:
    law = LAWS[name]
    run = ss.simulate(belt(law, 0.1), 10.0, ss.State([0.5], [0.0], "+"))
    times = np.linspace(0.0, 10.0, 21)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], -2.0 * y[0] + force(law, y[1] - 0.1)])

    exact = integrated(rates, [0.5, 0.0], times)
    assert np.abs(run.sample(times).position.values - exact[:, :1]).max() < 1e-9
    assert len(run.events) >= 2
    assert set(run.events.kind) == {"velocity"}
    at_events = [run.state(time).velocity[0] for time in run.events.time]
    np.testing.assert_allclose(at_events, 0.1, atol=1e-13)
    # Friction opposes slip at every sample.
    samples = run.sample(np.linspace(0.01, 9.99, 200))
    power = samples.friction_force.values[:, 0] * (samples.velocity.values[:, 0] - 0.1)
    assert power.max() <= 1e-15


def test_slips_of_contacts_that_mass_couples_reverse() -> None:
    """The normal force of the first one follows from the friction of both."""
    law = LAWS["square"]
    mass = np.array([[1.0, 0.3, 0.1], [0.3, 2.0, 0.2], [0.1, 0.2, 1.5]])
    stiffness, load = np.diag([2.0, 3.0, 50.0]), np.array([0.0, 0.0, -5.0])
    contacts = [
        ss.Contact(tangential=0, normal=2, friction=law, slider_speed=0.05),
        ss.Contact(tangential=1, normal_force=1.0, friction=law, slider_speed=0.0),
    ]
    scene = ss.Scene(
        mass, stiffness, damping=np.zeros((3, 3)), force=load, contacts=contacts, impact_friction=True
    )
    run = ss.simulate(scene, 10.0, ss.State([0.3, -0.2, 0.0], [0.0, 0.1, 0.0], "+-"))

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:3], y[3:]
        matrix = np.zeros((4, 4))
        matrix[:3, :3] = mass
        matrix[:, 3] = [-force(law, v[0] - 0.05), 0.0, -1.0, 0.0]
        matrix[3, 2] = 1.0
        loads = load - stiffness @ x + [0.0, force(law, v[1]), 0.0]
        return np.concatenate([v, np.linalg.solve(matrix, [*loads, 0.0])[:3]])

    times = np.linspace(0.0, 10.0, 21)
    exact = integrated(rates, [0.3, -0.2, 0.0, 0.0, 0.1, 0.0], times)
    assert np.abs(run.sample(times).position.values - exact[:, :3]).max() < 1e-9
    assert set(run.events.contact) == {0, 1}
    assert set(run.events.kind) == {"velocity"}


def test_multipliers_of_a_cycle_whose_slip_reverses() -> None:
    """The matrix of such an event is the identity, as the field is continuous there."""
    law, drive = LAWS["square"], ss.Harmonic({"x1": 2.0}, 0.4)
    run = ss.simulate(belt(law, 0.0, (drive,)), 60.0, ss.State([0.0], [0.0], "-"))
    cycle = run.limit_cycle()
    assert cycle.period == pytest.approx(2.5, rel=1e-14)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        load = 2.0 * np.cos(2.0 * np.pi * 0.4 * t)
        return np.array([y[1], -2.0 * y[0] + force(law, y[1]) + load])

    def after(start: np.ndarray, periods: int = 1) -> np.ndarray:
        return integrated(rates, list(start), np.array([2.5 * periods]))[-1]

    start = after(np.zeros(2), 45)
    step = 1e-5
    columns = [(after(start + step * e) - after(start - step * e)) / (2.0 * step) for e in np.eye(2)]
    expected = np.sort_complex(np.linalg.eigvals(np.transpose(columns)))
    np.testing.assert_allclose(np.sort_complex(cycle.multipliers), expected, atol=1e-6)


def test_a_zero_of_its_own_still_ends_a_law_that_vanishes_at_rest() -> None:
    scene = belt(ss.friction.Law(lambda s: 0.3 * s**2 * (1.0 - s)), 0.1)
    with pytest.raises(ss.RunError, match="reaches 0 at this slip speed"):
        ss.simulate(scene, 1.0, ss.State([2.5], [0.0], "+"))


def test_rest_goes_on_as_rest() -> None:
    run = ss.simulate(belt(LAWS["square"], 0.0), 5.0, ss.State([0.0], [0.0], "+"))
    assert len(run.events) == 0
    assert run.state(5.0).position[0] == 0.0


def test_the_direction_of_a_start_is_checked() -> None:
    scene = belt(LAWS["square"], 0.1)
    with pytest.raises(ss.InputError, match="slip velocity"):
        ss.simulate(scene, 1.0, ss.State([0.5], [0.0], "-"))
    with pytest.raises(ss.InputError, match="required friction force"):
        ss.simulate(scene, 1.0, ss.State([0.5], [0.1], "-"))


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        (lambda s: -0.1 * s, "slope: must be >= 0 where mu0 is 0, got -0.1"),
        (lambda s: s * s - 0.2 * s, "slope at rest: must be >= 0 where mu is 0, got -0.2"),
        (lambda s: -s * s, "curvature at rest: must be >= 0 where mu and its slope are 0, got -2"),
    ],
)
def test_a_law_that_falls_from_zero_is_refused(formula: Callable[[float], float], message: str) -> None:
    with pytest.raises(ss.InputError, match=message):
        belt(ss.friction.Law(formula), 0.1)


def test_slip_without_mass_needs_friction_at_rest() -> None:
    contact = ss.Contact(
        tangential=0, normal_force=1.0, tangential_stiffness=50.0, friction=ss.friction.Law("s + s**3")
    )
    with pytest.raises(ss.InputError, match="friction: must be > 0 at rest, or a line through 0"):
        ss.Scene([1.0], [[2.0]], contacts=[contact])
