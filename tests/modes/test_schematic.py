"""Scenes drawn from their matrices: bodies, springs, walls, and modes in motion."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.animation import AbstractMovieWriter

import stickslip as ss
from equal_chain import equal_chain
from meshed import block, plate
from stickslip.scene.drawing.schematic import VIEW, meshed, schematic
from stickslip.scene.known import known_of


def line(walls=(100.0, 0.0, 0.0), between=(50.0, 70.0)):
    """Return three masses in line, the first of which rubs: its normal dof stands last."""
    stiffness = np.diag([*walls, 1e4])
    for k, spring in enumerate(between):
        stiffness[k : k + 2, k : k + 2] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    contact = ss.Contact(tangential=0, normal=3, friction=0.3, slider_speed=0.1)
    return ss.Scene(np.ones(4), stiffness, force=[0.0, 0.0, 0.0, -10.0], contacts=[contact])


def test_springs_and_walls_are_those_of_the_matrix():
    drawing = schematic(line())
    assert [body.name for body in drawing.bodies] == ["contact 0: x1, x4", "x2", "x3"]
    assert [body.along for body in drawing.bodies] == [
        ((0, 1.0, 0.0), (3, 0.0, 1.0)),
        ((1, 1.0, 0.0),),
        ((2, 1.0, 0.0),),
    ]
    assert drawing.springs == ((0, 1, 50.0), (1, 2, 70.0))
    # The normal spring ends at the wall too; the stiffest counts.
    assert drawing.walls == ((0, 1e4),)
    assert schematic(line(walls=(0.0, 0.0, 30.0))).walls == ((2, pytest.approx(30.0)), (0, 1e4))
    assert drawing.omitted == 0


def test_layers_count_springs_from_the_contact():
    drawing = schematic(line())
    assert [body.y for body in drawing.bodies] == [0.0, 1.0, 2.0]


def test_no_two_bodies_stand_in_one_place():
    scene = equal_chain(6, friction=0.3)
    drawing = schematic(scene)
    assert len(drawing.bodies) == 18
    places = {(body.x, body.y) for body in drawing.bodies}
    assert len(places) == 18
    moved = sorted({dof for body in drawing.bodies for dof, _, _ in body.along})
    assert moved == list(range(scene.size))


def test_no_spring_hides_behind_a_body_or_another_spring():
    # With contacts of its own it is not the model, whose places are known.
    model = ss.models.two_subsystems()
    drawing = schematic(model.replace(contacts=model.contacts))
    places = np.array([(body.x, body.y) for body in drawing.bodies])
    for a, b, _ in drawing.springs:
        along = places[b] - places[a]
        for other in set(range(len(places))) - {a, b}:
            beside = places[other] - places[a]
            part = np.clip(beside @ along / (along @ along), 0.0, 1.0)
            # A spring is 0.07 wide.
            assert np.hypot(*(beside - part * along)) > 0.1
    # Every dof has its name in the drawing.
    assert {"contact 0: x3, x4", "contact 1: x7, x8"} < {body.name for body in drawing.bodies}


def test_what_is_large_says_what_it_leaves_out():
    size = 100
    scene = ss.Scene(np.ones(size), np.diag(np.full(size, 10.0)))
    drawing = schematic(scene)
    assert (len(drawing.bodies), drawing.omitted) == (48, 52)
    axes = scene.plot()
    assert "52 dofs are left out" in [text.get_text() for text in axes.texts]
    plt.close(axes.figure)


def test_known_masses_stand_where_they_are():
    scene = ss.models.two_subsystems()
    drawing = schematic(scene, known_of(scene).columns)
    assert [body.name for body in drawing.bodies] == ["m1", "m2", "m3", "m4"]
    displacement = np.zeros(8)
    displacement[2] = 1.0
    # Tangential to a slider inclined by 0.3.
    assert drawing.moved(displacement)[1] == pytest.approx([np.cos(0.3), np.sin(0.3)])
    displacement[2:4] = 0.0, 1.0
    assert drawing.moved(displacement)[1] == pytest.approx([-np.sin(0.3), np.cos(0.3)])
    assert {(a, b) for a, b, _ in drawing.springs} == {(0, 1), (0, 2), (2, 3)}


def test_a_mesh_in_the_plane_keeps_its_shape():
    scene = ss.fe.assemble(block(4, 2))
    drawing = meshed(scene.mesh)
    assert len(drawing.faces) == 8
    # Its top is held: there no dof moves a point.
    still = [body for body in drawing.bodies if not body.along]
    assert [body.y for body in still] == pytest.approx([0.02] * 5)
    assert (len(drawing.bodies), drawing.omitted) == (15, 0)
    displacement = np.zeros(scene.size)
    dof = scene.mesh.dofs[0, 1]
    displacement[dof] = 1.0
    moved = drawing.moved(displacement)
    assert moved[np.any(moved != 0.0, axis=1)] == pytest.approx(np.array([[0.0, 1.0]]))


def test_a_mesh_in_space_is_seen_from_above_its_front_faces_last():
    scene = ss.fe.assemble(plate((2, 2, 2), (0.02, 0.02, 0.004), (0.0, 0.0, 0.0)))
    drawing = meshed(scene.mesh)
    # 26 of 27 points and 24 faces lie at the surface; the point within moves nothing that is seen.
    assert (len(drawing.bodies), len(drawing.faces), drawing.omitted) == (26, 24, 3)
    right, up, eye = VIEW
    np.testing.assert_allclose(np.array(VIEW) @ np.transpose(VIEW), np.eye(3), atol=1e-15)
    assert eye == pytest.approx(np.cross(right, up))
    surface = sorted({int(node) for face in scene.mesh.faces() for node in face})
    depth = [np.mean([scene.mesh.points[surface[k]] @ eye for k in face]) for face in drawing.faces]
    assert depth == sorted(depth)
    random = np.random.default_rng(3).normal(size=scene.size)
    there = scene.mesh.displacements(random)[surface]
    np.testing.assert_allclose(drawing.moved(random), np.stack([there @ right, there @ up], 1), atol=1e-14)


def test_a_mode_moves_with_the_phase_of_each_body():
    scene = ss.models.two_subsystems()
    modes = ss.complex_modes(scene)
    columns = known_of(scene).columns
    mode = int(np.argmax(modes.eigenvalues.real))
    frames = []

    class Pictures(AbstractMovieWriter):
        def setup(self, fig, outfile, dpi=None):
            self.fig, self.dpi, self.outfile = fig, dpi, outfile
            self.fps = 1

        def grab_frame(self, **_):
            frames.append(self.fig.axes[0].collections[0].get_offsets().data.copy())

        def finish(self):
            pass

    modes.plot.animate(columns=columns, frames=8).save("unused", writer=Pictures())
    assert len(frames) == 8
    drawing = schematic(scene, columns)
    moved = drawing.moved(modes.shapes[:, mode])
    moved *= 0.3 / np.abs(moved).max()
    rest = np.array([(body.x, body.y) for body in drawing.bodies])
    for k, places in enumerate(frames):
        assert places - rest == pytest.approx((moved * np.exp(2j * np.pi * k / 8)).real, abs=1e-12)
    axes = modes.plot.structure(columns=columns)
    assert axes.get_title().endswith(" 119.36 Hz, grows at 49.9 1/s")
    assert axes.collections[0].get_offsets().data - rest == pytest.approx(moved.real)
    plt.close(axes.figure)


def test_what_cannot_be_drawn_is_refused():
    scene = ss.models.two_subsystems()
    modes = ss.complex_modes(scene)
    with pytest.raises(ss.InputError, match=r"number: expected a mode in 0\.\.5, got 6"):
        modes.plot.structure(6)
    with pytest.raises(ss.InputError, match="scene: it has no points"):
        scene.plot.mesh(np.zeros(8))
    with pytest.raises(ss.InputError, match="frames: expected"):
        modes.plot.animate(frames=1)
    with pytest.raises(ss.InputError, match=r"displacement: expected shape \(8,\)"):
        scene.plot(np.zeros(3))
    plt.close("all")
