"""Against `solve_ivp` restarted at events: the same events, states within the peer's own error."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from peer_integrator import assert_same_motion
from random_scenes import drawn_scenes


@pytest.mark.parametrize(("reference", "duration"), [("standard", 0.2), ("lifting", 0.13)])
def test_the_published_runs(request, reference, duration):
    known = request.getfixturevalue(reference)
    run = assert_same_motion(known.scene, known.start, duration)
    assert {"velocity", "slip+", "release", "impact"} <= set(run.events.kind)


@pytest.mark.slow
@given(drawn_scenes(min_friction=0.2), st.data())
def test_random_scenes(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.3, 2.0), label="strength"))
    assert_same_motion(drawn.scene, start, 0.02)
