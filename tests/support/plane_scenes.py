"""Random scenes with friction in planes, and their motions by general integrators of scipy.

`python tests/support/plane_scenes.py N SEED` compares N of them. The reference follows slip in `w / |w|` as
it stands: by DOP853, near the end of a slip until the forces on the contact are constant to rounding, and
where slip begins without a drop of friction (`|R| = mu N`) by Radau after a start of the third order in time.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss

#: Speed below which the reference ends a slip in closed form, and time over which slip begins in closed form.
SLOW, EARLY = 1e-8, 1e-3


@dataclass
class PlaneScene:
    """Masses in the plane on springs, each with friction in the plane or without; all loads are harmonic."""

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    force: np.ndarray
    wave: tuple[np.ndarray, float, float]
    friction: list[tuple[int, float, float, float, tuple[float, float]]]

    def scene(self, turn: float = 0.0) -> ss.Scene:
        """Return the scene, its tangential directions turned by an angle."""
        c, s = np.cos(turn), np.sin(turn)
        contacts = []
        for body, normal_force, kinetic, static, speed in self.friction:
            x, y = 2 * body, 2 * body + 1
            along, across = ({x: c, y: s}, {x: -s, y: c}) if turn else ({x: 1.0}, {y: 1.0})
            turned = (c * speed[0] + s * speed[1], -s * speed[0] + c * speed[1])
            contacts.append(
                ss.Contact(
                    tangential=(along, across),
                    normal_force=normal_force,
                    friction=kinetic,
                    static_friction=static,
                    slider_speed=turned,
                )
            )
        amplitude, frequency, phase = self.wave
        return ss.Scene(
            mass=self.mass,
            stiffness=self.stiffness,
            damping=self.damping,
            force=self.force,
            contacts=contacts,
            loads=[ss.Harmonic(amplitude, frequency / (2 * np.pi), phase=phase)],
        )


def random_scene(rng: np.random.Generator) -> tuple[PlaneScene, ss.State, float]:
    """Return a scene, a start and a duration; both directions of a body have one mass."""
    bodies = int(rng.integers(1, 5))
    n = 2 * bodies
    mass = np.repeat(rng.uniform(0.5, 2.0, bodies), 2)
    root = rng.normal(size=(n, n))
    stiffness = 0.3 * root @ root.T + np.diag(rng.uniform(0.2, 2.0, n))
    damping = 0.02 * stiffness + 0.05 * np.diag(mass)
    force = 0.3 * rng.normal(size=n)
    wave = (rng.normal(size=n), float(rng.uniform(0.3, 2.0)), float(rng.uniform(0, 6)))
    friction = []
    for body in range(bodies):
        if body and rng.random() < 0.3:
            continue
        kinetic = float(rng.uniform(0.1, 0.8))
        static = kinetic * float(rng.choice([1.0, 1.0, 1.3]))
        moves = rng.random() < 0.6
        speed = tuple(float(v) for v in 0.5 * rng.normal(size=2)) if moves else (0.0, 0.0)
        friction.append((body, float(rng.uniform(0.3, 2.0)), kinetic, static, speed))
    one = PlaneScene(mass, stiffness, damping, force, wave, friction)
    velocity = rng.normal(size=n)
    start = ss.State(0.3 * rng.normal(size=n), velocity, "oo" * len(friction))
    return one, start, float(rng.uniform(5.0, 15.0))


class Reference:
    """A motion by general integrators."""

    def __init__(self, given: PlaneScene, start: ss.State) -> None:
        self.given, self.n = given, len(given.mass)
        self.slips = [letter == "o" for letter in start.combination[::2]]
        self.time = 0.0
        self.state = np.concatenate([start.position, start.velocity])
        self.events: list[tuple[float, int, str]] = []

    def reaction(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the forces without friction."""
        x, v = y[: self.n], y[self.n :]
        amplitude, rate, phase = self.given.wave
        load = self.given.force + amplitude * np.cos(rate * t + phase)
        return load - self.given.stiffness @ x - self.given.damping @ v

    def slip(self, k: int, y: np.ndarray) -> np.ndarray:
        body, speed = self.given.friction[k][0], self.given.friction[k][4]
        return y[self.n + 2 * body : self.n + 2 * body + 2] - speed

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        force = self.reaction(t, y)
        for k, (body, normal_force, kinetic, _, _) in enumerate(self.given.friction):
            own = slice(2 * body, 2 * body + 2)
            if not self.slips[k]:
                force[own] = 0.0
                continue
            w = self.slip(k, y)
            length = np.hypot(*w)
            toward = w / length if length else force[own] / np.hypot(*force[own])
            force[own] -= kinetic * normal_force * toward
        return np.concatenate([y[self.n :], force / self.given.mass])

    def _limit(self, k: int, t: float, y: np.ndarray) -> float:
        body, normal_force, _, static, _ = self.given.friction[k]
        return float(static * normal_force - np.hypot(*self.reaction(t, y)[2 * body : 2 * body + 2]))

    def _integrate(self, until: float, method: str, events: list[Any]) -> Any:
        tight = {"rtol": 1e-13, "atol": 1e-15} if method == "DOP853" else {"rtol": 1e-12, "atol": 1e-15}
        # Steps that no load passes over.
        return solve_ivp(
            self.rates, (self.time, until), self.state, method=method, events=events, max_step=0.05, **tight
        )

    def run(self, until: float) -> None:
        """Go on to a time."""
        self.until = until
        while self.time < until:
            watched = []
            for k, slips in enumerate(self.slips):
                if slips:
                    begins = np.hypot(*self.slip(k, self.state)) <= 2 * SLOW
                    watched.append((k, "velocity", self.time + 0.01 if begins else 0.0))
                else:
                    watched.append((k, "slip", 0.0))
            functions = []
            for k, kind, armed in watched:
                if kind == "velocity":

                    def function(t: float, y: np.ndarray, k: int = k, armed: float = armed) -> float:
                        return float(np.hypot(*self.slip(k, y)) - SLOW) if t >= armed else 1.0

                else:

                    def function(t: float, y: np.ndarray, k: int = k, armed: float = armed) -> float:
                        return self._limit(k, t, y)

                function.terminal, function.direction = True, -1  # type: ignore[attr-defined]
                functions.append(function)
            found = self._integrate(until, "DOP853", functions)
            happened = [i for i, times in enumerate(found.t_events) if len(times)]
            if not happened:
                self.time, self.state = until, found.y[:, -1]
                return
            k, kind, _ = watched[happened[0]]
            if kind == "slip":
                self._slip(k, functions[happened[0]], found)
            else:
                self.time, self.state = found.t[-1], found.y[:, -1]
                self._stop(k)

    def _slip(self, k: int, function: Any, found: Any) -> None:
        """Begin a slip where the forces reach the limit, located by integrations up to it."""
        before = max(len(found.t) - 2, 0)
        self.time, self.state = found.t[before], found.y[:, before]

        def at(t: float) -> float:
            if t == self.time:
                return float(function(t, self.state))
            return float(function(t, self._integrate(t, "DOP853", []).y[:, -1]))

        end = found.t[-1] + 0.1 * (found.t[-1] - found.t[before]) + 1e-9
        root = brentq(at, self.time, end, xtol=1e-15, rtol=1e-15)
        if root > self.time:
            self.state = self._integrate(root, "DOP853", []).y[:, -1]
        self.time = root
        self.events.append((root, k, "slip"))
        body, normal_force, kinetic, static, speed = self.given.friction[k]
        own = slice(self.n + 2 * body, self.n + 2 * body + 2)
        self.state[own] = speed
        if static > kinetic:
            self.slips[k] = True
            return
        # The motion at rest, on which the forces and with them the slip are known to the third order.
        held = solve_ivp(
            self.rates,
            (root, root + EARLY),
            self.state,
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
            dense_output=True,
        )
        times, weights = np.polynomial.legendre.leggauss(8)
        place = slice(2 * body, 2 * body + 2)
        impulse = 0.0
        for x, weight in zip(times, weights, strict=True):
            t = root + 0.5 * EARLY * (1 + x)
            size = np.hypot(*self.reaction(t, held.sol(t))[place])
            impulse += 0.5 * EARLY * weight * (size - kinetic * normal_force)
        self.state = held.y[:, -1]
        self.time = root + EARLY
        toward = self.reaction(self.time, self.state)[place]
        toward = toward / np.hypot(*toward)
        mass = float(self.given.mass[place][0])
        self.state[own] += impulse / mass * toward
        self.state[place] += EARLY / 3 * impulse / mass * toward
        self.slips[k] = True
        short = self._integrate(min(self.time + 0.005, self.until), "Radau", [])
        self.time, self.state = short.t[-1], short.y[:, -1]
        if any(not slips and self._limit(j, self.time, self.state) < 0 for j, slips in enumerate(self.slips)):
            raise NotImplementedError("two slips begin at nearly the same time")

    def _stop(self, k: int) -> None:
        """End a slip of which little is left: the forces on the contact are constant."""
        body, normal_force, kinetic, _, speed = self.given.friction[k]
        place = slice(2 * body, 2 * body + 2)
        own = slice(self.n + 2 * body, self.n + 2 * body + 2)
        w, force = self.slip(k, self.state), self.reaction(self.time, self.state)[place]
        r, size, limit = np.hypot(*w), np.hypot(*force), kinetic * normal_force
        if size >= limit:
            # It passes close to rest.
            short = self._integrate(self.time + 1e-3, "DOP853", [])
            self.time, self.state = short.t[-1], short.y[:, -1]
            return
        mass = float(self.given.mass[place][0])
        left = mass * (r * limit + force @ w) / (limit**2 - size**2)
        self.state[place] += 0.5 * left * w + np.asarray(speed) * left
        self.slips[k] = False
        self.state[own] = speed
        before = self.state[place].copy()
        self.state = self._integrate(self.time + left, "DOP853", []).y[:, -1]
        self.state[place] = before
        self.time += left
        self.events.append((self.time, k, "velocity"))
        if self._limit(k, self.time, self.state) < 0:
            self.slips[k] = True


def compared(seed: int) -> tuple[int, float, float]:
    """Return the number of events of a random scene, and the largest differences of times and of the end."""
    rng = np.random.default_rng(seed)
    given, start, duration = random_scene(rng)
    run = ss.simulate(given.scene(), duration, start)
    reference = Reference(given, start)
    reference.run(duration)
    kinds = [("slip" if kind == "slip" else "velocity") for kind in run.events.kind]
    found = [(kind, contact // 2) for kind, contact in zip(kinds, run.events.contact, strict=True)]
    known = [(kind, k) for _, k, kind in reference.events]
    if found != known:
        raise AssertionError(f"seed {seed}: {found} {run.events.time} is not {reference.events}")
    times = max((abs(a - b[0]) for a, b in zip(run.events.time, reference.events, strict=True)), default=0.0)
    last = run.sample(duration)
    end = np.concatenate([last.position.values.ravel(), last.velocity.values.ravel()])
    return len(found), times, float(np.abs(end - reference.state).max())


if __name__ == "__main__":
    first = int(sys.argv[2])
    for seed in range(first, first + int(sys.argv[1])):
        try:
            print(seed, *compared(seed), flush=True)
        except (AssertionError, NotImplementedError) as reason:
            print(seed, "not compared:", reason, flush=True)
