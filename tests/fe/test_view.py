"""A mesh in space by pyvista: points and colours of pictures and films, and what files and notebooks get."""

import sys

import numpy as np
import pytest

import stickslip as ss
from meshed import block, plate

pv = pytest.importorskip("pyvista")

EPS = np.finfo(float).eps


@pytest.fixture(scope="module")
def scene():
    """A block of 6 x 4 elements on a belt."""
    body = block(6, 4)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.5, gap=-1e-6)
    return ss.fe.assemble(body, pairs, impact_friction=True)


@pytest.fixture(scope="module")
def box():
    """A box of 2 x 2 x 1 elements, free in space."""
    return ss.fe.assemble(plate((2, 2, 1), (0.02, 0.02, 0.004), (0.0, 0.0, 0.0)))


@pytest.fixture
def small(monkeypatch):
    """Small pictures, for speed."""
    monkeypatch.setattr("stickslip.scene.drawing.view.SIZE", (160, 112))


def in_space(values):
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))


def test_a_mode_at_a_phase(box):
    shape = np.exp(1j * np.arange(box.size))
    view = box.plot.view(shape, phase=0.7)
    grid = view.grid()
    moved = box.mesh.displacements(shape * np.exp(0.7j)).real
    # The largest amplitude of a point is drawn 0.08 of the size of the box, at every phase: |u| = sqrt(3).
    scale = 0.08 * np.hypot(np.hypot(0.02, 0.02), 0.004) / np.sqrt(3.0)
    # Phases up to 54 rad, rounded before their cosine, leave 54 ulp of displacements of 1; sizes of points
    # and displacements as drawn are below 0.03 m.
    np.testing.assert_allclose(grid.point_data["displacement"], moved, rtol=0, atol=54 * EPS)
    np.testing.assert_allclose(grid.points, box.mesh.points + scale * moved, rtol=0, atol=0.03 * 54 * EPS)
    np.testing.assert_allclose(
        grid.point_data["size"], np.linalg.norm(moved, axis=1), rtol=0, atol=2 * 54 * EPS
    )
    assert view.largest == pytest.approx(np.sqrt(3.0), rel=4 * EPS)
    assert grid.n_cells == 4
    assert set(grid.celltypes) == {pv.CellType.HEXAHEDRON}
    # Nodes around every cell in the order of VTK, so that volumes are positive.
    volumes = box.plot.view(shape, scale=0.0).grid().compute_cell_sizes().cell_data["Volume"]
    np.testing.assert_allclose(volumes, 0.01 * 0.01 * 0.004, rtol=1e-14)


def test_a_period_of_a_mode(scene):
    modes = ss.complex_modes(scene)
    worst = int(np.argmax(modes.eigenvalues.real))
    given = (modes, modes.to_dataset(), modes.to_dataset().isel(mode=worst))
    for view in (scene.plot.view(one, frames=8, scale=2.0) for one in given):
        assert len(view) == 8
        assert set(view.titles) == {f"mode {worst}: {modes.frequencies[worst]:.2f} Hz"}
        frames = np.array([view.grid(k).points for k in range(8)])
        # What a discrete Fourier transform of the period gives back is the complex shape, scaled.
        found = 2 * np.tensordot(np.exp(-2j * np.pi * np.arange(8) / 8), frames, axes=1) / 8
        expected = 2.0 * in_space(scene.mesh.displacements(modes.shapes[:, worst]))
        # Eight numbers up to 2.04 in a sum, twice their mean.
        np.testing.assert_allclose(found, expected, rtol=0, atol=8 * 2 * 2.04 * EPS)
        np.testing.assert_allclose(
            frames.mean(axis=0), in_space(scene.mesh.points), rtol=0, atol=8 * 2.04 * EPS
        )
    other = scene.plot.view(modes, mode=3, phase=np.pi)
    assert other.titles[0].startswith("mode 3: ")
    moved = in_space(scene.mesh.displacements(-modes.shapes[:, 3].real))
    np.testing.assert_allclose(other.grid().point_data["displacement"], moved, rtol=0, atol=2 * EPS)


def test_a_motion_at_one_time_and_over_a_run(scene):
    start = ss.steady_sliding(scene).perturbed(velocity={"1.1": 1e-3})
    run = ss.simulate(scene, 2e-6, start)
    times = [0.0, 1e-6, 2e-6]
    film = scene.plot.view(run.sample(times))
    assert film.titles == ("t = 0 s", "t = 1e-06 s", "t = 2e-06 s")
    at = run.state(1e-6)
    picture = scene.plot.view(at)
    assert (len(film), len(picture)) == (3, 1)
    moved = in_space(scene.mesh.displacements(at.position))
    for grid in (film.grid(1), picture.grid()):
        np.testing.assert_array_equal(grid.point_data["displacement"], moved)
        np.testing.assert_allclose(grid.point_data["size"], np.linalg.norm(moved, axis=1), rtol=2 * EPS)
    # One scale and one range of colours for the whole film.
    sizes = [film.grid(k).point_data["size"].max() for k in range(3)]
    assert film.largest == max(sizes)
    assert film.scale == pytest.approx(0.08 * np.hypot(0.04, 0.02) / max(sizes), rel=4 * EPS)
    turned = scene.dofs[::-1]
    same = ss.State(at.position[::-1], at.velocity[::-1], at.combination, turned)
    np.testing.assert_array_equal(scene.plot.view(same).position, picture.position)


def test_modes_and_motions_of_a_reduced_scene_on_the_full_mesh(scene):
    reduced = ss.fe.reduce(scene, (1e3, 60e3), modes=8)
    modes = ss.complex_modes(reduced.scene)
    view = scene.plot.view(reduced.expand(modes), mode=2)
    expected = scene.mesh.displacements(reduced.basis @ modes.shapes[:, 2]).real
    found = view.grid().point_data["displacement"]
    np.testing.assert_allclose(found, in_space(expected), rtol=0, atol=1e-13 * np.abs(expected).max())
    run = ss.simulate(reduced.scene, 2e-6, ss.steady_sliding(reduced.scene).perturbed(velocity={"q0": 1e-4}))
    film = scene.plot.view(reduced.expand(run.sample([0.0, 1e-6])))
    expected = scene.mesh.displacements(reduced.expand(run.state(1e-6)).position)
    np.testing.assert_allclose(
        film.grid(1).point_data["displacement"], in_space(expected), rtol=0, atol=1e-14 * film.largest
    )
    with pytest.raises(ss.InputError, match="those of a reduced scene go through expand first"):
        scene.plot.view(modes)


def test_a_picture_is_not_blank(box, small, tmp_path):
    view = box.plot.view(np.linspace(0.0, 1e-6, box.size))
    ss.save(view, tmp_path / "box.png")
    assert view._repr_html_() is None
    assert (tmp_path / "box.png").read_bytes() == view._repr_png_()
    pixels = pv.read(tmp_path / "box.png")
    assert pixels.dimensions[:2] == (160, 112)
    colours = np.unique(pixels.point_data["PNGImage"], axis=0)
    # The colours of the map beside those of background, edges and letters.
    assert len(colours) > 50


def test_a_film_moves_and_a_notebook_shows_it(scene, small, tmp_path):
    imageio = pytest.importorskip("imageio.v3")
    film = scene.plot.view(ss.complex_modes(scene), frames=4)
    ss.save(film, tmp_path / "mode.gif")
    pictures = imageio.imread(tmp_path / "mode.gif").astype(float)
    assert pictures.shape[:3] == (4, 112, 160)
    # Opposite phases differ most in shape, neighbours too.
    assert min(np.abs(pictures[k] - pictures[k - 1]).max() for k in range(4)) > 50.0
    assert film._repr_png_() is None
    assert film._repr_html_().startswith('<img src="data:image/gif;base64,R0lGOD')
    pytest.importorskip("imageio_ffmpeg")
    ss.save(film, tmp_path / "mode.mp4")
    assert (tmp_path / "mode.mp4").read_bytes()[4:8] == b"ftyp"
    assert len(list(tmp_path.iterdir())) == 2


def test_points_without_cells_and_a_plotter(scene, small):
    bare = scene.replace(mesh=type(scene.mesh)(scene.mesh.points, scene.mesh.dofs, {}))
    view = bare.plot.view(np.zeros(scene.size))
    grid = view.grid()
    assert set(grid.celltypes) == {pv.CellType.VERTEX}
    np.testing.assert_array_equal(grid.points, in_space(scene.mesh.points))
    plotter = view.plotter(off_screen=True)
    assert plotter.camera.parallel_projection
    assert tuple(plotter.window_size) == (160, 112)
    plotter.close()
    assert repr(view) == "View(picture, 35 points, scale 0.003578)"


def test_what_is_ill_posed_is_refused(scene, tmp_path):
    none = ss.simulate(scene, 1e-8).sample([])
    unknown = "displacements: expected what sample, expand or complex_modes return"
    modes, still = ss.complex_modes(scene), np.zeros(scene.size)
    strange = scene.replace(mesh=type(scene.mesh)(scene.mesh.points, scene.mesh.dofs, {"polygon": None}))
    for of, given, options, message in (
        (scene.replace(mesh=None), modes, {}, "scene: it has no points"),
        (strange, modes, {}, "scene: its mesh has cells 'polygon', expected some of vertex, line"),
        (scene, "modes", {}, unknown),
        (scene, still[1:], {}, "displacements: expected 56 dofs of the scene"),
        (scene, still * np.nan, {}, "displacements: must be finite"),
        (scene, modes.to_dataset().isel(mode=[]), {}, "displacements: expected at least one mode, got none"),
        (scene, {"position": still}, {}, unknown),
        (scene, none, {}, "displacements: expected at least one instant, got none"),
        (scene, modes, {"mode": 1000}, r"mode: expected a mode in 0..\d+, got 1000"),
        (scene, modes, {"frames": 1}, "frames: expected an integer >= 2, got 1"),
        (scene, modes, {"phase": np.inf}, "phase: must be finite, got inf"),
        (scene, modes, {"phase": "half"}, "phase: expected a real number, got 'half'"),
        (scene, modes, {"scale": np.nan}, "scale: must be finite, got nan"),
        (scene, still, {"mode": 3}, "mode: displacements that are no complex mode have none, got 3"),
        (scene, still, {"frames": 8}, "frames: displacements that are no complex mode have none, got 8"),
        (scene, still, {"phase": 1.0}, "phase: displacements that are no complex mode have none, got 1.0"),
        (scene, still + 0j, {"mode": 3}, "mode: the displacements are one shape without a number, got 3"),
    ):
        with pytest.raises(ss.InputError, match=message):
            of.plot.view(given, **options)
    picture, film = (scene.plot.view(modes, frames=frames) for frames in (None, 2))
    for view, name in ((picture, "a.gif"), (film, "a.png"), (film, "a.avi")):
        with pytest.raises(ss.InputError, match=rf"path: expected \.\w+.* for a .*, got '.*{name}'"):
            ss.save(view, tmp_path / name)
    with pytest.raises(ss.InputError, match="dpi: does not concern View, got 100"):
        ss.save(picture, tmp_path / "a.png", dpi=100)
    with pytest.raises(ss.InputError, match=r"instant: expected one in 0\.\.1, got 2"):
        film.grid(2)
    assert not list(tmp_path.iterdir())


def test_what_a_film_needs_is_named(scene, tmp_path, monkeypatch):
    film = scene.plot.view(ss.complex_modes(scene), frames=2)
    for name, suffix in (("imageio_ffmpeg", "mp4"), ("imageio", "gif")):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(
            ss.InputError, match=rf"view: this needs {name}; pip install 'stickslip\[pyvista\]'"
        ):
            ss.save(film, tmp_path / f"a.{suffix}")
