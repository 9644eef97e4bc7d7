"""Steady sliding with open contacts, against a trial of every choice of open contacts by dense algebra."""

import itertools

import numpy as np
import pytest

import stickslip as ss
from quad_block import quad_block

#: Contacts of the random problems, and how many of each.
PROBLEMS = [(1, 200), (2, 300), (4, 300), (7, 200)]


def random_problem(rng, count, friction=1.0):
    """A scene with `count` contacts, more dofs than they need, and a load that opens some of them."""
    size = 2 * count + int(rng.integers(0, 4))
    root = rng.normal(size=(size, size))
    springs = root @ root.T + 0.3 * np.eye(size)
    scale = 10.0 ** rng.uniform(-2.0, 2.0)
    contacts = [
        ss.Contact(
            tangential=2 * i,
            normal=2 * i + 1,
            friction=float(rng.uniform(0.0, friction)),
            slider_speed=float(rng.choice([-1.0, 1.0])),
            gap=float(rng.choice([0.0, rng.normal()])),
        )
        for i in range(count)
    ]
    force = scale * rng.normal(size=size)
    return ss.Scene(rng.uniform(0.5, 2.0, size), scale * springs, force=force, contacts=contacts)


def equilibria(scene):
    """Every equilibrium of steady sliding as (open contacts, position, normal forces)."""
    stiffness, count = np.asarray(scene.stiffness), len(scene.contacts)
    normal = [contact.normal for contact in scene.contacts]
    push = np.zeros((scene.size, count))
    for i, contact in enumerate(scene.contacts):
        push[contact.normal, i] = 1.0
        push[contact.tangential, i] = np.sign(contact.slider_speed) * contact.friction
    clearance = np.array([contact.gap for contact in scene.contacts])
    found = []
    for closed in itertools.product([True, False], repeat=count):
        held = np.flatnonzero(closed)
        # K x - push N = F, with gap n . x + clearance = 0 of closed contacts.
        system = np.block(
            [
                [stiffness, -push[:, held]],
                [np.eye(scene.size)[np.array(normal)[held]], np.zeros((held.size, held.size))],
            ]
        )
        if np.linalg.cond(system) > 1e13:
            continue
        solution = np.linalg.solve(system, np.concatenate([scene.force, -clearance[held]]))
        position, forces = solution[: scene.size], np.zeros(count)
        forces[held] = solution[scene.size :]
        gaps = position[normal] + clearance
        if (forces[held] >= 0.0).all() and np.delete(gaps, held).min(initial=0.0) >= 0.0:
            found.append((closed, position, forces))
    return found


@pytest.mark.parametrize(("count", "problems"), PROBLEMS)
def test_against_every_choice_of_open_contacts(count, problems):
    rng = np.random.default_rng(count)
    opened = several = none = 0
    for _ in range(problems):
        scene = random_problem(rng, count)
        expected = equilibria(scene)
        if not expected:
            none += 1
            with pytest.raises(ss.InputError, match=r"no equilibrium with open contacts was found"):
                ss.steady_sliding(scene)
            continue
        found = ss.steady_sliding(scene)
        closed = tuple(letter != "d" for letter in found.combination)
        match = [(x, n) for choice, x, n in expected if choice == closed]
        assert len(match) == 1
        position, forces = match[0]
        # Of systems with a condition of some thousands.
        assert found.position == pytest.approx(position, abs=1e-9 * np.abs(position).max())
        assert found.normal_forces == pytest.approx(forces, abs=1e-9 * np.abs(scene.force).max())
        assert found.unique is (len(expected) == 1)
        if found.unique:
            assert found.other is None
        else:
            second = tuple(letter != "d" for letter in found.other.combination)
            assert second != closed
            assert second in [choice for choice, _, _ in expected]
        opened += "d" in found.combination
        several += not found.unique
        # As it is, it is a start, at rest.
        ss.simulate(scene, 1e-3, found, method="taylor", max_events=1)
        forces_there = found.contact_forces(scene).normal_force.to_numpy()
        assert forces_there == pytest.approx(forces, abs=1e-8 * np.abs(scene.force).max())
    assert opened > problems // 3
    assert none + several > 0 or count == 1


def test_a_mass_that_only_contacts_hold():
    """K is singular: a free plank, its weight on the left one of two supports."""
    stiffness = np.diag([1.0, 0.0, 1.0, 0.0]) * 1e3
    stiffness[np.ix_([1, 3], [1, 3])] = 0.0
    contacts = [
        ss.Contact(tangential=0, normal=1, friction=0.2, slider_speed=1.0),
        ss.Contact(tangential=2, normal=3, friction=0.2, slider_speed=1.0, gap=1e-3),
    ]
    scene = ss.Scene(np.ones(4), stiffness, force=[0.0, -5.0, 0.0, -3.0], contacts=contacts)
    found = ss.steady_sliding(scene)
    assert found.combination == "++"
    assert found.normal_forces == pytest.approx([5.0, 3.0], rel=1e-14)
    assert found.position == pytest.approx([1e-3, 0.0, 6e-4, -1e-3], rel=1e-14)
    assert found.unique is True


def test_a_load_that_vanishes_keeps_contacts_closed():
    scene = ss.Scene(
        [1.0, 1.0], np.eye(2), contacts=[ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=1.0)]
    )
    found = ss.steady_sliding(scene)
    assert (found.combination, found.normal_forces.tolist(), found.unique) == ("+", [0.0], True)


def test_two_equilibria_are_both_shown():
    """Friction 2 on a spring of slope 1: open, or closed with the normal force that friction makes.

    K = [[1, a], [a, 1]], a = 0.9: ``S = K_nn - K_nt (K_tn - mu K_nn) / (K_tt - mu K_nt)`` is negative from
    friction 1 / a on, and the force that opens the contact at S < 0 is one that presses it, too.
    """
    stiffness = np.array([[1.0, 0.9], [0.9, 1.0]])
    contact = ss.Contact(tangential=0, normal=1, friction=2.0, slider_speed=1.0)
    for load in (1.0, -1.0):
        scene = ss.Scene([1.0, 1.0], stiffness, force=[0.0, load], contacts=[contact])
        expected = equilibria(scene)
        if not expected:
            with pytest.raises(ss.InputError, match="contact 0 would pull"):
                ss.steady_sliding(scene)
            continue
        found = ss.steady_sliding(scene)
        assert found.unique is False
        assert {found.combination, found.other.combination} == {"+", "d"}
        assert found.other.unique is None
        assert "one of several" in repr(found)


def test_hundreds_of_contacts():
    """A block whose preload reaches half of its lower edge: the others open."""
    scene = quad_block(200, 3, sparse=True)
    assert len(scene.contacts) == 201
    force = scene.force.copy()
    normal = np.array([contact.normal for contact in scene.contacts])
    force[normal[:100]] += 3.0 * np.abs(force).max()
    scene = scene.replace(force=force)
    found = ss.steady_sliding(scene)
    opened = np.array([letter == "d" for letter in found.combination])
    assert 20 < opened.sum() < 180
    gaps = found.position[normal]
    assert (gaps[opened] > 0.0).all()
    assert (np.abs(gaps[~opened]) <= 1e-12 * np.abs(gaps).max()).all()
    assert (found.normal_forces[~opened] >= 0.0).all()
    assert (found.normal_forces[opened] == 0.0).all()
    # The structure is in balance: K x = F + sum of the contact forces.
    forces = force.copy()
    forces[normal] += found.normal_forces
    tangential = np.array([contact.tangential for contact in scene.contacts])
    forces[tangential] += 0.3 * found.normal_forces
    residual = scene.stiffness @ found.position - forces
    size = abs(scene.stiffness) @ np.abs(found.position)
    assert (np.abs(residual) <= 1e-13 * size.max()).all()
    run = ss.simulate(scene, 1e-7, found)
    assert run.events.combination.size == 0


def test_modes_by_default_say_which_combination_it_finds():
    scene = ss.models.two_subsystems(preload_displacement=-1e-3, friction=0.9)
    found = ss.steady_sliding(scene)
    assert found.combination == "dd"
    assert found.unique is True
    with pytest.raises(ss.NoSteadyStateError, match='combination="dd"'):
        ss.complex_modes(scene)
    assert ss.complex_modes(scene, found.combination).combination == "dd"


def dependent_problem(rng):
    """A body of three dofs on two to four points: more directions than dofs."""
    count = int(rng.integers(2, 5))
    arms, height = rng.uniform(-0.1, 0.1, count), 0.02
    contacts = [
        ss.Contact(
            tangential={"x": 1.0, "turn": height},
            normal={"y": 1.0, "turn": float(arm)},
            friction=float(rng.uniform(0.0, 0.5)),
            slider_speed=0.1,
        )
        for arm in arms
    ]
    stiffness = np.diag([1e6, 1e4, 10.0 ** rng.uniform(1.0, 3.0)])
    force = [0.0, -100.0, float(rng.uniform(-12.0, 12.0))]
    scene = ss.Scene([1.0, 1.0, 1e-3], stiffness, force=force, contacts=contacts, dofs=["x", "y", "turn"])
    return scene, arms, height


def equilibria_of_body(scene, arms, height):
    """Yield every equilibrium in which at most two points are closed, which hold y and turn."""
    stiffness, count = np.asarray(scene.stiffness), len(arms)
    normal = np.column_stack([np.zeros(count), np.ones(count), arms])
    friction = np.array([contact.friction for contact in scene.contacts])
    push = normal + friction[:, None] * np.array([1.0, 0.0, height])
    for size in range(3):
        for held in itertools.combinations(range(count), size):
            held = list(held)
            system = np.block([[stiffness, -push[held].T], [normal[held], np.zeros((size, size))]])
            solution = np.linalg.solve(system, np.concatenate([scene.force, np.zeros(size)]))
            position, forces = solution[:3], np.zeros(count)
            forces[held] = solution[3:]
            gaps = np.delete(normal @ position, held)
            if (forces >= 0.0).all() and gaps.min(initial=0.0) >= -1e-15:
                yield position


def test_dependent_directions_against_every_choice():
    """The equilibrium is one of those found by hand, and a start at rest."""
    rng = np.random.default_rng(7)
    opened = 0
    for _ in range(300):
        scene, arms, height = dependent_problem(rng)
        expected = list(equilibria_of_body(scene, arms, height))
        assert expected
        found = ss.steady_sliding(scene)
        size = np.abs(found.position).max()
        # Of systems with a condition of some millions; where all of a pad is held, y and turn vanish.
        assert min(np.abs(found.position - x).max() for x in expected) <= 1e-9 * size
        opened += "d" in found.combination
    assert opened > 100


def test_a_pad_that_lifts_off_at_one_point_stays_there():
    points = [
        ss.Contact(
            tangential={"x": 1.0, "turn": 0.02},
            normal={"y": 1.0, "turn": arm},
            friction=0.3,
            slider_speed=0.1,
        )
        for arm in (-0.05, 0.05)
    ]
    scene = ss.Scene(
        [1.0, 1.0, 1e-3],
        np.diag([1e6, 1e4, 200.0]),
        force=[0.0, -100.0, 9.0],
        contacts=points,
        dofs=["x", "y", "turn"],
        impact_friction=True,
    )
    found = ss.steady_sliding(scene)
    assert found.combination == "+d"
    run = ss.simulate(scene, 0.1, found)
    assert len(run.events) == 0
    assert np.abs(run.state(0.1).position - found.position).max() <= 1e-16
