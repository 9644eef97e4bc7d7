"""The standard run under Stribeck friction and with hardening springs on its upper masses."""

from __future__ import annotations

from typing import Any

from mpmath import mpf

import stickslip as ss
from stickslip.scene.laws.friction import FrictionLaw

#: s
DURATION = 0.6
#: Events whose error counts.
COUNTED = 40
LAW = ss.friction.Stribeck(static=1.5, kinetic=1.2, speed=0.1)
#: N/m^3: at the largest motions, of 1 mm, a tenth of the stiffness of a subsystem.
HARD = 2e10


def reference_model(friction: FrictionLaw | float) -> tuple[ss.Scene, ss.State]:
    """Return the scene of the standard run under a friction, and its start."""
    scene = ss.models.two_subsystems(friction=friction, slider_speed=0.025, preload_displacement=1e-3)
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})


def error(found: Any, expected: list[tuple[mpf, int, str]]) -> str:
    """Return the largest error of the times; the contacts and combinations have to agree."""
    events = list(zip(found.time, found.contact, found.combination, strict=True))[: len(expected)]
    if [(int(i), str(c)) for _, i, c in events] != [(i, c) for _, i, c in expected]:
        return "other events"
    return f"{max(abs(float(mpf(float(e[0])) - t[0])) for e, t in zip(events, expected, strict=True)):.1e}"


def hardened(count: int) -> tuple[ss.Scene, ss.State]:
    """Return the scene of the standard run with some cubic springs, and its start."""
    scene = ss.models.two_subsystems(friction=1.5, slider_speed=0.025, preload_displacement=1e-3)
    law = ss.spring.Polynomial(0.0, 0.0, HARD)
    held = {scene.dofs[k] for contact in scene.contacts for k in (contact.tangential, contact.normal)}
    free = [name for name in scene.dofs if name not in held]
    scene = scene.replace(elements=[ss.Spring({name: 1.0}, law) for name in free[:count]])
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
