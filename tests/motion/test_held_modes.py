"""Series of dense scenes in the modes of the structure with held contacts, beside other ways."""

import pickle

import numpy as np
import pytest

import stickslip as ss
from nightly import nightly
from scene_forms import compare_motions, in_matrices

#: s, of the damping.
BETA = 2e-6


def dense_scene(seed, *, lumped=False, beside=False):
    """Return a scene of 60 dofs with dense matrices and contacts along directions of several dofs each.

    Beside them it may have a stop, and friction under a given normal force.
    """
    rng = np.random.default_rng(seed)
    size, contacts = 60, int(rng.integers(2, 5))
    turn = np.linalg.qr(rng.standard_normal((size, size)))[0]
    stiffness = turn * np.geomspace(1e4, 1e8, size) @ turn.T
    mass = np.exp(rng.uniform(-1.0, 1.0, size))
    directions = np.zeros((2 * contacts + 2, size))
    for row, dofs in zip(directions, rng.permutation(size)[: 6 * contacts + 6].reshape(-1, 3), strict=True):
        row[dofs] = rng.standard_normal(3)
    *directions, along, across = directions
    further = [
        ss.Contact(tangential=along, normal_force=20.0, friction=0.3, slider_speed=0.1),
        ss.Contact(normal=across, gap=1e-5, restitution=0.3),
    ]
    if not lumped:
        mixed = rng.standard_normal((size, size)) / size
        mass = np.diag(mass) + mixed @ mixed.T
    return ss.Scene(
        mass,
        0.5 * (stiffness + stiffness.T),
        damping=ss.Rayleigh(mass=5.0, stiffness=BETA),
        force=-np.transpose(directions[1::2]) @ rng.uniform(50.0, 100.0, contacts),
        contacts=[
            ss.Contact(
                tangential=directions[2 * k],
                normal=directions[2 * k + 1],
                friction=0.4,
                static_friction=[0.4, 0.6][k % 2],
                slider_speed=[0.1, -0.2][k % 2],
                restitution=0.5 * (k % 2),
            )
            for k in range(contacts)
        ]
        + beside * further,
        impact_friction=True,
    )


def pushed(scene, seed):
    """Return steady sliding, with slip velocities disturbed."""
    rng = np.random.default_rng(seed)
    start = ss.steady_sliding(scene)
    rubbing = [one for one in scene.contacts if one.tangential is not None]
    rows = [one.tangential for one in rubbing] + [
        one.normal for one in scene.contacts if one.normal is not None
    ]
    change = np.zeros(len(rows))
    speeds = np.array([one.slider_speed for one in rubbing])
    change[: len(speeds)] = rng.uniform(0.0, 0.9, len(speeds)) * speeds
    velocity = np.linalg.lstsq(rows, change, rcond=None)[0]
    return start.perturbed(velocity=dict(zip(scene.dofs, velocity, strict=True)))


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("lumped", [False, True])
@pytest.mark.parametrize("seed", nightly([0, 1, 2, 4, 7, 8, 9], lambda seed: seed in (0, 1, 4, 8)))
def test_the_same_events_as_of_dense_matrices(seed, lumped, beside):
    scene = dense_scene(seed, lumped=lumped, beside=beside)
    start = pushed(scene, seed)
    bounds = {"time_error": 1e-10, "sample_error": 1e-8, "near_share": 0.98}
    assert compare_motions(scene, in_matrices(scene), start, events=60, **bounds) >= 20


def test_panels_are_as_long_as_those_of_dense_matrices():
    scene = dense_scene(0)
    start = pushed(scene, 0)
    runs = [ss.simulate(which, 0.02, start, method="taylor") for which in (scene, in_matrices(scene))]
    assert runs[0].counters["taylor_phases"] == runs[1].counters["taylor_phases"]
    assert abs(runs[0].counters["panels"] - runs[1].counters["panels"]) <= 0.02 * runs[1].counters["panels"]


def test_a_motion_is_restored_to_the_last_bit():
    scene = dense_scene(1)
    run = ss.simulate(scene, 1.0, pushed(scene, 1), method="taylor", max_events=20)
    again = pickle.loads(pickle.dumps(run))
    times = np.linspace(0.0, run.duration, 50)
    for quantity in ("position", "velocity"):
        np.testing.assert_array_equal(again.sample(times)[quantity], run.sample(times)[quantity])


def test_friction_under_a_given_force_holds_its_balance_beside_modes():
    """A reduced model with its contact pressed on: steady sliding goes on, `K x = mu N t`."""
    size = 30
    stiffness = np.diag(np.geomspace(1e4, 1e6, size))
    stiffness[0, 1:] = stiffness[1:, 0] = -3e3
    stiffness[0, 0] = 1e6
    contact = ss.Contact(tangential=0, normal_force=20.0, friction=0.3, slider_speed=0.1)
    scene = ss.Scene(np.ones(size), stiffness, damping=ss.Rayleigh(stiffness=1e-6), contacts=[contact])
    steady = np.linalg.solve(stiffness, 6.0 * np.eye(size)[0])
    run = ss.simulate(scene, 0.05, ss.steady_sliding(scene), method="taylor")
    position = run.sample(np.linspace(0.0, 0.05, 20)).position.to_numpy()
    np.testing.assert_allclose(position, np.tile(steady, (20, 1)), rtol=0, atol=1e-14 * np.abs(steady).max())
