"""A scene of meshed bodies, drawn."""

import sys
from types import SimpleNamespace

import matplotlib

matplotlib.use("agg")
import numpy as np
import pytest
from matplotlib.animation import AbstractMovieWriter
from matplotlib.figure import Figure

import stickslip as ss
from meshed import block, plate


def test_a_plane_mesh_displaced():
    scene = ss.fe.assemble(block(4, 2))
    position = np.linspace(0.0, 1e-6, scene.size)
    axes = scene.plot.mesh(position, scale=100.0, title="pressed")
    (faces,) = axes.collections
    assert axes.get_title() == "pressed"
    assert len(faces.get_paths()) == 8
    # Corners of the first element, displaced.
    node = scene.mesh.cells["quad"][0]
    expected = scene.mesh.points[node] + 100.0 * scene.mesh.displacements(position)[node]
    np.testing.assert_allclose(faces.get_paths()[0].vertices[:4], expected, rtol=0, atol=1e-15)
    length = np.hypot(*scene.mesh.displacements(position).T)
    np.testing.assert_allclose(faces.get_array()[0], length[node].mean())


def test_a_complex_shape_in_space():
    scene = ss.fe.assemble(plate((2, 2, 1), (0.02, 0.02, 0.004), (0.0, 0.0, 0.0)))
    shape = np.exp(1j * np.arange(scene.size))
    axes = scene.plot.mesh(shape)
    axes.figure.canvas.draw()
    # Eight faces above and below, eight at the sides.
    assert axes.collections[0].get_array().shape == (16,)
    np.testing.assert_allclose(axes.collections[0].get_array(), np.sqrt(3.0))
    plane = Figure().subplots()
    with pytest.raises(ss.InputError, match="ax: expected axes of projection 3d"):
        scene.plot.mesh(shape, ax=plane)
    with pytest.raises(ss.InputError, match=r"displacement: expected shape \(54,\), got \(53,\)"):
        scene.plot.mesh(shape[:-1])
    with pytest.raises(ss.InputError, match="scene: it has no points"):
        scene.replace(mesh=None).plot.mesh(shape)


def test_modes_draw_their_shapes():
    body = block(4, 2)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.1, gap=-1e-6)
    scene = ss.fe.assemble(body, pairs)
    modes = ss.complex_modes(scene)
    axes = modes.plot.structure(2)
    assert axes.get_title().startswith(f"mode 2: {modes.frequencies[2]:.2f} Hz")
    length = np.hypot(*np.abs(scene.mesh.displacements(modes.shapes[:, 2])).T)
    corners = scene.mesh.cells["quad"]
    np.testing.assert_allclose(axes.collections[0].get_array(), length[corners].mean(axis=1))
    assert modes.plot().get_xlabel() == "growth rate, 1/s"
    with pytest.raises(ss.InputError, match="number: expected a mode in"):
        modes.plot.structure(len(modes))
    # Without a mesh the same mode is drawn on bodies and springs.
    plain = ss.complex_modes(scene.replace(mesh=None)).plot.structure(2)
    assert plain.get_title() == axes.get_title()
    assert plain.lines


def test_a_mode_of_a_mesh_moves_on_it():
    scene = ss.fe.assemble(block(4, 2))
    modes = ss.complex_modes(scene)
    places = []

    class Pictures(AbstractMovieWriter):
        def setup(self, fig, outfile, dpi=None):
            super().setup(fig, outfile, dpi)

        def grab_frame(self, **_):
            (faces,) = self.fig.axes[0].collections
            places.append(np.stack([path.vertices[:4] for path in faces.get_paths()]))

        def finish(self):
            self.fig.canvas.draw()

    modes.plot.animate(0, frames=4).save("unused", writer=Pictures())
    rest = scene.mesh.points[scene.mesh.cells["quad"]]
    moved = np.abs(places[0] - rest).max()
    # By 0.08 of the size of the mesh, 40 by 20 mm, at the largest.
    assert moved == pytest.approx(0.08 * np.hypot(0.04, 0.02), rel=1e-9)
    np.testing.assert_allclose(places[0] + places[2], 2.0 * rest, rtol=0, atol=1e-15)


def test_a_quantity_of_every_pair():
    body = block(4, 2)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.1)
    (line,) = pairs.plot([5.0, 4.0, 3.0, 2.0, 1.0], label="power, W").lines
    np.testing.assert_allclose(line.get_xdata(), [0.0, 10.0, 20.0, 30.0, 40.0])
    order = np.argsort(pairs.points[:, 0])
    np.testing.assert_allclose(line.get_ydata(), np.arange(5.0, 0.0, -1.0)[order])
    pad = plate((2, 2, 1), (0.02, 0.03, 0.004), (0.0, 0.0, 0.0))
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), None, velocity=(1, 0, 0), friction=0.1)
    axes = pairs.plot(np.arange(9.0) - 3.0, ax=Figure().subplots(), label="power, W")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x, mm", "y, mm")
    (spots,) = axes.collections
    np.testing.assert_allclose(spots.get_offsets(), 1e3 * pairs.points[:, :2])
    # Zero is in the middle of the colours.
    assert spots.get_clim() == (-5.0, 5.0)
    for values in (np.ones(8), np.full(9, np.nan)):
        with pytest.raises(ss.InputError, match="values: expected 9 finite numbers, one per pair"):
            pairs.plot(values)


@pytest.mark.parametrize(
    ("along", "names"), [((1, 0, 0), "xy"), ((0, 1, 0), "xy"), ((0, 0, 1), "xz"), ((1, 1, 0), "xy")]
)
@pytest.mark.parametrize("count", [1, 4])
def test_pairs_on_a_line_in_space(along, names, count):
    """Such as those of a single row of nodes: the line lies in the picture."""
    points = np.linspace(0.0, 0.03, count)[:, None] * np.array(along)
    axes = Figure().subplots()
    ss.fe.Pairs.plot(SimpleNamespace(points=points), np.arange(1.0, count + 1.0), ax=axes)
    axes.figure.canvas.draw()
    (spots,) = axes.collections
    shown = [points[:, "xyz".index(name)] for name in (names if count > 1 else "xy")]
    np.testing.assert_allclose(spots.get_offsets(), 1e3 * np.column_stack(shown))
    assert np.ptp(axes.get_xlim()) > 0.0 < np.ptp(axes.get_ylim())


def test_without_pyvista_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    scene = ss.fe.assemble(block(2, 1))
    with pytest.raises(ss.InputError, match=r"view: this needs pyvista; pip install 'stickslip\[pyvista\]'"):
        scene.plot.view(np.zeros(scene.size))
