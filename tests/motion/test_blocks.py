"""Scenes in parts that nothing couples: each runs by itself, and the whole is all of them."""

import dataclasses
import itertools
import pickle

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import block_diag

import stickslip as ss
from identical import assert_identical

DURATION = 0.2
#: kg, N/m: an oscillator that touches nothing.
MASS, STIFFNESS = 0.8, 2e4


def dense(matrix):
    return matrix.toarray() if hasattr(matrix, "toarray") else np.asarray(matrix)


class SideBySide:
    """Scenes as one without a spring between them, the dofs of one among those of the others."""

    def __init__(self, *scenes, **changes):
        owner = np.repeat(np.arange(len(scenes)), [scene.size for scene in scenes])
        owner = np.random.default_rng(1).permutation(owner)
        #: Of the dofs and contacts of each scene, in the whole.
        self.places = [np.flatnonzero(owner == k) for k in range(len(scenes))]
        counts = np.cumsum([0, *(len(scene.contacts) for scene in scenes)])
        self.contacts = [slice(first, last) for first, last in itertools.pairwise(counts)]
        self.scenes = scenes
        inverse = np.argsort(np.concatenate(self.places))
        contacts = [
            dataclasses.replace(contact, tangential=self.vector(k, t), normal=self.vector(k, n))
            for k, scene in enumerate(scenes)
            for contact, t, n in (
                (contact, scene.tangential_direction(index), scene.normal_direction(index))
                for index, contact in enumerate(scene.contacts)
            )
        ]
        self.scene = ss.Scene(
            np.concatenate([scene.mass for scene in scenes])[inverse],
            block_diag(*(dense(scene.stiffness) for scene in scenes))[np.ix_(inverse, inverse)],
            damping=scenes[0].damping,
            force=np.concatenate([scene.force for scene in scenes])[inverse],
            contacts=contacts,
            **changes,
        )

    def vector(self, scene, part):
        whole = np.zeros(sum(len(places) for places in self.places))
        whole[self.places[scene]] = part
        return whole

    def start(self, *starts):
        position = sum(self.vector(k, start.position) for k, start in enumerate(starts))
        velocity = sum(self.vector(k, start.velocity) for k, start in enumerate(starts))
        return ss.State(position, velocity, "".join(start.combination for start in starts))


def disturbed(scene, speed=1e-3):
    return ss.steady_sliding(scene).perturbed(velocity={"x1": speed})


@pytest.fixture(scope="module")
def parts():
    slow, fast = ss.models.two_subsystems(), ss.models.two_subsystems(friction=2.2, slider_speed=0.05)
    free = ss.Scene([MASS], [[STIFFNESS]], damping=slow.damping)
    whole = SideBySide(slow, free, fast)
    starts = [disturbed(slow), ss.State([1e-3], [0.0], ""), disturbed(fast, 2e-3)]
    return whole, starts


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_each_part_runs_as_if_it_were_alone(parts, method):
    whole, starts = parts
    run = ss.simulate(whole.scene, DURATION, whole.start(*starts), method=method)
    alone = [
        ss.simulate(scene, DURATION, start, method=method)
        for scene, start in zip(whole.scenes, starts, strict=True)
    ]
    for k, (part, contacts) in enumerate(zip(alone, whole.contacts, strict=True)):
        mine = (run.events.contact >= contacts.start) & (run.events.contact < contacts.stop)
        assert np.array_equal(run.events.time[mine], part.events.time)
        assert np.array_equal(run.events.contact[mine] - contacts.start, part.events.contact)
        assert np.array_equal(run.events.kind[mine], part.events.kind)
        times = np.linspace(0.0, DURATION, 501)
        position = run.sample(times).position.to_numpy()[:, whole.places[k]]
        expected = part.sample(times).position.to_numpy()
        assert np.abs(position - expected).max() <= 1e-15 * np.abs(expected).max() * 40
    assert len(run.events) == sum(len(part.events) for part in alone) > 100
    assert np.all(np.diff(run.events.time) >= 0.0)
    for counter in ("panels", "leaps", "refinements", "combinations"):
        assert run.counters[counter] == sum(part.counters[counter] for part in alone), counter
    instants = len(np.unique(run.events.time))
    assert run.counters["phases"] == 1 + instants


def test_a_part_without_contacts_swings_as_it_should(parts):
    whole, starts = parts
    run = ss.simulate(whole.scene, DURATION, whole.start(*starts))
    times = np.linspace(0.0, DURATION, 201)
    beta = whole.scene.damping.stiffness
    omega2 = STIFFNESS / MASS
    decay = 0.5 * beta * omega2
    omega = np.sqrt(omega2 - decay**2)
    expected = 1e-3 * np.exp(-decay * times) * (np.cos(omega * times) + decay / omega * np.sin(omega * times))
    found = run.sample(times).position.to_numpy()[:, whole.places[1][0]]
    assert np.abs(found - expected).max() < 1e-15


def test_the_number_of_events_ends_the_whole(parts):
    whole, starts = parts
    start = whole.start(*starts)
    full = ss.simulate(whole.scene, DURATION, start)
    for most in (0, 1, 50):
        run = ss.simulate(whole.scene, DURATION, start, max_events=most)
        assert run.stop_reason == "max_events"
        assert np.array_equal(run.events.time, full.events.time[:most])
        assert run.duration == (full.events.time[most - 1] if most else 0.0)
        assert run.sample([run.duration]).position.equals(full.sample([run.duration]).position)


@pytest.mark.parametrize("limits", [{}, {"max_events": 50}, {"time_limit": 1e-3}], ids=str)
def test_the_whole_comes_back_from_its_record_to_the_last_bit(parts, limits):
    whole, starts = parts
    run = ss.simulate(
        whole.scene, 1e4 if "time_limit" in limits else DURATION, whole.start(*starts), **limits
    )
    assert run.stop_reason == next(iter(limits), "duration")
    assert_identical(pickle.loads(pickle.dumps(run)), run)


def test_each_part_keeps_the_states_of_its_own_events(parts):
    """Not a state of the whole at every event: its record is about as large as those of the parts."""
    whole, starts = parts
    size = len(pickle.dumps(ss.simulate(whole.scene, DURATION, whole.start(*starts)).core.record()))
    alone = [
        len(pickle.dumps(ss.simulate(scene, DURATION, start).core.record()))
        for scene, start in zip(whole.scenes, starts, strict=True)
    ]
    assert size == pytest.approx(sum(alone), rel=0.05)


def test_energy_of_the_whole_closes(parts):
    whole, starts = parts
    run = ss.simulate(whole.scene, DURATION, whole.start(*starts))
    balance = run.balance()
    assert abs(balance.residual) <= 1e-13 * balance.turnover
    alone = ss.simulate(whole.scenes[0], DURATION, starts[0]).balance()
    assert balance.turnover > alone.turnover


def test_an_interrupted_part_leaves_all_up_to_there(parts):
    whole, starts = parts
    start = whole.start(*starts)
    run = ss.simulate(whole.scene, 1e4, start, time_limit=0.05)
    assert run.stop_reason == "time_limit"
    assert 0.0 < run.duration < 1e4
    full = ss.simulate(whole.scene, min(run.duration, 0.5), start)
    assert np.array_equal(run.events.time[: len(full.events)], full.events.time)
    assert np.isfinite(run.sample([run.duration]).position.to_numpy()).all()


def test_many_parts_are_asked_often_whether_they_are_to_stop():
    """Each part alone would be asked after hundreds of its own panels."""
    count = 3000
    contacts = [
        ss.Contact(tangential=2 * k, normal=2 * k + 1, friction=0.5, static_friction=0.8, slider_speed=0.01)
        for k in range(count)
    ]
    stiffness = sp.diags_array(np.tile([3e4, 5e4], count)).tocsr()
    scene = ss.Scene(np.ones(2 * count), stiffness, None, np.tile([0.0, -20.0], count), contacts)
    start = ss.steady_sliding(scene).perturbed(velocity=np.tile([-0.05, 0.0], count))
    run = ss.simulate(scene, 1e4, start, time_limit=1e-3)
    assert run.stop_reason == "time_limit"
    assert 0.0 < run.duration < 1e4
    assert run.counters["panels"] < 20 * count


def test_the_part_that_stops_first_stops_all():
    """One part without bound: the rest is given up to where it leaves the range of numbers."""
    slow = ss.models.two_subsystems()
    unstable = ss.Scene([1.0], [[-1e8]], damping=slow.damping)
    whole = SideBySide(slow, unstable)
    start = whole.start(disturbed(slow), ss.State([1.0], [0.0], ""))
    run = ss.simulate(whole.scene, DURATION, start)
    assert run.stop_reason == "unbounded"
    alone = ss.simulate(unstable, DURATION, ss.State([1.0], [0.0], ""))
    assert run.duration == alone.duration < DURATION
    assert np.all(run.events.time <= run.duration)
    assert np.isfinite(run.sample([run.duration]).position.to_numpy()).all()


def test_contacts_along_slanted_directions_keep_their_parts_apart(parts):
    """Rotated dofs of a part: its contact coordinates are none of them, and still apart from the other."""
    slow = ss.models.two_subsystems()
    rotation, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(8, 8)))
    turned = ss.Scene(
        rotation.T @ np.diag(slow.mass) @ rotation,
        rotation.T @ dense(slow.stiffness) @ rotation,
        damping=slow.damping,
        force=rotation.T @ slow.force,
        contacts=[
            dataclasses.replace(
                contact,
                tangential=rotation.T @ slow.tangential_direction(k),
                normal=rotation.T @ slow.normal_direction(k),
            )
            for k, contact in enumerate(slow.contacts)
        ],
    )
    free = ss.Scene([[MASS]], [[STIFFNESS]], damping=slow.damping)
    mass = block_diag(turned.mass, free.mass)
    scene = ss.Scene(
        mass,
        block_diag(dense(turned.stiffness), free.stiffness),
        damping=slow.damping,
        force=np.append(turned.force, 0.0),
        contacts=[
            dataclasses.replace(
                contact, tangential=np.append(contact.tangential, 0.0), normal=np.append(contact.normal, 0.0)
            )
            for contact in turned.contacts
        ],
    )
    start = disturbed(slow)
    state = ss.State(
        np.append(rotation.T @ start.position, 1e-3), np.append(rotation.T @ start.velocity, 0.0), "++"
    )
    run = ss.simulate(scene, DURATION, state)
    alone = ss.simulate(slow, DURATION, start)
    assert np.abs(run.events.time - alone.events.time).max() < 1e-12
    assert np.array_equal(run.events.combination, alone.events.combination)


def test_a_part_that_is_ahead_by_many_events_does_not_end_the_run():
    """A step of a local march is a panel, in which one contact can strike many times."""
    chain = sp.diags_array([-np.ones(119), 2.0 * np.ones(120), -np.ones(119)], offsets=[-1, 0, 1])
    stiffness = sp.block_diag([25.0 * chain, 25.0 * chain, 30.0 * np.eye(2)], format="csr")
    force, position, velocity = np.zeros((3, 242))
    force[[120, 241]] = -20.0
    position[120], velocity[241] = 0.1, 0.05
    contacts = [
        ss.Contact(tangential=0, normal=120, friction=0.3, slider_speed=5.0, restitution=0.5),
        ss.Contact(tangential=240, normal=241, friction=0.3, slider_speed=5.0, restitution=0.9),
    ]
    scene = ss.Scene(np.ones(242), stiffness, ss.Rayleigh(stiffness=1e-5), force, contacts)
    start = ss.State(position, velocity, "dd")
    full = ss.simulate(scene, 0.3, start)
    for most in (40, 60, 150):
        run = ss.simulate(scene, 0.3, start, max_events=most)
        assert run.stop_reason == "max_events"
        assert len(run.events) >= most
        assert np.array_equal(run.events.time, full.events.time[: len(run.events)])
        assert run.duration == run.events.time[-1]


@pytest.mark.parametrize("seed", [0, 1, 4, 7])
def test_energy_closes_where_parts_slide_by_laws_of_friction(seed):
    """The time at which a series ends is rounded on the clock of the whole."""
    random = np.random.default_rng(seed)
    law = ss.friction.Stribeck(0.5, 0.3, 0.1)
    contacts = [
        ss.Contact(tangential=2 * k, normal=2 * k + 1, friction=law, slider_speed=speed)
        for k, speed in enumerate((0.02, 0.3))
    ]
    stiffness = np.diag([3e2, 5e4, 4e2, 6e4] * random.uniform(0.8, 1.2, 4))
    force = [0.0, -20.0, 0.0, -20.0]
    scene = ss.Scene(np.ones(4), stiffness, ss.Rayleigh(stiffness=1e-5), force, contacts)
    start = ss.steady_sliding(scene).perturbed(velocity=[-0.05, 0.0, 0.05, 0.0])
    run = ss.simulate(scene, random.uniform(0.3, 1.5), start, max_events=int(random.integers(1, 6)))
    balance = run.balance()
    assert abs(balance.residual) <= 1e-13 * balance.turnover
