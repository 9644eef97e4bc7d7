"""`method="auto"`: which propagator a phase gets, by counted work alone."""

import numpy as np

import stickslip as ss
from equal_chain import equal_chain, long_chain

EPS = np.finfo(float).eps


def chain(count, **changes):
    """Equal subsystems, which slide stably at friction 0.3."""
    return equal_chain(count, **{"friction": 0.3, "damping": 2e-5, **changes})


def test_a_long_quiet_phase_goes_over_to_modes():
    """Five subsystems leave 15 coordinates: Taylor series for a while, then modes from its start."""
    scene = chain(5)
    start = ss.sliding_equilibrium(scene).perturbed(velocity={"x1": 1e-4})
    short, long = (ss.simulate(scene.replace(), start, duration) for duration in (2e-3, 1.0))
    assert len(short.events) == len(long.events) == 0
    assert (short.counters["taylor_phases"], short.counters["leaps"]) == (1, 0)
    assert long.counters["taylor_phases"] == 0
    assert long.counters["leaps"] > 0
    assert long.counters["combinations"] == 2  # series, then modes
    series = ss.simulate(scene, start, 1.0, method="taylor")
    assert long.counters["panels"] < 0.5 * series.counters["panels"]
    for time in (0.0, 1e-3, 0.3, 1.0):
        one, other = long.state(time), series.state(time)
        scale = np.abs(start.position).max()
        # Both as far as rounding of the equilibrium keeps them apart, over a thousand panels.
        assert np.abs(one.position - other.position).max() <= 1e4 * EPS * scale


def test_combinations_that_return_are_worth_their_modes():
    scene = chain(3, friction=1.5, static_friction=1.8)
    start = ss.sliding_equilibrium(chain(3)).perturbed(velocity={"x1": 0.3, "x5": -0.2})
    runs = {
        method: ss.simulate(scene.replace(), start, 0.1, method=method)
        for method in ("auto", "modal", "taylor")
    }
    counters = runs["auto"].counters
    assert 0 < counters["taylor_phases"] < counters["phases"]
    for other in (runs["modal"], runs["taylor"]):
        same = min(len(other.events), 20)
        assert same == 20
        assert np.array_equal(runs["auto"].events.combination[:same], other.events.combination[:same])
        assert np.abs(runs["auto"].events.time[:same] - other.events.time[:same]).max() <= 1e-11


def test_the_choice_does_not_depend_on_runs_before():
    """A scene that remembers modes gives the same bits as one that has met nothing."""
    scene = chain(5, friction=1.5)
    start = ss.sliding_equilibrium(chain(5)).perturbed(velocity={"x1": 0.3})
    fresh = ss.simulate(scene, start, 0.05)
    ss.simulate(scene, start, 0.05, method="modal")
    again = ss.simulate(scene, start, 0.05)
    assert len(fresh.events) > 20
    assert np.array_equal(fresh.events.time, again.events.time)
    assert np.array_equal(fresh.event_states()[0], again.event_states()[0])
    assert again.counters == {**fresh.counters, "combinations": 0}


def test_a_scene_too_large_for_an_eigenproblem_stays_with_series():
    run = ss.simulate(*long_chain(100), 1e-3)
    assert run.counters["taylor_phases"] == run.counters["phases"]
