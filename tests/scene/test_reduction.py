import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from peer_integrator import Mechanics
from random_scenes import drawn_scenes

COMBINATIONS = ["".join(pair) for pair in itertools.product("+-sd", repeat=2)]


@pytest.mark.parametrize("combination", COMBINATIONS)
def test_bases_merge_the_normal_row_into_the_tangential_one(combination):
    scene = ss.models.two_subsystems(friction=(1.5, 0.8))
    right, left = np.eye(8), np.eye(8)
    dropped = []
    for contact, status in enumerate(combination):
        tangential, normal = 4 * contact + 2, 4 * contact + 3
        if status in "+-":
            left[normal, tangential] = (-1.0 if status == "+" else 1.0) * (1.5, 0.8)[contact]
            dropped += [normal]
        elif status == "s":
            dropped += [tangential, normal]
    kept = [k for k in range(8) if k not in dropped]
    right, left = right[:, kept], left[:, kept]
    reduced = ss.equations_of(scene, combination)
    assert np.array_equal(reduced.right_basis, right)
    assert np.array_equal(reduced.left_basis, left)
    stiffness = scene.stiffness.toarray()
    # Each entry is a sum of two products at most.
    rounding = 4 * np.finfo(float).eps * 2.5 * np.abs(stiffness).max()
    assert np.abs(reduced.stiffness - left.T @ stiffness @ right).max() <= rounding
    assert np.abs(reduced.damping - 1e-4 * left.T @ stiffness @ right).max() <= 1e-4 * rounding
    assert np.array_equal(reduced.mass, np.diag(scene.mass[kept]))


@pytest.mark.parametrize("combination", COMBINATIONS)
def test_a_sticking_contact_moves_with_its_slider(combination):
    scene = ss.models.two_subsystems(slider_speed=(0.025, 0.04))
    reduced = ss.equations_of(scene, combination)
    speed = np.zeros(8)
    for contact, status in enumerate(combination):
        speed[4 * contact + 2] = (0.025, 0.04)[contact] * (status == "s")
    stiffness = scene.stiffness.toarray()
    constant = reduced.left_basis.T @ (scene.force - 1e-4 * stiffness @ speed)
    linear = -reduced.left_basis.T @ stiffness @ speed
    # Sums of at most eight products.
    eps = 16 * np.finfo(float).eps
    assert np.abs(reduced.force_constant - constant).max() <= eps * np.abs(scene.force).max()
    assert np.abs(reduced.force_linear - linear).max() <= eps * np.abs(stiffness).max() * np.abs(speed).max()


@given(drawn_scenes(), st.data())
def test_reduced_equations_give_the_accelerations_of_the_constrained_ones(drawn, data):
    """Against multipliers: for any state in a combination, R q'' = x''."""
    scene = drawn.scene
    combination = data.draw(st.text("+-sd", min_size=len(scene.contacts), max_size=len(scene.contacts)))
    frictionless = [i for i, c in enumerate(scene.contacts) if c.static_friction == 0.0]
    combination = "".join("+" if i in frictionless and s == "s" else s for i, s in enumerate(combination))
    reduced = ss.equations_of(scene, combination)
    q, u = 1e-4 * drawn.rng.normal(size=(2, reduced.mass.shape[0]))
    # Clearances of what is closed, and prescribed velocities at zero tangential displacement of what sticks.
    offset, moving = np.zeros(scene.size), np.zeros(scene.size)
    for i, (contact, status) in enumerate(zip(scene.contacts, combination, strict=True)):
        if status != "d":
            offset -= contact.gap * Mechanics(scene).normal[i]
        if status == "s":
            moving += contact.slider_speed * scene.tangential_direction(i)
    x = reduced.right_basis @ q + offset
    v = reduced.right_basis @ u + moving
    generator, constant, _ = Mechanics(scene).linear(combination)
    acceleration = (generator @ np.concatenate([x, v]) + constant)[scene.size :]
    load = reduced.force_constant - reduced.damping @ u - reduced.stiffness @ q
    ours = reduced.right_basis @ np.linalg.solve(reduced.mass, load)
    # Accelerations are differences of forces of this size; the condition of M and of R is below 100.
    forces = (
        np.abs(reduced.stiffness).max() * (np.abs(x).max() + np.abs(offset).max()) + np.abs(scene.force).max()
    )
    assert np.abs(ours - acceleration).max() <= 1e3 * np.finfo(float).eps * forces / 0.2
