import numpy as np
import pytest
from hypothesis import given

import stickslip as ss
from random_scenes import drawn_scenes

EPS = np.finfo(float).eps


@given(drawn_scenes())
def test_sliding_equilibrium_is_the_one_the_scene_was_made_for(drawn):
    scene = drawn.scene
    state = ss.steady_sliding(scene)
    assert state.combination == "".join("+" if c.slider_speed > 0 else "-" for c in scene.contacts)
    assert not state.velocity.any()
    condition = np.linalg.cond(ss.equations_of(scene, state.combination).stiffness)
    error = np.abs(state.position - drawn.equilibrium).max()
    assert error <= 10 * EPS * condition * np.abs(drawn.equilibrium).max()
    forces = ss.simulate(scene, 1e-6, state).sample(0.0)
    stiffness = np.abs(scene.stiffness).sum(axis=1).max()
    tolerance = 10 * EPS * condition * stiffness * np.abs(drawn.equilibrium).max()
    assert np.abs(forces.normal_force.values[0] - drawn.normal_force).max() <= tolerance


def test_equilibrium_of_the_reference_solution(standard, lifting):
    for reference in (standard, lifting):
        state = ss.steady_sliding(reference.scene)
        # Printed to more digits than a double has; the stiffness has a condition number below 1e3.
        error = np.abs(state.position - reference.start.position)
        assert error.max() <= 1e3 * EPS * np.abs(reference.start.position).max()


def test_perturbed_adds_by_name_index_or_vector():
    state = ss.steady_sliding(ss.models.two_subsystems())
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


@given(drawn_scenes())
def test_contact_forces_of_a_state_are_those_of_a_run_from_it(drawn):
    state = ss.steady_sliding(drawn.scene)
    forces = state.contact_forces(drawn.scene)
    sampled = ss.simulate(drawn.scene, 1e-6, state).sample(0.0)
    for name in ("normal_force", "friction_force"):
        assert (forces[name].to_numpy() == sampled[name].to_numpy()[0]).all()
    # At rest K x = F + D f, whatever mass couples.
    directions = [
        direction(i)
        for i in range(len(drawn.scene.contacts))
        for direction in (drawn.scene.tangential_direction, drawn.scene.normal_direction)
    ]
    along = np.stack([forces.friction_force, forces.normal_force], axis=1).ravel()
    load = drawn.scene.stiffness @ state.position - drawn.scene.force
    condition = np.linalg.cond(ss.equations_of(drawn.scene, state.combination).stiffness)
    scale = np.abs(drawn.scene.stiffness).sum(axis=1).max() * np.abs(state.position).max()
    assert np.abs(load - np.transpose(directions) @ along).max() <= 100 * EPS * condition * scale


def test_contact_forces_are_named_and_a_state_of_another_scene_is_refused():
    scene = ss.models.two_subsystems()
    named = scene.replace(
        contacts=[
            ss.Contact(tangential="x3", normal="x4", friction=1.5, slider_speed=0.025, name="left"),
            ss.Contact(tangential="x7", normal="x8", friction=1.5, slider_speed=0.025, name="right"),
        ]
    )
    state = ss.steady_sliding(named)
    forces = state.contact_forces(named)
    assert forces.contact.to_numpy().tolist() == ["left", "right"]
    # Coulomb's law in positive sliding; the sticking contact of a run holds less than friction times N.
    assert (forces.friction_force == 1.5 * forces.normal_force).all()
    run = ss.simulate(named, 0.3, state.perturbed(velocity={"x1": 1e-3}))
    stuck = next(event.time for event in run.events if "s" in event.combination)
    found = run.state(stuck)
    i = found.combination.index("s")
    held = found.contact_forces(named).isel(contact=i)
    assert abs(float(held.friction_force)) <= 1.5 * float(held.normal_force)
    with pytest.raises(ss.InputError, match=r"combination: .* per contact \(0 in all\)"):
        state.contact_forces(ss.Scene([1.0, 1.0], np.eye(2)))
    with pytest.raises(ss.InputError, match="position: contact 0 penetrates, gap -1 m"):
        state.perturbed(position={"x4": -1.0}).contact_forces(named)


def test_steady_sliding_knows_its_scene_and_its_forces(tmp_path, standard):
    scene = standard.scene
    found = ss.steady_sliding(scene)
    assert found.scene is scene
    of_scene = found.contact_forces(scene)
    assert found.contact_forces().identical(of_scene)
    np.testing.assert_array_equal(found.friction_forces, of_scene.friction_force)
    # Coulomb's law in the direction of the slider.
    signs = [1.0 if letter == "+" else -1.0 for letter in found.combination]
    friction = [contact.friction for contact in scene.contacts]
    expected = signs * np.array(friction) * found.normal_forces
    np.testing.assert_allclose(found.friction_forces, expected, rtol=1e-15)
    assert "only one" in str(found.summary())
    assert "normal force, N" in found._repr_html_()
    ss.save(found, tmp_path / "sliding.nc")
    assert ss.load(tmp_path / "sliding.nc").identical(found.to_dataset())
    moved = ss.steady_sliding(scene.replace(friction=0.0))
    assert not moved.friction_forces.any()
