"""Scenes twice, tied to each other by springs: both halves move as one of them does alone.

All events come in pairs then, of one instant. Springs between equal displacements carry no force, so the
motion of the half is the reference of both.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

import stickslip as ss
from fuzz_events import Comparison, compare, limits_of, sensitivity
from fuzz_terms import matrices

Direction = int | Mapping[int, float] | None


def doubled(scene: ss.Scene, start: ss.State, seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return a scene of two equal halves, tied by upper masses, and a state in which both are alike."""
    rng = np.random.default_rng([seed, index, 8])
    ties = np.zeros(scene.size)
    ties[[0, *np.flatnonzero(rng.random(scene.size // 4) < 0.5) * 4]] = 10.0 ** rng.uniform(4.0, 6.0)
    tie, stiffness = np.diag(ties), matrices(scene)[2]

    def moved(direction: Direction) -> Any:
        if direction is None or isinstance(direction, int):
            return direction if direction is None else direction + scene.size
        return {dof + scene.size: entry for dof, entry in direction.items()}

    second = [
        dataclasses.replace(contact, tangential=moved(contact.tangential), normal=moved(contact.normal))
        for contact in scene.contacts
    ]
    both = ss.Scene(
        np.tile(scene.mass, 2) if scene.mass.ndim == 1 else block_diag(scene.mass, scene.mass),
        np.block([[stiffness + tie, -tie], [-tie, stiffness + tie]]),
        damping=scene.damping,
        force=np.tile(scene.force, 2),
        contacts=[*scene.contacts, *second],
        impact_friction=scene.impact_friction,
    )
    return both, pair(start, start)


def pair(first: ss.State, second: ss.State) -> ss.State:
    """Return the state of two halves."""
    return ss.State(
        np.append(first.position, second.position),
        np.append(first.velocity, second.velocity),
        first.combination + second.combination,
    )


class Half:
    """One half of a run of two: what the comparison of events reads of a run."""

    def __init__(self, run: ss.Trajectory, scene: ss.Scene, which: int) -> None:
        self.run, self.scene, self.which = run, scene, which
        self.duration, self.stop_reason = run.duration, run.stop_reason
        count = len(scene.contacts)
        self.own = slice(which * count, (which + 1) * count)
        rows = run.events.contact // count == which
        self.events = SimpleNamespace(
            time=run.events.time[rows],
            contact=run.events.contact[rows] - which * count,
            kind=run.events.kind[rows],
            combination=np.array([letters[self.own] for letters in run.events.combination[rows]], dtype=str),
        )
        self.grazings = [
            SimpleNamespace(time=g.time, contact=g.contact - which * count, alternative=g.alternative)
            for g in run.grazings
            if g.contact // count == which
        ]
        self.start = self.state(0.0)

    def state(self, time: float) -> ss.State:
        """Return the state of this half."""
        state, size = self.run.state(time), self.scene.size
        dofs = slice(self.which * size, (self.which + 1) * size)
        return ss.State(state.position[dofs], state.velocity[dofs], state.combination[self.own])


def compare_halves(
    alone: ss.Trajectory, run: ss.Trajectory, follow: Callable[[ss.State, float, float], ss.Trajectory]
) -> list[Comparison]:
    """Return how the events of each half of a run differ from those of a scene alone.

    One half is nudged beside the other one: so what sets halves apart, which may grow, counts as well.
    """
    halves: list[Any] = [Half(run, alone.scene, which) for which in (0, 1)]

    def moved(which: int, directions: int) -> tuple[np.ndarray, np.ndarray]:
        def beside(state: ss.State, duration: float, begin: float) -> Any:
            other = halves[1 - which].state(begin)
            both = pair(state, other) if which == 0 else pair(other, state)
            return Half(follow(both, duration, begin), alone.scene, which)

        effect = sensitivity(halves[which], beside, directions, limits_of(alone))
        return effect, effect

    return [
        compare(halves[which], alone, lambda directions, which=which: moved(which, directions))
        for which in (0, 1)
    ]
