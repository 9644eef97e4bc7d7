"""Reduced models against full ones: eigenvalues, equilibria, matrices carried along, the way back."""

import dataclasses
import re

import numpy as np
import pytest
import scipy.sparse

import stickslip as ss
from block_cycles import lumped_block, on_belt, pulse, reduced_block
from meshed import plate
from stickslip.fe.reduced.agreement import LOST, compared
from stickslip.fe.reduced.contact_coordinates import contact_directions
from stickslip.fe.reduced.craig_bampton import CraigBampton
from stickslip.fe.reduced.lowest_modes import LowestModes
from stickslip.fe.reduced.reduction import reduced_scene


@pytest.fixture(scope="module")
def small():
    """A block of 60 dofs with 6 contacts, a force inside it, and all its interior modes."""
    scene = on_belt(5, 5)
    return scene.replace(force=_force(scene, {"20.1": 3.0, "21.2": -5.0}))


def _force(scene, forces):
    vector = np.zeros(scene.size)
    for dof, value in forces.items():
        vector[scene.dofs.index(dof)] = value
    return vector


ALL = (100.0, 3e5)


def eigenvalues(scene, combination="++++++"):
    return ss.complex_modes(scene, combination).eigenvalues


def nearest(wanted, offered):
    """Return the largest relative distance from wanted eigenvalues to the nearest offered one."""
    return max(np.abs(offered - value).min() / abs(value) for value in wanted)


def distances(reduced):
    """Return relative distances of the eigenvalues of the full scene to those that stand for them."""
    full, few = (reduced.errors[name].to_numpy() for name in ("full", "reduced"))
    return np.where(np.isnan(few), np.inf, np.abs(few - full) / np.abs(full))


@pytest.mark.filterwarnings("ignore:reduced scene")
def test_with_every_mode_nothing_is_lost(small):
    every = small.size - 12 - 1
    reduced = ss.fe.reduce(small, ALL, "consistent", modes=every)
    # One mode short of all: what is missing is the highest one.
    assert reduced.scene.size == small.size - 1
    full = eigenvalues(small)
    assert nearest(full[: full.size // 2], eigenvalues(reduced.scene)) < 1e-4
    table = reduced.errors
    assert table.sizes["mode"] == ((np.abs(full) > 200 * np.pi) & (np.abs(full) < 6e5 * np.pi)).sum()
    assert nearest(table.full.to_numpy(), full) < 1e-9
    assert nearest(table.reduced.to_numpy(), eigenvalues(reduced.scene)) < 1e-9


@pytest.mark.filterwarnings("ignore:reduced scene")
@pytest.mark.parametrize("boundary", ["lumped", "consistent", "massless"])
def test_steady_sliding_is_exact_with_few_modes(small, boundary):
    """Contact coordinates and the offset carry the static response, whatever the modes."""
    reduced = ss.fe.reduce(small, (100.0, 40e3), boundary, modes=3)
    full, few = ss.steady_sliding(small), ss.steady_sliding(reduced.scene)
    scale = np.abs(full.position).max()
    np.testing.assert_allclose(reduced.expand(few).position, full.position, rtol=0, atol=1e-12 * scale)
    one, other = (state.contact_forces(scene) for state, scene in ((full, small), (few, reduced.scene)))
    np.testing.assert_allclose(other.normal_force, one.normal_force, rtol=1e-9)
    np.testing.assert_allclose(other.friction_force, one.friction_force, rtol=1e-9)


@pytest.mark.filterwarnings("ignore:reduced scene")
@pytest.mark.parametrize("boundary", ["lumped", "consistent", "massless"])
def test_gyroscopic_circulatory_and_damping_matrices_are_carried_along(small, boundary):
    rng = np.random.default_rng(3)
    skew = scipy.sparse.random_array((small.size, small.size), density=0.05, rng=rng).tocsr()
    damping = (1e-7 * small.stiffness).tolil()
    damping[3, 3] += 1.0
    general = small.replace(
        gyroscopic=5.0 * (skew - skew.T),
        circulatory=None if boundary == "massless" else 1e6 * skew,
        damping=damping.tocsr(),
    )
    reduced = ss.fe.reduce(general, (100.0, 150e3), boundary, modes=40)
    # The basis holds all but the highest shapes; this coarse mesh has a coarse boundary.
    error = distances(reduced).max()
    assert error < (3e-3 if boundary == "consistent" else 5e-2)
    full, few = eigenvalues(general), eigenvalues(reduced.scene)
    low = full[(np.abs(full) > 200 * np.pi) & (np.abs(full) < 3e5 * np.pi)]
    if boundary == "massless":
        # Told is the distance of pairs, each used once, where errors are as large as distances.
        assert nearest(low, few) <= error * (1.0 + 1e-3)
    else:
        assert nearest(low, few) == pytest.approx(error, rel=1e-3)
    # Without them other eigenvalues come out: they count.
    plain = eigenvalues(reduced.scene.replace(gyroscopic=None, circulatory=None))
    if boundary == "consistent":
        assert nearest(low, plain) > 3.0 * error


def test_the_way_there_and_back(small):
    reduced = ss.fe.reduce(small, (100.0, 60e3), modes=20)
    rng = np.random.default_rng(5)
    moved = ss.State(1e-6 * rng.random(32), rng.random(32), "ssssdd", reduced.scene.dofs)
    back = reduced.project(reduced.expand(moved))
    np.testing.assert_allclose(
        back.position, moved.position, rtol=0, atol=1e-12 * np.abs(moved.position).max()
    )
    np.testing.assert_allclose(back.velocity, moved.velocity, rtol=0, atol=1e-10)
    assert back.combination == "ssssdd"
    # Of any state, gaps and slip velocities stay.
    state = ss.State(rng.random(small.size), rng.random(small.size), "++++++", small.dofs)
    few = reduced.project(state)
    for k in range(6):
        for way in ("normal_direction", "tangential_direction"):
            full, kept = getattr(small, way)(k), getattr(reduced.scene, way)(k)
            assert kept @ few.position == pytest.approx(full @ state.position, rel=1e-9, abs=1e-12)
            assert kept @ few.velocity == pytest.approx(full @ state.velocity, rel=1e-9, abs=1e-12)


def test_motions_and_modes_on_the_full_dofs(small):
    reduced = ss.fe.reduce(small, (100.0, 60e3), modes=20)
    start = ss.steady_sliding(reduced.scene).perturbed(velocity={"q0": 1e-4})
    run = ss.simulate(reduced.scene, 1e-5, start)
    sampled = run.sample([0.0, 3e-6])
    whole = reduced.expand(sampled)
    assert whole.position.dims == ("time", "dof")
    assert list(whole.dof.values) == list(small.dofs)
    np.testing.assert_array_equal(whole.normal_force, sampled.normal_force)
    expanded = reduced.expand(run.state(3e-6))
    np.testing.assert_allclose(whole.position[1], expanded.position, rtol=0, atol=1e-18)
    np.testing.assert_allclose(whole.velocity[1], expanded.velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(reduced.expand(sampled.position.to_numpy()), whole.position, atol=1e-20)
    modes = ss.complex_modes(reduced.scene)
    shapes = reduced.expand(modes)
    full = ss.complex_modes(small)
    # The lowest mode of both: parallel.
    one, other = shapes.shape[0].to_numpy(), full.shapes[:, 0]
    assert abs(np.vdot(one, other)) / np.linalg.norm(one) / np.linalg.norm(other) > 1 - 1e-3
    with pytest.raises(ss.InputError, match="motion: expected 32 dofs of the reduced scene"):
        reduced.expand(np.zeros(31))
    with pytest.raises(ss.InputError, match="state: expected a State of 60 dofs"):
        reduced.project(start)


def test_modes_are_added_until_the_tolerance_is_met(small):
    loose = ss.fe.reduce(small, (100.0, 60e3), "consistent", tolerance=1e-2)
    tight = ss.fe.reduce(small, (100.0, 60e3), "consistent", tolerance=1e-4)
    assert loose.frequencies.size < tight.frequencies.size < 47
    assert tight.errors.frequency_error.max() <= 1e-4
    assert loose.errors.frequency_error.max() <= 1e-2
    with pytest.raises(ss.InputError, match="tolerance: 1e-06 is not reached with a lumped boundary"):
        ss.fe.reduce(small, (100.0, 60e3), "lumped", tolerance=1e-6)


def test_a_lumped_boundary_couples_no_contacts(small):
    lumped = ss.fe.reduce(small, (100.0, 60e3), "lumped", modes=20)
    assert lumped.scene.mass.ndim == 1
    assert "tangential by row sums, normal by row sums" in repr(lumped)
    consistent = ss.fe.reduce(small, (100.0, 60e3), "consistent", modes=20)
    assert consistent.scene.mass.shape == (32, 32)
    # Row sums keep the inertia of all contacts that move together, which the modes leave there.
    together = np.arange(12) % 2 == 0
    left = consistent.scene.mass[:12, :12]
    assert lumped.scene.mass[:12][together].sum() == pytest.approx(left[np.ix_(together, together)].sum())


@pytest.mark.filterwarnings("ignore:reduced scene")
def test_a_massless_boundary_is_exact_at_rest_and_knows_no_impacts(small):
    """Its modes are those of the free structure, its flexibility that of all other modes."""
    reduced = ss.fe.reduce(small, (100.0, 60e3), "massless", modes=20)
    scene = reduced.scene
    assert not scene.mass[:12].any()
    free = ss.complex_modes(small.replace(damping=None), "dddddd").eigenvalues
    expected = free.imag[free.imag > 0.0][:20] / (2.0 * np.pi)
    np.testing.assert_allclose(reduced.frequencies[:20], expected, rtol=1e-9)
    # Further ones as long as they leave every direction a flexibility.
    assert 0 < reduced.frequencies.size - 20 < 12
    # Any forces at the contacts displace them as in the full scene.
    forces = np.arange(1.0, 13.0)
    whole = scipy.sparse.linalg.spsolve(scipy.sparse.csc_array(small.stiffness), reduced.dual[:12].T @ forces)
    few = np.linalg.solve(scene.stiffness, np.r_[forces, np.zeros(scene.size - 12)])
    np.testing.assert_allclose(reduced.basis @ few, whole, rtol=0, atol=1e-11 * np.abs(whole).max())
    start = ss.steady_sliding(scene).perturbed(velocity={"q0": 1e-2})
    run = ss.simulate(scene, 1e-3, start)
    assert {"release", "closing"} <= set(run.events.kind)
    assert not {"impact"} & set(run.events.kind)
    balance = run.balance()
    assert abs(balance.residual) < 1e-12 * (abs(balance.contact) + abs(balance.damping))
    # With more modes it comes nearer.
    errors = [
        distances(ss.fe.reduce(small, (100.0, 60e3), "massless", modes=modes)).max() for modes in (10, 20, 40)
    ]
    assert errors[0] > errors[1] > errors[2]
    assert errors[1] < 2e-2


def test_a_massless_boundary_has_the_inertia_of_the_modes_left_out():
    """At the contacts, ``B' (K - w^2 M)^-1 B`` has an error of order w^6; without further modes, of w^2."""
    full = lumped_block(8, 4, 4, "massless")
    reduced = ss.fe.reduce(full, (1e3, 60e3), "massless", combination="+++", modes=10)
    scene = reduced.scene
    # Six contact directions, ten modes, and a further one per direction.
    assert scene.size == 22
    assert (np.diff(reduced.frequencies) > 0.0).all()
    identity = reduced.dual @ reduced.basis
    np.testing.assert_allclose(identity, np.eye(22), rtol=0, atol=1e-11)
    directions = contact_directions(full)[1]
    stiffness, mass = scipy.sparse.csc_array(full.stiffness), scipy.sparse.diags_array(full.mass)
    errors = []
    for frequency in (5e3, 10e3):
        square = (2.0 * np.pi * frequency) ** 2
        exact = directions.T @ scipy.sparse.linalg.spsolve(stiffness - square * mass, directions.toarray())
        few = np.linalg.inv(scene.stiffness - square * np.diag(scene.mass))[:6, :6]
        errors.append(np.abs(exact - few).max())
    # 64, and a little more by the next term.
    assert 62.0 < errors[1] / errors[0] < 80.0


def test_modes_of_which_all_mass_is_at_the_contacts_have_no_further_ones():
    """Two masses on walls and one on a belt, which moves its contact alone."""
    body = ss.fe.Body(np.ones(3), np.diag([100.0, 900.0, 1600.0]), dofs=["1.1", "2.1", "3.1"])
    scene = ss.fe.assemble(body, [ss.Contact(normal="2.1")], force={"2.1": -1.0})
    reduced = ss.fe.reduce(scene, (0.1, 2.0), "massless", combination="+", modes=1)
    assert reduced.frequencies == pytest.approx([10.0 / (2.0 * np.pi)], rel=1e-12)
    assert reduced.scene.size == 2


def test_mass_at_the_contacts_does_not_strike_against_a_massless_boundary():
    """Without the inertia of the contacts, opening and closing take as many events as with impacts."""
    scene = lumped_block(20, 10, 4)
    models = [reduced_block(scene, boundary, 40) for boundary in ("lumped", "massless")]
    runs = [pulse(scene, reduced, duration=1e-3)[2] for reduced in models]
    assert models[1].scene.size == 64
    assert len(runs[1].events) < 1.2 * len(runs[0].events)


@pytest.mark.filterwarnings("ignore:reduced scene")
def test_a_structure_that_moves_freely_has_a_massless_boundary():
    """A bar that nothing holds but its contacts: its free motions are modes."""
    body = ss.fe.Body(
        *free_bar(8), dofs=[f"{k + 1}.1" for k in range(8)], points=np.linspace(0, 1, 8)[:, None] * [1, 0]
    )
    scene = ss.fe.assemble(body, [ss.Contact(normal="1.1", gap=0.0)], force={"8.1": -3.0})
    for count in (1, 4):
        reduced = ss.fe.reduce(scene, (0.1, 20.0), "massless", modes=count)
        assert reduced.frequencies[0] < 1e-5
        steady = reduced.expand(ss.steady_sliding(reduced.scene))
        np.testing.assert_allclose(steady.position, ss.steady_sliding(scene).position, atol=1e-12)


def test_contacts_along_one_direction_have_no_massless_boundary():
    body = ss.fe.Body(*free_bar(8), dofs=[f"{k + 1}.1" for k in range(8)])
    scene = ss.fe.assemble(
        body, [ss.Contact(normal="1.1", gap=gap) for gap in (0.0, 1e-3)], force={"8.1": -3.0}
    )
    with pytest.raises(ss.InputError, match=r"contacts: .* their directions depend on one another"):
        ss.fe.reduce(scene, (0.1, 20.0), "massless", combination="+d", modes=2)


def free_bar(nodes, stiffness=1e3, mass=0.2):
    """Return lumped mass and stiffness of a free bar."""
    springs = np.diag(np.full(nodes, 2.0)) - np.eye(nodes, k=1) - np.eye(nodes, k=-1)
    springs[0, 0] = springs[-1, -1] = 1.0
    return np.full(nodes, mass), stiffness * springs


def test_loads_in_time_are_carried_along(small):
    shaken = small.replace(
        impact_friction=True, loads=[ss.Harmonic({"20.1": 2.0}, frequency=4e3, name="shaker")]
    )
    reduced = ss.fe.reduce(shaken, (100.0, 60e3), "consistent", modes=46)
    (load,) = reduced.scene.loads
    assert (load.frequency, load.name) == (4e3, "shaker")
    # Their response: nearly all modes are there.
    runs = [ss.simulate(scene, 2e-4, ss.steady_sliding(scene)) for scene in (shaken, reduced.scene)]
    times = np.linspace(0.0, 2e-4, 50)
    full, few = runs[0].sample(times).position, reduced.expand(runs[1].sample(times)).position
    moved = np.abs(full - full[0]).max()
    assert moved > 0.0
    np.testing.assert_allclose(few, full, rtol=0, atol=2e-3 * moved)


@pytest.mark.parametrize("boundary", ["lumped", "massless"])
def test_modal_damping(small, boundary):
    damped = small.replace(damping=None)
    reduced = ss.fe.reduce(damped, (100.0, 60e3), boundary, modes=20, modal_damping=0.03)
    modes = ss.complex_modes(reduced.scene, "dddddd")
    np.testing.assert_allclose(modes.damping_ratios, 0.03, rtol=1e-8)
    added = ss.fe.reduce(small, (100.0, 60e3), boundary, modes=20, modal_damping=0.03)
    both = ss.complex_modes(added.scene, "dddddd")
    expected = 0.03 + 0.5e-7 * np.abs(both.eigenvalues)
    np.testing.assert_allclose(both.damping_ratios[:10], expected[:10], rtol=1e-6)


def test_two_flexible_bodies():
    """Pad and disc: contact coordinates are relative motions, of node to node and of node to face."""
    for counts in ((4, 4, 1), (3, 5, 1)):
        disc = plate(counts, (0.04, 0.04, 0.006), (0.0, 0.0, 0.0), young=100e9, density=7000.0, name="disc")
        disc = disc.held(disc.surface("bottom"))
        pad = plate((2, 2, 2), (0.02, 0.02, 0.01), (0.01, 0.01, 0.006), name="pad")
        top = pad.surface("top")
        pad = pad.held(top, directions=(1, 2))
        pairs = ss.fe.contact_pairs(
            pad.surface("bottom"), disc.surface("top"), velocity=(2, 0, 0), friction=0.3, plane=False
        )
        pressure = pad.surface("top").pressure(1e6)
        scene = ss.fe.assemble([pad, disc], pairs, force=pressure, damping=ss.Rayleigh(stiffness=1e-7))
        combination = "+" * len(pairs)
        options = {"band": (100.0, 60e3), "combination": combination, "tolerance": 5e-2}
        # Consistent mass of the mesh couples the contacts, and without the coupling two modes more grow.
        with pytest.raises(ss.InputError, match=r"leave the spurious eigenvalue .*lump the masses"):
            ss.fe.reduce(scene, **options)
        reduced = ss.fe.reduce(scene, boundary="consistent", **options)
        assert reduced.scene.size < scene.size / 2
        found = ss.complex_modes(reduced.scene, combination).eigenvalues
        expected = ss.complex_modes(scene, combination).eigenvalues
        low = expected[(expected.imag > 0) & (np.abs(expected) < 2 * np.pi * 60e3)]
        assert low.size >= 5
        assert nearest(low, found) < 5e-2


def disc_and_pad(friction):
    """Return a pad on a rotating disc with meshes that do not match, 600 dofs with 15 contacts."""
    disc = ss.fe.ring((3, 30, 1), (0.03, 0.075), (0.0, 2.0 * np.pi), (0.0, 0.01))
    pad = ss.fe.ring((2, 4, 1), (0.042, 0.071), np.deg2rad((0.7, 50.7)), (0.01, 0.022))
    damping = ss.Rayleigh(stiffness=1e-8)
    disc, pad = (
        ss.fe.Body.elastic(
            mesh, young=young, poisson=0.27, density=density, damping=damping, name=name
        ).lumped()
        for mesh, young, density, name in ((disc, 120e9, 7200.0, "disc"), (pad, 10e9, 2500.0, "pad"))
    )
    disc, pad = disc.held(disc.surface("inner")), pad.held(pad.surface("top"), (1, 2))
    spin = ss.fe.Rotation(5.0)
    # Along the rotation alone: with friction in the plane all modes decay.
    pairs = ss.fe.contact_pairs(
        pad.surface("bottom"), disc.surface("top"), velocity=spin, friction=friction, plane=False
    )
    return ss.fe.assemble([disc, pad], pairs, force=pad.surface("top").pressure(1e6))


def test_growth_rates_hold_where_frequencies_alone_do_not():
    """Shapes of the modes whose growth is wrong are added, and serve at other friction coefficients too."""
    scene = disc_and_pad(0.3)
    combination, band = "+" * 15, (500.0, 10e3)
    loose, tight = (
        ss.fe.reduce(scene, band, combination=combination, growth_tolerance=growth) for growth in (None, 0.05)
    )
    assert loose.errors.frequency_error.max() < 1e-3
    assert loose.errors.growth_error.max() > 0.1
    assert tight.errors.frequency_error.max() < 1e-3
    assert tight.errors.growth_error.max() < 0.05
    # Real and imaginary part of one shape.
    assert tight.frequencies.size == loose.frequencies.size + 2
    facts = dict(tight.summary().facts)
    assert facts["largest errors"] == (
        f"{float(tight.errors.frequency_error.max()):.2g} of a frequency, "
        f"{float(tight.errors.growth_error.max()):.2g} of a growth rate"
    )
    for friction in (0.2, 0.5):
        full = ss.complex_modes(disc_and_pad(friction), combination, band=band).eigenvalues
        worst = full[full.real.argmax()]
        contacts = [dataclasses.replace(one, friction=friction) for one in tight.scene.contacts]
        few = ss.complex_modes(tight.scene.replace(contacts=contacts), combination).eigenvalues
        nearest = few[np.abs(few - worst).argmin()]
        assert nearest.real == pytest.approx(worst.real, rel=0.06)
    # The error names what the boundary allows, and that is enough.
    with pytest.raises(
        ss.InputError, match=r"growth_tolerance: 1e-07 is not reached with a lumped"
    ) as refused:
        ss.fe.reduce(scene, band, combination=combination, growth_tolerance=1e-7)
    named = float(re.search(r"give growth_tolerance=([\d.e-]+), or another boundary", str(refused.value))[1])
    assert 1e-7 < named < 0.05
    held = ss.fe.reduce(scene, band, combination=combination, growth_tolerance=named)
    assert held.errors.growth_error.max() <= named


@pytest.mark.parametrize(
    ("offered", "named"),
    [
        (1.0 + 19.98j, "growth_tolerance=None"),
        (0.1 + 20.0j, "growth_tolerance=0.67"),
        (0.3 + 20.2j, "tolerance=0.01"),
        (0.1 + 20.2j, "tolerance=0.0099 and growth_tolerance=0.67"),
    ],
)
def test_tolerances_that_an_agreement_holds_are_named(offered, named):
    """An error of 2/3 in the growth rate 0.3 1/s, of 7/3, and of 1 % in the frequency."""
    found = compared(np.array([0.3 + 20.0j]), np.array([offered]), np.array([1.0, 50.0]), 1e-3)
    assert found.attainable(1e-3, 0.05) == named


def test_a_basis_with_the_shapes_of_complex_modes_has_their_eigenvalues(small):
    """Exactly, while as many modes with held contacts alone are 1e-3 off."""
    full = ss.complex_modes(small, "++++++", band=(100.0, 60e3))
    basis = CraigBampton(small, "consistent")

    with_shapes, without = (
        eigenvalues(reduced_scene(model, small, basis.kinds))
        for model in (basis.model(10, full.shapes), basis.model(10 + 2 * len(full)))
    )
    assert nearest(full.eigenvalues, with_shapes) < 1e-10
    assert nearest(full.eigenvalues, without) > 1e-5


def test_the_full_modes_can_be_handed_on():
    scene, band = disc_and_pad(0.3), (500.0, 10e3)
    full = ss.complex_modes(scene, "+" * 15, band=(100.0, 12e3), certify=False)
    handed = ss.fe.reduce(scene, band, full_modes=full)
    computed = ss.fe.reduce(scene, band, combination="+" * 15)
    assert len(full) > handed.errors.sizes["mode"] == computed.errors.sizes["mode"]
    np.testing.assert_allclose(handed.errors.reduced, computed.errors.reduced, rtol=1e-9)
    assert f"{computed.errors.sizes['mode']} eigenvalues of {'+' * 15}, not counted" in str(handed)
    assert f"{computed.errors.sizes['mode']} eigenvalues of {'+' * 15}, 0.00 missing" in str(computed)
    for options, told in (
        ({"full_modes": full.eigenvalues}, "full_modes: expected the modes of the scene that is reduced"),
        ({"full_modes": full, "combination": "d" * 15}, "full_modes: they are those of '[+]{15}', and the"),
    ):
        with pytest.raises(ss.InputError, match=told):
            ss.fe.reduce(scene, band, **options)
    with pytest.raises(ss.InputError, match="full_modes: expected the modes of the scene"):
        ss.fe.reduce(scene.replace(friction=0.2), band, full_modes=full)


@pytest.mark.filterwarnings("ignore:reduced scene")
def test_a_spurious_eigenvalue_and_a_mode_without_counterpart_are_told():
    """With fewer modes than the band has."""
    scene = disc_and_pad(0.3)
    with pytest.warns(UserWarning, match=r"mode \d+ at .* has no counterpart in the reduced scene"):
        reduced = ss.fe.reduce(scene, (500.0, 10e3), combination="+" * 15, modes=4)
    errors = reduced.errors
    lacking = np.isnan(errors.reduced.to_numpy())
    assert lacking.any()
    assert np.isinf(errors.frequency_error.to_numpy()[lacking]).all()
    assert np.isinf(errors.growth_error.to_numpy()[lacking]).all()

    def agreement(full, offered):
        return compared(np.array(full), np.array(offered), np.array([1.0, 50.0]), 1e-3)

    one = agreement(full=[-1 + 100j, 2 + 200j], offered=[-1 + 100j, 2 + 200j, 3 + 150j, 5 + 900j])
    assert one.spurious.tolist() == [3 + 150j]
    assert one.outside.tolist() == [5 + 900j]
    assert one.excess(1e-3, 0.05) == LOST
    assert one.lacking(1e-3, 0.05).startswith("the spurious eigenvalue")
    assert "spurious eigenvalue, 23.878 Hz with the growth rate 3 1/s" in one.remarks()[0]
    # Near the end of the band the full scene can have its eigenvalue outside.
    assert not agreement(full=[-1 + 100j], offered=[-1 + 100j, 313.999j]).spurious.size


@pytest.mark.slow
@pytest.mark.parametrize(("every", "modes"), [(8, 40), (8, 100), (4, 40), (4, 100), (2, 40), (2, 100)])
def test_the_block_of_1640_dofs(every, modes):
    scene = on_belt(40, 20, every)
    assert scene.size == 1640
    contacts = len(scene.contacts)
    assert contacts == 40 // every + 1
    reduced = ss.fe.reduce(scene, (1e3, 100e3), "lumped", combination="+" * contacts, modes=modes)
    assert reduced.scene.size == 2 * contacts + modes
    assert distances(reduced)[:6].max() < 3.5e-3


def test_what_is_ill_posed_is_refused(small):
    loose = ss.fe.assemble(plate((2, 1, 1), (0.02, 0.01, 0.004), (0.0, 0.0, 0.0)))
    pad = plate((2, 1, 1), (0.02, 0.01, 0.004), (0.0, 0.0, 0.0))
    pairs = ss.fe.contact_pairs(pad.surface("bottom"), None, velocity=(1, 0, 0), friction=0.1, plane=False)
    floating = ss.fe.assemble(pad, pairs)
    thin = plate((3, 2, 1), (0.04, 0.02, 0.01), (0.0, 0.0, 0.0)).lumped()
    thin = thin.held(thin.surface("top"))
    pairs_of_thin = ss.fe.contact_pairs(
        thin.surface("bottom"), None, velocity=(1, 0, 0), friction=0.1, gap=-1e-6
    )
    touching = ss.fe.assemble(thin, pairs_of_thin)
    for scene, options, told in (
        (small, {"band": (0.0, 1.0, 2.0)}, "band: expected .lowest, highest. in Hz"),
        (small, {"band": (10.0, 5.0)}, "band: expected"),
        (small, {"band": (1.0, 2.0)}, "band: the scene has no eigenvalue from 1 to 2 Hz"),
        (small, {"boundary": "free"}, "boundary: expected 'lumped', 'consistent' or 'massless', got 'free'"),
        (small.replace(circulatory=np.eye(60)), {"boundary": "massless"}, "carries no circulatory matrix"),
        (small, {"tolerance": 0.0}, "tolerance: expected a number between 0 and 1"),
        (small, {"growth_tolerance": 2.0}, "growth_tolerance: expected a number between 0 and 1, got 2"),
        (small, {"modes": 60}, "modes: expected at most 47, got 60"),
        (small, {"modal_damping": -0.1}, "modal_damping: expected a ratio"),
        (small, {"combination": "ssssss", "modes": 0}, "modes: expected an integer >= 1"),
        (loose, {}, "scene: it has no contacts"),
        (floating, {"combination": "+" * len(pairs)}, "with its contacts held"),
        (touching, {}, "of its 36 coordinates are those of contacts; there is nothing to reduce"),
    ):  # fmt: skip
        with pytest.raises(ss.InputError, match=told):
            ss.fe.reduce(scene, **{"band": (100.0, 60e3), **options})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "boundary"),
    [
        ((20, 10, 4), "lumped"),
        pytest.param((40, 20, 8), "lumped", marks=pytest.mark.nightly),
        pytest.param((20, 10, 4), "massless", marks=pytest.mark.nightly),
    ],
)
def test_the_cycle_of_the_reduced_model_is_that_of_the_full_one(mesh, boundary):
    """A separation pulse of 27.3 to 28.2 us: mean period and share of detached time once it has settled."""
    scene = lumped_block(*mesh, boundary)
    models = [reduced_block(scene, boundary, modes) for modes in (40, 100)]
    period, share, run = pulse(scene, models[0], full=True)
    assert (run.balance().impact > 0.0) == (boundary == "lumped")
    for reduced in models:
        other, part, _ = pulse(scene, reduced)
        assert other == pytest.approx(period, rel=5e-3 if boundary == "lumped" else 2e-3)
        assert abs(part - share) < 0.01


def test_a_massless_boundary_converges_to_the_full_model_without_mass_there():
    """The whole mass and its centre stay; with nearly all modes the eigenvalues are the full model's."""
    plain, scene = (lumped_block(8, 4, 4, boundary) for boundary in ("lumped", "massless"))
    dofs, x = scene.mesh.dofs, scene.mesh.points[:, 0]
    for direction in range(2):
        kept = dofs[:, direction] >= 0
        masses = [one.mass[dofs[kept, direction]] for one in (plain, scene)]
        assert masses[1].sum() == pytest.approx(masses[0].sum(), rel=1e-12)
        assert x[kept] @ masses[1] == pytest.approx(x[kept] @ masses[0], rel=1e-12)
    assert np.count_nonzero(scene.mass == 0.0) == 2 * len(scene.contacts)
    most = np.count_nonzero(scene.mass) - 1
    errors = [
        distances(ss.fe.reduce(scene, (1e3, 60e3), "massless", combination="+++", modes=modes)).max()
        for modes in (10, 30, 50, most)
    ]
    assert errors[0] > 100.0 * errors[1] > 1000.0 * errors[2]
    assert errors[2] < 1e-6
    # One mode is left out, and the only further mode is this one.
    assert errors[3] < 1e-13


def test_modes_of_a_structure_with_dofs_without_mass():
    """They satisfy the equations of these dofs, too, which no product with M sees."""
    scene = lumped_block(20, 10, 4, "massless")
    stiffness = scipy.sparse.csc_array(scene.stiffness)
    squares, shapes = LowestModes(stiffness, scipy.sparse.diags_array(scene.mass), 0.0)(160)
    residual = stiffness @ shapes - scene.mass[:, None] * shapes * squares
    scale = np.abs(stiffness).max() * np.abs(shapes).max(axis=0)
    assert (np.abs(residual).max(axis=0) < 1e-9 * scale).all()


@pytest.mark.filterwarnings("ignore:reduced scene")
def test_a_mode_that_grows_in_one_scene_alone_is_told():
    """Damping between the growth rates of the two scenes makes one of them stable."""
    undamped = on_belt(5, 5, friction=0.6, damping=None)
    band = (100.0, 60e3)
    found = ss.fe.reduce(undamped, band, modes=12).errors
    full, few = found.full.to_numpy().real, found.reduced.to_numpy().real
    mode = full.argmax()
    rates = full[mode], few[mode]
    assert max(rates) > 1.0
    damped = undamped.replace(damping=ss.Rayleigh(mass=sum(rates)))
    with pytest.warns(UserWarning, match=r"mode \d+ at .* Hz has the growth rate .* in the full scene"):
        reduced = ss.fe.reduce(damped, band, modes=12)
    assert reduced.errors.full.to_numpy().real.max() < 0.0 < reduced.errors.reduced.to_numpy().real.max()
    assert "growth rate" in dict(reduced.summary().facts)["warning"]
