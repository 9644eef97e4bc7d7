"""A mass that stays sparse, as of consistent finite elements, gives the same answers as a dense one."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse

import stickslip as ss
from quad_block import quad_block

EPS = np.finfo(float).eps


def thrown(scene, columns, rows, speed=0.5):
    """Steady sliding with a velocity along both axes that vanishes at both edges of the block."""
    height = (np.arange(scene.size) // 2 // (columns + 1)) / rows
    return ss.steady_sliding(scene).perturbed(velocity=speed * np.sin(np.pi * height))


def test_it_is_kept_sparse():
    scene = quad_block(6, 3, 2, lumped=False, sparse=True)
    assert scipy.sparse.issparse(scene.mass)
    assert "coupled" in str(scene.summary())
    again = scene.replace(friction=0.1)
    assert (again.mass != scene.mass).nnz == 0
    heavier = scene.replace(mass=2.0 * scene.mass)
    assert heavier.mass.diagonal().tolist() == (2.0 * scene.mass.diagonal()).tolist()


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_the_same_events_as_with_a_dense_mass(restitution):
    """Modes are those of dense matrices; series take sparse factors of the mass here."""
    columns, rows = 14, 7
    options = {"lumped": False, "restitution": restitution}
    sparse = quad_block(columns, rows, 3, sparse=True, **options)
    start = thrown(sparse, columns, rows)
    duration = 1e-4
    taylor = ss.simulate(sparse, duration, start, method="taylor")
    assert taylor.counters["taylor_phases"] == taylor.counters["phases"] > 20
    modal = ss.simulate(quad_block(columns, rows, 3, **options), duration, start, method="modal")
    first = min(60, len(modal.events.time))
    assert first > 30
    assert list(taylor.events.kind[:first]) == list(modal.events.kind[:first])
    assert list(taylor.events.combination[:first]) == list(modal.events.combination[:first])
    # The slowest events meet their zero at some m/s^2 beside accelerations of 1e6.
    assert taylor.events.time[:first] == pytest.approx(modal.events.time[:first], abs=1e-11 * duration)


def test_energy_closes_in_a_block_of_two_thousand_dofs():
    """2000 dofs and 20 contacts: no dense inverse of the mass for each of their combinations."""
    columns, rows = 57, 17
    scene = quad_block(columns, rows, 3, lumped=False, sparse=True)
    assert (scene.size, len(scene.contacts)) == (1972, 20)
    run = ss.simulate(scene, 1e-5, thrown(scene, columns, rows))
    assert run.stop_reason == "duration"
    assert len(run.events.time) > 5
    balance = run.balance()
    terms = [balance.stored, balance.contact, balance.external, balance.damping]
    # Sums over two thousand coordinates.
    assert abs(balance.residual) <= 1e3 * EPS * max(abs(float(np.sum(term))) for term in terms)
    # The motion itself: M x'' + C x' + K x = F + D f in every sample.
    sample = run.sample(np.linspace(0.0, 1e-5, 5))
    assert (sample.normal_force.to_numpy() >= -1e-9 * np.abs(scene.force).max()).all()


def test_steady_sliding_and_modes_are_those_of_the_dense_matrices():
    sparse, dense = (quad_block(10, 5, 2, lumped=False, sparse=kind) for kind in (True, False))
    one, other = ss.steady_sliding(sparse), ss.steady_sliding(dense)
    assert one.position == pytest.approx(other.position, abs=1e-12 * np.abs(other.position).max())
    # Steady sliding over the dofs, by hand: K x - mu K_n' into the tangential rows, gaps held.
    stiffness = scipy.sparse.csr_array(sparse.stiffness).toarray()
    left = stiffness.copy()
    force = sparse.force.copy()
    for contact in sparse.contacts:
        left[contact.tangential] -= contact.friction * stiffness[contact.normal]
        force[contact.tangential] -= contact.friction * force[contact.normal]
    free = np.setdiff1d(np.arange(sparse.size), [contact.normal for contact in sparse.contacts])
    position = np.zeros(sparse.size)
    position[free] = scipy.linalg.solve(left[np.ix_(free, free)], force[free])
    assert one.position == pytest.approx(position, abs=1e-10 * np.abs(position).max())
    found, expected = (ss.complex_modes(scene).eigenvalues for scene in (sparse, dense))
    assert found == pytest.approx(expected, rel=1e-9)


def test_ten_thousand_dofs_stay_small():
    """Their dense mass alone would take 800 MB, its inverse as much again."""
    size = 10_000
    beam = scipy.sparse.diags_array(
        [np.ones(size - 1), 4.0 * np.ones(size), np.ones(size - 1)], offsets=[-1, 0, 1]
    )
    springs = scipy.sparse.diags_array(
        [-np.ones(size - 1), 2.0 * np.ones(size), -np.ones(size - 1)], offsets=[-1, 0, 1]
    )
    force = np.zeros(size)
    force[1] = -1.0
    contact = ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=1.0)
    scene = ss.Scene(beam, springs, force=force, contacts=[contact], impact_friction=True)
    run = ss.simulate(scene, 1.0, ss.steady_sliding(scene).perturbed(velocity={0: 0.1}))
    assert run.stop_reason == "duration"
    assert abs(run.balance().residual) <= 1e3 * EPS * abs(run.balance().stored)


@pytest.mark.parametrize(
    ("mass", "message"),
    [
        ([[1.0, 2.0], [2.0, 1.0]], "mass: must be positive definite, it is not at dof [01]"),
        ([[1.0, 1.0], [1.0, 1.0]], "mass: must be positive definite, it is not at dof [01]"),
        ([[1.0, 0.1], [0.1, -2.0]], "mass: must be positive definite, got -2 as pivot of dof 1"),
        ([[1.0, 0.1], [0.2, 1.0]], "mass: must be symmetric"),
        ([[1.0, np.nan], [np.nan, 1.0]], "mass.*finite"),
    ],
)
def test_ill_posed_masses_are_refused(mass, message):
    with pytest.raises(ss.InputError, match=message):
        ss.Scene(scipy.sparse.csr_array(mass), np.eye(2))
    with pytest.raises(ss.InputError, match="mass: expected a square matrix"):
        ss.Scene(scipy.sparse.csr_array(np.ones((2, 3))), np.eye(2))


def test_files_keep_it_sparse(tmp_path):
    scene = quad_block(6, 3, 2, lumped=False, sparse=True)
    ss.save(scene, tmp_path / "block.toml")
    again = ss.load(tmp_path / "block.toml").scene
    assert scipy.sparse.issparse(again.mass)
    assert (again.mass != scene.mass).nnz == 0
