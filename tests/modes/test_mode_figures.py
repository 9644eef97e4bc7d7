import numpy as np
import pytest
from matplotlib.animation import AbstractMovieWriter

import stickslip as ss
from stickslip.modes.figures import MOST
from stickslip.scene.drawing.schematic import schematic

MASSES = {"m1": ("x1", "x2"), "m3": ("x5", "x6")}


def test_loci_show_the_branches():
    branches = ss.sweep(ss.models.two_subsystems(), {"friction": [0.5, 1.5, 1.0]})
    figure = ss.plot(branches)
    growth, frequency = figure.axes
    assert growth.get_xlabel() == "friction coefficient"
    assert growth.get_ylabel() == "growth rate, 1/s"
    # Two lines, all and unstable, for each of six pairs.
    lines = [line for line in frequency.lines if len(line.get_xdata()) == 3]
    assert len(lines) == 12
    assert list(lines[0].get_xdata()) == [0.5, 1.0, 1.5]
    ends = np.array([line.get_ydata()[-1] for line in lines[::2]])
    assert np.abs(ends - 118.44).min() < 0.01
    unstable = np.array([line.get_ydata()[-1] for line in lines[1::2]])
    assert np.isfinite(unstable).sum() == 1


def test_a_stability_map_shows_growth_and_its_border():
    values = {"friction": np.linspace(0.0, 3.0, 31), "slider_speed": [0.01, 0.05, 0.1]}
    figure = ss.plot(ss.sweep(ss.models.two_subsystems(), values))
    growth, count, *bars = figure.axes
    assert growth.get_ylabel() == "friction coefficient"
    assert growth.get_xlabel() == count.get_xlabel() == "slider speed, m/s"
    assert [bar.get_ylabel() for bar in bars] == ["largest growth rate, 1/s", "number of unstable modes"]
    # One unstable mode beyond the Hopf point, two beyond the second one; no mode depends on the speed.
    borders = [np.concatenate([path.vertices for path in c.get_paths()]) for c in count.collections]
    hopf = [
        p.value
        for p in ss.critical_points(ss.models.two_subsystems(), {"friction": (0.0, 3.0)}, kinds=("hopf",))
    ]
    # Between samples 0.1 apart the border is interpolated.
    for border, expected in ((borders[0], hopf[0]), (borders[1], hopf[1]), (borders[-1], hopf[0])):
        assert border[:, 1].min() == pytest.approx(expected, abs=0.05)
    single = {**values, "slider_speed": [0.01]}
    with pytest.raises(ss.InputError, match=r"two values of each of two, got .*: 1}"):
        ss.plot(ss.sweep(ss.models.two_subsystems(), single))


def test_a_stability_map_says_once_what_one_unstable_mode_means():
    values = np.linspace(0.0, 1.5, 7)
    figure = ss.plot(ss.sweep(ss.models.two_subsystems(), {"friction_0": values, "friction_1": values}))
    _, bar = figure.axes
    # Between unstable and stable the ticks of the bar have at most two digits.
    ticks = bar.get_yticks()
    assert 5 <= ticks.size <= 9
    assert ticks == pytest.approx([float(f"{tick:.2g}") for tick in ticks])
    assert 0.0 in ticks


def test_shapes_show_every_mode():
    modes = ss.complex_modes(ss.models.two_subsystems(friction=0.0))
    figure = modes.plot.shapes()
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:2] == ["mode 0: 91.56 Hz", "mode 1: 112.20 Hz"]
    heights = [bar.get_height() for bar in figure.axes[0].patches]
    assert np.abs(heights).max() == pytest.approx(1.0)
    assert np.abs(heights) == pytest.approx(np.abs(modes.shapes[:, 0]), abs=1e-15)


def test_shapes_of_a_long_chain_are_few():
    part = ss.models.Subsystem(
        upper_mass=0.3,
        contact_mass=0.3,
        inclination=0.3,
        vertical_stiffness=4.5e5,
        horizontal_stiffness=3e5,
        ceiling_stiffness=6e4,
    )
    link = ss.models.Link(horizontal_stiffness=1.5e6, vertical_stiffness=2.4e5)
    chain = ss.models.chain([part] * 10, [link] * 9, wall_stiffness=1.8e6, friction=0.4, slider_speed=0.025)
    modes = ss.complex_modes(chain)
    figure = modes.plot.shapes()
    numbers = [int(axes.get_title().split()[1].rstrip(":")) for axes in figure.axes]
    assert len(numbers) == MOST < len(modes)
    others = np.setdiff1d(np.arange(len(modes)), numbers)
    assert modes.eigenvalues.real[numbers].min() >= modes.eigenvalues.real[others].max()
    # One artist for all dofs, with as many lines as there are dofs.
    assert not figure.axes[0].patches
    assert len(figure.axes[0].collections[0].get_paths()) == chain.size
    assert figure.get_figheight() < 8.0
    chosen = [axes.get_title() for axes in modes.plot.shapes([4, 2]).axes if axes.get_visible()]
    assert [title.split(":")[0] for title in chosen] == ["mode 4", "mode 2"]
    with pytest.raises(ss.InputError, match=r"numbers: expected a mode in 0\.\.\d+, got -1"):
        modes.plot.shapes([-1])


def test_orbits_of_all_masses_have_one_scale():
    modes = ss.complex_modes(ss.models.two_subsystems())
    figure = modes.plot.orbits(0, {"m1": ("x1", "x2"), "m3": ("x5", "x6"), "m4": ("x7", "x8")})
    figure.draw_without_rendering()
    widths = [np.ptp(axes.get_xlim()) / axes.bbox.width for axes in figure.axes]
    heights = [np.ptp(axes.get_ylim()) / axes.bbox.height for axes in figure.axes]
    assert widths == pytest.approx([widths[0]] * 3, rel=1e-6)
    assert heights == pytest.approx(widths, rel=1e-6)


def test_orbits_show_the_motion():
    modes = ss.complex_modes(ss.models.two_subsystems(friction=1.5))
    mode = int(np.argmax(modes.eigenvalues.real))
    figure = modes.plot.orbits(mode, MASSES)
    motion = modes.orbit(mode, ("x1", "x2"))
    assert figure.axes[0].lines[0].get_xydata() == pytest.approx(motion.to_numpy())
    assert "grows" in figure.get_suptitle()
    assert [axes.get_title() for axes in figure.axes] == ["m1", "m3"]


class Pictures(AbstractMovieWriter):
    """A writer that keeps where the masses are in every picture, and writes no file."""

    def __init__(self):
        super().__init__()
        self.seen = []

    def setup(self, fig, outfile, dpi=None):
        super().setup(fig, outfile, dpi)

    def grab_frame(self, **_):
        self.seen.append(np.array(self.fig.axes[0].collections[0].get_offsets()))

    def finish(self):
        pass


def test_an_animation_is_one_period():
    modes = ss.complex_modes(ss.models.two_subsystems(friction=1.5))
    pictures = Pictures()
    modes.plot.animate(0, frames=8).save("unused", writer=pictures)
    seen = pictures.seen
    assert len(seen) == 8
    # Opposite phases are mirrored at the place of rest.
    rest = np.array([(body.x, body.y) for body in schematic(modes.scene).bodies])
    assert seen[4] - rest == pytest.approx(rest - seen[0], abs=1e-12)
    assert np.abs(seen[0] - seen[2]).max() > 1e-3


def test_hostile_input():
    modes = ss.complex_modes(ss.models.two_subsystems())
    with pytest.raises(ss.InputError, match="masses: expected the two dofs of at least one mass"):
        modes.plot.orbits(0, {})
    with pytest.raises(ss.InputError, match=r"number: expected a mode in 0\.\.5, got 6"):
        modes.plot.animate(6)
    with pytest.raises(ss.InputError, match="figure: expected a figure of matplotlib, got 5"):
        modes.plot.shapes([0], figure=5)
