"""Limit cycles: period, sequence, multipliers, spectrum."""

from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from return_map import assert_multipliers

EPSILON = np.finfo(float).eps


def settled(friction=1.5, slider_speed=0.025, duration=0.6, velocity=None):
    scene = ss.models.two_subsystems(friction=friction, slider_speed=slider_speed)
    start = ss.steady_sliding(scene).perturbed(velocity=velocity or {"x1": 1e-3})
    return ss.simulate(scene, duration, start).limit_cycle()


@pytest.fixture(scope="module")
def cycle():
    return settled()


def test_period_and_sequence_of_the_standard_run(cycle):
    # Design, section 3: 13 digits of the period.
    assert cycle.period == pytest.approx(8.908492605779e-3, rel=1e-12)
    assert cycle.combinations == ("++", "+d", "++", "s+", "ss", "s+")
    assert cycle.durations.sum() == pytest.approx(cycle.period, rel=8 * EPSILON)
    assert cycle.frequency == pytest.approx(112.2524, abs=5e-5)
    assert not cycle.period_doubled
    # Rounding of a period of motion at condition numbers of the modes below 300.
    assert cycle.residual <= 300 * EPSILON


def test_multipliers_of_the_standard_run(cycle):
    assert cycle.multipliers.size == 12
    assert np.count_nonzero(cycle.multipliers == 0.0) == cycle.structural_zeros
    assert np.count_nonzero(np.abs(cycle.multipliers - 1.0) < 1e-10) == 1
    assert np.abs(cycle.transverse_multipliers).max() == pytest.approx(0.7837, abs=5e-5)
    assert cycle.stable


def test_a_run_from_the_orbit_stays_on_it(cycle):
    run = ss.simulate(cycle.scene, cycle.period, cycle.run.state(0.5 * cycle.durations[0]))
    first, last = run.state(0.0), run.state(run.duration)
    spread = float(cycle.amplitude.max())
    # The largest entries of the monodromy matrix carry rounding of the positions once around.
    assert np.abs(first.position - last.position).max() <= 1e3 * EPSILON * 1e-3
    assert np.abs(first.position - last.position).max() <= 1e-9 * spread


@pytest.mark.parametrize(
    ("friction", "slider_speed", "period", "doubled", "largest"),
    [
        (3.0, 0.025, 17.7519e-3, True, None),
        (2.2, 0.025, 8.912734e-3, False, -0.9369),
        (2.2, 0.05, None, False, None),
        (2.2, 0.3, 18.397e-3, True, None),
        (2.2, 0.9, 17.871e-3, True, None),
    ],
)
def test_periods_over_friction_and_speed(friction, slider_speed, period, doubled, largest):
    cycle = settled(friction, slider_speed)
    if period is not None:
        assert cycle.period == pytest.approx(period, abs=1e-6 if slider_speed >= 0.3 else 1e-7)
    assert cycle.period_doubled == doubled
    if largest is not None:
        outermost = max(cycle.transverse_multipliers, key=abs)
        assert outermost == pytest.approx(largest, abs=5e-5)
        assert cycle.period < 9e-3
    if slider_speed == 0.025:
        # Published, to the unit.
        assert cycle.main_frequency("x2") == pytest.approx(112.0, abs=1.0)


def test_decaying_motion_is_an_equilibrium():
    with pytest.raises(ss.NotPeriodicError) as error:
        settled(friction=0.65, duration=0.1)
    assert error.value.kind == "equilibrium"
    assert error.value.partial.duration == 0.1


def test_a_run_too_short_says_so():
    scene = ss.models.two_subsystems()
    run = ss.simulate(scene, 0.12, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    with pytest.raises(ss.NotPeriodicError) as error:
        run.limit_cycle(further=0.0)
    # Its only event comes near the end: what neighbours do on the attractor is not known.
    assert error.value.kind == "undecided"
    assert error.value.error == np.inf
    assert run.limit_cycle().period == pytest.approx(8.908492605779e-3, rel=1e-12)


def test_a_search_shows_how_much_motion_it_has_followed(cycle, monkeypatch):
    told = []

    @contextmanager
    def looked(done, total, description, progress, patience):
        told.append((done(), total, description, progress))
        yield
        told.append(done())

    monkeypatch.setattr("stickslip.transient.trajectory.watched", looked)
    start = ss.steady_sliding(cycle.scene).perturbed(velocity={"x1": 1e-3})
    run = ss.simulate(cycle.scene, 0.12, start)
    run.limit_cycle(progress=True)
    begin, end = told
    assert begin == (0, 100, "limit cycle, % of `further`", True)
    assert 10 <= end <= 100


@pytest.mark.parametrize("further", [-1.0, np.nan, np.inf, "1"])
def test_further_is_checked(further, cycle):
    with pytest.raises(ss.InputError, match="further"):
        ss.Trajectory(cycle.scene, cycle.run.start, cycle.run.core).limit_cycle(further=further)


@given(
    shape=st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12).filter(
        lambda shape: max(map(abs, shape)) > 0.1
    ),
    size=st.floats(-6.0, 0.0).map(lambda power: 10.0**power),
)
def test_the_cycle_does_not_depend_on_the_perturbation(shape, size):
    """Any shape over all that sliding leaves free, over six decades up to where contacts still slide."""
    scene = ss.models.two_subsystems()
    free = ["x1", "x2", "x3", "x5", "x6", "x7"]
    position = {dof: 1e-6 * size * x for dof, x in zip(free, shape[:6], strict=True)}
    velocity = {dof: 1e-2 * size * x for dof, x in zip(free, shape[6:], strict=True)}
    start = ss.steady_sliding(scene).perturbed(position=position, velocity=velocity)
    cycle = ss.simulate(scene, 0.6, start).limit_cycle()
    assert cycle.period == pytest.approx(8.908492605779e-3, rel=1e-12)
    assert cycle.combinations == ("++", "+d", "++", "s+", "ss", "s+")


@pytest.mark.parametrize(
    ("slider_speed", "statuses"),
    [
        # Table 3; where the record notes it, what the model gives in place of what the table prints.
        (0.025, {"++", "s+", "ss"}),
        (0.05, {"++", "+s", "s+", "ss", "sd", "+d"}),
        (0.3, {"++", "d+", "+d", "s+", "ss", "sd", "dd"}),
    ],
)
def test_statuses_on_the_attractor_over_slider_speed(slider_speed, statuses):
    assert set(settled(2.2, slider_speed).combinations) == statuses


def quadrature(cycle, count, fastest=4000.0):
    """Fourier coefficients by Gauss's rule on every phase of the sampled orbit; `fastest` mode in rad/s."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    order = np.arange(count + 1)
    total = np.zeros((count + 1, cycle.scene.size), dtype=complex)
    for phase in cycle.phases:
        # Pieces short beside the fastest harmonic and mode: 2 radians at their rates.
        pieces = int(np.ceil(phase.duration * (fastest + count * 2 * np.pi * cycle.frequency) / 2.0))
        for piece in range(pieces):
            width = phase.duration / pieces
            times = phase.start + width * (piece + 0.5 * (1.0 + nodes))
            motion = cycle.run.sample(times).position.to_numpy()
            turn = np.exp(-2j * np.pi * cycle.frequency * np.outer(order, times))
            total += 0.5 * width * (turn * weights) @ motion
    return total / cycle.period


def test_fourier_coefficients_against_quadrature(cycle):
    exact = cycle.harmonics(40).coefficient.to_numpy()
    amplitude = cycle.amplitude.to_numpy()
    error = np.abs(exact - quadrature(cycle, 40)) / np.maximum(amplitude, amplitude.max() * 1e-3)
    assert error.max() <= 1e-12


def carried(mass, damping, **loads):
    """1 kg that rubs on a belt and hangs on another `mass`, which a spring and a damper hold."""
    belt = ss.Contact(tangential="x", normal="y", friction=0.3, static_friction=0.5, slider_speed=0.1)
    stiffness = [[4.0, -2.0, 0.0], [-2.0, 2.0, 0.0], [0.0, 0.0, 1.0]]
    scene = ss.Scene(
        [mass, 1.0, 1.0],
        stiffness,
        damping=np.diag([damping, 0.0, 0.0]),
        force=[0.0, 0.0, -1.0],
        contacts=[belt],
        dofs=["hanger", "x", "y"],
        **loads,
    )
    start = ss.State([0.0, 0.0, 0.0], [0.05 if mass else 0.0, 0.1, 0.0], "s")
    return ss.simulate(scene, 100.0, start).limit_cycle()


def test_fourier_coefficients_of_a_dof_without_mass_against_quadrature():
    cycle = carried(0.0, 0.0)
    error = cycle.harmonics(5).coefficient.to_numpy() - quadrature(cycle, 5, fastest=2.0)
    assert np.abs(error).max() <= 1e-14


def test_fourier_coefficients_under_a_switched_load_against_quadrature():
    cycle = carried(0.01, 0.02, loads=[ss.Switched({"x": 0.1}, times=[1.0], values=[0.0, 1.0])])
    error = cycle.harmonics(5).coefficient.to_numpy() - quadrature(cycle, 5, fastest=30.0)
    assert np.abs(error).max() <= 1e-14


def test_fourier_coefficients_beside_a_fast_mode_against_quadrature():
    """A mode of 2e6 1/s over a period of 8 s: in closed form at once, by quadrature in a minute."""
    cycle = carried(1e-8, 0.02)
    error = cycle.harmonics(5).coefficient.to_numpy() - quadrature(cycle, 5, fastest=200.0)
    assert np.abs(error).max() <= 1e-13


def test_fft_of_a_period_converges_at_its_aliasing_order(cycle):
    """Positions have kinks where a plastic impact stops the gap: coefficients fall like 1/k^2, and N
    samples alias the first harmonic by 1/N^2; velocities, which jump, by 1/N."""
    exact = cycle.harmonics(4).coefficient.sel(dof="x8").to_numpy()
    errors = []
    for count in (1024, 4096):
        times = cycle.period * np.arange(count) / count
        motion = cycle.run.sample(times)
        position = np.fft.fft(motion.position.sel(dof="x8").to_numpy())[1] / count
        speed = motion.velocity.sel(dof="x8").to_numpy()
        velocity = np.fft.fft(speed)[1] / count
        rate = 2j * np.pi * cycle.frequency * exact[1]
        errors.append((abs(position - exact[1]), abs(velocity - rate)))
        # A jump is misplaced by at most half a sampling interval, and no larger than the speed.
        assert abs(velocity - rate) <= np.abs(speed).max() / count
    # A fourfold N gains 16 and 4; the place of the jump within a sampling interval, up to twice more or less.
    assert errors[0][0] / errors[1][0] >= 8.0
    assert errors[0][1] / errors[1][1] >= 2.0


def test_multipliers_against_finite_differences(cycle):
    """The return map of perturbed starts, one period later, differenced: the same eigenvalues to 1e-6."""
    assert_multipliers(cycle, 1e-6)


def test_a_series_that_no_memory_holds_is_refused(cycle):
    with pytest.raises(ss.InputError, match=r"count: 1000000000000 would take .* GiB"):
        cycle.harmonics(10**12)
