"""What `method="auto"` chooses, by counts of what it computed."""

import numpy as np
import pytest

import stickslip as ss
from quad_block import quad_block, reduced_block


def kicked(scene, speed=0.5):
    return ss.steady_sliding(scene).perturbed(velocity={scene.dofs[0]: speed})


def test_coupled_masses_go_by_modes():
    """A term of the series of 209 coordinates is a product with the dense inverse of their mass."""
    scene = quad_block(14, 7, 14, lumped=False)
    # Damping in two parts, which modes with held contacts do not serve.
    scene = scene.replace(damping=10.0 * np.asarray(scene.mass) + 1e-7 * np.asarray(scene.stiffness))
    run = ss.simulate(scene, 2e-4, kicked(scene), method="auto")
    # One phase, begun by series and soon left to modes; series alone need twice as many panels.
    assert run.counters["phases"] == 1
    assert run.counters["taylor_phases"] == 0
    assert run.counters["panels"] < 120


def test_coupled_masses_stay_with_series_in_held_modes():
    """In these modes a term costs little, so that modes of the combination pay after hundreds of panels."""
    scene = quad_block(14, 7, 14, lumped=False)
    short, long = (ss.simulate(scene, duration, kicked(scene), method="auto") for duration in (2e-4, 1.0))
    assert short.counters["taylor_phases"] == short.counters["phases"] == 1
    assert (long.counters["taylor_phases"], long.counters["phases"]) == (0, 1)
    assert 500 < long.counters["panels"] < 5000


@pytest.mark.slow
def test_series_are_kept_where_combinations_hardly_return():
    scene = reduced_block(20, 10, 2, 40)
    runs = {
        method: ss.simulate(scene, 1e-2, kicked(scene), method=method, max_events=1800).counters
        for method in ("taylor", "auto")
    }
    combinations = runs["taylor"]["combinations"]
    assert combinations > 80
    # The modes of few are computed beside the series of all.
    assert runs["auto"]["combinations"] - combinations <= combinations // 20


@pytest.mark.slow
def test_modes_are_computed_where_combinations_return():
    scene = reduced_block(20, 10, 4, 40)
    counters = ss.simulate(scene, 1e-2, kicked(scene), method="auto", max_events=2000).counters
    # The commonest of some two dozen combinations go by modes.
    assert counters["taylor_phases"] <= 0.9 * counters["phases"]
