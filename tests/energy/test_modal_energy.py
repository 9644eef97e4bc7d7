"""Energy of complex modes: growth from power, shares of a motion, and the sum over them."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from random_scenes import drawn_scenes
from stickslip.modes.shape import mode_friction
from stickslip.scene.structure import Structure

EPS = np.finfo(float).eps
COMBINATIONS = ["".join(pair) for pair in itertools.product("+-sd", repeat=2)]


@pytest.mark.parametrize("damping", [None, ss.Rayleigh(0.3, 2e-4), np.diag([1.0, 2.0, 3.0])])
@pytest.mark.parametrize("mass", [[1.0, 2.0, 3.0], [[2.0, 0.1, 0.0], [0.1, 3.0, 0.0], [0.0, 0.0, 1.0]]])
def test_the_matrices_of_a_scene_come_back_from_the_core(mass, damping):
    stiffness = np.array([[4.0, -1.0, 0.0], [-1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])
    sideways = ss.Contact(tangential=[0.6, 0.0, -0.8], normal=1, friction=0.1)
    scene = ss.Scene(mass, stiffness, damping, [1.0, 2.0, 3.0], [sideways])
    full = np.array(mass) if np.ndim(mass) == 2 else np.diag(mass)
    given = np.zeros((3, 3)) if damping is None else damping
    viscous = 0.3 * full + 2e-4 * stiffness if isinstance(damping, ss.Rayleigh) else given
    for structure in (Structure.dense(scene), Structure.of(scene)):
        for name, expected in {"mass": full, "damping": viscous, "stiffness": stiffness}.items():
            entries = getattr(structure, name)
            assert np.array_equal(entries if isinstance(entries, np.ndarray) else entries.toarray(), expected)
    directions = Structure.dense(scene).directions
    assert directions.tolist() == [[0.6, 0.0], [0.0, 1.0], [-0.8, 0.0]]
    # P' D = 1: the forces that balance D f are f.
    assert Structure.dense(scene).impulse_response.T @ directions == pytest.approx(np.eye(2), abs=1e-15)


def check_growth(scene, combination):
    """contact - damping = 2 Re(lambda) energy for every mode, to rounding of powers and eigenvalue.

    Contact power by Coulomb's law on the normal forces; `Modes.power` takes it from the equation of motion.
    """
    power, modes = ss.complex_modes(scene, combination).power(), ss.complex_modes(scene, combination)
    structure = Structure.of(scene)
    slip = structure.directions[:, ::2].T @ (modes.eigenvalues * modes.shapes)
    mean = np.where(modes.eigenvalues.imag == 0.0, 1.0, 0.5)
    contact = mean * (mode_friction(structure, scene, modes) * slip.conj()).real
    rate, energy = np.abs(modes.eigenvalues), power.energy.values
    # Forces of a mode are differences in (lambda^2 M + lambda C + K) xi, beside the largest stiffness.
    stiffness = abs(scene.stiffness).sum(axis=0).max()
    scale = np.abs(contact).sum(axis=0) + power.damping_power.values + rate * (energy + stiffness)
    rounding = 50 * EPS * np.minimum(modes.condition, 1.0 / EPS) * scale
    growth = 2.0 * modes.eigenvalues.real * energy
    assert (np.abs(contact.sum(axis=0) - power.damping_power.values - growth) <= rounding).all()
    assert (np.abs(contact - power.contact_power.values) <= rounding).all()


@pytest.mark.parametrize("combination", COMBINATIONS)
@pytest.mark.parametrize("friction", [0.65, 1.5, 2.2])
def test_growth_is_contact_power_less_damping_power(friction, combination):
    scene = ss.models.two_subsystems(friction=friction, slider_speed=0.025, preload_displacement=1e-3)
    check_growth(scene, combination)


@given(drawn_scenes(min_friction=0.1), st.data())
def test_growth_is_power_in_any_scene(drawn, data):
    letters = st.text("+-sd", min_size=len(drawn.scene.contacts), max_size=len(drawn.scene.contacts))
    check_growth(drawn.scene, data.draw(letters, label="combination"))


def test_contact_power_alone_has_not_the_sign_of_the_growth():
    scene = ss.models.two_subsystems(friction=0.65, slider_speed=0.025, preload_displacement=1e-3)
    power = ss.complex_modes(scene).power()
    least = int(np.argmax(power.eigenvalue.values.real))
    contact = float(power.contact_power.sum("contact")[least] / power.energy[least])
    damping = float(power.damping_power[least] / power.energy[least])
    assert contact == pytest.approx(28.8, abs=0.1)
    assert damping == pytest.approx(45.6, abs=0.1)
    assert power.eigenvalue.values[least].real < 0.0


def test_modes_add_up_to_the_motion_and_grow_by_their_own_power(standard):
    run = ss.simulate(standard.scene, 0.3, standard.start)
    # Between events, two instants of one phase so close that differences show the rate.
    times = run.events.time[10:40]
    middle = times[:-1] + 0.5 * np.diff(times)
    step = 1e-6
    early, now, late = (ss.modal_energy(run, middle + shift) for shift in (-step, 0.0, step))
    rate = (late.energy.values - early.energy.values) / (2.0 * step)
    power = (now.contact_power - now.damping_power).values
    valid = ~np.isnan(power)
    # Central differences of e^{2 lambda t}: (2 |lambda| step)^2 / 6 of 2 |lambda| energy.
    fastest = 2.0 * np.pi * now.frequency.values
    error = (2.0 * fastest * step) ** 2 / 6.0 * 2.0 * fastest * now.energy.values
    rounding = 1e-9 * np.nanmax(now.energy.values) / step
    assert (np.abs(rate - power) <= error + rounding)[valid].all()
    np.testing.assert_allclose(now.share.sum("pair"), now.total, rtol=1e-12)
    assert (now.energy.values[valid] >= 0.0).all()


def test_in_the_growth_phase_the_unstable_mode_holds_the_energy(standard):
    """From the kick to the first event only exponentials: the shares are those of z' = lambda z."""
    run = ss.simulate(standard.scene, 0.3, standard.start)
    onset = float(run.events.time[0])
    modes = ss.modal_energy(run, np.linspace(0.05, 0.999 * onset, 40))
    unstable = modes.growth_rate.values[0] > 0.0
    assert unstable.sum() == 1
    energy = modes.energy.values[:, unstable][:, 0]
    growth = modes.growth_rate.values[0, unstable][0]
    # Its energy grows by e^{2 Re(lambda) t} but for a ripple that is the same after half a period.
    frequency = modes.frequency.values[0, unstable][0]
    zeta = growth / (2.0 * np.pi * frequency)
    half = 0.5 / (frequency * np.sqrt(1.0 - zeta**2))
    pair = ss.modal_energy(run, [0.08, 0.08 + half])
    ratio = pair.energy.values[1, unstable] / pair.energy.values[0, unstable]
    assert ratio[0] == pytest.approx(np.exp(2.0 * growth * half), rel=1e-9)
    assert energy[-1] / float(modes.total[-1]) > 0.9


@given(drawn_scenes(min_friction=0.1), st.floats(0.5, 3.0))
def test_the_energy_of_all_modes_is_that_of_the_deviation_from_sliding(drawn, strength):
    run = ss.simulate(drawn.scene, 0.02, drawn.kicked(strength), max_events=50)
    times = np.concatenate([[0.0], drawn.rng.uniform(0.0, run.duration, 10)])
    modes, flow, sample = ss.modal_energy(run, times), run.energy(times), run.sample(times)
    equilibrium = ss.steady_sliding(drawn.scene)
    kept = (modes.combination.values == equilibrium.combination) & ~np.isnan(modes.total.values)
    # All sliding as in the equilibrium, as at the start: the quasi-static motion is that equilibrium.
    assert kept[0]
    deviation = sample.position.values - equilibrium.position
    elastic = 0.5 * np.einsum("ki,ij,kj->k", deviation, np.asarray(drawn.scene.stiffness), deviation)
    expected = flow.kinetic.values + elastic
    # The projection on modes of condition up to 1e6 is rounded relative to the static displacement.
    np.testing.assert_allclose(
        modes.total.values[kept], expected[kept], rtol=1e-8, atol=1e-9 * float(flow.elastic.max())
    )


def test_under_a_given_normal_force_the_deviation_is_from_sliding():
    belt = ss.Contact(tangential="x", normal_force=10.0, friction=0.3, slider_speed=0.4)
    scene = ss.Scene([1.0], [[100.0]], damping=[[1.0]], contacts=[belt], dofs=["x"])
    sliding = ss.steady_sliding(scene)
    run = ss.simulate(scene, 3.0, sliding.perturbed(velocity={"x": 0.2}))
    times = np.linspace(0.0, 3.0, 20)
    modes, sample = ss.modal_energy(run, times), run.sample(times)
    deviation = sample.position.values[:, 0] - 0.3 * 10.0 / 100.0
    expected = 0.5 * sample.velocity.values[:, 0] ** 2 + 50.0 * deviation**2
    np.testing.assert_allclose(modes.total, expected, rtol=1e-12)


def test_a_motion_under_a_law_of_friction_is_no_sum_of_modes():
    law = ss.friction.Stribeck(0.5, 0.3, 0.1)
    scene = ss.models.two_subsystems(friction=law, slider_speed=0.2, preload_displacement=1e-3)
    run = ss.simulate(scene, 0.01, ss.steady_sliding(scene))
    with pytest.raises(ss.InputError, match="no sum of modes"):
        ss.modal_energy(run, [0.005])
