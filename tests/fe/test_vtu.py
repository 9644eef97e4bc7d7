"""Displacements on the mesh: what meshio reads back, with phases and scales."""

import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest

import stickslip as ss
from meshed import block


@pytest.fixture(scope="module")
def scene():
    """A block of 6 x 4 elements on a belt."""
    body = block(6, 4)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.5, gap=-1e-6)
    return ss.fe.assemble(body, pairs, impact_friction=True)


def listed(path):
    """Return times and files that a .pvd names."""
    found = [one.attrib for one in ET.parse(path).getroot().iter("DataSet")]
    return [float(one["timestep"]) for one in found], [path.parent / one["file"] for one in found]


def test_a_motion_as_it_is(scene, tmp_path):
    start = ss.steady_sliding(scene).perturbed(velocity={"1.1": 1e-3})
    run = ss.simulate(scene, 2e-6, start)
    sampled = run.sample([0.0, 1e-6, 2e-6])
    files = ss.fe.write_vtu(tmp_path / "squeal.pvd", scene, sampled)
    times, named = listed(tmp_path / "squeal.pvd")
    assert times == [0.0, 1e-6, 2e-6]
    assert [tmp_path / "squeal.pvd", *named] == files
    last = meshio.read(named[2])
    assert last.cells_dict["quad"].shape == (24, 4)
    np.testing.assert_array_equal(last.points[:, :2], scene.mesh.points)
    for k, dof in enumerate(scene.dofs):
        node, direction = dof.split(".")
        for field in ("position", "velocity"):
            name = {"position": "displacement"}.get(field, field)
            shown = last.point_data[name][int(node) - 1, int(direction) - 1]
            assert shown == sampled[field][2, k]
    # The top is held.
    top = scene.mesh.points[:, 1] > 0.02 - 1e-9
    assert (last.point_data["displacement"][top] == 0.0).all()


def test_a_complex_mode_moves_with_its_phases(scene, tmp_path):
    modes = ss.complex_modes(scene)
    for given in (modes, modes.to_dataset(), modes.shapes[:, 4]):
        ss.fe.write_vtu(tmp_path / "mode.pvd", scene, given, mode=4, frames=8)
        times, named = listed(tmp_path / "mode.pvd")
        step = 2 * np.pi / abs(modes.eigenvalues[4].imag) / 8 if given is not modes.shapes[:, 4] else 1 / 8
        if not isinstance(given, np.ndarray):
            np.testing.assert_allclose(times, step * np.arange(8), rtol=1e-14)
        frames = np.array([meshio.read(file).point_data["displacement"][:, :2] for file in named])
        shape = scene.mesh.displacements(modes.shapes[:, 4])
        # What a discrete Fourier transform of the period gives back is the complex shape, scaled.
        phases = np.exp(-2j * np.pi * np.arange(8) / 8)
        found = 2 * np.tensordot(phases, frames, axes=1) / 8
        length = np.sqrt((np.abs(shape) ** 2).sum(axis=1)).max()
        expected = 0.05 * np.hypot(0.04, 0.02) / length * shape
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)


def test_a_state_a_vector_and_a_scale(scene, tmp_path):
    steady = ss.steady_sliding(scene)
    for given in (steady, steady.position):
        path = tmp_path / "new" / "folder" / "steady.pvd"
        ss.fe.write_vtu(path, scene, given)
        times, (file,) = listed(path)
        assert times == [0.0]
        shown = meshio.read(file).point_data["displacement"][:, :2]
        np.testing.assert_array_equal(shown, scene.mesh.displacements(steady.position))
    shape = steady.position.astype(complex)
    ss.fe.write_vtu(tmp_path / "shape.pvd", scene, shape, frames=2, scale=3.0)
    first = meshio.read(listed(tmp_path / "shape.pvd")[1][0]).point_data["displacement"][:, :2]
    np.testing.assert_allclose(first, 3.0 * scene.mesh.displacements(steady.position), rtol=1e-15)


def test_a_reduced_motion_on_the_full_mesh(scene, tmp_path):
    reduced = ss.fe.reduce(scene, (1e3, 60e3), modes=8)
    start = ss.steady_sliding(reduced.scene).perturbed(velocity={"q0": 1e-4})
    run = ss.simulate(reduced.scene, 2e-6, start)
    files = ss.fe.write_vtu(tmp_path / "a.pvd", scene, reduced.expand(run.sample([1e-6])))
    shown = meshio.read(files[1]).point_data["displacement"][:, :2]
    expected = scene.mesh.displacements(reduced.expand(run.state(1e-6)).position)
    np.testing.assert_allclose(shown, expected, rtol=0, atol=1e-18)
    with pytest.raises(ss.InputError, match="those of a reduced scene go through expand first"):
        ss.fe.write_vtu(tmp_path / "a.pvd", scene, run.sample([1e-6]))


def test_what_is_ill_posed_is_refused(scene, tmp_path):
    modes = ss.complex_modes(scene)
    plain = scene.replace(mesh=None)
    for arguments, options, told in (
        ((tmp_path / "a.vtu", scene, modes), {}, "path: expected a file .pvd"),
        ((tmp_path / "a.pvd", plain, modes), {}, "scene: it has no points"),
        ((tmp_path / "a.pvd", scene, "modes"), {}, "displacements: expected what sample, expand"),
        ((tmp_path / "a.pvd", scene, np.full(scene.size, np.nan)), {}, "displacements: must be finite"),
        ((tmp_path / "a.pvd", scene, np.zeros(scene.size, complex)), {}, "zero at all points"),
        ((tmp_path / "a.pvd", scene, modes), {"mode": 1000}, "mode: expected a mode in 0.."),
        ((tmp_path / "a.pvd", scene, modes), {"frames": 1}, "frames: expected an integer >= 2"),
    ):
        with pytest.raises(ss.InputError, match=told):
            ss.fe.write_vtu(*arguments, **options)
    assert not list(tmp_path.iterdir())


def test_without_meshio_the_message_says_what_to_install(scene, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "meshio", None)
    with pytest.raises(ss.InputError, match=r"write_vtu: this needs meshio; pip install 'stickslip\[fe\]'"):
        ss.fe.write_vtu(tmp_path / "a.pvd", scene, np.zeros(scene.size))
