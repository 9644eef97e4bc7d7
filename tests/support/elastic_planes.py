"""Random scenes with elastic slip in planes, and their motions by a general integrator of scipy.

The reference has the deflections of the springs as states, `z' = w` while a node rests, and
`z' = w - e (e . w)` with `e = z / |z|` while it slips.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import stickslip as ss


@dataclass
class Pad:
    """Friction in the plane of the dofs of one body, on a spring."""

    body: int
    normal_force: float
    friction: float
    stiffness: float
    speed: np.ndarray

    @property
    def extent(self) -> float:
        """Stretch of the spring as its node slips, m."""
        return self.friction * self.normal_force / self.stiffness


@dataclass
class ElasticScene:
    """Bodies in a plane on springs under harmonic loads."""

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    waves: list[tuple[np.ndarray, float, float]]
    pads: list[Pad]
    events: list[tuple[float, int]] = field(default_factory=list)

    def scene(self, turn: float = 0.0) -> ss.Scene:
        """Return the scene, its tangential directions turned by an angle."""
        c, s = np.cos(turn), np.sin(turn)
        contacts = []
        for pad in self.pads:
            x, y = 2 * pad.body, 2 * pad.body + 1
            along, across = ({x: c, y: s}, {x: -s, y: c}) if turn else ({x: 1.0}, {y: 1.0})
            contacts.append(
                ss.Contact(
                    tangential=(along, across),
                    normal_force=pad.normal_force,
                    friction=pad.friction,
                    tangential_stiffness=pad.stiffness,
                    slider_speed=tuple(np.array([[c, s], [-s, c]]) @ pad.speed),
                )
            )
        loads = [ss.Harmonic(size, rate / (2 * np.pi), phase=phase) for size, rate, phase in self.waves]
        return ss.Scene(self.mass, self.stiffness, damping=self.damping, contacts=contacts, loads=loads)

    def rate(self, t: float, y: np.ndarray, slips: list[bool]) -> np.ndarray:
        """Return the rate of places, velocities and deflections."""
        n = self.mass.size
        x, v, z = y[:n], y[n : 2 * n], y[2 * n :].reshape(-1, 2)
        force = -self.stiffness @ x - self.damping @ v
        for size, rate, phase in self.waves:
            force = force + size * np.cos(rate * t + phase)
        rates = []
        for pad, own, slipping in zip(self.pads, z, slips, strict=True):
            rows = slice(2 * pad.body, 2 * pad.body + 2)
            force[rows] -= pad.stiffness * own
            w = v[rows] - pad.speed
            e = own / np.hypot(*own) if slipping else np.zeros(2)
            rates.append(w - e * (e @ w))
        return np.concatenate([v, force / self.mass, *rates])

    def follow(self, start: ss.State, duration: float, early: float = 1e-5) -> np.ndarray:
        """Return the state at the end of a motion from relaxed springs, and note its events."""
        n = self.mass.size
        time, slips = 0.0, [False] * len(self.pads)
        state = np.concatenate([start.position, start.velocity, np.zeros(2 * len(self.pads))])

        def ends(k: int, t: float, y: np.ndarray) -> float:
            pad, z = self.pads[k], y[2 * n + 2 * k : 2 * n + 2 * k + 2]
            rows = slice(2 * pad.body, 2 * pad.body + 2)
            return float(z @ (y[n:][rows] - pad.speed) if slips[k] else pad.extent**2 - z @ z)

        def event(k: int) -> Any:
            value: Any = partial(ends, k)
            value.terminal, value.direction = True, -1.0
            return value

        settings = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-15}
        functions = [event(k) for k in range(len(self.pads))]
        while True:
            frozen = list(slips)

            def rate(t: float, y: np.ndarray, frozen: list[bool] = frozen) -> np.ndarray:
                return self.rate(t, y, frozen)

            # The function of the contact whose status has just changed begins at zero.
            beyond = solve_ivp(rate, (time, time + early), state, **settings)
            time, state = time + early, beyond.y[:, -1]
            found = solve_ivp(rate, (time, duration), state, events=functions, **settings)
            if found.status == 0:
                return found.y[:, -1]
            time = float(found.t[-1])
            k = next(k for k, times in enumerate(found.t_events) if times.size)
            # Steps end where they are accurate; values between them are less so.
            state = solve_ivp(rate, (found.t[0], time), found.y[:, 0], **settings).y[:, -1]
            self.events.append((time, k))
            slips[k] = not slips[k]


def random_scene(rng: np.random.Generator, equal: bool) -> tuple[ElasticScene, ss.State, float]:
    """Return a scene, a start with relaxed springs, and a duration; `equal`: a body has one mass."""
    bodies = int(rng.integers(1, 4))
    n = 2 * bodies
    mass = np.repeat(rng.uniform(0.5, 2.0, bodies), 2) if equal else rng.uniform(0.5, 2.0, n)
    root = rng.normal(size=(n, n))
    stiffness = 0.3 * root @ root.T + np.diag(rng.uniform(0.2, 2.0, n))
    damping = 0.02 * stiffness + 0.05 * np.diag(mass)
    waves = [
        (rng.normal(size=n), float(rng.uniform(0.3, 3.0)), float(rng.uniform(0.0, 6.0))) for _ in range(2)
    ]
    pads = []
    for body in range(bodies):
        if body and rng.random() < 0.3:
            continue
        speed = 0.3 * rng.normal(size=2) * (rng.random() < 0.5)
        pads.append(
            Pad(
                body,
                float(rng.uniform(0.3, 2.0)),
                float(rng.uniform(0.1, 0.8)),
                float(rng.uniform(1.0, 30.0)),
                speed,
            )
        )
    one = ElasticScene(mass, stiffness, damping, waves, pads)
    start = ss.State(0.3 * rng.normal(size=n), rng.normal(size=n), "ss" * len(pads))
    return one, start, float(rng.uniform(5.0, 12.0))
