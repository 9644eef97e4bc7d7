"""Every figure of the paper: what it draws, its letters, its size on paper."""

import colorsys
import re
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from paper import comparison as reproduce
from paper import figures as paper
from paper.numbers import published

import stickslip as ss
from pictures import assert_shown

NUMBERS = range(2, 16)


@cache
def drawn(number):
    return paper.FIGURES[number]()


@cache
def standard():
    return reproduce.standard_run()


def curves(axes):
    """Lines of data; reference lines run across all of the axes."""
    return [line for line in axes.lines if len(line.get_xdata()) > 2]


def titles(number):
    return [axes.get_title() for axes in drawn(number).axes]


def legend(figure):
    owners = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
    return [text.get_text() for owner in owners if owner for text in owner.get_texts()]


def test_there_is_one_function_for_each():
    assert list(paper.FIGURES) == list(NUMBERS)
    for number in NUMBERS:
        assert paper.FIGURES[number] is getattr(paper, f"figure_{number}")


@pytest.mark.slow
@pytest.mark.parametrize("number", NUMBERS)
def test_the_gallery_shows_what_is_drawn_today(number, tmp_path):
    # Drawn anew: a test before may have laid out what `drawn` keeps.
    ss.save(paper.FIGURES[number](), tmp_path / "figure.png")
    assert_shown(f"gallery/figure-{number:02}.png", tmp_path / "figure.png")


@pytest.mark.slow
@pytest.mark.parametrize("number", NUMBERS)
def test_is_legible_in_a_column(number, tmp_path):
    figure = drawn(number)
    ss.save(figure, tmp_path / "figure.svg")
    width, height = 25.4 * figure.get_size_inches()
    assert width == pytest.approx(85.0)
    assert height <= 160.0
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    assert min(text.get_fontsize() for text in texts) >= 6.0
    # Nothing sticks out of the page.
    figure.canvas.draw()
    box = figure.get_tightbbox()
    sides = (box.x0, box.y0, figure.get_figwidth() - box.x1, figure.get_figheight() - box.y1)
    assert min(sides) > -0.01, sides
    # Vectors only: no picture of pixels inside.
    text = (tmp_path / "figure.svg").read_text(encoding="utf-8")
    assert "<image" not in text
    assert "<path" in text


@pytest.mark.parametrize("number", NUMBERS)
def test_reads_without_colour(number):
    for axes in drawn(number).axes:
        seen = {}
        for line in curves(axes):
            look = (line.get_linestyle(), line.get_linewidth() > 1.5, line.get_marker())
            seen.setdefault(look, set()).add(line.get_color())
        for colours in seen.values():
            # The same style twice: the same meaning, or lighter by far.
            lightness = sorted(colorsys.rgb_to_hls(*to_rgb(colour))[1] for colour in colours)
            assert all(high - low > 0.15 for low, high in pairwise(lightness)), (number, seen)


@pytest.mark.parametrize("number", [n for n in NUMBERS if n not in (2, 4)])
def test_axes_have_units(number):
    figure = drawn(number)
    labels = [axes.get_xlabel() or axes.get_ylabel() for axes in figure.axes]
    labels += [figure.get_supxlabel(), figure.get_supylabel()]
    named = [label for label in labels if label and label != "friction coefficient"]
    assert named
    assert all(re.search(r", (m?s|Hz|1/s|µm|m/s|mJ|W)$", label) for label in named), named


def test_mode_shapes():
    printed = [f"{float(hz):.2f} Hz" for hz in published()["natural_frequencies_mu0"]["hz"]]
    assert titles(2) == printed
    modes = ss.complex_modes(ss.models.two_subsystems(friction=0.0))
    heights = [bar.get_height() for bar in drawn(2).axes[0].patches]
    assert np.abs(heights) == pytest.approx(np.abs(modes.shapes[:, 0]), abs=1e-12)


def test_loci():
    growth, frequency = drawn(3).axes
    assert frequency.get_xlabel() == "friction coefficient"
    lines = curves(growth)
    assert len(lines) == 12
    # Thick where unstable: from each Hopf point on.
    begins = sorted(
        line.get_xdata()[np.isfinite(line.get_ydata())][0]
        for line in lines[1::2]
        if np.isfinite(line.get_ydata()).any()
    )
    step = 0.01
    assert begins == pytest.approx([0.70156717308523 + step / 2, 2.1002056016114 + step / 2], abs=step / 2)


def test_orbits_in_the_axes_of_the_reader():
    assert titles(4) == ["m1", "m2", "m3", "m4"]
    for index, inclination in ((1, 0.3), (3, 0.75)):
        path = curves(drawn(4).axes[index])[0].get_xydata()
        assert path[:, 1] == pytest.approx(np.tan(inclination) * path[:, 0], abs=1e-12)
    modes = ss.complex_modes(ss.models.two_subsystems())
    spiral = modes.orbit(int(np.argmax(modes.eigenvalues.real)), ("x1", "x2"))
    assert curves(drawn(4).axes[0])[0].get_xydata() == pytest.approx(spiral.to_numpy(), abs=1e-12)


def test_history():
    assert [axes.get_ylabel() for axes in drawn(5).axes] == ["x1, µm", "x2, µm", "x3, µm", "x7, µm"]
    line = drawn(5).axes[1].lines[0]
    moved = standard().state(0.5).position[1] - standard().start.position[1]
    at = int(np.argmin(np.abs(line.get_xdata() - 0.5)))
    assert line.get_xdata()[at] == pytest.approx(0.5, abs=1e-12)
    assert line.get_ydata()[at] == pytest.approx(1e6 * moved, rel=1e-9)


def test_phase_planes():
    assert titles(6) == ["m2", "m4"]
    assert legend(drawn(6)) == ["+  positive sliding", "s  sticking", "slider", "d  detached"]
    for axes in drawn(6).axes:
        by_status = {line.get_label()[0]: line for line in curves(axes)}
        sticking = by_status["s"].get_ydata()[np.isfinite(by_status["s"].get_xdata())]
        # Sticking: the velocity of the slider from the first instant to the last.
        assert sticking == pytest.approx(0.025, rel=1e-9)
    assert "d" not in {line.get_label()[0] for line in curves(drawn(6).axes[0])}


def test_loci_name_their_colours_and_mark_the_hopf_points():
    figure = drawn(3)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["unstable", "stable", "Hopf point"]
    (dots,) = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert dots.get_xdata() == pytest.approx([0.70156717308523, 2.1002056016114], abs=1e-12)


def test_status_bars():
    whole, end = drawn(7).axes
    assert whole.get_xlim() == (0.0, 0.6)
    assert np.ptp(end.get_xlim()) == pytest.approx(0.0178)
    assert [tick.get_text() for tick in end.get_yticklabels()] == ["m2", "m4"]
    # All bars together are as long as the run, for each contact.
    bars = [polygon for drawn in whole.patches for polygon in drawn.get_path().to_polygons()]
    assert sum(np.ptp(bar[:, 0]) for bar in bars) == pytest.approx(2 * 0.6)


def test_spectra():
    assert titles(8) == ["up to the first status change", "limit cycle, main line 112.25 Hz"]
    grows = curves(drawn(8).axes[0])[0]
    assert grows.get_xdata()[np.argmax(grows.get_ydata())] == pytest.approx(119.36, abs=5.0)
    lines = drawn(8).axes[1].lines[0]
    # No line beyond the end of the axis.
    assert 1000.0 - 112.25 < lines.get_xdata().max() < 1000.0
    harmonics = standard().limit_cycle().harmonics().amplitude.sel(dof="x2").to_numpy()
    assert lines.get_ydata() == pytest.approx(1e6 * harmonics[1 : 1 + lines.get_ydata().size])
    for number, count in ((10, 3), (12, 4)):
        main = [float(title.split()[-2]) for title in titles(number)]
        assert len(main) == count
        assert all(108.0 < hz < 113.0 for hz in main)


@pytest.mark.parametrize(
    ("number", "speeds"), [(9, [0.025] * 2), (11, [0.025, 0.025, 0.05, 0.05, 0.3, 0.3, 0.9, 0.9])]
)
def test_cycles_reach_the_speed_of_their_slider(number, speeds):
    for axes, speed in zip(drawn(number).axes, speeds, strict=True):
        assert len(curves(axes)) == (3 if number == 9 else 1)
        for line in curves(axes):
            assert line.get_ydata().max() == pytest.approx(speed, rel=1e-6)
            assert line.get_xdata().max() == pytest.approx(-line.get_xdata().min())
    assert legend(drawn(9)) == ["friction 1.5", "friction 2.2", "friction 3.0"]
    assert titles(11)[-1] == "m4, 0.9 m/s"


@pytest.mark.parametrize("number", [13, 14, 15])
def test_energy(number):
    figure = drawn(number)
    stored, rate, powers, status = figure.axes
    assert legend(figure)[:4] == ["elastic", "kinetic", "dE/dt", "sum of powers"]
    assert legend(figure)[4:8] == ["contact m2", "contact m4", "external", "\N{MINUS SIGN}damping"]
    motion = standard().limit_cycle().run if number == 14 else standard()
    flow = motion.energy(rate.lines[0].get_xdata())
    assert rate.lines[0].get_ydata() == pytest.approx(flow.energy_rate.values)
    assert powers.lines[0].get_ydata() == pytest.approx(flow.contact_power.sel(contact=0).values)
    top = stored.collections[1].get_paths()[0].vertices[:, 1].max()
    assert top == pytest.approx(1e3 * float((flow.kinetic + flow.elastic).max()))
    onset = standard().events.time[0]
    interval = {13: (0.0, 0.6), 14: (0.0, 8.908492605779e-3), 15: (onset - 0.03, onset + 0.01)}
    assert status.get_xlim() == pytest.approx(interval[number], rel=1e-9)
