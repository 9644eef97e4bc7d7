"""Figures as files: letters of panels, milliseconds, the same bytes."""

import errno
import io
import itertools
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import stickslip as ss
from stickslip.show.replaced_file import replace_file
from stickslip.show.style import panel_letters, readable_units, save


def test_panels_have_letters_and_a_single_one_has_none():
    figure = Figure(layout="constrained")
    panels = figure.subplots(1, 3)
    panels[2].set_visible(False)
    figure.colorbar(panels[0].imshow([[0.0, 1.0]]), ax=panels[0])
    for _ in range(2):
        panel_letters(figure)
    assert [[text.get_text() for text in axes.texts] for axes in figure.axes] == [["(a)"], ["(b)"], [], []]
    alone = Figure()
    alone.subplots()
    panel_letters(alone)
    assert not alone.axes[0].texts


@pytest.mark.parametrize(("end", "label"), [(0.05, "time, ms"), (0.5, "time, s")])
def test_short_times_are_in_milliseconds(end, label):
    scene = ss.models.two_subsystems()
    run = ss.simulate(scene, end, ss.disturbed_sliding(scene))
    figure = Figure()
    axes = figure.subplots()
    run.plot.statuses(ax=axes)
    readable_units(figure)
    assert axes.get_xlabel() == label
    # Contact 0 stands on top.
    assert axes.get_ylim()[0] > axes.get_ylim()[1]
    if end < 0.1:
        assert axes.xaxis.get_major_formatter()(0.02, 0) == "20"


def test_panels_that_share_a_label_share_its_unit():
    figure = Figure()
    above, below = figure.subplots(2, 1)
    above.set_xlim(0.0, 0.6)
    below.set(xlim=(0.58, 0.6), xlabel="time, s")
    readable_units(figure)
    assert below.get_xlabel() == "time, s"
    above.set_xlim(0.5, 0.55)
    readable_units(figure)
    assert below.get_xlabel() == "time, ms"
    assert above.xaxis.get_major_formatter()(0.52, 0) == "520"


@pytest.mark.parametrize(
    ("given", "largest", "label", "tick"),
    [
        ("x1, µm", 5e4, "x1, mm", "50"),
        ("x1, µm", 800.0, "x1, µm", "800"),
        ("x1, m", 9e-4, "x1, µm", "900"),
        ("x1, m", 8e-3, "x1, mm", "8"),
        ("x1, m", 3.0, "x1, m", "3"),
    ],
)
def test_lengths_have_a_unit_that_suits_them(given, largest, label, tick):
    figure = Figure()
    axes = figure.subplots()
    axes.set(ylim=(-largest, 0.5 * largest), ylabel=given)
    for _ in range(2):
        readable_units(figure)
        assert axes.get_ylabel() == label
        assert axes.yaxis.get_major_formatter().format_ticks([largest])[0].removesuffix(".0") == tick


def test_a_figure_has_one_minus_sign():
    figure = Figure()
    scaled, plain = figure.subplots(1, 2)
    scaled.set(ylim=(-8e-4, 8e-4), ylabel="x1, m")
    readable_units(figure)
    assert scaled.yaxis.get_major_formatter().format_ticks([-6e-4]) == ["\N{MINUS SIGN}600"]
    assert plain.yaxis.get_major_formatter().format_ticks([-0.2])[0].startswith("\N{MINUS SIGN}")


@pytest.mark.parametrize("drawn", ["statuses", "events"])
def test_a_file_of_your_own_axes_holds_the_whole_legend(drawn):
    scene = ss.models.two_subsystems()
    figure = Figure(figsize=(5.0, 2.5))
    run = ss.simulate(scene, 0.2, ss.disturbed_sliding(scene))
    draw = {"statuses": run.plot.statuses, "events": run.events.plot}[drawn]
    axes = draw(ax=figure.subplots())
    save(axes, io.BytesIO(), form="png")
    figure.draw_without_rendering()
    legend = axes.get_legend().get_window_extent()
    assert figure.bbox.x1 >= legend.x1
    assert figure.bbox.y0 <= legend.y0


def test_a_layout_of_your_own_stays_where_nothing_is_cut():
    figure = Figure()
    axes = figure.subplots()
    figure.subplots_adjust(left=0.3)
    save(figure, io.BytesIO(), form="png")
    assert axes.get_position().x0 == pytest.approx(0.3)


def test_a_letter_stands_above_the_tick_at_the_upper_end():
    figure = Figure(layout="constrained")
    for axes in figure.subplots(1, 2):
        axes.set(ylim=(0.0, 1.0), yticks=[0.0, 1.0])
    panel_letters(figure)
    figure.draw_without_rendering()
    for axes in figure.axes:
        tick = axes.yaxis.get_ticklabels()[-1].get_window_extent()
        assert not axes.texts[0].get_window_extent().overlaps(tick)


@pytest.mark.parametrize("form", ["png", "pdf", "svg"])
def test_the_same_figure_gives_the_same_bytes(form):
    cycle = ss.models.two_subsystems()
    run = ss.simulate(cycle, 0.05, ss.disturbed_sliding(cycle))
    written = []
    for _ in range(2):
        stream = io.BytesIO()
        save(run.plot.history(), stream, dpi=60, form=form)
        written.append(stream.getvalue())
    assert written[0] == written[1]
    if form == "pdf":
        # Fonts are embedded as TrueType.
        assert b"/FontFile2" in written[0]


def test_a_figure_that_cannot_be_drawn_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    figure, path = Figure(), tmp_path / "figure.png"
    figure.subplots()
    save(figure, path, dpi=60)
    before = path.read_bytes()

    def broken(stream, **_how):
        if isinstance(stream, Path):
            stream.write_bytes(b"half of it")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(figure, "savefig", broken)
    with pytest.raises(OSError, match="No space left"):
        save(figure, path, dpi=60)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["figure.png"]


def test_a_figure_without_suffix_is_named_as_by_matplotlib(tmp_path):
    figure = Figure()
    save(figure, tmp_path / "figure", dpi=60)
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_an_error_of_writing_names_the_file_that_was_asked_for(tmp_path):
    path = tmp_path / "missing" / "figure.png"
    with pytest.raises(FileNotFoundError) as caught:
        save(Figure(), path, dpi=60)
    assert caught.value.filename == str(path)
    with pytest.raises(FileNotFoundError) as caught:
        replace_file(path, b"")
    assert caught.value.filename == str(path)


def test_events_and_works_are_told_apart():
    scene = ss.models.two_subsystems()
    run = ss.simulate(scene, 0.2, ss.disturbed_sliding(scene))
    axes = run.events.plot(ax=Figure().subplots())
    strokes = np.concatenate([lines.get_segments() for lines in axes.collections])
    assert len(strokes) == len(run.events)
    rows = [sorted({(s[0][1], s[1][1]) for s in lines.get_segments()}) for lines in axes.collections]
    lanes = sorted(lane for row in rows for lane in row)
    assert all(end <= begin for (_, end), (begin, _) in itertools.pairwise(lanes))
    bars = run.balance().plot(ax=Figure().subplots())
    names = {
        text.get_text(): bar.get_height()
        for text, bar in zip(bars.get_yticklabels(), bars.patches, strict=True)
    }
    assert names["of contact 0"] == names["of contact 1"] < 0.5 * names["contact"]


@pytest.mark.parametrize(
    ("joules", "unit", "shown"), [(7.5, "J", 7.5), (7.5e-3, "mJ", 7.5), (7.5e-7, "nJ", 750.0)]
)
def test_an_axis_of_energy_has_the_unit_that_suits_it(joules, unit, shown):
    figure = Figure()
    axes = figure.subplots()
    axes.barh([0.0], [-1e3 * joules])
    axes.set(xlabel="work, mJ", xlim=(-1e3 * joules, 0.0))
    save(figure, io.BytesIO(), form="svg")
    assert axes.get_xlabel() == f"work, {unit}"
    axes.xaxis.set_ticks([-1e3 * joules])
    (label,) = axes.xaxis.get_major_formatter().format_ticks([-1e3 * joules])
    assert float(label.replace("\N{MINUS SIGN}", "-")) == pytest.approx(-shown)


def test_a_figure_has_the_width_of_a_column_with_everything_in_it(tmp_path):
    scene = ss.models.two_subsystems()
    figure = ss.simulate(scene, 0.05).plot.history()
    before = figure.get_size_inches().tolist()
    ss.save(figure, tmp_path / "whole.png", dpi=100)
    sizes = {text: text.get_fontsize() for text in figure.findobj(Text)}
    ss.save(figure, tmp_path / "column.png", dpi=100, width=0.085)
    ss.save(figure, tmp_path / "again.png", dpi=100)
    assert plt.imread(tmp_path / "column.png").shape[1] == int(100 * 0.085 / 0.0254)
    # A constrained layout begins where the one before ended: the same picture but for a pixel here and there.
    whole, again = (plt.imread(tmp_path / f"{name}.png") for name in ("whole", "again"))
    assert again.shape == whole.shape
    assert np.abs(again - whole).mean() < 0.02
    assert figure.get_size_inches().tolist() == before
    assert {text: text.get_fontsize() for text in sizes} == sizes
    with pytest.raises(ss.InputError, match=r"width: must be positive and below 10 m, got -1\.0"):
        ss.save(figure, tmp_path / "column.png", width=-1)
    with pytest.raises(ss.InputError, match=r"width: does not concern Scene, got 0\.1"):
        ss.save(scene, tmp_path / "scene.toml", width=0.1)
