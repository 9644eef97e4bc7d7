"""Motions that have to be the same to the last bit."""

import numpy as np


def assert_identical(again, run):
    """Assert two motions equal to the last bit, in whatever order they are asked."""
    times = np.random.default_rng(1).permutation(np.linspace(0.0, run.duration, 200))
    a, b = again.sample(times), run.sample(times)
    for name in ("position", "velocity", "normal_force", "friction_force", "status"):
        assert np.array_equal(a[name], b[name]), name
    for name in ("time", "contact", "kind", "combination"):
        assert np.array_equal(getattr(again.events, name), getattr(run.events, name)), name
    for a, b in zip(again.core.event_states(), run.core.event_states(), strict=True):
        assert np.array_equal(a, b)
    assert again.counters == run.counters
    assert again.accumulations == run.accumulations
    assert (again.stop_reason, again.duration) == (run.stop_reason, run.duration)
