"""Starts whose speed is that of the slider up to a few units in the last place."""

from math import inf, nextafter

import numpy as np
import pytest

import stickslip as ss

SPEED = 0.3
#: m/s; 0.1 + 0.2 is one unit in the last place above 0.3.
SPEEDS = [
    SPEED,
    0.1 + 0.2,
    nextafter(SPEED, 0.0),
    nextafter(0.1 + 0.2, inf),
    SPEED * (1.0 + 1e-12),
    SPEED * (1.0 - 1e-12),
]
KINDS = {
    "constant friction": {},
    "static friction": {"static_friction": 0.6},
    "law": {"friction": ss.friction.Stribeck(0.5, 0.3, 0.1)},
    "coupled mass": {"coupling": 0.2},
}


def block(slider_speed, friction=0.5, coupling=0.0, **contact):
    """1 kg on a spring of 100 N/m, pressed by 10 N onto a belt that carries it."""
    mass = [[1.0, coupling], [coupling, 1.0]] if coupling else [1.0, 1.0]
    belt = ss.Contact(tangential="x", normal="y", friction=friction, slider_speed=slider_speed, **contact)
    return ss.Scene(
        mass,
        np.diag([100.0, 100.0]),
        force=[0.0, -10.0],
        contacts=[belt],
        dofs=["x", "y"],
        impact_friction=bool(coupling),
    )


@pytest.mark.parametrize("status", "s+-")
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_the_belt_carries_what_starts_with_almost_its_speed(kind, speed, status, mirrored):
    scene = block(mirrored * SPEED, **KINDS[kind])
    start = ss.State([0.0, 0.0], [mirrored * speed, 0.0], status)
    slip = mirrored * (speed - SPEED)
    pushed_back = {"s": True, "+": slip < 0.0, "-": slip > 0.0}[status]
    if not pushed_back:
        said = f"contact 0 is '\\{status}' in the combination, but its"
        if status != "s" and abs(slip) > 1e-9:
            said += rf".*; give it the letter '\{'+' if slip < 0.0 else '-'}'"
        with pytest.raises(ss.InputError, match=said):
            ss.simulate(scene, 0.1, start)
        return
    # Friction of 3 N and more holds the spring up to x = 0.03 m.
    run = ss.simulate(scene, 0.0999, start)
    assert str(run.sample([0.05]).status.item()) in {"s", "sticking"}
    moved = run.sample([0.0999]).position.to_numpy()[0, 0]
    assert moved == pytest.approx(mirrored * SPEED * 0.0999, rel=1e-11 if abs(slip) < 1e-14 else 1e-9)
