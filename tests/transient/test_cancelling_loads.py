"""Loads that cancel exactly leave rounding in the motion; no event that they cause is certain."""

from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss


def star(seed, links):
    """A mass between three others whose pulls cancel in exact arithmetic: it and a chain on it stay at rest.

    Stiffness and places have so few digits that every product and every sum of the start is exact.
    """
    rng = np.random.default_rng(seed)
    spring, wall = (float(rng.integers(1 << 18, 1 << 19)) for _ in range(2))
    a, b = (float(rng.integers(1 << 48, 1 << 49)) / 2.0**49 for _ in range(2))
    size = 4 + links
    stiffness = np.diag([wall] * size)
    for i, j in [(0, 1), (0, 2), (0, 3), *zip([0, *range(4, size)], range(4, size), strict=False)]:
        stiffness[np.ix_([i, j], [i, j])] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    dofs = [str(i) for i in range(size)]
    stop = ss.Contact(normal=dofs[-1] if links else "0", gap=1.0, restitution=0.5)
    return stiffness, [0.0, a, b, -(a + b), *[0.0] * links], stop, dofs, 2 * np.pi / np.sqrt(spring + wall)


@pytest.mark.parametrize("method", ["taylor", "modal"])
@pytest.mark.parametrize("links", [0, 1])
@pytest.mark.parametrize("gap", [1e-14, 1e-15, 3e-16, 1e-16, 3e-17])
def test_a_mass_between_cancelling_pulls_strikes_nothing_for_certain(method, links, gap):
    for seed in range(20):
        stiffness, place, stop, dofs, period = star(seed, links)
        scene = ss.Scene([1.0] * len(dofs), stiffness, contacts=[replace(stop, gap=gap)], dofs=dofs)
        start = ss.State(place, [0.0] * len(dofs), "d", dofs=dofs)
        run = ss.simulate(scene, 20 * period, start, method=method, max_events=20)
        assert len(run.events) == 0
