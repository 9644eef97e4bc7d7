"""Friction in a plane whose slip stays on a line, beside friction along that line, where events coincide."""

import numpy as np
import pytest

import stickslip as ss

PULL = np.pi / 2.0


def runs(pads, coupling=0.0, loads=None, damping=None, start=None, duration=2.0, *, height=None):
    """Return the runs of equal masses under pads along lines and in planes; `pads` are (contact, force)."""
    found = []
    for plane in (False, True):
        dofs, contacts, force, letters = [], [], [], ""
        velocity = np.zeros(3 * len(pads))
        for i, (given, pull) in enumerate(pads):
            dofs += [f"x{i}", f"z{i}", f"y{i}"]
            speed = given["slider_speed"]
            own = given | {"slider_speed": (speed, 0.0) if plane else speed}
            own |= {"normal": f"z{i}"} if "normal_force" not in given else {}
            tangential = (f"x{i}", f"y{i}") if plane else f"x{i}"
            contacts.append(ss.Contact(tangential=tangential, name=f"pad{i}", **own))
            force += [pull, -1.0 if "normal_force" not in given else 0.0, 0.0]
            letter = start[i]
            velocity[3 * i] = speed if letter == "s" else 0.0
            letters += (letter if letter in "sd" else "o") * 2 if plane else letter
        size = len(dofs)
        stiffness = (
            np.diag([100.0, 10.0, 100.0] * len(pads)) if height is not None else np.zeros((size, size))
        )
        for k in range(size - 3):
            stiffness[np.ix_([k, k + 3], [k, k + 3])] += coupling * np.array([[1.0, -1.0], [-1.0, 1.0]])
        scene = ss.Scene(
            np.ones(size),
            stiffness,
            damping=damping,
            force=force,
            dofs=dofs,
            contacts=contacts,
            loads=[] if loads is None else [ss.Harmonic(*loads)],
        )
        position = np.zeros(size)
        position[1::3] = height or 0.0
        found.append(ss.simulate(scene, duration, ss.State(position, velocity, letters)))
    return found


def assert_alike(found, *, events=True):
    """The same events to the last digits, the same end, and an energy that closes."""
    along, plane = found
    assert plane.stop_reason == along.stop_reason == "duration"
    if events:
        assert [kind[:4] for kind in plane.events.kind] == [kind[:4] for kind in along.events.kind]
        np.testing.assert_allclose(np.sort(plane.events.time), np.sort(along.events.time), rtol=1e-12)
    ends = [run.state(2.0) for run in found]
    np.testing.assert_allclose(ends[1].position, ends[0].position, atol=1e-12)
    np.testing.assert_allclose(ends[1].velocity, ends[0].velocity, atol=1e-12)
    assert abs(plane.balance().residual) < 1e-12


def test_slip_begins_at_the_same_instant():
    """On a contact spring, whose normal force is large in a phase and about to vanish where slip begins."""
    pad = {"friction": 1.0, "slider_speed": 0.1, "normal_stiffness": 1e3}
    found = runs([(pad, 0.0)], start="d", height=0.5)
    assert found[0].events.kind.tolist().count("slip+") > 0
    assert_alike(found)


@pytest.mark.parametrize(
    "law",
    [0.5, ss.friction.Stribeck(0.5, 0.3, 0.1), ss.friction.Linear(0.5, 0.1)],
    ids=["number", "falls", "rises"],
)
def test_equal_pads_stop_together(law):
    pad = {"friction": law, "slider_speed": 1.0, "normal_force": 1.0}
    found = runs([(pad, 0.4)] * 3, damping=ss.Rayleigh(mass=0.1), start="+++")
    assert found[0].events.kind.tolist() == ["velocity"] * 3
    assert_alike(found)


def test_equal_pads_pass_through_rest_together():
    """A load turns their slips at one instant, and friction does not hold them."""
    pad = {"friction": 0.5, "slider_speed": 0.1, "normal_force": 4.0}
    load = ({f"x{i}": 4.0 for i in range(3)}, 2.0, PULL)
    found = runs([(pad, 0.0)] * 3, 1.0, load, ss.Rayleigh(mass=0.1), start="sss")
    assert found[0].events.kind.tolist().count("velocity") > 6
    assert_alike(found)


def test_a_start_at_the_limit_leaves_it_as_the_neighbour_moves():
    """Forces on a pad are at its limit with no rate: its slip begins with a higher power of time."""
    law = ss.friction.Linear(0.5, 0.1)
    pad = {"friction": law, "slider_speed": 0.0, "normal_force": 1.0}
    free = {"friction": 0.1, "slider_speed": 0.0, "normal_force": 1.0}
    found = runs([(pad, 0.5), (free, 0.4)], 50.0, damping=ss.Rayleigh(mass=0.1), start="s-")
    assert_alike(found, events=False)
    assert found[1].state(2.0).position[0] > 0.0
