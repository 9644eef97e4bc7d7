"""Series of impacts over contacts that mass couples, as one event of a periodic orbit."""

import pickle

import numpy as np
import pytest

import stickslip as ss
from pad_on_disc import pad_on_disc
from return_map import assert_multipliers
from stickslip.cycles.attractors import disturbed_sliding


def settled(restitution, friction=0.6, **controls):
    pad = pad_on_disc(friction, restitution)
    return ss.simulate(pad, 0.5, disturbed_sliding(pad), **controls)


@pytest.fixture(scope="module")
def cycle():
    """An orbit whose contacts both bounce until they close jointly."""
    return settled(0.3).limit_cycle()


def joint_closings(cycle):
    """The phases that end with a joint closing, and the contacts that close."""
    return [(k, series) for k, series in enumerate(cycle.core.series) if series]


def joint_closing(cycle):
    """The phase that ends with the closing of both contacts."""
    (closing,) = (k for k, series in joint_closings(cycle) if len(series) == 2)
    return closing


def test_multipliers_where_all_contacts_fly(cycle):
    assert "dd" in cycle.combinations
    assert cycle.residual <= 1e-12
    longest = max(range(len(cycle.phases)), key=lambda k: cycle.phases[k].duration)
    # The differences of runs err by 1e-7 (see `return_map`).
    assert_multipliers(cycle, 1e-6, phase=longest)


@pytest.mark.parametrize("friction", [0.6, 0.7])
def test_an_interrupted_series_of_one_contact_is_a_joint_closing(friction):
    """A round of the lead's impacts is below rounding, but its flights began above the slider.

    Their limit is that of a series which the trail takes part in, not the one of the lead's own bounces: with
    the time of the latter no orbit was found.
    """
    cycle = settled(0.1, friction).limit_cycle()
    assert [series for _, series in joint_closings(cycle)] == [[0], [0, 1]]
    assert cycle.residual <= 1e-12
    longest = max(range(len(cycle.phases)), key=lambda k: cycle.phases[k].duration)
    assert_multipliers(cycle, 1e-6, phase=longest)
    # Bounces of a tenth hardly change the orbit of plastic impacts.
    plastic = settled(0.0, friction).limit_cycle()
    assert cycle.largest_multiplier == pytest.approx(plastic.largest_multiplier, rel=1e-4)


def test_a_joint_closing_forgets_all_gaps_and_their_velocities(cycle):
    """Between two impacts of the lead, the trail bounces and comes to rest, in ever shorter rounds."""
    closing = joint_closing(cycle)
    last = max(k for k, phase in enumerate(cycle.phases[: closing + 1]) if phase.combination == "dd")
    # The limit of the bounces of the trail forgets its gap and velocity, the closing those of the lead.
    assert cycle.phases[last].event == "accumulation"
    assert [cycle.core.losses[last], cycle.core.losses[closing]] == [2, 2]
    # A round that is below rounding is one event: the trail is lifted off and back. That forgets nothing, for
    # the trail has been closed before.
    rounds = range(last + 1, closing)
    assert [cycle.phases[k].combination for k in rounds] == ["d+"] * len(rounds)
    assert [series for k, series in joint_closings(cycle) if k in rounds] == [[1]] * len(rounds)
    assert not any(cycle.core.losses[k] for k in rounds)


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.0, 0.1, 0.3, 0.5])
def test_the_number_of_impacts_does_not_matter(restitution):
    run = settled(restitution)
    coarse = settled(restitution, accumulation_tolerance=1e-5)
    assert len(coarse.events) < 0.6 * len(run.events)
    cycle, other = run.limit_cycle(), coarse.limit_cycle()
    # What is left out is below the rounding of displacements; cycles are refined without tolerance.
    assert other.period == pytest.approx(cycle.period, rel=1e-12)
    assert other.largest_multiplier == pytest.approx(cycle.largest_multiplier, rel=1e-9)
    # A period has 14 phases without restitution and 499 with 0.5, but the orbit hardly changes.
    plastic = settled(0.0).limit_cycle()
    assert cycle.period == pytest.approx(plastic.period, rel=1e-3)
    assert cycle.largest_multiplier == pytest.approx(plastic.largest_multiplier, rel=0.02)


def test_the_motion_of_an_orbit_has_the_events_of_a_run(cycle):
    events = cycle.run.events
    kinds = np.flatnonzero(events.kind == "accumulation")
    joint = [k for k in kinds if np.count_nonzero(events.time[kinds] == events.time[k]) == 2]
    assert list(events.contact[joint]) == [0, 1]
    assert set(events.combination[joint]) == {"++"}


def test_an_orbit_with_a_joint_closing_is_kept(cycle):
    kept = pickle.loads(pickle.dumps(cycle))
    assert kept.period == cycle.period
    assert np.array_equal(kept.multipliers, cycle.multipliers)
    assert np.array_equal(kept.run.events.kind, cycle.run.events.kind)


def test_an_orbit_with_a_joint_closing_is_followed(cycle):
    followed = cycle.continued(pad_on_disc(0.601, 0.3))
    assert followed.is_followed()
    assert followed.period != cycle.period
