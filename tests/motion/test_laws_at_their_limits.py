"""Friction laws where a motion meets their knots, or runs far faster than they change."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss

TABLE = ss.friction.Tabulated(speeds=[0.0, 0.05, 0.1, 0.2, 0.4, 0.8], values=[0.5, 0.4, 0.35, 0.3, 0.29, 0.1])


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("apart", [1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 0.0])
def test_a_start_beside_a_knot_is_in_the_right_piece(apart: float, side: float) -> None:
    contact = ss.Contact(tangential="x", normal_force=10.0, friction=TABLE, slider_speed=0.0)
    scene = ss.Scene([1.0], [[100.0]], damping=[[0.0]], contacts=[contact], dofs=["x"])
    start = [-0.2, 0.2 * (1.0 + side * apart)]

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -100.0 * y[0] - 10.0 * float(TABLE.coefficient(y[1]))]

    exact = solve_ivp(rates, (0.0, 0.05), start, "DOP853", rtol=1e-13, atol=1e-15, max_step=1e-3)
    run = ss.simulate(scene, 0.05, ss.State([start[0]], [start[1]], "-", dofs=["x"]))
    end = run.state(0.05)
    assert abs(end.position[0] - exact.y[0, -1]) < 1e-11
    assert abs(end.velocity[0] - exact.y[1, -1]) < 1e-11


def swinging(friction: object, amplitude: float) -> object:
    """Return the run of a block on a spring that swings with an amplitude."""
    contact = ss.Contact(tangential=0, normal_force=1.0, friction=friction, slider_speed=0.1)
    scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
    return ss.simulate(scene, 3.0, ss.State([amplitude], [0.05], "+"), max_events=100)


@pytest.mark.parametrize("speed", [1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12])
@pytest.mark.parametrize("law", [ss.friction.Stribeck, ss.friction.Rational])
def test_a_law_over_a_tiny_speed_is_its_constant_limit(law: type, speed: float) -> None:
    constant = swinging(0.3, 1.0).events.time
    times = swinging(law(0.5, 0.3, speed), 1.0).events.time
    # Its excess over the limit is an impulse of the order of `speed` per passage, times a logarithm under
    # the rational law.
    assert len(times) == len(constant)
    assert np.abs(times - constant).max() < 1e-2 * speed + 1e-13


@pytest.mark.parametrize("amplitude", [1e2, 1e8, 3e8, 1e9])
@pytest.mark.parametrize("law", [ss.friction.Stribeck, ss.friction.Rational])
def test_a_motion_far_larger_than_the_speed_of_its_law_swings_on(law: type, amplitude: float) -> None:
    run, constant = swinging(law(0.5, 0.3, 0.1), amplitude), swinging(0.3, amplitude)
    assert len(run.events) == len(constant.events)
    # Its excess of 0.2 N acts over about 0.1 m/s per passage, and with a logarithm under the rational law.
    assert np.abs(run.events.time - constant.events.time).max() < 1.0 / amplitude**2 + 1e-14


@pytest.mark.parametrize("speed", [1e-11, 1e-12, 1e-13])
@pytest.mark.parametrize("damping", [0.0, 1.0])
@pytest.mark.parametrize("law", [ss.friction.Stribeck, ss.friction.Rational])
def test_slip_whose_beginning_is_lost_in_rounding_is_refused(law: type, damping: float, speed: float) -> None:
    # It grows as J / r^2 e^(r t) with J = 1e3 m/s^3 and r = 2 / speed; the velocity has units of 1.4e-17 m/s.
    contact = ss.Contact(tangential=0, normal_force=10.0, friction=law(0.5, 0.3, speed), slider_speed=0.1)
    scene = ss.Scene([1.0], [[1e4]], damping=[[damping]], contacts=[contact])
    with pytest.raises(
        ss.RunError, match=r"contact 0 at t = 0\.00(49|5) s: its friction changes over"
    ) as error:
        ss.simulate(scene, 1.0, ss.State([0.0], [0.1], "s"), max_events=100)
    assert len(error.value.partial.events) == 1


GROWING = [
    ss.friction.Stribeck(0.5, 0.3, 0.1),
    ss.friction.Rational(0.5, 0.3, 0.1),
    ss.friction.Tabulated([0.0, 0.1, 0.3], [0.5, 0.4, 0.3]),
]


@pytest.mark.parametrize("law", [*GROWING, ss.friction.Linear(0.3, 0.1), 0.3])
def test_a_motion_that_grows_without_bound_says_so(law: object) -> None:
    contact = ss.Contact(tangential=0, normal_force=1.0, friction=law, slider_speed=0.1)
    scene = ss.Scene([1.0], [[-100.0]], contacts=[contact])
    run = ss.simulate(scene, 1000.0, ss.State([1.0], [0.2], "-"))
    assert run.stop_reason == "unbounded"
    assert run.state(run.duration).position[0] > 1e150


@pytest.mark.parametrize("law", GROWING)
def test_a_swing_that_outgrows_its_law_is_not_called_unbounded(law: object) -> None:
    contact = ss.Contact(tangential=0, normal_force=1.0, friction=law, slider_speed=0.1)
    scene = ss.Scene([1.0], [[100.0]], damping=[[-5.0]], contacts=[contact])
    with pytest.raises(
        ss.RunError, match=r"contact 0 at t = .*: its friction changes over slip speeds"
    ) as error:
        ss.simulate(scene, 1000.0, ss.State([1.0], [0.2], "-"))
    run = error.value.partial
    last = run.state(run.duration)
    assert np.isfinite(last.position[0])
    assert np.abs(run.sample(np.linspace(0.0, run.duration, 50)).position.values).max() > 1e12


def test_every_table_is_a_law() -> None:
    rng = np.random.default_rng(36)
    for number in range(300):
        count = rng.integers(2, 12)
        widths = 10.0 ** rng.uniform(-6.0 if number % 2 else -0.5, 0.0, count - 1)
        speeds = np.concatenate([[0.0], np.cumsum(widths)]) * 10.0 ** rng.uniform(-12.0, 6.0)
        values = 10.0 ** rng.uniform(-12.0, 2.0, count) * (rng.uniform(size=count) < 0.8)
        table = ss.friction.Tabulated(speeds, values)
        contact = ss.Contact(tangential=0, normal_force=1.0, friction=table)
        scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
        assert scene.contacts[0].friction == table


def test_a_polynomial_has_a_bound_where_slip_has_no_mass() -> None:
    """Its series holds everywhere, and the tube of its slope is finite all the same."""

    def law(speed: float) -> float:
        return 0.01 + 0.3 * speed + 0.4 * speed**3

    contact = ss.Contact(
        tangential=0,
        normal_force=1.0,
        tangential_stiffness=50.0,
        friction=ss.friction.Law(law),
        slider_speed=0.1,
    )
    scene = ss.Scene([1.0], [[2.0]], damping=[[0.0]], contacts=[contact])
    run = ss.simulate(scene, 3.0, ss.State([0.5], [0.0], "+"))
    assert run.duration == 3.0

    def rates(t: float, y: np.ndarray) -> list[float]:
        friction = 50.0 * (y[0] - y[2])
        held = abs(friction) <= law(0.0)
        speed = 0.0 if held else brentq(lambda s: law(s) - abs(friction), 0.0, 100.0, xtol=1e-16)
        return [y[1], -2.0 * y[0] - friction, 0.1 + np.sign(friction) * speed]

    start = [0.5, 0.0, 0.5 + law(0.1) / 50.0]
    exact = solve_ivp(rates, (0.0, 3.0), start, "LSODA", rtol=1e-10, atol=1e-12, max_step=0.01)
    assert abs(run.state(3.0).position[0] - exact.y[0, -1]) < 1e-8
