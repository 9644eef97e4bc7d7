"""Random scenes under loads in time."""

import numpy as np

import stickslip as ss


def scene_of(seed, **changes):
    """A random scene of five dofs with a rough slider that vibrates, three loads, and its start."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(5, 5))
    mass = rng.uniform(0.5, 2.0, 5)
    contact = ss.Contact(
        tangential="x1",
        normal="x2",
        friction=0.3,
        static_friction=0.4,
        slider_speed=0.1,
        restitution=0.5 * (seed % 3 == 0),
        slider_vibration=ss.Harmonic(rng.uniform(0.0, 0.3), rng.uniform(1.0, 8.0), phase=1.0),
    )
    loads = [
        ss.Harmonic({"x1": 20.0 * rng.normal(), "x4": 20.0 * rng.normal()}, rng.uniform(1.0, 8.0), phase=2.0),
        ss.Harmonic(20.0 * rng.normal() * np.eye(5)[1], rng.uniform(1.0, 8.0), name="shaker"),
        ss.Switched({"x3": 10.0}, times=[0.3, 0.7], values=[0.5, 1.0, -1.0]),
    ]
    scene = ss.Scene(
        np.diag(mass) + 0.1 if seed % 2 else mass,
        1e3 * root @ root.T + 500.0 * np.eye(5),
        damping=ss.Rayleigh(0.1, 1e-3),
        force=[0.0, -60.0, 0.0, 0.0, 0.0],
        contacts=[contact],
        loads=loads,
        impact_friction=bool(seed % 2),
    ).replace(**changes)
    return scene, ss.State(ss.steady_sliding(scene).position, np.zeros(5), "+")
