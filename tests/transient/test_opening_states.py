"""Contacts with a state under normal forces that change: closed forms, modes, cycles, other integrators."""

import numpy as np
import pytest

import stickslip as ss
from nightly import nightly
from opening_state_scenes import OpeningEquations, followed_openings, opening_scene

LUGRE = ss.friction.LuGre(static=0.8, kinetic=0.4, speed=0.1, stiffness=400.0, damping=0.2, viscous=0.01)
DAHL = ss.friction.Dahl(0.5, 300.0)
ROCK = ss.friction.RateState(0.5, 0.05, 0.06, 0.02, 0.1)
LOOP = ss.friction.BoucWen(0.5, 300.0, exponent=2.0, share=0.3)
PLASTIC = ss.friction.ElastoPlastic(0.5, 300.0, break_away=0.6, damping=0.05, viscous=0.02)
LAWS = pytest.mark.parametrize(
    "law",
    [LUGRE, DAHL, ROCK, LOOP, PLASTIC],
    ids=["LuGre", "Dahl", "rate and state", "Bouc-Wen", "elasto-plastic"],
)
SHAKER = ss.Harmonic({"y": 7.0, "x": 1.0}, frequency=1.1, name="shaker")


def pressed(law, coupling=20.0, loads=(), speed=0.2, **contact):
    """Return a mass with two dofs that its weight presses on a slider."""
    belt = ss.Contact(tangential="x", normal="y", friction=law, slider_speed=speed, **contact)
    return ss.Scene(
        [1.0, 0.7],
        [[90.0, coupling], [coupling, 200.0]],
        damping=[[0.3, 0.0], [0.0, 0.1]],
        force=[0.0, -5.0],
        contacts=[belt],
        dofs=["x", "y"],
        loads=loads,
    )


def test_bristles_follow_the_place_whatever_the_normal_force():
    """Dahl: ``z - z_end`` falls by ``exp(-stiffness |dx| / kinetic)``, and T is ``-N(t) stiffness z``."""
    shaker = ss.Harmonic({"y": 3.0}, frequency=2.3, name="shaker")
    scene = pressed(DAHL, coupling=0.0, loads=[shaker], speed=0.0)
    start = ss.State([0.1, 0.0], [0.0, 0.0], "+", scene.dofs, internal={0: 0.0})
    run = ss.simulate(scene, 3.0, start)
    assert len(run.events) > 5
    assert set(run.events.kind) == {"velocity"}
    place, z, sign = 0.1, 0.0, 1.0
    for k, time in enumerate(run.events.time):
        there = float(run.event_states()[0][k, 0])
        end = -sign * DAHL.kinetic / DAHL.stiffness
        z = end + (z - end) * np.exp(-DAHL.stiffness * abs(there - place) / DAHL.kinetic)
        assert run.state(float(time)).internal == pytest.approx([z], abs=1e-15)
        force = run.sample([time])
        assert force.normal_force.item() == pytest.approx(
            5.0 - 3.0 * np.cos(2.0 * np.pi * 2.3 * time), abs=1e-12
        )
        expected = -force.normal_force.item() * DAHL.stiffness * z
        assert force.friction_force.item() == pytest.approx(expected, abs=1e-12)
        place, sign = there, -sign


@LAWS
def test_a_constant_reaction_is_a_given_normal_force(law):
    """Of loops the reaction multiplies formulas in pieces, and a given force a table of the deflection."""
    contact = ss.Contact(tangential="x", normal_force=5.0, friction=law, slider_speed=0.2)
    alone = ss.Scene([1.0], [[90.0]], damping=[[0.3]], contacts=[contact], dofs=["x"])
    one = ss.simulate(alone, 3.0, ss.State([0.3], [0.0], "+", ["x"], internal={0: 0.0}))
    two = ss.simulate(
        pressed(law, coupling=0.0),
        3.0,
        ss.State([0.3, 0.0], [0.0, 0.0], "+", ["x", "y"], internal={0: 0.0}),
    )
    assert len(one.events) > 3
    assert two.events.time == pytest.approx(one.events.time, abs=1e-12)
    ends = [run.state(3.0) for run in (one, two)]
    assert ends[1].position[0] == pytest.approx(ends[0].position[0], abs=1e-13)
    assert ends[1].internal == pytest.approx(ends[0].internal, abs=1e-14)


@LAWS
def test_a_contact_that_lifts_off_loses_its_state(law):
    """It opens where ``N = 5 - 7 sin(2 pi f t)`` vanishes, and closes with a state of 0."""
    shaker = ss.Harmonic({"y": 7.0}, frequency=1.1, phase=-np.pi / 2.0, name="shaker")
    scene = pressed(law, coupling=0.0, loads=[shaker])
    rest = ss.steady_sliding(pressed(law, coupling=0.0))
    run = ss.simulate(scene, 1.0, ss.State(rest.position, [0.0, 0.0], "+", scene.dofs))
    kinds = list(run.events.kind)
    lifted, struck = kinds.index("release"), kinds.index("impact")
    time = np.arcsin(5.0 / 7.0) / (2.0 * np.pi * 1.1)
    assert float(run.events.time[lifted]) == pytest.approx(time, abs=1e-12)
    assert run.state(time - 1e-9).internal[0] != 0.0
    for when in (run.events.time[lifted], run.events.time[struck]):
        assert run.state(float(when)).internal == [0.0]
    air = run.sample([0.5 * float(run.events.time[lifted] + run.events.time[struck])])
    assert (air.normal_force.item(), air.friction_force.item()) == (0.0, 0.0)
    assert run.state(float(run.events.time[struck]) + 1e-3).internal[0] != 0.0
    balance = run.balance()
    assert abs(balance.residual) < 1e-13 * balance.turnover


@pytest.mark.parametrize("index", nightly([0, 1, 2, 3, 24], lambda index: index != 24))
def test_random_scenes_by_another_integrator(index):
    found = followed_openings(*opening_scene(1, index))
    assert found.events > 50
    assert found.missed == 0
    assert found.state < 1e-9
    assert found.energy < 1e-12


@pytest.mark.parametrize("stiffness", [None, 3000.0], ids=["rigid", "compliant"])
@LAWS
def test_modes_are_those_of_the_equations(law, stiffness):
    """With ``dT = -N_0 df - f dN``: by differences of the equations in x, x' and z."""
    scene = pressed(law, normal_stiffness=stiffness)
    equations, rest = OpeningEquations(scene), ss.steady_sliding(scene)
    y = equations.state(ss.simulate(scene, 1e-9, rest).state(0.0))
    assert np.abs(equations.rate(0.0, y, "+")).max() < 1e-12
    steps = 1e-4 * np.maximum(np.abs(y), 1e-2)

    def slope(unit, h):
        along = [equations.rate(0.0, y + k * h * unit, "+") for k in (-2.0, -1.0, 1.0, 2.0)]
        return (along[0] - 8.0 * along[1] + 8.0 * along[2] - along[3]) / (12.0 * h)

    jacobian = np.array([slope(unit, h) for unit, h in zip(np.eye(5), steps, strict=True)]).T
    if law is PLASTIC:
        # Its rate is linear in z beyond steady slip, and bends before.
        further = equations.rate(0.0, y + np.eye(5)[4] * y[4], "+")
        jacobian[:, 4] = (further - equations.rate(0.0, y, "+")) / y[4]
    free = [0, 2, 4] if stiffness is None else range(5)
    expected = np.linalg.eigvals(jacobian[np.ix_(free, free)])
    expected = np.sort_complex(expected[expected.imag >= 0.0])
    found = np.sort_complex(ss.complex_modes(scene).eigenvalues)
    assert found == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_a_cycle_with_lift_off_has_the_multipliers_of_its_neighbours(restitution):
    scene = pressed(LUGRE, loads=[SHAKER], restitution=restitution)
    run = ss.simulate(scene, 30.0, ss.State([0.0, 0.01], [0.0, 0.0], "d", scene.dofs))
    cycle = run.limit_cycle(further=60.0)
    assert "release" in set(cycle.run.events.kind)
    assert abs(cycle.balance().residual) < 1e-14
    start = cycle.run.state(0.0)
    assert start.combination == "d"
    step, columns = 1e-6, []
    for unit in np.eye(4):
        ends = []
        for sign in (1.0, -1.0):
            moved = sign * step * unit
            near = ss.State(
                start.position + moved[:2],
                start.velocity + moved[2:],
                "d",
                scene.dofs,
                internal=start.internal,
            )
            end = ss.simulate(scene, cycle.period, near).state(cycle.period)
            ends.append(np.concatenate([end.position, end.velocity]))
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    expected = np.sort(np.abs(np.linalg.eigvals(np.array(columns).T)))
    assert np.sort(np.abs(cycle.multipliers)) == pytest.approx(expected, abs=1e-7)


def test_the_slip_law_is_that_of_ruina():
    law = ss.friction.RateState(0.6, 0.01, 0.015, 1e-5, 1e-6, state_evolution="slip")
    own = ss.friction.StateLaw(
        "direct * log(abs(s) / speed) * sign(s) + (reference + evolution * z) * sign(s)",
        "-(abs(s) / length) * (log(abs(s) / speed) + z)",
        **law.parameters(),
    )
    assert law.coefficient(1e-3) == pytest.approx(0.6 - 0.005 * np.log(1e3), rel=1e-12)
    assert law.replace(length=2e-5).state_evolution == "slip"

    def rock(law):
        contact = ss.Contact(tangential="x1", normal_force=1e6, friction=law, slider_speed=1e-3)
        return lambda stiffness: ss.Scene([1.0], [[stiffness]], contacts=[contact])

    for one in (law, own):
        # The stiffness of Rice and Ruina, which is the same under both laws.
        (point,) = ss.critical_points(rock(one), {"stiffness": (4e8, 6e8)})
        assert point.value == pytest.approx(500005000.0, rel=1e-12)
    runs = []
    for one in (law, own):
        scene = rock(one)(5.2e8)
        start = ss.steady_sliding(scene).perturbed(velocity={"x1": 2e-4})
        runs.append(ss.simulate(scene, 2e-3, start).state(2e-3))
    for name in ("position", "velocity", "internal"):
        assert getattr(runs[0], name) == pytest.approx(getattr(runs[1], name), rel=1e-9)


def test_a_run_under_the_slip_law_ends_where_slip_turns():
    law = ss.friction.RateState(0.5, 0.05, 0.06, 0.02, 0.1, state_evolution="slip")
    contact = ss.Contact(tangential="x1", normal_force=5.0, friction=law, slider_speed=0.2)
    scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": -1.0})
    with pytest.raises(ss.RunError, match=r"contact 0 at t = 0\.1.*: its law has no finite value") as error:
        ss.simulate(scene, 5.0, start)
    run = error.value.partial
    assert 0.1 < run.duration < 1.0
    # ln |s| has no series about the end.
    assert abs(run.state(run.duration).velocity[0] - 0.2) < 1e-6


def test_a_slip_that_creeps_below_the_rounding_of_its_slider_ends_the_run_at_once():
    """At rest under ``mu / a = 40`` slip goes on with about ``speed e^-40``, 1e-19 m/s beside 0.2 m/s."""
    law = ss.friction.RateState(1.2, 0.03, 0.05, 0.02, 0.1)
    contact = ss.Contact(tangential="x1", normal_force=5.0, friction=law, slider_speed=0.2)
    scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": -1.0})
    with pytest.raises(ss.RunError, match="slip speeds that are lost in the rounding of the motion") as error:
        ss.simulate(scene, 5.0, start)
    run = error.value.partial
    assert abs(run.state(run.duration).velocity[0] - 0.2) < 1e-14
    assert run.counters["panels"] < 500


def test_a_state_evolution_has_a_name():
    with pytest.raises(ss.InputError, match="friction: state_evolution: expected 'aging' or 'slip', got"):
        ss.friction.RateState(0.5, 0.05, 0.06, 0.02, 0.1, state_evolution="both")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"impact_friction": True}, "contact 0: .* impact_friction"),
        ({"mass": [[1.0, 0.2], [0.2, 0.7]]}, "contact 0: .* where mass couples contacts; lump"),
    ],
)
def test_what_is_not_computed_is_refused(changes, said):
    with pytest.raises(ss.InputError, match=said):
        pressed(DAHL).replace(**changes)


@pytest.mark.parametrize(
    ("internal", "said"),
    [
        ([0.0, 1.0], r"internal: expected one finite number per contact \(1\)"),
        ({1: 0.0}, "internal: expected indices of contacts below 1, got 1"),
        ({"belt": 0.0}, "internal: expected indices of contacts below 1, got 'belt'"),
    ],
)
def test_states_belong_to_contacts(internal, said):
    with pytest.raises(ss.InputError, match=said):
        ss.State([0.0, 0.0], [0.0, 0.0], "+", internal=internal)


def test_an_open_contact_has_no_state():
    with pytest.raises(ss.InputError, match="internal: contact 0: must be 0 where a contact is open or has"):
        ss.simulate(pressed(DAHL), 1.0, ss.State([0.0, 1.0], [0.0, 0.0], "d", ["x", "y"], internal=[1e-3]))


@pytest.mark.parametrize(
    ("spring", "remote"),
    [(1e3, False), (1e4, False), (ss.spring.Hertz(9e3), False), (None, True)],
)
def test_bristles_count_by_the_load_that_presses_them(spring, remote):
    """The norm weighs deflections by a normal force: that on the body of a node, or a load elsewhere."""
    stiffness = [[90.0, 10.0, 0.0], [10.0, 200.0, -150.0], [0.0, -150.0, 200.0]]
    scenes = [
        ss.Scene(
            mass=[1.0, 1.0, 1.0],
            stiffness=stiffness,
            damping=ss.Rayleigh(mass=0.1, stiffness=1e-3),
            force=[0.0, 0.0, -5.0] if far else [0.0, -5.0, 0.0],
            dofs=["x", "y", "far"],
            contacts=[
                ss.Contact(
                    tangential="x",
                    normal="y",
                    friction=ss.friction.Dahl(0.8, 1300.0),
                    slider_speed=0.1,
                    normal_stiffness=one,
                )
            ],
        )
        for one, far in ((spring, remote), (None, False))
    ]
    runs = [
        ss.simulate(scene, 3.0, ss.steady_sliding(scene).perturbed(velocity={"x": -0.5})) for scene in scenes
    ]
    assert runs[0].counters["panels"] < 2 * runs[1].counters["panels"]
