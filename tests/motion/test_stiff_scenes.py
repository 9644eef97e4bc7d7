"""Time constants from a microsecond to a thousand seconds in one scene."""

import mpmath as mp
import numpy as np
import pytest

import stickslip as ss
from one_mass import MASS

#: Free coordinates in sliding.
MOVING = [0, 2, 3]


def stiff_scene(slider_speed=0.1):
    """A belt oscillator tied to a creeping mass, c / k = 1e3 s, and to a fast dashpot, m / c = 1e-6 s."""
    stiffness = np.diag([3e4, 5e4, 1.0, 1e4])
    for i, j, spring in [(0, 2, 0.3), (0, 3, 5e3)]:
        stiffness[np.ix_([i, j], [i, j])] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    contact = ss.Contact(tangential=0, normal=1, friction=0.3, static_friction=0.6, slider_speed=slider_speed)
    return ss.Scene(
        [MASS, MASS, 1.0, 1e-3],
        stiffness,
        damping=np.diag([0.5, 0.5, 1.3e3, 1e3]),
        force=[0.0, -20.0, 1.0, 0.0],
        contacts=[contact],
    )


STUCK = ss.State(np.zeros(4), [0.1, 0.0, 0.0, 0.0], "s")


def test_a_fast_dashpot_makes_no_mode_ill_conditioned():
    """Each mode in its own scale of velocity against position: condition near 1, whatever the others are."""
    modes = ss.complex_modes(stiff_scene(), "+")
    rates = np.abs(modes.eigenvalues)
    assert rates.max() > 0.9e6
    assert rates.min() < 1.1e-3
    assert modes.condition.max() < 10.0
    assert not modes.defective.any()


def test_work_goes_by_the_events_and_not_by_the_fastest_mode():
    scene = stiff_scene()
    run = ss.simulate(scene, 2.0, STUCK)
    assert run.stop_reason == "duration"
    assert run.counters["taylor_phases"] == 0
    assert run.counters["panels"] < 30 * len(run.events)
    # The same events by short steps, as far as these reach in bearable time.
    short = ss.simulate(scene, 0.05, STUCK, method="taylor")
    n = len(short.events)
    assert n >= 3
    assert np.array_equal(run.events.combination[:n], short.events.combination)
    assert np.abs(run.events.time[:n] - short.events.time).max() <= 1e-12


def sliding(scene):
    """The state matrix of positive sliding, T = +mu N, and the forces, as (x, x', 1)' = A (x, x', 1)."""
    friction, size = mp.mpf(scene.contacts[0].friction), len(MOVING)

    def row(matrix, i):
        merged = [mp.mpf(float(entry)) for entry in matrix[i]]
        if i == 0:
            merged = [a - friction * mp.mpf(float(b)) for a, b in zip(merged, matrix[1], strict=True)]
        return merged

    system = mp.zeros(2 * size + 1)
    for k, i in enumerate(MOVING):
        mass = mp.mpf(float(scene.mass[i]))
        system[k, size + k] = 1
        for matrix, block in ((scene.stiffness, 0), (scene.damping, size)):
            for j, entry in enumerate(row(matrix, i)[n] for n in MOVING):
                system[size + k, block + j] = -entry / mass
        system[size + k, 2 * size] = row(scene.force[:, None], i)[0] / mass
    return system


def exponential(matrix):
    squarings = 36
    scaled = matrix / mp.mpf(2) ** squarings
    term = total = mp.eye(matrix.rows)
    for k in range(1, 45):
        term = term * scaled / k
        total = total + term
    for _ in range(squarings):
        total = total * total
    return total


@pytest.mark.parametrize("duration", [1e-6, 1e-3, 0.05, 2.0, 500.0])
def test_every_time_scale_against_the_matrix_exponential(duration):
    """Every coordinate to its own digits, 60 digits for comparison; the belt runs away, so nothing sticks."""
    scene = stiff_scene(slider_speed=1e4)
    start = ss.State(np.zeros(4), [0.1, 0.0, 0.0, 0.2], "+")
    run = ss.simulate(scene, duration, start)
    assert len(run.events) == 0
    assert run.counters["panels"] <= 5
    end = run.state(duration)
    got = np.concatenate([end.position[MOVING], end.velocity[MOVING]])
    with mp.workdps(60):
        begin = [start.position[i] for i in MOVING] + [start.velocity[i] for i in MOVING]
        exact = exponential(sliding(scene) * mp.mpf(duration)) * mp.matrix([*map(mp.mpf, begin), 1])
        error = [abs(mp.mpf(float(g)) - x) / abs(x) for g, x in zip(got, exact, strict=False)]
    # In a microsecond the creeping mass has hardly moved: most of its modes cancels.
    assert max(error) < 1e-12 * max(1.0, 4e-6 / duration)
