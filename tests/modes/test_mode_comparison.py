import numpy as np
import pytest

import stickslip as ss

SCENE = ss.models.two_subsystems(friction=0.5)
MODES = ss.complex_modes(SCENE)


def test_a_mode_is_like_itself_and_its_multiples():
    alike = MODES.mac(MODES)
    assert alike.dims == ("first", "second")
    assert (alike.first.to_numpy() == np.arange(len(MODES))).all()
    assert np.diag(alike) == pytest.approx(1.0, rel=1e-14)
    assert alike.to_numpy() == pytest.approx(alike.to_numpy().T, rel=1e-12)
    assert (alike.to_numpy() >= 0.0).all()
    assert (alike.to_numpy() <= 1.0 + 1e-14).all()
    # |x* y|^2 / (x* x)(y* y), written out for one entry.
    x, y = MODES.shapes[:, 0], MODES.shapes[:, 1]
    expected = abs(np.vdot(x, y)) ** 2 / (np.vdot(x, x) * np.vdot(y, y)).real
    assert float(alike.sel(first=0, second=1)) == pytest.approx(expected, rel=1e-13)


def springs(stiffness, dofs=None):
    """Masses side by side, each on its own spring: mode k moves mass k alone."""
    return ss.Scene(np.ones(len(stiffness)), np.diag(stiffness), dofs=dofs)


def test_pairs_follow_the_shape_where_frequencies_pass_each_other():
    before = ss.complex_modes(springs([1.0, 4.0, 9.0]), "")
    after = ss.complex_modes(springs([5.0, 4.0, 9.0]), "")
    found = before.pairing(after)
    assert found.first.to_numpy().tolist() == [0, 1, 2]
    assert found.second.to_numpy().tolist() == [1, 0, 2]
    assert found.mac.to_numpy() == pytest.approx(1.0)
    assert found["shift"].to_numpy() * 2.0 * np.pi == pytest.approx([np.sqrt(5.0) - 1.0, 0.0, 0.0], abs=1e-12)


def test_scenes_of_other_sizes_are_compared_by_the_dofs_they_share():
    small = ss.complex_modes(springs([4.0, 9.0], dofs=["b", "c"]), "")
    large = ss.complex_modes(springs([1.0, 4.0, 9.0], dofs=["a", "b", "c"]), "")
    found = large.pairing(small)
    assert list(zip(found.first.to_numpy(), found.second.to_numpy(), strict=True)) == [(1, 0), (2, 1)]
    # The mode of mass a moves neither b nor c.
    assert np.isnan(large.mac(small).sel(first=0)).all()
    with pytest.raises(
        ss.InputError, match="other: expected a dof that these modes have, such as 'x1', got 'b'"
    ):
        MODES.mac(small)
    with pytest.raises(ss.InputError, match=r"other: expected Modes, got Scene.*complex_modes"):
        MODES.mac(SCENE)


def test_modes_are_selected_by_band_and_stability():
    modes = ss.complex_modes(ss.models.two_subsystems())
    every = modes.select()
    assert [mode.number for mode in every] == [0, 1, 2, 3, 4, 5]
    (growing,) = modes.select(unstable=True)
    assert growing.unstable
    assert growing.number == 1
    assert [mode.number for mode in modes.select(band=(119.0, 240.0), unstable=False)] == [2, 3]
    edge = modes.frequencies[2]
    assert [mode.number for mode in modes.select(band=(edge, edge))] == [2]
    assert modes.select(band=(0.0, 1.0)) == ()
    assert modes.select(oscillating=False) == ()
    real = ss.complex_modes(ss.models.two_subsystems(), "+-").select(oscillating=False)
    assert [mode.eigenvalue.imag for mode in real] == [0.0] * len(real)
    assert len(real) > 0
    for band in ((2.0, 1.0), (1.0,), 3.0):
        with pytest.raises(ss.InputError, match="band"):
            modes.select(band=band)
