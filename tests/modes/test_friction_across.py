"""Friction damping across the sliding direction of planes: closed forms, and what a mesh makes of it."""

import mpmath
import numpy as np
import pytest

import stickslip as ss
from meshed import plate

MU, FORCE, SPEED = 0.4, 30.0, 0.05


def slider(speed=SPEED, **changes):
    """A mass of 2 kg pressed on a slider; x along the sliding, y across it, z the normal."""
    contact = ss.Contact(tangential=("x", "y"), normal="z", friction=MU, slider_speed=(speed, 0.0))
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
    modes = ss.complex_modes(slider(speed)).with_conjugates
    c = mpmath.mpf(MU) * mpmath.mpf(FORCE) / mpmath.mpf(SPEED)
    root = mpmath.sqrt(c**2 - 4 * 2 * mpmath.mpf(5e4))
    expected = sorted((complex((-c + sign * root) / 4) for sign in (1, -1)), key=lambda value: value.imag)
    found = modes.eigenvalues[modes.eigenvalues.real < -1.0]
    np.testing.assert_allclose(sorted(found, key=lambda value: value.imag), expected, rtol=1e-14)
    undamped = modes.eigenvalues[np.abs(modes.eigenvalues.real) <= 1.0]
    np.testing.assert_allclose(np.abs(undamped.imag), np.sqrt(3e4 / 2.0), rtol=1e-14)


def test_steady_sliding_without_a_normal_force_or_a_speed_has_no_damping_across():
    with pytest.raises(ss.InputError, match="slider_speed"):
        ss.complex_modes(slider(slider_speed=0.0))
    with pytest.raises(ss.InputError, match="slider_speed is 0, so steady sliding has no direction"):
        ss.complex_modes(slider(slider_speed=0.0), "oo")
    still = ss.Contact(tangential="w", normal="u", friction=MU, slider_speed=0.1)
    wider = ss.Scene(
        np.full(5, 2.0),
        np.diag([3e4, 5e4, 8e4, 1e4, 1e4]),
        force=[0.0, 0.0, -FORCE, 0.0, -FORCE],
        contacts=[*slider().contacts, still],
        dofs=["x", "y", "z", "w", "u"],
    )
    with pytest.raises(ss.InputError, match="contact 2 sticks, so there is no steady state"):
        ss.complex_modes(wider, "oos")


@pytest.mark.parametrize("consistent", [False, True])
@pytest.mark.parametrize("damping", [None, ss.Rayleigh(stiffness=1e-7)])
def test_a_mesh_that_moves_across_as_a_whole(consistent, damping):
    """With one speed everywhere the damping matrix is mu F / v along a common motion across."""
    pad = plate((3, 2, 1), (0.03, 0.02, 0.01), (0.0, 0.0, 0.0))
    pad = pad if consistent else pad.lumped()
    pad = pad.held(pad.surface("top"), directions=(1,))
    # Held by springs to the ground in the plane.
    stiffness = pad.stiffness.tolil()
    across = np.array([name.endswith(".2") for name in pad.names])
    stiffness[across, across] = stiffness.diagonal()[across] + 1e6
    body = ss.fe.Body(pad.mass, stiffness, dofs=pad.names, points=pad.points)
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), None, velocity=(2.0, 0.0, 0.0), friction=0.3)
    scene = ss.fe.assemble(body, pairs, force=pad.surface("top").pressure(1e6), damping=damping)
    modes = ss.complex_modes(scene)
    assert modes.combination == "oo" * len(pairs)
    # Normal dofs are held, and their rows times the friction are those of the dofs along the sliding.
    place = {name: k for k, name in enumerate(pad.names)}
    held = [place[next(iter(contact.normal))] for contact in pairs.contacts]
    along, beside = (
        [place[next(iter(contact.tangential[axis]))] for contact in pairs.contacts] for axis in (0, 1)
    )
    free = np.delete(np.arange(scene.size), held)
    mass, spring = body.mass.toarray(), stiffness.toarray()
    damper = np.zeros_like(mass) if damping is None else damping.stiffness * spring
    for matrix in (mass, spring, damper):
        matrix[along] -= 0.3 * matrix[held]
    load = np.array(scene.force)
    load[along] -= 0.3 * load[held]
    rest = np.zeros(scene.size)
    rest[free] = np.linalg.solve(spring[np.ix_(free, free)], load[free])
    normal_force = (stiffness.toarray() @ rest - np.array(scene.force))[held]
    assert normal_force.sum() == pytest.approx(1e6 * 0.03 * 0.02, rel=1e-9)
    damper[beside, beside] += 0.3 * normal_force / 2.0
    m, c, k = (matrix[np.ix_(free, free)] for matrix in (mass, damper, spring))
    size = len(free)
    first_order = np.block(
        [[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]]
    )
    known = np.linalg.eigvals(first_order)
    off = np.abs(modes.eigenvalues[:, None] - known[None, :]).min(axis=1)
    assert (off / np.abs(modes.eigenvalues)).max() < 1e-8
    band = ss.complex_modes(scene, band=(0.0, 40e3))
    inside = modes.eigenvalues[modes.frequencies <= 40e3]
    np.testing.assert_allclose(band.eigenvalues, inside, rtol=1e-9)


def test_a_large_mesh_has_the_modes_of_its_dense_equations():
    """A pad on a plate whose nodes lie on faces, with consistent mass: for modes mass may couple contacts."""
    disc = plate((9, 7, 2), (0.04, 0.04, 0.006), (0.0, 0.0, 0.0), young=100e9, density=7000.0, name="disc")
    disc = disc.held(disc.surface("bottom"))
    pad = plate((4, 4, 2), (0.02, 0.02, 0.01), (0.011, 0.012, 0.006), name="pad")
    pad = pad.held(pad.surface("top"), directions=(1, 2))
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), disc.surface("top"), velocity=(2, 1, 0), friction=0.3)
    damping = ss.Rayleigh(stiffness=1e-8)
    scene = ss.fe.assemble([pad, disc], pairs, force=pad.surface("top").pressure(1e6), damping=damping)
    assert scene.size > 500
    modes = ss.complex_modes(scene, "oo" * len(pairs))
    band = ss.complex_modes(scene, "oo" * len(pairs), band=(0.0, 60e3))
    inside = modes.eigenvalues[modes.frequencies <= 60e3]
    assert len(inside) > 4
    assert abs(band.missing) < 0.1
    np.testing.assert_allclose(band.eigenvalues, inside, rtol=1e-8)
