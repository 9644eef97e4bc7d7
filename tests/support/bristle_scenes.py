"""Random scenes with bristles, and another way to their motion: DOP853 in displacements and deflections."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.scene.laws.friction import BoucWen, Dahl, LuGre

#: s
DURATION = 3.0
#: Relative tolerance of the integrator, and absolute one in parts of the largest entry.
ACCURACY, NEGLIGIBLE = 1e-13, 1e-16
#: Fewest steps of a phase.
STEPS = 300
#: Phases that it follows.
FOLLOWED = 40


def bristle_scene(seed: int, index: int) -> tuple[ss.Scene, ss.State]:
    """Return one to five masses in a row with contacts under given normal forces, and a start."""
    rng = np.random.default_rng([seed, index, 11])
    size = int(rng.integers(1, 6))
    springs = rng.uniform(50.0, 500.0, size + 1)
    stiffness = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    mass = rng.uniform(0.5, 2.0, size)
    contacts = []
    for dof in rng.permutation(size)[: rng.integers(1, 4)]:
        direction = np.zeros(size)
        direction[dof] = 1.0
        if size > 1 and rng.random() < 0.3:
            direction[(dof + 1) % size] = rng.uniform(-0.5, 0.5)
        kinetic, stiff = rng.uniform(0.2, 0.8), 10.0 ** rng.uniform(1.0, 4.0)
        law: BoucWen | Dahl | LuGre = ss.friction.Dahl(kinetic, stiff)
        kind = rng.random()
        if kind > 0.75:
            law = ss.friction.BoucWen(kinetic, stiff, float(rng.integers(1, 4)), rng.uniform(0.0, 1.0))
        elif kind < 0.6:
            law = ss.friction.LuGre(
                static=kinetic * rng.uniform(1.0, 2.0),
                kinetic=kinetic,
                speed=10.0 ** rng.uniform(-2.5, 0.0),
                stiffness=stiff,
                damping=rng.uniform(0.0, 1.0) / np.sqrt(stiff),
                viscous=rng.uniform(0.0, 0.2),
            )
        speed = rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 0.3)
        contacts.append(
            ss.Contact(
                tangential=direction,
                normal_force=rng.uniform(1.0, 10.0),
                friction=law,
                slider_speed=speed if rng.random() < 0.8 else 0.0,
            )
        )
    damping = ss.Rayleigh(mass=0.1, stiffness=1e-4) if rng.random() < 0.5 else None
    # Consistent masses couple neighbours.
    matrix = np.diag(mass) + 0.1 * (np.eye(size, k=1) + np.eye(size, k=-1)) if rng.random() < 0.3 else mass
    scene = ss.Scene(matrix, stiffness, damping=damping, force=rng.normal(0, 1, size), contacts=contacts)
    velocity = rng.normal(0.0, 0.3, size)
    slips = [contact.tangential @ velocity - contact.slider_speed for contact in contacts]
    letters = "".join("-" if slip > 0.0 else "+" for slip in slips)
    return scene, ss.State(rng.normal(0.0, 0.02, size), velocity, letters)


class BristleEquations:
    """``M x'' = F - K x - C x' + sum t T`` and z' as the laws have it, for the vector (x, x', z)."""

    def __init__(self, scene: ss.Scene) -> None:
        def dense(matrix: object) -> np.ndarray:
            return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix, dtype=float)

        self.size = scene.size
        mass = dense(scene.mass)
        self.mass = np.diag(mass) if mass.ndim == 1 else mass
        self.stiffness = dense(scene.stiffness)
        rayleigh = scene.damping or ss.Rayleigh()
        self.damping = rayleigh.mass * self.mass + rayleigh.stiffness * self.stiffness
        self.inverse = np.linalg.inv(self.mass)
        self.force = np.asarray(scene.force, dtype=float)
        contacts = scene.contacts
        self.directions = np.array([contact.tangential for contact in contacts])
        self.speeds = np.array([contact.slider_speed for contact in contacts])
        self.pressed = np.array([contact.normal_force for contact in contacts])
        laws = [contact.friction for contact in contacts]
        self.bristles = np.array([law.stiffness for law in laws])
        self.kinetic = np.array([law.kinetic for law in laws])
        self.static = np.array([getattr(law, "static", law.kinetic) for law in laws])
        self.scale = np.array([getattr(law, "speed", 1.0) for law in laws])
        self.dampers = np.array([getattr(law, "damping", 0.0) for law in laws])
        self.viscous = np.array([getattr(law, "viscous", 0.0) for law in laws])
        self.loops = np.array([isinstance(law, BoucWen) for law in laws])
        self.exponents = np.array([getattr(law, "exponent", 1.0) for law in laws])
        self.shares = np.array([getattr(law, "share", 1.0) for law in laws])

    def slips(self, y: np.ndarray) -> np.ndarray:
        """Return the slip velocities."""
        return self.directions @ y[self.size : 2 * self.size] - self.speeds

    def rate(self, _: float, y: np.ndarray) -> np.ndarray:
        """Return (x', x'', z')."""
        x, u, z = np.split(y, [self.size, 2 * self.size])
        s = self.slips(y)
        level = self.kinetic + (self.static - self.kinetic) * np.exp(-((s / self.scale) ** 2))
        bent = self.bristles * z / level
        turned = self.shares * np.sign(z) + (1.0 - self.shares) * np.sign(s)
        loss = np.where(self.loops, np.abs(bent) ** self.exponents * turned, bent)
        rate = s - np.abs(s) * loss
        friction = -self.pressed * (self.bristles * z + self.dampers * rate + self.viscous * s)
        load = self.force - self.stiffness @ x - self.damping @ u + self.directions.T @ friction
        return np.concatenate([u, self.inverse @ load, rate])

    def state(self, state: ss.State) -> np.ndarray:
        """Return (x, x', z) of a state."""
        assert state.friction_force is not None
        z = -state.friction_force / (self.pressed * self.bristles)
        return np.concatenate([state.position, state.velocity, z])


@dataclass
class Followed:
    """How far the integrator ends from the program: states relative to their largest entry, and times."""

    events: int
    state: float
    #: Slip velocity at the events over its rate, s.
    time: float
    #: Phases in which the integrator sees slip turn.
    missed: int
    energy: float


def followed(scene: ss.Scene, start: ss.State) -> Followed:
    """Follow the phases of a motion, each from its start."""
    run = ss.simulate(scene, DURATION, start)
    equations = BristleEquations(scene)
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    result = Followed(len(run.events), 0.0, 0.0, 0, 0.0)
    for k in range(min(len(edges) - 1, FOLLOWED)):
        begin, end = float(edges[k]), float(edges[k + 1])
        if not end > begin:
            continue
        first, last = equations.state(run.state(begin)), equations.state(run.state(end))
        parts = np.split(np.abs(np.stack([first, last])), [scene.size, 2 * scene.size], axis=1)
        largest = np.concatenate([np.full(part.shape[1], part.max()) for part in parts])
        absolute = NEGLIGIBLE * np.maximum(largest, 1e-9 * largest.max())
        # Longer steps pass over a narrow peak of friction about rest.
        path = solve_ivp(
            equations.rate,
            (begin, end),
            first,
            method="DOP853",
            rtol=ACCURACY,
            atol=absolute,
            max_step=(end - begin) / STEPS,
        )
        assert path.status == 0, path.message
        reached = path.y[:, -1]
        # Velocities may vanish at both ends.
        parts = np.split(np.abs(path.y), [scene.size, 2 * scene.size])
        sizes = np.concatenate([np.full(len(part), part.max()) for part in parts])
        result.state = max(result.state, float(np.max(np.abs(reached - last) / sizes)))
        letters = run.start.combination if k == 0 else run.events.combination[k - 1]
        signs = np.array([1.0 if letter == "-" else -1.0 for letter in letters])
        slips = signs[:, None] * np.array([equations.slips(y) for y in path.y.T]).T
        scale = np.abs(slips).max() + np.abs(equations.speeds).max()
        result.missed += int((slips < -1e-10 * scale).any())
        if k < len(run.events):
            contact = int(run.events.contact[k])
            rate = equations.directions[contact] @ equations.rate(end, reached)[scene.size : 2 * scene.size]
            result.time = max(result.time, abs(float(equations.slips(reached)[contact] / rate)))
    balance = run.balance()
    result.energy = abs(balance.residual) / (balance.turnover or 1.0)
    return result


def main() -> None:
    """Follow scenes 0 to N - 1 of a seed."""
    import sys

    count, seed = (int(one) for one in sys.argv[1:3])
    worst, events = Followed(0, 0.0, 0.0, 0, 0.0), 0
    for index in range(count):
        found = followed(*bristle_scene(seed, index))
        events += found.events
        for name in ("state", "time", "missed", "energy"):
            setattr(worst, name, max(getattr(worst, name), getattr(found, name)))
        if found.state > 1e-9 or found.time > 1e-10 or found.missed or found.energy > 1e-11:
            print(index, found, flush=True)
    print(f"{count} scenes, {events} events, worst {worst}")


if __name__ == "__main__":
    main()
