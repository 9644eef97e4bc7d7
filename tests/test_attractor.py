"""What the published runs settle to."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.attractor import RETURN, settle

#: friction, slider speed, period in ms with its last printed digit, doubled
CYCLES = [
    (1.5, 0.025, 8.908492605779, 1e-12, False),
    (3.0, 0.025, 17.7519, 1e-4, True),
    (2.2, 0.3, 18.397, 1e-3, True),
    (2.2, 0.9, 17.871, 1e-3, True),
]


def settled(friction, speed, **changes):
    scene = ss.models.two_subsystems(friction=friction, slider_speed=speed, **changes)
    return settle(scene, ss.sliding_equilibrium(scene).perturbed(velocity={"x1": 1e-3}))


@pytest.mark.parametrize(("friction", "speed", "period", "digit", "doubled"), CYCLES)
def test_period(friction, speed, period, digit, doubled):
    cycle = settled(friction, speed)
    # A state that returns within `RETURN` returns in time to about that part of the period.
    assert abs(1e3 * cycle.period - period) < digit + 10 * RETURN * period
    assert (cycle.main_harmonic("x2") == 2) == doubled
    assert cycle.main_frequency("x2") == cycle.main_harmonic("x2") / cycle.period


def test_phases_of_the_standard_limit_cycle():
    cycle = settled(1.5, 0.025)
    assert cycle.combinations == ("++", "+d", "++", "s+", "ss", "s+")
    assert cycle.onset == pytest.approx(0.116427801919532, abs=1e-13)


def test_a_slowly_dying_alternation_is_no_doubled_period():
    """At friction 2.2 the multiplier is -0.937: after 0.6 s every second period still looks different."""
    cycle = settled(2.2, 0.025)
    assert cycle.period == pytest.approx(1.0 / 112.199, rel=1e-5)
    assert cycle.main_harmonic("x2") == 1


def test_the_attractor_returns_to_itself():
    cycle = settled(2.2, 0.05)
    first, last = cycle.run.state(cycle.begin), cycle.run.state(cycle.begin + cycle.period)
    assert first.combination == last.combination
    assert (
        np.abs(first.position - last.position).max()
        <= RETURN * np.ptp(cycle.run.event_states()[0], axis=0).max()
    )


def test_motion_without_status_changes_has_no_attractor_of_events():
    scene = ss.models.two_subsystems(friction=0.3)
    start = ss.sliding_equilibrium(scene).perturbed(velocity={"x1": 1e-3})
    with pytest.raises(ss.RunError, match="no recurrence of events within 2 s") as caught:
        settle(scene, start, limit=2.0)
    assert caught.value.partial.duration == 1.0
