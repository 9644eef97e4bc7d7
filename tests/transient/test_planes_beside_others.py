"""Friction in a plane in scenes with nonlinear springs, compliant contacts and nodes without mass."""

import numpy as np
import pytest

import stickslip as ss
from plane_scenes import compared, random_lifting_scene, random_scene, with_laws, with_springs

#: Along x, across it, and y of the body that slips in a plane; x and y of the one beside it.
DOFS = ("x", "z", "y", "x1", "y1")
SPEED = 0.12


@pytest.mark.parametrize(
    ("draw", "seed"),
    [
        *((random_scene, seed) for seed in (3, 7, 12)),
        # Springs act along the normals of contacts.
        *((random_lifting_scene, seed) for seed in (3, 5, 8, 11, 14)),
        *((with_laws(random_scene), seed) for seed in (3, 7)),
        *((with_laws(random_lifting_scene), seed) for seed in (3, 5, 11, 14)),
    ],
)
def test_scenes_beside_cubic_springs_agree_with_a_general_integrator(draw, seed):
    _, times, state = compared(seed, with_springs(draw))
    assert times < 1e-9
    assert state < 2e-9


def beside(kind: str, rng: np.random.Generator) -> tuple[ss.Contact, float]:
    """Return a contact along x1 that is compliant, and the load that presses it."""
    changes = {
        "along": {"normal": "y1", "tangential_stiffness": 600.0, "normal_stiffness": 2000.0},
        "across": {"normal": "y1", "normal_stiffness": 1500.0},
        "Hertz": {"normal": "y1", "normal_stiffness": ss.spring.Hertz(9000.0)},
        "Jenkins": {"normal_force": 4.0, "tangential_stiffness": 500.0},
    }[kind]
    friction = float(rng.uniform(0.2, 0.6))
    contact = ss.Contact(tangential="x1", friction=friction, slider_speed=0.1, name="line", **changes)
    return contact, 0.0 if kind == "Jenkins" else -6.0


def both(kind: str, seed: int, spring: float | ss.spring.Hertz | None = None) -> list[ss.Scene]:
    """Return a scene whose slip in a plane has no reason to leave x, and the same with friction along x.

    On a contact spring of its own a load lifts the pad.
    """
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(4, 4))
    stiffness = np.diag([0.0, 100.0, 0.0, 0.0, 0.0])
    others = np.ix_([0, 2, 3, 4], [0, 2, 3, 4])
    stiffness[others] = 15.0 * root @ root.T + np.diag(rng.uniform(50.0, 200.0, 4))
    mass = rng.uniform(0.5, 2.0, 5)
    static = float(rng.uniform(0.3, 0.7))
    by_law = ss.friction.Stribeck(static=static, kinetic=0.7 * static, speed=0.1)
    pad = {"friction": by_law if rng.random() < 0.5 else static, "name": "pad"}
    opens = spring is not None or rng.random() < 0.5
    pad |= {"normal": "y", "normal_stiffness": spring} if opens else {"normal_force": 5.0}
    line, load = beside(kind, rng)
    springs = [ss.Spring({"x": 1.0, "x1": -1.0}, ss.spring.Polynomial(0.0, 0.0, 2e3))]
    contacts = [
        ss.Contact(tangential=("x", "z"), slider_speed=(SPEED, 0.0), **pad),
        ss.Contact(tangential="x", slider_speed=SPEED, **pad),
    ]
    return [
        ss.Scene(
            mass=mass,
            stiffness=stiffness,
            damping=ss.Rayleigh(mass=0.1),
            force=[0.0, 0.0, -5.0 if opens else 0.0, 0.0, load],
            dofs=DOFS,
            contacts=[contact, line],
            elements=springs if seed % 2 else [],
            loads=[] if spring is None else [ss.Harmonic({"y": 6.0, "x": 1.0}, frequency=1.3)],
        )
        for contact in contacts
    ]


@pytest.mark.parametrize(
    ("kind", "seed", "spring"),
    [
        *((kind, seed, None) for kind in ("along", "across", "Hertz", "Jenkins") for seed in range(4)),
        *(("across", seed, spring) for spring in (1500.0, ss.spring.Hertz(9e3)) for seed in range(4)),
    ],
)
def test_slip_that_stays_on_a_line_beside_compliance_is_slip_along_this_line(kind, seed, spring):
    runs = []
    for scene in both(kind, seed, spring):
        start = ss.steady_sliding(scene).perturbed(velocity={"x": -0.15})
        runs.append(ss.simulate(scene, 3.0, start))
    plane, line = runs
    balance = plane.balance()
    closes = 1e-13 if spring is None else 1e-11
    assert abs(balance.residual) < closes * max(abs(balance.external), 1.0)
    assert spring is None or "closing" in plane.events.kind
    assert [one.rstrip("+-") for one in plane.events.kind] == [one.rstrip("+-") for one in line.events.kind]
    np.testing.assert_allclose(plane.events.time, line.events.time, atol=1e-12)
    ends = [run.state(3.0) for run in runs]
    np.testing.assert_allclose(ends[0].position, ends[1].position, atol=1e-12)


def test_a_slip_beside_springs_begins_where_the_whole_force_reaches_the_limit():
    """A body that sticks to a belt is pulled by a cubic spring alone, and pressed by another one."""
    cubic = ss.spring.Polynomial(0.0, 0.0, 300.0)
    scene = ss.Scene(
        mass=[1.0, 1.0, 1.0],
        stiffness=np.zeros((3, 3)),
        force=[0.0, 0.0, -2.0],
        dofs=("x", "z", "y"),
        contacts=[ss.Contact(tangential=("x", "z"), normal="y", friction=0.5, slider_speed=(0.3, 0.1))],
        elements=[ss.Spring("x", cubic), ss.Spring({"x": -0.5, "y": 1.0}, cubic)],
    )
    run = ss.simulate(scene, 0.7, ss.State([0.0] * 3, [0.3, 0.1, 0.0], "ss"), max_events=1)
    place = 0.3 * float(run.events.time[0])
    # The second spring lifts the body, and pulls it back along x with half of that force.
    lifting = 300.0 * (0.5 * place) ** 3
    pull = 300.0 * place**3 + 0.5 * lifting
    assert run.events.kind[0] == "slip"
    np.testing.assert_allclose(pull, 0.5 * (2.0 - lifting), rtol=1e-12)


def test_a_plane_needs_mass_on_its_own_dofs():
    contact = ss.Contact(tangential=("x", "z"), normal_force=1.0, friction=0.5, slider_speed=(0.1, 0.0))
    with pytest.raises(ss.InputError, match="not computed beside dofs without mass on which it acts"):
        ss.Scene(mass=[1.0, 0.0], stiffness=np.eye(2), dofs=("x", "z"), contacts=[contact])


@pytest.mark.parametrize(
    ("share", "spring"), [(0.0, {}), (0.25, {}), (0.0, {"normal_stiffness": 1e4})], ids=str
)
def test_a_contact_opens_where_its_cone_only_touches_zero(share, spring):
    """Sticking without a friction force, or with a part of N, its limit and its force vanish at once."""
    runs = []
    for tangential, speed, statuses in (("x", 0.0, "s"), (("x", "y"), (0.0, 0.0), "ss")):
        pad = ss.Contact(
            tangential=tangential, normal="z", friction=0.4, slider_speed=speed, name="pad", **spring
        )
        scene = ss.Scene(
            np.ones(3),
            100.0 * np.eye(3),
            damping=0.1 * np.eye(3),
            dofs=["x", "y", "z"],
            force=[-5.0 * share, 0.0, -5.0],
            contacts=[pad],
            loads=[ss.Harmonic({"x": 8.0 * share, "z": 8.0}, 1.0, phase=-np.pi / 2.0)],
        )
        runs.append(ss.simulate(scene, 2.0, ss.State(np.zeros(3), np.zeros(3), statuses)))
    along, plane = (run.events for run in runs)
    assert "release" in along.kind
    assert [kind[:4] for kind in plane.kind] == [kind[:4] for kind in along.kind]
    np.testing.assert_allclose(plane.time, along.time, rtol=1e-11)
    normal = runs[1].sample(np.linspace(0.0, 2.0, 501)).normal_force
    assert float(normal.min()) >= 0.0


def test_a_frictionless_plane_closes_on_its_spring_as_a_stop_does():
    """No friction begins where it closes, also where nothing slides."""
    runs = []
    for contact in (
        ss.Contact(
            tangential=("x", "y"), normal="z", friction=0.0, slider_speed=(0.0, 0.0), normal_stiffness=1e3
        ),
        ss.Contact(normal="z", normal_stiffness=1e3),
    ):
        scene = ss.Scene(
            np.ones(3),
            np.diag([100.0, 0.0, 10.0]),
            damping=0.1 * np.eye(3),
            dofs=["x", "y", "z"],
            force=[0.0, 0.0, -4.0],
            contacts=[contact],
        )
        start = ss.State([0.0, 0.0, 0.5], np.zeros(3), "d" * len(scene.contacts))
        runs.append(ss.simulate(scene, 2.0, start))
    assert runs[0].events.kind.tolist() == ["closing", "release", "closing", "release", "closing"]
    np.testing.assert_allclose(runs[0].events.time, runs[1].events.time, rtol=1e-12)


def test_three_equal_pads_come_to_rest_at_one_instant():
    """The last of them does so in a phase whose other slips have ended where it begins."""
    pads, force, load = [], [], {}
    for i in range(3):
        pads.append(
            ss.Contact(
                tangential=(f"x{i}", f"y{i}"),
                normal=f"z{i}",
                friction=0.5,
                slider_speed=(0.1, 0.0),
                normal_stiffness=1e3,
                name=f"pad{i}",
            )
        )
        force += [0.0, 0.0, -1.0]
        load |= {f"x{i}": 0.5, f"z{i}": 2.0}
    scene = ss.Scene(
        np.ones(9),
        np.diag([100.0, 0.0, 10.0] * 3),
        damping=ss.Rayleigh(mass=0.1),
        dofs=[f"{name}{i}" for i in range(3) for name in "xyz"],
        force=force,
        contacts=pads,
        loads=[ss.Harmonic(load, 0.5, phase=-np.pi / 2.0)],
    )
    position = np.tile([0.0, 0.0, -1e-3], 3)
    run = ss.simulate(scene, 2.0, ss.State(position, np.zeros(9), "oooooo"))
    assert "velocity" in run.events.kind
    state = run.state(2.0)
    for values in (state.position, state.velocity):
        np.testing.assert_allclose(np.reshape(values, (3, 3)), np.tile(values[:3], (3, 1)), atol=1e-11)
