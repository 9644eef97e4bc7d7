"""Loads in time against `solve_ivp`: the same events, states to what the peer knows of them."""

import numpy as np
import pytest

import stickslip as ss
from forced_peer import integrate_forced
from forced_scenes import scene_of


@pytest.mark.parametrize("seed", range(6))
def test_random_forced_scenes(seed):
    """One contact whose slider vibrates, loads that oscillate and one that is switched, masses apart."""
    scene, start = scene_of(seed)
    mass = scene.mass if scene.mass.ndim == 1 else np.diag(scene.mass)
    scene = scene.replace(restitution=0.0, impact_friction=False, mass=mass)
    start = ss.State(ss.steady_sliding(scene).position, start.velocity, "+")
    peer = integrate_forced(scene, start, 1.0)
    run = ss.simulate(scene, 1.0, start)
    events = run.events
    ours = list(zip(events.contact.tolist(), events.kind.tolist(), events.combination.tolist(), strict=True))
    assert ours == peer.labels()
    assert len(ours) > 5
    # DOP853 is told 1e-12 per step, and events start it again.
    assert np.abs(events.time - peer.time).max() <= 1e-10
    end = run.state(1.0)
    size = np.abs(peer.end_state).max()
    assert np.abs(np.concatenate([end.position, end.velocity]) - peer.end_state).max() <= 1e-10 * size
