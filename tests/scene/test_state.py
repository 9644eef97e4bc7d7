import numpy as np
import pytest
from hypothesis import given

import stickslip as ss
from random_scenes import drawn_scenes

EPS = np.finfo(float).eps


@given(drawn_scenes())
def test_sliding_equilibrium_is_the_one_the_scene_was_made_for(drawn):
    scene = drawn.scene
    state = ss.sliding_equilibrium(scene)
    assert state.combination == "".join("+" if c.slider_speed > 0 else "-" for c in scene.contacts)
    assert not state.velocity.any()
    condition = np.linalg.cond(ss.reduce(scene, state.combination).stiffness)
    error = np.abs(state.position - drawn.equilibrium).max()
    assert error <= 10 * EPS * condition * np.abs(drawn.equilibrium).max()
    forces = ss.simulate(scene, state, 1e-6).sample(0.0)
    stiffness = np.abs(scene.stiffness).sum(axis=1).max()
    tolerance = 10 * EPS * condition * stiffness * np.abs(drawn.equilibrium).max()
    assert np.abs(forces.normal_force.values[0] - drawn.normal_force).max() <= tolerance


def test_equilibrium_of_the_reference_solution(standard, lifting):
    for reference in (standard, lifting):
        state = ss.sliding_equilibrium(reference.scene)
        # Printed to more digits than a double has; the stiffness has a condition number below 1e3.
        error = np.abs(state.position - reference.start.position)
        assert error.max() <= 1e3 * EPS * np.abs(reference.start.position).max()


def test_perturbed_adds_by_name_index_or_vector():
    state = ss.sliding_equilibrium(ss.models.two_subsystems())
    by_name = state.perturbed(velocity={"x1": 1e-3, "x6": 2e-3}, position={"x2": 1e-6})
    assert by_name.velocity.tolist() == [1e-3, 0, 0, 0, 0, 2e-3, 0, 0]
    assert by_name.position[1] == state.position[1] + 1e-6
    assert by_name.combination == state.combination
    by_index = state.perturbed(velocity={0: 1e-3, 5: 2e-3})
    assert np.array_equal(by_index.velocity, by_name.velocity)
    by_vector = state.perturbed(velocity=by_name.velocity)
    assert np.array_equal(by_vector.velocity, by_name.velocity)
    assert not state.velocity.any()


def test_a_state_is_read_only():
    state = ss.State([0.0, 1.0], [2.0, 3.0], combination="+")
    assert state.dofs == ("x1", "x2")
    with pytest.raises(ValueError, match="read-only"):
        state.position[0] = 1.0
