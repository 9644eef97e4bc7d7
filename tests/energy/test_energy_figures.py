"""Figures of energy show the numbers that the functions return."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.path import Path

import stickslip as ss


@pytest.fixture(scope="module")
def run(standard):
    return ss.simulate(standard.scene, standard.duration, standard.start)


@pytest.fixture(scope="module")
def cycle(run):
    return run.limit_cycle()


def test_energy_history_of_a_cycle(cycle):
    figure = cycle.plot.energy()
    stored, rate, powers, status = figure.axes
    flow = cycle.run.energy(rate.lines[0].get_xdata())
    assert rate.lines[0].get_ydata() == pytest.approx(flow.energy_rate.values)
    # Both curves of the rate lie on each other: the balance of powers.
    assert rate.lines[1].get_ydata() == pytest.approx(flow.energy_rate.values, abs=1e-11)
    assert powers.lines[0].get_ydata() == pytest.approx(flow.contact_power.sel(contact=0).values)
    top = stored.collections[1].get_paths()[0].vertices[:, 1].max()
    assert top == pytest.approx(1e3 * float((flow.kinetic + flow.elastic).max()))
    # `++ +d ++ s+ ss s+` by contact: + s, and + d + s +.
    # Stretches of one status are one path: of ++ that of contact 0 and three of contact 1.
    stretches = [int((bar.get_path().codes == Path.MOVETO).sum()) for bar in status.patches]
    assert sorted(stretches) == [1, 2, 4]


def test_every_flow_has_a_colour_of_its_own():
    """Of the cycle at friction 1.5, whose contact 1 lifts off and strikes."""
    scene = ss.models.two_subsystems()
    run = ss.simulate(scene, 0.6, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    balance = run.limit_cycle().balance()
    assert balance.impact_loss > 0.0
    axes = balance.plot.flow()
    names = [text.get_text().split("\n")[0] for text in axes.texts][:-1]
    colours = [patch.get_facecolor() for patch in axes.patches][: len(names)]
    owners = {name.removeprefix("slider of ").removeprefix("friction heat of ") for name in names}
    assert {"impacts", "dampers", "contact 0", "contact 1"} <= owners
    assert len(set(colours)) == len(owners)


def test_energy_flow_is_in_proportion(cycle):
    balance = cycle.balance()
    axes = balance.plot.flow()
    texts = [text.get_text() for text in axes.texts]
    for expected in ("slider of contact 0\n26.87 mJ", "dampers\n2.133 mJ", "impacts\n32.3 nJ"):
        assert expected in texts
    heights = {}
    for patch, text in zip(axes.patches, texts, strict=False):
        vertices = patch.get_path().vertices
        heights[text.split("\n")[0]] = vertices[0, 1] - vertices[-1, 1]
    ratio = heights["slider of contact 0"] / heights["dampers"]
    work = float(balance.contacts.slider.sel(contact=0).sum())
    assert ratio == pytest.approx(work / balance.damping, rel=1e-9)


def test_growth_and_selection_figures(run):
    shares = ss.modal_energy(run, np.linspace(0.0, 0.15, 2001))
    lines = {line.get_label(): line for line in ss.plot(shares, "++").lines}
    assert "119.4 Hz" in lines
    energy = ss.modal_energy(run, lines["all"].get_xdata()[:50])
    assert lines["all"].get_ydata()[:50] == pytest.approx(1e3 * energy.total.values)
    selection = ss.mode_selection(run.scene, np.linspace(1e-5, 1e-4, 4), phases=4)
    panels = Figure().subplots(1, 2)
    curve = selection.plot(ax=panels[0]).lines[0]
    over_energy = selection.plot(over="energy", ax=panels[1]).lines[0]
    assert over_energy.get_xdata() == pytest.approx(1e3 * selection.gains.energy.values[0])
    assert curve.get_ydata() == pytest.approx((selection.gains.net / selection.gains.energy).values[0])
