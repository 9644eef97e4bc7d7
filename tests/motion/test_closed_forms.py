"""Motions that a formula gives from the first event to the last."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import stickslip as ss
from one_mass import MASS, oscillator

EPS = np.finfo(float).eps
#: kg


@given(st.floats(0.05, 0.5), st.floats(0.6, 6.0))
def test_coulomb_friction_takes_a_fixed_amplitude_per_half_cycle(friction, starts):
    """On a resting slider every half cycle loses 2 mu N / k, until the spring cannot break loose."""
    load, stiffness = 20.0, 3e4
    loss = 2.0 * friction * load / stiffness
    # Stopped at half a loss from the middle, the mass is as close to sliding as to sticking.
    assume(abs((starts - 0.5) - round(starts - 0.5)) > 1e-9)
    omega = np.sqrt(stiffness / MASS)
    scene = oscillator(friction=friction)
    halves = int(np.ceil(starts - 0.5))
    # Released from rest it slides towards the middle, with friction T = +mu N against it.
    start = ss.State([starts * loss, 0.0], [0.0, 0.0], "+")
    run = ss.simulate(scene, (halves + 1) * np.pi / omega, start)
    assert len(run.events) == halves
    turns = np.pi / omega * np.arange(1, halves + 1)
    # x' vanishes with slope omega^2 times the distance from the middle of the half cycle.
    middle = np.abs(starts - np.arange(halves) - 0.5) * loss
    assert (np.abs(run.events.time - turns) <= 20 * EPS * (turns + starts * loss / (omega * middle))).all()
    position, velocity = run.event_states()
    sides = (-1.0) ** np.arange(1, halves + 1)
    left = sides * (starts - np.arange(1, halves + 1)) * loss
    assert np.abs(position[:, 0] - left).max(initial=0.0) <= 20 * EPS * starts * loss * (halves + 1)
    assert not velocity.any()
    assert run.state(run.duration).combination == "s"


@given(
    st.floats(0.1, 1.0),
    st.floats(1.05, 3.0),
    st.floats(0.005, 0.2),
    st.sampled_from([-1.0, 1.0]),
    st.floats(5, 200),
)
def test_stick_slip_with_static_friction(friction, ratio, speed, direction, load):
    """The mass is carried to static_friction N / k, slips, and is caught when it moves with the belt again.

    Slip from rest on the belt: x' = v cos(w t) - a w sin(w t), a = (static - kinetic) N / k; it equals v
    again at w t / 2 = pi - atan(a w / v). The belt then carries it back over 2 a.
    """
    stiffness = 3e4
    omega = np.sqrt(stiffness / MASS)
    scene = oscillator(friction=friction, static=ratio * friction, speed=direction * speed, load=(0.0, -load))
    amplitude = (ratio - 1.0) * friction * load / stiffness
    slip = 2.0 / omega * (np.pi - np.arctan(amplitude * omega / speed))
    stick = 2.0 * amplitude / speed
    caught = direction * (friction * load / stiffness - amplitude)
    start = ss.State([caught, 0.0], [direction * speed, 0.0], "s")
    run = ss.simulate(scene, 3.5 * (slip + stick), start)
    sign = "+" if direction > 0 else "-"
    assert [*run.events.kind[:6]] == [f"slip{sign}", "velocity"] * 3
    assert [*run.events.combination[:6]] == [sign, "s"] * 3
    expected = np.cumsum([stick, slip] * 3)
    # The onset is the root of a force with slope k v, the catch that of a velocity with slope w^2 a.
    slopes = ratio * friction * load / (stiffness * speed) + speed / (omega**2 * amplitude)
    rounding = 20 * EPS * (slopes + expected)
    assert (np.abs(run.events.time[:6] - expected) <= rounding).all()


@given(
    st.floats(0.1, 1.0), st.floats(0.005, 0.2), st.sampled_from([-1.0, 1.0]), st.floats(5, 200), st.booleans()
)
def test_a_mass_dragged_by_a_belt_through_its_spring(friction, speed, direction, load, taylor):
    """Stuck from x = 0 it is carried to mu N / k; then, with no static excess, it slides by itself for ever.

    At the onset of slip, a double root of the slip velocity, it moves with the belt. From there
    x = mu N / k + (v / w) sin(w t), slower than the belt until w t = 2 pi, where x' touches v from below.
    """
    stiffness = 3e4
    omega = np.sqrt(stiffness / MASS)
    scene = oscillator(friction=friction, speed=direction * speed, load=(0.0, -load))
    start = ss.State([0.0, 0.0], [direction * speed, 0.0], "s")
    onset = friction * load / (stiffness * speed)
    run = ss.simulate(scene, onset + 0.9 * 2 * np.pi / omega, start, method="taylor" if taylor else "auto")
    assert run.events.kind.tolist() == ["slip+" if direction > 0 else "slip-"]
    assert run.events.time[0] == pytest.approx(onset, rel=20 * EPS)
    after = np.linspace(0.0, 0.9, 50) * 2 * np.pi / omega
    sample = run.sample(np.minimum(run.events.time[0] + after, run.duration))
    static, amplitude = friction * load / stiffness, speed / omega
    expected = direction * (static + amplitude * np.sin(omega * after))
    # The phase of the slide carries the rounding of the onset.
    rounding = 40 * EPS * (static + amplitude + speed * run.duration)
    assert np.abs(sample.position.values[:, 0] - expected).max() <= rounding


@given(st.floats(0.05, 0.9), st.floats(1e-4, 1e-2), st.floats(1.0, 20.0), st.booleans())
def test_bounces_of_a_falling_mass_accumulate(restitution, height, gravity, taylor):
    """A rigid-body mode without stiffness: flights 2 e^k v / g after the fall, at rest after their sum."""
    scene = oscillator(
        restitution=restitution, stiffness=(3e4, 0.0), load=(0.0, -MASS * gravity), friction=0.3, speed=0.1
    )
    fall = np.sqrt(2.0 * height / gravity)
    arrival = gravity * fall
    end = fall + 2.0 * arrival / gravity * restitution / (1.0 - restitution)
    start = ss.State([0.0, height], [0.0, 0.0], "d")
    run = ss.simulate(scene, 1.1 * end, start, method="taylor" if taylor else "auto")
    (limit,) = run.accumulations
    assert run.events.kind[limit.event] == "accumulation"
    assert set(run.events.kind[: limit.event]) == {"impact"}
    k = np.arange(limit.event)
    impacts = fall + 2.0 * arrival / gravity * restitution * (1.0 - restitution**k) / (1.0 - restitution)
    # Every flight repeats the rounding of its speed, g of its curvature.
    rounding = 20 * EPS * end / (1.0 - restitution)
    assert np.abs(run.events.time[: limit.event] - impacts).max() <= rounding
    assert abs(run.events.time[limit.event] - end) <= limit.error + rounding
    speeds = run.event_states()[1][: limit.event, 1]
    assert np.abs(speeds / (arrival * restitution ** (k + 1)) - 1.0).max() <= 20 * EPS * (k.size + 1)
    assert limit.error <= 1e-6 * np.spacing(end)
    # It lies still from then on, and presses with its weight.
    rest = run.sample(np.linspace(run.events.time[limit.event], run.duration, 5))
    assert not rest.position.values[:, 1].any()
    assert rest.normal_force.values == pytest.approx(MASS * gravity, rel=4 * EPS)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_a_coarser_accumulation_skips_the_bounces_it_says(tolerance):
    """The rest of the series is replaced where it falls below the tolerance; the limit itself stays."""
    restitution, gravity, height = 0.7, 9.81, 1e-2
    scene = oscillator(restitution=restitution, stiffness=(3e4, 0.0), load=(0.0, -MASS * gravity))
    fall = np.sqrt(2.0 * height / gravity)
    end = fall * (1.0 + 2.0 * restitution / (1.0 - restitution))
    run = ss.simulate(scene, 1.0, ss.State([0.0, height], [0.0, 0.0], "d"), accumulation_tolerance=tolerance)
    (limit,) = run.accumulations
    bounces = limit.event
    rest = 2.0 * fall * restitution**bounces / (1.0 - restitution)
    assert rest <= tolerance < rest / restitution
    assert run.events.time[bounces] == pytest.approx(end, abs=limit.error + 40 * EPS * end)
    # Counted down to flights of one ulp of t.
    left = np.log(rest / np.spacing(end)) / -np.log(restitution)
    assert limit.bounces == pytest.approx(left, abs=1.0)


@given(st.floats(1e-4, 1e-2), st.sampled_from([0.0, 0.3, 0.9]))
def test_impact_of_an_oscillator_on_a_rigid_stop(lift, restitution):
    """Released at rest from a lift, about an equilibrium d below the stop: cos(w t) = d / (d + lift)."""
    omega = np.sqrt(5e4 / MASS)
    depth = 20.0 / 5e4
    scene = oscillator(restitution=restitution)
    first = np.arccos(depth / (depth + lift)) / omega
    arrival = omega * np.sqrt((depth + lift) ** 2 - depth**2)
    # Thrown back with e times the speed: half a period plus or minus the phase of the throw.
    back = restitution * arrival
    flight = 2.0 * np.arctan2(back, omega * depth) / omega
    run = ss.simulate(scene, first + 0.9 * flight + 1e-4, ss.State([0.0, lift], [0.0, 0.0], "d"))
    assert run.events.kind.tolist() == ["impact"]
    assert run.events.time[0] == pytest.approx(first, rel=20 * EPS * (1.0 + depth / lift))
    position, velocity = run.event_states()
    assert position[0, 1] == 0.0
    # The speed of arrival is a root of a difference when the lift is small beside the depth.
    assert velocity[0, 1] == pytest.approx(back, rel=20 * EPS * (1.0 + depth / lift))
    closed = restitution == 0.0
    assert run.events.combination[0] == ("+" if closed else "d")
    if closed:
        assert run.sample(run.duration).normal_force.item() == pytest.approx(20.0, rel=10 * EPS)


@given(st.floats(0.1, 1.0), st.floats(1e-4, 1.0), st.integers(3, 40), st.booleans())
def test_free_oscillator_on_a_stop_at_its_equilibrium(restitution, speed, bounces, taylor):
    """Without load or damping every flight lasts half a cycle, and returns with e times the speed."""
    omega = np.sqrt(5e4 / MASS)
    scene = oscillator(restitution=restitution, load=(0.0, 0.0))
    duration = (bounces + 0.5) * np.pi / omega
    start = ss.State([0.0, 0.0], [0.0, speed], "d")
    run = ss.simulate(scene, duration, start, method="taylor" if taylor else "auto")
    assert run.events.kind.tolist() == ["impact"] * bounces
    k = np.arange(1, bounces + 1)
    # Each half cycle is as exact as omega, whose own rounding they all share.
    assert np.abs(run.events.time * omega / (np.pi * k) - 1.0).max() <= 20 * EPS
    speeds = run.event_states()[1][:, 1]
    assert np.abs(speeds / (speed * restitution**k) - 1.0).max() <= 20 * EPS * bounces


def test_release_when_the_normal_force_reaches_zero():
    """A closed mass tied to a moving one by a spring: N = -F - k y(t), y = a cos(w t)."""
    tie = 1e4
    contact = ss.Contact(tangential=0, normal=1, friction=0.0, slider_speed=1.0)
    stiffness = np.array([[1e4, 0.0, 0.0], [0.0, tie, -tie], [0.0, -tie, tie]])
    scene = ss.Scene([1.0, 1.0, 0.5], stiffness, force=[0.0, -5.0, 0.0], contacts=[contact])
    amplitude = 1e-3
    run = ss.simulate(scene, 0.02, ss.State([0, 0, -amplitude], [0, 0, 0], "+"))
    # N = 5 - tie * y with y = -amplitude cos(w t) rising through zero to 5 / tie.
    expected = np.arccos(-5.0 / (tie * amplitude)) / np.sqrt(tie / 0.5)
    assert run.events.kind[0] == "release"
    assert run.events.combination[0] == "d"
    assert run.events.time[0] == pytest.approx(expected, rel=20 * EPS)


@given(st.floats(1e-3, 0.3), st.floats(0.2, 1.0))
def test_viscous_decay_between_impacts(ratio, restitution):
    """At damping ratio z a half cycle lasts pi / (w sqrt(1 - z^2)) and keeps exp(-pi z / sqrt(1 - z^2))."""
    omega = np.sqrt(5e4 / MASS)
    scene = oscillator(
        restitution=restitution, load=(0.0, 0.0), damping=ss.Rayleigh(mass=2.0 * ratio * omega)
    )
    damped = omega * np.sqrt(1.0 - ratio**2)
    run = ss.simulate(scene, 8.5 * np.pi / damped, ss.State([0.0, 0.0], [0.0, 0.1], "d"))
    k = np.arange(1, 9)
    assert run.events.kind.tolist() == ["impact"] * 8
    assert np.abs(run.events.time * damped / (np.pi * k) - 1.0).max() <= 20 * EPS
    kept = restitution * np.exp(-np.pi * ratio * omega / damped)
    assert np.abs(run.event_states()[1][:, 1] / (0.1 * kept**k) - 1.0).max() <= 200 * EPS
