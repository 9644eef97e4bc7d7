"""Figures as files: letters of panels, milliseconds, the same bytes."""

import io

import pytest
from matplotlib.figure import Figure

import stickslip as ss
from stickslip.show.style import panel_letters, readable_lengths, readable_times, save


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
    run = ss.simulate(scene, ss.disturbed_sliding(scene), end)
    figure = Figure()
    axes = figure.subplots()
    ss.plot.contact_status(axes, run)
    readable_times(figure)
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
    readable_times(figure)
    assert below.get_xlabel() == "time, s"
    above.set_xlim(0.5, 0.55)
    readable_times(figure)
    assert below.get_xlabel() == "time, ms"
    assert above.xaxis.get_major_formatter()(0.52, 0) == "520"


@pytest.mark.parametrize(("far", "label", "tick"), [(9e3, "x, µm", None), (5e4, "x, mm", "50")])
def test_far_displacements_are_in_millimetres(far, label, tick):
    figure = Figure()
    axes = figure.subplots()
    axes.set(xlim=(0.0, far), xlabel="x, µm", ylabel="amplitude, µm", ylim=(1.0, far), yscale="log")
    for _ in range(2):
        readable_lengths(figure)
    assert axes.get_xlabel() == label
    assert axes.get_ylabel() == "amplitude, µm"
    if tick:
        assert axes.xaxis.get_major_formatter()(5e4, 0) == tick


@pytest.mark.parametrize("form", ["png", "pdf", "svg"])
def test_the_same_figure_gives_the_same_bytes(form):
    cycle = ss.models.two_subsystems()
    run = ss.simulate(cycle, ss.disturbed_sliding(cycle), 0.05)
    written = []
    for _ in range(2):
        stream = io.BytesIO()
        save(ss.plot.history(run), stream, dpi=60, form=form)
        written.append(stream.getvalue())
    assert written[0] == written[1]
    if form == "pdf":
        # Fonts are embedded as TrueType.
        assert b"/FontFile2" in written[0]
