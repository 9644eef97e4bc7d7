"""Contacts with a state: other people's numbers, closed forms, and another integrator."""

import numpy as np
import pytest
from scipy.optimize import brentq

import stickslip as ss
from nightly import nightly
from state_scenes import StateEquations, followed, state_scene

#: LuGre's usual numbers, Canudas de Wit and others (1995), Table I.
CANONICAL = ss.friction.LuGre(
    static=1.5, kinetic=1.0, speed=1e-3, stiffness=1e5, damping=np.sqrt(1e5), viscous=0.4
)


def dragged(law=CANONICAL, speed=0.1, **changes):
    """Return a mass whose spring is pulled at a speed, in the frame of the pulled end."""
    contact = ss.Contact(tangential="x1", normal_force=1.0, friction=law, slider_speed=-speed)
    return ss.Scene([1.0], [[2.0]], contacts=[contact], **changes)


@pytest.fixture(scope="module")
def canonical():
    return ss.simulate(dragged(), 36.0, ss.State([0.0], [-0.1], "-"))


def test_the_canonical_set_turns_when_others_say(canonical):
    times = [10.2660909412841, 10.2764203978014, 10.2926632434272, 10.3009597155445, 16.6288107623498]
    assert canonical.events.time[:5] == pytest.approx(times, abs=1e-12)
    assert set(canonical.events.kind) == {"velocity"}
    assert "".join(canonical.events.combination[:4]) == "+-+-"
    places = canonical.event_states()[0][:4, 0] + 0.1 * canonical.events.time[:4]
    known = [0.63628438968428, 0.636282539413642, 0.636283162607228, 0.636283130162437]
    assert places == pytest.approx(known, abs=2e-13)
    deflection = canonical.state(canonical.events.time[0]).internal
    assert deflection == pytest.approx([1.06108504680792e-05], rel=1e-12)
    fastest = canonical.sample(np.linspace(8.66597, 8.66598, 11)).velocity.to_numpy().max() + 0.1
    assert fastest == pytest.approx(0.369815998, abs=1e-9)


def test_the_canonical_set_comes_to_its_cycle(canonical):
    cycle = canonical.limit_cycle()
    assert cycle.period == pytest.approx(6.362719821066, abs=1e-12)
    assert cycle.stable
    # Superstable: the bristles forget everything while the mass sticks.
    assert np.abs(cycle.transverse_multipliers).max() < 1e-8
    assert abs(cycle.balance().residual) < 1e-12


def test_the_work_of_the_canonical_set_is_counted(canonical):
    """In slip the deflection follows from its balance: a panel lasts for thousands of its relaxations."""
    assert canonical.counters["phases"] == 21
    assert canonical.counters["panels"] == pytest.approx(1_190, rel=0.1)


@pytest.mark.parametrize("stiffness", [1e7, pytest.param(1e9, marks=pytest.mark.nightly)])
def test_stiff_bristles_need_no_panel_for_each_of_their_relaxations(stiffness):
    """They turn before friction without a state stops the mass, by a time over the root of the stiffness."""
    numbers = {"static": 1.5, "kinetic": 1.0, "speed": 1e-3, "viscous": 0.4}

    def levels(s, static=1.5, kinetic=1.0, speed=1e-3, viscous=0.4):
        return kinetic + (static - kinetic) * np.exp(-((s / speed) ** 2)) + viscous * s

    law = ss.friction.LuGre(stiffness=stiffness, damping=np.sqrt(stiffness), **numbers)
    run = ss.simulate(dragged(law), 12.0, ss.State([0.0], [-0.1], "-"))
    # In a slip of three seconds they relax up to 0.3 stiffness times a second.
    assert run.counters["panels"] < 1e-3 * stiffness
    assert abs(run.balance().residual) < 1e-12
    rigid = ss.simulate(dragged(ss.friction.Law(levels)), 12.0, ss.State([0.0], [-0.1], "s"))
    sooner = rigid.events.time[-1] - run.events.time[0]
    assert sooner * np.sqrt(stiffness) == pytest.approx(8.5, rel=0.02)


def test_bristles_of_unlike_stiffness_move_together_as_each_alone():
    """Panels on which one deflection follows and another relaxes too often for a series are passed over."""
    stiffness = [3e4, 1e5, 2e5, 9e5]

    def contact(k):
        law = ss.friction.LuGre(1.5, 1.0, 1e-2, stiffness[k], np.sqrt(stiffness[k]), 0.4)
        return ss.Contact(tangential=np.eye(4)[k], normal_force=1.0, friction=law, slider_speed=0.1)

    springs, start = np.array([2.0, 3.0, 5.0, 7.0]), np.array([0.02, -0.05, 0.03, 0.04])
    together = ss.Scene(np.ones(4), np.diag(springs), contacts=[contact(k) for k in range(4)])
    run = ss.simulate(together, 4.0, ss.steady_sliding(together).perturbed(velocity=start))
    assert run.counters["panels"] < 300
    assert abs(run.balance().residual) < 1e-13
    for k in range(4):
        law = contact(k).friction
        single = ss.Contact(tangential="x1", normal_force=1.0, friction=law, slider_speed=0.1)
        scene = ss.Scene([1.0], [[springs[k]]], contacts=[single])
        alone = ss.simulate(scene, 4.0, ss.steady_sliding(scene).perturbed(velocity=start[k : k + 1]))
        times = np.linspace(0.0, 4.0, 41)
        own, other = alone.sample(times), run.sample(times)
        for name in ("position", "velocity"):
            difference = other[name].to_numpy()[:, k] - own[name].to_numpy()[:, 0]
            assert np.abs(difference).max() < 1e-13


def test_friction_of_dahl_is_a_function_of_the_place():
    """Between turns ``T - T_end`` falls by ``exp(-stiffness |dx| / kinetic)``."""
    kinetic, stiffness, pressed = 0.4, 300.0, 5.0
    law = ss.friction.Dahl(kinetic, stiffness)
    contact = ss.Contact(tangential="x1", normal_force=pressed, friction=law)
    scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
    run = ss.simulate(scene, 6.0, ss.State([0.1], [0.0], "+", internal=[0.0]))
    assert len(run.events) > 10
    places, friction, sign = 0.1, 0.0, 1.0
    for k, time in enumerate(run.events.time):
        place = float(run.event_states()[0][k, 0])
        end = sign * kinetic * pressed
        friction = end + (friction - end) * np.exp(-stiffness * abs(place - places) / kinetic)
        found = float(run.sample([time]).friction_force.item())
        assert found == pytest.approx(friction, abs=1e-12)
        assert -pressed * stiffness * run.state(float(time)).internal == pytest.approx([friction], abs=1e-12)
        places, sign = place, -sign


@pytest.mark.parametrize("exponent", [1, 2, 3])
def test_bristles_of_bouc_and_wen_follow_the_place(exponent):
    """Loaded from rest ``dz = dx (1 - (z / Z)^n)``; with equal shares it unloads along a straight line."""
    kinetic, stiffness, pressed = 0.4, 300.0, 5.0
    law = ss.friction.BoucWen(kinetic, stiffness, exponent)
    contact = ss.Contact(tangential="x1", normal_force=pressed, friction=law)
    scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
    run = ss.simulate(scene, 1.0, ss.State([0.0], [0.3], "-", internal=[0.0]))
    turn = float(run.events.time[0])
    sample = run.sample(np.append(np.linspace(0.0, turn, 20), turn + 1e-4))
    place, friction = sample.position.to_numpy()[:, 0], sample.friction_force.to_numpy()[:, 0]
    extent = kinetic / stiffness
    z = -friction / (pressed * stiffness) / extent
    way = {
        1: lambda z: -np.log1p(-z),
        2: np.arctanh,
        # The integral of 1 / (1 - z^3).
        3: lambda z: (
            np.log(1.0 + z + z**2) / 6.0
            - np.log(1.0 - z) / 3.0
            + (np.arctan((2.0 * z + 1.0) / np.sqrt(3.0)) - np.pi / 6.0) / np.sqrt(3.0)
        ),
    }[exponent]
    loaded = place[:-1] < 3.0 * extent
    assert np.count_nonzero(loaded) > 1
    assert way(z[:-1][loaded]) == pytest.approx(place[:-1][loaded] / extent, abs=1e-10)
    back = -pressed * stiffness * (place[-1] - place[-2])
    assert friction[-1] - friction[-2] == pytest.approx(back, rel=1e-6)


def test_bouc_and_wen_with_one_share_is_dahl():
    def turns(law):
        contact = ss.Contact(tangential="x1", normal_force=5.0, friction=law, slider_speed=0.05)
        scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
        return ss.simulate(scene, 3.0, ss.State([0.1], [0.0], "+")).events.time

    assert turns(ss.friction.BoucWen(0.4, 300.0, 1, 1.0)) == pytest.approx(
        turns(ss.friction.Dahl(0.4, 300.0)), abs=1e-13
    )


def test_the_loop_of_dahl():
    """A loop of amplitude X turns at ``kinetic tanh(stiffness X / kinetic)`` and loses the area in it."""
    law = ss.friction.Dahl(1.0, 1e5)

    def swung(force):
        contact = ss.Contact(tangential="x1", normal_force=1.0, friction=law)
        scene = ss.Scene(
            [1.0],
            [[1e3]],
            contacts=[contact],
            damping=[[2.0]],
            loads=[ss.Harmonic({"x1": force}, frequency=20.0)],
        )
        return ss.simulate(scene, 1.0, ss.State([0.0], [0.0], "-")).limit_cycle(further=10.0)

    def amplitude(force):
        cycle = swung(force)
        return 0.5 * float(cycle.maximum[0] - cycle.minimum[0])

    force = brentq(lambda force: amplitude(force) - 1e-5, 0.5, 1.5, xtol=1e-13)
    cycle = swung(force)
    turns = cycle.run.sample(cycle.run.events.time)
    assert np.abs(turns.friction_force.to_numpy()).max() == pytest.approx(0.761594155955765, rel=1e-9)
    # The slider is at rest: what the contact takes is heat.
    assert -cycle.balance().contact == pytest.approx(9.5362337617694e-6, rel=1e-8)


@pytest.mark.parametrize("index", nightly(range(7), lambda index: index not in (0, 1, 6)))
def test_random_scenes_by_another_integrator(index):
    found = followed(*state_scene(1, index))
    assert found.missed == 0
    assert found.state < 1e-9
    assert found.time < 1e-11
    assert found.energy < 1e-12


@pytest.mark.parametrize("normal", [{"normal_force": 45.0}, {"normal": "z"}], ids=["given", "contact"])
@pytest.mark.parametrize(
    "element",
    [
        ss.Spring({"x": 1.0}, ss.spring.Polynomial(0.0, 0.0, 1e9)),
        ss.Spring({"x": 1.0}, ss.spring.Law("k * u / (1 + u * u)", k=10.0)),
        ss.Spring({"x": 1.0}, ss.spring.Gap(1e4, 1e-3)),
        ss.Damper({"x": 1.0}, ss.spring.Polynomial(0.0, 0.0, 20.0)),
        ss.Spring({"z": 1.0}, ss.spring.Polynomial(0.0, 0.0, 1e6)),
    ],
    ids=["hard", "own", "gap", "drag", "normal"],
)
def test_bristles_relax_beside_a_spring_as_without_it(element, normal):
    """The start slips at speed zero, where a first panel of the usual width has no bound."""
    law = ss.friction.LuGre(static=0.8, kinetic=0.4, speed=0.1, stiffness=4e4, damping=2.0, viscous=0.1)
    scene = ss.Scene(
        [1.0, 0.5],
        [[2e4, -3e3], [-3e3, 3e4]],
        damping=ss.Rayleigh(1.0, 1e-5),
        force=[0.0, -50.0],
        dofs=["x", "z"],
        contacts=[ss.Contact(tangential="x", slider_speed=0.05, friction=law, **normal)],
    )
    panels = []
    for elements in ([], [element]):
        one = scene.replace(elements=elements)
        run = ss.simulate(one, 0.3, ss.steady_sliding(one).perturbed(velocity={"x": 0.05}))
        assert run.stop_reason == "duration"
        assert len(run.events) > 30
        balance = run.balance()
        assert abs(balance.residual) < 1e-13 * balance.turnover
        panels.append(run.counters["panels"] / len(run.events))
    assert panels[1] < 1.2 * panels[0]


def test_bristles_of_two_kinds_on_one_body_count_each_by_its_own_norm():
    """The loss of Bouc and Wen's has the slip speed as a factor, that of Dahl's a deflection, far smaller."""
    scene = ss.Scene(
        mass=[1.5, 1.0],
        stiffness=[[300.0, -100.0], [-100.0, 250.0]],
        dofs=["x", "y"],
        contacts=[
            ss.Contact(
                tangential={"x": 0.5, "y": 1.0},
                normal_force=10.0,
                friction=ss.friction.Dahl(0.3, 7000.0),
                slider_speed=-0.2,
            ),
            ss.Contact(
                tangential="x", normal_force=7.0, friction=ss.friction.BoucWen(0.6, 160.0), slider_speed=-0.1
            ),
        ],
    )
    run = ss.simulate(scene, 1.0, ss.steady_sliding(scene).perturbed(velocity={"y": 0.3}))
    # Dahl's relaxes up to 7000 times; a panel lasts for about six of these.
    assert len(run.events) == 8
    assert run.counters["panels"] < 1200


def test_bristles_do_not_shorten_panels_of_contacts_that_springs_press():
    """The spring changes one normal force; bristles that relax at 1600 1/s are under another one."""
    contacts = [
        ss.Contact(
            tangential="x", normal="z", slider_speed=0.1, friction=ss.friction.Stribeck(0.5, 0.3, 0.1)
        ),
        ss.Contact(
            tangential="y",
            normal_force=10.0,
            slider_speed=0.05,
            friction=ss.friction.LuGre(static=0.5, kinetic=0.3, speed=0.1, stiffness=1e4),
        ),
    ]
    free = ss.Scene(
        [1.0, 1.2, 0.8],
        [[2e4, -3e3, 1e3], [-3e3, 3e4, 2e3], [1e3, 2e3, 5e4]],
        damping=ss.Rayleigh(1.0, 1e-5),
        force=[0.0, 0.0, -50.0],
        dofs=["x", "y", "z"],
        contacts=contacts,
    )
    # Too soft to matter, on a dof that the contact holds.
    pressed = free.replace(elements=[ss.Spring({"z": 1.0}, ss.spring.Polynomial(0.0, 0.0, 1e3))])
    runs = []
    for scene in (free, pressed):
        start = ss.steady_sliding(scene).perturbed(velocity={"x": 0.09})
        runs.append(ss.simulate(scene, 0.2, start))
    assert np.abs(runs[1].events.time - runs[0].events.time).max() < 1e-13
    assert runs[1].counters["panels"] < 2 * runs[0].counters["panels"]


def eigenvalues(scene):
    """Return those of steady sliding, from the equations in x, x' and z."""
    equations = StateEquations(scene)
    rest = equations.state(started(scene))
    size, step = rest.size, np.cbrt(np.finfo(float).eps)
    columns = [
        (equations.rate(0.0, rest + h * unit) - equations.rate(0.0, rest - h * unit)) / (2.0 * h)
        for unit, h in zip(np.eye(size), step * np.maximum(np.abs(rest), 1e-4), strict=True)
    ]
    return np.linalg.eigvals(np.array(columns).T)


def started(scene):
    """Return steady sliding with its deflections."""
    return ss.simulate(scene, 1e-9, ss.steady_sliding(scene)).state(0.0)


def two_masses(slider_speed=0.05, kinetic=0.3, **numbers):
    given = {"static": 0.6, "speed": 0.1, "stiffness": 1e4, "damping": 1.0, "viscous": 0.05}
    law = ss.friction.LuGre(kinetic=kinetic, **{**given, **numbers})
    contact = ss.Contact(tangential=[1.0, 0.0], normal_force=10.0, friction=law, slider_speed=slider_speed)
    return ss.Scene(
        [1.0, 2.0],
        [[2000.0, -1000.0], [-1000.0, 3000.0]],
        damping=ss.Rayleigh(mass=0.5, stiffness=0.0),
        contacts=[contact],
    )


OTHERS = {
    "LuGre": None,
    "Dahl": ss.friction.Dahl(0.3, 1e3),
    "BoucWen": ss.friction.BoucWen(0.3, 1e3, 2, 0.7),
}


@pytest.mark.parametrize("slider_speed", [0.05, -0.3, 1e-3])
@pytest.mark.parametrize("law", OTHERS.values(), ids=OTHERS)
def test_modes_are_those_of_the_equations_in_deflections(slider_speed, law):
    scene = two_masses(slider_speed)
    if law is not None:
        scene = scene.replace(friction=law)
    modes = ss.complex_modes(scene)
    expected = eigenvalues(scene)
    expected = expected[expected.imag >= 0.0]
    found = modes.eigenvalues[np.argsort(modes.eigenvalues.imag)]
    # The expected ones are by differences.
    assert found == pytest.approx(expected[np.argsort(expected.imag)], rel=1e-6)
    assert np.count_nonzero(found.imag == 0.0) == 1


def test_the_equations_of_small_motions_have_a_deflection():
    scene = two_masses(0.05)
    reduced = ss.equations_of(scene, "+")
    assert repr(reduced) == "Reduced('+', 2 of 2 coordinates free, 1 deflections of bristles)"
    rate = complex(ss.complex_modes(scene).eigenvalues[0])
    pencil = reduced.stiffness + rate * reduced.damping + rate**2 * reduced.mass
    sizes = np.linalg.svd(pencil / np.abs(pencil).max(axis=1, keepdims=True), compute_uv=False)
    assert sizes[-1] < 1e-13 * sizes[0]


def test_a_load_is_answered_as_by_the_linear_equations():
    scene = two_masses(0.5).replace(loads=[ss.Harmonic({"x1": 1e-3}, frequency=3.0, name="shaker")])
    answer = ss.frequency_response(scene, {"shaker_frequency": [3.0, 6.0]}).to_dataset()
    # As small as this it is linear.
    linear = answer.linear.sel(linear_frequency=[3.0, 6.0])
    assert answer.response.to_numpy() == pytest.approx(linear.to_numpy(), rel=1e-6)


def test_steady_sliding_stays():
    scene = two_masses(0.3)
    rest = ss.steady_sliding(scene)
    run = ss.simulate(scene, 3.0, rest)
    assert len(run.events) == 0
    places = run.sample(np.linspace(0.0, 3.0, 50)).position.to_numpy()
    assert np.ptp(places, axis=0) == pytest.approx([0.0, 0.0], abs=1e-14)
    assert rest.friction_forces == pytest.approx([10.0 * scene.contacts[0].coefficient()], rel=1e-12)


def test_sliding_that_stays_is_an_equilibrium():
    scene = two_masses(0.5)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})
    with pytest.raises(ss.NotPeriodicError, match="settles to an equilibrium: every mode decays"):
        ss.simulate(scene, 2.0, start).limit_cycle()


def test_small_motions_grow_as_the_modes_say():
    scene = two_masses(0.05)
    modes = ss.complex_modes(scene)
    rest = started(scene)
    shape = modes.shapes[:, 0] if modes.shapes.shape[0] == 2 else modes.shapes[0]
    rate = complex(modes.eigenvalues[0])
    size = 1e-8
    start = ss.State(
        rest.position + size * shape.real,
        rest.velocity + size * (rate * shape).real,
        "+",
    )
    run = ss.simulate(scene, 0.5, start)
    times = np.array([0.1, 0.3, 0.5])
    # The bristles follow within a thousandth of a second.
    expected = size * (shape[None] * np.exp(rate * times)[:, None]).real
    moved = run.sample(times).position.to_numpy() - rest.position
    assert moved == pytest.approx(expected, abs=2e-2 * size * np.exp(rate.real * 0.5))


def test_a_hopf_point_is_where_the_equations_have_one():
    found = ss.critical_points(two_masses(), {"slider_speed": (0.1, 1.0)})
    hopf = [point for point in found if point.kind == "hopf"]
    assert len(hopf) == 2
    for point in hopf:
        values = eigenvalues(two_masses(point.value))
        assert np.abs(values.real).min() < 1e-5
        assert point.criticality in ("subcritical", "supercritical")


def test_stiff_bristles_come_to_friction_without_a_state():
    """The time at which a slip ends differs from that under ``mu(|s|)`` by a number over the stiffness."""
    static, kinetic, speed = 0.6, 0.3, 0.2

    def levels(s, kinetic=kinetic, more=static - kinetic, speed=speed):
        return kinetic + more * np.exp(-((s / speed) ** 2))

    def stop(law):
        contact = ss.Contact(tangential="x1", normal_force=5.0, friction=law, slider_speed=0.05)
        scene = ss.Scene([1.0], [[100.0]], contacts=[contact], damping=[[0.2]])
        return ss.simulate(scene, 0.12, ss.State([0.0], [0.5], "-")).events.time[0]

    rigid = stop(ss.friction.Law(levels))
    later = [
        (stop(ss.friction.LuGre(static, kinetic, speed, stiffness)) - rigid) * stiffness
        for stiffness in (1e4, 1e5, 1e6)
    ]
    assert later == pytest.approx([1.0875] * 3, rel=0.03)
    assert later[1:] == pytest.approx([1.0875] * 2, rel=0.003)


def test_a_scene_goes_through_a_file(tmp_path):
    scene = two_masses()
    ss.save(scene, tmp_path / "scene.toml")
    assert ss.load(tmp_path / "scene.toml").scene.contacts[0].friction == scene.contacts[0].friction
    assert scene.contacts[0].friction.replace(kinetic=0.2).kinetic == 0.2


def test_deflections_go_on_with_a_state(canonical):
    middle = canonical.state(10.27)
    again = ss.simulate(dragged(), 0.05, middle)
    assert again.events.time[0] == pytest.approx(canonical.events.time[1] - 10.27, abs=1e-12)
    assert again.sample([0.0]).friction_force.item() == pytest.approx(
        canonical.sample([10.27]).friction_force.item(), abs=1e-12
    )


REFUSED = [
    (
        {"tangential_stiffness": 1e3},
        "friction with a state is not computed beside a slip without mass; give the dof mass, or leave",
    ),
    (
        {"slider_vibration": ss.Harmonic(0.1, frequency=1.0)},
        "friction with a state is not computed beside sliders that",
    ),
    ({"static_friction": 0.5}, "contact 0: friction: must be 0 beside a state of the contact, got 0.5"),
    ({"friction": ss.friction.Dahl(-1.0, 1e3)}, "contact 0: friction: kinetic: must be > 0, got -1"),
    (
        {"friction": ss.friction.BoucWen(1.0, 1e3, 2, 1.5)},
        r"contact 0: friction: share: must be in \[0, 1\], got",
    ),
    ({"friction": ss.friction.Dahl(1.0, 0.0)}, "contact 0: friction: stiffness: must be > 0, got 0"),
]


@pytest.mark.parametrize(("changes", "said"), REFUSED)
def test_what_bristles_are_not_computed_for_is_refused(changes, said):
    given = {"tangential": "x1", "normal_force": 1.0, "friction": CANONICAL, "slider_speed": 0.1}
    with pytest.raises(ss.InputError, match=said):
        ss.Scene([1.0, 1.0], np.eye(2), contacts=[ss.Contact(**{**given, **changes})])


def test_an_exponent_is_a_small_whole_number():
    with pytest.raises(ss.InputError, match=r"friction: exponent: must be 1, 2 or 3, got 1\.5"):
        ss.friction.BoucWen(0.4, 300.0, 1.5)


def test_a_contact_with_bristles_does_not_stick():
    with pytest.raises(ss.InputError, match="friction"):
        ss.simulate(dragged(), 1.0, ss.State([0.0], [-0.1], "s"))
