"""Random scenes of contacts with a state, and another way to their motion: DOP853 in places and states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.scene.laws.state import BoucWen, Dahl, ElastoPlastic, LawWithState, LuGre, RateState, StateLaw

#: s
DURATION = 3.0
#: Relative tolerance of the integrator, and absolute one in parts of the largest entry.
ACCURACY, NEGLIGIBLE = 1e-13, 1e-16
#: Fewest steps of a phase.
STEPS = 300
#: Phases that it follows.
FOLLOWED = 15


def state_scene(seed: int, index: int) -> tuple[ss.Scene, ss.State]:
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
        law = drawn_law(rng)
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
    scene = ss.Scene(
        matrix,
        stiffness,
        damping=damping,
        force=rng.normal(0, 1, size),
        contacts=contacts,
        elements=drawn_elements(np.random.default_rng([seed, index, 12]), size),
    )
    velocity = rng.normal(0.0, 0.3, size)
    slips = [contact.tangential @ velocity - contact.slider_speed for contact in contacts]
    letters = "".join("-" if slip > 0.0 else "+" for slip in slips)
    return scene, ss.State(rng.normal(0.0, 0.02, size), velocity, letters)


#: LuGre's law, and a state that follows the slip velocity late, in a user's own words.
LUGRE = (
    "stiffness * z + viscous * s"
    " + damping * (s - stiffness * abs(s) * z / (kinetic + more * exp(-(s / speed)**2)))",
    "s - stiffness * abs(s) * z / (kinetic + more * exp(-(s / speed)**2))",
)
LATE = ("kinetic * tanh(z) + viscous * s", "(s / speed - z) * haste")


def drawn_law(rng: np.random.Generator) -> LawWithState:
    """Return a law with a state."""
    kinetic, stiffness = rng.uniform(0.2, 0.8), 10.0 ** rng.uniform(1.0, 4.0)
    damping = {"damping": rng.uniform(0.0, 1.0) / np.sqrt(stiffness), "viscous": rng.uniform(0.0, 0.2)}
    speed = 10.0 ** rng.uniform(-2.5, 0.0)
    match rng.choice(7):
        case 0:
            return ss.friction.Dahl(kinetic, stiffness)
        case 1:
            return ss.friction.BoucWen(kinetic, stiffness, float(rng.integers(1, 4)), rng.uniform(0.0, 1.0))
        case 2:
            return ss.friction.ElastoPlastic(kinetic, stiffness, rng.uniform(0.1, 0.9), **damping)
        case 3:
            # Rates at rest grow by exp(kinetic / direct).
            direct, evolution = kinetic * rng.uniform(0.15, 0.5, 2)
            return ss.friction.RateState(
                kinetic, direct, evolution, rng.uniform(0.01, 0.1), rng.uniform(0.05, 0.5)
            )
        case 4:
            more = kinetic * rng.uniform(0.0, 1.0)
            numbers = {"kinetic": kinetic, "more": more, "speed": speed, "stiffness": stiffness, **damping}
            return ss.friction.StateLaw(*LUGRE, **numbers)
        case 5:
            haste, viscous = 10.0 ** rng.uniform(0.0, 2.5), damping["viscous"]
            return ss.friction.StateLaw(*LATE, kinetic=kinetic, viscous=viscous, speed=speed, haste=haste)
    static = kinetic * rng.uniform(1.0, 2.0)
    return ss.friction.LuGre(static, kinetic, speed, stiffness, **damping)


def drawn_elements(rng: np.random.Generator, size: int) -> list[ss.Spring | ss.Damper]:
    """Return none, or one or two springs and dampers, each on a dof or between two."""
    found: list[ss.Spring | ss.Damper] = []
    for _ in range(int(rng.choice([0, 0, 1, 2]))):
        direction = np.zeros(size)
        first, second = rng.integers(size, size=2)
        direction[second] = -1.0
        direction[first] = 1.0
        if rng.random() < 0.4:
            drag = ss.spring.Polynomial(0.0, 0.0, 10.0 ** rng.uniform(-1.0, 2.0))
            found.append(ss.Damper(direction, drag))
            continue
        hard = ss.spring.Polynomial(rng.uniform(0.0, 50.0), 0.0, 10.0 ** rng.uniform(2.0, 6.0))
        soft = ss.spring.Law(
            "force * tanh(u / width)", force=rng.uniform(0.1, 2.0), width=10.0 ** rng.uniform(-2.0, -1.0)
        )
        found.append(ss.Spring(direction, hard if rng.random() < 0.5 else soft))
    return found


def element_forces(scene: ss.Scene, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return what springs and dampers of vectors over the dofs do."""
    load = np.zeros(scene.size)
    for one in scene.elements:
        along = np.asarray(one.direction, dtype=float)
        load -= along * one.law.force(float(along @ (x if isinstance(one, ss.Spring) else u)))
    return load


def force_and_rate(law: LawWithState) -> Callable[[float, float], tuple[float, float]]:
    """Return the function of s and z that gives -T / N and the rate of z."""
    if isinstance(law, StateLaw):
        names = law.parameters() | {name: getattr(np, name) for name in ("exp", "tanh")}
        force, rate = (eval(f"lambda s, z: {told}", dict(names)) for told in (law.force, law.rate))
        return lambda s, z: (force(s, z), rate(s, z))
    if isinstance(law, RateState):
        a, b, reference, v, length = law.direct, law.evolution, law.reference, law.speed, law.length
        return lambda s, z: (
            a * np.arcsinh(s / (2.0 * v) * np.exp((reference + b * z) / a)),
            (v * np.exp(-z) - abs(s)) / length,
        )
    assert isinstance(law, BoucWen | Dahl | ElastoPlastic | LuGre)
    stiffness, kinetic = law.stiffness, law.kinetic

    def loss(s: float, z: float) -> float:
        bent, sign = stiffness * z / kinetic, np.sign(s)
        match law:
            case LuGre(static=static, speed=speed):
                return abs(s) * stiffness * z / (kinetic + (static - kinetic) * np.exp(-((s / speed) ** 2)))
            case BoucWen(exponent=exponent, share=share):
                return abs(s) * abs(bent) ** exponent * (share * np.sign(z) + (1.0 - share) * sign)
            case ElastoPlastic(break_away=break_away):
                part = (bent * sign - break_away) / (1.0 - break_away)
                if part >= 1.0:
                    return abs(s) * bent
                # The cubic of Hermite from (0, slope 0) to (1, slope 1 - break_away).
                width = 1.0 - break_away
                return s * ((3.0 - width) * part**2 + (width - 2.0) * part**3 if part > 0.0 else 0.0)
        return abs(s) * bent

    damping, viscous = getattr(law, "damping", 0.0), getattr(law, "viscous", 0.0)

    def both(s: float, z: float) -> tuple[float, float]:
        rate = s - loss(s, z)
        return stiffness * z + damping * rate + viscous * s, rate

    return both


class StateEquations:
    """``M x'' = F - K x - C x' + sum t T`` and z' as the laws have it, for the vector (x, x', z)."""

    def __init__(self, scene: ss.Scene) -> None:
        def dense(matrix: object) -> np.ndarray:
            return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix, dtype=float)

        self.size, self.scene = scene.size, scene
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
        self.laws = [force_and_rate(contact.friction) for contact in contacts]

    def slips(self, y: np.ndarray) -> np.ndarray:
        """Return the slip velocities."""
        return self.directions @ y[self.size : 2 * self.size] - self.speeds

    def rate(self, _: float, y: np.ndarray) -> np.ndarray:
        """Return (x', x'', z')."""
        x, u, z = np.split(y, [self.size, 2 * self.size])
        found = [
            law(*given) for law, given in zip(self.laws, zip(self.slips(y), z, strict=True), strict=True)
        ]
        force, rate = np.array(found).T
        load = self.force - self.stiffness @ x - self.damping @ u + element_forces(self.scene, x, u)
        load -= self.directions.T @ (self.pressed * force)
        return np.concatenate([u, self.inverse @ load, rate])

    def state(self, state: ss.State) -> np.ndarray:
        """Return (x, x', z) of a state."""
        assert state.internal is not None
        return np.concatenate([state.position, state.velocity, state.internal])


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
    equations = StateEquations(scene)
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


def report(
    scene_of: Callable[[int, int], tuple[ss.Scene, ss.State]], follow: Callable[..., Followed]
) -> None:
    """Follow scenes 0 to N - 1 of a seed, both from the command line; print the worst."""
    import sys

    count, seed = (int(one) for one in sys.argv[1:3])
    worst, events = Followed(0, 0.0, 0.0, 0, 0.0), 0
    for index in range(count):
        found = follow(*scene_of(seed, index))
        events += found.events
        for name in ("state", "time", "missed", "energy"):
            setattr(worst, name, max(getattr(worst, name), getattr(found, name)))
        if found.state > 1e-9 or found.time > 1e-10 or found.missed or found.energy > 1e-11:
            print(index, found, flush=True)
    print(f"{count} scenes, {events} events, worst {worst}")


if __name__ == "__main__":
    report(state_scene, followed)
