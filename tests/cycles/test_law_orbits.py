"""Orbits under friction over slip speed: multipliers against differences of runs and an integrator."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss
from law_blocks import HOPF, STEPS, STRIBECK, block, small_cycle
from return_map import assert_multipliers, differenced_multipliers
from stickslip import NotPeriodicError, OrbitError
from stickslip.scene.laws.friction import FrictionLaw, Linear, Rational, Stribeck, Tabulated

TABLE = Tabulated([0.0, 0.05, 0.1, 0.2, 0.4], [0.5, 0.4, 0.35, 0.3, 0.29])
LAWS = [STRIBECK, Stribeck(0.5, 0.3, 0.1, 0.1), Rational(0.5, 0.3, 0.1), TABLE]


def two_blocks(coupling: float = 50.0) -> ss.Scene:
    """Return two blocks on one belt, with a spring between them."""
    belt = {"slider_speed": 0.1}
    contacts = [
        ss.Contact(tangential=0, normal_force=10.0, friction=STRIBECK, **belt),
        ss.Contact(tangential=1, normal_force=8.0, friction=Rational(0.5, 0.3, 0.1), **belt),
    ]
    stiffness = [[100.0 + coupling, -coupling], [-coupling, 80.0 + coupling]]
    return ss.Scene([1.0, 1.3], stiffness, damping=[[0.3, 0.0], [0.0, 0.2]], contacts=contacts)


def skew_block(law: FrictionLaw, damping: float = 0.0) -> ss.Scene:
    """Return a mass on a normal that is not orthogonal to the slip: W couples friction and pressure."""
    contact = ss.Contact(tangential=[1.0, 0.0], normal=[0.3, 1.0], friction=law, slider_speed=0.3)
    return ss.Scene(
        [1.0, 1.5],
        [[400.0, -60.0], [-60.0, 900.0]],
        damping=[[0.4 + damping, 0.0], [0.0, 0.6]],
        force=[0.0, -20.0],
        contacts=[contact],
        impact_friction=True,
    )


def kicked(scene: ss.Scene, speed: float, slope: float = 0.0) -> ss.State:
    velocity = np.zeros(scene.size)
    velocity[0] = speed
    velocity[1:] = slope * speed
    return ss.steady_sliding(scene).perturbed(velocity=velocity)


@pytest.mark.parametrize("law", LAWS)
def test_stick_slip_forgets_all_but_its_phase(law):
    scene = block(0.1, law)
    cycle = ss.simulate(scene, 10.0, kicked(scene, 0.01)).limit_cycle()
    assert cycle.combinations == ("+", "s")
    assert cycle.multipliers == pytest.approx([1.0, 0.0], abs=1e-12)
    assert_multipliers(cycle, 1e-8, steps=STEPS)
    balance = cycle.balance()
    assert abs(balance.residual) <= 1e-13 * abs(balance.damping)


def test_multipliers_of_two_blocks():
    scene = two_blocks()
    cycle = ss.simulate(scene, 20.0, kicked(scene, 0.02)).limit_cycle()
    assert cycle.combinations == ("++", "+s", "++", "s+")
    assert_multipliers(cycle, 1e-8, steps=STEPS)
    assert cycle.stable
    assert cycle.is_followed()


def test_multipliers_of_the_published_model_under_a_law():
    base = ss.models.two_subsystems()
    contacts = [
        replace(c, friction=Stribeck(1.1 * c.friction, c.friction, 0.02), static_friction=None)
        for c in base.contacts
    ]
    scene = ss.Scene(
        base.mass,
        base.stiffness,
        damping=base.damping,
        force=base.force,
        contacts=contacts,
        dofs=base.dofs,
    )
    cycle = ss.simulate(scene, 0.6, kicked(scene, 1e-3)).limit_cycle()
    assert cycle.combinations == ("++", "+d", "++", "s+", "ss", "s+")
    assert cycle.structural_zeros == 2
    assert_multipliers(cycle, 1e-7)


@pytest.mark.parametrize("law", LAWS[:3:2])
def test_a_cycle_without_events_of_coupled_friction_and_pressure(law):
    """The unstable cycle where damping barely makes sliding stable."""

    def leading(damping: float) -> float:
        return float(ss.complex_modes(skew_block(law, damping)).eigenvalues.real.max())

    damping = 1.02 * brentq(leading, -0.4, 30.0)
    scene = skew_block(law, damping)
    cycle = ss.simulate(scene, 3.0, kicked(scene, 0.1, -0.3)).closed_cycle()
    assert cycle.combinations == ("+",)
    assert not cycle.stable
    assert_multipliers(cycle, 1e-8, steps=STEPS)


@pytest.mark.parametrize("law", [STRIBECK, TABLE])
@pytest.mark.parametrize(("speed", "amplitude", "letters"), [(0.5, 1.0, "+"), (0.2, 2.0, "s+s")])
def test_orbits_under_loads_in_time(law, speed, amplitude, letters):
    load = ss.Harmonic({"x": amplitude}, frequency=1.2)
    scene = block(speed, law, 2.0, loads=[load])
    cycle = ss.simulate(scene, 20.0, ss.steady_sliding(scene)).limit_cycle()
    assert "".join(cycle.combinations) == letters
    # At the phase of the loads at which runs begin.
    differenced = differenced_multipliers(cycle, at=0.0, steps=STEPS)
    assert cycle.multipliers == pytest.approx(differenced[: cycle.multipliers.size], abs=1e-7)


def test_impacts_rub_by_the_slip_speed_before_them():
    """A mass that bounces on a belt: the tangential impulse depends on slip speed by the law."""
    contact = ss.Contact(tangential=0, normal=1, friction=STRIBECK, slider_speed=0.3, restitution=0.6)
    load = ss.Harmonic({"x2": 12.0}, frequency=4.0)
    for mass in ([1.0, 1.5], [[1.0, 0.2], [0.2, 1.5]]):
        scene = ss.Scene(
            mass,
            [[400.0, -60.0], [-60.0, 900.0]],
            damping=[[0.4, 0.0], [0.0, 0.6]],
            force=[0.0, -5.0],
            contacts=[contact],
            impact_friction=True,
            loads=[load],
        )
        start = ss.State([0.0, 0.01], [0.0, 0.0], "d")
        cycle = ss.simulate(scene, 40.0, start).limit_cycle()
        assert any(phase.event == "impact" for phase in cycle.phases)
        assert_multipliers(cycle, 1e-7, at=0.0, steps=STEPS)


def test_the_cycle_born_at_the_hopf_point_agrees_with_an_integrator():
    """The variational equations by an integrator of order 8; for one dof the product of multipliers is
    ``exp(int trace dt)`` (Liouville)."""
    speed = 1.01 * HOPF
    cycle = small_cycle(speed)
    assert cycle.combinations == ("+",)
    assert not cycle.stable
    assert cycle.is_followed()
    start = cycle.run.state(0.0)

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        slip = speed - y[1]
        change = np.array([[0.0, 1.0], [-100.0, -1.0 + 10.0 * 0.2 / 0.1 * np.exp(-slip / 0.1)]])
        force = 10.0 * STRIBECK.coefficient(float(slip))
        return np.concatenate([[y[1], -100.0 * y[0] - y[1] + force], (change @ y[2:].reshape(2, 2)).ravel()])

    first = np.concatenate([start.position, start.velocity, np.eye(2).ravel()])
    end = solve_ivp(rate, (0.0, cycle.period), first, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    assert end[:2] == pytest.approx(first[:2], abs=1e-13)
    monodromy = end[2:].reshape(2, 2)
    assert np.sort(np.linalg.eigvals(monodromy).real) == pytest.approx(
        np.sort(cycle.multipliers.real), abs=1e-10
    )
    assert cycle.transverse_multipliers[0].real == pytest.approx(np.linalg.det(monodromy), abs=1e-11)
    # The coordinates between them carry the given normal force.
    assert cycle.core.monodromy()[::2, ::2] == pytest.approx(monodromy, abs=1e-10)
    assert_multipliers(cycle, 1e-8, steps=STEPS)
    # What the belt brings in the damper takes.
    balance = cycle.balance()
    assert abs(balance.residual) <= 1e-13 * abs(balance.damping)
    # The Fourier series is the motion.
    series = cycle.harmonics(40).coefficient.values[:, 0]
    time = 0.37 * cycle.period
    sum_of = series[0] + 2.0 * np.sum(
        series[1:] * np.exp(2j * np.pi * np.arange(1, 41) * time / cycle.period)
    )
    assert sum_of.real == pytest.approx(cycle.run.state(time).position[0], abs=1e-13)


def test_a_run_settles_to_a_stable_cycle_without_events():
    """Friction that falls and rises again holds a small cycle: no contact ever sticks."""
    # mu falls about 0.3 m/s and rises on either side.
    speeds = np.linspace(0.0, 0.6, 61)
    values = 0.4 - 0.2 * (speeds - 0.3) + 6.0 * (speeds - 0.3) ** 3
    scene = block(0.3, Tabulated(speeds, values), 1.0)
    run = ss.simulate(scene, 40.0, kicked(scene, 0.02))
    assert len(run.events) == 0
    cycle = run.limit_cycle()
    assert cycle.combinations == ("+",)
    assert cycle.stable
    assert cycle.is_followed()
    assert_multipliers(cycle, 1e-8, steps=STEPS)
    assert cycle.period == pytest.approx(2.0 * np.pi / 10.0, rel=0.01)
    # Restored from its record, in the same scene.
    restored = type(cycle)(scene, type(cycle.core).from_record(scene.core, cycle.core.record()))
    assert restored.multipliers == pytest.approx(cycle.multipliers, abs=0.0)


@pytest.mark.parametrize(
    "scene", [block(0.2, Linear(0.3, 0.05)), block(0.5), skew_block(Stribeck(0.5, 0.3, 0.1, 0.3))]
)
def test_sliding_that_decays_is_an_equilibrium(scene):
    run = ss.simulate(scene, 10.0, kicked(scene, 0.05, -0.3))
    with pytest.raises(NotPeriodicError) as told:
        run.limit_cycle()
    assert told.value.kind == "equilibrium"


def test_uncoupled_blocks_keep_two_phases():
    """Two cycles of their own: the motion does not recur."""
    scene = two_blocks(coupling=0.0)
    with pytest.raises(NotPeriodicError) as told:
        ss.simulate(scene, 20.0, kicked(scene, 0.02, 1.0)).limit_cycle(further=20.0)
    assert told.value.kind in ("quasi-periodic", "undecided")


def test_a_motion_without_anything_that_comes_back_has_no_closed_cycle():
    scene = block(0.5)
    with pytest.raises(OrbitError, match="no event of the motion comes back"):
        ss.simulate(scene, 0.1, kicked(scene, 0.05)).closed_cycle()
    with pytest.raises(OrbitError):
        # The only orbit near is steady sliding itself.
        ss.simulate(scene, 5.0, kicked(scene, 1e-4)).closed_cycle()
