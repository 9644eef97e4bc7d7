"""Both 220-bit reference solutions: every event, its time, and the state at the end."""

import numpy as np
import pytest

import stickslip as ss


@pytest.fixture(scope="module", params=["standard", "lifting"])
def reference(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module", params=["equilibrium", "printed start"])
def run(request, reference):
    if request.param == "equilibrium":
        start = ss.steady_sliding(reference.scene).perturbed(velocity=reference.perturbation)
    else:
        start = reference.start
    return ss.simulate(reference.scene, reference.duration, start)


def test_the_same_events_in_the_same_order(run, reference):
    assert len(run.events) == len(reference.time)
    assert np.array_equal(run.events.contact, reference.contact)
    assert np.array_equal(run.events.kind, reference.kind)
    assert np.array_equal(run.events.combination, reference.combination)
    assert run.stop_reason == "duration"
    assert run.duration == reference.duration


def test_event_times(run, reference):
    error = np.abs(run.events.time - reference.time)
    # Some dozen ulp of the times themselves; no event of these runs is ill-conditioned.
    assert error[:100].max() <= 2e-14
    assert error.max() <= 4e-14


def test_states_at_the_last_event_and_at_the_end(run, reference):
    n = run.scene.size
    position, velocity = run.event_states()
    end = run.state(run.duration)
    for x, v, exact in (
        (position[-1], velocity[-1], reference.last_event_state),
        (end.position, end.velocity, reference.end_state),
    ):
        # What an error of 1e-12 s in time makes of positions and velocities at 0.1 m/s and 500 m/s^2, twice.
        assert np.abs(x - exact[:n]).max() <= 2 * 1e-12 * 0.1
        assert np.abs(v - exact[n:]).max() <= 2 * 1e-12 * 500.0


def test_a_plastic_impact_with_tension_leaves_the_combination_and_is_an_event(lifting):
    """One gap of the second run closes while the forces already pull it open again."""
    run = ss.simulate(lifting.scene, lifting.duration, lifting.start)
    ((time, contact, kind, _),) = lifting.grazing
    index = int(np.argmin(np.abs(run.events.time - time)))
    assert (run.events.contact[index], run.events.kind[index]) == (contact, kind)
    assert run.events.combination[index] == run.events.combination[index - 1] == "+d"
    after = run.state(run.events.time[index])
    assert after.velocity[7] == 0.0
    assert run.grazings == ()


#: What the reference runs cost: exact numbers, the same on every machine. Whoever changes how motion is
#: followed or events are found updates them here, and says why they became more.
WORK = {
    ("standard", "auto"): {
        "phases": 313,
        "panels": 729,
        "leaps": 5,
        "refinements": 546,
        "combinations": 5,
        "taylor_phases": 0,
        "expansions": 0,
    },
    ("standard", "taylor"): {
        "phases": 313,
        "panels": 703,
        "leaps": 0,
        "refinements": 772,
        "combinations": 5,
        "taylor_phases": 313,
        "expansions": 0,
    },
    ("lifting", "auto"): {
        "phases": 148,
        "panels": 344,
        "leaps": 7,
        "refinements": 292,
        "combinations": 6,
        "taylor_phases": 0,
        "expansions": 0,
    },
    ("lifting", "taylor"): {
        "phases": 148,
        "panels": 355,
        "leaps": 0,
        "refinements": 386,
        "combinations": 6,
        "taylor_phases": 148,
        "expansions": 0,
    },
}


@pytest.mark.parametrize(("name", "method"), WORK)
def test_work(request, name, method):
    reference = request.getfixturevalue(name)
    scene = reference.scene.replace()  # remembers no combination
    cold = ss.simulate(scene, reference.duration, reference.start, method=method)
    assert cold.counters == WORK[name, method]
    assert cold.counters["phases"] == 1 + len(np.unique(reference.time))
    assert cold.counters["combinations"] == len({"++", *reference.combination})
    warm = ss.simulate(scene, reference.duration, reference.start, method=method)
    assert warm.counters == {**WORK[name, method], "combinations": 0}


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_either_kind_of_motion_gives_the_reference(standard, method):
    run = ss.simulate(standard.scene, standard.duration, standard.start, method=method)
    assert np.array_equal(run.events.combination, standard.combination)
    assert np.abs(run.events.time - standard.time).max() <= 1e-12
