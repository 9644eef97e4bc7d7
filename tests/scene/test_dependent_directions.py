"""Contact directions that depend on each other: floor and ceiling, a stop on a friction dof, rigid pads."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

import stickslip as ss
from random_scenes import drawn_scenes

EPS = np.finfo(float).eps


def between(floor=0.0, ceiling=1.5, restitution=0.8, **law):
    """A mass of 1 kg under a force of -10 N between a floor and a ceiling."""
    stops = [
        ss.Contact(normal=0, gap=-floor, restitution=restitution, name="floor"),
        ss.Contact(normal=[-1.0], gap=ceiling, restitution=restitution, name="ceiling"),
    ]
    return ss.Scene([1.0], [[0.0]], force=[-10.0], contacts=stops, **law)


def test_a_floor_and_a_ceiling_in_closed_form():
    """Between stops v^2 changes by 2 g h, each takes it to e v, and rest comes after 2 v / (g (1 - e))."""
    with mp.workdps(40):
        e, g = mp.mpf("0.8"), mp.mpf(10)
        speeds, times, which = [], [], []
        time, speed, height = mp.mpf(0), mp.mpf(10), mp.mpf(1)
        while True:
            # Upwards from `height`.
            if speed**2 > 2 * g * (mp.mpf("1.5") - height):
                arrival = mp.sqrt(speed**2 - 2 * g * (mp.mpf("1.5") - height))
                time += (speed - arrival) / g
                speeds.append(e * arrival)
                times.append(time)
                which.append("ceiling")
                landing = mp.sqrt((e * arrival) ** 2 + 2 * g * mp.mpf("1.5"))
                time += (landing - e * arrival) / g
            else:
                rest = time + 2 * speed / (g * (1 - e))
                landing = speed
                time += 2 * speed / g
            speed, height = e * landing, mp.mpf(0)
            speeds.append(speed)
            times.append(time)
            which.append("floor")
            if len(times) > 20:
                break
        assert [float(v) for v in speeds[:2]] == pytest.approx([7.5894663844, 7.48758973235], rel=1e-11)
        assert [float(t) for t in times[:2]] == pytest.approx(
            [0.0513167019494862, 0.228318780052882], rel=1e-13
        )
        assert float(rest) == pytest.approx(6.20723724208631, rel=1e-14)
    for method in ("auto", "taylor"):
        run = ss.simulate(between(), 7.0, ss.State([1.0], [10.0], "dd"), method=method)
        assert [("floor", "ceiling")[i] for i in run.events.contact[: len(which)]] == which
        assert (run.events.contact == 1).sum() == 2
        assert run.events.time[: len(times)] == pytest.approx([float(t) for t in times], rel=1e-13)
        after = np.abs(run.event_states()[1][: len(speeds), 0])
        assert after == pytest.approx([float(v) for v in speeds], rel=1e-12)
        assert run.events.kind[-1] == "accumulation"
        assert run.events.time[-1] == pytest.approx(float(rest), rel=1e-12)
        assert run.events.combination[-1] == "+d"
        balance = run.balance()
        assert abs(balance.residual) <= 1e-12 * balance.turnover
        again = pickle.loads(pickle.dumps(run))
        assert (
            again.sample(np.linspace(0, 7, 20)).position == run.sample(np.linspace(0, 7, 20)).position
        ).all()


def test_a_force_towards_the_ceiling_rests_there():
    scene = between(restitution=0.0).replace(force=[10.0])
    run = ss.simulate(scene, 1.0, ss.State([1.0], [0.0], "dd"))
    assert list(run.events.combination) == ["d+"]
    assert run.events.time == pytest.approx([np.sqrt(0.1)], rel=1e-14)
    sample = run.sample([0.5])
    assert float(sample.position.squeeze()) == 1.5
    assert sample.normal_force.values[0] == pytest.approx([0.0, 10.0], rel=1e-15)
    at_rest = ss.steady_sliding(between())
    assert at_rest.combination == "+d"
    assert ss.steady_sliding(scene).combination == "d+"
    assert ss.steady_sliding(scene).position == pytest.approx([1.5])
    assert ss.equations_of(scene, "d+").stiffness.shape == (0, 0)
    # Both at once are held by what is held already.
    assert ss.equations_of(scene, "++").stiffness.shape == (0, 0)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_stop_on_a_dof_with_friction(restitution):
    """mu N = 3 N slows the mass by 3 m/s^2 until it strikes; friction turns round in the same instant."""
    scene = ss.Scene(
        [1.0],
        [[0.0]],
        contacts=[
            ss.Contact(tangential=0, friction=0.3, normal_force=10.0),
            ss.Contact(normal=[-1.0], gap=1.0, restitution=restitution),
        ],
    )
    for method in ("auto", "taylor"):
        run = ss.simulate(scene, 3.0, ss.State([0.0], [4.0], "-d"), method=method)
        arrival = np.sqrt(16.0 - 2.0 * 3.0 * 1.0)
        time = (4.0 - arrival) / 3.0
        assert run.events.time[0] == pytest.approx(time, rel=1e-13)
        if restitution == 0.0:
            assert run.events.combination[-1][0] == "s"
            assert run.state(3.0).position == pytest.approx([1.0], rel=1e-14)
            continue
        struck = run.events.combination[run.events.time == run.events.time[0]][-1]
        assert struck == "+d"
        back = restitution * arrival
        assert run.events.time[-1] == pytest.approx(time + back / 3.0, rel=1e-13)
        assert run.events.combination[-1] == "sd"
        assert run.state(3.0).position == pytest.approx([1.0 - back**2 / 6.0], rel=1e-13)
        assert abs(run.balance().residual) <= 1e-14 * run.balance().turnover


def pad(points=(-1.0, 1.0), height=0.1, friction=0.4, speed=0.1, stiffness=100.0, **law):
    """A rigid pad (x, y, angle) of 10 kg on points of a belt, pressed with 100 N and held by a spring."""
    frictions = np.broadcast_to(friction, len(points))
    contacts = [
        ss.Contact(
            tangential=[1.0, 0.0, height],
            normal=[0.0, 1.0, place],
            friction=float(mu),
            slider_speed=speed,
            **law,
        )
        for place, mu in zip(points, frictions, strict=True)
    ]
    return ss.Scene(
        [10.0, 10.0, 4.0],
        np.diag([stiffness, 0.0, 0.0]),
        force=[0.0, -100.0, 0.0],
        contacts=contacts,
        impact_friction=True,
    )


def single(friction=0.4, speed=0.1, stiffness=100.0, **law):
    """The same mass on one contact."""
    contact = ss.Contact(tangential=0, normal=1, friction=friction, slider_speed=speed, **law)
    return ss.Scene([10.0, 10.0], np.diag([stiffness, 0.0]), force=[0.0, -100.0], contacts=[contact])


@pytest.mark.parametrize("points", [(-1.0, 1.0), (-1.0, 0.3, 1.0), (-1.0, -0.2, 0.2, 1.0)])
@pytest.mark.parametrize("static", [0.5, 0.6])
def test_a_rigid_pad_moves_as_one_contact(points, static):
    """All points stick or slide together; slip begins when the total force reaches the sum of the limits."""
    count = len(points)
    for method in ("auto", "taylor"):
        pads = ss.simulate(
            pad(points, static_friction=static),
            20.0,
            ss.State(np.zeros(3), [0.1, 0.0, 0.0], "s" * count),
            method=method,
        )
        one = ss.simulate(
            single(static_friction=static), 20.0, ss.State([0.0, 0.0], [0.1, 0.0], "s"), method=method
        )
        assert len(one.events) >= 4
        assert set(pads.events.combination) == {letter * count for letter in "+s"}
        times = pads.events.time.reshape(-1, count)
        assert (times == times[:, :1]).all()
        assert times[:, 0] == pytest.approx(one.events.time, rel=1e-12)
        at = np.linspace(0.003, 20.0, 101)
        theirs, ours = one.sample(at), pads.sample(at)
        assert ours.position.values[:, 0] == pytest.approx(theirs.position.values[:, 0], abs=1e-12)
        total = ours.friction_force.values.sum(axis=1)
        assert total == pytest.approx(theirs.friction_force.values[:, 0], abs=1e-9)
        assert ours.normal_force.values.sum(axis=1) == pytest.approx(np.full(101, 100.0), rel=1e-12)
        stuck = tuple(range(count))
        assert pads.undetermined["s" * count] == stuck
        assert ("+" * count in pads.undetermined) == (count > 2)
        assert "forces not determined" in str(pads.summary())
        assert one.undetermined == {}
        assert abs(pads.balance().residual) <= 1e-12 * pads.balance().turnover


@pytest.mark.parametrize("points", [(-1.0, 1.0), (-1.0, 0.3, 1.0)])
def test_a_rigid_pad_under_loads_moves_as_one_contact(points):
    """A harmonic load, a switched one, and sliders that vibrate."""
    count = len(points)
    wave = ss.Harmonic(0.05, 0.9, phase=0.4)
    loads = [
        ss.Harmonic({0: 12.0}, frequency=0.7, phase=1.0),
        ss.Switched({0: 5.0}, times=[3.0, 9.0], values=[0.0, 1.0, -1.0]),
    ]
    law = {"static_friction": 0.6, "slider_vibration": wave}
    velocity = 0.1 + 0.05 * np.cos(0.4)
    for method in ("auto", "taylor"):
        pads = ss.simulate(
            pad(points, **law).replace(loads=loads),
            20.0,
            ss.State(np.zeros(3), [velocity, 0.0, 0.0], "s" * count),
            method=method,
        )
        one = ss.simulate(
            single(**law).replace(loads=loads),
            20.0,
            ss.State([0.0, 0.0], [velocity, 0.0], "s"),
            method=method,
        )
        assert len(one.events) >= 8
        assert set(one.events.kind) >= {"load", "velocity"}
        # A switched load is one event of no contact; every other is one of each point.
        of_one = np.repeat(one.events.time, np.where(one.events.kind == "load", 1, count))
        assert pads.events.time == pytest.approx(of_one, rel=1e-11)
        at = np.linspace(0.003, 20.0, 101)
        theirs, ours = one.sample(at), pads.sample(at)
        assert ours.position.values[:, 0] == pytest.approx(theirs.position.values[:, 0], abs=1e-11)
        assert ours.friction_force.values.sum(axis=1) == pytest.approx(
            theirs.friction_force.values[:, 0], abs=1e-8
        )
        assert abs(pads.balance().residual) <= 1e-12 * pads.balance().turnover
        assert pads.balance().external == pytest.approx(one.balance().external, rel=1e-9)


def test_a_vibrating_slider_beside_a_stop_on_the_same_dof():
    """Friction on a slider that vibrates, on one that does not, and a stop: seen from the first slider.

    There the mass feels its inertia as a load. The stop would move: it is out of reach.
    """
    amplitude, frequency = 0.4, 3.0
    rate = 2.0 * np.pi * frequency
    contacts = [
        ss.Contact(tangential=[1.0], friction=0.4, static_friction=0.5, normal_force=20.0),
        ss.Contact(tangential=[1.0], friction=0.2, normal_force=3.0, slider_speed=1.5),
        ss.Contact(normal=[-1.0], gap=0.5, restitution=0.5),
    ]
    wave = ss.Harmonic(amplitude, frequency)
    shaken = [replace(contacts[0], slider_vibration=wave), *contacts[1:]]
    other = [contacts[0], replace(contacts[1], slider_vibration=replace(wave, amplitude=-amplitude))]
    mass, spring = 2.0, 150.0
    scene = ss.Scene([mass], [[spring]], contacts=shaken)
    seen = ss.Scene(
        [mass],
        [[spring]],
        contacts=[*other, contacts[2]],
        loads=[ss.Harmonic({0: (mass * rate**2 - spring) * amplitude / rate}, frequency, -np.pi / 2)],
    )
    one = ss.simulate(scene, 2.0, ss.State([0.0], [amplitude], "s+d"))
    two = ss.simulate(seen, 2.0, ss.State([0.0], [0.0], "s+d"))
    assert len(one.events) > 6
    assert list(one.events.combination) == list(two.events.combination)
    assert one.events.time == pytest.approx(two.events.time, rel=1e-11)
    for run in (one, two):
        assert abs(run.balance().residual) <= 1e-13 * run.balance().turnover


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_a_load_on_two_masses_that_a_stop_ties(method):
    """They move as one: `(m_0 + m_1) x'' + (k_0 + k_1) x = k_0 g + F cos wt`.

    Five stops on three masses: modes with and without the load have to be in the same coordinates.
    """
    mass, stiffness, gap = [0.7, 1.1, 1.6], [2500.0, 3200.0, 3900.0], 1e-3
    force, rate = 0.5, 2 * np.pi * 20.0
    normals = [{2: 1.0}, {1: 1.0}, {0: 1.0, 2: -1.0}, {1: 1.0, 0: -1.0}, {0: 1.0, 1: -1.0}]
    scene = ss.Scene(
        mass,
        np.diag(stiffness),
        # 5 N press the two masses together.
        force=[-5.0, 5.0, 0.0],
        contacts=[ss.Contact(normal=normal, gap=gap) for normal in normals],
        loads=[ss.Harmonic(amplitude={1: force}, frequency=rate / (2 * np.pi))],
    )
    place = 2e-4
    start = ss.State([place - gap, place, 0.0], [0.0] * 3, "dddd+")
    run = ss.simulate(scene, 2e-3, start, method=method)
    assert len(run.events) == 0
    # x of the second mass; the first one is `gap` below it.
    m, k = mass[0] + mass[1], stiffness[0] + stiffness[1]
    rest = stiffness[0] * gap / k
    forced = force / (k - m * rate**2)
    time = np.linspace(0.0, 2e-3, 9)
    own = np.sqrt(k / m)
    expected = rest + forced * np.cos(rate * time) + (place - rest - forced) * np.cos(own * time)
    found = run.sample(time).position.values
    assert found[:, 1] == pytest.approx(expected, abs=64.0 * EPS * rest)
    assert found[:, 0] == pytest.approx(expected - gap, abs=64.0 * EPS * rest)


def test_directions_that_are_almost_dependent_are_refused():
    """By 5e-10 of their length, and by no more than 5e-11 in any entry."""
    first = np.zeros(102)
    first[:2] = 1.0, 1e-3
    second = first.copy()
    second[2:] = 5e-11 * (-1.0) ** np.arange(100)
    for contacts in ((first, second), (second, first)):
        with pytest.raises(ss.InputError, match=r"^contact 0: directions .* are nearly parallel"):
            ss.Scene(np.ones(102), 1e4 * np.eye(102), contacts=[ss.Contact(normal=one) for one in contacts])


def test_a_pad_that_tips():
    """Pulled at its centre of mass, height h above the belt, it tips about its front edge when P h > W a."""
    height, half = 0.5, 0.2
    scene = pad((-half, half), height=height, friction=0.9, speed=0.0, stiffness=0.0)
    for pull, tips in ((35.0, False), (45.0, True)):
        pulled = scene.replace(force=[pull, -100.0, 0.0])
        run = ss.simulate(pulled, 0.2, ss.State(np.zeros(3), np.zeros(3), "ss")) if not tips else None
        if not tips:
            assert len(run.events) == 0
            forces = run.sample([0.1])
            assert forces.friction_force.values.sum() == pytest.approx(-pull)
            # About the front point: N_1 2 a = W a - P h, in this sign of the angle.
            assert sorted(forces.normal_force.values[0]) == pytest.approx(
                sorted([50.0 - pull * height / (2 * half), 50.0 + pull * height / (2 * half)])
            )
        else:
            with pytest.raises(ss.InputError, match=r"contact [01] is"):
                ss.simulate(pulled, 0.2, ss.State(np.zeros(3), np.zeros(3), "ss"))


def test_a_pad_lifts_a_point_and_comes_down_again():
    scene = pad((-0.2, 0.2), height=0.5, friction=0.3, speed=0.2, stiffness=2000.0)
    run = ss.simulate(scene, 3.0, ss.State(np.zeros(3), [0.0, 0.0, 0.0], "++"))
    assert "impact" in run.events.kind or len(run.events) >= 2
    for time in np.linspace(0.0, run.duration, 200):
        state, sample = run.state(time), run.sample([time])
        for i, contact in enumerate(scene.contacts):
            gap = scene.normal_direction(i) @ state.position + contact.gap
            assert gap >= -1e-13
            assert sample.normal_force.values[0, i] >= -1e-9
            assert sample.normal_force.values[0, i] * gap == pytest.approx(0.0, abs=1e-10)
    assert abs(run.balance().residual) <= 1e-11 * run.balance().turnover


def test_where_the_motion_depends_on_the_split_it_says_so():
    scene = pad((-1.0, 0.0, 1.0), friction=(0.2, 0.8, 0.4))
    with pytest.raises(
        (ss.InputError, ss.RunError), match=r"depends on how their forces are split; give .* stiffness"
    ):
        ss.simulate(scene, 1.0, ss.State(np.zeros(3), np.zeros(3), "+++"))
    with pytest.raises(ss.InputError, match="depends on how their forces are split"):
        ss.complex_modes(scene, "+++")
    # Where they stick it does not matter, until they slip.
    stuck = ss.State(np.zeros(3), [0.1, 0.0, 0.0], "sss")
    assert len(ss.simulate(scene, 1.0, stuck).events) == 0


def test_a_mass_that_may_press_on_either_of_two_others_says_so():
    """It lifts them by any split of its force, and friction under one of them feels the split."""
    contacts = [
        ss.Contact(normal=0),
        ss.Contact(tangential=2, normal=1, friction=0.5, slider_speed=1.0),
        ss.Contact(normal={0: 1.0, 3: -1.0}, gap=1e-3),
        ss.Contact(normal={1: 1.0, 3: -1.0}, gap=1e-3),
    ]
    mass, force = [1.0, 1.0, 1.0, 1e-3], [-200.0, -200.0, 0.0, 1.0]
    scene = ss.Scene(mass, np.eye(4), force=force, contacts=contacts, impact_friction=True)
    start = ss.State(np.zeros(4), [0.0, 0.0, 0.0, 0.2], "++dd")
    with pytest.raises(ss.RunError, match=r"several solutions \(.* depends on how their forces are split"):
        ss.simulate(scene, 0.1, start)
    # Without friction the motion does not depend on it.
    smooth = [replace(contact, tangential=None, friction=0.0, slider_speed=0.0) for contact in contacts]
    run = ss.simulate(scene.replace(contacts=smooth), 0.1, start)
    assert run.stop_reason == "duration"


LAWS = [
    ss.friction.Stribeck(0.5, 0.3, 0.05),
    ss.friction.Linear(0.5, -0.2),
    ss.friction.Tabulated([0.0, 0.05, 0.4], [0.5, 0.35, 0.3]),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("points", [(-1.0, 1.0), (-1.0, 0.3, 1.0)])
def test_a_rigid_pad_under_a_law_moves_as_one_contact(points, law):
    """N mu(s) is the same for every split of N, and so are the inequalities of what sticks.

    The height of the points turns friction into a couple, which moves N between them and not its sum.
    """
    count = len(points)
    for method in ("auto", "taylor"):
        start = ss.State(np.zeros(3), [0.1, 0.0, 0.0], "s" * count)
        pads = ss.simulate(with_law(pad(points), law), 20.0, start, method=method)
        one = ss.simulate(with_law(single(), law), 20.0, ss.State([0.0, 0.0], [0.1, 0.0], "s"), method=method)
        assert len(one.events) >= 6
        assert pads.events.time.reshape(-1, count)[:, 0] == pytest.approx(one.events.time, rel=1e-12)
        at = np.linspace(0.003, 20.0, 101)
        theirs, ours = one.sample(at), pads.sample(at)
        assert ours.position.values[:, 0] == pytest.approx(theirs.position.values[:, 0], abs=1e-12)
        assert ours.friction_force.values.sum(axis=1) == pytest.approx(
            theirs.friction_force.values[:, 0], abs=1e-9
        )
        assert pads.undetermined["s" * count] == tuple(range(count))
        assert ("+" * count in pads.undetermined) == (count > 2)
        assert abs(pads.balance().residual) <= 1e-12 * pads.balance().turnover


def with_law(scene, law):
    """The scene with a law of friction at all contacts."""
    contacts = [replace(contact, friction=law, static_friction=None) for contact in scene.contacts]
    return scene.replace(contacts=contacts)


def test_a_pad_that_sticks_beside_a_contact_under_a_law():
    """The pad, tied to a block that slides by a law, is told by it when to slip: its total force counts."""
    law = ss.friction.Stribeck(0.5, 0.3, 0.05)

    def beside(scene):
        size = scene.size
        tie = 40.0
        stiffness = np.pad(np.diag(scene.stiffness.diagonal()), (0, 1))
        stiffness[[0, size, 0, size], [0, size, size, 0]] += [tie, tie + 100.0, -tie, -tie]
        block = ss.Contact(tangential=size, friction=law, normal_force=60.0, slider_speed=0.2)
        own = [
            replace(
                contact,
                tangential=np.append(directions(contact.tangential, size), 0.0),
                normal=np.append(directions(contact.normal, size), 0.0),
            )
            for contact in scene.contacts
        ]
        return ss.Scene(
            [*scene.mass, 5.0],
            stiffness,
            force=[*scene.force, 0.0],
            contacts=[*own, block],
            impact_friction=True,
        )

    pads, one = (
        ss.simulate(
            beside(scene), 30.0, ss.State(np.zeros(scene.size + 1), [0.1, *np.zeros(scene.size)], stuck + "+")
        )
        for scene, stuck in ((pad(static_friction=0.5), "ss"), (single(static_friction=0.5), "s"))
    )
    block = pads.events.contact == 2
    assert block.sum() >= 4
    assert (~block).sum() >= 8
    assert pads.events.time[block] == pytest.approx(one.events.time[one.events.contact == 1], rel=1e-11)
    assert pads.events.time[~block][::2] == pytest.approx(one.events.time[one.events.contact == 0], rel=1e-11)
    assert "ss+" in pads.undetermined


def directions(named, size):
    """A direction as a vector."""
    return np.eye(size)[named] if np.ndim(named) == 0 else np.asarray(named)


@pytest.mark.parametrize("second", [ss.friction.Stribeck(0.5, 0.2, 0.05), 0.5])
def test_unlike_laws_of_undetermined_forces_are_refused(second):
    """Alike at rest, they differ with slip: the split of the normal forces counts."""
    scene = with_law(pad((-1.0, 0.3, 1.0)), ss.friction.Stribeck(0.5, 0.3, 0.05))
    contacts = [scene.contacts[0], replace(scene.contacts[1], friction=second), scene.contacts[2]]
    with pytest.raises(ss.InputError, match="how the forces of closed contacts are split"):
        ss.simulate(scene.replace(contacts=contacts), 1.0, ss.State(np.zeros(3), np.zeros(3), "+++"))


def test_modes_of_unlike_slopes_under_undetermined_forces_are_refused():
    """Friction at the speed of the belt is alike, and its slope is not: damping depends on the split."""
    falling, rising = ss.friction.Linear(0.5, -1.0), ss.friction.Linear(0.3, 1.0)
    for laws in ((falling, falling, rising), (falling, rising, falling)):
        scene = pad((-1.0, 0.3, 1.0))
        contacts = [replace(c, friction=law) for c, law in zip(scene.contacts, laws, strict=True)]
        with pytest.raises(ss.InputError, match="depends on how their forces are split"):
            ss.complex_modes(scene.replace(contacts=contacts), "+++")


def test_modes_and_cycles_of_a_pad_under_a_law_are_those_of_one_contact():
    law = ss.friction.Stribeck(0.5, 0.3, 0.05)
    many, few = with_law(pad((-1.0, 0.3, 1.0)), law), with_law(single(), law)
    assert ss.complex_modes(many).eigenvalues == pytest.approx(ss.complex_modes(few).eigenvalues)
    pads = ss.simulate(many, 100.0, ss.State(np.zeros(3), [0.1, 0.0, 0.0], "sss")).limit_cycle()
    one = ss.simulate(few, 100.0, ss.State([0.0, 0.0], [0.1, 0.0], "s")).limit_cycle()
    assert pads.period == pytest.approx(one.period, rel=1e-12)
    assert pads.stability == one.stability
    assert pads.multipliers[0] == pytest.approx(one.multipliers[0], abs=1e-9)
    assert pads.balance().contact == pytest.approx(one.balance().contact, rel=1e-10)


def test_modes_and_cycles_of_a_pad_are_those_of_one_contact():
    assert ss.complex_modes(pad(), "++").eigenvalues == pytest.approx(
        ss.complex_modes(single(), "+").eigenvalues
    )
    hinged = ss.complex_modes(pad(), "+d")
    assert hinged.with_conjugates.eigenvalues.size == 4
    law = {"static_friction": 0.6}
    pads = ss.simulate(pad(**law), 300.0, ss.State(np.zeros(3), [0.1, 0.0, 0.0], "ss")).limit_cycle()
    one = ss.simulate(single(**law), 300.0, ss.State([0.0, 0.0], [0.1, 0.0], "s")).limit_cycle()
    assert pads.period == pytest.approx(one.period, rel=1e-12)
    assert pads.stability == one.stability
    assert pads.balance().contact == pytest.approx(one.balance().contact, rel=1e-10)
    assert "forces not determined" in str(pads.summary())
    swept = ss.sweep(pad(), {"friction": [0.1, 0.2, 0.4]})
    assert swept.eigenvalue.shape == ss.sweep(single(), {"friction": [0.1, 0.2, 0.4]}).eigenvalue.shape


@pytest.mark.parametrize("speed", np.linspace(0.086, 0.1, 12))
def test_an_impact_elsewhere_leaves_what_sticks_at_rest(speed):
    """A dashpot tells a mass that sticks of an impact; its friction force stays within static friction.

    The slip velocity is a multiple of another contact's: it is zero to the last bit all the same.
    """
    scene = ss.Scene(
        [1.0, 1.0],
        [[2000.0, 0.0], [0.0, 0.0]],
        damping=[[200.0, -200.0], [-200.0, 200.0]],
        contacts=[
            ss.Contact(tangential=[0.7, 0.0], friction=0.3, normal_force=1.0, slider_speed=1.0),
            ss.Contact(
                tangential=[1.0, 0.0],
                friction=0.3,
                static_friction=0.5,
                normal_force=100.0,
                slider_speed=speed,
            ),
            ss.Contact(normal=[0.0, -1.0], gap=0.002, restitution=0.9),
        ],
    )
    run = ss.simulate(scene, 0.02, ss.State([0.0, 0.0], [speed, 0.3], "+sd"))
    assert run.events.kind[0] == "impact"
    after = run.state(run.events.time[0])
    required = 2000.0 * after.position[0] + 200.0 * (speed - after.velocity[1]) - 0.7 * 0.3
    # Between the two: under kinetic friction it would slip.
    assert 30.0 < required < 50.0
    assert run.events.combination[0] == "+sd"


def test_friction_that_falls_pushes_the_slip_that_begins_with_it():
    """Two slides hold one mass: where both begin to slip, friction of one falls and pushes the mass off."""
    first = ss.Contact(tangential=0, friction=0.3, static_friction=0.6, slider_speed=0.2, normal_force=10)
    second = ss.Contact(tangential=0, friction=0.2, slider_speed=0.2, normal_force=10)
    together = ss.Contact(tangential=0, friction=0.5, static_friction=0.8, slider_speed=0.2, normal_force=10)
    pair, one = (
        ss.simulate(ss.Scene([1.0], [[100.0]], contacts=contacts), 2.0, ss.State([0.0], [0.2], letters))
        for contacts, letters in (([first, second], "ss"), ([together], "s"))
    )
    # 100 x = 8 N at the onset of slip.
    assert one.events.time[0] == pytest.approx(0.4, rel=1e-14)
    assert list(pair.events.kind) == list(np.repeat(one.events.kind, 2))
    assert pair.events.time == pytest.approx(np.repeat(one.events.time, 2), rel=1e-13)
    assert abs(pair.balance().residual) <= 1e-15


def test_twin_stops_are_one():
    """Two stops at the same place: their forces are shared, the motion is that of one."""
    one = ss.Scene([2.0], [[0.0]], force=[-20.0], contacts=[ss.Contact(normal=0, restitution=0.5)])
    two = one.replace(contacts=[one.contacts[0], one.contacts[0]])
    first, second = (
        ss.simulate(scene, 4.0, ss.State([5.0], [0.0], "d" * len(scene.contacts))) for scene in (one, two)
    )
    assert second.events.combination[-1] == "++"
    assert second.events.time[-1] == pytest.approx(first.events.time[-1], rel=1e-12)
    assert second.sample([3.5]).normal_force.values.sum() == pytest.approx(20.0)


DRAWN = drawn_scenes(
    restitution=(0.0, 0.5), min_friction=0.2, max_friction=0.8, kinds=("both", "stop", "friction")
)


def with_dependents(drawn, rng):
    """A ceiling above every normal direction, a stop along a tangential one, friction along it."""
    scene, contacts, letters = drawn.scene, list(drawn.scene.contacts), ""
    for i, contact in enumerate(drawn.scene.contacts):
        normal, tangential = scene.normal_direction(i), scene.tangential_direction(i)
        if normal.any():
            gap = rng.uniform(2e-6, 2e-5) - contact.gap
            contacts.append(ss.Contact(normal=-normal, gap=gap, restitution=contact.restitution))
            letters += "d"
        if tangential.any():
            place = tangential @ drawn.equilibrium
            clearance = rng.uniform(1e-5, 1e-4)
            contacts.append(ss.Contact(normal=-tangential, gap=place + clearance, restitution=0.5))
            contacts.append(
                ss.Contact(
                    tangential=rng.choice([-2.0, 1.0]) * tangential,
                    friction=0.3,
                    normal_force=rng.uniform(1.0, 10.0),
                    slider_speed=rng.uniform(0.5, 1.0),
                )
            )
            letters += "d+"
    return scene.replace(contacts=contacts), letters


@given(DRAWN, st.integers(0, 2**32 - 1), st.floats(0.3, 3.0))
def test_random_scenes(drawn, seed, strength):
    scene, letters = with_dependents(drawn, np.random.default_rng(seed))
    kicked = drawn.kicked(strength)
    start = ss.State(kicked.position, kicked.velocity, kicked.combination + letters)
    try:
        one, other = (
            ss.simulate(scene, 0.02, start, method=method, max_events=60) for method in ("auto", "taylor")
        )
    except ss.InputError:
        # The further friction may take the pressure off a contact that was closed.
        return
    count = min(len(one.events), len(other.events), 12)
    assert list(one.events.kind[:count]) == list(other.events.kind[:count])
    assert one.events.time[:count] == pytest.approx(other.events.time[:count], abs=1e-9)
    balance = one.balance()
    stiffness = scene.stiffness.toarray() if hasattr(scene.stiffness, "toarray") else scene.stiffness
    at_first = np.abs(start.position)
    stored = at_first @ np.abs(stiffness) @ at_first
    assert abs(balance.residual) <= 1e-11 * balance.turnover + 100 * EPS * (1 + len(one.events)) * stored
    lengths = max(np.abs(start.position).max(), 1e-4)
    for time in np.linspace(0.0, one.duration, 40):
        state, sample = one.state(time), one.sample([time])
        for i, contact in enumerate(scene.contacts):
            letter = state.combination[i]
            normal_force, friction_force = (
                float(sample[name].values[0, i]) for name in ("normal_force", "friction_force")
            )
            slip = scene.tangential_direction(i) @ state.velocity - contact.slider_speed
            if contact.normal is not None:
                gap = scene.normal_direction(i) @ state.position + contact.gap
                assert gap >= -1e-11 * lengths
                assert normal_force >= -1e-6
                assert letter == "d" or abs(gap) <= 1e-11 * lengths
            if letter == "s":
                assert abs(slip) <= 1e-10
                static = contact.friction if contact.static_friction is None else contact.static_friction
                if i not in one.undetermined.get(state.combination, ()):
                    assert abs(friction_force) <= static * normal_force + 1e-6
            elif letter in "+-" and contact.tangential is not None:
                sign = 1.0 if letter == "+" else -1.0
                assert sign * slip <= 1e-10
                assert friction_force == pytest.approx(sign * contact.friction * normal_force, abs=1e-6)


@pytest.mark.parametrize("method", ["auto", "taylor"])
@pytest.mark.parametrize("seed", range(10))
def test_two_sliders_of_one_speed(seed, method):
    """A mass sticks on one slider, and slides on another one that vibrates about the same speed.

    Where the speeds are the same, the slip on the second one changes its sign, and the first one still holds.
    """
    rng = np.random.default_rng(seed)
    frequency, speed, phase = rng.uniform(50.0, 90.0), rng.uniform(-0.1, 0.1), rng.uniform(-3.0, 3.0)
    wave = ss.Harmonic(0.01, frequency, phase)
    law = {"tangential": 0, "slider_speed": speed}
    contacts = [
        ss.Contact(normal=1, friction=0.5, static_friction=1.0, slider_vibration=wave, **law),
        ss.Contact(normal_force=7.0, friction=1.0, **law),
    ]
    scene = ss.Scene([1.0, 1.0], np.diag([1e2, 1e4]), force=[0.0, -10.0], contacts=contacts)
    ahead = np.cos(phase) > 0.0
    run = ss.simulate(scene, 0.05, ss.State([0.0, 0.0], [speed, 0.0], "+s" if ahead else "-s"), method=method)
    # cos(2 pi f t + phase) = 0
    zeros = (np.arange(-2, 12) + 0.5 - phase / np.pi) / (2.0 * frequency)
    zeros = zeros[(zeros > 0.0) & (zeros < 0.05)]
    assert run.events.time == pytest.approx(zeros, abs=1e-13)
    assert (run.events.contact == 0).all()
    assert (run.events.kind == "velocity").all()
    letters = ["-s", "+s"] if ahead else ["+s", "-s"]
    assert list(run.events.combination) == [letters[k % 2] for k in range(zeros.size)]


def test_a_body_that_sticks_at_very_many_points_names_the_limit_that_it_meets():
    """Sticking never depends on the split of forces; the inequalities of splits that hold are too many."""
    rng = np.random.default_rng(3)
    points = rng.uniform(-1.0, 1.0, (80, 2)) / 16.0
    ways = rng.uniform(0.0, np.pi, 80)
    contacts = [
        ss.Contact(
            tangential=[np.cos(way), np.sin(way), 0.0, 0.0, 0.0, x * np.sin(way) - y * np.cos(way)],
            normal=[0.0, 0.0, 1.0, x, y, 0.0],
            friction=0.3,
        )
        for (x, y), way in zip(points, ways, strict=True)
    ]
    force = [1.0, 2.0, -100.0, 0.05, 0.07, 0.0]
    stiffness = np.diag([1e6, 1e6, 1e4, 200.0, 200.0, 200.0])
    mass = [1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3]
    scene = ss.Scene(mass, stiffness, force=force, contacts=contacts, impact_friction=True)
    with pytest.raises(ss.InputError, match="more than 1000 inequalities, the most that are followed"):
        ss.simulate(scene, 1e-3, ss.State(np.zeros(6), np.zeros(6), "s" * 80))
