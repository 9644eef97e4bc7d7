"""Motions under a law of a user's own: those under the same law built in, and those of an integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import stickslip as ss

Law = ss.friction.Law
#: Laws built in, and the same by their formulas.
TWINS = {
    "Stribeck": (
        ss.friction.Stribeck(0.5, 0.3, 0.1, 0.02),
        Law(lambda s, at=0.5, low=0.3, v=0.1: low + (at - low) * np.exp(-s / v) + 0.02 * s),
    ),
    "Rational": (
        ss.friction.Rational(0.5, 0.3, 0.1),
        Law(lambda s, at=0.5, low=0.3, v=0.1: low + (at - low) / (1.0 + s / v)),
    ),
    "Linear": (ss.friction.Linear(0.4, -0.02), Law("at + slope * s", at=0.4, slope=-0.02)),
}
#: Laws that have no twin, with every operation.
OWN = {
    "powers": Law(lambda s, v=0.1: 0.3 + 0.2 / np.sqrt(1.0 + (s / v) ** 2)),
    "logarithm": Law(lambda s, v=0.1: 0.5 - 0.05 * np.log(1.0 + s / v)),
    "tanh": Law(lambda s, v=0.1: 0.5 - 0.2 * np.tanh(s / v) ** 2 + 0.01 * s**3),
    "arctan": Law(lambda s, v=0.1: 0.5 - 0.2 * np.arctan(s / v) ** 2 / (1.0 + s)),
    "ripples": Law(lambda s, v=0.01: 0.4 + 0.1 * np.sin(s / v) * np.cos(3.0 * s / v)),
    "exponent": Law(lambda s, v=0.1, d=1.7: 0.3 + 0.2 * np.exp(-((0.01 + s / v) ** d))),
}


def block(law, speed=0.1):
    belt = ss.Contact(tangential="x", normal_force=10.0, friction=law, slider_speed=speed)
    return ss.Scene([1.0], [[100.0]], damping=[[1.0]], contacts=[belt], dofs=["x"])


@pytest.mark.parametrize("name", TWINS)
def test_a_motion_is_that_of_the_law_built_in(name):
    runs = []
    for law in TWINS[name]:
        scene = ss.models.two_subsystems(friction=law, slider_speed=0.025, preload_displacement=1e-3)
        runs.append(ss.simulate(scene, 0.3, ss.disturbed_sliding(scene)))
    built, own = runs
    assert len(own.events) == len(built.events) > (0 if name == "Linear" else 40) - 1
    assert own.events.kind.tolist() == built.events.kind.tolist()
    assert own.counters["panels"] == built.counters["panels"]
    # The same tape in another order of its sums: an ulp a panel.
    np.testing.assert_allclose(own.events.time, built.events.time, rtol=1e-13)
    end = [run.sample([run.duration]).position for run in runs]
    np.testing.assert_allclose(end[1], end[0], rtol=1e-12)


@pytest.mark.parametrize("name", OWN)
def test_a_motion_is_that_of_an_integrator(name):
    law, scene = OWN[name], block(OWN[name])
    start = ss.steady_sliding(scene).perturbed(velocity={"x": -0.05})
    run = ss.simulate(scene, 20.0, start, max_events=1)

    def rate(_, state):
        position, velocity = state
        # Slower than the belt, which pulls.
        return velocity, 10.0 * law.coefficient(0.1 - velocity) - 100.0 * position - velocity

    end = run.events.time[0] if len(run.events) else 1.0
    found = solve_ivp(rate, (0.0, end), [*start.position, *start.velocity], "DOP853", rtol=1e-12, atol=1e-14)
    sample = run.sample([end])
    assert sample.position[0, 0] == pytest.approx(found.y[0, -1], abs=1e-10)
    assert sample.velocity[0, 0] == pytest.approx(found.y[1, -1], abs=1e-10)


def beside_four(force=-1.0, pressed=1.0):
    """A mass whose slip is damped about a speed of 4 m/s, at which friction is the normal force."""
    law = Law(lambda s: 1.0 - 0.05 * (4.0 - s) + 0.05 * (4.0 - s) ** 3)
    belt = ss.Contact(tangential="x", normal_force=pressed, friction=law, slider_speed=4.0)
    return ss.Scene([1.0], [[1.0]], force=[force], contacts=[belt], dofs=["x"])


def test_a_motion_decays_to_steady_sliding_at_zero():
    """The same motion about x = 0 and about x = 1, and where it is small that of a linear damper."""
    scenes = beside_four(-1.0), beside_four(0.0)
    runs = [
        ss.simulate(scene, 2000.0, ss.State([rest], [0.2], "+"))
        for scene, rest in zip(scenes, (0.0, 1.0), strict=True)
    ]
    assert [run.stop_reason for run in runs] == ["duration", "duration"]
    about_zero, about_one = (run.sample(np.linspace(0.0, 2000.0, 501)).position.to_numpy() for run in runs)
    # The force of 1 N is off by some ulp on every panel, which 1 / 0.025 s remember.
    rounding = 40.0 * np.finfo(float).eps
    np.testing.assert_allclose(about_zero, about_one - 1.0, rtol=0.0, atol=4.0 * rounding)
    # What the cubic term adds at 4e-8 m/s is below rounding.
    small = runs[0].sample([600.0, 1000.0])
    states = np.hstack([small.position.to_numpy(), small.velocity.to_numpy()])
    decayed = expm(400.0 * np.array([[0.0, 1.0], [-1.0, -0.05]])) @ states[0]
    np.testing.assert_allclose(states[1], decayed, rtol=0.0, atol=rounding)
    with pytest.raises(ss.NotPeriodicError, match="settles to an equilibrium"):
        runs[0].limit_cycle()


@pytest.mark.parametrize("pressed", [1.0, 100.0])
@pytest.mark.parametrize("velocity", [0.0, 1e-300, 1e-12])
def test_a_motion_beside_zero_stays_there(velocity, pressed):
    run = ss.simulate(beside_four(-pressed, pressed), 200.0, ss.State([0.0], [velocity], "+"))
    assert run.stop_reason == "duration"
    # Rounding of the normal force, over the 40 s in which it is forgotten.
    largest = float(np.abs(run.sample(np.linspace(0.0, 200.0, 201)).position).max())
    assert largest <= velocity + 40.0 * np.finfo(float).eps * pressed


def test_basins_know_steady_sliding_at_zero():
    scene = beside_four()
    start = ss.steady_sliding(scene)
    assert start.position.tolist() == [0.0]
    found = ss.basins(scene, start=start, velocity={"x": [0.0, 0.2]}, position={"x": [0.0, 0.1]})
    assert found.attractors == ("equilibrium",)
