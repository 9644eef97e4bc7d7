"""Floquet multipliers of orbits of every kind, against finite differences of runs; their structural zeros."""

import numpy as np
import pytest

import stickslip as ss
from return_map import assert_multipliers, differenced_multipliers


def kicked(scene):
    return ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})


def settled(scene, method="auto"):
    return ss.simulate(scene, 0.6, kicked(scene), method=method).limit_cycle(method=method)


def two_subsystems(coupling=0.0, normal_coupling=0.0, *, impact_friction=False, **laws):
    """The published model, its contacts changed, its masses, or only the normal ones, tied to each other."""
    base = ss.models.two_subsystems(**laws)
    rng = np.random.default_rng(0)
    spread = rng.standard_normal((8, 8))
    mass = np.asarray(base.mass)
    mass = np.diag(mass) if mass.ndim == 1 else mass
    if coupling:
        mass = mass + coupling * 0.3 / 8 * spread @ spread.T
    normal = [contact.normal for contact in base.contacts]
    mass[np.ix_(normal, normal)] += 0.3 * normal_coupling * np.array([[0.0, 1.0], [1.0, 0.0]])
    return ss.Scene(
        mass,
        base.stiffness,
        damping=base.damping,
        force=base.force,
        contacts=base.contacts,
        dofs=base.dofs,
        impact_friction=impact_friction,
    )


@pytest.fixture(scope="module")
def standard():
    return settled(two_subsystems())


def test_structural_zeros_of_the_standard_run(standard):
    """From flight (14) through sliding (12) and sticking of one (11) to sticking of both (10)."""
    assert [phase.dimension for phase in standard.phases] == [12, 14, 12, 11, 10, 11]
    assert [phase.loss for phase in standard.phases] == [0, 2, 1, 1, 0, 0]
    assert standard.entries == 3
    # The release between the section and the impact gives back what the impact takes.
    assert standard.structural_zeros == 2
    assert standard.multipliers.size == 12
    assert np.count_nonzero(standard.multipliers == 0.0) == 2
    assert np.abs(standard.multipliers[:10]).min() > 1e-3


@pytest.mark.parametrize(("phase", "zeros"), [(0, 2), (1, 4), (3, 1), (4, 0)])
def test_zeros_at_a_section_anywhere(standard, phase, zeros):
    """Dimension less rank: within the flight all entries come before all departures, and 2 + 1 + 1 are lost.

    In the middle of a phase, the differenced map has as many eigenvalues that are rounding."""
    differenced = differenced_multipliers(standard, phase)
    rank = standard.multipliers.size - standard.structural_zeros
    assert differenced.size - rank == zeros
    assert (np.abs(differenced[rank:]) <= 1e-5).all()
    assert (np.abs(differenced[:rank]) >= 1e-3).all()
    for multiplier in standard.multipliers[:rank]:
        assert np.abs(differenced - multiplier).min() <= 1e-6


def test_a_period_run_through_twice_has_no_more_zeros():
    """Eight entries in a doubled period, and still the two zeros of its narrowest place."""
    doubled = settled(two_subsystems(friction=3.0))
    assert doubled.combinations == ("++", "s+", "ss", "s+") * 2
    assert doubled.entries == 4
    assert doubled.structural_zeros == 2
    assert_multipliers(doubled)


@pytest.mark.parametrize(
    "laws",
    [
        {"friction": 2.2, "slider_speed": 0.3},
        {"friction": 2.2, "slider_speed": 0.9, "impact_friction": True},
        {"impact_friction": True},
        {"normal_coupling": 0.05},
        {"normal_coupling": 0.05, "friction": 2.2, "slider_speed": 0.3},
        {"coupling": 0.02, "impact_friction": True},
        {"coupling": 0.02, "impact_friction": True, "friction": 2.2, "slider_speed": 0.3},
    ],
)
def test_impacts_and_coupled_masses(laws):
    cycle = settled(two_subsystems(**laws))
    assert any(phase.event == "impact" for phase in cycle.phases)
    assert_multipliers(cycle, 5e-6)


def test_an_unstable_orbit():
    cycle = settled(two_subsystems(friction=2.4)).continued(two_subsystems(friction=2.8))
    assert not cycle.stable
    assert cycle.multipliers.real.min() < -1.0
    assert_multipliers(cycle)


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.1, 0.3, 0.5])
def test_bounces_that_come_to_rest(restitution):
    """The limit of a series of bounces is an event like others; how many come before it does not matter."""
    scene = two_subsystems().replace(restitution=restitution)
    cycle = settled(scene)
    assert any(phase.event == "accumulation" for phase in cycle.phases)
    assert np.abs(cycle.multipliers - 1.0).min() <= 1e-7
    assert cycle.structural_zeros == 2
    assert_multipliers(cycle, 1e-5)


def test_motions_by_taylor_series():
    cycle = settled(two_subsystems(), method="taylor")
    assert cycle.run.counters["taylor_phases"] > 0
    assert cycle.period == pytest.approx(8.908492605779e-3, rel=1e-12)
    assert_multipliers(cycle, method="taylor")
