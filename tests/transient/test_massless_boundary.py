"""Dofs without mass that contacts act on: against brute force, and what must hold in every run."""

import numpy as np
import pytest
from tests.support.quasi_static import Node, QuasiStatic

import stickslip as ss

ULP = np.finfo(float).eps


def boundary(seed: int, contacts: int, *, static: bool) -> tuple[ss.Scene, QuasiStatic, ss.State]:
    """Masses that hang on a dense elastic boundary, whose nodes rub on a slider; springs tie the nodes."""
    rng = np.random.default_rng(seed)
    inner, outer = 3, 2 * contacts
    size = inner + outer
    links = rng.normal(size=(size, size))
    stiffness = 3e2 * (links @ links.T) + np.diag(np.r_[np.full(inner, 1e4), np.full(outer, 2e4)])
    mass = np.r_[rng.uniform(0.5, 2.0, inner), np.zeros(outer)]
    damping = np.zeros((size, size))
    damping[:inner, :inner] = np.diag(rng.uniform(1.0, 5.0, inner))
    force = np.r_[rng.uniform(-20.0, 20.0, inner), np.tile([0.0, -40.0], contacts)]
    laws, nodes = [], []
    for k in range(contacts):
        friction = rng.uniform(0.1, 0.5)
        held = friction * (1.2 if static else 1.0)
        tangential, normal = inner + 2 * k, inner + 2 * k + 1
        laws.append(
            ss.Contact(
                tangential=tangential,
                normal=normal,
                friction=friction,
                static_friction=held,
                slider_speed=0.1,
            )
        )
        nodes.append(Node(np.eye(size)[tangential], np.eye(size)[normal], friction, held, 0.1))
    scene = ss.Scene(mass, stiffness, damping=damping, force=force, contacts=laws)
    reference = QuasiStatic(mass[:inner], damping[:inner, :inner], stiffness, force, nodes)
    # Lifted off by some millimetres, and let go.
    flexibility = np.linalg.inv(stiffness[inner:, inner:])
    gaps = slice(1, outer, 2)
    lifted = rng.uniform(1e-3, 3e-3, contacts) - (flexibility @ force[inner:])[gaps]
    position = np.linalg.lstsq(-(flexibility @ stiffness[inner:, :inner])[gaps], lifted, rcond=None)[0]
    velocity = rng.uniform(-0.5, 0.5, inner)
    rest = np.zeros(outer)
    start = ss.State(np.r_[position, rest], np.r_[velocity, rest], "d" * contacts)
    return scene, reference, start


def assert_same_events(run: ss.Trajectory, reference: QuasiStatic, least: int = 4) -> None:
    """The same combinations after the same instants; a jump may change several contacts at one."""
    last = np.append(np.diff(run.events.time) > 1e-10, True)
    assert [combination for _, _, combination in reference.events] == list(run.events.combination[last])
    assert last.sum() >= least
    np.testing.assert_allclose(run.events.time[last], [event[0] for event in reference.events], atol=1e-9)


@pytest.mark.parametrize(
    ("seed", "contacts", "static"),
    [
        (0, 1, False),
        (0, 1, True),
        (1, 2, False),
        (2, 2, False),
        (3, 3, False),
        (2, 2, True),
        (9, 2, True),
        (3, 3, True),
    ],
)
def test_against_brute_force(seed: int, contacts: int, static: bool) -> None:
    scene, reference, start = boundary(seed, contacts, static=static)
    duration, inner = 0.15, reference.m
    places = [float(node.t @ start.position) for node in reference.nodes]
    state = [*start.position[:inner], *start.velocity[:inner]]
    end = reference.run(state, start.combination, duration, places)
    for method in ("modal", "taylor"):
        run = ss.simulate(scene, duration, start, method=method)
        assert_same_events(run, reference)
        last = run.state(duration)
        np.testing.assert_allclose([*last.position[:inner], *last.velocity[:inner]], end, atol=1e-8)
        balance = run.balance()
        terms = abs(balance.contact) + abs(balance.external) + abs(balance.damping)
        assert abs(balance.residual) <= 500.0 * ULP * terms


def test_dofs_without_mass_follow_in_modes_and_states() -> None:
    """`x_b` is where statics put it, in states, samples and mode shapes."""
    scene, _, start = boundary(4, 2, static=False)
    run = ss.simulate(scene, 0.05, start)
    sample = run.sample(np.linspace(0.0, run.duration, 51))
    load = sample.position.values @ np.asarray(scene.stiffness).T - scene.force
    forces = np.stack([sample.friction_force.values, sample.normal_force.values], axis=2).reshape(51, 4)
    np.testing.assert_allclose(load[:, 3:], forces, atol=1e-10 * np.abs(load).max())
    modes = ss.complex_modes(scene, "++")
    assert modes.shapes.shape == (7, 3)
    friction = np.array([contact.friction for contact in scene.contacts])
    rows = np.asarray(scene.stiffness) @ modes.shapes
    np.testing.assert_allclose(rows[3::2], friction[:, None] * rows[4::2], atol=1e-9 * np.abs(rows).max())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"stiffness": np.diag([1e3, 1e3, 0.0])}, "positive definite over the dofs without mass"),
        ({"damping": np.diag([1.0, 1.0, 1.0])}, "damping: entry at dof 2, which has no mass"),
        ({"contacts": [ss.Contact(normal=2, restitution=0.5)]}, "nothing bounces"),
        ({"contacts": [ss.Contact(normal=1, tangential=2, friction=0.1)]}, "give both mass"),
        ({"contacts": [ss.Contact(normal=[0.0, 1.0, -1.0])]}, "tie dofs with mass to dofs without"),
    ],
)
def test_scenes_that_are_refused(given: dict[str, object], message: str) -> None:
    whole = {"mass": [1.0, 1.0, 0.0], "stiffness": np.diag([1e3, 1e3, 1e3]), **given}
    with pytest.raises(ss.InputError, match=message):
        ss.Scene(**whole)
