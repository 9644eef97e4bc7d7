"""Motions under a law of a user's own: those under the same law built in, and those of an integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

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
