"""Laws of friction that rise with slip speed where slip has no mass: a motion of first order."""

from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss
from return_map import assert_multipliers
from stickslip import NotPeriodicError
from stickslip.scene.laws.friction import FrictionLaw, Linear, Rational, Stribeck, Tabulated

#: Slope of a law, s/m, slider speed, m/s, given normal force, N, and spring of a node, N/m.
SLOPE, SPEED, PRESSED, SPRING = 0.3, 0.2, 10.0, 700.0
LINEAR = Linear(0.4, SLOPE)
LAWS = [
    LINEAR,
    Stribeck(0.5, 0.3, 0.1, viscous=2.5),
    Stribeck(0.3, 0.6, 0.3),
    Rational(0.3, 0.5, 0.1),
    Tabulated([0.0, 0.1, 0.3, 2.0], [0.3, 0.35, 0.5, 1.4]),
]


def block(law: FrictionLaw | float, **changes) -> ss.Scene:
    """Return a mass of 1 kg with a node on a belt, under a given normal force."""
    given = {"normal_force": PRESSED, "slider_speed": SPEED, "tangential_stiffness": SPRING}
    loads = changes.pop("loads", ())
    node = ss.Contact(tangential=0, friction=law, **{**given, **changes})
    return ss.Scene([1.0], [[100.0]], damping=[[0.4]], contacts=[node], loads=loads)


def slip_speed(law: FrictionLaw, friction: float, pressed: float) -> float:
    """Return the slip speed at which a law has a friction force, of its sign; 0 where the force holds."""
    excess = abs(friction) / pressed - law.coefficient(0.0)
    if excess <= 0.0:
        return 0.0
    top = 2.0 if isinstance(law, Tabulated) else 1e3
    speed = brentq(
        lambda s: law.coefficient(s) - law.coefficient(0.0) - excess, 0.0, top, xtol=1e-17, rtol=1e-15
    )
    return float(np.copysign(speed, friction))


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_slip_agrees_with_an_integrator(law):
    scene = block(law)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.6})
    run = ss.simulate(scene, 3.0, start)
    assert run.events.time.size >= 2

    def rate(_: float, y: np.ndarray, slides: bool) -> list[float]:
        place, velocity, node = y
        friction = SPRING * (node - place)
        slip = slip_speed(law, friction, PRESSED) if slides else 0.0
        return [velocity, friction - 100.0 * place - 0.4 * velocity, SPEED - slip]

    friction = float(run.sample([0.0]).friction_force.values[0, 0])
    y = np.array([start.position[0], start.velocity[0], start.position[0] + friction / SPRING])
    instants = [0.0, *run.events.time[run.events.time < 0.8], 0.8]
    for begin, end in pairwise(instants):
        slides = run.state(0.5 * (begin + end)).combination != "s"
        path = solve_ivp(rate, (begin, end), y, method="DOP853", rtol=1e-13, atol=1e-15, args=(slides,))
        y = path.y[:, -1]
        state = run.state(end)
        force = run.sample([end]).friction_force.values[0, 0]
        found = [*state.position, *state.velocity, state.position[0] + force / SPRING]
        np.testing.assert_allclose(found, y, rtol=0.0, atol=1e-11)
    # Works of some joules.
    assert abs(run.balance().residual) < 1e-12
    sample = run.energy(np.linspace(0.01, 3.0, 60))
    powers = sample.contact_power.sum("contact") + sample.external_power - sample.damping_power
    np.testing.assert_allclose(sample.energy_rate, powers, atol=1e-11)


def test_a_node_without_mass_relaxes_exponentially():
    """With `k q + mu(|s|) N = 0` and a linear law of slope m, `q' = v - (k q / N - mu_0) / m`."""
    k, pressed, at_rest, slope, speed, start = 50.0, 4.0, 0.3, 0.5, 0.2, 0.02
    law = Linear(at_rest, slope)
    contact = ss.Contact(tangential=1, normal_force=pressed, friction=law, slider_speed=speed)
    scene = ss.Scene([1.0, 0.0], np.diag([100.0, k]), contacts=[contact])
    run = ss.simulate(scene, 1.0, ss.State([0.1, start], [0.0, 0.0], "s"))
    onset = (at_rest * pressed / k - start) / speed
    assert list(run.events.kind) == ["slip+"]
    assert run.events.time[0] == pytest.approx(onset, abs=4.0 * np.finfo(float).eps)
    last = pressed * (at_rest + slope * speed) / k
    for time in (0.05, 0.1, 0.4, 0.9):
        gone = np.exp(-k / (slope * pressed) * (time - onset))
        state = run.state(time)
        assert state.position[1] == pytest.approx(last + (at_rest * pressed / k - last) * gone, abs=1e-16)
        rate = (last - at_rest * pressed / k) * k / (slope * pressed) * gone
        assert state.velocity[1] == pytest.approx(rate, abs=1e-14)
        assert state.position[0] == pytest.approx(0.1 * np.cos(10.0 * time), abs=1e-15)


def test_a_stribeck_law_agrees_with_thirty_digits():
    law = LAWS[1]
    scene = block(law)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": -0.1})
    run = ss.simulate(scene, 0.05, start)
    assert run.events.time.size == 0
    friction = float(run.sample([0.0]).friction_force.values[0, 0])
    with mp.workdps(30):
        falling, scale = mp.mpf(law.static) - mp.mpf(law.kinetic), mp.mpf(law.speed)
        wanted = mp.mpf(friction) / mp.mpf(PRESSED) - mp.mpf(law.kinetic)

        def coefficient(speed):
            return falling * mp.exp(-speed / scale) + mp.mpf(law.viscous) * speed

        def rate(_, y):
            # The slip speed is an entry in place of the node: `mu'(|s|) N |s|' = k (v - |s| - x')`.
            place, velocity, speed = y
            force = mp.mpf(PRESSED) * (mp.mpf(law.kinetic) + coefficient(speed))
            slope = mp.mpf(law.viscous) - falling / scale * mp.exp(-speed / scale)
            faster = SPRING * (mp.mpf(SPEED) - speed - velocity) / (slope * mp.mpf(PRESSED))
            return [velocity, force - 100 * place - mp.mpf(0.4) * velocity, faster]

        first = mp.findroot(lambda speed: coefficient(speed) - wanted, mp.mpf(SPEED))
        path = mp.odefun(rate, 0, [mp.mpf(start.position[0]), mp.mpf(start.velocity[0]), first])
        expected = [float(entry) for entry in path(mp.mpf(0.05))[:2]]
    state = run.state(0.05)
    np.testing.assert_allclose([*state.position, *state.velocity], expected, rtol=0.0, atol=4e-16)


def test_a_mass_that_vanishes_has_the_same_motion():
    law = LINEAR
    nodes = block(law)
    rest = ss.steady_sliding(nodes)
    expected = ss.simulate(nodes, 0.06, rest.perturbed(velocity={"x1": 0.15}))
    steady = law.coefficient(SPEED) * PRESSED / SPRING
    differences = []
    for mass in (1e-5, 1e-6, 1e-7):
        contact = ss.Contact(tangential=1, normal_force=PRESSED, friction=law, slider_speed=SPEED)
        stiffness = [[100.0 + SPRING, -SPRING], [-SPRING, SPRING]]
        scene = ss.Scene([1.0, mass], stiffness, damping=np.diag([0.4, 0.0]), contacts=[contact])
        start = ss.State([rest.position[0], rest.position[0] + steady], [0.15, 0.0], "+")
        run = ss.simulate(scene, 0.06, start)
        differences.append(abs(run.state(0.06).velocity[0] - expected.state(0.06).velocity[0]))
    assert differences[0] < 1e-3
    # In proportion to the mass.
    assert differences[1] == pytest.approx(0.1 * differences[0], rel=0.05)
    assert differences[2] == pytest.approx(0.01 * differences[0], rel=0.05)


def test_static_friction_above_the_law_begins_slip_at_a_finite_speed():
    run = ss.simulate(block(LINEAR, static_friction=0.5), 4.0, ss.State([0.0], [0.0], "s"))
    assert run.events.kind[0] == "slip+"
    onset = run.events.time[0]
    sample = run.sample([onset])
    assert sample.friction_force.values[0, 0] == pytest.approx(0.5 * PRESSED, rel=1e-12)
    # 0.5 = 0.4 + 0.3 |s|
    power = run.energy([onset]).wear_power.values[0, 0]
    assert power == pytest.approx(PRESSED * 0.1 / SLOPE, rel=1e-9)


def test_normal_force_of_a_spring_agrees_with_an_integrator():
    normal_spring = 900.0
    contact = ss.Contact(
        tangential=0,
        normal=1,
        friction=LINEAR,
        slider_speed=SPEED,
        tangential_stiffness=SPRING,
        normal_stiffness=normal_spring,
    )
    stiffness, damping = np.array([[100.0, -40.0], [-40.0, 300.0]]), np.array([0.4, 0.8])
    force = np.array([0.0, -12.0])
    scene = ss.Scene([1.0, 1.5], stiffness, damping=np.diag(damping), force=force, contacts=[contact])
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.1, "x2": -0.05})
    run = ss.simulate(scene, 2.0, start)

    def rate(_: float, y: np.ndarray) -> list[float]:
        friction, pressed = SPRING * (y[4] - y[0]), -normal_spring * y[1]
        rest = force - stiffness @ y[:2] - damping * y[2:4] + [friction, pressed]
        return [*y[2:4], rest[0], rest[1] / 1.5, SPEED - slip_speed(LINEAR, friction, pressed)]

    friction = float(run.sample([0.0]).friction_force.values[0, 0])
    y = np.r_[start.position, start.velocity, start.position[0] + friction / SPRING]
    instants = [0.0, *run.events.time, 2.0]
    for begin, end in pairwise(instants):
        path = solve_ivp(rate, (begin, end), y, method="DOP853", rtol=1e-13, atol=1e-15, max_step=0.05)
        y = path.y[:, -1]
    state = run.state(2.0)
    np.testing.assert_allclose([*state.position, *state.velocity], y[:4], rtol=0.0, atol=1e-11)
    assert abs(run.balance().residual) < 1e-12


def boundary(laws: list[FrictionLaw | float]) -> ss.Scene:
    """Return two masses, each tied to a dof without mass on a belt; springs tie these to each other."""
    stiffness = np.array(
        [
            [300.0, 0.0, -200.0, 0.0],
            [0.0, 400.0, 0.0, -250.0],
            [-200.0, 0.0, 500.0, -120.0],
            [0.0, -250.0, -120.0, 600.0],
        ]
    )
    contacts = [
        ss.Contact(tangential=2, normal_force=8.0, friction=laws[0], slider_speed=0.2),
        ss.Contact(tangential=3, normal_force=6.0, friction=laws[1], slider_speed=0.1),
    ]
    damping = np.diag([0.4, 0.6, 0.0, 0.0])
    return ss.Scene([1.0, 1.5, 0.0, 0.0], stiffness, damping=damping, contacts=contacts)


def test_contacts_that_springs_tie_agree_with_an_integrator():
    scene = boundary([LINEAR, LINEAR])
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.8, "x2": -0.7})
    run = ss.simulate(scene, 2.5, start)
    assert run.events.time.size > 10

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        forces = scene.stiffness @ y[:4]
        given = zip(forces[2:], (8.0, 6.0), (0.2, 0.1), strict=True)
        slips = [speed - slip_speed(LINEAR, friction, pressed) for friction, pressed, speed in given]
        return np.r_[y[4:], slips, (-forces[:2] - np.array([0.4, 0.6]) * y[4:]) / [1.0, 1.5]]

    y = np.r_[start.position, start.velocity[:2]]
    instants = [0.0, *run.events.time, 2.5]
    for begin, end in pairwise(instants):
        if end > begin:
            path = solve_ivp(rate, (begin, end), y, method="DOP853", rtol=1e-13, atol=1e-15, max_step=0.05)
            y = path.y[:, -1]
    state = run.state(2.5)
    np.testing.assert_allclose([*state.position, *state.velocity[:2]], y, rtol=0.0, atol=1e-11)
    assert abs(run.balance().residual) < 1e-12


@pytest.mark.parametrize("laws", [[LINEAR, 0.5], [LAWS[3], LINEAR], [0.5, LAWS[1]]], ids=repr)
def test_energy_closes_beside_other_contacts_without_mass(laws):
    scene = boundary(laws)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.1, "x2": -0.7})
    run = ss.simulate(scene, 4.0, start)
    assert run.events.time.size > 3
    assert abs(run.balance().residual) < 1e-12


def test_a_motion_goes_on_from_its_states():
    scene = block(LINEAR)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.6})
    run = ss.simulate(scene, 1.0, start)
    for phase in (0, 1, 2):
        begin = 0.5 * (np.r_[0.0, run.events.time][phase] + run.events.time[phase])
        later = ss.simulate(scene, 1.0 - begin, run.state(begin))
        np.testing.assert_allclose(later.events.time + begin, run.events.time[phase:], rtol=0.0, atol=1e-14)


def test_switched_loads_change_the_slip_speed_at_once():
    contact = ss.Contact(tangential=1, normal_force=4.0, friction=LINEAR, slider_speed=SPEED)
    loads = [ss.Switched({"x2": 1.0}, times=[0.1, 0.2], values=[0.0, 0.5, 5.0])]
    scene = ss.Scene([1.0, 0.0], np.diag([100.0, 50.0]), contacts=[contact], loads=loads)
    run = ss.simulate(scene, 0.3, ss.State([0.0, 0.037], [0.0, 0.0], "+"))
    assert list(run.events.kind).count("load") == 2
    for time in (0.1, 0.2):
        before, after = (run.state(instant).position[1] for instant in (time - 1e-12, time))
        assert after == pytest.approx(before, abs=1e-11)
    assert abs(run.balance().residual) < 1e-12


@pytest.mark.parametrize("law", [LINEAR, LAWS[1], LAWS[3]], ids=repr)
def test_multipliers_are_those_of_differenced_runs(law):
    contacts = [
        ss.Contact(tangential=0, normal_force=10.0, friction=Stribeck(0.5, 0.3, 0.1), slider_speed=0.1),
        ss.Contact(tangential=2, normal_force=2.0, friction=law, slider_speed=0.1),
    ]
    stiffness = [[140.0, -40.0, 0.0], [-40.0, 400.0, -300.0], [0.0, -300.0, 320.0]]
    scene = ss.Scene([1.0, 0.8, 0.0], stiffness, damping=np.diag([0.1, 0.1, 0.0]), contacts=contacts)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.01})
    cycle = ss.simulate(scene, 60.0, start).limit_cycle()
    assert len(cycle.combinations) > 1
    assert_multipliers(cycle, 1e-6)


def settled(scene: ss.Scene, start: ss.State, duration: float, further: float = 10.0) -> str:
    """Return what a motion settles to."""
    with pytest.raises(NotPeriodicError) as found:
        ss.simulate(scene, duration, start).limit_cycle(further)
    return found.value.kind


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_motion_that_comes_to_rest_is_an_equilibrium(law):
    scene = block(law)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.6})
    assert settled(scene, start, 60.0) == "equilibrium"


def test_contacts_that_springs_tie_come_to_rest():
    scene = boundary([LAWS[3], LAWS[1]])
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.8, "x2": -0.7})
    assert settled(scene, start, 60.0) == "equilibrium"


@pytest.mark.parametrize("law", [LAWS[0], LAWS[3]], ids=repr)
def test_what_counts_as_rest_has_no_later_event(law):
    """Slip of a node ends first where the body moves by about the speed of the slider."""
    scene = block(law)
    rest = ss.steady_sliding(scene)
    kinds = []
    for speed in np.geomspace(1e-3, 0.4, 40):
        start = rest.perturbed(velocity={"x1": float(speed)})
        run = ss.simulate(scene, 30.0, start)
        kinds.append((settled(scene, start, 1e-6, further=0.0) == "equilibrium", run.events.time.size == 0))
    proved, lasts = np.transpose(kinds)
    assert not np.any(proved & ~lasts)
    assert 5 < proved.sum() < lasts.sum() < 40


PRESSING = 900.0


def bouncing(law: FrictionLaw | float, speed: float, spring: float) -> ss.Scene:
    """Return two coupled dofs whose compliant contact opens and closes."""
    given = {"tangential": 0, "normal": 1, "normal_stiffness": PRESSING, "tangential_stiffness": spring}
    contact = ss.Contact(**given, friction=law, slider_speed=speed)
    stiffness = [[100.0, -40.0], [-40.0, 300.0]]
    damping = np.diag([0.4, 0.8])
    return ss.Scene([1.0, 1.5], stiffness, damping=damping, force=[0.0, -12.0], contacts=[contact])


FLIGHT = ss.State([0.0, 0.01], [0.3, -0.02], "d")


def test_a_contact_that_sticks_as_it_closes_goes_on():
    """Until it slips and opens again: before, the node moves with the slider."""
    scene = bouncing(Linear(4.0, SLOPE), 0.2, 150.0)
    closing = ss.simulate(scene, 0.05, FLIGHT).events
    assert list(closing.kind) == ["closing"]
    assert list(closing.combination) == ["s"]
    (time,) = closing.time
    run = ss.simulate(scene, time + 0.05, FLIGHT)
    assert run.events.time.size == 1
    state = run.state(time)
    node = state.position[0]

    def rate(t: float, y: np.ndarray) -> list[float]:
        forces = [150.0 * (node + 0.2 * (t - time) - y[0]), -PRESSING * y[1]]
        rest = scene.force - scene.stiffness @ y[:2] - scene.damping @ y[2:] + forces
        return [*y[2:], *(rest / [1.0, 1.5])]

    start = np.r_[state.position, state.velocity]
    path = solve_ivp(rate, (time, time + 0.05), start, method="DOP853", rtol=1e-13, atol=1e-15)
    end = run.state(time + 0.05)
    np.testing.assert_allclose(np.r_[end.position, end.velocity], path.y[:, -1], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("law", "spring"),
    [(LINEAR, 3000.0), (LAWS[1], 3000.0), (LAWS[3], 150.0), (LAWS[4], 700.0), (Linear(0.4, 2.0), 150.0)],
    ids=repr,
)
def test_a_closing_into_slip_ends_a_run_with_the_reason(law, spring):
    """The friction force would grow faster than the static bound: `k (v - x') > mu N'`."""
    start = ss.State([0.0, 0.01], [-3.0, -0.02], "d")
    with pytest.raises(ss.RunError, match="if the contact does not slip as it does"):
        ss.simulate(bouncing(law, 1.0, spring), 1.0, start)


@pytest.mark.parametrize(("law", "spring"), [(LINEAR, 3000.0), (LINEAR, 150.0), (LAWS[3], 700.0)], ids=repr)
def test_an_opening_from_slip_ends_a_run_with_the_reason(law, spring):
    scene = bouncing(law, 0.2, spring)
    start = ss.steady_sliding(scene).perturbed(velocity={"x2": 2.0})
    with pytest.raises(ss.RunError, match=r"leave tangential_stiffness out, give the dofs mass") as ended:
        ss.simulate(scene, 1.0, start)
    # Up to there the normal force is above zero and falls to it.
    time = float(str(ended.value).split("t = ")[1].split(" s")[0])
    run = ss.simulate(scene, time * (1.0 - 1e-6), start)
    forces = run.sample(np.linspace(0.0, run.duration, 200)).normal_force.values[:, 0]
    assert forces.min() == forces[-1]
    assert 0.0 < forces[-1] < 1e-4 * forces[0]


def test_opening_and_closing_of_contacts_that_are_tied_end_a_run_with_the_reason():
    """The tangential and the normal direction of a boundary without mass, tied by stiffness."""
    stiffness = np.array(
        [
            [400.0, 0.0, -300.0, 0.0],
            [0.0, 500.0, 0.0, -400.0],
            [-300.0, 0.0, 320.0, -60.0],
            [0.0, -400.0, -60.0, 450.0],
        ]
    )
    contact = ss.Contact(tangential=2, normal=3, friction=LINEAR, slider_speed=SPEED)
    scene = ss.Scene([1.0, 1.5, 0.0, 0.0], stiffness, force=[0.0, -12.0, 0.0, 0.0], contacts=[contact])
    start = ss.steady_sliding(scene).perturbed(velocity={"x2": 3.0})
    with pytest.raises(ss.RunError, match="no stiffness ties that direction"):
        ss.simulate(scene, 3.0, start)


def test_a_law_that_levels_off_ends_a_run_with_the_reason():
    law = Tabulated([0.0, 0.1, 0.3, 1.0], [0.3, 0.35, 0.5, 0.6])
    contact = ss.Contact(tangential=1, normal_force=4.0, friction=law, slider_speed=SPEED)
    # The load falls so fast that the spring of the node takes it past the largest friction force.
    loads = [ss.Harmonic({"x2": 40.0}, frequency=0.5)]
    scene = ss.Scene([1.0, 0.0], np.diag([100.0, 50.0]), contacts=[contact], loads=loads)
    with pytest.raises(ss.RunError, match="levels off"):
        ss.simulate(scene, 3.0, ss.State([0.0, 0.82], [0.0, 0.0], "s"))


def test_a_law_of_one_value_is_a_number():
    number, law = (
        ss.simulate(block(friction), 5.0, ss.State([0.05], [0.3], "s"))
        for friction in (0.5, Linear(0.5, 0.0))
    )
    assert number.events.time.size > 0
    np.testing.assert_array_equal(number.events.time, law.events.time)


@pytest.mark.parametrize(
    ("law", "reason"),
    [
        (Stribeck(0.5, 0.3, 0.1), "no quasi-static motion follows"),
        (Linear(0.5, -0.2), "no quasi-static motion follows"),
        (Stribeck(0.5, 0.3, 0.1, viscous=1.0), "no quasi-static motion follows"),
        (Tabulated([0.0, 0.1, 0.2, 0.3], [0.3, 0.4, 0.4, 0.5]), "does not rise"),
    ],
    ids=repr,
)
def test_laws_that_do_not_rise_are_refused_with_the_reason(law, reason):
    with pytest.raises(ss.InputError, match="contact 0: friction") as refused:
        block(law)
    assert reason in str(refused.value)
    assert "tangential_stiffness" in str(refused.value)


@pytest.mark.parametrize("force", [0.0, 0.05])
def test_a_node_starts_with_the_friction_force_of_the_state_also_without_any(force):
    """On a body held at rest: `c k^-1 T' + T = c v` with a damper `c = slope N` between node and slider."""
    law = Linear(0.0, 0.5)
    node = ss.Contact(
        tangential=0, normal_force=2.0, friction=law, slider_speed=0.1, tangential_stiffness=1e3
    )
    # So heavy that it does not move: 1e-15 m/s after 10 ms.
    scene = ss.Scene([1e12], [[1e12]], contacts=[node])
    run = ss.simulate(scene, 0.01, ss.State([0.0], [0.0], "+", friction_force=[force]))
    time = np.linspace(0.0, 0.01, 5)
    damper = 0.5 * 2.0
    expected = damper * 0.1 + (force - damper * 0.1) * np.exp(-time * 1e3 / damper)
    np.testing.assert_allclose(run.sample(time).friction_force.values[:, 0], expected, atol=1e-12)
    # Without a force in the state it slides steadily.
    steady = ss.simulate(scene, 0.01, ss.State([0.0], [0.0], "+"))
    np.testing.assert_allclose(steady.sample(time).friction_force.values[:, 0], damper * 0.1, rtol=1e-12)
