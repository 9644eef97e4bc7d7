"""Series of impacts over contacts that mass couples."""

import numpy as np
import pytest

import stickslip as ss
from coupled_scenes import elastic_block, masses_on_a_belt
from fuzz_chains import coupled_by_mass
from fuzz_checks import (
    balance_residual,
    complementarity,
    continuity,
    coupled_impact_law,
    energy_residual,
)
from fuzz_samples import Sampled
from fuzz_scenes import fuzz_scene

CASES = [
    (count, coupling, restitution)
    for count in (2, 3, 4, 5, 6, 7, 8)
    for coupling in (0.3, 0.6, 0.9)
    for restitution in (0.0, 0.2, 0.5)
]
#: Rounding of the works, some hundred ulp.
ROUNDING = 256 * np.finfo(float).eps
#: Of the works of 0.1 J, for each flight of long series: it rounds a gap by up to 100 ulp of the static
#: displacement of 0.1 m, and the loads of 10 N work on the sum of those roundings.
FLIGHT = 1000 * np.finfo(float).eps


def check(run, balanced):
    """Complementarity between the events, and the balance of energy."""
    scene = run.scene
    count = len(scene.contacts)
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    widths = np.diff(edges)
    longest = np.argsort(widths)[-300:]
    times = np.sort((edges[longest, None] + widths[longest, None] * np.array([0.1, 0.5, 0.9])).ravel())
    data = run.sample(times)
    gap = np.array([scene.normal_direction(i) for i in range(count)]) @ data.position.values.T
    gap = gap.T + np.array([contact.gap for contact in scene.contacts])
    # Rounding of motions about the static displacement under the same load.
    static = np.linalg.solve(scene.stiffness, scene.force)
    scale = max(np.abs(data.position.values).max(), np.abs(static).max())
    assert gap.min() >= -1e3 * np.finfo(float).eps * scale
    normal = data.normal_force.values
    assert normal.min() >= -1e-9 * np.abs(normal).max()
    balance = run.balance()
    turnover = sum(abs(float(getattr(balance, name))) for name in ("stored", "external", "damping"))
    turnover += np.abs(balance.contact).sum() + np.abs(balance.impact).sum()
    assert abs(balance.residual) <= balanced * turnover


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "coupling", "restitution"),
    [case if case[0] < 6 else pytest.param(*case, marks=pytest.mark.nightly) for case in CASES],
)
def test_masses_on_a_belt_come_to_rest(count, coupling, restitution):
    scene, start = masses_on_a_belt(count, coupling, restitution)
    run = ss.simulate(scene, 0.5, start)
    assert run.stop_reason == "duration"
    assert run.events.combination[-1] == "+" * count
    check(run, ROUNDING if coupling < 0.9 else FLIGHT * len(run.events))
    # A hundred events per contact and millisecond, on the mean of the series.
    assert len(run.events) <= 100 * count * 1e3 * run.events.time[-1]


@pytest.mark.parametrize(
    ("count", "coupling", "restitution", "height", "method"),
    [(8, 0.6, 0.2, 1e-4, "auto"), (7, 0.3, 0.3, 5e-5, "modal"), (7, 0.6, 0.5, 5e-5, "modal")],
)
def test_impacts_too_near_for_the_clock_end(count, coupling, restitution, height, method):
    """Some bounce below the rounding of their gaps while one that is as near still has all of the energy.

    They were taken for unfinished one after the other, by forces equal but for rounding, and struck on.
    """
    scene, start = masses_on_a_belt(count, coupling, restitution, height)
    run = ss.simulate(scene, 0.5, start, method=method)
    assert run.stop_reason == "duration"
    assert run.events.combination[-1] == "+" * count
    check(run, ROUNDING)


@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.8])
def test_both_methods_come_to_rest_alike(restitution):
    scene, start = masses_on_a_belt(3, 0.3, restitution)
    modal = ss.simulate(scene, 0.5, start, method="modal")
    taylor = ss.simulate(scene, 0.5, start, method="taylor")
    assert modal.events.combination[-1] == taylor.events.combination[-1] == "+++"
    one, other = modal.state(0.5), taylor.state(0.5)
    # The slide after the series has forgotten its order: both end within what its impulses were known to.
    assert np.abs(one.position - other.position).max() <= 1e-9 * np.abs(one.position).max()
    assert np.abs(one.velocity - other.velocity).max() <= 1e-8 * np.abs(one.velocity).max()
    assert modal.accumulations
    for limit in modal.accumulations:
        assert modal.events.kind[limit.event] == "accumulation"
        assert limit.bounces >= 1
        # A flight under 10 N as high as gaps are known, 1e4 ulp of 0.1 m; then others lift.
        flight = np.sqrt(8 * 1e4 * np.finfo(float).eps * 0.1 / 10.0)
        assert 0.0 <= limit.error < 2.0 * flight / (1.0 - restitution)


@pytest.mark.parametrize("coupling", [-0.3, -0.9])
def test_contacts_that_press_on_each_other_strike_at_one_instant(coupling):
    """Each plastic impact presses the other contact in; the sum of all is one impact of both.

    The distances of such impacts square themselves, so two or three are all that numbers can tell apart.
    """
    scene, start = masses_on_a_belt(2, coupling, 0.0, height=1e-6)
    runs = [ss.simulate(scene, 0.05, start, method=method) for method in ("modal", "taylor")]
    for run in runs:
        assert list(run.events.kind) == ["impact", "impact"]
        assert run.events.combination[-1] == "++"
        first = float(run.events.time[0])
        # In flight the two fall alike from 0.5 and 1 um: the lower one strikes, and presses the other in.
        struck = run.state(np.nextafter(first, 0.0)).velocity[2:]
        pressed = run.state(first).velocity[2:]
        assert pressed[1] == pytest.approx(struck[1] - coupling * struck[0], rel=1e-9)
        # Rounding of the stored energy, a hundred times what the impacts take.
        assert abs(run.balance().residual) <= 16 * np.finfo(float).eps * abs(run.balance().stored)
    assert runs[0].events.time == pytest.approx(runs[1].events.time, abs=1e-15)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8])
def test_contacts_that_press_on_each_other_come_to_rest(restitution):
    scene, start = masses_on_a_belt(3, -0.45, restitution, height=1e-6)
    for method in ("modal", "taylor"):
        run = ss.simulate(scene, 0.05, start, method=method)
        check(run, 10 * ROUNDING)
        assert run.state(0.05).combination == "+++"


def test_impacts_that_have_no_end_at_one_instant():
    """Two contacts press on each other so strongly that an impact takes 5 % of their velocity."""
    scene, start = fuzz_scene(5, 71)
    for method in ("modal", "taylor"):
        assert ss.simulate(scene, 0.1, start, method=method, max_events=200).stop_reason == "max_events"


@pytest.mark.parametrize("count", [4, 5])
def test_a_nested_series_does_not_feed_on_rounding(count):
    """Gaps of some ulp of the static displacement were lifted and fell again, without end."""
    scene, start = masses_on_a_belt(count, 0.9, 0.5)
    run = ss.simulate(scene, 0.5, start, max_events=30_000)
    assert run.stop_reason == "duration"
    assert run.events.combination[-1] == "+" * count
    assert len(run.events) <= 100 * count * 1e3 * run.events.time[-1]


def test_any_state_of_a_motion_is_a_start():
    """What one contact carries depends on the status of the others."""
    scene, start = fuzz_scene(5, 37)
    run = ss.simulate(scene, 0.1, start, max_events=200)
    edges = np.concatenate([[0.0], run.events.time])
    longest = np.argsort(np.diff(edges))[-20:]
    for time in 0.5 * (edges[longest] + edges[longest + 1]):
        assert ss.simulate(scene, 1e-9, run.state(time)).stop_reason == "duration"


def test_repeated_eigenvalues_by_modes_and_series():
    """All flight modes of the masses have one of two eigenvalues."""
    scene, _ = masses_on_a_belt(4, 0.6, 0.5)
    rng = np.random.default_rng(0)
    start = ss.State(
        np.r_[np.zeros(4), np.full(4, 1e-3)], np.r_[np.zeros(4), 0.01 * rng.normal(size=4)], "dddd"
    )
    modal, taylor = (
        ss.simulate(scene, 1e-4, start, method=method).state(1e-4) for method in ("modal", "taylor")
    )
    assert modal.velocity == pytest.approx(taylor.velocity, rel=1e-12, abs=1e-16)


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_reduced_block_lifts_off(restitution):
    scene = elastic_block(restitution=restitution)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})
    run = ss.simulate(scene, 6e-4, start, max_events=1500)
    assert run.stop_reason == "max_events"
    assert "impact" in run.events.kind
    assert "accumulation" in run.events.kind
    check(run, FLIGHT * len(run.events))


@pytest.mark.slow
def test_a_tolerance_cuts_impacts_that_lift_each_other():
    """One impact lifts several contacts, which strike and lift others: their series has no constant ratio."""
    scene = elastic_block()
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})
    full = ss.simulate(scene, 5.4e-4, start)
    # The shortest period is 5e-6 s.
    for tolerance, part in ((1e-9, 3), (1e-8, 6)):
        cut = ss.simulate(scene, 5.4e-4, start, accumulation_tolerance=tolerance)
        check(cut, ROUNDING)
        assert len(cut.events) * part < len(full.events)
        assert max(limit.error for limit in cut.accumulations) <= tolerance
        one, other = full.state(5e-4), cut.state(5e-4)
        change = np.abs(one.position - other.position).max()
        assert change <= tolerance * np.abs(full.state(5e-4).velocity).max()


def test_contacts_that_hold_all_of_a_scene_come_to_rest():
    """Two masses that mass couples, and a third stop along their sum: at rest every displacement is zero.

    Their gaps vanish beside the deflection under the constant load, not beside displacements that vanish with
    them.
    """
    bounces = ((0, 0.8), (1, 0.8), ([1.0, 1.0], 0.0))
    stops = [ss.Contact(normal=normal, restitution=restitution) for normal, restitution in bounces]
    scene = ss.Scene(
        [[1.0, -0.5], [-0.5, 1.0]],
        [[100.0, 0.0], [0.0, 100.0]],
        force=[-10.0, -7.0],
        contacts=stops,
        impact_friction=True,
    )
    run = ss.simulate(scene, 0.5, ss.State([1e-3, 2e-3], [0.0, 0.0], "ddd"), max_events=3000)
    assert run.stop_reason == "duration"
    assert run.state(0.5).combination == "+++"
    assert run.events.time[-1] < 0.2
    assert np.abs(run.state(0.5).position).max() == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_impulses_that_cancel_move_no_other_contact(seed):
    """A mass that strikes a moving slider is pushed against a stop, which takes all of the friction impulse.

    Mass couples a third contact with both, which sticks: its slip velocity stays zero to the last bit.
    """
    factor = np.random.default_rng(seed).normal(size=(3, 3))
    mass, tied = np.eye(4), [0, 2, 3]
    mass[np.ix_(tied, tied)] = factor @ factor.T + 0.3 * np.eye(3)
    contacts = [
        ss.Contact(tangential=0, normal=1, friction=0.4, slider_speed=1.0),
        ss.Contact(normal={0: -1.0}),
        ss.Contact(tangential=2, normal_force=50.0, friction=1.0),
    ]
    stiffness = np.diag([1e3, 1e4, 1e3, 1e3])
    scene = ss.Scene(mass, stiffness, force=[20.0, -10.0, 1.0, 0.0], contacts=contacts, impact_friction=True)
    run = ss.simulate(scene, 0.02, ss.State([0.0, 1e-3, 0.0, 0.0], [0.0, -0.5, 0.0, 0.0], "d+s"))
    first = run.events.time == run.events.time[0]
    assert list(run.events.contact[first]) == [0]
    assert run.events.kind[0] == "impact"
    assert run.events.combination[0] == "++s"


@pytest.mark.parametrize("seed", [2, 5, 11, 17, 20, 29])
def test_thousands_of_coupled_impacts_leave_the_balance_closed(seed):
    """Accumulations over two to four contacts that mass couples by up to 0.9, with restitution 0.5.

    Each phase starts from modes, whose projection has to invert their superposition to rounding: an error
    of 1e-14 of it has one sign in all phases of a combination, and thousands of them add up to 1e-11.
    """
    rng = np.random.default_rng(seed)
    count = 2 + seed % 3
    mass = np.eye(count)
    for i in range(count):
        for j in range(i):
            mass[i, j] = mass[j, i] = 0.9 * rng.uniform(-1.0, 1.0)
    mass += max(0.0, 0.05 - np.linalg.eigvalsh(mass).min()) * np.eye(count)
    root = rng.normal(size=(count, count))
    scene = ss.Scene(
        mass,
        root @ root.T + 0.5 * np.eye(count),
        force=-rng.uniform(0.5, 3.0, count),
        contacts=[ss.Contact(normal=i, restitution=0.5) for i in range(count)],
    )
    start = ss.State(rng.uniform(0.0, 1.0, count), rng.normal(size=count), "d" * count)
    run = ss.simulate(scene, 20.0, start)
    balance = run.balance()
    assert len(run.events) > 1000
    # Of 1e4 phases, each of which rounds its energy to 1e-16 with either sign.
    assert abs(balance.residual) <= 2e-13 * balance.turnover


@pytest.mark.parametrize("seed", range(6))
def test_impacts_without_friction_leave_slip_as_it_is(seed):
    """Mass ties the normal directions to each other, and the tangential ones, but none of both."""
    scene, start = coupled_by_mass(np.random.default_rng(seed))
    scene = scene.replace(impact_friction=False)
    run = ss.simulate(scene, 0.05, start, max_events=400)
    sampled = Sampled(run)
    for check in (complementarity, coupled_impact_law):
        assert check(sampled) == ""
    assert continuity(run) == ""
    assert energy_residual(sampled) < 1e-11
    assert balance_residual(run) < 1e-11
    slip = np.array([scene.tangential_direction(i) for i in range(len(scene.contacts))])
    before = sampled.before.velocity
    assert sampled.impacts.size > 5
    assert np.abs((sampled.after[1] - before) @ slip.T).max() <= 1e-7 * np.abs(before).max()


def test_errors_of_a_coupled_mass_name_the_way_out():
    """One contact whose two directions mass couples: an error that speaks of other contacts would not fit."""
    mass, stiffness = [[1.0, 0.3], [0.3, 1.0]], np.diag([1e4, 1e4])
    rubs = ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=1.0)
    scene = ss.Scene(mass, stiffness, force=[0.0, -10.0], contacts=[rubs])
    start = ss.steady_sliding(scene)
    told = r"impact_friction: .* normal with tangential directions.*Body\.lumped\(\)"
    with pytest.raises(ss.InputError, match=told):
        ss.simulate(scene, 0.01, start)
    springs = {"normal_stiffness": 1e6, "tangential_stiffness": 1e6}
    sprung = ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=1.0, **springs)
    with pytest.raises(ss.InputError, match=r"mass: .*Body\.lumped\(\) or fe\.reduce\(boundary='massless'\)"):
        ss.Scene(mass, stiffness, force=[0.0, -10.0], contacts=[sprung])
