"""Events that last a small part of a phase are found; touches within rounding are reported."""

import numpy as np
import pytest

import stickslip as ss
from dip_scenes import gap, normal_force, slip

EPS = np.finfo(float).eps


@pytest.mark.parametrize("method", ["modal", "taylor"])
@pytest.mark.parametrize("make", [gap, slip, normal_force])
@pytest.mark.parametrize("part", [1e-3, 1e-6])
def test_a_dip_deeper_than_rounding_is_an_event(make, part, method):
    dip = make(part)
    run = ss.simulate(dip.scene, dip.period, dip.start, method=method)
    assert run.events.kind[0] == dip.kind
    # c (pi part)^2 2 pi is the slope where it enters; some ten roundings of terms of size c.
    condition = 20 * EPS / (2.0 * np.pi * np.pi * part)
    assert abs(run.events.time[0] / dip.period - (0.5 - 0.5 * part)) <= condition + 20 * EPS
    assert not [touch for touch in run.grazings if touch.time < run.events.time[0]]


@pytest.mark.parametrize("method", ["modal", "taylor"])
@pytest.mark.parametrize("make", [gap, slip, normal_force])
@pytest.mark.parametrize("part", [1e-9, 0.0])
def test_a_dip_within_rounding_is_found_or_reported(make, part, method):
    dip = make(part)
    run = ss.simulate(dip.scene, 0.9 * dip.period, dip.start, method=method)
    reported = [(touch.time, touch.alternative) for touch in run.grazings]
    found = [(float(run.events.time[0]), run.events.kind[0])] if len(run.events) else []
    ((time, kind),) = reported + found
    assert kind == dip.kind
    # Where a double root is known to some hundred roundings, its place is known to the root of that.
    assert abs(time / dip.period - 0.5) <= np.sqrt(200 * EPS) / (2.0 * np.pi)
    for touch in run.grazings:
        assert abs(touch.value) <= touch.uncertainty


@pytest.mark.parametrize("make", [gap, slip, normal_force])
@pytest.mark.parametrize("part", [1e-3, 1e-6])
def test_a_function_that_stays_above_zero_by_as_much_is_no_event(make, part):
    """The swing ends short of zero: nothing is found, nothing reported."""
    dip = make(part)
    run = ss.simulate(dip.scene, dip.period, dip.shortened(1.0 - (np.pi * part) ** 2))
    assert len(run.events) == 0
    assert run.grazings == ()
