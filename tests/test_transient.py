"""Motions with a closed form, and what a trajectory answers about itself."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import stickslip as ss
from random_scenes import drawn_scenes

EPS = np.finfo(float).eps


def oscillator(
    *, friction=0.0, speed=0.0, static=None, restitution=0.0, stiffness=(3e4, 5e4), load=(0.0, -20.0)
):
    """One mass of 1.5 kg without damping: x1 along a slider, x2 normal to it."""
    contact = ss.Contact(
        tangential=0,
        normal=1,
        friction=friction,
        static_friction=static,
        slider_speed=speed,
        restitution=restitution,
    )
    return ss.Scene([1.5, 1.5], np.diag(stiffness), force=load, contacts=[contact])


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
    omega = np.sqrt(stiffness / 1.5)
    scene = oscillator(friction=friction, static=ratio * friction, speed=direction * speed, load=(0.0, -load))
    amplitude = (ratio - 1.0) * friction * load / stiffness
    slip = 2.0 / omega * (np.pi - np.arctan(amplitude * omega / speed))
    stick = 2.0 * amplitude / speed
    caught = direction * (friction * load / stiffness - amplitude)
    start = ss.State([caught, 0.0], [direction * speed, 0.0], "s")
    run = ss.simulate(scene, start, 3.5 * (slip + stick))
    sign = "+" if direction > 0 else "-"
    assert [*run.events.kind[:6]] == [f"slip{sign}", "velocity"] * 3
    assert [*run.events.combination[:6]] == [sign, "s"] * 3
    expected = np.cumsum([stick, slip] * 3)
    # Onset and catch are roots of functions that vanish with slope k v and k v: rounding of the load in time.
    rounding = 20 * EPS * (ratio * friction * load / (stiffness * speed) + expected)
    assert (np.abs(run.events.time[:6] - expected) <= rounding).all()


@given(st.floats(0.05, 0.5), st.floats(0.6, 6.0))
def test_coulomb_friction_takes_a_fixed_amplitude_per_half_cycle(friction, starts):
    """On a resting slider every half cycle loses 2 mu N / k, until the spring cannot break loose."""
    load, stiffness = 20.0, 3e4
    loss = 2.0 * friction * load / stiffness
    # Stopped at half a loss from the middle, the mass is as close to sliding as to sticking.
    assume(abs((starts - 0.5) - round(starts - 0.5)) > 1e-9)
    omega = np.sqrt(stiffness / 1.5)
    scene = oscillator(friction=friction)
    halves = int(np.ceil(starts - 0.5))
    # Released from rest it slides towards the middle, with friction T = +mu N against it.
    start = ss.State([starts * loss, 0.0], [0.0, 0.0], "+")
    run = ss.simulate(scene, start, (halves + 1) * np.pi / omega)
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


@given(st.floats(1e-4, 1e-2), st.sampled_from([0.0, 0.3, 0.9]))
def test_impact_of_an_oscillator_on_a_rigid_stop(lift, restitution):
    """Released at rest from a lift, about an equilibrium d below the stop: cos(w t) = d / (d + lift)."""
    omega = np.sqrt(5e4 / 1.5)
    depth = 20.0 / 5e4
    scene = oscillator(restitution=restitution)
    first = np.arccos(depth / (depth + lift)) / omega
    arrival = omega * np.sqrt((depth + lift) ** 2 - depth**2)
    # Thrown back with e times the speed: half a period plus or minus the phase of the throw.
    back = restitution * arrival
    flight = 2.0 * np.arctan2(back, omega * depth) / omega
    run = ss.simulate(scene, ss.State([0.0, lift], [0.0, 0.0], "d"), first + 0.9 * flight + 1e-4)
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


def test_release_when_the_normal_force_reaches_zero():
    """A closed mass tied to a moving one by a spring: N = -F - k y(t), y = a cos(w t)."""
    tie = 1e4
    contact = ss.Contact(tangential=0, normal=1, friction=0.0, slider_speed=1.0)
    stiffness = np.array([[1e4, 0.0, 0.0], [0.0, tie, -tie], [0.0, -tie, tie]])
    scene = ss.Scene([1.0, 1.0, 0.5], stiffness, force=[0.0, -5.0, 0.0], contacts=[contact])
    amplitude = 1e-3
    run = ss.simulate(scene, ss.State([0, 0, -amplitude], [0, 0, 0], "+"), 0.02)
    # N = 5 - tie * y with y = -amplitude cos(w t) rising through zero to 5 / tie.
    expected = np.arccos(-5.0 / (tie * amplitude)) / np.sqrt(tie / 0.5)
    assert run.events.kind[0] == "release"
    assert run.events.combination[0] == "d"
    assert run.events.time[0] == pytest.approx(expected, rel=20 * EPS)


@given(drawn_scenes(), st.data())
def test_state_and_sample_agree_and_a_run_can_be_cut_anywhere(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.1, 3.0), label="strength"))
    run = ss.simulate(drawn.scene, start, 0.05)
    times = np.sort(drawn.rng.uniform(0.0, run.duration, 20))
    sample = run.sample(drawn.rng.permutation(times)).sortby("time")
    for time in times:
        state, row = run.state(time), sample.sel(time=time)
        assert np.array_equal(state.position, row.position.values)
        assert np.array_equal(state.velocity, row.velocity.values)
        assert state.combination == "".join(row.status.values)
    begin = run.sample(0.0).position.values[0]
    # To contact coordinates and back.
    assert np.abs(begin - start.position).max() <= 8 * EPS * np.abs(start.position).max()
    at_events = run.sample(run.events.time)
    position, velocity = run.event_states()
    assert np.array_equal(at_events.position.values, position)
    assert np.array_equal(at_events.velocity.values, velocity)
    statuses = ["".join(row) for row in at_events.status.values]
    assert statuses == run.events.combination.tolist()


@given(drawn_scenes(), st.data())
def test_contact_conditions_hold_between_events(drawn, data):
    scene = drawn.scene
    run = ss.simulate(scene, drawn.kicked(data.draw(st.floats(0.1, 3.0), label="strength")), 0.05)
    sample = run.sample(np.linspace(0.0, run.duration, 2001))
    force = np.abs(sample.normal_force).values.max() + np.abs(scene.force).max()
    # Constraints are exact coordinates; forces and slip velocities carry rounding of their terms.
    force_rounding = 1e-10 * force
    speed_rounding = 1e-10 * np.abs(sample.velocity).values.max()
    for i, contact in enumerate(scene.contacts):
        normal = contact.normal if np.ndim(contact.normal) else np.eye(scene.size)[contact.normal]
        gap = sample.position.values @ normal + contact.gap
        slip = sample.velocity.values @ scene.tangential_direction(i) - contact.slider_speed
        status = sample.status.values[:, i]
        normal_force, friction_force = sample.normal_force.values[:, i], sample.friction_force.values[:, i]
        closed = status != "d"
        assert np.abs(gap[closed]).max(initial=0.0) <= 1e-12 * np.abs(sample.position).values.max()
        assert gap.min() >= -1e-12 * np.abs(sample.position).values.max()
        assert normal_force.min() >= -force_rounding
        assert not normal_force[~closed].any()
        assert not friction_force[~closed].any()
        assert np.abs(slip[status == "s"]).max(initial=0.0) <= speed_rounding
        if contact.static_friction > 0.0:
            assert slip[status == "+"].max(initial=0.0) <= speed_rounding
            assert slip[status == "-"].min(initial=0.0) >= -speed_rounding
        cone = contact.static_friction * normal_force - np.abs(friction_force)
        assert cone[status == "s"].min(initial=0.0) >= -force_rounding
        for letter, sign in (("+", 1.0), ("-", -1.0)):
            chosen = status == letter
            expected = sign * contact.friction * normal_force[chosen]
            assert np.abs(friction_force[chosen] - expected).max(initial=0.0) <= force_rounding


@given(drawn_scenes(), st.data())
def test_modal_coordinates_build_the_motion(drawn, data):
    run = ss.simulate(drawn.scene, drawn.kicked(data.draw(st.floats(0.1, 3.0), label="strength")), 0.03)
    times = np.linspace(0.0, run.duration, 50)
    coordinates = run.modal_coordinates(times)
    velocity = run.sample(times).velocity
    for row, combination in enumerate(coordinates.combination.values):
        modes = ss.complex_modes(drawn.scene, str(combination))
        z = coordinates.values[row, : modes.eigenvalues.size]
        assert np.isnan(coordinates.values[row, modes.eigenvalues.size :]).all()
        free = modes.eigenvalues.size // 2
        rates = ss.reduce(drawn.scene, str(combination)).right_basis @ (modes.right[free:] @ z)
        for i, contact in enumerate(drawn.scene.contacts):
            if combination[i] == "s":
                rates = rates + contact.slider_speed * drawn.scene.tangential_direction(i)
        # The basis loses as many digits as its worst conditioned mode has.
        size = np.abs(modes.right[free:] * z).sum(axis=1).max() + np.abs(velocity.values[row]).max()
        tolerance = 1e3 * EPS * modes.condition.max() * size
        assert np.abs(rates - velocity.values[row]).max() <= tolerance


def test_limits_of_a_run(standard):
    run = ss.simulate(standard.scene, standard.start, 0.6, max_events=7)
    assert len(run.events) == 7
    assert run.stop_reason == "max_events"
    assert run.duration == run.events.time[-1]
    assert ss.simulate(standard.scene, standard.start, 0.6, max_events=0).stop_reason == "max_events"


def test_arrays_of_a_sample_carry_names_and_units(standard):
    run = ss.simulate(standard.scene, standard.start, 0.13)
    sample = run.sample([0.0, 0.125])
    assert sample.position.dims == sample.velocity.dims == ("time", "dof")
    assert sample.normal_force.dims == sample.friction_force.dims == sample.status.dims == ("time", "contact")
    units = {name: sample[name].attrs.get("units") for name in sample.variables}
    assert units["position"] == "m"
    assert units["velocity"] == "m/s"
    assert units["normal_force"] == units["friction_force"] == "N"
    assert units["time"] == "s"
    assert sample.dof.values.tolist() == [f"x{i}" for i in range(1, 9)]
    assert sample.status.sel(time=0.125).values.tolist() == ["s", "+"]
    assert f"{len(run.events)} events" in repr(run)
    assert repr(run.events).startswith(f"Events({len(run.events)})")
