"""What a trajectory answers about itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from random_scenes import drawn_scenes

EPS = np.finfo(float).eps


@given(drawn_scenes(), st.data())
def test_state_and_sample_agree_and_a_run_can_be_cut_anywhere(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.1, 3.0), label="strength"))
    run = ss.simulate(drawn.scene, 0.05, start)
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
    run = ss.simulate(scene, 0.05, drawn.kicked(data.draw(st.floats(0.1, 3.0), label="strength")))
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
    run = ss.simulate(drawn.scene, 0.03, drawn.kicked(data.draw(st.floats(0.1, 3.0), label="strength")))
    times = np.linspace(0.0, run.duration, 50)
    coordinates = run.modal_coordinates(times)
    velocity = run.sample(times).velocity
    for row, combination in enumerate(coordinates.combination.values):
        modes = ss.complex_modes(drawn.scene, str(combination))
        z = coordinates.values[row, : len(modes)]
        assert np.isnan(coordinates.values[row, len(modes) :]).all()
        free = modes.mass.shape[0]
        # A conjugate adds the conjugate.
        z = np.where(modes.eigenvalues.imag > 0.0, 2.0, 1.0) * z
        rates = ss.equations_of(drawn.scene, str(combination)).right_basis @ (modes.right[free:] @ z).real
        for i, contact in enumerate(drawn.scene.contacts):
            if combination[i] == "s":
                rates = rates + contact.slider_speed * drawn.scene.tangential_direction(i)
        # The basis loses as many digits as its worst conditioned mode has.
        size = np.abs(modes.right[free:] * z).sum(axis=1).max() + np.abs(velocity.values[row]).max()
        tolerance = 1e3 * EPS * modes.condition.max() * size
        assert np.abs(rates - velocity.values[row]).max() <= tolerance


def test_limits_of_a_run(standard):
    run = ss.simulate(standard.scene, 0.6, standard.start, max_events=7)
    assert len(run.events) == 7
    assert run.stop_reason == "max_events"
    assert run.duration == run.events.time[-1]
    assert ss.simulate(standard.scene, 0.6, standard.start, max_events=0).stop_reason == "max_events"


def test_arrays_of_a_sample_carry_names_and_units(standard):
    run = ss.simulate(standard.scene, 0.13, standard.start)
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


@pytest.mark.parametrize("method", ["auto", "taylor", "local"])
@pytest.mark.parametrize("masses", [2, 40])
def test_what_a_slider_takes_along_moves_masses_at_rest(method, masses):
    """A chain at rest at the origin, pulled at its end: no term of its series of order 0 or 1 is there.

    Of two masses, ``m a'' = k (v t - a)`` gives ``a = v (t - sin(w t) / w)``.
    """
    stiffness, speed, holding = 10.0, 1.0, 2.0
    scene = ss.Scene(
        mass=np.ones(masses),
        stiffness=stiffness * (2.0 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1))
        - stiffness * np.diag(np.isin(np.arange(masses), [0, masses - 1])),
        contacts=[
            ss.Contact(tangential=masses - 1, normal_force=4.0, friction=holding / 4.0, slider_speed=speed)
        ],
    )
    start = ss.State(np.zeros(masses), np.append(np.zeros(masses - 1), speed), "s")
    run = ss.simulate(scene, 0.5, start, method=method)
    assert run.stop_reason == "duration"
    assert run.events.kind[0] == "slip+"
    turned = np.arcsin(holding * np.sqrt(1.0 / stiffness) / speed)
    if masses == 2:
        assert run.events.time[0] == pytest.approx(turned / np.sqrt(stiffness), rel=1e-14)
    # The wave reaches the other masses as a power of the time.
    early = ss.simulate(scene, 1e-2, start, method=method).state(1e-2)
    pulled = speed * 1e-2**3 * stiffness / 6.0
    assert early.position[-2] == pytest.approx(pulled, rel=1e-3)
