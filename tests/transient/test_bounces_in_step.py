"""Masses tied by springs that bounce in step: the springs never act, and each moves like one ball.

A ball falls from h in t1 = sqrt(2 h / g) and bounces for 2 e t1, 2 e^2 t1, ..: it rests at
t1 (1 + 2 e / (1 - e)).
"""

import numpy as np
import pytest

import stickslip as ss


def dropped(count, stiffness, restitution, kick=0.0, ground=0.0):
    """Masses of 1 kg in a chain, each on a spring of its own, under 1 N towards stops 1 m away."""
    springs = 2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    springs[0, 0] = springs[-1, -1] = 1.0 if count > 1 else 0.0
    springs = stiffness * springs + ground * np.eye(count)
    stops = [ss.Contact(normal=k, restitution=restitution) for k in range(count)]
    scene = ss.Scene([1.0] * count, springs, force=[-1.0] * count, contacts=stops)
    position = np.ones(count)
    position[0] += kick
    return scene, ss.State(position, [0.0] * count, "d" * count)


@pytest.mark.parametrize("method", ["auto", "taylor"])
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("stiffness", [1.0, 37.0, 100.0])
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.8])
def test_rests_like_one_ball(method, count, stiffness, restitution):
    scene, state = dropped(count, stiffness, restitution)
    rest = np.sqrt(2.0) * (1.0 + 2.0 * restitution / (1.0 - restitution))
    run = ss.simulate(scene, rest + 1.0, state, method=method)
    ends = run.events.time[run.events.kind == "accumulation"]
    # Each flight's end is known to some ulp of time, which the series adds up.
    assert ends == pytest.approx(count * [rest], abs=1e-14 * rest)
    assert run.stop_reason == "duration"
    assert np.all(run.state(rest + 1.0).velocity == 0.0)


@pytest.mark.parametrize("method", ["auto", "taylor", "modal"])
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("stiffness", [1.0, 37.0, 100.0])
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.8])
def test_held_masses_rest_like_one(method, count, stiffness, restitution):
    """The reference is one mass alone."""
    ends = []
    for masses in (1, count):
        scene, state = dropped(masses, stiffness, restitution, ground=0.3)
        run = ss.simulate(scene, 40.0, state, method=method)
        ends.append(run.events.time[run.events.kind == "accumulation"])
    assert ends[1] == pytest.approx(count * list(ends[0]), abs=1e-14 * ends[0][0])


@pytest.mark.parametrize("kick", [1e-15, -1e-15, 1e-14])
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.8])
def test_nearly_in_step(restitution, kick):
    scene, state = dropped(2, 37.0, restitution, kick)
    rest = np.sqrt(2.0) * (1.0 + 2.0 * restitution / (1.0 - restitution))
    run = ss.simulate(scene, rest + 1.0, state)
    ends = run.events.time[run.events.kind == "accumulation"]
    # The relative motion of a mass grows by 1 / e beside its own bounces, at most until they rest together.
    assert ends == pytest.approx([rest, rest], abs=1e-12 * rest)


def test_many_bounces_at_one_instant():
    """With e = 0.95 a series has 14 bounces while its rest shrinks from two ulp of time to one."""
    scene, state = dropped(1, 0.0, 0.95)
    rest = np.sqrt(2.0) * (1.0 + 2.0 * 0.95 / 0.05)
    for method in ("auto", "local"):
        run = ss.simulate(scene, rest + 1.0, state, method=method)
        assert run.stop_reason == "duration"
        assert run.events.time[-1] == pytest.approx(rest, rel=1e-14)


def test_the_limits_take_what_the_bounces_would():
    """With a coarse tolerance the second mass ends in flight, and its height counts, too."""
    scene, state = dropped(2, 1.0, 0.5, kick=1e-3, ground=0.3)
    run = ss.simulate(scene, 20.0, state, accumulation_tolerance=0.05)
    balance = run.balance()
    assert np.count_nonzero(run.events.kind == "accumulation") == 2
    # The loads change by part of themselves over the rest, and what is left has 1e-3 of the energy.
    assert abs(balance.residual) <= 1e-6 * balance.turnover
