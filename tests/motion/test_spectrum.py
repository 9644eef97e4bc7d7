"""Spectra of motions, and the figures of motions and cycles."""

import itertools

import matplotlib.figure
import numpy as np
import pytest
from matplotlib.path import Path

import stickslip as ss
from stickslip.show.style import HATCHES, STYLES


@pytest.fixture(scope="module")
def run():
    scene = ss.models.two_subsystems()
    return ss.simulate(scene, 0.6, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))


@pytest.fixture(scope="module")
def cycle(run):
    return run.limit_cycle()


@pytest.fixture
def axes():
    return matplotlib.figure.Figure().subplots()


def test_the_exact_lines_are_multiples_of_the_fundamental(run, cycle):
    lines = run.spectrum("x2", harmonics=10)
    assert lines.attrs["method"] == "exact"
    assert lines.frequency.to_numpy() == pytest.approx(np.arange(11) * cycle.frequency, rel=1e-15)
    assert int(np.argmax(lines.amplitude.to_numpy()[1:])) == 0
    assert lines.amplitude.dims == ("frequency",)
    assert run.spectrum(harmonics=3).amplitude.dims == ("frequency", "dof")


def test_the_series_is_the_motion(cycle):
    """Fourier's sum of displacements: coefficients fall like 1/k^3, of what an impact stops like 1/k^2."""
    count = 200
    times = cycle.period * (np.arange(64) + 0.5) / 64
    series = cycle.harmonics(count).coefficient.to_numpy()
    turn = np.exp(2j * np.pi * np.outer(times / cycle.period, np.arange(1, count + 1)))
    motion = series[0].real + 2.0 * (turn @ series[1:]).real
    exact = cycle.run.sample(times).position.to_numpy()
    # The rest of a series of coefficients below a_1 / k^2 is at most a_1 / count.
    assert np.abs(motion - exact).max() <= 2.0 * np.abs(series[1]).max() / count


def test_a_doubled_period_has_a_line_at_half_the_main_frequency():
    scene = ss.models.two_subsystems(friction=3.0)
    run = ss.simulate(scene, 0.6, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    lines = run.spectrum("x2").amplitude
    main = float(lines.frequency[1:][int(np.argmax(lines.to_numpy()[1:]))])
    assert main == pytest.approx(112.0, abs=1.0)
    # Well above the rounding of the coefficients.
    assert float(lines.sel(frequency=0.5 * main, method="nearest")) > 0.1 * float(lines.sel(frequency=main))


def test_growth_has_the_line_of_the_unstable_mode(run):
    """Up to the first event the motion is linear: its last part is the growing mode, at its own frequency."""
    first = float(run.events.time[0])
    growth = run.spectrum("x1", begin=0.5 * first, end=first)
    assert growth.attrs["method"] == "sampled"
    modes = ss.complex_modes(run.scene)
    growing = modes.eigenvalues[np.argmax(modes.eigenvalues.real)]
    main = float(growth.frequency[int(np.argmax(growth.amplitude.to_numpy()))])
    # The resolution of the stretch.
    assert main == pytest.approx(abs(growing.imag) / (2.0 * np.pi), abs=2.0 / first)


def test_a_sampled_stretch_of_whole_periods_gives_the_exact_lines(cycle):
    sampled = cycle.run.spectrum(begin=0.0, end=cycle.period, window="boxcar", detrend=None)
    exact = cycle.harmonics(8)
    # Aliasing of kinks: 1/N^2 of the first line, with N = 2^14.
    tolerance = 10.0 / 2**28 * float(exact.amplitude[1:].max())
    assert np.abs(sampled.amplitude[1:9].to_numpy() - exact.amplitude[1:].to_numpy()).max() <= tolerance


def test_the_usual_window_is_that_of_its_name(run):
    usual = run.spectrum("x1", end=0.1)
    same = run.spectrum("x1", end=0.1, window=("general_hamming", 0.5))
    largest = float(same.amplitude.max())
    assert np.abs(usual.coefficient - same.coefficient).max() <= 1e-12 * largest


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"dof": "x99"}, "x99"),
        ({"harmonics": 0}, "count"),
        ({"begin": 0.3, "end": 0.2}, "begin, end"),
        ({"end": 99.0}, "begin, end"),
        ({"end": 0.1, "samples": 4}, "samples"),
        ({"end": 0.1, "window": "no such window"}, "window"),
        ({"end": 0.1, "detrend": "cubic"}, "detrend"),
    ],
)
def test_ill_posed_spectra(run, arguments, message):
    with pytest.raises(ss.InputError, match=message):
        run.spectrum(**arguments)


def test_every_portrait_draws_on_the_axes_it_is_given(run, cycle):
    diagram = ss.bifurcation(run.scene, {"friction": [0.5, 1.5, 2.2]}, stretch=0.6)
    for draw in (
        lambda axes: run.plot("x2", ax=axes),
        lambda axes: cycle.plot.phase(contact=1, ax=axes),
        lambda axes: ss.plot(run.spectrum("x2"), ax=axes),
        lambda axes: ss.plot(run.spectrum("x2", end=0.1), ax=axes),
        lambda axes: cycle.plot.outline(label="friction 1.5", ax=axes),
        lambda axes: diagram.plot("x2", ax=axes),
    ):
        axes = matplotlib.figure.Figure().subplots()
        assert draw(axes) is axes
        assert len(axes.lines) >= 1
    bars = matplotlib.figure.Figure().subplots()
    assert cycle.plot.statuses(ax=bars) is bars
    # Every bar begins anew.
    drawn = sum((artist.get_path().codes == Path.MOVETO).sum() for artist in bars.patches)
    # One bar as long as the status of a contact stays the same.
    letters = [[combination[contact] for combination in cycle.combinations] for contact in (0, 1)]
    assert drawn == sum(1 + sum(a != b for a, b in itertools.pairwise(row)) for row in letters)
    # The first contact is on top.
    assert bars.yaxis_inverted()
    with pytest.raises(ss.InputError, match="x99"):
        run.plot("x99", ax=bars)


def test_statuses_survive_grey(cycle, axes):
    """Each status has a line style and a hatching of its own, whatever its colour turns into."""
    assert len(set(STYLES.values())) == len(set(HATCHES.values())) == 5
    cycle.plot.phase(ax=axes)
    *drawn, slider = [line for line in axes.lines if not line.get_label().startswith("_")]
    assert slider.get_label() == "slider"
    assert len({line.get_linestyle() for line in drawn}) == len(drawn) == 2
