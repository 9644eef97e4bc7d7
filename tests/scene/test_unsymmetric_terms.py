"""Gyroscopic and circulatory terms: `M x'' + (C + G) x' + (K + H) x = F` with contacts."""

import pickle
from functools import partial

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

import stickslip as ss
from peer_integrator import Mechanics, assert_same_motion
from random_scenes import combinations, drawn_scenes
from return_map import assert_multipliers

EPS = np.finfo(float).eps
DRAWN = drawn_scenes(min_friction=0.2, unsymmetric=True)


def drum_brake(friction=0.3, loss=0.02, **changes):
    """Two modes of 100 and 75 Hz that friction couples."""
    first, second = 2.0 * np.pi * 100.0, 2.0 * np.pi * 75.0
    arguments = {
        "mass": [1.0, 1.0],
        "stiffness": np.diag([first**2, second**2]),
        "damping": np.diag([loss * first, loss * second]) if loss else None,
        "circulatory": friction * np.array([[0.0, -(second**2)], [first**2, 0.0]]),
    }
    return ss.Scene(**{**arguments, **changes})


def rotor(spin=10.0, **changes):
    """A mass on a belt with a gyroscopic couple between its two directions, and a follower force."""
    arguments = {
        "mass": [1.0, 1.0, 0.5],
        "stiffness": [[900.0, 0.0, 0.0], [0.0, 800.0, -300.0], [0.0, -300.0, 700.0]],
        "damping": ss.Rayleigh(stiffness=2e-4),
        "gyroscopic": [[0.0, spin, 3.0], [-spin, 0.0, 0.0], [-3.0, 0.0, 0.0]],
        "circulatory": [[0.0, 60.0, 0.0], [0.0, 0.0, -40.0], [10.0, 20.0, 5.0]],
        "force": [0.0, -40.0, 0.0],
        "contacts": [
            ss.Contact(tangential=0, normal=1, friction=0.5, static_friction=0.8, slider_speed=0.05)
        ],
    }
    return ss.Scene(**{**arguments, **changes})


def state_matrix(scene, combination):
    """Generator of the motion of the free coordinates."""
    reduced = ss.equations_of(scene, combination)
    m = reduced.mass.shape[0]
    lower = -np.linalg.solve(reduced.mass, np.hstack([reduced.stiffness, reduced.damping]))
    return np.vstack([np.hstack([np.zeros((m, m)), np.eye(m)]), lower])


@given(DRAWN, st.data())
def test_right_and_left_modes(drawn, data):
    """Each satisfies its own equation, and both are bi-orthogonal."""
    scene = drawn.scene
    modes = ss.complex_modes(scene, data.draw(combinations(scene)))
    sound = modes.condition < 1e3
    rate, xi, v = modes.eigenvalues[sound], modes.right[:, sound], modes.left[:, sound]
    a, b = modes.state_a, modes.state_b
    size = np.linalg.norm(a) * np.abs(rate) + np.linalg.norm(b)
    assert (np.abs(a @ xi * rate + b @ xi).max(axis=0) <= 1e-12 * size * np.abs(xi).max(axis=0)).all()
    assert (np.abs(a.T @ v * rate + b.T @ v).max(axis=0) <= 1e-12 * size * np.abs(v).max(axis=0)).all()
    expected = np.linalg.eigvals(state_matrix(scene, modes.combination))
    for value, condition in zip(rate, modes.condition[sound], strict=True):
        assert np.abs(expected - value).min() <= 1e-11 * condition * np.abs(expected).max()


def test_an_undamped_circulatory_scene_has_pairs_on_the_axis():
    """`lambda^2` are the eigenvalues of `-M^-1 (K + H)`: real below lock-in, so no mode grows by rounding."""
    modes = ss.complex_modes(drum_brake(0.2, loss=0.0))
    assert (modes.eigenvalues.real == 0.0).all()
    squares = np.linalg.eigvals(-drum_brake(0.2).stiffness - drum_brake(0.2).circulatory)
    assert np.sort(modes.eigenvalues.imag) == pytest.approx(np.sort(np.sqrt(-squares)), rel=1e-14)


@pytest.mark.parametrize("spin", [0.0, 1.0, 300.0])
def test_a_gyroscopic_pair_splits(spin):
    """`z = x + i y` with `z'' - i spin z' + w^2 z = 0`: two circular frequencies, `w1 w2 = w^2`."""
    w = 50.0
    scene = ss.Scene([1.0, 1.0], w**2 * np.eye(2), gyroscopic=[[0.0, spin], [-spin, 0.0]])
    imaginary = np.sort(ss.complex_modes(scene).eigenvalues.imag)
    half, root = 0.5 * spin, np.sqrt(0.25 * spin**2 + w**2)
    assert imaginary == pytest.approx([root - half, root + half], rel=4e-14)
    # G does no work.
    run = ss.simulate(scene, 3.0, ss.State([1e-3, 0.0], [0.0, 0.0], ""))
    assert abs(run.balance().stored) <= 1e-12 * float(run.energy(0.0).elastic[0])


@given(DRAWN, st.data())
def test_modes_and_series_and_blocks_give_the_same_events(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.3, 2.0), label="strength"))
    by_series = ss.simulate(drawn.scene, 0.02, start, method="taylor")
    run = ss.simulate(drawn.scene, 0.02, start)
    assert run.events.combination.tolist() == by_series.events.combination.tolist()
    assert run.events.kind.tolist() == by_series.events.kind.tolist()
    assert np.abs(run.events.time - by_series.events.time).max(initial=0.0) <= 1e-11
    for name in ("position", "velocity"):
        ours, theirs = (getattr(one.state(0.02), name) for one in (run, by_series))
        assert np.abs(ours - theirs).max() <= 1e-9 * np.abs(ours).max()


@pytest.mark.slow
@given(DRAWN, st.data())
def test_motions_against_an_independent_integrator(drawn, data):
    start = drawn.kicked(data.draw(st.floats(0.3, 2.0), label="strength"))
    assert_same_motion(drawn.scene, start, 0.02)


@pytest.mark.slow
def test_the_rotor_sticks_and_slips_as_an_independent_integrator_says():
    scene = rotor()
    start = ss.State(ss.steady_sliding(scene).position, [0.05, 0.0, 0.0], "s")
    run = assert_same_motion(scene, start, 1.5)
    assert {"velocity", "slip+"} <= set(run.events.kind)


@given(drawn_scenes(restitution=(0.0, 0.5), unsymmetric=True), st.data())
def test_energy_closes(drawn, data):
    """`stored = contact + external + circulatory - damping - impact`, each from its own formula."""
    scene = drawn.scene
    lifted = data.draw(st.booleans(), label="lifted")
    start = drawn.lifted(3.0) if lifted else drawn.kicked(2.0)
    run = ss.simulate(scene, 0.03, start, max_events=200)
    balance = run.balance()
    mechanics = Mechanics(scene)
    sizes = [np.abs(state.position) for state in (run.start, run.state(run.duration))]
    stored = max(size @ np.abs(mechanics.stiffness) @ size for size in sizes)
    assert abs(balance.residual) <= 1e-12 * balance.turnover + 40 * EPS * (1 + run.events.time.size) * stored
    flow = run.energy(np.linspace(0.0, run.duration, 7))
    powers = flow.contact_power.sum("contact") + flow.external_power + flow.circulatory_power
    terms = np.abs(flow.contact_power).sum("contact") + np.abs(flow.external_power) + flow.damping_power
    velocity = np.abs(run.sample(flow.time.values).velocity.values)
    terms = terms + velocity.max() * np.abs(mechanics.stiffness).sum() * max(size.max() for size in sizes)
    assert (np.abs(flow.energy_rate - powers + flow.damping_power) <= 1e-12 * terms).all()
    h = 0.0 if scene.circulatory is None else 0.5 * (scene.circulatory - scene.circulatory.T)
    sample = run.sample(flow.time.values)
    for k in range(flow.time.size):
        x, u = sample.position.values[k], sample.velocity.values[k]
        expected = -u @ (h @ x) if scene.circulatory is not None else 0.0
        scale = np.abs(u) @ (np.abs(h) @ np.abs(x)) if scene.circulatory is not None else 0.0
        assert float(flow.circulatory_power[k]) == pytest.approx(expected, abs=1e-13 * scale)


def test_a_symmetric_circulatory_matrix_is_a_spring():
    """Its energy is elastic, its power nothing, and the motion is that of a scene with it in K."""
    spring = np.array([[50.0, -20.0, 0.0], [-20.0, 30.0, 0.0], [0.0, 0.0, 0.0]])
    separate = rotor(circulatory=spring, damping=None)
    plain = rotor(circulatory=None, stiffness=rotor().stiffness + spring, damping=None)
    start = ss.State([1e-3, 0.0, 0.01], [0.0, 0.0, 0.1], "+")
    ours, theirs = (ss.simulate(scene, 1.0, start) for scene in (separate, plain))
    assert ours.events.combination.tolist() == theirs.events.combination.tolist()
    balance, expected = ours.balance(), theirs.balance()
    assert balance.circulatory == 0.0
    assert balance.elastic == pytest.approx(expected.elastic, rel=1e-11)


def test_an_entry_on_one_side_joins_parts():
    """x2 drives x1 through H, and nothing drives x2: the scene is one part."""
    scene = ss.Scene([1.0, 2.0], np.diag([400.0, 900.0]), circulatory=[[0.0, 70.0], [0.0, 0.0]])
    for method in ("modal", "taylor"):
        run = ss.simulate(scene, 1.0, ss.State([0.0, 1e-3], [0.0, 0.0], ""), method=method)
        flow = expm(state_matrix(scene, "") * 1.0) @ [0.0, 1e-3, 0.0, 0.0]
        assert run.state(1.0).position == pytest.approx(flow[:2], rel=1e-11)
        assert abs(run.state(1.0).position[0]) > 1e-6


def test_uncoupled_parts_run_by_themselves():
    """Two rotors side by side are two rotors."""
    one, other = rotor(), rotor(spin=-15.0)

    def join(a, b):
        return scipy.sparse.block_diag([a, b]).tocsr()

    contacts = [
        one.contacts[0],
        ss.Contact(tangential=3, normal=4, friction=0.5, static_friction=0.8, slider_speed=0.05),
    ]
    both = ss.Scene(
        np.tile(one.mass, 2),
        join(one.stiffness, other.stiffness),
        one.damping,
        np.tile(one.force, 2),
        contacts,
        gyroscopic=join(one.gyroscopic, other.gyroscopic),
        circulatory=join(one.circulatory, other.circulatory),
    )
    starts = [ss.steady_sliding(scene).perturbed(velocity={"x1": 0.04}) for scene in (one, other)]
    alone = [ss.simulate(scene, 0.5, start) for scene, start in zip((one, other), starts, strict=True)]
    together = ss.simulate(
        both,
        0.5,
        ss.State(
            *(np.concatenate([getattr(s, name) for s in starts]) for name in ("position", "velocity")), "++"
        ),
    )
    for k, run in enumerate(alone):
        own = together.events.time[together.events.contact == k]
        assert own == pytest.approx(run.events.time, rel=1e-12)
        part = together.state(0.5).position[3 * k : 3 * k + 3]
        assert part == pytest.approx(run.state(0.5).position, rel=1e-10)


def test_multipliers_of_a_cycle():
    scene = rotor()
    run = ss.simulate(scene, 20.0, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.04}))
    cycle = run.limit_cycle()
    assert "s" in "".join(cycle.combinations)
    assert_multipliers(cycle)
    balance = cycle.balance()
    assert abs(balance.stored) <= 1e-11 * balance.turnover
    assert abs(balance.circulatory) > 1e-3 * balance.turnover
    assert abs(balance.residual) <= 1e-12 * balance.turnover
    harmonics = cycle.harmonic_energy(60)
    assert float(harmonics.circulatory.sum()) == pytest.approx(balance.circulatory, rel=1e-3)


def test_mean_powers_of_modes_tell_their_growth():
    power = ss.complex_modes(drum_brake(0.35)).power()
    assert float(power.circulatory_power[0]) > float(power.damping_power[0]) > 0.0
    assert (np.abs(power.residual) <= 1e-12 * power.damping_power).all()


def test_energy_of_modes_in_a_motion():
    scene = rotor()
    run = ss.simulate(scene, 0.01, ss.steady_sliding(scene).perturbed(velocity={"x3": 1e-3}))
    assert run.events.time.size == 0
    step = 1e-5
    before, at, after = (ss.modal_energy(run, t) for t in (0.005 - step, 0.005, 0.005 + step))
    rate = (after.energy.values - before.energy.values)[0] / (2.0 * step)
    powers = (at.contact_power + at.circulatory_power - at.damping_power).values[0]
    assert rate == pytest.approx(powers, rel=1e-6, abs=1e-6 * np.abs(powers).max())


@pytest.mark.parametrize("loss", [0.0, 0.02, 0.1])
def test_hopf_point_of_a_model_that_fills_the_circulatory_matrix(loss):
    """`mu^2 = (w1 - w2)^2 / (w1 w2) + loss^2` at `w^2 = w1 w2`.

    Without damping the modes meet at `(w1^2 - w2^2) / (2 w1 w2)`.
    """
    model = partial(drum_brake, loss=loss)
    points = ss.critical_points(model, {"friction": (0.0, 0.5)})
    if loss == 0.0:
        (lock_in,) = points
        assert (lock_in.kind, lock_in.value) == ("lock_in", pytest.approx(7.0 / 24.0, rel=1e-14))
        return
    (hopf,) = [point for point in points if point.kind == "hopf"]
    assert hopf.value == pytest.approx(np.sqrt(1.0 / 12.0 + loss**2), rel=1e-12)
    assert hopf.frequency == pytest.approx(np.sqrt(7500.0), rel=1e-12)
    assert ss.critical_points(model, {"friction": (0.0, 0.5)}, kinds=("hopf",))[0].value == pytest.approx(
        hopf.value, rel=1e-14
    )
    sweep = ss.sweep(model, {"friction": [0.9 * hopf.value, 1.1 * hopf.value]})
    assert sweep.stable.values.tolist() == [True, False]
    verdicts = ss.stability(model, {"friction": [0.9 * hopf.value, 1.1 * hopf.value]})
    assert (verdicts.eigenvalue.real > 0.0).values.tolist() == [False, True]


def test_sensitivity_to_the_circulatory_matrix():
    step = 1e-4
    change = ss.sensitivity(drum_brake, {"friction": 0.35}).derivative[0]
    values = [ss.complex_modes(drum_brake(0.35 + d)).eigenvalues for d in (-step, step)]
    assert change.values == pytest.approx((values[1] - values[0]) / (2 * step), rel=1e-5)
    entries = ss.sensitivity(drum_brake(0.35), entries="circulatory").entry_derivative.values
    first, second = 2.0 * np.pi * 100.0, 2.0 * np.pi * 75.0
    along = entries[:, 1, 0] * first**2 - entries[:, 0, 1] * second**2
    assert along == pytest.approx(change.values, rel=1e-10)


def test_a_scene_keeps_replaces_and_pickles_them():
    scene = rotor()
    with pytest.raises(ValueError, match="read-only"):
        scene.gyroscopic[0, 1] = 1.0
    copy = pickle.loads(pickle.dumps(scene))
    values = ss.complex_modes(scene).eigenvalues
    assert np.array_equal(ss.complex_modes(copy).eigenvalues, values)
    assert np.array_equal(ss.complex_modes(scene.replace(friction=0.5)).eigenvalues, values)
    still = scene.replace(gyroscopic=None)
    assert still.gyroscopic is None
    assert still.circulatory is not None
    sparse = scene.replace(gyroscopic=scipy.sparse.coo_array(scene.gyroscopic))
    assert np.array_equal(ss.complex_modes(sparse).eigenvalues, values)
    assert "gyroscopic: matrix" in repr(scene)
    assert "circulatory" in scene._repr_html_()
    plain = scene.replace(gyroscopic=np.zeros((3, 3)), circulatory=np.zeros((3, 3)))
    bare = scene.replace(gyroscopic=None, circulatory=None)
    assert np.array_equal(ss.complex_modes(plain).eigenvalues, ss.complex_modes(bare).eigenvalues)


def test_a_record_gives_the_motion_back(tmp_path):
    scene = rotor()
    run = ss.simulate(scene, 1.0, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.04}))
    copy = pickle.loads(pickle.dumps(run))
    assert np.array_equal(copy.state(0.77).position, run.state(0.77).position)
    assert copy.balance().circulatory == run.balance().circulatory


@pytest.mark.parametrize("matrices", ["auto", "npz", "mtx"])
def test_a_scene_file_keeps_them(tmp_path, matrices):
    scene = rotor(circulatory=scipy.sparse.csr_array(rotor().circulatory))
    path = tmp_path / "rotor.toml"
    ss.save(scene, path, matrices=matrices)
    back = ss.load(path).scene
    assert np.array_equal(back.gyroscopic, scene.gyroscopic)
    assert scipy.sparse.issparse(back.circulatory)
    assert (back.circulatory != scene.circulatory).nnz == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"stiffness": [[1.0, 2.0], [0.0, 1.0]]},
            r"stiffness: must be symmetric, got 2 at \(0, 1\) and 0 at \(1, 0\); .*"
            r"stiffness=\(A \+ A'\) / 2 and circulatory=\(A - A'\) / 2",
        ),
        ({"damping": [[1.0, 2.0], [0.0, 1.0]]}, r"damping: must be symmetric.*gyroscopic=\(A - A'\) / 2"),
        ({"gyroscopic": [[0.0, 1.0], [1.0, 0.0]]}, r"gyroscopic: must be skew-symmetric .*got 1 at \(0, 1\)"),
        ({"gyroscopic": [[1.0, 0.0], [0.0, 0.0]]}, r"gyroscopic: must be skew-symmetric .*got 1 at \(0, 0\)"),
        ({"circulatory": np.eye(3)}, r"circulatory: expected shape \(2, 2\), got \(3, 3\)"),
        ({"circulatory": [[0.0, np.nan], [0.0, 0.0]]}, r"circulatory: must be finite, got NaN at \(0, 1\)"),
    ],
)
def test_what_is_refused(changes, message):
    with pytest.raises(ss.InputError, match=message):
        drum_brake(**changes)
