"""Chains of any number of subsystems, and starts on the cycles of their contacts.

The chains alternate the two published subsystems. Every contact starts on the cycle that it settles to: a
chain of ten is followed until all its contacts stick and slip in turn, and longer chains are ten after ten at
random times of that motion. What does not fit at the seams makes some events early on.
"""

from __future__ import annotations

import numpy as np

import stickslip as ss

#: The published subsystems and the springs between and before them.
SUBSYSTEMS = (
    ss.models.Subsystem(
        upper_mass=0.3,
        contact_mass=0.3,
        inclination=0.3,
        vertical_stiffness=4.5e5,
        horizontal_stiffness=3e5,
        ceiling_stiffness=6e4,
        preload_displacement=1e-3,
    ),
    ss.models.Subsystem(
        upper_mass=0.7,
        contact_mass=0.7,
        inclination=0.75,
        vertical_stiffness=3e4,
        horizontal_stiffness=2.4e6,
        ceiling_stiffness=1.8e5,
        preload_displacement=1e-3,
    ),
)
LINK = ss.models.Link(horizontal_stiffness=1.5e6, vertical_stiffness=2.4e5)
WALL = 1.8e6
#: Subsystems of the chain whose motion the others start from, and from when on it is on its cycle, s.
TILE, SETTLED = 10, (0.5, 1.0)
#: Subsystems of the large chain.
LARGE = 1000


def scene_of(count: int) -> ss.Scene:
    """Return a chain of `count` subsystems."""
    parts = [SUBSYSTEMS[i % 2] for i in range(count)]
    links = [LINK] * (count - 1)
    return ss.models.chain(parts, links, wall_stiffness=WALL, friction=1.5, slider_speed=0.025)


def settled() -> ss.Trajectory:
    """Return the motion that all start from."""
    scene = scene_of(TILE)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-2})
    run = ss.simulate(scene, SETTLED[1], start, method="taylor")
    moving = np.unique(run.events.contact[run.events.time > SETTLED[0]])
    if moving.size < TILE:
        raise SystemExit(f"only {moving.size} of {TILE} contacts are on a cycle")
    return run


def on_cycles(run: ss.Trajectory, count: int, seed: int = 0) -> ss.State:
    """Return a start for `count` subsystems."""
    times = np.random.default_rng([count, seed]).uniform(*SETTLED, -(-count // TILE))
    states = [run.state(at) for at in times]
    return ss.State(
        np.concatenate([state.position for state in states])[: 4 * count],
        np.concatenate([state.velocity for state in states])[: 4 * count],
        "".join(state.combination for state in states)[:count],
    )
