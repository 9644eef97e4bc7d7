"""Springs in planes under normal forces that change: a node without mass that rests, slips and lifts."""

import numpy as np
import pytest

import stickslip as ss
from lifting_springs import random_lifting_scene

DOFS = ["x", "y", "z"]
MASS, FRICTION, SPRING = [1.0, 1.0, 1.5], 0.4, 25.0
APART = np.diag([8.0, 6.0, 40.0])
COUPLED = np.array([[8.0, 1.0, 2.0], [1.0, 6.0, -1.5], [2.0, -1.5, 40.0]])
#: Constant load along z, N.
PRESSED = -4.0
SHAKEN = [ss.Harmonic({"x": 4.0, "z": 5.0}, 0.7), ss.Harmonic({"y": 3.5}, 0.7, phase=-1.2)]

START = ss.State([0.1, 0.0, 0.05], [0.5, 0.0, 0.0], "dd")


def pad(stiffness=COUPLED, damping=0.03, loads=(), **changes):
    """Return a body in space with one contact below it."""
    given = {
        "tangential": ("x", "y"),
        "normal": "z",
        "friction": FRICTION,
        "tangential_stiffness": SPRING,
        "name": "pad",
    }
    contact = ss.Contact(**{**given, **changes})
    return ss.Scene(
        MASS,
        stiffness,
        damping=damping * np.asarray(stiffness),
        force=[0.0, 0.0, PRESSED],
        contacts=[contact],
        dofs=DOFS,
        loads=loads,
    )


@pytest.mark.parametrize("seed", [1, 2, 5, 10, 12, 13, 15])
def test_motions_are_those_of_a_general_integrator(seed):
    """Contacts close, rest, slip and open; impacts change the normal forces of others."""
    one, start, duration = random_lifting_scene(np.random.default_rng(seed))
    run = ss.simulate(one.scene(), duration, start)
    last = one.follow(start, duration)
    end = run.state(duration)
    assert np.abs(np.concatenate([end.position, end.velocity]) - last).max() < 1e-10
    times, contacts, kinds = zip(*one.events, strict=True)
    # What an impact changes of other contacts is an event of theirs at the same instant.
    found = run.events.time
    first = np.flatnonzero(np.diff(found, prepend=-1.0) > 0.0)
    assert list(zip(run.events.contact[first] // 2, run.events.kind[first], strict=True)) == list(
        zip(contacts, kinds, strict=True)
    )
    assert np.abs(found[first] - times).max() < 1e-9


def test_a_normal_force_that_does_not_change_is_a_given_one():
    start = ss.State([0.1, 0.0, 0.0], [2.0, -1.0, 0.0], "ss")
    loads = [ss.Harmonic({"x": 4.0, "y": 1.0}, 0.3)]
    scenes = [pad(APART, loads=loads), pad(APART, loads=loads, normal=None, normal_force=-PRESSED)]
    runs = [ss.simulate(scene, 8.0, start) for scene in scenes]
    assert len(runs[0].events) > 8
    assert list(runs[0].events.combination) == list(runs[1].events.combination)
    assert np.abs(runs[0].events.time - runs[1].events.time).max() < 1e-13
    assert np.abs(runs[0].state(8.0).position - runs[1].state(8.0).position)[:2].max() < 1e-13


@pytest.mark.parametrize("turn", [0.7, 2.2])
def test_no_direction_of_the_plane_is_special(turn):
    one, start, duration = random_lifting_scene(np.random.default_rng(4))
    runs = [ss.simulate(one.scene(angle), duration, start) for angle in (0.0, turn)]
    assert list(runs[0].events.kind) == list(runs[1].events.kind)
    assert "release" in runs[0].events.kind
    assert np.abs(runs[0].events.time - runs[1].events.time).max() < 1e-11
    assert np.abs(runs[0].state(duration).position - runs[1].state(duration).position).max() < 1e-11


def test_energy_closes_and_the_heat_is_that_of_the_node():
    run = ss.simulate(pad(loads=SHAKEN), 12.0, START)
    assert {"oo", "ss", "dd"} <= set(run.events.combination)
    balance = run.balance()
    assert abs(float(balance.residual)) < 1e-13 * abs(float(balance.external))
    lost = np.asarray(balance.contacts.slider - balance.contacts.work)
    wear = np.asarray(balance.contacts.wear)
    assert np.abs(lost - FRICTION * wear).max() < 1e-11 * np.abs(lost).max()
    assert (wear >= -1e-15).all()


def test_a_spring_beyond_its_limit_slips_at_once():
    """A load lifts the normal force below what a spring at rest holds: the heat is what the spring loses."""
    scene = pad(APART, loads=[ss.Switched({"z": 1.0}, times=[0.1], values=[0.0, 3.0])])
    run = ss.simulate(scene, 0.3, ss.State([0.0, 0.0, 0.0], [0.6, 0.0, 0.0], "ss"))
    switched = list(run.events.time).index(0.1)
    before, after = (run.state(time) for time in (np.nextafter(0.1, 0.0), 0.1))
    held, limit = abs(before.friction_force[0]), FRICTION * (-PRESSED - 3.0)
    assert run.events.combination[switched] == "oo"
    assert held > 2.0 * limit
    assert abs(after.friction_force[0]) == pytest.approx(limit, rel=1e-12)
    balance = run.balance()
    assert abs(float(balance.residual)) < 1e-14
    jumped = (held**2 - limit**2) / (2.0 * SPRING)
    assert float(balance.contacts.impact_friction.sum()) == pytest.approx(jumped, rel=1e-9)


def equations(one, slips):
    """Return the rate of (x, x', angle) of a body whose node slips, over the dofs in its plane."""
    x, v, angle = one[:2], one[2:4], one[4]
    place, speed = np.append(x, 0.0), np.append(v, 0.0)
    load = np.array([0.0, 0.0, PRESSED]) - COUPLED @ place - 0.03 * COUPLED @ speed
    e = np.array([np.cos(angle), np.sin(angle)])
    limit = -FRICTION * load[2]
    w = v - slips
    turning = SPRING / limit * (w @ np.array([-e[1], e[0]]))
    return np.concatenate([v, (load[:2] - limit * e) / np.array(MASS[:2]), [turning]])


def test_small_motions_are_those_of_the_differenced_equations():
    """Friction follows N along the slip; across it the node lags, with the rate `k |v| / (mu N)`."""
    slider = np.array([0.3, 0.1])
    scene = pad(slider_speed=tuple(slider))
    steady = ss.steady_sliding(scene)
    at = np.concatenate([steady.position[:2], np.zeros(2), [np.arctan2(*-slider[::-1])]])
    assert np.abs(equations(at, slider)).max() < 1e-14
    columns = [
        (equations(at + step, slider) - equations(at - step, slider)) / 2e-6 for step in 1e-6 * np.eye(5)
    ]
    expected = np.linalg.eigvals(np.array(columns).T)
    found = ss.complex_modes(scene).eigenvalues
    assert len(found) == np.sum(expected.imag >= 0.0)
    assert max(np.abs(expected - value).min() for value in found) < 1e-8


def test_multipliers_are_those_of_the_motion():
    """A period of slip, rest, flight and impact, with its derivative by central differences of runs."""
    scene = pad(loads=SHAKEN, damping=0.06)
    period = 1.0 / 0.7
    run = ss.simulate(scene, 30.0 * period, START)
    cycle = run.limit_cycle(further=60.0 * period)
    assert {"oo", "ss", "dd"} <= set(cycle.run.events.combination)
    begin = cycle.run.state(0.0)
    where = np.concatenate([begin.position, begin.velocity, begin.friction_force])
    free = {"ss": [0, 1, 3, 4, 6, 7], "dd": [0, 1, 2, 3, 4, 5]}[begin.combination]

    def after(y):
        start = ss.State(y[:3], y[3:6], begin.combination, friction_force=y[6:])
        end = ss.simulate(scene, cycle.period, start).state(cycle.period)
        return np.concatenate([end.position, end.velocity, end.friction_force])

    assert np.abs(after(where) - where).max() < 1e-10
    steps = 1e-6 * np.eye(where.size)[free]
    columns = [(after(where + step) - after(where - step))[free] / 2e-6 for step in steps]
    expected = np.linalg.eigvals(np.array(columns).T)
    found = [value for value in cycle.multipliers if abs(value) > 1e-6]
    assert found
    assert max(np.abs(expected - value).min() for value in found) < 1e-6


def test_an_opening_costs_a_bounded_number_of_panels():
    """The direction of slip changes ever faster, until what it does is below rounding."""
    scene = pad(loads=SHAKEN)
    run = ss.simulate(scene, 12.0, START)
    openings = np.sum(run.events.kind == "release")
    assert openings > 3
    assert run.counters["panels"] < 200 * openings


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": [[1.0, 0.0, 0.2], [0.0, 1.0, 0.0], [0.2, 0.0, 1.5]]}, "mass couples contacts"),
        (
            {"elements": [ss.Spring("z", ss.spring.Polynomial(1.0, 0.0, 5.0))]},
            "an element that is not linear",
        ),
        ({"elements": [ss.Spring("x", ss.spring.Polynomial(1.0, 0.0, 5.0))]}, "a damper ties it"),
    ],
)
def test_what_is_not_computed_beside_says_so(changes, message):
    scene = pad()
    with pytest.raises(ss.InputError, match=message):
        scene.replace(**changes)


def test_dofs_without_mass_are_refused_beside():
    wider = np.diag([0.0, 0.0, 0.0, 1.0])
    wider[:3, :3] = COUPLED
    with pytest.raises(ss.InputError, match="dofs without mass"):
        ss.Scene([*MASS, 0.0], wider, contacts=pad().contacts, dofs=[*DOFS, "node"])
