"""Nonlinear modes beside limit cycles that are known, the energy balance, and the motion itself."""

import numpy as np
import pytest

import stickslip as ss

STIFFNESS = np.array([[2.0, -1.0], [-1.0, 2.0]])


def belt():
    """Mass on a belt under friction that falls with the slip speed (bSTAB, case_friction)."""
    law = ss.friction.Stribeck(static=1.0, kinetic=0.5, speed=0.5)
    contact = ss.Contact(tangential="x", normal_force=1.0, friction=law, slider_speed=1.5)
    return ss.Scene([1.0], [[1.0]], [[0.1]], contacts=[contact], dofs=["x"])


def joint(damping=0.01):
    """Two masses, one of them on an elastic joint that slides."""
    contact = ss.Contact(tangential="x1", normal_force=1.0, friction=0.2, tangential_stiffness=0.5)
    return ss.Scene([1.0, 1.0], STIFFNESS, ss.Rayleigh(stiffness=damping), contacts=[contact])


def stop():
    contact = ss.Contact(normal="x", gap=1.0, restitution=0.8)
    return ss.Scene([1.0], [[1.0]], [[0.02]], contacts=[contact], dofs=["x"])


def test_delta_vanishes_at_the_unstable_limit_cycle():
    """The cycle that bounds the basin of steady sliding, known to 13 digits."""
    steady = ss.steady_sliding(belt()).position[0]
    # Of the cycle whose largest distance from steady sliding is 1.330254955995 m.
    amplitude = 1.2526186589761925
    mode = ss.nonlinear_mode(belt(), 0, [0.5, amplitude, 1.4])
    assert mode.data.delta.to_numpy() == pytest.approx([0.04372782, 0.0, -0.016], abs=2e-3)
    assert abs(mode.data.delta[1]) < 1e-12
    cycle = mode.cycles[1]
    assert cycle.period == pytest.approx(6.295334793503, abs=1e-11)
    assert cycle.maximum[0] - steady == pytest.approx(1.330254955995, abs=1e-11)
    assert not cycle.stable


def test_small_amplitudes_have_the_linear_mode():
    linear = ss.complex_modes(belt(), "+")[0]
    mode = ss.nonlinear_mode(belt(), 0, [1e-3])
    assert mode.data.delta[0] == pytest.approx(-2.0 * linear.eigenvalue.real, rel=1e-5)
    assert mode.data.frequency[0] == pytest.approx(1.0 / (2.0 * np.pi), rel=1e-5)


@pytest.mark.parametrize("number", [0, 1])
def test_every_mode_is_periodic_and_balanced(number):
    amplitudes = [0.6, 1.0, 2.0]
    mode = ss.nonlinear_mode(joint(), number, amplitudes)
    linear = ss.complex_modes(joint(), "s")[number]
    held, free = linear.frequency, np.sqrt([1.0, 3.0])[number] / (2.0 * np.pi)
    assert mode.data.amplitude.max("dof").to_numpy() == pytest.approx(amplitudes, rel=0.2)
    # Between the frequencies with the joint stuck and without it.
    assert (np.diff(mode.data.frequency) < 0.0).all()
    assert ((mode.data.frequency > free) & (mode.data.frequency < held)).all()
    assert mode.data.followed.all()
    for cycle, delta in zip(mode.cycles, mode.data.delta.to_numpy(), strict=True):
        fed = joint().replace(damping=0.01 * STIFFNESS - delta * np.eye(2))
        start = cycle.run.state(0.0)
        after = ss.simulate(fed, cycle.period, start).state(cycle.period)
        assert after.position == pytest.approx(start.position, abs=1e-10)
        assert after.velocity == pytest.approx(start.velocity, abs=1e-10)
        # What delta feeds in is what friction and damping take.
        assert abs(cycle.balance().residual) < 1e-12


def test_impacts_are_made_up_for():
    mode = ss.nonlinear_mode(stop(), 0, [1.05, 1.5])
    assert mode.data.damping_ratio[1] > mode.data.damping_ratio[0] > 0.01
    for cycle, amplitude in zip(mode.cycles, (1.05, 1.5), strict=True):
        assert cycle.amplitude[0] == pytest.approx(amplitude, rel=1e-12)
        assert list(cycle.run.events.kind) == ["impact"]
        assert abs(cycle.balance().residual) < 1e-12


def test_every_view_of_it(tmp_path):
    mode = ss.nonlinear_mode(joint(), 0, [1.0, 2.0])
    assert "2 orbits" in repr(mode)
    assert "delta" in str(mode.summary())
    assert mode.plot().lines
    ss.save(mode, tmp_path / "mode.nc")
    read = ss.load(tmp_path / "mode.nc")
    assert read.data.damping_ratio.to_numpy() == pytest.approx(mode.data.damping_ratio.to_numpy())
    assert [cycle.period for cycle in read.cycles] == [cycle.period for cycle in mode.cycles]


def test_a_motion_without_events_is_the_linear_mode():
    with pytest.raises(ss.OrbitError, match=r"amplitude 0\.05 m of x1: no event happens"):
        ss.nonlinear_mode(joint(), 0, [0.05], dof="x1")


def test_a_period_between_two_impacts_is_not_linear():
    """The linear mode would pass the stop at 0.6 m; a period of the motion lies between two impacts."""
    stiffness = np.array([[4.0, 0.5, 1.8], [0.5, 4.5, 0.7], [1.8, 0.7, 6.4]])
    contact = ss.Contact(normal="x1", gap=0.6, restitution=0.8)
    scene = ss.Scene([0.7, 1.2, 1.8], stiffness, 0.02 * stiffness, contacts=[contact])
    message = ""
    try:
        cycle = ss.nonlinear_mode(scene, 0, [0.9], dof="x1").cycles[0]
        assert len(cycle.run.events)
    except ss.OrbitError as error:
        message = str(error)
    assert "no event happens" not in message


def test_amplitudes_found_before_are_kept():
    with pytest.raises(ss.OrbitError, match=r"amplitude 1e\+300 m of x") as caught:
        ss.nonlinear_mode(stop(), 0, [1.05, 1e300])
    assert len(caught.value.partial.cycles) == 1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ss.nonlinear_mode(1.0, 0, [1.0]), "scene: expected a Scene"),
        (lambda: ss.nonlinear_mode(ss.Scene([1.0], [[1.0]]), 0, [1.0]), "scene: expected a contact"),
        (
            lambda: ss.nonlinear_mode(joint().replace(loads=[ss.Harmonic({"x1": 1.0}, 1.0)]), 0, [1.0]),
            "scene: .*without loads in time",
        ),
        (lambda: ss.nonlinear_mode(joint(), 2, [1.0]), "mode: there are 2 modes"),
        (lambda: ss.nonlinear_mode(joint(), -1, [1.0]), "mode"),
        (lambda: ss.nonlinear_mode(joint(300.0), 1, [1.0]), "mode: number 1 does not oscillate"),
        (lambda: ss.nonlinear_mode(joint(), 0, [1.0, 0.5]), "amplitudes: .*ascending"),
        (lambda: ss.nonlinear_mode(joint(), 0, []), "amplitudes"),
        (lambda: ss.nonlinear_mode(joint(), 0, [np.nan]), "amplitudes"),
        (lambda: ss.nonlinear_mode(joint(), 0, [1.0], dof="x3"), "dof: the scene has no dof 'x3'"),
    ],
)
def test_what_is_refused(call, message):
    with pytest.raises(ss.InputError, match=message):
        call()
