"""Rest and modes of large scenes have coordinates of their own: beside those of motions, and multipliers."""

import numpy as np
import pytest
import scipy.sparse

import stickslip as ss

SIZE, CONTACTS = 520, 5


@pytest.fixture(scope="module")
def grid():
    """A chain with stiff neighbours, a mass that is not diagonal, and contacts over several dofs each."""
    rng = np.random.default_rng(5)
    second = scipy.sparse.diags_array([-1.0, 2.02, -1.0], offsets=[-1, 0, 1], shape=(SIZE, SIZE))
    mass = scipy.sparse.diags_array([0.1, 1.0, 0.1], offsets=[-1, 0, 1], shape=(SIZE, SIZE))
    contacts = []
    for k in range(CONTACTS):
        near = 100 * k + 10 + np.arange(6)
        weights = rng.uniform(0.2, 1.0, 6)
        contacts.append(
            ss.Contact(
                tangential={int(dof): float(w) for dof, w in zip(near[:3], weights[:3], strict=True)},
                normal={int(dof): float(w) for dof, w in zip(near[3:], weights[3:], strict=True)},
                friction=0.1 + 0.1 * k,
                slider_speed=1.0,
                gap=0.0 if k else -1e-3,
            )
        )
    force = np.zeros(SIZE)
    force[[100 * k + 14 for k in range(CONTACTS)]] = -50.0
    return ss.Scene(
        mass.tocsr(),
        1e4 * second.tocsr(),
        damping=ss.Rayleigh(1.0, 1e-5),
        force=force,
        contacts=contacts,
        impact_friction=True,
    )


def test_rest_closes_the_gaps_and_balances_the_loads(grid):
    rest = ss.steady_sliding(grid)
    assert rest.combination == "+" * CONTACTS
    normal = np.array([grid.normal_direction(k) for k in range(CONTACTS)])
    tangential = np.array([grid.tangential_direction(k) for k in range(CONTACTS)])
    friction = np.array([contact.friction for contact in grid.contacts])
    gaps = np.array([contact.gap for contact in grid.contacts])
    forces = normal + friction[:, None] * tangential
    stiffness = grid.stiffness.toarray()
    matrix = np.block([[stiffness, -forces.T], [normal, np.zeros((CONTACTS, CONTACTS))]])
    expected = np.linalg.solve(matrix, np.concatenate([grid.force, -gaps]))
    np.testing.assert_allclose(rest.position, expected[:SIZE], atol=1e-11 * np.abs(expected[:SIZE]).max())
    np.testing.assert_allclose(rest.normal_forces, expected[SIZE:], rtol=1e-9)
    assert np.abs(normal @ rest.position + gaps).max() < 1e-15


def test_modes_of_a_band_are_those_in_the_coordinates_of_motions(grid):
    every = ss.complex_modes(grid)
    band = ss.complex_modes(grid, band=(5.0, 9.0))
    assert round(band.missing) == 0
    frequency = np.abs(every.eigenvalues.imag) / (2.0 * np.pi)
    inside = np.flatnonzero((frequency > 5.0) & (frequency < 9.0))
    assert len(band) == inside.size > 10
    order = np.argsort(band.eigenvalues.imag)
    expected = inside[np.argsort(every.eigenvalues[inside].imag)]
    np.testing.assert_allclose(band.eigenvalues[order], every.eigenvalues[expected], rtol=1e-11)
    # Conditions are in the norm of the mass; here the normal parts of left vectors count, too.
    np.testing.assert_allclose(band.condition[order], every.condition[expected], rtol=1e-2)


def test_motions_begin_where_rest_is(grid):
    rest = ss.steady_sliding(grid)
    run = ss.simulate(grid, 0.01, rest)
    assert len(run.events) == 0
    moved = np.abs(run.state(0.01).position - rest.position).max()
    assert moved < 1e-12 * np.abs(rest.position).max()
