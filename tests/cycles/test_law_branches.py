"""A block on a Stribeck belt: from the Hopf point over the unstable cycle to its fold with stick-slip.

``x'' + c x' + k x = N mu(v - x')``. Steady sliding loses its stability where ``c + N mu'(v) = 0``. About it
the motion is that of ``x'' + k x = f(x')`` with ``f''' = -N mu'''``. Because f depends on x' alone, the first
Lyapunov coefficient has the sign of f''' (Guckenheimer and Holmes 1983, eq. 3.4.11): for the law of Stribeck,
``mu''' < 0``, the cycle is unstable and lives where sliding is stable. It ends where it touches the
speed of the belt.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss
from law_blocks import HOPF, STEPS, block, small_cycle
from return_map import assert_multipliers
from stickslip import NotPeriodicError
from stickslip.scene.laws.friction import Stribeck


def stick_slip(speed: float) -> ss.Cycle:
    """Return the cycle to which a block settles that the belt carries along."""
    scene = block(speed)
    start = ss.State([0.0], [speed], "s", dofs=scene.dofs)
    return ss.simulate(scene, 20.0, start).limit_cycle()


def touching_speed() -> float:
    """Return the speed of the belt at which the slide from the end of sticking comes back to that speed."""

    def excess(speed: float) -> float:
        # The end of sticking: k x + c v = N mu(0).
        start = [(10.0 * 0.5 - speed) / 100.0, speed]

        def rate(_: float, y: np.ndarray) -> list[float]:
            # Beyond rest the law goes on as an analytic function.
            force = 10.0 * (0.3 + 0.2 * np.exp(-(speed - y[1]) / 0.1))
            return [y[1], -100.0 * y[0] - y[1] + force]

        def top(_: float, y: np.ndarray) -> float:
            return rate(0.0, y)[1]

        top.direction = -1.0
        run = solve_ivp(rate, (0.0, 0.9), start, method="DOP853", rtol=1e-13, atol=1e-15, events=top)
        turns = [y[1] for t, y in zip(run.t_events[0], run.y_events[0], strict=True) if t > 0.3]
        return turns[0] - speed

    return float(brentq(excess, 0.601, 0.62, xtol=1e-12))


def test_the_branch_is_born_at_the_hopf_point():
    point = ss.critical_points(block(0.2), {"slider_speed": (0.1, 0.5)})[0]
    assert point.value == pytest.approx(HOPF, abs=1e-12)
    near, further = (small_cycle((1.0 + e) * HOPF, guess) for e, guess in ((5e-4, 0.011), (1e-3, 0.016)))
    assert near.stable is False
    assert further.stable is False
    # The square of the amplitude grows in proportion to the distance.
    squares = [float(cycle.amplitude[0]) ** 2 for cycle in (near, further)]
    born = HOPF * (1.0 + 5e-4 - 5e-4 * squares[0] / (squares[1] - squares[0]))
    assert born == pytest.approx(HOPF, rel=1e-6)
    # Averaging: the growth (f' + f''' a^2 / 8) / 2 of the amplitude a of the velocity vanishes.
    falling = np.exp(-1.001 * HOPF / 0.1)
    growth, curved = -1.0 + 20.0 * falling, 2000.0 * falling
    assert 10.0 * np.sqrt(squares[1]) == pytest.approx(np.sqrt(-8.0 * growth / curved), rel=5e-3)


def test_the_branch_touches_the_stick_slip_cycle_at_its_fold():
    speed = 1.01 * HOPF
    small = ss.continuation(small_cycle(speed), {"slider_speed": (speed, 0.8)}).points
    large = ss.continuation(stick_slip(0.2), {"slider_speed": (0.2, 0.8)}).points
    assert [point.kind for point in (*small, *large)] == ["grazing", "grazing"]
    assert small[0].value == pytest.approx(large[0].value, rel=2e-8)
    assert small[0].value == pytest.approx(touching_speed(), rel=1e-8)
    assert small[0].event == "velocity"


def test_the_branch_ends_at_the_hopf_point():
    speed = 1.01 * HOPF
    branch = ss.continuation(small_cycle(speed), {"slider_speed": (speed, 0.98 * HOPF)})
    (point,) = branch.points
    assert (branch.end, point.kind, point.contact) == ("hopf", "hopf", None)
    # A parabola over the square of a hundredth of the amplitude, at which the speed is off by 1 %, leaves out
    # 1e-2 * (1e-2)^6 of it; the orbits are at their speeds to some 1e-11.
    assert point.value == pytest.approx(HOPF, rel=1e-10)
    assert float(branch.cycles[-1].amplitude[0]) <= 1e-2 * float(branch.cycles[0].amplitude[0])
    assert "hopf" in str(branch.summary())


@pytest.mark.parametrize("speed", [0.35, 0.45, 0.55])
def test_sliding_and_stick_slip_coexist(speed):
    """Sliding and stick-slip are stable there, and the cycle between them is not."""
    scene = block(speed)
    assert ss.complex_modes(scene).eigenvalues.real.max() < 0.0
    branch = ss.continuation(small_cycle(1.01 * HOPF), {"slider_speed": (1.01 * HOPF, speed)}, step=0.2)
    between, large = branch.cycles[-1], stick_slip(speed)
    assert branch.data.followed.all()
    assert large.combinations == ("+", "s")
    assert large.stable
    assert large.transverse_multipliers == pytest.approx([0.0], abs=1e-15)
    assert between is not None
    assert between.stable is False
    assert between.largest_multiplier > 1.0
    assert_multipliers(between, 1e-8, steps=STEPS)
    assert_multipliers(large, 1e-8, steps=STEPS)
    # From either side of the unstable cycle.
    top = between.run.state(0.0).position[0]
    rest = ss.steady_sliding(scene).position[0]
    ends = {}
    for factor in (0.98, 1.02):
        start = ss.State([rest + factor * (top - rest)], [0.0], "+", dofs=scene.dofs)
        run = ss.simulate(scene, 20.0, start)
        try:
            ends[factor] = run.limit_cycle(further=100.0).combinations
        except NotPeriodicError as told:
            ends[factor] = told.kind
    assert ends == {0.98: "equilibrium", 1.02: ("+", "s")}


def test_calls_over_many_scenes_take_laws():
    found = ss.bifurcation(block(0.2), {"slider_speed": np.array([0.15, 0.2])})
    for cycle, speed in zip(found.cycles, (0.15, 0.2), strict=True):
        assert cycle is not None
        assert cycle.period == pytest.approx(stick_slip(speed).period, rel=1e-11)


def test_basins_and_bifurcations_tell_sliding_from_stick_slip():
    scene = block(0.4)
    sliding = ss.steady_sliding(scene)
    found = ss.basins(scene, start=sliding, velocity={"x": [0.1, 0.39]}, position={"x": [0.0, 0.01]})
    assert found.map.values.tolist() == [[0, 1], [0, 1]]
    assert found.attractors[0] == "equilibrium"
    assert "".join(found.attractors[1].combinations) == "+s"
    diagram = ss.bifurcation(
        scene,
        {"slider_speed": [0.2, 0.4, 0.8]},
        start=lambda scene: ss.State([0.0], [scene.contacts[0].slider_speed], "s", dofs=scene.dofs),
    )
    assert diagram.to_dataset().kind.values.tolist() == ["cycle", "cycle", "equilibrium"]


def test_studies_answer_what_single_calls_do():
    outputs = ["growth_rate", "period", "stability", "energy_per_cycle"]
    study = ss.Study(
        block(0.2), {"slider_speed": [0.2, 0.4]}, outputs=outputs, duration=20.0, velocity={"x": 0.1}
    )
    found = study.run()
    start = ss.steady_sliding(block(0.2)).perturbed(velocity={"x": 0.1})
    cycle = ss.simulate(block(0.2), 20.0, start).limit_cycle()
    assert found.stability.values.tolist() == ["stable", ""]
    assert found.period.values[0] == pytest.approx(cycle.period, rel=1e-12)
    assert found.energy_per_cycle.values[0] == pytest.approx(cycle.balance().damping, rel=1e-9)
    growth = ss.complex_modes(block(0.4)).eigenvalues.real.max()
    assert found.growth_rate.values[1] == pytest.approx(growth, rel=1e-12)


def test_a_cycle_through_sticking_and_a_law_shows_the_modes_that_there_are():
    law = Stribeck(1.5, 1.2, 0.1)
    scene = ss.models.two_subsystems(friction=law, slider_speed=0.025, preload_displacement=1e-3)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    cycle = ss.simulate(scene, 0.6, start).limit_cycle()
    assert "s+" in cycle.combinations
    assert "s+" not in cycle.modes
    assert "++" in cycle.modes
    frequency = cycle.table().frequency[cycle.combinations.index("s+")]
    assert np.isnan(frequency).all()
    assert str(cycle.summary())
