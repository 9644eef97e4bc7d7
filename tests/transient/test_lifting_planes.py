"""Friction in a plane under the normal force of a contact that opens: slip, stops, lift-off and impacts."""

import numpy as np
import pytest

import stickslip as ss
from plane_scenes import check_energy, compared, end, random_lifting_scene, turned_kinds, with_laws

STIFFNESS = np.array([[100.0, 0.0, 20.0], [0.0, 140.0, -15.0], [20.0, -15.0, 400.0]])
SPEED = np.array([0.3, 0.1])


def pressed(**changes) -> ss.Scene:
    """Return a mass on a belt in the plane, whose normal force follows its place."""
    contact = {"friction": 0.5, "slider_speed": tuple(SPEED), "name": "pad"} | changes
    return ss.Scene(
        mass=[1.0, 1.0, 0.5],
        stiffness=STIFFNESS,
        damping=0.02 * STIFFNESS,
        force=[0.0, 0.0, -6.0],
        dofs=("x", "y", "z"),
        contacts=[ss.Contact(tangential=("x", "y"), normal="z", **contact)],
    )


@pytest.mark.parametrize("seed", [3, 15, 18, 20, 39])
def test_random_scenes_agree_with_a_general_integrator(seed):
    events, times, state = compared(seed, random_lifting_scene)
    assert events > 9
    assert times < 1e-10
    assert state < 1e-10


@pytest.mark.parametrize("seed", [0, 15, 18, 39])
def test_random_scenes_under_laws_agree_with_a_general_integrator(seed):
    events, times, state = compared(seed, with_laws(random_lifting_scene))
    assert events > 9
    assert times < 1e-9
    assert state < 1e-9


def test_turned_directions_change_nothing():
    kinds = turned_kinds(random_lifting_scene, 12)
    assert min(kinds.count(kind) for kind in ("impact", "release", "velocity", "slip", "accumulation")) > 0


@pytest.mark.parametrize("draw", [random_lifting_scene, with_laws(random_lifting_scene)])
def test_energy_closes_and_friction_never_gives_any(draw):
    check_energy(draw)


def test_a_constant_normal_force_is_a_given_one():
    """Nothing but a load presses the mass: all events are those under this load as given normal force."""
    planar = {"mass": 1.0, "stiffness": np.diag([30.0, 20.0]), "damping": 0.1 * np.eye(2)}
    given = ss.Contact(tangential=("x", "y"), normal_force=5.0, friction=0.3, slider_speed=(0.3, 0.1))
    held = ss.Contact(tangential=("x", "y"), normal="z", friction=0.3, slider_speed=(0.3, 0.1))
    flat = ss.Scene([1.0, 1.0], planar["stiffness"], planar["damping"], dofs=("x", "y"), contacts=[given])
    wider = [
        np.block([[planar[name], np.zeros((2, 1))], [np.zeros(2), 1.0]]) for name in ("stiffness", "damping")
    ]
    space = ss.Scene([1.0] * 3, *wider, force=[0.0, 0.0, -5.0], dofs=("x", "y", "z"), contacts=[held])
    start = ([0.5, 0.3], [1.0, -2.0])
    first = ss.simulate(flat, 8.0, ss.State(*start, "oo"))
    second = ss.simulate(space, 8.0, ss.State(*([*part, 0.0] for part in start), "oo"))
    assert len(first.events) > 1
    assert list(first.events.kind) == list(second.events.kind)
    np.testing.assert_allclose(second.events.time, first.events.time, rtol=1e-15)


@pytest.mark.parametrize("law", [None, ss.friction.Stribeck(0.6, 0.3, 0.2), ss.friction.Linear(0.3, 0.8)])
def test_steady_sliding_and_its_modes_are_those_of_the_closed_form(law):
    """``N = n . x + 6`` presses; dampers act along the slip, ``mu' N``, and across, ``mu N / |v|``."""
    scene = pressed(friction=0.5 if law is None else law)
    speed = float(np.linalg.norm(SPEED))
    friction = 0.5 if law is None else law.coefficient(speed)
    step = 1e-5
    ends = [0.5, 0.5] if law is None else [law.coefficient(speed + side) for side in (-step, step)]
    slope = (ends[1] - ends[0]) / (2 * step)
    direction = SPEED / speed
    normal = np.array([20.0, -15.0])
    stiffness = STIFFNESS[:2, :2] - friction * np.outer(direction, normal)
    place = np.linalg.solve(stiffness, friction * 6.0 * direction)
    force = 6.0 + normal @ place
    rest = ss.steady_sliding(scene)
    np.testing.assert_allclose(rest.normal_forces, [force, force], rtol=1e-14)
    np.testing.assert_allclose(rest.position[:2], place, rtol=1e-13)
    along = np.outer(direction, direction)
    of_structure = 0.02 * (STIFFNESS[:2, :2] - friction * np.outer(direction, normal))
    damping = of_structure + force * (friction / speed * (np.eye(2) - along) + slope * along)
    first_order = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, -damping]])
    known = np.linalg.eigvals(first_order)
    modes = ss.complex_modes(scene)
    off = np.abs(np.array(modes.eigenvalues)[:, None] - known[None, :])
    assert off.min(axis=1).max() < (1e-12 if law is None else 1e-8)


WEAKENING = ss.friction.Stribeck(static=0.6, kinetic=0.35, speed=0.3)


@pytest.mark.parametrize(
    ("seed", "other", "law"),
    [
        *((seed, 1.1, None) for seed in (5, 25, 35, 55)),
        *((seed, other, law) for law in (None, WEAKENING) for seed, other in ((25, 1.6), (35, 0.8))),
        (5, 1.1, WEAKENING),
    ],
)
def test_multipliers_are_the_derivative_of_the_stroboscopic_map(seed, other, law):
    """Impacts with friction, series of bounces, stops, onsets and lift-off; also with unlike masses."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    stiffness = np.diag(rng.uniform(1, 3, 3)) + 0.2 * root @ root.T
    rate = rng.uniform(0.6, 1.4)
    contact = ss.Contact(
        tangential=("x", "y"),
        normal="z",
        friction=0.5 if law is None else law,
        static_friction=float(rng.choice([0.5, 0.6])) + (0.0 if law is None else 0.1),
        slider_speed=(0.1, 0.0),
        restitution=float(rng.choice([0.0, 0.3])),
    )
    scene = ss.Scene(
        [1.1, other, 0.7],
        stiffness,
        0.06 * stiffness,
        force=[0.0, 0.0, -1.0],
        dofs=("x", "y", "z"),
        contacts=[contact],
        impact_friction=True,
        loads=[
            ss.Harmonic({"x": 0.8, "z": 1.1}, rate / 2 / np.pi),
            ss.Harmonic({"y": 0.6, "z": 0.2}, rate / 2 / np.pi, phase=1.0),
        ],
    )
    period = 2 * np.pi / rate
    # Friction by a law settles slowly, by 0.85 in a period.
    settled = (60 if law is None else 160) * period
    run = ss.simulate(scene, settled, ss.State([0.0, 0.0, 0.2], 0.1 * rng.normal(size=3), "dd"))
    cycle = run.limit_cycle(further=100 * period)
    known_sequences = {5: {"dd", "oo", "ss"}, 25: {"dd", "oo", "ss"}, 35: {"dd", "oo", "ss"}, 55: {"oo"}}
    assert law is not None or set(cycle.combinations) == known_sequences[seed]
    state = run.state(settled)
    place = np.concatenate([state.position, state.velocity])
    free = [0, 1, 3, 4] if state.combination == "oo" else list(range(6))

    def after(moved):
        return end(ss.simulate(scene, period, ss.State(moved[:3], moved[3:], state.combination)))[free]

    step = 1e-5
    units = np.eye(6)[free]
    columns = [(after(place + step * unit) - after(place - step * unit)) / (2 * step) for unit in units]
    known = sorted(np.abs(np.linalg.eigvals(np.transpose(columns))))
    found = sorted(np.abs(cycle.multipliers))[-len(known) :]
    np.testing.assert_allclose(found, known, atol=2e-8)


def test_an_impulse_in_the_cone_obeys_the_balance_of_momentum():
    """``M w+ = M w- - p w+ / |w+|`` with unlike masses, p the friction times the normal impulse."""
    mass = np.array([1.0, 3.0])
    scene = ss.Scene(
        [*mass, 2.0],
        np.zeros((3, 3)),
        force=[0.0, 0.0, -1.0],
        dofs=("x", "y", "z"),
        contacts=[ss.Contact(tangential=("x", "y"), normal="z", friction=0.4, restitution=0.5)],
        impact_friction=True,
    )
    before = np.array([0.7, -0.4])
    run = ss.simulate(scene, 1e-9, ss.State([0.0, 0.0, 1e-12], [*before, -0.3], "dd"))
    after = run.state(1e-9).velocity[:2]
    assert run.events.kind[0] == "impact"
    impulse = 0.4 * 1.5 * 2.0 * 0.3
    np.testing.assert_allclose(
        mass * after, mass * before - impulse * after / np.linalg.norm(after), rtol=1e-9
    )


def test_both_directions_open_at_once():
    scene = pressed()
    assert [contact.normal for contact in scene.contacts] == ["z", None]
    assert sorted(letters for letters, _ in ss.status_table(scene).rows()) == ["dd", "oo", "ss"]
    with pytest.raises(ss.InputError, match="friction in one plane"):
        ss.complex_modes(scene, "od")
    lifted = scene.replace(force=[0.0, 0.0, 6.0])
    assert ss.steady_sliding(lifted).combination == "dd"


def test_numbers_of_the_normal_direction_belong_to_the_first_direction():
    scene = pressed(restitution=0.3).replace(gap_pad_x=0.001)
    assert scene.contacts[0].gap == 0.001
    with pytest.raises(ss.InputError, match="normal_force"):
        scene.replace(normal_force_pad_y=1.0)


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ({"normal": "z"}, {"normal": "z"}, "that both directions or none of them states"),
        ({"normal": "z"}, {"normal_force": 1.0}, "that both directions or none of them states"),
        ({}, {}, "that both directions or none of them states"),
        ({}, {"normal": "z"}, "state it with the first"),
    ],
)
def test_the_normal_force_is_stated_once_with_the_first_direction(first, second, said):
    both = [
        ss.Contact(tangential=name, friction=0.3, beside=1 - place, **own)
        for place, (name, own) in enumerate((("x", first), ("y", second)))
    ]
    with pytest.raises(ss.InputError, match=said):
        ss.Scene(np.ones(3), np.eye(3), dofs=("x", "y", "z"), contacts=both)


def test_without_friction_a_contact_in_a_plane_slips_and_lifts_as_a_stop():
    scene = pressed(friction=0.0, restitution=0.3)
    stop = scene.replace(contacts=[ss.Contact(normal="z", restitution=0.3)])
    start = ([0.1, 0.0, 0.02], [0.0, 0.3, 0.0])
    first = ss.simulate(scene, 2.0, ss.State(*start, "dd"))
    second = ss.simulate(stop, 2.0, ss.State(*start, "d"))
    assert len(first.events) > 5
    assert list(first.events.kind) == list(second.events.kind)
    np.testing.assert_allclose(first.events.time, second.events.time, rtol=1e-15)
    assert ss.critical_points(scene, {"friction": (0.0, 0.5)}) is not None
    assert [letters for letters, _ in ss.status_table(scene).rows()] == ["oo", "dd"]
