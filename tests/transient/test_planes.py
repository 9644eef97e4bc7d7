"""Friction in a plane: closed forms, motions along lines, turned directions, and a general integrator."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import stickslip as ss
from plane_scenes import check_energy, compared, end, random_scene, turned_kinds, with_laws

#: g, m/s^2, slope, coefficient, speed, m/s; time of the stop, s, its place across and down, m.
PUCKS = [
    ((9.81, 0.5, 0.8, 2.0), (0.54413183608894114, 0.32871240846481622, 0.18578786053666366)),
    ((10.0, 0.3, 0.5, 1.0), (0.33916928382884716, 0.11575127401113722, 0.052458677121198706)),
]


FALLING = ss.friction.Stribeck(static=0.8, kinetic=0.4, speed=0.1)


def puck(gravity: float, slope: float, friction: float) -> ss.Scene:
    """Return a puck of 1 kg on an incline, which falls along y."""
    return ss.Scene(
        mass=[1.0, 1.0],
        stiffness=np.zeros((2, 2)),
        force=[0.0, gravity * np.sin(slope)],
        dofs=("x", "y"),
        contacts=[
            ss.Contact(
                tangential=("x", "y"), normal_force=gravity * np.cos(slope), friction=friction, name="puck"
            )
        ],
    )


@pytest.mark.parametrize(("given", "known"), PUCKS)
def test_a_puck_on_an_incline_stops_where_its_closed_form_says(given, known):
    *scene, speed = given
    run = ss.simulate(puck(*scene), 1.0, ss.State([0.0, 0.0], [speed, 0.0], "oo"))
    assert list(run.events.kind) == ["velocity"]
    assert list(run.events.contact) == [0]
    assert run.events.combination[0] == "ss"
    assert run.events.time[0] == pytest.approx(known[0], rel=2e-15)
    np.testing.assert_allclose(end(run)[:2], known[1:], rtol=4e-15)
    # From the throw to the stop, and the rest.
    assert run.counters["panels"] <= 21
    lost = run.balance().contacts.work.to_numpy().sum()
    assert lost == pytest.approx(-0.5 * speed**2 - scene[0] * np.sin(scene[1]) * known[2], rel=1e-14)


def test_a_puck_on_the_slope_of_its_friction_keeps_half_its_speed():
    """It never stops: ``v (1 + cos phi)`` is constant, and v ends as ``v_0 / 2`` down the slope."""
    run = ss.simulate(puck(9.81, 0.5, float(np.tan(0.5))), 50.0, ss.State([0.0, 0.0], [2.0, 0.0], "oo"))
    assert len(run.events) == 0
    for time in (0.3, 1.0, 3.0, 50.0):
        vx, vy = run.sample(time).velocity.values.ravel()
        assert np.hypot(vx, vy) + vy == pytest.approx(2.0, rel=1e-13)
    np.testing.assert_allclose([vx, vy], [0.0, 1.0], atol=1e-12)


def rotating_load(friction: float | ss.friction.Stribeck = 0.3) -> ss.Scene:
    """Return a mass on springs under a load of 1 N that turns by 0.8 1/s, pressed by 1 N."""
    loads = [
        ss.Harmonic({"x": 1.0}, 0.8 / (2 * np.pi)),
        ss.Harmonic({"y": 1.0}, 0.8 / (2 * np.pi), phase=-np.pi / 2),
    ]
    contact = ss.Contact(tangential=("x", "y"), normal_force=1.0, friction=friction)
    return ss.Scene([1.0, 1.0], np.eye(2), 0.05 * np.eye(2), dofs=("x", "y"), loads=loads, contacts=[contact])


def test_a_mass_under_a_rotating_load_goes_round_in_a_circle():
    rate, friction, damping = 0.8, 0.3, 0.05
    radius = 2.5437483730543945
    phase = np.angle((1.0 - rate**2) * radius + 1j * (damping * rate * radius + friction))
    scene = rotating_load()
    place = radius * np.array([np.cos(phase), -np.sin(phase)])
    start = ss.State(place, rate * np.array([-place[1], place[0]]), "oo")
    run = ss.simulate(scene, 2 * np.pi / rate, start)
    assert len(run.events) == 0
    np.testing.assert_allclose(end(run)[:2], place, atol=5e-15)
    balance = run.balance()
    turn = 2 * np.pi * radius
    assert balance.contacts.work.to_numpy().sum() == pytest.approx(-friction * turn, rel=1e-14)
    assert balance.contacts.wear.to_numpy().sum() == pytest.approx(turn, rel=1e-14)
    assert abs(balance.residual) < 1e-13


def test_a_circle_under_a_law_is_that_of_the_friction_at_its_speed():
    """With the radius a of the circle the balance is ``((1 - w^2) a)^2 + (c w a + mu(w a) N)^2 = F^2``."""
    rate, damping = 0.8, 0.05
    law = ss.friction.Stribeck(static=0.5, kinetic=0.2, speed=3.0, viscous=0.01)

    def forces(radius):
        return (1.0 - rate**2) * radius + 1j * (damping * rate * radius + law.coefficient(rate * radius))

    radius = brentq(lambda a: abs(forces(a)) - 1.0, 1.0, 4.0, xtol=1e-15, rtol=1e-15)
    phase = np.angle(forces(radius))
    place = radius * np.array([np.cos(phase), -np.sin(phase)])
    start = ss.State(place, rate * np.array([-place[1], place[0]]), "oo")
    run = ss.simulate(rotating_load(law), 2 * np.pi / rate, start)
    assert len(run.events) == 0
    np.testing.assert_allclose(end(run)[:2], place, atol=2e-14)
    work = -law.coefficient(rate * radius) * 2 * np.pi * radius
    assert run.balance().contacts.work.to_numpy().sum() == pytest.approx(work, rel=1e-13)
    assert abs(run.balance().residual) < 1e-13


@pytest.mark.parametrize(
    ("ratio", "known"),
    [(1.0, 0.83462684167407319), (2.0, 0.64263768177312447), (10.0, 0.23441565423091321)],
)
def test_vibration_across_lowers_the_friction_of_sliding(ratio, known):
    """The mean of ``1 / sqrt(1 + a^2 cos^2)`` is ``2 K(m) / (pi sqrt(1 + a^2))``, ``m = a^2 / (1 + a^2)``."""
    assert known == pytest.approx(
        2 / np.pi * ellipk(ratio**2 / (1 + ratio**2)) / np.hypot(1, ratio), rel=1e-15
    )
    speed, frequency, heavy = 0.5, 10.0, 1e9
    scene = ss.Scene(
        mass=[heavy, heavy],
        stiffness=np.zeros((2, 2)),
        dofs=("x", "y"),
        contacts=[
            ss.Contact(
                tangential=("x", "y"),
                normal_force=1.0,
                friction=0.3,
                slider_speed=(speed, 0.0),
                slider_vibration=(None, ss.Harmonic(ratio * speed, frequency)),
            )
        ],
    )
    run = ss.simulate(scene, 1.0 / frequency, ss.State([0.0, 0.0], [0.0, 0.0], "oo"))
    # On a mass that hardly moves the slider does the work of the mean friction.
    work = run.balance().contacts.slider.to_numpy()[0].sum()
    assert work * frequency / (0.3 * speed) == pytest.approx(known, rel=1e-9)


def oscillator(
    direction: np.ndarray | None,
    speed: float,
    friction: float | ss.friction.Stribeck = 0.5,
    static: float | None = 0.7,
) -> ss.Scene:
    """Return a mass on springs with friction along x, or in a plane turned by an angle."""
    along = {"normal_force": 5.0, "friction": friction, "static_friction": static}
    if direction is None:
        contact = ss.Contact(tangential="x", slider_speed=speed, **along)
        return ss.Scene([1.0], [[30.0]], [[0.2]], force=[1.0], dofs=("x",), contacts=[contact])
    stiffness, damping = 30.0 * np.eye(2), 0.2 * np.eye(2)
    contact = ss.Contact(tangential=("x", "y"), slider_speed=tuple(speed * direction), **along)
    return ss.Scene([1.0, 1.0], stiffness, damping, force=direction, dofs=("x", "y"), contacts=[contact])


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, 4.4])
def test_motion_along_a_line_has_the_events_of_that_line(angle):
    direction = np.array([np.cos(angle), np.sin(angle)])
    line = ss.simulate(oscillator(None, 0.3), 10.0, ss.State([0.1], [-1.0], "+"))
    plane = ss.simulate(oscillator(direction, 0.3), 10.0, ss.State(0.1 * direction, -1.0 * direction, "oo"))
    kinds = ["slip" if kind.startswith("slip") else kind for kind in line.events.kind]
    assert kinds == list(plane.events.kind)
    assert len(kinds) > 6
    np.testing.assert_allclose(plane.events.time, line.events.time, rtol=2e-15, atol=0)
    np.testing.assert_allclose(direction @ end(plane)[:2], end(line)[0], rtol=1e-14)


@pytest.mark.parametrize("static", [None, 0.9])
@pytest.mark.parametrize(
    ("angle", "law"),
    [
        (0.0, FALLING),
        (2.0, FALLING),
        (4.4, ss.friction.Tabulated([0.0, 0.02, 0.1, 0.3], [0.8, 0.7, 0.5, 0.45])),
    ],
)
def test_motion_along_a_line_under_a_law_has_the_events_of_that_line(angle, law, static):
    direction = np.array([np.cos(angle), np.sin(angle)])
    line = ss.simulate(oscillator(None, 0.1, law, static), 10.0, ss.State([0.1], [-0.2], "+"))
    start = ss.State(0.1 * direction, -0.2 * direction, "oo")
    plane = ss.simulate(oscillator(direction, 0.1, law, static), 10.0, start)
    kinds = ["slip" if kind.startswith("slip") else kind for kind in line.events.kind]
    assert kinds == list(plane.events.kind)
    assert len(kinds) > 6
    np.testing.assert_allclose(plane.events.time, line.events.time, rtol=1e-14, atol=0)
    cycle = plane.limit_cycle()
    assert cycle.period == pytest.approx(line.limit_cycle().period, rel=1e-13)
    for name in ("contact_work", "damping"):
        of_line, of_plane = (run.balance().to_dataset()[name].sum().item() for run in (line, plane))
        assert of_plane == pytest.approx(of_line, rel=1e-11)


def test_a_law_that_changes_over_speeds_within_rounding_or_falls_to_zero_is_named():
    direction = np.array([0.6, 0.8])
    slow = ss.friction.Stribeck(static=0.8, kinetic=0.4, speed=1e-12)
    with pytest.raises(ss.RunError, match="lost in the rounding"):
        ss.simulate(oscillator(direction, 0.1, slow, None), 10.0, ss.State([0.0] * 2, 0.1 * direction, "ss"))
    for law in (ss.friction.Linear(0.3, -1.0), ss.friction.Law(lambda s, v=0.3: 0.3 * (1.0 - (s / v) ** 2))):
        with pytest.raises(ss.RunError, match="its friction reaches 0") as failure:
            ss.simulate(oscillator(direction, 0.1, law, None), 10.0, ss.State(direction, [0.0, 0.0], "oo"))
        end = failure.value.partial
        slip = end.state(end.duration).velocity - 0.1 * direction
        assert np.hypot(*slip) == pytest.approx(0.3, rel=1e-9)


def test_a_cycle_is_continued_over_friction_as_that_along_a_line():
    """With more friction its slip stops earlier than that of the cycle from which Newton's method starts."""
    direction = np.array([0.6, 0.8])
    start = ss.State([0.0, 0.0], 0.1 * direction, "ss")
    cycle = ss.simulate(oscillator(direction, 0.1), 10.0, start).limit_cycle()
    assert cycle.combinations == ("oo", "ss")
    # The contact sticks until it slips, and the function of that has no other zero.
    assert cycle.margins() == ()
    for friction in (0.4, 0.51, 0.6):
        run = ss.simulate(oscillator(None, 0.1, friction), 10.0, ss.State([0.0], [0.1], "s"))
        known = run.limit_cycle().period
        assert cycle.continued(oscillator(direction, 0.1, friction)).period == pytest.approx(known, rel=1e-13)
    branch = ss.continuation(cycle, {"friction": (0.5, 0.6)}, step=0.2)
    assert branch.end == "range"
    assert branch.points == ()
    assert branch.data.followed.all()
    assert branch.data.period.values[-1] == pytest.approx(known, rel=1e-13)


def test_turned_directions_change_nothing():
    assert len(turned_kinds(random_scene, 30)) > 30


@pytest.mark.parametrize("seed", [0, 104, 123, 141, 157])
def test_random_scenes_agree_with_a_general_integrator(seed):
    events, times, state = compared(seed)
    assert (events > 3) == (seed > 0)
    assert times < 1e-9
    assert state < 1e-9


@pytest.mark.parametrize("seed", [12, 18, 28, 36, 39])
def test_random_scenes_under_laws_agree_with_a_general_integrator(seed):
    events, times, state = compared(seed, with_laws(random_scene))
    assert events > 3
    assert times < 1e-9
    assert state < 1e-9


def test_turned_directions_change_nothing_under_laws():
    assert len(turned_kinds(with_laws(random_scene), 20)) > 20


@pytest.mark.parametrize("draw", [random_scene, with_laws(random_scene)])
def test_energy_closes_and_friction_never_gives_any(draw):
    check_energy(draw)


def test_an_onset_without_a_drop_of_friction_takes_few_panels():
    """A mass on a slider, pulled until the force on it is at the limit: slip begins with its rate zero."""
    scene = ss.Scene(
        mass=[1.0, 1.0],
        stiffness=np.diag([20.0, 30.0]),
        dofs=("x", "y"),
        contacts=[ss.Contact(tangential=("x", "y"), normal_force=1.0, friction=0.5, slider_speed=(0.2, 0.1))],
    )
    run = ss.simulate(scene, 1.0, ss.State([0.0, 0.0], [0.2, 0.1], "ss"))
    assert list(run.events.kind) == ["slip"]
    # The forces at the limit: (20 * 0.2)^2 + (30 * 0.1)^2 = (0.5 / t)^2.
    assert run.events.time[0] == pytest.approx(0.1, rel=1e-15)
    stuck = ss.simulate(scene, run.events.time[0], ss.State([0.0, 0.0], [0.2, 0.1], "ss"))
    assert run.counters["panels"] - stuck.counters["panels"] <= 40


@pytest.mark.parametrize("later", [1e-6, 1e-8])
def test_two_slips_begin_one_after_the_other_beside_one_that_turns(later):
    """The directions of young slips follow on panels far wider than they relax, whatever the third slip does.

    The masses do not move each other, so each moves as on its own.
    """
    stiffness, onset, start = 1e4, 5e-4, 2e-5
    speed = np.array([0.1, 0.1, 1e-4])
    limit = stiffness * np.hypot(0.1 * np.array([onset, onset + later]), start)

    def motion(places):
        given = [limit[place] / 0.5 if place < 2 else 1.0 for place in places]
        contacts = [
            ss.Contact(
                tangential=({2 * i: 1.0}, {2 * i + 1: 1.0}),
                normal_force=given[i],
                friction=0.5,
                slider_speed=(speed[place], 0.0),
            )
            for i, place in enumerate(places)
        ]
        size = 2 * len(places)
        scene = ss.Scene([1.0] * size, stiffness * np.eye(size), contacts=contacts)
        # Two stick; the third slides, and its slip turns.
        position = np.concatenate([[0.0, start] if place < 2 else [0.5e-4, 0.0] for place in places])
        velocity = np.concatenate([[0.1, 0.0] if place < 2 else [0.0, 1e-5] for place in places])
        letters = "".join("ss" if place < 2 else "oo" for place in places)
        return ss.simulate(scene, 6e-4, ss.State(position, velocity, letters))

    run = motion([0, 1, 2])
    assert run.events.time == pytest.approx([onset, onset + later], rel=1e-13)
    assert run.counters["panels"] < 20
    end = run.state(6e-4).velocity.reshape(3, 2)
    alone = np.array([motion([place]).state(6e-4).velocity for place in range(3)])
    assert np.abs(end - alone).max() < 1e-14


def test_the_multipliers_of_a_circle_under_a_rotating_load_are_those_of_its_closed_form():
    """In the frame that turns with the load the linearisation is constant; each exponent is one of a pair."""
    rate = 0.8
    scene = rotating_load()
    start = ss.State([2.5, 0.0], [0.0, 2.0], "oo")
    cycle = ss.simulate(scene, 300.0, start).limit_cycle(further=1000.0)
    exponents = [-0.0617497258749691 + 1.79686029855597j, -0.0619603949790288 + 0.195468183464513j]
    known = np.exp(2 * np.pi / rate * np.array([*exponents, *np.conj(exponents)]))
    off = np.abs(np.array(cycle.multipliers)[:, None] - known[None, :])
    assert off.min(axis=0).max() < 1e-13
    assert sorted(np.abs(cycle.multipliers)) == pytest.approx(
        [0.614690860013788] * 2 + [0.615708764022376] * 2, rel=1e-13
    )


def test_a_motion_that_slips_all_the_time_settles_to_a_cycle_without_events():
    """Beyond a supercritical Hopf point under constant friction, whose direction turns with the slip."""
    stiffness = [[100.0, 0.0, 60.0], [0.0, 90.0, -50.0], [60.0, -50.0, 110.0]]
    belt = ss.Contact(tangential=("x", "y"), normal="z", friction=0.6, slider_speed=(1.6, 1.6))
    scene = ss.Scene(
        [1.0, 1.0, 0.5],
        stiffness,
        damping=0.004 * np.array(stiffness),
        force=[0.0, 0.0, -20.0],
        dofs=("x", "y", "z"),
        contacts=[belt],
    )
    rest = ss.steady_sliding(scene)
    assert ss.complex_modes(scene).eigenvalues.real.max() > 0.0
    start = rest.perturbed(velocity={"x": 0.3, "y": -0.2})
    run = ss.simulate(scene, 400.0, start)
    assert len(run.events) == 0
    cycle = run.limit_cycle(further=2000.0)
    assert cycle.combinations == ("oo",)
    assert cycle.stable
    first = cycle.run.state(0.0)

    def after(moved):
        state = ss.State(np.append(moved[:2], 0.0), np.append(moved[2:], 0.0), "oo")
        return end(ss.simulate(scene, cycle.period, state))[[0, 1, 3, 4]]

    place = np.concatenate([first.position[:2], first.velocity[:2]])
    np.testing.assert_allclose(after(place), place, atol=1e-11)
    columns = [(after(place + 1e-6 * unit) - after(place - 1e-6 * unit)) / 2e-6 for unit in np.eye(4)]
    known = sorted(np.abs(np.linalg.eigvals(np.transpose(columns))))
    np.testing.assert_allclose(sorted(np.abs(cycle.multipliers))[-4:], known, atol=1e-7)


@pytest.mark.parametrize(
    ("springs", "mass", "damping", "friction", "speed", "load", "rate"),
    [
        ((2.9, 1.8), 2.0, 0.1, 0.5, 0.05, 1.0, 1.0),
        ((2.5, 2.5), 0.5, 0.02, 0.3, 0.3, 0.5, 1.0),
        ((0.8, 1.7), 0.5, 0.02, 0.5, 0.05, 0.5, 1.0),
        ((1.6, 2.8), 0.5, 0.0, 0.5, 0.05, 0.5, 0.5),
        ((2.2, 1.3), 2.0, 0.0, 0.3, 0.05, 1.0, 0.5),
        ((1.2, 1.2), 0.5, 0.1, 0.3, 0.05, 1.0, 0.8),
    ],
)
def test_the_multipliers_of_straight_slip_have_the_direction_that_neighbours_turn(
    springs, mass, damping, friction, speed, load, rate
):
    """The motion stays on a line, on wide panels; directions of neighbours relax many times over one."""
    scene = ss.Scene(
        [1.0, mass],
        np.diag(springs),
        damping * np.diag(springs),
        dofs=("x", "y"),
        contacts=[
            ss.Contact(tangential=("x", "y"), normal_force=1.0, friction=friction, slider_speed=(speed, 0.0))
        ],
        loads=[ss.Harmonic({"x": load}, rate / (2 * np.pi))],
    )
    settled = 60 * 2 * np.pi / rate
    run = ss.simulate(scene, settled, ss.State([0.0, 0.0], [0.01, 0.0], "oo"))
    cycle = run.limit_cycle(further=200.0)
    state = run.state(settled)
    place = np.concatenate([state.position, state.velocity])
    free = [0, 1, 2, 3] if state.combination == "oo" else [0, 1]

    def after(moved):
        return end(ss.simulate(scene, cycle.period, ss.State(moved[:2], moved[2:], state.combination)))[free]

    columns = [(after(place + 1e-6 * unit) - after(place - 1e-6 * unit)) / 2e-6 for unit in np.eye(4)[free]]
    known = sorted(np.abs(np.linalg.eigvals(np.transpose(columns))))
    np.testing.assert_allclose(sorted(np.abs(cycle.multipliers))[-len(free) :], known, atol=2e-8)


def test_the_multipliers_of_stick_and_slip_are_the_rates_at_which_its_periods_settle():
    scene = ss.Scene(
        [1.0, 1.0],
        [[30.0, 4.0], [4.0, 20.0]],
        0.05 * np.eye(2),
        dofs=("x", "y"),
        contacts=[
            ss.Contact(
                tangential=("x", "y"),
                normal_force=5.0,
                friction=0.3,
                static_friction=0.5,
                slider_speed=(0.2, 0.1),
            )
        ],
    )
    run = ss.simulate(scene, 60.0, ss.State([0.0, 0.0], [0.2, 0.1], "ss"))
    cycle = run.limit_cycle(further=100.0)
    assert sorted(cycle.combinations) == ["oo", "ss"]
    stops = run.events.time[run.events.kind == "velocity"]
    np.testing.assert_allclose(np.diff(stops)[-3:], cycle.period, rtol=1e-12)
    off = np.diff(stops)[4:9] - cycle.period
    ratios = off[1:] / off[:-1]
    shrinking = sorted(np.array(cycle.multipliers).real)[0]
    assert shrinking == pytest.approx(-0.21008, abs=1e-4)
    assert ratios[-1] == pytest.approx(shrinking, rel=1e-3)
    # Two directions are forgotten where the contact sticks, and one is the shift in time.
    assert sorted(np.round(np.abs(cycle.multipliers), 9))[:2] == [0.0, 0.0]
    assert np.abs(cycle.multipliers).max() == pytest.approx(1.0, abs=1e-10)


def test_multipliers_are_the_derivative_of_the_stroboscopic_map():
    """Two bodies that slip, stop and slip again under loads, one without a drop of friction."""
    rng = np.random.default_rng(101)
    stiffness = np.diag(rng.uniform(1, 3, 4)) + 0.3
    rate = rng.uniform(0.6, 1.4)
    contacts = [
        ss.Contact(tangential=("x", "y"), normal_force=1.0, friction=0.8, static_friction=1.0),
        ss.Contact(tangential=("z", "w"), normal_force=0.8, friction=0.6, slider_speed=(0.1, 0.0)),
    ]
    scene = ss.Scene(
        np.repeat(rng.uniform(0.8, 1.2, 2), 2),
        stiffness,
        0.05 * stiffness,
        dofs=("x", "y", "z", "w"),
        contacts=contacts,
        loads=[
            ss.Harmonic({"x": 1.0, "z": 0.5}, rate / 2 / np.pi),
            ss.Harmonic({"y": 0.6, "w": 0.8}, rate / 2 / np.pi, phase=1.0),
        ],
    )
    period = 2 * np.pi / rate
    run = ss.simulate(scene, 60 * period, ss.State(np.zeros(4), 0.1 * rng.normal(size=4), "oooo"))
    cycle = run.limit_cycle(further=100 * period)
    assert {"oooo", "ssoo", "ooss"} == set(cycle.combinations)
    state = run.state(60 * period)
    assert state.combination == "oooo"
    place = np.concatenate([state.position, state.velocity])

    def after(moved):
        return end(ss.simulate(scene, period, ss.State(moved[:4], moved[4:], "oooo")))

    step = 1e-6
    columns = [(after(place + step * unit) - after(place - step * unit)) / (2 * step) for unit in np.eye(8)]
    known = sorted(np.abs(np.linalg.eigvals(np.transpose(columns))))[-4:]
    np.testing.assert_allclose(sorted(np.abs(cycle.multipliers))[-4:], known, atol=1e-8)


@pytest.mark.parametrize("vibrates", [False, True])
def test_multipliers_under_a_law_are_the_derivative_of_the_return_map(vibrates):
    """Two directions of unlike stiffness under friction that falls with the slip speed."""
    law = ss.friction.Stribeck(static=0.5, kinetic=0.3, speed=0.2)
    contact = ss.Contact(tangential=("x", "y"), normal_force=2.0, friction=law, slider_speed=(0.4, 0.2))
    stiffness, rate = np.array([[3.0, 0.5], [0.5, 2.0]]), 0.9
    loads = [ss.Harmonic({"x": 1.2, "y": 0.5}, rate / (2 * np.pi))] if vibrates else []
    damping = (0.3 if vibrates else 0.05) * stiffness
    scene = ss.Scene([1.0, 1.0], stiffness, damping, dofs=("x", "y"), loads=loads, contacts=[contact])
    run = ss.simulate(scene, 150.0, ss.State([0.0, 0.0], [0.1, 0.0], "oo"))
    cycle = run.limit_cycle(further=400.0)
    if vibrates:
        period, state = 2 * np.pi / rate, run.state(20 * 2 * np.pi / rate)
        assert state.combination == "oo"
        place = np.concatenate([state.position, state.velocity])

        def after(moved):
            return end(ss.simulate(scene, period, ss.State(moved[:2], moved[2:], "oo")))

        columns = [(after(place + 1e-6 * unit) - after(place - 1e-6 * unit)) / 2e-6 for unit in np.eye(4)]
        known = sorted(np.abs(np.linalg.eigvals(np.transpose(columns))))
        np.testing.assert_allclose(sorted(np.abs(cycle.multipliers)), known, atol=1e-7)
        return
    slips = run.events.time[run.events.kind == "slip"]
    off = np.diff(slips)[3:8] - cycle.period
    shrinking = sorted(np.array(cycle.multipliers).real, key=abs)[-2]
    assert (off[1:] / off[:-1])[-1] == pytest.approx(shrinking, rel=1e-2)


def test_a_slip_that_ends_slowly_takes_few_panels():
    """The forces on the contact are just below its limit: its direction relaxes much faster than it stops."""
    scene = puck(9.81, 0.5, 1.0003 * float(np.tan(0.5)))
    run = ss.simulate(scene, 1.0, ss.State([0.0, 0.0], [1e-3, 0.0], "oo"))
    pull = 9.81 * np.sin(0.5)
    assert run.events.time[0] == pytest.approx(1e-3 * 1.0003 / (pull * (1.0003**2 - 1)), rel=1e-11)
    assert run.counters["panels"] < 80


@pytest.mark.parametrize(
    "friction", [0.5, ss.friction.Linear(0.4, 0.2), ss.friction.Stribeck(static=0.6, kinetic=0.4, speed=0.05)]
)
def test_a_motion_comes_to_steady_sliding_where_its_energy_cannot_stop_it(friction):
    scene = oscillator(np.array([0.6, 0.8]), 0.3, friction)
    near = ss.steady_sliding(scene).perturbed(velocity={"x": 0.05})
    with pytest.raises(ss.NotPeriodicError, match="settles to an equilibrium"):
        ss.simulate(scene, 1.0, near).limit_cycle(further=5.0)


def test_a_motion_that_friction_may_yet_drive_to_a_stop_has_not_come_to_steady_sliding():
    """Steady sliding is stable, but a little slower friction falls so steeply that it feeds the motion."""
    law = ss.friction.Law("0.3 + 0.2 / (1 + exp((s - v) / width))", v=0.28, width=0.002)
    scene = oscillator(np.array([0.6, 0.8]), 0.3, law)
    rest = ss.steady_sliding(scene)
    assert ss.complex_modes(scene).eigenvalues.real.max() < 0.0
    moved = ss.simulate(scene, 60.0, rest.perturbed(velocity={"x": 0.05, "y": 0.02}))
    assert "velocity" in moved.events.kind
    assert moved.limit_cycle().period > 0.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"normal_stiffness": 1e3}, "normal_stiffness"),
        ({"friction": 0.0, "static_friction": 0.1}, "> 0 in a plane beside static friction"),
        ({"slider_speed": 0.1}, "expected a pair"),
        ({"tangential_stiffness": 1e3, "static_friction": 0.5}, "a tangential_stiffness and a static"),
        ({"friction": FALLING, "static_friction": 0.8, "tangential_stiffness": 1e3}, "depends on slip speed"),
        ({"friction": ss.friction.Linear(0.0, 0.3)}, "friction: must be > 0 at rest, in a plane"),
        ({"friction": ss.friction.Dahl(kinetic=0.4, stiffness=100.0)}, "friction with a state"),
    ],
)
def test_what_is_not_computed_in_a_plane_is_refused(changes, said):
    given = {"tangential": ("x", "y"), "normal_force": 1.0, "friction": 0.3} | changes
    with pytest.raises(ss.InputError, match=said):
        ss.Scene(np.ones(3), np.eye(3), dofs=("x", "y", "z"), contacts=[ss.Contact(**given)])


def test_both_directions_have_one_status():
    scene = puck(9.81, 0.5, 0.8)
    with pytest.raises(ss.InputError, match="contacts 0 and 1 are friction in one plane"):
        ss.simulate(scene, 1.0, ss.State([0.0, 0.0], [1.0, 0.0], "os"))
    with pytest.raises(ss.InputError, match="friction in one plane"):
        ss.complex_modes(scene, "+-")


def test_a_number_of_one_direction_is_that_of_both():
    scene = puck(9.81, 0.5, 0.8).replace(friction_puck_x=0.9)
    assert [contact.friction for contact in scene.contacts] == [0.9, 0.9]
    faster = scene.replace(slider_speed_puck_y=0.3)
    assert [contact.slider_speed for contact in faster.contacts] == [0.0, 0.3]
