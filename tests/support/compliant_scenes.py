"""Random scenes with compliant contacts, each as a scene and as its brute-force reference."""

from __future__ import annotations

import numpy as np
from tests.support.quasi_static import QuasiStatic, compliant

import stickslip as ss


def pair(mass, damping, stiffness, force, contacts: list[dict[str, object]]) -> tuple[ss.Scene, QuasiStatic]:
    """Scene and reference of contacts given as dicts of ``t``, ``n``, ``kn``, ``kt`` and the law."""
    scene = ss.Scene(
        mass,
        stiffness,
        damping=damping,
        force=force,
        contacts=[
            ss.Contact(
                tangential=np.asarray(law["t"], float),
                normal=np.asarray(law["n"], float),
                friction=law.get("friction", 0.0),
                static_friction=law.get("static"),
                slider_speed=law.get("speed", 0.0),
                gap=law.get("gap", 0.0),
                normal_stiffness=law["kn"],
                tangential_stiffness=law["kt"],
            )
            for law in contacts
        ],
    )
    arrays = [{**law, "t": np.asarray(law["t"], float), "n": np.asarray(law["n"], float)} for law in contacts]
    return scene, compliant(mass, damping, np.asarray(stiffness, float), np.asarray(force, float), arrays)


def rigid_pad(seed: int, points: int, *, static: bool) -> tuple[ss.Scene, QuasiStatic, ss.State]:
    """A rigid pad (x, y, angle) on compliant points in a row, thrown onto a moving slider."""
    rng = np.random.default_rng(seed)
    stiffness = np.diag([2e4, 3e4, 60.0])
    stiffness[0, 2] = stiffness[2, 0] = rng.uniform(-100.0, 100.0)
    contacts = []
    for arm in np.linspace(-0.06, 0.06, points):
        friction = rng.uniform(0.2, 0.9)
        contacts.append(
            {
                "t": [1.0, 0.0, 0.05],
                "n": [0.0, 1.0, arm],
                "kn": rng.uniform(2e4, 2e5),
                "kt": rng.uniform(1e4, 1e5),
                "friction": friction,
                "static": friction * rng.uniform(1.05, 1.5) if static else friction,
                "speed": 0.2,
            }
        )
    force = [0.0, -100.0, 0.0]
    scene, reference = pair([2.0, 2.0, 4e-3], np.diag([2.0, 2.0, 2e-3]), stiffness, force, contacts)
    position = [rng.uniform(-1e-3, 1e-3), -rng.uniform(1e-3, 3e-3), rng.uniform(-1e-2, 1e-2)]
    velocity = [rng.uniform(-0.4, 0.4), rng.uniform(-0.5, 0.5), rng.uniform(-3.0, 3.0)]
    gaps = [float(np.dot(law["n"], position)) for law in contacts]
    return scene, reference, ss.State(position, velocity, "".join("d" if gap > 0.0 else "s" for gap in gaps))
