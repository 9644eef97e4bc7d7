"""Friction damping across the sliding direction: closed forms, and what a mesh makes of it."""

import mpmath
import numpy as np
import pytest

import stickslip as ss
from meshed import plate

MU, FORCE, SPEED = 0.4, 30.0, 0.05


def slider(friction=MU, speed=SPEED, **changes):
    """A mass of 2 kg pressed on a slider; x along the sliding, y across it, z the normal."""
    contact = ss.Contact(tangential="x", normal="z", friction=friction, slider_speed=speed)
    scene = ss.Scene(
        [2.0, 2.0, 2.0],
        np.diag([3e4, 5e4, 8e4]),
        force=[0.0, 0.0, -FORCE],
        contacts=[contact],
        dofs=["x", "y", "z"],
    )
    return scene.replace(**changes)


@pytest.mark.parametrize("speed", [SPEED, -SPEED])
def test_one_mass_across_the_sliding(speed):
    """``2 y'' + (mu F / |v|) y' + k y = 0``; along the sliding nothing changes."""
    scene = slider(speed=speed)
    modes = ss.complex_modes(scene, transverse=[{"y": 1.0}]).with_conjugates
    c = mpmath.mpf(MU) * mpmath.mpf(FORCE) / mpmath.mpf(SPEED)
    root = mpmath.sqrt(c**2 - 4 * 2 * mpmath.mpf(5e4))
    expected = sorted((complex((-c + sign * root) / 4) for sign in (1, -1)), key=lambda value: value.imag)
    found = modes.eigenvalues[modes.eigenvalues.real < -1.0]
    np.testing.assert_allclose(sorted(found, key=lambda value: value.imag), expected, rtol=1e-14)
    undamped = modes.eigenvalues[np.abs(modes.eigenvalues.real) <= 1.0]
    np.testing.assert_allclose(np.abs(undamped.imag), np.sqrt(3e4 / 2.0), rtol=1e-14)
    # Motions know nothing of it, and neither do contacts that are open or stick.
    assert scene.damping is None
    for combination in "ds":
        with_it = ss.complex_modes(scene, combination, transverse=[{"y": 1.0}])
        assert np.array_equal(with_it.eigenvalues, ss.complex_modes(scene, combination).eigenvalues)


def test_a_law_of_friction_counts_at_the_speed_of_the_slider():
    law = ss.friction.Rational(static=0.6, kinetic=0.2, speed=0.05)
    modes = ss.complex_modes(slider(friction=law), transverse=[[0.0, 1.0, 0.0]])
    # Its coefficient at 0.05 m/s is 0.4.
    damped = modes.eigenvalues[np.abs(np.abs(modes.eigenvalues) - np.sqrt(5e4 / 2.0)) < 1e-6]
    np.testing.assert_allclose(damped.real, -MU * FORCE / SPEED / 4.0, rtol=1e-12)


@pytest.mark.parametrize("damping", [None, ss.Rayleigh(stiffness=1e-7)])
def test_a_mesh_that_moves_across_as_a_whole(damping):
    """With one speed everywhere the damping matrix is mu F / v along a common motion across."""
    pad = plate((3, 2, 1), (0.03, 0.02, 0.01), (0.0, 0.0, 0.0))
    pad = pad.held(pad.surface("top"), directions=(1,))
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), None, velocity=(2.0, 0.0, 0.0), friction=0.3)
    # Held by springs to the ground in the plane.
    stiffness = pad.stiffness.tolil()
    place = {name: k for k, name in enumerate(pad.names)}
    across = np.array([name.endswith(".2") for name in pad.names])
    stiffness[across, across] = stiffness.diagonal()[across] + 1e6
    body = ss.fe.Body(pad.mass, stiffness, dofs=pad.names, points=pad.points)
    scene = ss.fe.assemble(body, pairs, force=pad.surface("top").pressure(1e6), damping=damping)
    combination = "+" * len(pairs)
    plain = ss.complex_modes(scene, combination)
    modes = ss.complex_modes(scene, combination, transverse=pairs.transverse)
    together = (modes.damping - plain.damping)[
        np.ix_(_free(across, pairs, place), _free(across, pairs, place))
    ]
    assert together.sum() == pytest.approx(0.3 * 1e6 * 0.03 * 0.02 / 2.0, rel=1e-9)
    assert modes.eigenvalues.real.min() < plain.eigenvalues.real.min()
    band = ss.complex_modes(scene, combination, band=(0.0, 40e3), transverse=pairs.transverse)
    inside = modes.eigenvalues[modes.frequencies <= 40e3]
    np.testing.assert_allclose(band.eigenvalues, inside, rtol=1e-9)


def _free(across, pairs, place):
    """Return which coordinates of the sliding combination are displacements across."""
    normal = [place[next(iter(contact.normal))] for contact in pairs.contacts]
    return np.delete(across, normal)


def test_what_is_ill_posed_is_refused():
    scene = slider()
    for given, combination, told in (
        ("y", None, "transverse: expected one direction per contact"),
        ([], None, "transverse: expected 1 directions, one per contact, got 0"),
        ([{"q": 1.0}], None, "unknown dof 'q'"),
        ([{"y": 1.0}], "-", None),
    ):
        if told is None:
            ss.complex_modes(scene, combination, transverse=given)
            continue
        with pytest.raises(ss.InputError, match=told):
            ss.complex_modes(scene, combination, transverse=given)
    with pytest.raises(ss.InputError, match=r"contact 0 does not slide steadily in .*force is -30 N"):
        ss.complex_modes(slider(force=[0.0, 0.0, FORCE]), "+", transverse=[{"y": 1.0}])
    with pytest.raises(ss.InputError, match="its slider is at rest"):
        ss.complex_modes(slider(speed=0.0), "+", transverse=[{"y": 1.0}])
