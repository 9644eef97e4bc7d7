"""Sweeps and critical points of a band of a scene with more dofs than all modes are wanted of."""

import numpy as np
import pytest

import stickslip as ss
from quad_block import quad_block

BAND = (0.0, 60e3)


@pytest.fixture(scope="module")
def block():
    """A mesh of 110 dofs and 6 contacts: 104 free coordinates while all slide."""
    return quad_block(10, 5, 2)


@pytest.mark.slow
def test_sweep_of_a_band_has_the_eigenvalues_of_the_full_scene(block):
    values = np.array([0.6, 0.0, 0.3])
    swept = ss.sweep(block, {"friction": values}, combination="++++++", band=BAND)
    assert np.abs(swept.attrs["missing"]).max() < 0.01
    assert list(swept.attrs["doubts"]) == []
    for k, value in enumerate(values):
        modes = ss.complex_modes(block.replace(friction=value), "++++++").with_conjugates
        expected = modes.eigenvalues[modes.frequencies <= BAND[1]]
        found = swept["eigenvalue"].values[k]
        found = found[np.abs(found) <= 2.0 * np.pi * BAND[1]]
        assert found.size == expected.size > 10
        error = np.abs(expected[:, None] - found).min(axis=1)
        # The projection is taken to 1e-9 of an eigenvalue times its condition.
        assert np.all(error <= 1e-9 * modes.condition[modes.frequencies <= BAND[1]] * np.abs(expected))
        assert bool(swept["stable"][k]) == (not modes.unstable[modes.frequencies <= BAND[1]].any())
    # The branches are the continuous ones: their slopes lead from one value to a close one.
    near = ss.sweep(block, {"friction": [0.3, 0.3 + 1e-6]}, combination="++++++", band=BAND)
    step = near["eigenvalue"].values[1] - near["eigenvalue"].values[0]
    slope = near["derivative"].values[0]
    known = np.isfinite(slope)
    scale = np.abs(near["eigenvalue"].values[0])[known]
    assert np.all(np.abs(step - 1e-6 * slope)[known] <= 1e-10 * scale)


@pytest.mark.slow
def test_hopf_points_of_a_band_are_those_of_the_full_scene(block):
    expected = [
        p
        for p in ss.critical_points(block, {"friction": (0.0, 0.3)}, combination="++++++", kinds=("hopf",))
        if p.frequency <= BAND[1]
    ]
    found = ss.critical_points(
        block, {"friction": (0.0, 0.3)}, combination="++++++", band=BAND, kinds=("hopf",)
    )
    assert len(found) == len(expected) > 1
    for point, other in zip(found, expected, strict=True):
        assert abs(point.value - other.value) <= 1e-9
        assert abs(point.eigenvalue - other.eigenvalue) <= 1e-9 * abs(other.eigenvalue)
        assert point.direction == other.direction
        assert point.steady_sliding == other.steady_sliding


def test_few_dofs_are_followed_as_they_are():
    scene = ss.models.two_subsystems()
    points = ss.critical_points(scene, {"friction": (0.0, 3.0)})
    band = ss.critical_points(scene, {"friction": (0.0, 3.0)}, band=(100.0, 200.0))
    assert [p.value for p in band] == [p.value for p in points if 100.0 <= p.frequency <= 200.0]
    assert len(band) > 0
    swept = ss.sweep(scene, {"friction": [0.1, 1.5]}, band=(100.0, 200.0))
    inside = (swept["frequency"] >= 100.0) & (swept["frequency"] <= 200.0)
    assert bool(inside.any("friction").all())


def test_what_does_not_go_with_a_band_is_refused():
    scene = ss.models.two_subsystems()
    for options, message in (
        ({"band": (0.0, 1e3), "modes": 3}, "modes: cannot be given together with band"),
        ({"band": (0.0, 1e3), "vectors": True}, "vectors: cannot be given together with band"),
        ({"growth": (0.0, None)}, "growth: needs a band"),
        ({"band": (3.0, 1.0)}, "band: expected"),
    ):
        with pytest.raises(ss.InputError, match=message):
            ss.sweep(scene, {"friction": [0.0, 1.0]}, **options)
    frictions = {"friction_0": [0.0, 1.0], "friction_1": [0.0, 1.0]}
    with pytest.raises(ss.InputError, match="band: expected one parameter with an array"):
        ss.sweep(scene, frictions, band=(0.0, 1e3))


def test_verdicts_on_a_band_are_those_of_its_modes(block):
    values = np.array([0.35, 0.0, 0.2])
    found = ss.stability(block, {"friction": values}, combination="++++++", band=BAND)
    assert np.abs(found.attrs["missing"]).max() < 0.01
    every = ss.stability(block, {"friction": values}, combination="++++++")
    np.testing.assert_array_equal(found.steady_sliding, every.steady_sliding)
    np.testing.assert_allclose(found.normal_force, every.normal_force, rtol=1e-8)
    for k, value in enumerate(values):
        modes = ss.complex_modes(block.replace(friction=value), "++++++", band=BAND)
        worst = np.argmax(modes.eigenvalues.real)
        error = abs(found.eigenvalue.values[k] - modes.eigenvalues[worst])
        assert error <= 1e-9 * modes.condition[worst] * abs(modes.eigenvalues[worst])
        assert found.unstable_modes[k] == np.count_nonzero(modes.unstable)
    with pytest.raises(ss.InputError, match="band: of a large scene expected samples of one parameter"):
        ss.stability(
            block, {"friction": values, "slider_speed": values + 1.0}, combination="++++++", band=BAND
        )
    with pytest.raises(ss.InputError, match="growth: needs a band"):
        ss.stability(block, {"friction": values}, combination="++++++", growth=(0.0, None))


def test_verdicts_on_a_band_of_few_dofs():
    scene = ss.models.two_subsystems()
    values = np.array([0.5, 2.2])
    band = (100.0, 140.0)
    found = ss.stability(scene, {"friction": values}, combination="++", band=band)
    for k, value in enumerate(values):
        modes = ss.complex_modes(scene.replace(friction=value), "++", band=band)
        worst = modes.eigenvalues[np.argmax(modes.eigenvalues.real)]
        assert found.eigenvalue.values[k].real == worst.real
        assert found.unstable_modes[k] == np.count_nonzero(modes.unstable)
    # Nothing oscillates at some kHz.
    nothing = ss.stability(scene, {"friction": values}, combination="++", band=(3e3, 5e3))
    assert np.isnan(nothing.growth_rate).all()
    assert not nothing.unstable_modes.any()


def test_sensitivities_of_a_band_are_those_of_all_modes(block):
    """By a scene and by a model function; eigenvalues of the full scene come by dense matrices."""

    def model(friction, softer=0.0):
        return block.replace(friction=friction, stiffness=(1.0 - softer) * block.stiffness)

    asked = (
        (block, {"friction": 0.25}),
        (block, {"friction_2": 0.25}),
        (model, {"friction": 0.25, "softer": 0.1}),
    )
    for what, values in asked:
        every = ss.sensitivity(what, values, combination="++++++")
        part = ss.sensitivity(what, values, combination="++++++", band=BAND)
        inside = np.abs(every.eigenvalue.to_numpy()) <= 2.0 * np.pi * BAND[1]
        expected = every.sel(mode=inside)
        assert part.sizes["mode"] == expected.sizes["mode"] > 5
        assert bool(part.defined.all())
        one, other = part.derivative.to_numpy(), expected.derivative.to_numpy()
        scale = np.abs(other).max(axis=1, keepdims=True)
        assert (scale > 0.0).all()
        # Interpolants of projected entries are taken to 1e-9 of their largest.
        np.testing.assert_allclose(one / scale, other / scale, rtol=0, atol=1e-6)
