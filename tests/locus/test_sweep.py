import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from stickslip.show.progress import watched

EPS = np.finfo(float).eps


def rotation(size, seed):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(size, size)))[0]


def rotated_oscillators(stiffness, seed, coupling=0.0):
    """Oscillators of unit mass with stiffnesses over p, mixed by a rotation so that no block shows."""
    size = len(stiffness(0.0))
    turn = rotation(size, seed)
    tie = coupling * (np.ones((size, size)) - np.eye(size))

    def model(p):
        matrix = turn @ (np.diag(stiffness(p)) + tie) @ turn.T
        return ss.Scene(np.ones(size), 0.5 * (matrix + matrix.T), damping=ss.Rayleigh(stiffness=1e-3))

    return model


def upper(dataset, index=slice(None)):
    """Branches with positive imaginary part at the first value."""
    return dataset.eigenvalue.to_numpy()[:, dataset.eigenvalue.to_numpy()[0].imag > 0.0][index]


slopes = st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=5, unique=True)


@given(slopes, st.integers(0, 2**32 - 1), st.integers(3, 60), st.data())
def test_branches_that_cross_are_followed_through(gradients, seed, points, data):
    starts = np.array(
        data.draw(st.lists(st.floats(5.0, 9.0), min_size=len(gradients), max_size=len(gradients)))
    )
    gradients = np.array(gradients)

    def stiffness(p):
        return 1e4 * (starts + gradients * p)

    values = np.linspace(-1.0, 1.0, points)
    found = ss.sweep(rotated_oscillators(stiffness, seed), {"p": values})
    expected = np.sqrt(np.array([stiffness(p) for p in values]))
    frequencies = 2 * np.pi * found.frequency.to_numpy()
    # Each branch is one of the straight lines from end to end; the rounding of k moves sqrt(k) by half as
    # much.
    for line in expected.T:
        distance = np.abs(frequencies - line[:, None]).max(axis=0)
        assert distance.min() <= 1e-9 * line.max()
    # Sorted at the start, each line is taken by one conjugate pair.
    start = np.sort(expected[0])
    assert frequencies[0] == pytest.approx(np.repeat(start, 2), rel=1e-9)


@given(st.floats(1e-8, 1e-1), st.integers(0, 2**32 - 1), st.integers(3, 60), st.floats(-0.5, 0.5))
def test_branches_that_veer_are_not_swapped(gap, seed, points, centre):
    def stiffness(p):
        return 1e4 * np.array([4.0 + (p - centre), 4.0 - (p - centre), 9.0])

    values = np.linspace(-1.0, 1.0, points)
    found = ss.sweep(rotated_oscillators(stiffness, seed, coupling=1e4 * gap), {"p": values})
    frequencies = upper(found)
    assert (np.diff(np.abs(frequencies), axis=1) > 0.0).all()


def test_a_grid_point_on_the_crossing_itself_does_not_matter():
    def stiffness(p):
        return 1e4 * np.array([4.0 + p, 4.0 - p, 9.0])

    found = ss.sweep(rotated_oscillators(stiffness, 3), {"p": np.linspace(-1.0, 1.0, 21)})
    squares = np.abs(upper(found)) ** 2
    assert squares[0] == pytest.approx([3e4, 5e4, 9e4], rel=1e-12)
    assert squares[-1] == pytest.approx([5e4, 3e4, 9e4], rel=1e-12)
    assert squares[10] == pytest.approx([4e4, 4e4, 9e4], rel=1e-12)


def test_double_eigenvalues_all_along_are_no_obstacle():
    def stiffness(p):
        return 1e4 * np.array([4.0 + p, 4.0 + p, 9.0, 6.0 - p])

    found = ss.sweep(rotated_oscillators(stiffness, 5), {"p": np.linspace(-1.0, 1.0, 33)})
    assert np.abs(upper(found)[-1]) ** 2 == pytest.approx([5e4, 5e4, 5e4, 9e4], rel=1e-12)
    assert found.meetings.size == 0


def test_reference_model_equals_its_modes_at_every_point():
    scene = ss.models.two_subsystems()
    values = np.linspace(0.0, 3.0, 31)
    found = ss.sweep(scene, {"friction": values}, vectors=True)
    for friction, row in zip(values, found.eigenvalue.to_numpy(), strict=True):
        modes = ss.complex_modes(scene.replace(friction=friction)).with_conjugates
        order = np.lexsort((-row.imag, np.abs(row.imag), np.abs(row)))
        bound = 100 * EPS * modes.condition * np.abs(modes.eigenvalues).max()
        assert (np.abs(row[order] - modes.eigenvalues) <= bound).all()


def test_vectors_solve_the_problem_and_are_biorthogonal():
    scene = ss.models.two_subsystems()
    found = ss.sweep(scene, {"friction": np.linspace(0.0, 3.0, 13)}, vectors=True)
    for friction in found.friction.to_numpy():
        point = found.sel(friction=friction)
        modes = ss.complex_modes(scene.replace(friction=friction))
        value = point.eigenvalue.to_numpy()
        right, left = (np.vstack([v, v * value]) for v in (point.right.to_numpy(), point.left.to_numpy()))
        product = left.T @ modes.state_a @ right
        size = np.abs(left).T @ np.abs(modes.state_a) @ np.abs(right)
        assert (np.abs(product - np.diag(point.a)) <= 1e-12 * size).all()
        residual = modes.state_a @ right * value + modes.state_b @ right
        assert (np.abs(residual) <= 1e-12 * (np.abs(modes.state_b) @ np.abs(right)).max(axis=0)).all()


def test_a_model_function_gives_what_its_scenes_give():
    values = np.array([0.1, 0.9, 0.35])
    found = ss.sweep(lambda angle: ss.models.two_subsystems(inclination=(angle, 0.75)), {"angle": values})
    assert found.angle.to_numpy() == pytest.approx(values, abs=0.0)
    for angle, row in zip(values, found.eigenvalue.to_numpy(), strict=True):
        modes = ss.complex_modes(ss.models.two_subsystems(inclination=(angle, 0.75)))
        # Interpolated to 64 ulp of a row; the derivative of an eigenvalue is its condition.
        bound = 1e3 * EPS * modes.condition * np.abs(modes.eigenvalues).max()
        distance = np.abs(modes.eigenvalues[:, None] - row[None, :]).min(axis=1)
        assert (distance <= bound).all()


def test_derivatives_are_those_of_the_branches():
    step = 1e-5
    found = ss.sweep(ss.models.two_subsystems(), {"friction": 1.3 + step * np.array([-1.0, 0.0, 1.0])})
    value, derivative = found.eigenvalue.to_numpy(), found.derivative.to_numpy()
    # Central difference: error step^2 / 6 of the third derivative, which is of the order of the value.
    assert (value[2] - value[0]) / (2 * step) == pytest.approx(derivative[1], rel=1e-6)


def test_marginal_points_are_said_where_they_are_wanted():
    undamped = ss.models.two_subsystems(damping=0.0)
    over = {"friction": [0.3, 0.7]}
    found = ss.sweep(undamped, over, marginal=True)
    # Below lock-in no mode grows or decays; beyond it one grows.
    assert found.marginal.to_numpy().tolist() == [True, False]
    assert found.stable.to_numpy().tolist() == [True, False]
    assert not ss.sweep(ss.models.two_subsystems(), over, marginal=True).marginal.any()
    assert "marginal" not in ss.sweep(undamped, over)
    grid = ss.sweep(undamped, {"friction_0": [0.1, 0.2], "friction_1": [0.1, 3.0, 0.2]}, marginal=True)
    assert grid.marginal.dims == ("friction_0", "friction_1")
    assert grid.marginal.to_numpy()[:, 0].all()


def test_two_parameters_make_a_stability_map():
    scene = ss.models.two_subsystems()
    first, second = np.linspace(0.0, 3.0, 7), np.linspace(0.0, 3.0, 9)
    found = ss.sweep(scene, {"friction_0": first, "friction_1": second})
    assert found.eigenvalue.dims == ("friction_0", "friction_1", "branch")
    for a in (0.0, 1.5, 3.0):
        for b in (0.75, 3.0):
            modes = ss.complex_modes(scene.replace(friction=[a, b]))
            assert bool(found.stable.sel(friction_0=a, friction_1=b)) == (not modes.unstable.any())
    # The first column is a branch of its own: it moves by no more than its slope allows.
    column = ss.sweep(scene, {"friction_0": first, "friction_1": 0.0})
    assert found.eigenvalue.to_numpy()[:, 0] == pytest.approx(column.eigenvalue.to_numpy(), rel=1e-9)


def test_a_sweep_that_shows_its_progress_is_the_sweep(capsys):
    values = np.linspace(0.0, 3.0, 101)
    scene = ss.models.two_subsystems()
    whole = ss.sweep(scene, {"friction": values}, progress=False)
    shown = ss.sweep(scene, {"friction": values}, progress=True)
    assert capsys.readouterr().out == ""
    # Also beyond the meetings, where the order of the branches is a convention.
    assert whole.eigenvalue.to_numpy().tobytes() == shown.eigenvalue.to_numpy().tobytes()
    assert whole.meetings.size == 2


def test_a_map_shows_its_progress_beside_its_output(capsys):
    axes = {"friction_0": [0.1, 0.5, 0.9], "friction_1": [0.2, 0.4]}
    quiet = ss.sweep(ss.models.two_subsystems(), axes, progress=False)
    shown = ss.sweep(ss.models.two_subsystems(), axes, progress=True)
    assert capsys.readouterr().out == ""
    assert shown.identical(quiet)


def test_one_long_call_shows_its_progress_beside_its_output(capsys):
    scene, values = ss.models.two_subsystems(), np.linspace(0.1, 1.5, 9)
    quiet = ss.sweep(scene, {"friction": values}, modes=2, progress=False)
    assert capsys.readouterr() == ("", "")
    shown = ss.sweep(scene, {"friction": values}, modes=2, progress=True)
    assert capsys.readouterr().out == ""
    assert shown.identical(quiet)


def test_a_bar_follows_what_another_thread_counts(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")  # as on a terminal
    counted = []

    def done():
        counted.append(len(counted))
        return len(counted)

    with watched(done, 5, "work", True, 60.0):
        while len(counted) < 3:
            time.sleep(0.01)
    assert "work" in capsys.readouterr().err
    looked = len(counted)
    with watched(done, 5, "work", False, 0.0):
        pass
    assert len(counted) == looked


def test_a_defective_point_is_flagged_and_has_no_left_vectors():
    """An oscillator over its damping, critical in the middle of the range."""

    def oscillator(dashpot: float) -> ss.Scene:
        return ss.Scene(np.ones(1), np.ones((1, 1)), damping=np.array([[dashpot]]))

    found = ss.sweep(oscillator, {"dashpot": [1.0, 2.0, 3.0]}, vectors=True)
    assert found.defective.to_numpy().tolist() == [[False] * 2, [True] * 2, [False] * 2]
    for name in ("left", "a", "derivative"):
        undefined = np.isnan(found[name].to_numpy()).reshape(3, -1)
        assert undefined.tolist() == [[False] * 2, [True] * 2, [False] * 2]
    assert np.isfinite(found.right.to_numpy()).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"frictoin": [0.0, 1.0]}, "frictoin: a scene has no such parameter; nearest: friction"),
        ({"friction": [0.0, np.nan]}, "friction: expected finite values"),
        ({"friction": [1.0, 1.0]}, "friction: expected distinct values"),
        ({"friction": []}, "at least one"),
        ({"friction": 1.0}, "expected one or two parameters with arrays"),
        ({"friction": [-0.1, 1.0]}, "friction: must be >= 0, got -0.1"),
    ],
)
def test_what_cannot_be_swept_is_refused(arguments, message):
    with pytest.raises(ss.InputError, match=message):
        ss.sweep(ss.models.two_subsystems(), arguments)


def test_a_model_with_a_kink_is_refused():
    with pytest.raises(ss.InputError, match="load: the model is not a smooth function of it"):
        ss.sweep(
            lambda load: ss.models.two_subsystems(damping=1e-4 * (1 + abs(load - 0.3))), {"load": [0.0, 1.0]}
        )


def test_a_single_value_is_a_sweep_too():
    found = ss.sweep(ss.models.two_subsystems(), {"friction": [1.5]})
    assert found.eigenvalue.shape == (1, 12)
    assert not bool(found.stable[0])


def test_chosen_modes_are_the_branches_of_the_largest_real_parts():
    # With damping that is not in proportion no branches meet at a real value: labels are no convention.
    scene = ss.models.two_subsystems(friction=1.0).replace(damping=np.diag(20.0 * np.arange(1.0, 9.0)))
    values = np.linspace(0.0, 3.0, 61)
    every = ss.sweep(scene, {"friction": values})
    assert every.meetings.size == 0
    largest = every.eigenvalue.to_numpy().real.max(axis=0)
    for count in (1, 3, 5):
        chosen = ss.sweep(scene, {"friction": values}, modes=count, vectors=True)
        # All of this scene are conjugate pairs, adjacent.
        pairs = np.sort(np.argsort(-largest[::2])[:count])
        branches = np.stack([2 * pairs, 2 * pairs + 1], axis=1).ravel()
        expected = every.eigenvalue.to_numpy()[:, branches]
        assert chosen.eigenvalue.shape == expected.shape
        np.testing.assert_allclose(chosen.eigenvalue, expected, rtol=1e-9)
        assert chosen.right.shape == (61, 6, 2 * count)
        np.testing.assert_array_equal(chosen.stable, every.stable)


def test_chosen_modes_that_meet_are_followed_beyond():
    scene = ss.models.two_subsystems(friction=1.0)
    values = np.linspace(0.0, 3.0, 61)
    every, chosen = (ss.sweep(scene, {"friction": values}, modes=modes) for modes in (None, 3))
    # Two pairs meet twice; a quarter of the interval between two values tells where, from its middle.
    assert every.meetings.size == 2
    for meeting in every.meetings:
        assert np.abs(chosen.meetings - meeting).min() <= (values[1] - values[0]) / 4.0
    # Which of both branches goes on beyond a meeting is a convention; how fast those that grow do so is not.
    largest, kept = (np.sort(found.eigenvalue.to_numpy().real.max(axis=0)) for found in (every, chosen))
    assert np.count_nonzero(largest > 0.0) == 4
    np.testing.assert_allclose(kept[-4:], largest[-4:], rtol=1e-9)


def test_stability_is_that_of_all_modes_although_few_are_followed():
    # The first oscillator grows up to p = 0.5, by little; the second beyond p = 0.8, by more.
    def model(p):
        return ss.Scene(np.ones(2), np.diag([1e4, 4e4]), damping=np.diag([p - 0.5, 40.0 - 50.0 * p]))

    found = ss.sweep(model, {"p": [0.1, 0.7, 0.9]}, modes=1)
    np.testing.assert_allclose(found.eigenvalue[2].real, 2.5)
    assert found.stable.to_numpy().tolist() == [False, True, False]


def test_a_wrong_number_of_modes_is_refused():
    scene = ss.models.two_subsystems()
    with pytest.raises(ss.InputError, match="modes"):
        ss.sweep(scene, {"friction": [0.0, 1.0]}, modes=0)
    with pytest.raises(ss.InputError, match="modes: expected None with two parameters"):
        ss.sweep(scene, {"friction": [0.0, 1.0], "slider_speed": [0.01, 0.02]}, modes=2)
