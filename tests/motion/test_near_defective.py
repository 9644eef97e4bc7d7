"""Accuracy beside the defective points of the reference model, where modal superposition loses all digits.

With C = beta K two modes of the damped system coalesce where those of the undamped one do. Reference is the
exponential of the state matrix in 60 digits.
"""

import itertools

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import stickslip as ss

#: s
DURATION = 0.1
BETA = 1e-4
DISTANCES = [1.0, *10.0 ** -np.arange(2.0, 17.0, 2.0)]
#: Lowest natural frequency, 1/s.
LOWEST = 2 * np.pi * 44.0
#: Of the reference: 60 digits, and 20 for squaring and growth.
BITS = 266
#: So fast that no contact comes near sticking.
SLIDER_SPEED = 1e3


def scene_at(friction):
    return ss.models.two_subsystems(friction=friction, slider_speed=SLIDER_SPEED, damping=BETA)


@pytest.fixture(scope="module", autouse=True)
def digits():
    with mp.workdps(60):
        yield


def exact(array):
    return np.array([mp.mpf(float(x)) for x in np.ravel(array)], dtype=object).reshape(np.shape(array))


def sliding(friction):
    """M, K and F of the six coordinates that move, both contacts in positive sliding: T = +mu N."""
    scene = scene_at(0.5)
    mass, stiffness, force = exact(scene.mass), exact(scene.stiffness.toarray()), exact(scene.force)
    for t, n in ((2, 3), (6, 7)):
        stiffness[t] = stiffness[t] - friction * stiffness[n]
        force[t] = force[t] - friction * force[n]
    moving = [0, 1, 2, 4, 5, 6]
    return mass[moving], stiffness[np.ix_(moving, moving)], force[moving]


def defective_friction(near):
    """Where (kappa_1 - kappa_2)^2 of the closest pair of eigenvalues of M^-1 K, which is smooth, vanishes."""

    def gap(friction):
        mass, stiffness, _ = sliding(friction)
        matrix = mp.matrix((stiffness / mass[:, None]).tolist())
        kappa = mp.eig(matrix, left=False, right=False)
        pairs = [(a - b) ** 2 for i, a in enumerate(kappa) for b in kappa[:i]]
        return mp.re(min(pairs, key=abs))

    return mp.findroot(gap, (mp.mpf(near), mp.mpf(near) + mp.mpf("1e-9")), tol=1e-60)


def exponential(matrix):
    """Scaling, Taylor series, squaring; integers in units of 2^-BITS multiply faster than mpmath."""
    squarings = 20
    units = [int(mp.floor(mp.ldexp(x, BITS - squarings))) for x in np.ravel(matrix)]
    scaled = np.array(units, dtype=object).reshape(matrix.shape)
    term = total = np.array(
        [[int(i == j) << BITS for j in range(len(matrix))] for i in range(len(matrix))], dtype=object
    )
    for k in itertools.count(1):
        term = (term.dot(scaled) >> BITS) // k
        # Down to the rounding of the powers.
        if max(abs(term).ravel()) < 1 << squarings:
            break
        total = total + term
    for _ in range(squarings):
        total = total.dot(total) >> BITS
    return np.array([mp.ldexp(x, -BITS) for x in np.ravel(total)], dtype=object).reshape(matrix.shape)


def exact_state(friction, position, velocity):
    """x and x' of the moving coordinates after DURATION from the start."""
    mass, stiffness, force = sliding(mp.mpf(friction))
    m = mass.size
    generator = exact(np.zeros((2 * m + 1, 2 * m + 1)))
    generator[:m, m : 2 * m] = exact(np.eye(m))
    generator[m : 2 * m, :m] = -stiffness / mass[:, None]
    generator[m : 2 * m, m : 2 * m] = -mp.mpf(BETA) * stiffness / mass[:, None]
    generator[m : 2 * m, 2 * m] = force / mass
    # Velocities in units of a high frequency balance the blocks.
    unit = np.concatenate([exact(np.ones(m)), exact(np.full(m, 2.0**13)), exact(np.ones(1))])
    balanced = generator * unit[None, :] / unit[:, None] * mp.mpf(DURATION)
    start = np.concatenate([exact(position), exact(velocity), exact(np.ones(1))])
    end = (exponential(balanced).dot(start / unit) * unit).astype(float)
    return end[:m], end[m : 2 * m]


@pytest.fixture(
    scope="module", params=[("0.612484152848669", 1), ("1.989108991216879", -1)], ids=["first", "second"]
)
def point(request, digits):
    near, side = request.param
    return defective_friction(near), side


@pytest.mark.parametrize("distance", DISTANCES)
def test_accuracy_does_not_depend_on_the_distance_to_a_defective_point(point, distance):
    defective, side = point
    friction = float(defective + side * mp.mpf(distance))
    # The spacing of floats is all that the nearest one can miss.
    assert abs(abs(mp.mpf(friction) - defective) - distance) <= np.spacing(friction)
    scene = scene_at(friction)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-4})
    moving = [0, 1, 2, 4, 5, 6]
    x, v = exact_state(friction, start.position[moving], start.velocity[moving])
    for method in ("auto", "taylor"):
        run = ss.simulate(scene, DURATION, start, method=method)
        assert len(run.events) == 0
        end = run.state(DURATION)
        assert np.abs(end.position[moving] - x).max() <= 1e-12 * np.abs(x).max()
        # The vibration has decayed below the equilibrium, whose rounding moves at the lowest frequency.
        speed = max(np.abs(v).max(), LOWEST * np.abs(x).max())
        assert np.abs(end.velocity[moving] - v).max() <= 1e-12 * speed


def test_modes_are_used_far_away_and_left_close_by(point):
    """What the test above compares are two ways of propagation, not one."""
    defective, side = point
    used = []
    for distance in DISTANCES:
        scene = scene_at(float(defective + side * mp.mpf(distance)))
        run = ss.simulate(scene, 1e-3, ss.steady_sliding(scene))
        used.append(run.counters["taylor_phases"])
    assert used == sorted(used)
    assert used[0] == 0
    assert used[-1] == 1


@pytest.mark.slow
@given(
    exponent=st.floats(-16.0, 0.0),
    side=st.sampled_from([-1, 1]),
    shape=st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12),
)
def test_errors_are_a_part_of_the_motion_at_any_distance(point, exponent, side, shape):
    """Not of the static displacement, which is 1e4 times larger."""
    defective, _ = point
    friction = float(defective + side * mp.mpf(10) ** exponent)
    assume(friction > 0.0)
    scene = scene_at(friction)
    rest = ss.steady_sliding(scene)
    moving = [0, 1, 2, 4, 5, 6]
    static = np.abs(rest.position).max()
    position, velocity = rest.position.copy(), rest.velocity.copy()
    position[moving] += 1e-4 * static * np.array(shape[:6])
    velocity[moving] += 1e-4 * static * LOWEST * np.array(shape[6:])
    start = ss.State(position, velocity, rest.combination)
    runs = {method: ss.simulate(scene, DURATION, start, method=method) for method in ("auto", "taylor")}
    # Far above the second point the motion grows until contacts are lost.
    still = {method: len(run.events) == 0 for method, run in runs.items()}
    assert still["auto"] == still["taylor"]
    assume(still["auto"])
    x, v = exact_state(friction, position[moving], velocity[moving])
    ends = {method: run.state(DURATION) for method, run in runs.items()}
    of_position = {method: np.abs(end.position[moving] - x).max() for method, end in ends.items()}
    of_velocity = {method: np.abs(end.velocity[moving] - v).max() for method, end in ends.items()}
    eps = np.finfo(float).eps
    size, speed = np.abs(x).max(), max(np.abs(v).max(), LOWEST * np.abs(x).max())
    assert of_position["auto"] <= max(3 * of_position["taylor"], 10 * eps * size)
    assert of_velocity["auto"] <= max(3 * of_velocity["taylor"], 10 * eps * speed)
    # The start may be close to rest, and the end to the start: what moves in between is as large as either.
    motion = max(np.abs(x - position[moving]).max(), np.abs(v).max() / LOWEST)
    for method in ("auto", "taylor"):
        # The displacement itself is known to the spacing of the positions that hold it.
        assert of_position[method] <= 1e-10 * motion + np.spacing(size)
        assert of_velocity[method] <= 1e-10 * LOWEST * motion
