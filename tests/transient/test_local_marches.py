"""Local marches of sparse scenes against marches of the whole scene."""

import dataclasses
import pickle

import numpy as np
import pytest
import scipy.sparse as sp

import stickslip as ss
from equal_chain import equal_chain, long_chain
from identical import assert_identical
from nightly import nightly


def edges(kind, count):
    """Return which cells are tied: a chain, a square grid, or a star."""
    if kind == "chain":
        return [(i - 1, i) for i in range(1, count)]
    if kind == "star":
        return [(0, i) for i in range(1, count)]
    side = int(count**0.5)
    across = [(i - 1, i) for i in range(count) if i % side]
    return across + [(i - side, i) for i in range(side, count)]


def cells(kind, count, seed, **laws):
    """Return cells of two masses on sliders, tied by random springs, and a random start."""
    rng = np.random.default_rng(seed)
    stiffness = np.zeros((2 * count, 2 * count))

    def tie(i, j):
        k = 10.0 ** rng.uniform(3.0, 5.0)
        a = np.zeros(2 * count)
        a[i], a[j] = 1.0, -1.0 if i != j else 1.0
        stiffness[:] += k * np.outer(a, a)

    for cell in range(count):
        tie(2 * cell, 2 * cell)
        tie(2 * cell + 1, 2 * cell + 1)
        tie(2 * cell, 2 * cell + 1)
    for a, b in edges(kind, count):
        tie(2 * a, 2 * b)
        tie(2 * a + 1, 2 * b + 1)
    damping = (
        ss.Rayleigh(stiffness=rng.choice([0.0, 1e-5, 1e-4])) if seed % 2 else sp.csr_array(1e-4 * stiffness)
    )
    friction = rng.uniform(0.2, 0.8, count)
    scene = ss.Scene(
        mass=rng.uniform(0.3, 2.0, 2 * count),
        stiffness=sp.csr_array(stiffness),
        damping=damping,
        force=np.tile([0.0, -200.0], count) * rng.uniform(0.5, 1.5, 2 * count),
        contacts=[
            ss.Contact(
                tangential=2 * i,
                normal=2 * i + 1,
                friction=friction[i],
                static_friction=friction[i] * (1.4 if laws.get("static") else 1.0),
                restitution=laws.get("restitution", 0.0),
                slider_speed=rng.uniform(-0.3, 0.3),
            )
            for i in range(count)
        ],
        impact_friction=laws.get("impact_friction", False),
    )
    position = np.zeros(2 * count)
    position[1::2] = rng.uniform(1e-5, 3e-4, count)
    velocity = rng.normal(0.0, 0.1, 2 * count)
    velocity[1::2] *= 0.1
    return scene, ss.State(position, velocity, "d" * count)


def lasting(events, contact):
    """Return times and kinds of the events of a contact, without bounces too short to tell apart."""
    own = np.flatnonzero(events.contact == contact)
    times, kinds = events.time[own], [str(events.kind[k]) for k in own]
    limits = np.array([time for time, kind in zip(times, kinds, strict=True) if kind == "accumulation"])
    kept = [
        k
        for k, time in enumerate(times)
        if kinds[k] == "accumulation" or not (np.abs(limits - time) < 1e-12).any()
    ]
    return times[kept], [kinds[k] for k in kept]


def assert_same(local, whole, tolerance=1e-9):
    """Assert the same events of every contact at the same times, and the same states."""
    for contact in range(len(whole.scene.contacts)):
        (times, kinds), (expected, expected_kinds) = (
            lasting(local.events, contact),
            lasting(whole.events, contact),
        )
        assert kinds == expected_kinds
        np.testing.assert_allclose(times, expected, rtol=0.0, atol=tolerance * whole.duration)
    for time in np.linspace(0.0, whole.duration, 5):
        a, b = local.state(time), whole.state(time)
        assert np.abs(a.position - b.position).max() <= tolerance * np.abs(b.position).max()
        assert np.abs(a.velocity - b.velocity).max() <= tolerance * np.abs(b.velocity).max()


def both(scene, start, duration, **options):
    return [ss.simulate(scene, duration, start, method=method, **options) for method in ("local", "taylor")]


LAWS = [
    {},
    {"static": True},
    {"restitution": 0.4},
    {"restitution": 0.7, "static": True, "impact_friction": True},
]


@pytest.mark.parametrize("laws", LAWS, ids=["plain", "static", "bounces", "all"])
@pytest.mark.parametrize(("kind", "count"), [("chain", 40), ("grid", 36), ("star", 25)])
@pytest.mark.parametrize("seed", nightly(range(4), lambda seed: seed > 1))
def test_local_and_whole_marches_agree(kind, count, laws, seed):
    scene, start = cells(kind, count, seed, **laws)
    local, whole = both(scene, start, 0.02)
    assert local.stop_reason == whole.stop_reason == "duration"
    assert len(whole.events) > count
    # Bounces come so close together that their rounding grows; what follows is the same motion.
    assert_same(local, whole, 1e-7 if "restitution" in laws else 1e-10)
    assert len(local.accumulations) == len(whole.accumulations)


def test_a_long_chain_has_the_events_of_the_whole():
    scene, start = long_chain(250)
    local, whole = both(scene, start, 4e-3)
    assert len(local.events) == len(whole.events) >= 250
    one, other = (np.lexsort((run.events.time, run.events.contact)) for run in (local, whole))
    assert np.array_equal(local.events.contact[one], whole.events.contact[other])
    assert np.array_equal(local.events.kind[one], whole.events.kind[other])
    assert np.abs(local.events.time[one] - whole.events.time[other]).max() < 1e-15


def test_events_of_a_chain_cost_the_same_at_any_length():
    """Counted work per event, with that of the panels: an exponent over the size below 0.05."""
    sizes, work = (100, 600, 4000), []
    for count in sizes:
        scene, start = long_chain(count)
        run = ss.simulate(scene, 2e-3, start, method="local")
        assert run.counters["panels"] == 2
        work.append([run.counters[name] / len(run.events) for name in ("expansions", "refinements")])
    # The ends of a chain cut some reaches short.
    exponents = np.polyfit(np.log(sizes), np.log(work), 1)[0]
    assert (np.abs(exponents) < 0.05).all(), exponents
    assert np.max(work) < 120


def test_counted_work():
    """Exact numbers: what adds work to a march shows here, whatever machine it runs on."""
    counted = {}
    for count in (50, 200):
        scene, start = long_chain(count)
        run = ss.simulate(scene, 4e-3, start, method="local")
        names = ("phases", "panels", "expansions", "refinements", "combinations", "leaps")
        counted[count] = (len(run.events), *(run.counters[name] for name in names))
    # Events, phases, panels, coordinates expanded, functions looked at, combinations, leaps.
    assert counted == {50: (50, 51, 3, 4891, 515, 0, 0), 200: (200, 201, 3, 22076, 2605, 0, 0)}


def test_sampling_and_energy():
    scene, start = cells("grid", 25, 1, static=True)
    local, whole = both(scene, start, 0.01)
    instants = np.unique(np.concatenate([np.linspace(0.0, 0.01, 50), whole.events.time]))
    times = 0.5 * (instants[1:] + instants[:-1])
    times = times[np.diff(instants) > 1e-9]
    a, b = local.sample(times), whole.sample(times)
    for name in ("position", "velocity", "normal_force", "friction_force"):
        assert np.abs(a[name] - b[name]).max() <= 1e-6 * np.abs(b[name]).max(), name
    # In another order the same to the last bit.
    order = np.random.default_rng(0).permutation(times.size)
    again = local.sample(times[order])
    assert np.array_equal(again["position"], a["position"].isel(time=order))
    balance, other = local.balance(), whole.balance()
    assert abs(balance.residual) <= 1e-12 * abs(other.damping)
    assert balance.impact == pytest.approx(other.impact, rel=1e-7)
    assert np.array_equal(local.events.combination, whole.events.combination)


def test_loads():
    loads = [
        ss.Harmonic({0: 20.0}, frequency=150.0),
        ss.Switched({7: 300.0}, times=[4e-3, 7e-3], values=[0.0, 1.0, -1.0]),
    ]
    scene, start = cells("chain", 12, 3)
    scene = scene.replace(loads=loads)
    local, whole = both(scene, start, 0.012)
    assert np.count_nonzero(whole.events.kind == "load") == 2
    assert_same(local, whole)


def test_friction_under_a_given_force_and_stops():
    count = 20
    rng = np.random.default_rng(5)
    springs = sp.diags_array(
        [np.full(count - 1, -4e4), np.full(count, 9e4), np.full(count - 1, -4e4)], offsets=[-1, 0, 1]
    )
    contacts = [
        ss.Contact(
            tangential=i, normal=None, normal_force=400.0, friction=0.3, static_friction=0.5, slider_speed=0.2
        )
        for i in range(0, count, 2)
    ]
    contacts += [ss.Contact(tangential=None, normal=i, gap=1e-5, restitution=0.5) for i in range(1, count, 2)]
    scene = ss.Scene(np.ones(count), springs, damping=None, contacts=contacts)
    start = ss.State(
        np.zeros(count), rng.normal(0.0, 0.05, count) * np.tile([0.0, 1.0], count // 2), "+" * 10 + "d" * 10
    )
    local, whole = both(scene, start, 0.1)
    assert len(whole.events) > 20
    assert_same(local, whole, 1e-8)


@pytest.mark.parametrize("most", [0, 1, 7, 60])
def test_max_events(most):
    scene, start = long_chain(50)
    local, whole = both(scene, start, 1.0, max_events=most)
    assert local.stop_reason == "max_events"
    assert len(local.events) == len(whole.events) == most
    assert local.duration == pytest.approx(whole.duration, rel=1e-12)
    assert np.isfinite(local.state(local.duration).position).all()


def test_uncoupled_parts_are_no_special_case():
    part = equal_chain(2, friction=0.5)
    stiffness = sp.block_diag([part.stiffness] * 3, format="csr")
    contacts = [
        ss.Contact(tangential=8 * k + 4 * i + 2, normal=8 * k + 4 * i + 3, friction=0.5, slider_speed=0.05)
        for k in range(3)
        for i in range(2)
    ]
    scene = ss.Scene(
        np.tile(part.mass, 3), stiffness, ss.Rayleigh(stiffness=1e-4), np.tile(part.force, 3), contacts
    )
    position = np.zeros(24)
    position[3::4] = np.linspace(1e-5, 1e-4, 6)
    local, whole = both(scene, ss.State(position, np.zeros(24), "d" * 6), 0.02)
    assert_same(local, whole)


def test_uncoupled_parts_choose_for_themselves():
    """A chain too large for modes marches locally beside two small parts that go by modes."""
    chain, own = long_chain(60)
    small = ss.models.two_subsystems()
    sliding = ss.steady_sliding(small).perturbed(velocity={"x1": 1e-3})
    contacts = list(chain.contacts)
    for first in (chain.size, chain.size + small.size):
        contacts += [
            dataclasses.replace(
                contact,
                tangential=first + int(np.argmax(small.tangential_direction(k))),
                normal=first + int(np.argmax(small.normal_direction(k))),
            )
            for k, contact in enumerate(small.contacts)
        ]
    scene = ss.Scene(
        np.concatenate([chain.mass, small.mass, small.mass]),
        sp.block_diag([chain.stiffness, small.stiffness, 1.1 * small.stiffness], format="csr"),
        chain.damping,
        np.concatenate([chain.force, small.force, small.force]),
        contacts,
    )
    start = ss.State(
        np.concatenate([own.position, sliding.position, sliding.position]),
        np.concatenate([own.velocity, sliding.velocity, sliding.velocity]),
        "d" * 60 + "++++",
    )
    run = ss.simulate(scene, 5e-3, start)
    alone = ss.simulate(chain, 5e-3, own)
    assert run.counters["expansions"] == alone.counters["expansions"] > 0
    assert run.counters["leaps"] > 0
    assert_same(ss.simulate(scene, 5e-3, start, method="local"), run)
    assert_identical(pickle.loads(pickle.dumps(run)), run)
    most = len(run.events) // 2
    less = ss.simulate(scene, 5e-3, start, max_events=most)
    assert np.array_equal(less.events.time, run.events.time[:most])
    assert np.array_equal(less.state(less.duration).position, run.state(less.duration).position)
    assert_identical(pickle.loads(pickle.dumps(less)), less)


def test_what_cannot_be_marched_locally_is_refused():
    mass = sp.csr_array([[1.0, 0.1], [0.1, 1.0]])
    stiffness = 1e4 * np.eye(2)
    scene = ss.Scene(mass, stiffness)
    with pytest.raises(ss.StickslipError, match="'local' does not work here: mass couples"):
        ss.simulate(scene, 0.1, ss.State([1e-3, 0.0], [0.0, 0.0], ""), method="local")


def bouncing(kind="grid", count=16, seed=2):
    """Return cells that fall, bounce with accumulations, stick and slip, under a load that is switched."""
    scene, start = cells(kind, count, seed, restitution=0.5, static=True)
    loads = [
        ss.Harmonic({0: 20.0}, frequency=150.0),
        ss.Switched({7: 300.0}, times=[4e-3], values=[0.0, 1.0]),
    ]
    return scene.replace(loads=loads), start


@pytest.mark.parametrize("limits", [{}, {"max_events": 30}, {"accumulation_tolerance": 1e-6}], ids=str)
def test_a_motion_comes_back_from_its_record_to_the_last_bit(limits):
    scene, start = bouncing()
    run = ss.simulate(scene, 0.012, start, method="local", **limits)
    assert len(run.events) >= 30
    assert limits == {"max_events": 30} or len(run.accumulations) > 3
    again = pickle.loads(pickle.dumps(run))
    assert_identical(again, run)
    balance, other = again.balance(), run.balance()
    assert (balance.residual, balance.impact, balance.damping) == (
        other.residual,
        other.impact,
        other.damping,
    )
    # A record of a record is the same one.
    assert pickle.dumps(pickle.loads(pickle.dumps(again)).core.record()) == pickle.dumps(again.core.record())


def test_a_motion_keeps_what_its_events_have_set():
    """Not a state for each event: a record of a long chain is a fraction of its states."""
    scene, start = long_chain(300)
    run = ss.simulate(scene, 2e-3, start, method="local")
    states = 8 * 2 * 1200 * len(run.events)
    assert len(pickle.dumps(run.core.record())) < states / 10


def test_many_local_runs():
    scene, start = bouncing(count=9)
    starts = [start, start.perturbed(velocity={0: 1e-3})]
    batch = ss.simulate_many(scene, starts, duration=0.01, method="local", threads=2)
    for one, single in zip(batch, starts, strict=True):
        assert_identical(one.run, ss.simulate(scene, 0.01, single, method="local"))


def test_large_sparse_scenes_march_locally_by_themselves():
    """Beyond the size at which modes are thought of, and where no product is dense."""
    for count, local in ((40, False), (60, True)):
        scene, start = long_chain(count)
        run = ss.simulate(scene, 2e-3, start)
        assert (run.counters["expansions"] > 0) == local
    stiffness = sp.csr_array(scene.stiffness).toarray() + 1e-3
    dense = ss.Scene(np.ones(240), stiffness, force=scene.force, contacts=scene.contacts)
    run = ss.simulate(dense, 2e-4, ss.State(start.position, start.velocity, "d" * 60))
    assert run.counters["expansions"] == 0


@pytest.mark.parametrize("by_time", [False, True])
def test_a_run_that_is_stopped_keeps_what_it_has(by_time):
    scene, start = cells("chain", 100, 1, static=True)
    whole = ss.simulate(scene, 0.01, start, method="local")
    limit = {"time_limit": 1e-9} if by_time else {"max_events": 64}
    run = ss.simulate(scene, 0.01, start, method="local", **limit)
    assert run.stop_reason == ("time_limit" if by_time else "max_events")
    assert run.duration < whole.duration
    assert_identical(pickle.loads(pickle.dumps(run)), run)
    count = len(run.events)
    assert np.array_equal(run.events.time, whole.events.time[:count])
    end, there = run.state(run.duration), whole.state(run.duration)
    assert np.array_equal(end.position, there.position)
