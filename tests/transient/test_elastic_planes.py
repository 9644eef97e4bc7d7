"""Elastic slip in planes: a node without mass, with friction in a plane, on a spring."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss
from elastic_planes import random_scene

#: N m, N, N/m and m/s of one contact.
FRICTION, PRESSED, SPRING, SPEED = 0.5, 2.0, 60.0, (0.3, 0.1)
MASS, STIFFNESS = np.array([1.0, 1.5]), np.array([[30.0, 4.0], [4.0, 20.0]])
ROTATING = [ss.Harmonic({"x": 4.0}, 1.0), ss.Harmonic({"y": 3.0}, 1.0, phase=-np.pi / 2)]


def pad(**changes):
    """Return a body in a plane with one contact."""
    given = {
        "tangential": ("x", "y"),
        "normal_force": PRESSED,
        "friction": FRICTION,
        "tangential_stiffness": SPRING,
        "slider_speed": SPEED,
        "name": "pad",
    }
    contact = ss.Contact(**{**given, **changes})
    return ss.Scene(MASS, STIFFNESS, damping=0.02 * STIFFNESS, contacts=[contact], dofs=["x", "y"])


@pytest.mark.parametrize("seed", [1, 3, 4, 5, 6, 7, 8, 9])
def test_motions_are_those_of_a_general_integrator(seed):
    """Its steps are accurate to some 1e-14; events are where the same contacts change, in both."""
    one, start, duration = random_scene(np.random.default_rng(seed), seed % 2 == 0)
    run = ss.simulate(one.scene(), duration, start)
    last = one.follow(start, duration)
    times, contacts = zip(*one.events, strict=True)
    assert list(run.events.contact // 2) == list(contacts)
    assert np.abs(run.events.time - times).max() < 1e-12
    end = run.state(duration)
    bent = -end.friction_force / np.repeat([pad.stiffness for pad in one.pads], 2)
    assert np.abs(np.concatenate([end.position, end.velocity, bent]) - last).max() < 1e-12


@pytest.mark.parametrize("turn", [0.3, 1.1, 2.0, -2.9])
def test_no_direction_of_the_plane_is_special(turn):
    one, start, duration = random_scene(np.random.default_rng(4), True)
    runs = [ss.simulate(one.scene(angle), duration, start) for angle in (0.0, turn)]
    times = [run.events.time for run in runs]
    assert len(times[0]) > 10
    assert np.abs(times[1] - times[0]).max() < 1e-12
    ends = [run.state(duration).position for run in runs]
    assert np.abs(ends[1] - ends[0]).max() < 1e-12


def test_motion_along_a_line_is_that_of_a_compliant_contact():
    """That one has a node without mass, which sticks or follows its body."""
    loads = [ss.Harmonic({"x": 5.0}, 1.1)]
    apart = np.diag([30.0, 20.0])
    given = {"normal_force": PRESSED, "friction": FRICTION, "tangential_stiffness": SPRING}
    scenes = [
        ss.Scene(MASS, apart, damping=0.02 * apart, contacts=[contact], dofs=["x", "y"], loads=loads)
        for contact in (ss.Contact(tangential="x", **given), ss.Contact(tangential=("x", "y"), **given))
    ]
    starts = [ss.State([0.1, 0.0], [0.5, 0.0], letters) for letters in ("s", "ss")]
    line, plane = (ss.simulate(scene, 6.0, start) for scene, start in zip(scenes, starts, strict=True))
    assert len(line.events) > 10
    assert np.abs(line.events.time - plane.events.time).max() < 1e-13
    assert np.abs(line.state(6.0).position - plane.state(6.0).position).max() < 1e-14
    slips = [letters != "s" for letters in line.events.combination]
    assert slips == [letters == "oo" for letters in plane.events.combination]


def test_a_stiff_spring_is_friction_at_the_mass():
    """Slip that goes on differs by the time in which the spring relaxes, in proportion to 1 / k."""
    start = {"position": [0.0, 0.0], "velocity": [2.0, -1.0], "combination": "oo"}
    rigid = ss.simulate(pad(tangential_stiffness=None), 0.3, ss.State(**start)).state(0.3).position
    apart = []
    for stiffness in (1e3, 2e3, 4e3):
        run = ss.simulate(pad(tangential_stiffness=stiffness), 0.3, ss.State(**start))
        assert not len(run.events)
        apart.append(np.abs(run.state(0.3).position - rigid).max())
    ratios = np.divide(apart[:-1], apart[1:])
    assert np.abs(ratios - 2.0).max() < 0.1


def test_energy_closes_and_the_heat_is_that_of_the_node():
    run = ss.simulate(pad().replace(loads=ROTATING), 10.0, ss.State([0.1, 0.0], [0.5, 0.0], "ss"))
    assert {"oo", "ss"} <= set(run.events.combination)
    balance = run.balance()
    contacts = balance.contacts
    assert abs(float(balance.residual)) < 1e-13 * abs(float(balance.external))
    # mu times the wear, which is N times the slip speed of the node.
    lost = np.asarray(contacts.slider - contacts.work)
    wear = np.asarray(contacts.wear)
    assert np.abs(lost - FRICTION * wear).max() < 1e-12 * np.abs(lost).max()
    assert (wear >= -1e-15).all()


def test_small_motions_have_a_spring_in_series_with_a_damper():
    """Across the slip: k and mu N / |v|; along it, nothing but the structure; `ss`: k in every direction."""
    v = np.array(SPEED)
    across = np.array([-v[1], v[0]]) / np.hypot(*v)
    rate = SPRING * np.hypot(*v) / (FRICTION * PRESSED)
    inverse = np.diag(1.0 / MASS)
    matrix = np.block(
        [
            [np.zeros((2, 2)), np.eye(2), np.zeros((2, 1))],
            [-inverse @ STIFFNESS, -0.02 * inverse @ STIFFNESS, -SPRING * (inverse @ across)[:, None]],
            [np.zeros((1, 2)), across[None], np.array([[-rate]])],
        ]
    )
    modes = ss.complex_modes(pad())
    expected = [value for value in np.linalg.eigvals(matrix) if value.imag >= 0.0]
    assert np.allclose(np.sort_complex(modes.eigenvalues), np.sort_complex(expected), rtol=1e-12)
    held = np.block(
        [
            [np.zeros((2, 2)), np.eye(2)],
            [-inverse @ (STIFFNESS + SPRING * np.eye(2)), -0.02 * inverse @ STIFFNESS],
        ]
    )
    expected = [value for value in np.linalg.eigvals(held) if value.imag >= 0.0]
    found = ss.complex_modes(pad(), combination="ss").eigenvalues
    assert np.allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-12)


def test_multipliers_are_those_of_the_motion():
    """A period of stick and slip, with its derivative by central differences of runs."""
    loads = [ss.Harmonic({"x": 4.0}, 1.0, phase=1.5), ss.Harmonic({"y": 1.0}, 1.0, phase=1.1)]
    scene = pad(slider_speed=(0.0, 0.0), normal_force=8.0).replace(loads=loads)
    run = ss.simulate(scene, 60.0, ss.State([0.1, 0.0], [0.5, 0.0], "ss"))
    cycle = run.limit_cycle()
    assert set(cycle.run.events.combination) == {"oo", "ss"}
    begin = cycle.run.state(0.0)
    where = np.concatenate([begin.position, begin.velocity, begin.friction_force])
    assert begin.combination == "ss"

    def after(y):
        start = ss.State(y[:2], y[2:4], begin.combination, friction_force=y[4:])
        end = ss.simulate(scene, cycle.period, start).state(cycle.period)
        return np.concatenate([end.position, end.velocity, end.friction_force])

    assert np.abs(after(where) - where).max() < 1e-9
    columns = []
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-5
        columns.append((after(where + step) - after(where - step)) / (2.0 * step[k]))
    expected = np.linalg.eigvals(np.array(columns).T)
    found = np.array(cycle.multipliers)
    order = np.argsort(-np.abs(expected)), np.argsort(-np.abs(found))
    assert np.allclose(np.abs(expected[order[0]]), np.abs(found[order[1]][:6]), atol=1e-6)


def test_the_tractrix_of_a_point_dragged_in_a_line():
    """With a body that hardly moves, the spring turns as ``psi' = -(|v| / d) sin(psi)``."""
    heavy = ss.Scene(
        [1e12, 1e12],
        np.zeros((2, 2)),
        dofs=["x", "y"],
        contacts=[
            ss.Contact(
                tangential=("x", "y"),
                normal_force=PRESSED,
                friction=FRICTION,
                tangential_stiffness=SPRING,
                slider_speed=(0.3, 0.0),
            )
        ],
    )
    begun = 1.4
    force = FRICTION * PRESSED * np.array([np.cos(begun), np.sin(begun)])
    run = ss.simulate(heavy, 0.1, ss.State([0.0, 0.0], [0.0, 0.0], "oo", friction_force=force))
    x, y = run.state(0.1).friction_force
    rate = 0.3 * SPRING / (FRICTION * PRESSED)
    expected = 2.0 * np.arctan(np.tan(begun / 2.0) * np.exp(-rate * 0.1))
    assert np.arctan2(y, x) == pytest.approx(expected, rel=1e-8)


def test_a_scene_and_its_start_come_back_from_files(tmp_path):
    scene = pad()
    ss.save(ss.Case(scene), tmp_path / "scene.toml")
    again = ss.load(tmp_path / "scene.toml").scene
    start = ss.State([0.1, 0.0], [0.5, 0.0], "ss", friction_force=[0.3, -0.2])
    runs = [ss.simulate(one, 3.0, start) for one in (scene, again)]
    assert len(runs[0].events)
    assert np.array_equal(runs[0].events.time, runs[1].events.time)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"static_friction": 0.7}, "static friction above the kinetic one"),
        ({"friction": 0.0}, "must be > 0 beside a tangential_stiffness in a plane"),
        ({"slider_vibration": (None, ss.Harmonic(1.0, 2.0))}, "sliders that vibrate"),
        ({"friction": ss.friction.Stribeck(0.5, 0.3, 0.1)}, "slip speed"),
    ],
)
def test_what_is_not_computed_is_refused(changes, said):
    with pytest.raises(ss.InputError, match=said):
        pad(**changes)


def test_a_spring_along_the_plane_beside_a_normal_stiffness_is_refused():
    contact = ss.Contact(
        tangential=("x", "y"), normal="z", friction=0.5, tangential_stiffness=1e3, normal_stiffness=1e3
    )
    with pytest.raises(
        ss.InputError, match="not computed beside a normal_stiffness; tie a dof with a small mass"
    ):
        ss.Scene(np.ones(3), np.eye(3), dofs=["x", "y", "z"], contacts=[contact])


@pytest.mark.parametrize(
    ("letters", "force", "said"),
    [
        ("ss", [1.1, 0.0], "friction force is 1.1"),
        ("oo", [0.9, 0.0], "friction force is 0.9"),
        ("oo", [1.0, 0.0], "slip velocity of its node"),
        ("ss", [-1.0, 0.0], "slip velocity of its node"),
    ],
)
def test_a_start_that_is_none_is_refused(letters, force, said):
    """The body moves along x over a slider at rest, so that friction pulls it back."""
    start = ss.State([0.0, 0.0], [0.2, 0.0], letters, friction_force=force)
    with pytest.raises(ss.InputError, match=said):
        ss.simulate(pad(slider_speed=(0.0, 0.0)), 1.0, start)


def test_a_start_at_the_limit_that_comes_back_does_not_slip():
    start = ss.State([0.0, 0.0], [-0.2, 0.0], "ss", friction_force=[-1.0, 0.0])
    run = ss.simulate(pad(slider_speed=(0.0, 0.0)), 0.01, start)
    assert not len(run.events)
    state = run.state(0.01)

    def rate(t, y):
        force = y[4:] - STIFFNESS @ (y[:2] + 0.02 * y[2:4])
        return np.concatenate([y[2:4], force / MASS, -SPRING * y[2:4]])

    begin = np.array([0.0, 0.0, -0.2, 0.0, -1.0, 0.0])
    last = solve_ivp(rate, (0.0, 0.01), begin, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    assert np.abs(np.concatenate([state.position, state.velocity, state.friction_force]) - last).max() < 1e-13


def test_onsets_are_where_the_force_is_at_its_limit():
    """The square of a force moves twice as fast as the force, on panels that are as short."""
    scene = pad(slider_speed=(0.0, 0.0), normal_force=8.0).replace(loads=ROTATING)
    run = ss.simulate(scene, 10.0, ss.State([0.1, 0.0], [0.5, 0.0], "ss"))
    onsets = run.events.time[run.events.kind == "slip"]
    assert len(onsets) > 10
    forces = [np.hypot(*run.state(time).friction_force) for time in onsets]
    assert np.abs(np.array(forces) - 8.0 * FRICTION).max() < 1e-12


def test_the_force_of_the_spring_stands_for_its_deflection():
    """No second number of a state tells the same; `internal` is for laws with a state."""
    run = ss.simulate(pad(), 2.0, ss.State([0.1, 0.0], [0.5, 0.0], "ss"))
    assert run.state(2.0).internal is None
    with pytest.raises(ss.InputError, match="internal: contact 0: must be 0"):
        ss.simulate(pad(), 2.0, ss.State([0.1, 0.0], [0.5, 0.0], "ss", internal=[0.01, 0.0]))


def beside_bristles():
    """Return the pad and a body beside it, on bristles under a normal force that changes, which lifts off."""
    bristles = ss.friction.LuGre(static=0.8, kinetic=0.4, speed=0.1, stiffness=400.0, damping=0.2)
    belt = ss.Contact(tangential="u", normal="v", friction=bristles, slider_speed=0.2)
    stiffness = np.zeros((4, 4))
    stiffness[:2, :2] = STIFFNESS
    stiffness[2:, 2:] = [[90.0, 20.0], [20.0, 200.0]]
    stiffness[0, 2] = stiffness[2, 0] = -15.0
    return ss.Scene(
        [*MASS, 1.0, 0.7],
        stiffness,
        damping=0.01 * stiffness,
        force=[0.0, 0.0, 0.0, -5.0],
        dofs=["x", "y", "u", "v"],
        contacts=[*pad().contacts, belt],
        loads=[ss.Harmonic({"v": 7.0, "x": 3.0}, 1.1), ss.Harmonic({"y": 3.0}, 1.1, phase=-1.5)],
    )


def test_a_motion_goes_on_from_its_states_beside_a_contact_with_bristles_that_opens():
    scene = beside_bristles()
    run = ss.simulate(scene, 6.0, ss.State(np.zeros(4), np.zeros(4), "ssd"))
    assert {"ss", "oo"} <= {letters[:2] for letters in run.events.combination}
    assert {"release", "impact", "slip"} <= set(run.events.kind)
    last = run.state(6.0)
    closed = [time for time in np.linspace(0.5, 3.0, 40) if run.state(time).combination[2] != "d"]
    for time in closed[:: max(1, len(closed) // 5)]:
        begin = run.state(time)
        assert np.any(begin.friction_force[:2])
        assert list(begin.internal[:2]) == [0.0, 0.0]
        assert begin.internal[2] != 0.0
        shifted = scene.replace(
            loads=[
                ss.Harmonic({"v": 7.0, "x": 3.0}, 1.1, phase=2 * np.pi * 1.1 * time),
                ss.Harmonic({"y": 3.0}, 1.1, phase=2 * np.pi * 1.1 * time - 1.5),
            ]
        )
        again = ss.simulate(shifted, 6.0 - time, begin).state(6.0 - time)
        assert np.abs(again.position - last.position).max() < 1e-10
        assert np.abs(again.friction_force - last.friction_force).max() < 1e-8


def test_modes_of_nodes_that_rest_beside_an_open_contact_with_bristles():
    """The contact that is open has no state: its body is free, and the pad has its spring."""
    scene = beside_bristles()
    held = np.array(scene.stiffness)
    held[:2, :2] += SPRING * np.eye(2)
    inverse = np.diag(1.0 / np.array(scene.mass))
    damped = -0.01 * inverse @ np.array(scene.stiffness)
    matrix = np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ held, damped]])
    expected = [value for value in np.linalg.eigvals(matrix) if value.imag >= 0.0]
    found = ss.complex_modes(scene, combination="ssd").eigenvalues
    assert np.allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-12)


def test_a_pad_that_its_slider_takes_along_pulls_a_node_from_rest():
    """Beside the same scene with friction along a line."""

    def motion(plane):
        stiffness = 10.0 * np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(2))
        contacts = [
            ss.Contact(
                tangential=(f"x{i}", f"y{i}") if plane else f"x{i}",
                normal_force=4.0,
                friction=0.5,
                tangential_stiffness=100.0 if i == 0 else None,
                slider_speed=(float(i), 0.0) if plane else float(i),
            )
            for i in range(2)
        ]
        scene = ss.Scene([1.0] * 4, stiffness, dofs=["x0", "y0", "x1", "y1"], contacts=contacts)
        start = ss.State([0.0] * 4, [0.0, 0.0, 1.0, 0.0], "s" * len(scene.contacts))
        return ss.simulate(scene, 2.0, start)

    plane, line = motion(True), motion(False)
    assert [plane.stop_reason, line.stop_reason] == ["duration"] * 2
    assert len(plane.events) == len(line.events) > 2
    np.testing.assert_allclose(plane.events.time, line.events.time, rtol=1e-13)
    np.testing.assert_allclose(plane.state(2.0).position, line.state(2.0).position, atol=1e-13)
