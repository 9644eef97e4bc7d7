"""Hopf curves beside those of AUTO-07p, a program for continuation that shares no code; see `auto_peer`."""

import numpy as np
import pytest

import stickslip as ss
from auto_peer import CURVES, RANGES, belt
from stickslip.scene.parameters.family import Family


@pytest.fixture(scope="module")
def boundary():
    return ss.stability_boundary(belt(), RANGES)


def points_of_auto():
    """Return the points of AUTO by the Hopf point through which their curve leads, (k, 2) each."""
    table = np.loadtxt(CURVES)
    return {label: table[table[:, 0] == label, 1:] for label in np.unique(table[:, 0])}


def test_every_point_of_auto_is_a_hopf_point():
    family = Family(belt())
    worst = 0.0
    for place in np.concatenate([*points_of_auto().values()]):
        modes = ss.complex_modes(family.scene(dict(zip(RANGES, map(float, place), strict=True))))
        worst = max(worst, np.abs(modes.eigenvalues.real / modes.eigenvalues).min())
    # AUTO prints eleven digits.
    assert worst <= 1e-11


def test_both_programs_find_the_same_curves(boundary):
    of_auto = points_of_auto()
    assert boundary.doubts == ()
    assert len(boundary) == len(of_auto) == 2
    for points in of_auto.values():
        ends = points[np.isclose(points, [[0.05, 0.02]], rtol=1e-8, atol=0.0).any(axis=1)]
        assert len(ends) == 2
        (curve,) = (
            one for one in boundary if np.abs(one.values[[0, -1], None] - ends).max(axis=2).min() < 1e-3
        )
        for end in ends:
            assert np.abs(curve.values[[0, -1]] - end).max(axis=1).min() <= 1e-9
        # Between its points a curve is drawn as cubics.
        drawn = curve.drawn(boundary.spans, 200) / boundary.spans
        distance = np.linalg.norm(drawn - points[:, None] / boundary.spans, axis=2).min(axis=1)
        assert distance.max() <= 1e-3
