"""Random scenes with springs in planes that lift, and their motions by a general integrator of scipy.

The reference has the deflections z of the springs as states: `z' = w` while a node rests, and
`z' = w - e (e . w - r')` with `e = z / |z|` and `r = mu N / k` while it slips.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss

#: Rate at which the reference takes `|z|` back to r, 1/s, and relative differences of both that are rounding.
ATTRACTION, ROUNDING = 50.0, 1e-9
#: Steps of the reference, and the time after an event over which its function is not looked at, s.
SETTINGS = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
EARLY = 1e-6


@dataclass
class Pad:
    """A contact of one body, whose dofs are x, y and z."""

    body: int
    friction: float
    stiffness: float
    speed: np.ndarray

    @property
    def normal(self) -> int:
        """Dof along the normal direction."""
        return 3 * self.body + 2

    @property
    def plane(self) -> slice:
        """Dofs in the plane."""
        return slice(3 * self.body, 3 * self.body + 2)


@dataclass
class LiftingScene:
    """Bodies in space on springs under constant and harmonic loads, which close and open their contacts."""

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    force: np.ndarray
    waves: list[tuple[np.ndarray, float, float]]
    pads: list[Pad]
    events: list[tuple[float, int, str]] = field(default_factory=list)

    def scene(self, turn: float = 0.0) -> ss.Scene:
        """Return the scene, its tangential directions turned by an angle."""
        c, s = np.cos(turn), np.sin(turn)
        contacts = []
        for pad in self.pads:
            x, y = 3 * pad.body, 3 * pad.body + 1
            along, across = ({x: c, y: s}, {x: -s, y: c}) if turn else ({x: 1.0}, {y: 1.0})
            contacts.append(
                ss.Contact(
                    tangential=(along, across),
                    normal={pad.normal: 1.0},
                    friction=pad.friction,
                    tangential_stiffness=pad.stiffness,
                    slider_speed=tuple(np.array([[c, s], [-s, c]]) @ pad.speed),
                )
            )
        loads = [ss.Harmonic(size, rate / (2 * np.pi), phase=phase) for size, rate, phase in self.waves]
        return ss.Scene(
            self.mass,
            self.stiffness,
            damping=self.damping,
            force=self.force,
            contacts=contacts,
            loads=loads,
        )

    def accelerations(self, t: float, y: np.ndarray, letters: list[str]) -> list[np.ndarray]:
        """Return accelerations, and the reactions of all dofs and their rates where these are held."""
        n = self.mass.size
        x, v, z = y[:n], y[n : 2 * n], y[2 * n :].reshape(-1, 2)
        load = self.force - self.stiffness @ x - self.damping @ v
        rate = -self.stiffness @ v
        for size, speed, phase in self.waves:
            load = load + size * np.cos(speed * t + phase)
            rate = rate - size * speed * np.sin(speed * t + phase)
        force = load.copy()
        for pad, own, letter in zip(self.pads, z, letters, strict=True):
            if letter != "d":
                force[pad.plane] -= pad.stiffness * own
                force[pad.normal] = 0.0
        accelerations = force / self.mass
        return [accelerations, -load, self.damping @ accelerations - rate]

    def limit(self, k: int, t: float, y: np.ndarray, letters: list[str]) -> np.ndarray:
        """Return r and r' of a contact."""
        pad = self.pads[k]
        _, forces, rates = self.accelerations(t, y, letters)
        return pad.friction / pad.stiffness * np.array([forces[pad.normal], rates[pad.normal]])

    def bent(self, k: int, y: np.ndarray) -> list[np.ndarray]:
        """Return the deflection of a spring, as a view, and the velocity of its body over the slider."""
        n, pad = self.mass.size, self.pads[k]
        place = 2 * n + 2 * k
        return [y[place : place + 2], y[n : 2 * n][pad.plane] - pad.speed]

    def rate(self, t: float, y: np.ndarray, letters: list[str]) -> np.ndarray:
        """Return the rate of places, velocities and deflections."""
        n = self.mass.size
        accelerations = self.accelerations(t, y, letters)[0]
        velocities = y[n : 2 * n].copy()
        deflections = []
        for k, (pad, letter) in enumerate(zip(self.pads, letters, strict=True)):
            z, w = self.bent(k, y)
            if letter != "d":
                velocities[pad.normal] = 0.0
            if letter == "o":
                r, faster = self.limit(k, t, y, letters)
                length = np.hypot(*z)
                e = z / length
                w = w - e * (e @ w - faster + ATTRACTION * (length - r))
            deflections.append(w if letter != "d" else np.zeros(2))
        return np.concatenate([velocities, accelerations, *deflections])

    def value(self, t: float, y: np.ndarray, letters: list[str], k: int, kind: str) -> float:
        """Return an event function, positive while its contact is as it is."""
        if kind == "impact":
            return float(y[self.pads[k].normal])
        r, faster = self.limit(k, t, y, letters)
        z, w = self.bent(k, y)
        of_kind = {"release": r, "slip": r * r - z @ z, "velocity": z @ w - r * faster}
        return float(of_kind[kind])

    def settle(self, k: int, kind: str, t: float, y: np.ndarray, letters: list[str]) -> None:
        """Take a state and the letters through an event, in place; impacts are plastic."""
        n, pad = self.mass.size, self.pads[k]
        letters[k] = {"release": "d", "slip": "o", "velocity": "s", "impact": "s"}[kind]
        if kind in ("release", "impact"):
            y[pad.normal] = y[n + pad.normal] = 0.0
            self.bent(k, y)[0][:] = 0.0
        if kind != "impact":
            return
        # The damping feels the impact, and with it the other normal forces.
        for other in range(len(self.pads)):
            if letters[other] == "d" or other == k:
                continue
            r, faster = self.limit(other, t, y, letters)
            z, w = self.bent(other, y)
            length = np.hypot(*z)
            if r < 0.0:
                letters[other] = "d"
                z[:] = 0.0
            elif length > r * (1.0 + ROUNDING):
                z *= r / length
                letters[other] = "o" if z @ w > r * faster else "s"
            elif length < r * (1.0 - ROUNDING) or (letters[other] == "o" and z @ w < r * faster):
                letters[other] = "s"

    def follow(self, start: ss.State, duration: float) -> np.ndarray:
        """Return the state at the end of a motion from relaxed springs, and note its events."""
        n = self.mass.size
        time, letters = 0.0, list(start.combination[::2])
        state = np.concatenate([start.position, start.velocity, np.zeros(2 * len(self.pads))])
        while True:
            frozen = list(letters)
            rate = partial(self.rate, letters=frozen)
            ends = {"d": ["impact"], "s": ["release", "slip"], "o": ["release", "velocity"]}
            kinds = [(k, kind) for k, letter in enumerate(frozen) for kind in ends[letter]]

            def event(k: int, kind: str, frozen: list[str] = frozen) -> Any:
                value: Any = partial(self.value, letters=frozen, k=k, kind=kind)
                value.terminal, value.direction = True, -1.0
                return value

            beyond = solve_ivp(rate, (time, time + EARLY), state, **SETTINGS)
            time, state = time + EARLY, beyond.y[:, -1]
            functions = [event(k, kind) for k, kind in kinds]
            found = solve_ivp(rate, (time, duration), state, events=functions, **SETTINGS)
            if found.status == 0:
                return found.y[: 2 * n, -1]
            time = float(found.t[-1])
            k, kind = next(kinds[i] for i, times in enumerate(found.t_events) if times.size)
            state = solve_ivp(rate, (found.t[0], time), found.y[:, 0], **SETTINGS).y[:, -1]
            self.events.append((time, k, kind))
            self.settle(k, kind, time, state, letters)


def random_lifting_scene(rng: np.random.Generator) -> tuple[LiftingScene, ss.State, float]:
    """Return a scene whose contacts are open at first, its start, and a duration."""
    bodies = int(rng.integers(1, 3))
    n = 3 * bodies
    mass = np.repeat(rng.uniform(0.5, 2.0, bodies), 3)
    root = rng.normal(size=(n, n))
    stiffness = 0.3 * root @ root.T + np.diag(rng.uniform(1.0, 10.0, n))
    damping = [0.02 * np.diag(mass), 0.03 * stiffness, 0.02 * root @ root.T][rng.integers(3)]
    force = np.zeros(n)
    force[2::3] = -rng.uniform(0.5, 4.0, bodies)
    waves = [
        (
            rng.normal(size=n) * rng.uniform(0.3, 1.5),
            float(rng.uniform(0.5, 4.0)),
            float(rng.uniform(0.0, 6.0)),
        )
        for _ in range(2)
    ]
    pads = []
    for body in range(bodies):
        speed = 0.3 * rng.normal(size=2) * (rng.random() < 0.6)
        pads.append(Pad(body, float(rng.uniform(0.1, 0.8)), float(rng.uniform(3.0, 40.0)), speed))
    position, velocity = 0.2 * rng.normal(size=n), 0.5 * rng.normal(size=n)
    position[2::3] = 0.3 * np.abs(position[2::3]) + 0.05
    one = LiftingScene(mass, stiffness, damping, force, waves, pads)
    return one, ss.State(position, velocity, "dd" * bodies), float(rng.uniform(4.0, 9.0))
