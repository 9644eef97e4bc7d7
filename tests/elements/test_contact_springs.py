"""Contact stiffnesses by a law: by DOP853, by closed forms, and beside the same spring on a massive layer."""

import dataclasses

import numpy as np
import pytest
from tests.support.contact_spring_peer import ContactSpringPeer
from tests.support.small_motions import check_small_motions

import stickslip as ss

LAWS = [
    ss.spring.Polynomial(40.0, 0.0, 4e3),
    ss.spring.Law(lambda u, soft=30.0, scale=0.2: soft * u * (1.0 + np.tanh(u / scale) ** 2)),
    # Softer where it is pressed more, and positive everywhere.
    ss.spring.Polynomial(60.0, -80.0, 60.0),
    # Its slope at zero is 0, as monotone cubics through convex values have it.
    ss.spring.Tabulated([0.0, 0.05, 0.1, 0.3], [0.0, 2.0, 8.0, 60.0]),
]


def random_scene(seed, law=None):
    """Return a scene of three masses on one contact, a start, and the same for DOP853."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    given = {
        "mass": rng.uniform(0.5, 2.0, 3),
        "stiffness": 8.0 * root @ root.T + 10.0 * np.eye(3),
        "damping": np.diag(rng.uniform(0.0, 0.3, 3)),
        "force": np.array([2.0 * rng.normal(), -rng.uniform(0.5, 6.0), 2.0 * rng.normal()]),
    }
    normal = np.array([0.0, 1.0, rng.choice([0.0, 0.3])])
    gap, friction, speed = rng.uniform(-0.1, 0.05), rng.uniform(0.1, 0.9), rng.uniform(-0.6, 0.6)
    static, law = friction * rng.choice([1.0, 1.3]), law or LAWS[seed % len(LAWS)]
    contact = ss.Contact(
        tangential=0,
        normal=normal,
        friction=friction,
        static_friction=static,
        slider_speed=speed,
        gap=gap,
        normal_stiffness=law,
    )
    x, u = 0.3 * rng.normal(size=3), rng.normal(size=3)
    status = "d" if normal @ x + gap > 0.0 else "+" if u[0] < speed else "-"
    peer = ContactSpringPeer(*given.values(), normal, gap, law.force, friction, static, speed)
    return ss.Scene(**given, contacts=[contact]), ss.State(x, u, status), peer


def hertz(seed):
    """Return a law of Hertz, of another exponent in every third scene."""
    return ss.spring.Hertz(60.0 * 1.5 ** (seed % 7), 1.5 if seed % 3 else 1.2 + 0.1 * seed)


@pytest.mark.parametrize(
    ("seed", "law"),
    [*((seed, None) for seed in range(8)), *((seed, hertz(seed)) for seed in range(20, 32))],
)
def test_motions_are_those_of_dop853(seed, law):
    """Slip, stick, lift-off and closing: every event by kind and time, and the state at the end."""
    scene, start, peer = random_scene(seed, law)
    run = ss.simulate(scene, 8.0, start)
    events, end = peer.run([*start.position, *start.velocity], start.combination, 8.0)
    assert list(run.events.kind) == [kind for _, kind in events]
    assert {"release", "closing"} <= set(run.events.kind)
    # DOP853 with 1e-13 loses up to 1e-8 after twenty events and knots of a table.
    np.testing.assert_allclose(run.events.time, [time for time, _ in events], atol=1e-8)
    found = run.state(8.0)
    np.testing.assert_allclose([*found.position, *found.velocity], end, atol=1e-7)
    assert abs(run.balance().residual) < 1e-12


def test_the_scenes_together_have_every_kind_of_event():
    given = [random_scene(seed)[:2] for seed in range(8)]
    kinds = {kind for scene, start in given for kind in ss.simulate(scene, 8.0, start).events.kind}
    assert kinds == {"velocity", "slip+", "slip-", "release", "closing"}


def test_a_bounce_on_a_cubic_spring_lasts_as_long_as_its_integral():
    """m x'' = -k x - k3 x^3 for x > 0: by energy the time of contact is an integral over penetration."""
    import mpmath

    mass, soft, hard, speed = 2.0, 50.0, 3e4, 1.5
    stop = ss.Contact(normal=[-1.0], normal_stiffness=ss.spring.Polynomial(soft, 0.0, hard))
    scene = ss.Scene([mass], [[0.0]], contacts=[stop])
    run = ss.simulate(scene, 2.0, ss.State([0.0], [speed], "+"))
    assert list(run.events.kind) == ["release"]
    energy = mass * speed**2
    # 2 k3 u^4 / 4 + k u^2 = m v^2
    deepest = mpmath.sqrt((-soft + mpmath.sqrt(soft**2 + 2.0 * hard * energy)) / hard)

    def slowness(angle):
        # u = deepest sin(angle) takes away the root at the end: (a^2 - u^2)(k + k3 (a^2 + u^2) / 2).
        square = (deepest * mpmath.sin(angle)) ** 2
        return 1 / mpmath.sqrt((soft + hard * (deepest**2 + square) / 2) / mass)

    lasts = 2 * mpmath.quad(slowness, [0, mpmath.pi / 2])
    assert run.events.time[0] == pytest.approx(float(lasts), rel=1e-14)
    half = run.sample([0.5 * float(lasts)])
    assert half.normal_force.item() == pytest.approx(float(soft * deepest + hard * deepest**3), rel=1e-13)
    # The law has no mass: it gives all energy back.
    assert run.state(2.0).velocity[0] == pytest.approx(-speed, rel=1e-14)


@pytest.mark.parametrize("exponent", [1.1, 1.5, 2.0, 2.7])
@pytest.mark.parametrize(
    ("stiffness", "mass", "speed"), [(1e9, 1.0, 1.0), (1.0, 2.0, 0.3), (1e6, 1e-3, 20.0)]
)
def test_an_impact_on_a_round_body_lasts_as_long_as_hertz_has_it(exponent, stiffness, mass, speed):
    """m x'' = -K x^p: d^(p+1) = (p+1) m v^2 / (2 K), and with u = d s, T = 2 d/v int ds / sqrt(1 - s^(p+1)).

    The integral is B(1/(p+1), 1/2) / (p+1).
    """
    import mpmath

    p = mpmath.mpf(exponent)
    deepest = ((p + 1) * mass * mpmath.mpf(speed) ** 2 / (2 * stiffness)) ** (1 / (p + 1))
    lasts = 2 * deepest / speed * mpmath.beta(1 / (p + 1), mpmath.mpf(1) / 2) / (p + 1)
    stop = ss.Contact(normal=[-1.0], normal_stiffness=ss.spring.Hertz(stiffness, exponent))
    scene = ss.Scene([mass], [[0.0]], contacts=[stop])
    run = ss.simulate(scene, 3.0 * float(lasts), ss.State([0.0], [speed], "+"))
    assert list(run.events.kind) == ["release"]
    # Rounding, and what the line below 1e-9 N makes of the energy.
    line = (1e-9 / stiffness) ** (1.0 / exponent)
    near = 1e-13 + 0.5 * (exponent - 1.0) * (line / float(deepest)) ** (exponent + 1.0)
    assert run.events.time[0] == pytest.approx(float(lasts), rel=near)
    half = run.sample([0.5 * float(lasts)])
    assert half.position.item() == pytest.approx(float(deepest), rel=near)
    assert half.normal_force.item() == pytest.approx(float(stiffness * deepest**p), rel=near)
    assert run.state(run.duration).velocity[0] == pytest.approx(-speed, rel=1e-13)
    assert abs(run.balance().residual) < 1e-13 * 0.5 * mass * speed**2


def test_the_line_below_a_small_force_changes_an_impact_as_stated():
    """The energy of the largest penetration d is off by its part (p - 1)/2 (delta/d)^(p + 1)."""
    stiffness, force = 1e9, 100.0
    delta = (force / stiffness) ** (2.0 / 3.0)
    stop = ss.Contact(normal=[-1.0], normal_stiffness=ss.spring.Hertz(stiffness, straight_below=force))
    run = ss.simulate(ss.Scene([1.0], [[0.0]], contacts=[stop]), 1e-3, ss.State([0.0], [1.0], "+"))
    deepest = run.sample([0.5 * run.events.time[0]]).position.item()
    exact = (5.0 / (4.0 * stiffness)) ** 0.4
    part = 1.0 - 0.25 * (delta / exact) ** 2.5
    assert (deepest / exact) ** 2.5 == pytest.approx(part, rel=1e-9)
    assert 1e-4 < 1.0 - part < 1e-3


@pytest.mark.parametrize("far", [0.01, 1.0, 10.0])
@pytest.mark.parametrize("stiffness", [1e6, 1e9, 1e12])
def test_an_impact_after_a_flight_lasts_as_long_up_to_the_rounding_of_the_places(far, stiffness):
    """Places are rounded by 1e-16 of the flight; a release is as sure as some thousand of these."""
    lasts = 2.9432751843247046574 * (5.0 / (4.0 * stiffness)) ** 0.4
    stop = ss.Contact(normal=[-1.0], gap=far, normal_stiffness=ss.spring.Hertz(stiffness))
    run = ss.simulate(ss.Scene([1.0], [[0.0]], contacts=[stop]), far + 0.1, ss.State([0.0], [1.0], "d"))
    assert list(run.events.kind) == ["closing", "release"]
    closing, release = run.events.time
    assert release - closing == pytest.approx(lasts, rel=1e-13, abs=1e-12 * far)
    assert run.state(run.duration).velocity[0] == pytest.approx(-1.0, rel=1e-14)


def pressed(law, **changes):
    """Return a block on a belt, pressed on by 20 N."""
    given = {"tangential": "x", "normal": "y", "friction": 0.4, "slider_speed": 0.2, "normal_stiffness": law}
    contact = ss.Contact(**{**given, **changes})
    stiffness, force = [[300.0, 50.0], [50.0, 400.0]], [0.0, -20.0]
    return ss.Scene([1.0, 1.0], stiffness, ss.Rayleigh(0.2, 1e-3), force, [contact], dofs=["x", "y"])


def test_steady_sliding_and_modes_take_the_slope_where_it_rests():
    law = ss.spring.Polynomial(2e3, 0.0, 1e8)
    state = ss.steady_sliding(pressed(law))
    x, y = state.position
    normal = 2e3 * -y + 1e8 * (-y) ** 3
    assert state.normal_forces == pytest.approx([normal], rel=1e-14)
    assert (300.0 * x + 50.0 * y, 50.0 * x + 400.0 * y) == pytest.approx(
        (0.4 * normal, normal - 20.0), rel=1e-13
    )
    slope = 2e3 + 3e8 * y**2
    found = ss.complex_modes(pressed(law)).eigenvalues
    np.testing.assert_allclose(found, ss.complex_modes(pressed(slope)).eigenvalues, rtol=1e-12)
    power = ss.complex_modes(pressed(law)).power
    with pytest.raises(ss.InputError, match="energies of modes and harmonics need mass on every dof"):
        power()


def test_a_contact_that_would_pull_is_open():
    law = ss.spring.Polynomial(2e3, 0.0, 1e8)
    state = ss.steady_sliding(pressed(law, gap=0.1))
    assert (state.combination, *state.normal_forces) == ("d", 0.0)
    force = np.array([[300.0, 50.0], [50.0, 400.0]]) @ state.position
    np.testing.assert_allclose(force, [0.0, -20.0], atol=1e-14)


def test_a_law_with_one_coefficient_is_a_number():
    law, number = pressed(ss.spring.Polynomial(2e3)), pressed(2e3)
    start = ss.State([0.01, -0.02], [0.0, 0.1], "+")
    runs = [ss.simulate(scene, 2.0, start) for scene in (law, number)]
    np.testing.assert_array_equal(runs[0].events.time, runs[1].events.time)
    assert len(runs[0].events) > 3


@pytest.mark.parametrize("name", ["normal_stiffness_k3", "friction"])
def test_sweeps_and_derivatives_follow_the_rest(name):
    scene = pressed(ss.spring.Polynomial(2e3, 0.0, 1e8))
    values = {"normal_stiffness_k3": [0.0, 3e7, 1e8], "friction": [0.1, 0.4, 0.8]}[name]
    check_small_motions(scene, name, values)


def layered(friction, law, penetration):
    """Return Hoffmann's model by a contact stiffness and by a spring to a massive layer on the belt."""
    normal = law.force(penetration)
    rows = np.array([[2.0, 1.0], [1.0, 2.0 / 3.0]])
    damping, force = 0.1 * np.eye(2), [friction * normal, -normal]
    contact = ss.Contact(tangential="x", normal="y", friction=friction, slider_speed=-100.0, gap=-penetration)
    stiff = ss.Scene(
        [1.0, 1.0],
        rows,
        damping,
        force,
        [dataclasses.replace(contact, normal_stiffness=law)],
        dofs=["x", "y"],
    )
    grown = [np.pad(part, (0, 1)) for part in (rows, damping)]
    layer = ss.Scene(
        [1.0, 1.0, 1.0],
        *grown,
        [*force, 0.0],
        [dataclasses.replace(contact, normal="n", gap=0.0)],
        dofs=["x", "y", "n"],
        elements=[ss.Spring({"n": 1.0, "y": -1.0}, law, -penetration)],
    )
    return stiff, layer


def test_criticality_is_that_of_the_same_spring_on_a_layer():
    law = ss.spring.Law(
        lambda u, k=4.0 / 3.0, bend=-0.3, hard=1.0, p=3.0: (
            k * u + bend * ((u - p) ** 2 - p**2) + hard * ((u - p) ** 3 + p**3)
        )
    )
    points = []
    for k in range(2):

        def model(friction, k=k):
            return layered(friction, law, 3.0)[k]

        points.append(ss.critical_points(model, {"friction": (0.5, 1.0)}, kinds=("hopf",)))
    assert len(points[0]) == 1
    for ours, theirs in zip(*points, strict=True):
        assert ours.value == pytest.approx(theirs.value, rel=1e-12)
        assert ours.criticality == theirs.criticality != "linear until a status changes"
        assert ours.lyapunov == pytest.approx(theirs.lyapunov, rel=1e-9)


def test_numbers_of_the_law_are_parameters_and_files_hold_it(tmp_path):
    scene = pressed({"law": "polynomial", "k1": 2e3, "k3": 1e8})
    other = scene.replace(normal_stiffness_k3=5e7)
    assert other.contacts[0].normal_stiffness == ss.spring.Polynomial(2e3, 0.0, 5e7)
    with pytest.raises(ss.InputError, match="normal_stiffness: a number would replace the law of contact 0"):
        ss.sweep(scene, {"normal_stiffness": [1.0, 2.0]})
    ss.save(scene, tmp_path / "scene.toml")
    again = ss.load(tmp_path / "scene.toml").scene
    assert again.contacts[0].normal_stiffness == scene.contacts[0].normal_stiffness
    assert ss.steady_sliding(again).position.tolist() == ss.steady_sliding(scene).position.tolist()
    for told in (repr(scene), str(scene.summary())):
        assert "Polynomial(2000.0, 0.0, 100000000.0)" in told


@pytest.mark.parametrize(
    ("law", "changes", "said"),
    [
        (
            ss.spring.Polynomial(0.0, 1e5),
            {},
            "slope at zero penetration: must be > 0 and finite; add a linear",
        ),
        (ss.spring.Gap(1e5, -0.1), {}, "normal_stiffness: force at zero penetration: must be 0, got"),
        (ss.spring.Gap(1e5, 0.1), {}, "normal_stiffness: force at a penetration: must be > 0, got 0"),
        (
            ss.spring.Tabulated([0.0, 1.0, 2.0], [0.0, 5.0, -1.0]),
            {},
            "normal_stiffness: force at a penetration: must be > 0, got -1",
        ),
        (
            ss.spring.Polynomial(1e5, 1e5),
            {"tangential_stiffness": 1e3},
            "normal_stiffness: a law is not computed beside a tangential_stiffness",
        ),
    ],
)
def test_what_is_no_contact_stiffness_is_refused(law, changes, said):
    with pytest.raises(ss.InputError, match=said):
        pressed(law, **changes)


def test_a_law_that_would_pull_ends_the_run():
    """u - u^2 has no force at a penetration of 1 m, which the mass reaches with speed left."""
    stop = ss.Contact(normal=[-1.0], normal_stiffness=ss.spring.Polynomial(1.0, -1.0))
    scene = ss.Scene([1.0], [[0.0]], contacts=[stop])
    start = ss.State([0.0], [1.0], "+")
    with pytest.raises(
        ss.RunError, match=r"contact 0 at .* the law of its normal_stiffness comes to force 0"
    ) as told:
        ss.simulate(scene, 5.0, start)
    partial = told.value.partial
    assert partial.state(partial.duration).position[0] == pytest.approx(1.0, rel=1e-12)
