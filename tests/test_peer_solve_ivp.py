"""Against `solve_ivp` restarted at events: the same events, states within the peer's own error."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from peer_integrator import integrate
from random_scenes import drawn_scenes


def assert_same_motion(scene, start, duration):
    run = ss.simulate(scene, start, duration)
    coarse = integrate(scene, start, duration, longest_step=2e-4)
    fine = integrate(scene, start, duration, longest_step=1e-4)
    assert (coarse.contact, coarse.kind, coarse.combination) == (fine.contact, fine.kind, fine.combination)
    assert run.events.contact.tolist() == fine.contact
    assert run.events.kind.tolist() == fine.kind
    assert run.events.combination.tolist() == fine.combination
    n = scene.size
    position, velocity = run.event_states()
    end = run.state(duration)
    ours = np.vstack([np.hstack([position, velocity]), np.concatenate([end.position, end.velocity])])
    theirs, rough = (np.vstack([*motion.states, motion.end_state]) for motion in (fine, coarse))
    # What the peer changes by from steps twice as long, fourfold: at an impact of 2e-3 m/s rounding of its
    # event functions adds as much.
    scale = np.repeat([np.abs(theirs[:, :n]).max(), np.abs(theirs[:, n:]).max()], n)
    own_error = 4 * np.abs((theirs - rough) / scale).max() + 1e-12
    assert np.abs((ours - theirs) / scale).max() <= own_error
    assert own_error < 1e-5, "the peer is too far off to say anything"
    times = np.array([fine.time, coarse.time])
    time_error = 4 * np.abs(times[0] - times[1]).max(initial=0.0) + 1e-12 * duration
    assert np.abs(run.events.time - times[0]).max(initial=0.0) <= time_error
    return run


@pytest.mark.parametrize(("reference", "duration"), [("standard", 0.2), ("lifting", 0.13)])
def test_the_published_runs(request, reference, duration):
    known = request.getfixturevalue(reference)
    run = assert_same_motion(known.scene, known.start, duration)
    kinds = set(run.events.kind)
    assert {"velocity", "slip+", "release", "impact"} <= kinds


@given(drawn_scenes(min_friction=0.2), st.data())
def test_random_scenes(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.3, 2.0), label="strength"))
    assert_same_motion(drawn.scene, start, 0.02)
