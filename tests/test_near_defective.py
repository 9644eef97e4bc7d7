"""Accuracy beside the defective points of the reference model, where modal superposition loses all digits.

With C = beta K two modes of the damped system coalesce where those of the undamped one do. Reference is the
exponential of the state matrix in 60 digits.
"""

import mpmath as mp
import numpy as np
import pytest

import stickslip as ss

#: s
DURATION = 0.1
BETA = 1e-4
DISTANCES = [1.0, *10.0 ** -np.arange(2.0, 17.0, 2.0)]
#: Lowest natural frequency, 1/s.
LOWEST = 2 * np.pi * 44.0
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
    """Scaling, Taylor series, squaring; object arrays multiply faster than mpmath's own matrices."""
    squarings = 12
    scaled = matrix / mp.mpf(2) ** squarings
    term = total = exact(np.eye(matrix.shape[0]))
    for k in range(1, 60):
        term = term.dot(scaled) / k
        total = total + term
        if max(abs(term).ravel()) < mp.mpf(10) ** -55:
            break
    for _ in range(squarings):
        total = total.dot(total)
    return total


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
    start = ss.sliding_equilibrium(scene).perturbed(velocity={"x1": 1e-4})
    moving = [0, 1, 2, 4, 5, 6]
    x, v = exact_state(friction, start.position[moving], start.velocity[moving])
    for method in ("auto", "taylor"):
        run = ss.simulate(scene, start, DURATION, method=method)
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
        run = ss.simulate(scene, ss.sliding_equilibrium(scene), 1e-3)
        used.append(run.counters["taylor_phases"])
    assert used == sorted(used)
    assert used[0] == 0
    assert used[-1] == 1
