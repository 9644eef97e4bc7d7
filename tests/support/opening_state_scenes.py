"""Random scenes of contacts with a state under normal forces that change, and another way to their motion."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss
from state_scenes import (
    ACCURACY,
    FOLLOWED,
    NEGLIGIBLE,
    STEPS,
    Followed,
    drawn_elements,
    drawn_law,
    element_forces,
    force_and_rate,
    report,
)

#: s
DURATION = 2.0
#: Parts of the terms of a gap, a slip velocity or a normal force that may have the wrong sign.
SIDE = 1e-9


def opening_scene(seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return one to three masses with two dofs each, pressed on sliders by changing loads, and a start."""
    rng = np.random.default_rng([seed, index, 41])
    count = int(rng.integers(1, 4))
    size = 2 * count
    dofs = [f"{axis}{k + 1}" for k in range(count) for axis in "xy"]
    root = rng.normal(0.0, 4.0, (size, size))
    stiffness = root @ root.T + np.diag(rng.uniform(50.0, 400.0, size))
    damping = np.diag(rng.uniform(0.1, 2.0, size))
    contacts, force = [], np.zeros(size)
    for k in range(count):
        speed = rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.3)
        compliant = rng.random() < 0.3
        contacts.append(
            ss.Contact(
                tangential=dofs[2 * k],
                normal=dofs[2 * k + 1],
                friction=drawn_law(rng),
                slider_speed=speed if rng.random() < 0.8 else 0.0,
                restitution=0.0 if compliant else rng.choice([0.0, 0.5]),
                gap=0.0 if rng.random() < 0.5 else rng.uniform(-0.01, 0.0),
                normal_stiffness=rng.uniform(500.0, 5000.0) if compliant else None,
            )
        )
        force[2 * k + 1] = -rng.uniform(1.0, 8.0)
    loads = []
    if rng.random() < 0.7:
        push = {dofs[1]: rng.uniform(1.0, 9.0), dofs[0]: rng.uniform(-2.0, 2.0)}
        loads.append(ss.Harmonic(push, frequency=rng.uniform(0.5, 4.0), name="shaker"))
    scene = ss.Scene(
        rng.uniform(0.5, 2.0, size),
        stiffness,
        damping=damping,
        force=force,
        contacts=contacts,
        dofs=dofs,
        loads=loads,
        elements=drawn_elements(np.random.default_rng([seed, index, 42]), size),
    )
    position, velocity = rng.normal(0.0, 0.02, size), rng.normal(0.0, 0.3, size)
    # All begin open, and fall.
    for k, contact in enumerate(contacts):
        position[2 * k + 1] = 0.01 * rng.random() - contact.gap
        velocity[2 * k + 1] = -abs(velocity[2 * k + 1])
    return scene, ss.State(position, velocity, "d" * count, dofs)


class OpeningEquations:
    """``M x'' = F(t) - K x - C x' + sum n N + t T`` for the vector (x, x', z), with ``T = -N force(s, z)``.

    A closed rigid contact holds its normal dof, with N as the reaction; a closed compliant one has
    ``N = -k (y + gap)``. An open contact has neither force nor state.
    """

    def __init__(self, scene: ss.Scene) -> None:
        self.size, self.contacts, self.scene = scene.size, scene.contacts, scene
        self.mass = np.asarray(scene.mass, dtype=float)
        self.stiffness, self.damping = np.asarray(scene.stiffness), np.asarray(scene.damping)
        self.force, self.loads, self.dofs = np.asarray(scene.force), scene.loads, list(scene.dofs)
        self.slip_dofs = [self.dofs.index(contact.tangential) for contact in scene.contacts]
        self.gap_dofs = [self.dofs.index(contact.normal) for contact in scene.contacts]
        self.laws = [force_and_rate(contact.friction) for contact in scene.contacts]

    def slips(self, y: np.ndarray) -> np.ndarray:
        """Return the slip velocities."""
        return y[self.size : 2 * self.size][self.slip_dofs] - [one.slider_speed for one in self.contacts]

    def gaps(self, y: np.ndarray) -> np.ndarray:
        """Return the gaps of the dofs."""
        return y[: self.size][self.gap_dofs] + [one.gap for one in self.contacts]

    def load(self, time: float, y: np.ndarray) -> np.ndarray:
        """Return what acts on the dofs without contacts."""
        x, u = y[: self.size], y[self.size : 2 * self.size]
        load = self.force - self.stiffness @ x - self.damping @ u + element_forces(self.scene, x, u)
        for one in self.loads:
            for dof, amplitude in one.amplitude.items():
                load[self.dofs.index(dof)] += amplitude * np.cos(2.0 * np.pi * one.frequency * time)
        return load

    def normal_forces(self, time: float, y: np.ndarray, letters: str) -> np.ndarray:
        """Return the normal forces, 0 of open contacts."""
        load, gaps = self.load(time, y), self.gaps(y)
        found = np.zeros(len(letters))
        for k, (letter, contact) in enumerate(zip(letters, self.contacts, strict=True)):
            if letter == "d":
                continue
            stiffness = contact.normal_stiffness
            found[k] = -load[self.gap_dofs[k]] if stiffness is None else -stiffness * gaps[k]
        return found

    def rate(self, time: float, y: np.ndarray, letters: str) -> np.ndarray:
        """Return (x', x'', z')."""
        u, z = y[self.size : 2 * self.size], y[2 * self.size :]
        load, slips = self.load(time, y), self.slips(y)
        rates = np.zeros_like(z)
        for k, pressed in enumerate(self.normal_forces(time, y, letters)):
            if letters[k] == "d":
                continue
            force, rates[k] = self.laws[k](slips[k], z[k])
            load[self.slip_dofs[k]] -= pressed * force
            load[self.gap_dofs[k]] += pressed
        return np.concatenate([u, load / self.mass, rates])

    def state(self, state: ss.State) -> np.ndarray:
        """Return (x, x', z) of a state."""
        assert state.internal is not None
        return np.concatenate([state.position, state.velocity, state.internal])


def followed_openings(scene: ss.Scene, start: ss.State) -> Followed:
    """Follow the phases of a motion, each from its start, and what its events do to velocity and state."""
    run = ss.simulate(scene, DURATION, start)
    equations, n = OpeningEquations(scene), scene.size
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    result = Followed(len(run.events), 0.0, 0.0, 0, 0.0)
    for k in range(min(len(edges) - 1, FOLLOWED)):
        begin, end = float(edges[k]), float(edges[k + 1])
        letters = run.start.combination if k == 0 else run.events.combination[k - 1]
        if not end > begin:
            continue
        first, after = equations.state(run.state(begin)), equations.state(run.state(end))
        largest = np.maximum(np.abs(first), np.abs(after))
        path = solve_ivp(
            partial(equations.rate, letters=letters),
            (begin, end),
            first,
            method="DOP853",
            rtol=ACCURACY,
            atol=NEGLIGIBLE * np.maximum(largest, 1e-9 * largest.max()),
            max_step=(end - begin) / STEPS,
        )
        assert path.status == 0, path.message
        reached = path.y[:, -1].copy()
        if k < len(run.events):
            contact, kind = int(run.events.contact[k]), run.events.kind[k]
            later = run.events.combination[k]
            if kind == "impact":
                place = n + equations.gap_dofs[contact]
                reached[place] *= -scene.contacts[contact].restitution
            for one, letter in enumerate(later):
                if letter == "d":
                    reached[2 * n + one] = 0.0
                elif scene.contacts[one].normal_stiffness is None:
                    reached[n + equations.gap_dofs[one]] = 0.0
        parts = np.split(np.abs(path.y), [n, 2 * n])
        sizes = np.concatenate([np.full(len(part), max(part.max(), 1e-12)) for part in parts])
        result.state = max(result.state, float(np.max(np.abs(reached - after) / sizes)))
        signs = {"-": 1.0, "+": -1.0, "d": 0.0}
        inner = list(zip(path.t, path.y.T, strict=True))[1:-1]
        for time, y in inner:
            slips, gaps = equations.slips(y), equations.gaps(y)
            forces = equations.normal_forces(time, y, letters)
            for one, letter in enumerate(letters):
                wrong = signs[letter] * slips[one] < -SIDE or (letter != "d" and forces[one] < -SIDE)
                result.missed += int(wrong or (letter == "d" and gaps[one] < -SIDE))
    balance = run.balance()
    result.energy = abs(balance.residual) / (balance.turnover or 1.0)
    return result


if __name__ == "__main__":
    report(opening_scene, followed_openings)
