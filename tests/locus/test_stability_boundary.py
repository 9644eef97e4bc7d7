"""Curves on which stability ends: closed forms, counts of growing modes over maps, and what users see."""

import sys

import numpy as np
import pytest

import interrupts
import stickslip as ss
from curve_checks import PLANES, contradictions, random_plane
from stickslip.locus.boundary import codimension
from stickslip.locus.boundary.codimension import meetings, others
from stickslip.locus.boundary.conditions import Hopf
from stickslip.locus.boundary.curves import pieces
from stickslip.locus.boundary.plane import Expansion
from stickslip.locus.boundary.tracing import traced
from stickslip.scene.parameters.family import Family

TWO = ss.models.two_subsystems


def oscillators(*rates):
    """Uncoupled oscillators of 100, 141.4, ... rad/s whose growth rates are functions of p and q."""

    def model(p, q):
        growth = np.array([rate(p, q) for rate in rates])
        stiffness = 1e4 * np.arange(1.0, growth.size + 1.0)
        return ss.Scene(np.ones(growth.size), np.diag(stiffness), damping=np.diag(-2.0 * growth))

    return model


UNIT = {"p": (0.0, 1.0), "q": (0.0, 1.0)}


@pytest.fixture(scope="module")
def published():
    return {name: ss.stability_boundary(*plane) for name, plane in PLANES.items()}


@pytest.mark.parametrize("name", PLANES)
def test_the_published_model_beside_a_map(published, name):
    model, parameters = PLANES[name]
    wrong, compared = contradictions(published[name], model, parameters, 60)
    assert (wrong, compared) == ([], 2 * 60 * 59)
    assert published[name].doubts == ()
    assert [curve.kind for curve in published[name]] == ["hopf"] * 2
    # Of a matrix whose rows and columns have size 1.
    assert all(curve.error.max() <= 1e-14 for curve in published[name])


@pytest.mark.nightly
@pytest.mark.parametrize("name", PLANES)
def test_the_published_model_beside_a_fine_map(published, name):
    model, parameters = PLANES[name]
    wrong, compared = contradictions(published[name], model, parameters, 400)
    assert (wrong, compared) == ([], 2 * 400 * 399)


@pytest.mark.parametrize("name", ["slider speed", "a stiffness"])
def test_points_are_on_their_curve(published, name):
    model, _ = PLANES[name]
    for curve in published[name]:
        for place, frequency, beyond in zip(curve.values, curve.frequency, curve.unstable_modes, strict=True):
            values = dict(zip(curve.names, map(float, place), strict=True))
            modes = ss.complex_modes(Family(model).scene(values))
            own = np.argmin(np.abs(modes.eigenvalues - 2j * np.pi * frequency))
            # A few roundings, times the condition of the eigenvalue.
            assert abs(modes.eigenvalues[own].real) <= 1e-14 * modes.condition[own] * abs(
                modes.eigenvalues[own]
            )
            upper = (modes.eigenvalues.imag >= 0.0) & (np.arange(modes.eigenvalues.size) != own)
            assert np.count_nonzero(modes.unstable[upper]) == beyond


def test_slider_speed_does_not_matter_under_constant_friction(published):
    onsets = [0.70156717308523, 2.1002056016114]
    assert [curve.values[0, 0] for curve in published["slider speed"]] == pytest.approx(onsets, abs=1e-12)
    for curve, onset in zip(published["slider speed"], onsets, strict=True):
        np.testing.assert_allclose(curve.values[:, 0], onset, rtol=1e-13)
        assert curve.values[[0, -1], 1].tolist() == [0.01, 1.0]


def test_curves_without_damping_begin_at_lock_ins(published):
    # Stiffness-proportional damping that vanishes leaves the lock-ins, whose values have 60-digit arithmetic.
    begins = [curve.values[0] for curve in published["damping"]]
    np.testing.assert_allclose([at[0] for at in begins], [0.612484152848669, 1.989108991216879], rtol=1e-11)
    np.testing.assert_allclose([at[1] for at in begins], 0.0, atol=1e-12)


def test_a_lock_in_at_the_end_of_a_curve_is_no_second_pair(monkeypatch):
    # Where damping vanishes, the eigenvalue of a curve is a double one, computed to the root of rounding.
    found = []

    def second_pair(trace, k, rank):
        found.append(search(trace, k, rank))
        return found[-1]

    search = codimension._second_pair
    monkeypatch.setattr(codimension, "_second_pair", second_pair)
    boundary = ss.stability_boundary(*random_plane(3, 87), cells=4)
    assert min(curve.values[:, 1].min() for curve in boundary) < 1e-12
    assert [len(one) for one in found] == [1, 1]


def test_two_curves_cross_at_a_double_hopf_point(published):
    (point,) = (one for one in published["a stiffness"].points if one.kind == "double_hopf")
    modes = ss.complex_modes(Family(TWO).scene(point.values))
    on_axis = np.abs(modes.eigenvalues.real) <= 1e-12 * np.abs(modes.eigenvalues)
    assert np.count_nonzero(on_axis & (modes.eigenvalues.imag > 0.0)) == 2
    frequencies = np.sort(modes.frequencies[on_axis & (modes.eigenvalues.imag > 0.0)])
    np.testing.assert_allclose(point.frequencies, frequencies, rtol=1e-12)


def test_a_curve_turns_where_the_critical_friction_is_least(published):
    (least, *_) = sorted(
        (one for one in published["a stiffness"].points if one.parameter == "friction"),
        key=lambda one: one.values["friction"],
    )
    stiffness = least.values["vertical_stiffness_0"]

    def onset(factor):
        found = ss.critical_points(
            TWO, {"friction": (0.0, 1.0), "vertical_stiffness_0": factor * stiffness}, kinds=("hopf",)
        )
        return found[0].value

    assert onset(1.0) == pytest.approx(least.values["friction"], rel=1e-13)
    # The slope vanishes: a part d beside the extreme changes it by d^2.
    assert 0.0 < onset(0.999) - onset(1.0) < 1e-5
    assert 0.0 < onset(1.001) - onset(1.0) < 1e-5


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("radius", [0.3, 0.02, 0.004])
def test_closed_curves_are_found_also_within_a_cell(radius, sign):
    # 0.004 is half of the width of a cell of the map that is compared.
    centre = (0.31 + 1e-3, 0.42)

    def rate(p, q):
        return sign * ((p - centre[0]) ** 2 + (q - centre[1]) ** 2 - radius**2)

    boundary = ss.stability_boundary(oscillators(rate), UNIT)
    (curve,) = boundary
    assert curve.closed
    assert boundary.doubts == ()
    np.testing.assert_allclose(np.hypot(*(curve.values - centre).T), radius, rtol=1e-11)
    assert (curve.values[0] == curve.values[-1]).all()
    # Drawn as cubics, it leaves the circle by less than what is seen.
    np.testing.assert_allclose(np.hypot(*(curve.drawn((1.0, 1.0)) - centre).T), radius, rtol=1e-3)
    turns = {(point.kind, point.parameter) for point in boundary.points}
    assert turns == {("degenerate", "p"), ("degenerate", "q")}
    assert len(boundary.points) == 4


def test_hopf_lines_cross_each_other_and_themselves():
    boundary = ss.stability_boundary(oscillators(lambda p, q: p - 0.4, lambda p, q: q - 0.7 * p - 0.1), UNIT)
    (point,) = boundary.points
    assert point.kind == "double_hopf"
    np.testing.assert_allclose(list(point.values.values()), [0.4, 0.38], rtol=1e-13)
    np.testing.assert_allclose(
        2.0 * np.pi * np.array(point.frequencies), [100.0, 100.0 * np.sqrt(2.0)], rtol=1e-13
    )
    assert len(boundary) == 2
    assert {int(n) for curve in boundary for n in curve.unstable_modes} == {0, 1}


def softened(p, q):
    """One oscillator whose stiffness p and damping q vanish, and one that is stable."""
    return ss.Scene([1.0, 1.0], np.diag([1e4 * (p - 0.3), 2e4]), damping=np.diag([20.0 * (q - 0.6), 1.0]))


def test_a_hopf_curve_ends_where_its_frequency_vanishes():
    boundary = ss.stability_boundary(softened, UNIT)
    kinds = {curve.kind: curve for curve in boundary}
    assert sorted(curve.kind for curve in boundary) == ["divergence", "hopf"]
    np.testing.assert_allclose(kinds["divergence"].values[:, 0], 0.3, rtol=1e-13)
    np.testing.assert_allclose(kinds["hopf"].values[:, 1], 0.6, rtol=1e-13)
    assert sorted(kinds["hopf"].ends) == ["range", "zero_frequency"]
    (point,) = boundary.points
    # The frequency at the end of the curve is 1e-5 of that at its start, the error its square.
    assert point.kind == "zero_frequency"
    np.testing.assert_allclose(list(point.values.values()), [0.3, 0.6], rtol=1e-9)
    stiffness = 1e4 * (kinds["hopf"].values[:, 0] - 0.3)
    np.testing.assert_allclose((2.0 * np.pi * kinds["hopf"].frequency) ** 2, stiffness, rtol=1e-9, atol=1e-4)


def test_a_divergence_crosses_a_hopf_curve():
    def model(p, q):
        return ss.Scene(
            [1.0, 1.0], np.diag([1e4 * (p - 0.3), 2e4]), damping=np.diag([1.0, q - 0.5 * p - 0.2])
        )

    boundary = ss.stability_boundary(model, UNIT)
    (point,) = boundary.points
    assert point.kind == "zero_hopf"
    np.testing.assert_allclose(list(point.values.values()), [0.3, 0.35], rtol=1e-13)
    np.testing.assert_allclose(point.frequencies, [0.0, np.sqrt(2e4) / (2.0 * np.pi)], rtol=1e-13)


def test_two_points_between_neighbours_on_a_curve_that_nearly_cancel():
    # Along the Hopf curve of the second mode a real eigenvalue ceases to grow at p = 0.3, a pair begins
    # to grow at p = 0.302: one more grows in the end than before.
    def model(p=0.5, q=0.5):
        return ss.Scene(
            [1.0, 1.0, 1.0],
            np.diag([1e4 * (p - 0.3), 2e4, 5e4]),
            damping=np.diag([1.0, q - 0.5 * p - 0.2, 0.302 - p]),
        )

    first, second = sorted(ss.stability_boundary(model, UNIT).points, key=lambda point: point.values["p"])
    assert (first.kind, second.kind) == ("zero_hopf", "double_hopf")
    assert first.values == pytest.approx({"p": 0.3, "q": 0.35}, abs=1e-12)
    assert second.values == pytest.approx({"p": 0.302, "q": 0.351}, abs=1e-12)
    frequencies = np.sqrt([2e4, 5e4]) / (2.0 * np.pi)
    assert first.frequencies == pytest.approx((0.0, frequencies[0]), rel=1e-12)
    assert second.frequencies == pytest.approx(tuple(frequencies), rel=1e-12)


def lifted(friction, load):
    """A block pushed along a belt that lifts it as friction grows: N = load - friction N."""
    return ss.Scene(
        [1.0, 1.0],
        [[1e4, -4e3], [-4e3, 2e4]],
        damping=[[3.0 - 4.0 * friction, 0.0], [0.0, 1.0]],
        force=[0.0, -load],
        dofs=["x", "y"],
        contacts=[ss.Contact(tangential="x", normal="y", friction=friction, slider_speed=-1.0, name="belt")],
    )


def test_a_contact_separates_on_its_closed_form():
    boundary = ss.stability_boundary(lifted, {"friction": (0.0, 2.0), "load": (-1.0, 1.0)})
    (separation,) = (curve for curve in boundary if curve.kind == "separation")
    # K q = F - N (n + mu t), y = 0: N = load (1e4 + ..) / ..., zero with the load whatever the friction.
    np.testing.assert_allclose(separation.values[:, 1], 0.0, atol=1e-15)
    assert separation.name == "belt"
    assert np.isnan(separation.frequency).all()
    (point,) = (one for one in boundary.points if one.kind == "separation")
    (hopf,) = (curve for curve in boundary if curve.kind == "hopf")
    np.testing.assert_allclose(hopf.values[:, 0], 0.75, rtol=1e-13)
    np.testing.assert_allclose(list(point.values.values()), [0.75, 0.0], rtol=1e-13, atol=1e-15)
    assert (point.contact, point.name) == (0, "belt")
    assert not hopf.steady_sliding[hopf.values[:, 1] < -1e-3].any()
    assert hopf.steady_sliding[hopf.values[:, 1] > 1e-3].all()


def test_without_damping_flutter_begins_at_no_curve():
    with pytest.raises(ss.InputError, match=r"a mode neither grows nor decays .* begins at a lock-in"):
        ss.stability_boundary(TWO(damping=0.0), {"friction": (0.0, 3.0), "stiffness": (0.5, 2.0)})
    # Below the lock-ins nothing grows, and nothing is missed.
    stable = ss.stability_boundary(TWO(damping=0.0), {"friction": (0.0, 0.5), "stiffness": (0.9, 1.1)})
    assert (len(stable), stable.doubts) == (0, ())


def test_a_law_of_friction_from_knot_to_knot():
    table = ss.friction.Tabulated(speeds=[0.0, 0.05, 0.2, 0.6], values=[0.9, 0.6, 0.45, 0.5])
    scene = TWO(friction=table)
    parameters = {"slider_speed": (0.02, 0.5), "damping_stiffness": (2e-5, 3e-4)}
    boundary = ss.stability_boundary(scene, parameters)
    assert boundary.doubts == ()
    # Where the slope of the table has a kink, a curve goes on in another direction.
    assert [curve.ends.count("corner") for curve in boundary].count(1) == 2
    wrong, _ = contradictions(boundary, scene, parameters, 30)
    assert wrong == []


@pytest.mark.slow
@pytest.mark.parametrize("index", range(8))
def test_random_scenes_beside_their_maps(index):
    agrees(2, index)


@pytest.mark.nightly
def test_a_hundred_random_scenes_beside_their_maps():
    found = [agrees(3, index) for index in range(100)]
    assert sum(found) > 100


def test_cubics_follow_a_curve_that_bends_between_two_points():
    """Two modes nearly meet there."""
    scene, parameters = random_plane(3, 85)
    boundary = ss.stability_boundary(scene, parameters)
    assert contradictions(boundary, scene, parameters, 100)[0] == []


def boundary_of(scene, parameters):
    """Return the boundary; None where there is a reason not to have one."""
    try:
        return ss.stability_boundary(scene, parameters)
    except ss.InputError as error:
        if "neither grows nor decays" in str(error) or "contacts open or close" in str(error):
            return None
        raise


def agrees(seed, index):
    """Expect that curves and map of a random scene agree; return how many curves there are."""
    scene, parameters = random_plane(seed, index)
    boundary = boundary_of(scene, parameters)
    if boundary is None:
        return 0
    assert boundary.doubts == ()
    corners = [
        (values, frequency)
        for curve in boundary
        for ended, values, frequency in zip(
            curve.ends, curve.values[[0, -1]], curve.frequency[[0, -1]], strict=True
        )
        if ended == "corner"
    ]
    for values, frequency in corners:
        # Here no law has knots: two modes become one.
        there = Family(scene).scene(dict(zip(parameters, map(float, values), strict=True)))
        modes = ss.complex_modes(there, there.core.sliding_combination()).eigenvalues
        near = np.sort(np.abs(modes - 2j * np.pi * frequency))
        assert near[1] < 1e-3 * 2.0 * np.pi * frequency
    assert all(curve.error.max() <= 1e-12 for curve in boundary)
    wrong, _ = contradictions(boundary, scene, parameters, 40)
    assert wrong == [], parameters
    return len(boundary)


def test_a_boundary_is_told_drawn_and_kept(published, tmp_path):
    boundary = published["a stiffness"]
    data = boundary.to_dataset()
    assert data.sizes["point"] == sum(len(curve.values) for curve in boundary)
    assert data.at_vertical_stiffness_0.attrs["units"] == "N/m"
    assert data.special_kind.to_numpy().tolist() == [point.kind for point in boundary.points]
    ss.save(boundary, tmp_path / "boundary.nc")
    assert ss.load(tmp_path / "boundary.nc").identical(data)
    text = str(boundary.summary())
    assert "agree at 64 x 64 places" in text
    assert "no curve wider than 0.1875 in friction or 1.219e+05 in vertical_stiffness_0" in text
    assert "double hopf" in text
    assert repr(boundary).startswith(
        "StabilityBoundary(2 curves, 4 points)\n  BoundaryCurve(hopf over friction"
    )
    axes = boundary.plot()
    assert axes.get_ylabel().startswith("friction")
    assert {line.get_linewidth() for line in axes.lines} >= {0.7, 1.6}
    assert len(boundary[:1]) == 1
    assert boundary[:1].points == boundary.points
    over = boundary.plot(growth=False, ax=axes)
    assert over is axes


def test_a_curve_becomes_thin_where_it_meets_another_one(published):
    boundary = published["a stiffness"]
    (double,) = (point for point in boundary.points if point.kind == "double_hopf")
    place = np.array(list(double.values.values())) / boundary.spans
    for curve in boundary:
        (first, one), (second, other) = pieces(curve, boundary.spans, boundary.points)
        assert {one, other} == {1, 2}
        assert (first[-1] == second[0]).all()
        drawn = curve.drawn(boundary.spans) / boundary.spans
        assert np.concatenate([first, second[1:]]) / boundary.spans == pytest.approx(drawn, abs=0)
        # At the nearest of the points drawn.
        nearest = np.linalg.norm(drawn - place, axis=1).min()
        gap = np.linalg.norm(first[-1] / boundary.spans - place)
        assert gap == pytest.approx(nearest, rel=1e-14)


def test_nothing_to_find_is_an_empty_boundary():
    boundary = ss.stability_boundary(TWO, {"friction": (0.0, 0.1), "damping": (1e-4, 2e-4)}, cells=2)
    assert len(boundary) == len(boundary.points) == 0
    assert boundary.to_dataset().sizes["point"] == 0
    assert "Curves" in str(boundary.summary())
    boundary.plot()


@pytest.mark.parametrize(
    ("parameters", "options", "message"),
    [
        ({"friction": (0.0, 1.0)}, {}, "parameters: expected two with a range, got ['friction']"),
        ({"friction": (0.0, 1.0), "damping": (1.0, 0.0)}, {}, "damping: expected finite lower < upper"),
        ({"friction": (0.0, 1.0), "damping": (0.0, 1.0)}, {"cells": 1}, "cells: "),
        ({"friction": (0.0, 1.0), "damping": (0.0, 1.0)}, {"cells": 1001}, "cells: expected at most 1000"),
        ({"friction": (0.0, 1.0), "slider_speed": (-1.0, 1.0)}, {}, "slider speeds change their sign at 0"),
        ({"friction": (0.0, 1.0), "nothing": (0.0, 1.0)}, {}, "nothing: "),
    ],
)
def test_what_cannot_be_asked(parameters, options, message):
    with pytest.raises(ss.InputError) as told:
        ss.stability_boundary(TWO, parameters, **options)
    assert message in str(told.value)


INTERRUPTED = """
    import stickslip as ss
    from interrupts import Interrupt

    plane = {"friction": (0.0, 3.0), "vertical_stiffness_0": (5e4, 2e6)}
    ss.stability_boundary(ss.models.two_subsystems, plane, cells=4)
    interrupt = Interrupt(after=1.0)
    try:
        ss.stability_boundary(ss.models.two_subsystems, plane, cells=1000)
    except ss.Interrupted as stopped:
        print(len(stopped.partial), stopped.partial.doubts[-1].startswith("interrupted after"), stopped)
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT to one process")
def test_ctrl_c_leaves_the_curves_found():
    found, told, *message = interrupts.printed(INTERRUPTED, timeout=60).split()
    assert (found, told) == ("2", "True")
    assert message[-3:] == ["of", "6000", "lines"]


class BesideAPole:
    """Two oscillators: the growth of one begins at v = 0.5, the stiffness of the other is u - 0.4.

    The other is pressed, and its contact closed, by 1 / (u - 0.4) - 100: from 0.4 to 0.41.
    """

    region = basis = None

    def seen(self, eigenvalues):
        return eigenvalues

    def at(self, u, v):
        mass, damping, stiffness = np.zeros((3, 3, 2, 2))
        load, rows, offsets = np.zeros((3, 2)), np.zeros((3, 1, 2)), np.zeros((3, 1))
        mass[0] = np.eye(2)
        damping[0], damping[2, 0, 0] = np.diag([v - 0.5, 0.1]), 1.0
        stiffness[0], stiffness[1, 1, 1] = np.diag([4.0, u - 0.4]), 1.0
        load[0, 1] = rows[0, 0, 1] = 1.0
        offsets[0, 0] = 100.0
        return Expansion(mass, damping, stiffness, load, rows, offsets)


def test_a_separation_beside_a_pole_is_a_point_of_a_hopf_curve():
    """Both lie between two points of the curve, at which the margin has one sign."""
    condition = Hopf(BesideAPole(), np.array([0.2, 0.5]), 2.0)
    curve = traced(condition, condition.start)
    places = curve.points[:, 0]
    assert not ((places > 0.4) & (places < 0.41)).any()
    found = meetings(curve, others(curve, curve.points), np.array([0]))
    assert [one.kind for one in found] == ["zero_hopf", "separation"]
    assert [one.place for one in found] == [pytest.approx([u, 0.5], abs=1e-13) for u in (0.4, 0.41)]
