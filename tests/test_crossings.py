"""Where two kinds of scene or result meet: each is seen by every view that exists for one of them."""

import re
from pathlib import Path

import numpy as np
import pytest
from meshed import block

import stickslip as ss
from stickslip.explorer import picture
from stickslip.motion.events import KINDS

BELT = {"friction": 0.5, "slider_speed": 0.1}


def compliant():
    """Hoffmann's two dofs on a contact spring, unstable above friction 0.546."""
    contact = ss.Contact(tangential="x", normal="y", friction=0.8, slider_speed=1.0, normal_stiffness=30.0)
    return ss.Scene(
        [1.0, 1.0], [[11.0, -5.0], [-5.0, 10.0]], force=[0, -10.0], dofs=["x", "y"], contacts=[contact]
    )


def bouncing():
    """Return a motion that opens and closes a contact spring."""
    scene = compliant()
    start = ss.sliding_equilibrium(scene)
    return ss.simulate(scene, ss.State(start.position + [0.0, 2.0], start.velocity, "d"), 20.0)


def with_stop():
    """Return a mass on a belt beside a stop that it does not reach in steady sliding."""
    belt = ss.Contact(tangential="x", normal="y", **BELT)
    stop = ss.Contact(normal={"x": -1.0}, gap=1.0)
    return ss.Scene(
        [1.0, 1.0], [[9.0, 1.0], [1.0, 20.0]], force=[0, -5.0], dofs=["x", "y"], contacts=[belt, stop]
    )


def test_every_kind_of_event_of_the_core_is_explained():
    source = Path(__file__).parents[1] / "rust/core/src/contact/event_kind.rs"
    named = re.findall(r'EventKind::\w+ => "([^"]+)"', source.read_text())
    assert len(named) == 11
    assert set(KINDS) == set(named)


def test_a_run_with_closings_has_a_summary():
    run = bouncing()
    assert "closing" in run.events.kind
    assert KINDS["closing"] in str(run.summary())
    assert KINDS["closing"] in run.events._repr_html_()


def test_sliding_beside_a_stop_is_disturbed_within_the_speed_of_the_belt():
    scene = with_stop()
    start = ss.disturbed_sliding(scene)
    assert start.combination == "+d"
    # The mode as a velocity takes the only moving slider to half of its speed, as the docstring says.
    assert abs(start.velocity[0]) == pytest.approx(0.5 * BELT["slider_speed"], rel=1e-14)


def test_explorer_chooses_contacts_of_a_motion_under_steps():
    push = ss.Steps({"x": 0.1}, times=[0.5, 1.0], values=[0.0, 1.0, 0.0])
    scene = ss.Scene(
        [1.0, 1.0],
        np.diag([9.0, 20.0]),
        force=[0, -5.0],
        dofs=["x", "y"],
        loads=[push],
        contacts=[ss.Contact(tangential="x", normal="y", **BELT)],
    )
    run = ss.simulate(scene, ss.disturbed_sliding(scene), 3.0)
    assert -1 in run.events.contact
    assert picture._contacts(run) == [0]
