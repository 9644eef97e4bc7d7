"""Free flight of structures with rigid bodies, whose double eigenvalue zero no sum of modes represents."""

import numpy as np
import pytest
import scipy.linalg

import stickslip as ss

#: Largest error of each method, of the sizes of positions and velocities.
ACCURACY = 1e-12


def structure(rng, bodies, coupled, damping):
    """A random structure with so many rigid-body motions and a load, and its fastest rate, 1/s."""
    n = int(rng.integers(bodies + 2, bodies + 7))
    turn = np.linalg.qr(rng.standard_normal((n, n)))[0]
    stiffness = (turn * np.r_[np.zeros(bodies), 1e9 * np.logspace(-3.0, 0.0, n - bodies)]) @ turn.T
    root = np.eye(n) + 0.3 * rng.standard_normal((n, n)) / np.sqrt(n)
    mass = 1e-3 * (root.T @ root if coupled else np.diag(rng.uniform(0.5, 2.0, n)))
    stiffness, mass = (0.5 * (matrix + matrix.T) for matrix in (stiffness, mass))
    if damping == "general":
        factor = rng.standard_normal((n, n))
        damping = 1.0 * factor @ factor.T
    elif damping == "internal":
        # Dampers between points of the structure: none acts on a rigid body.
        factor = rng.standard_normal((n, n)) @ turn[:, bodies:] @ turn[:, bodies:].T
        damping = 1.0 * factor.T @ factor
    else:
        damping = damping[0] * mass + damping[1] * stiffness
    damping = 0.5 * (damping + damping.T)
    load = 50.0 * rng.standard_normal(n)
    fastest = float(np.sqrt(scipy.linalg.eigvalsh(stiffness, mass)[-1]))
    return mass, damping, stiffness, load, fastest


def exact_state(structure, start, duration):
    """(x, x', 1) after a duration, by the matrix exponential in extended precision."""
    mass, damping, stiffness, load = (np.asarray(part, np.longdouble) for part in structure[:4])
    n = len(mass)
    inverse = np.linalg.inv(structure[0]).astype(np.longdouble)
    for _ in range(3):
        inverse = inverse @ (2 * np.eye(n) - mass @ inverse)
    system = np.zeros((2 * n + 1, 2 * n + 1), np.longdouble)
    system[:n, n : 2 * n] = np.eye(n)
    system[n : 2 * n] = -inverse @ np.column_stack([stiffness, damping, -load])
    # Velocities in units of the fastest rate balance the blocks.
    unit = np.r_[np.ones(n), np.full(n, structure[4]), 1.0].astype(np.longdouble)
    system *= np.longdouble(duration) * unit / unit[:, None]
    squarings = 2 + max(0, int(np.ceil(np.log2(float(np.abs(system).sum(axis=1).max())))))
    term = total = np.eye(2 * n + 1, dtype=np.longdouble)
    for k in range(1, 26):
        term = term @ system / (k * 2**squarings)
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return (unit * (total @ (start / unit))).astype(float)


def check(case, rng, structure, duration):
    """Every method agrees with the matrix exponential from a random state, or modes are refused."""
    mass, c, stiffness, load, _ = structure
    n = len(mass)
    x, v = 1e-6 * rng.standard_normal(n), 0.1 * rng.standard_normal(n)
    exact = exact_state(structure, np.r_[x, v, 1.0], duration)
    scene, start = ss.Scene(mass, stiffness, damping=c, force=load), ss.State(x, v, "")
    for method in ("modal", "auto", "taylor"):
        try:
            state = ss.simulate(scene, duration, start, method=method).state(duration)
        except ss.InputError:
            if method != "modal":
                raise
            continue
        position = np.abs(state.position - exact[:n]).max() / np.abs(exact[:n]).max()
        velocity = np.abs(state.velocity - exact[n : 2 * n]).max() / np.abs(exact[n : 2 * n]).max()
        message = f"{case} by {method} for {duration:.1e} s: {position:.1e}, {velocity:.1e}"
        assert max(position, velocity) <= ACCURACY, message


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize(
    "damping", [(0.0, 0.0), (0.0, 5e-6), (300.0, 0.0), (1e-3, 0.0), (300.0, 1e-6), "general", "internal"]
)
def test_every_method_agrees_with_the_matrix_exponential_or_is_refused(coupled, damping):
    """Rounding splits the double zero by its root: parts of a sum of modes are 1e8 times as large as it."""
    rng = np.random.default_rng(3)
    for bodies in range(7):
        body = structure(rng, bodies, coupled, damping)
        for duration in (0.2 / body[-1], 3.0 / body[-1]):
            check(f"{bodies} rigid bodies", rng, body, duration)


@pytest.mark.skipif(
    np.finfo(np.longdouble).eps > 1e-18, reason="the reference needs more digits than doubles have"
)
@pytest.mark.parametrize("held", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_bodies_that_weak_dampers_hold_lose_no_digits(seed, held):
    """Modes of a body that slows down at a rate alpha are 1 / (alpha t) times as large as its motion."""
    rng = np.random.default_rng(seed)
    for _ in range(25):
        alpha, beta = 10.0 ** rng.uniform(0.0, 4.0), held * 10.0 ** rng.uniform(-7.0, -4.0)
        bodies = int(rng.integers(7))
        body = structure(rng, bodies, bool(rng.integers(2)), (alpha, beta))
        duration = 0.2 * 10.0 ** rng.uniform(0.0, 3.0) / body[-1]
        check(f"{bodies} rigid bodies, alpha {alpha:.1f}, beta {beta:.1e}", rng, body, duration)


def test_modes_remain_for_a_body_that_is_held():
    """A support 1e-6 times as stiff as the structure is no rigid body."""
    chain = np.diag([1.0, 2.0, 1.0]) - np.eye(3, k=1) - np.eye(3, k=-1)
    scene = ss.Scene(np.eye(3), 1e6 * chain + np.diag([1.0, 0.0, 0.0]), force=[0.0, 0.0, 1.0])
    run = ss.simulate(scene, 0.01, ss.State([1e-3, 0.0, 0.0], [0.0, 0.0, 1.0], ""), method="modal")
    series = ss.simulate(scene, 0.01, ss.State([1e-3, 0.0, 0.0], [0.0, 0.0, 1.0], ""), method="taylor")
    assert np.abs(run.state(0.01).velocity - series.state(0.01).velocity).max() <= ACCURACY


@pytest.mark.parametrize("method", ["modal", "taylor", "auto"])
@pytest.mark.parametrize("amplitude", [0.0, 0.5])
def test_a_damped_body_drifts_to_where_its_momentum_carries_it(method, amplitude):
    """``x'' + c x' = a sin(w t)`` has an eigenvalue zero, of the place at which the body comes to rest."""
    c, w, speed = 0.1, 2.0 * np.pi, 0.3
    load = ss.Harmonic({"x": amplitude}, 1.0, phase=-np.pi / 2.0)
    scene = ss.Scene(
        [1.0, 1.0], np.zeros((2, 2)), c * np.eye(2), dofs=["x", "z"], force=[0.0, -1.0], loads=[load]
    )
    run = ss.simulate(scene, 12.0, ss.State([0.0, 0.5], [speed, 0.0], ""), method=method)
    t = np.linspace(0.0, 12.0, 601)
    decay, part = np.exp(-c * t), amplitude / (c * c + w * w)
    place = speed * (1.0 - decay) / c
    place += part * (c * (1.0 - np.cos(w * t)) / w - np.sin(w * t) + w * (1.0 - decay) / c)
    velocity = speed * decay + part * (c * np.sin(w * t) - w * np.cos(w * t) + w * decay)
    sample = run.sample(t)
    np.testing.assert_allclose(sample.position[:, 0], place, atol=ACCURACY)
    np.testing.assert_allclose(sample.velocity[:, 0], velocity, atol=ACCURACY)
