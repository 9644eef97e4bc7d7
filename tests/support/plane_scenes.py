"""Random scenes with friction in planes, and their motions by general integrators of scipy.

`python tests/support/plane_scenes.py N SEED` compares N of them, with `--lifting` of those whose contacts
open, with `--laws` under friction that follows the slip speed, with `--springs` beside cubic springs between
dofs of all kinds. The reference follows slip in `w / |w|` as it
stands: by DOP853, near the end of a slip until the forces on the contact are constant to rounding, and where
slip begins without a drop of friction (`|R| = mu N`) by Radau after a start of the third order in time.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss
from stickslip.scene.laws.law import FrictionLaw

#: Speed below which the reference ends a slip in closed form, and time over which slip begins in closed form.
SLOW, EARLY = 1e-8, 1e-3


@dataclass
class Pad:
    """Friction in the plane of two dofs, under a given normal force or that of a third dof."""

    plane: tuple[int, int]
    kinetic: float | FrictionLaw
    static: float
    speed: tuple[float, float]
    normal_force: float | None = None
    normal: int | None = None
    restitution: float = 0.0

    def friction(self, w: np.ndarray) -> float:
        """Return the coefficient of kinetic friction at a slip velocity."""
        is_constant = isinstance(self.kinetic, float)
        return self.kinetic if is_constant else self.kinetic.coefficient(float(np.hypot(*w)))


@dataclass
class PlaneScene:
    """Masses on springs, each with friction in a plane or without; all loads are harmonic."""

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    force: np.ndarray
    wave: tuple[np.ndarray, float, float]
    pads: list[Pad]
    impact_friction: bool = False
    #: Directions over all dofs, and stiffnesses, N/m^3.
    springs: tuple[tuple[np.ndarray, float], ...] = ()

    def scene(self, turn: float = 0.0) -> ss.Scene:
        """Return the scene, its tangential directions turned by an angle."""
        c, s = np.cos(turn), np.sin(turn)
        contacts = []
        for pad in self.pads:
            (x, y), speed = pad.plane, pad.speed
            along, across = ({x: c, y: s}, {x: -s, y: c}) if turn else ({x: 1.0}, {y: 1.0})
            turned = (c * speed[0] + s * speed[1], -s * speed[0] + c * speed[1])
            contacts.append(
                ss.Contact(
                    tangential=(along, across),
                    normal=pad.normal,
                    normal_force=pad.normal_force,
                    friction=pad.kinetic,
                    static_friction=pad.static,
                    slider_speed=turned,
                    restitution=pad.restitution,
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
            impact_friction=self.impact_friction,
            elements=[
                ss.Spring(direction, ss.spring.Polynomial(0.0, 0.0, cubic))
                for direction, cubic in self.springs
            ],
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
    pads = []
    for body in range(bodies):
        if body and rng.random() < 0.3:
            continue
        kinetic = float(rng.uniform(0.1, 0.8))
        static = kinetic * float(rng.choice([1.0, 1.0, 1.3]))
        moves = rng.random() < 0.6
        speed = tuple(float(v) for v in 0.5 * rng.normal(size=2)) if moves else (0.0, 0.0)
        plane = (2 * body, 2 * body + 1)
        pads.append(Pad(plane, kinetic, static, speed, normal_force=float(rng.uniform(0.3, 2.0))))
    one = PlaneScene(mass, stiffness, damping, force, wave, pads)
    velocity = rng.normal(size=n)
    start = ss.State(0.3 * rng.normal(size=n), velocity, "oo" * len(pads))
    return one, start, float(rng.uniform(5.0, 15.0))


def random_lifting_scene(rng: np.random.Generator) -> tuple[PlaneScene, ss.State, float]:
    """Return the same with bodies in space, which are pressed by a load, slip, stick, lift off and strike."""
    bodies = int(rng.integers(1, 4))
    n = 3 * bodies
    mass = np.repeat(rng.uniform(0.5, 2.0, bodies), 3) * np.tile([1.0, 1.0, rng.uniform(0.5, 2.0)], bodies)
    root = rng.normal(size=(n, n))
    stiffness = 0.3 * root @ root.T + np.diag(rng.uniform(0.2, 2.0, n))
    damping = 0.02 * stiffness + 0.05 * np.diag(mass)
    force = 0.3 * rng.normal(size=n)
    force[2::3] -= rng.uniform(0.5, 2.5, bodies)
    wave = (rng.normal(size=n), float(rng.uniform(0.3, 2.0)), float(rng.uniform(0, 6)))
    pads = []
    for body in range(bodies):
        kinetic = float(rng.uniform(0.1, 0.8))
        static = kinetic * float(rng.choice([1.0, 1.0, 1.3]))
        moves = rng.random() < 0.6
        speed = tuple(float(v) for v in 0.5 * rng.normal(size=2)) if moves else (0.0, 0.0)
        restitution = float(rng.choice([0.0, 0.4], p=[0.9, 0.1]))
        plane = (3 * body, 3 * body + 1)
        pads.append(Pad(plane, kinetic, static, speed, normal=3 * body + 2, restitution=restitution))
    one = PlaneScene(mass, stiffness, damping, force, wave, pads, bool(rng.random() < 0.5))
    place, velocity = 0.3 * rng.normal(size=n), rng.normal(size=n)
    # Above the plane, and falling.
    place[2::3], velocity[2::3] = rng.uniform(0.05, 0.5, bodies), 0.0
    return one, ss.State(place, velocity, "dd" * bodies), float(rng.uniform(5.0, 12.0))


def drawn_law(rng: np.random.Generator, kinetic: float) -> float | FrictionLaw:
    """Return friction over slip speed, or now and then a number."""
    static, speed = kinetic * rng.uniform(1.0, 1.6), 10.0 ** rng.uniform(-1.5, 0.5)
    match rng.choice(6):
        case 0:
            return ss.friction.Stribeck(static, kinetic, speed, viscous=rng.uniform(0.0, 0.1))
        case 1:
            return ss.friction.Rational(static, kinetic, speed)
        case 2:
            return ss.friction.Linear(kinetic, rng.uniform(0.0, 0.2))
        case 3:
            return ss.friction.Law("k + d * exp(-(s / v)**2)", k=kinetic, d=static - kinetic, v=speed)
        case 4:
            values = [static, kinetic * rng.uniform(0.9, 1.1), kinetic, kinetic * rng.uniform(0.8, 1.2)]
            return ss.friction.Tabulated([0.0, 0.5 * speed, speed, 2.0 * speed], values)
    return kinetic


def with_laws(draw: Any) -> Any:
    """Return a draw of the same scenes, in which friction follows the slip speed."""

    def drawn(rng: np.random.Generator) -> tuple[PlaneScene, ss.State, float]:
        scene, start, duration = draw(rng)
        for pad in scene.pads:
            assert isinstance(pad.kinetic, float)
            ratio = pad.static / pad.kinetic
            pad.kinetic = drawn_law(rng, pad.kinetic)
            pad.static = ratio * pad.friction(np.zeros(2))
        return scene, start, duration

    return drawn


def with_springs(draw: Any) -> Any:
    """Return a draw of the same scenes beside one to three cubic springs."""

    def drawn(rng: np.random.Generator) -> tuple[PlaneScene, ss.State, float]:
        scene, start, duration = draw(rng)
        n = len(scene.mass)

        def direction() -> np.ndarray:
            along = np.zeros(n)
            ends = rng.choice(n, size=2, replace=False)
            along[ends[0]] = 1.0
            if rng.random() < 0.5:
                along[ends[1]] = rng.uniform(-1.0, 1.0)
            return along

        count = int(rng.integers(1, 4))
        scene.springs = tuple((direction(), float(rng.uniform(0.3, 3.0))) for _ in range(count))
        return scene, start, duration

    return drawn


class Reference:
    """A motion by general integrators."""

    def __init__(self, given: PlaneScene, start: ss.State) -> None:
        self.given, self.n = given, len(given.mass)
        self.statuses = list(start.combination[::2])
        self.time = 0.0
        self.state = np.concatenate([start.position, start.velocity])
        self.events: list[tuple[float, int, str]] = []

    def reaction(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the forces without those of contacts."""
        x, v = y[: self.n], y[self.n :]
        amplitude, rate, phase = self.given.wave
        load = self.given.force + amplitude * np.cos(rate * t + phase)
        springs = (cubic * float(along @ x) ** 3 * along for along, cubic in self.given.springs)
        return load - self.given.stiffness @ x - self.given.damping @ v - sum(springs)

    def slip(self, k: int, y: np.ndarray) -> np.ndarray:
        pad = self.given.pads[k]
        return y[self.n + np.array(pad.plane)] - pad.speed

    def pressed(self, k: int, force: np.ndarray) -> float:
        """Return the normal force of a closed pad under these forces."""
        pad = self.given.pads[k]
        return float(-force[pad.normal]) if pad.normal_force is None else pad.normal_force

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        force = self.reaction(t, y)
        for k, pad in enumerate(self.given.pads):
            if self.statuses[k] == "d":
                continue
            own, pressed = list(pad.plane), self.pressed(k, force)
            if pad.normal is not None:
                force[pad.normal] = 0.0
            if self.statuses[k] == "s":
                force[own] = 0.0
                continue
            w = self.slip(k, y)
            length = np.hypot(*w)
            toward = w / length if length else force[own] / np.hypot(*force[own])
            force[own] -= pad.friction(w) * pressed * toward
        return np.concatenate([y[self.n :], force / self.given.mass])

    def _limit(self, k: int, t: float, y: np.ndarray) -> float:
        force, pad = self.reaction(t, y), self.given.pads[k]
        return float(pad.static * self.pressed(k, force) - np.hypot(*force[list(pad.plane)]))

    def _integrate(self, until: float, method: str, events: list[Any]) -> Any:
        tight = {"rtol": 1e-13, "atol": 1e-15} if method == "DOP853" else {"rtol": 1e-12, "atol": 1e-15}
        # Steps that no load passes over.
        return solve_ivp(
            self.rates, (self.time, until), self.state, method=method, events=events, max_step=0.05, **tight
        )

    def _watched(self) -> list[tuple[int, str, Any]]:
        """Return contacts, kinds and functions of the events that may come."""
        watched: list[tuple[int, str, Any]] = []
        for k, (status, pad) in enumerate(zip(self.statuses, self.given.pads, strict=True)):
            if status == "o":
                begins = np.hypot(*self.slip(k, self.state)) <= 2 * SLOW
                armed = self.time + 0.01 if begins else 0.0
                watched.append(
                    (
                        k,
                        "velocity",
                        lambda t, y, k=k, armed=armed: (
                            float(np.hypot(*self.slip(k, y)) - SLOW) if t >= armed else 1.0
                        ),
                    )
                )
                if pad.normal is not None:
                    watched.append((k, "release", lambda t, y, k=k: self.pressed(k, self.reaction(t, y))))
            elif status == "s":
                watched.append((k, "slip", lambda t, y, k=k: self._limit(k, t, y)))
            else:
                # A gap that begins at zero counts once it is open.
                gap, after = pad.normal, self.time
                leaves = abs(self.state[gap]) < 1e-12
                armed = after + 1e-4 if leaves else after
                watched.append(
                    (
                        k,
                        "impact",
                        lambda t, y, gap=gap, armed=armed: float(y[gap]) if t >= armed else 1.0,
                    )
                )
        for _, _, function in watched:
            function.terminal, function.direction = True, -1
        return watched

    def run(self, until: float) -> None:
        """Go on to a time."""
        self.until = until
        while self.time < until:
            watched = self._watched()
            found = self._integrate(until, "DOP853", [function for _, _, function in watched])
            happened = [i for i, times in enumerate(found.t_events) if len(times)]
            if not happened:
                self.time, self.state = until, found.y[:, -1]
                return
            k, kind, function = watched[happened[0]]
            if kind == "velocity":
                self.time, self.state = found.t[-1], found.y[:, -1]
                self._stop(k)
                continue
            self._locate(function, found)
            pad = self.given.pads[k]
            if kind == "slip":
                self._slip(k)
            elif kind == "release":
                self.events.append((self.time, k, kind))
                self.statuses[k] = "d"
                self.state[[pad.normal, self.n + pad.normal]] = 0.0
            else:
                self._strike(k)

    def _locate(self, function: Any, found: Any) -> None:
        """Go to the zero of an event function, by integrations up to it."""
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

    def _strike(self, k: int) -> None:
        """Let a pad strike the plane, with an impulse in its cone of friction if impacts have friction."""
        pad, n = self.given.pads[k], self.n
        self.events.append((self.time, k, "impact"))
        approach = self.state[n + pad.normal]
        self.state[pad.normal] = 0.0
        self.state[n + pad.normal] = -pad.restitution * approach
        own, mass = n + np.array(pad.plane), self.given.mass
        if self.given.impact_friction:
            w = self.slip(k, self.state)
            impulse = pad.friction(w) * (1 + pad.restitution) * mass[pad.normal] * abs(approach)
            momentum = mass[pad.plane[0]] * np.hypot(*w)
            self.state[own] = pad.speed + w * max(1 - impulse / momentum, 0.0)
        if self.state[n + pad.normal] > 1e-3:
            return
        if pad.restitution:
            raise NotImplementedError("a series of impacts comes to rest")
        self.state[n + pad.normal] = 0.0
        force = self.reaction(self.time, self.state)
        if self.pressed(k, force) < 0:
            return
        rests = not np.any(self.slip(k, self.state)) and self._limit(k, self.time, self.state) > 0
        self.statuses[k] = "s" if rests else "o"

    def _slip(self, k: int) -> None:
        """Begin a slip where the forces reach the limit."""
        root = self.time
        self.events.append((root, k, "slip"))
        pad = self.given.pads[k]
        place, own = np.array(pad.plane), self.n + np.array(pad.plane)
        self.state[own] = pad.speed
        if pad.static > pad.friction(np.zeros(2)):
            self.statuses[k] = "o"
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
        impulse = 0.0
        for x, weight in zip(times, weights, strict=True):
            t = root + 0.5 * EARLY * (1 + x)
            force = self.reaction(t, held.sol(t))
            size, pressed = np.hypot(*force[place]), self.pressed(k, force)
            # Slip grows with the square of time, by half of what the force beyond friction at rest gives.
            excess = size - pad.friction(np.zeros(2)) * pressed
            slip = 0.5 * excess * (t - root) / self.given.mass[place][0]
            impulse += 0.5 * EARLY * weight * (size - pad.friction(np.array([slip, 0.0])) * pressed)
        self.state = held.y[:, -1]
        self.time = root + EARLY
        toward = self.reaction(self.time, self.state)[place]
        toward = toward / np.hypot(*toward)
        mass = float(self.given.mass[place][0])
        self.state[own] += impulse / mass * toward
        self.state[place] += EARLY / 3 * impulse / mass * toward
        self.statuses[k] = "o"
        short = self._integrate(min(self.time + 0.005, self.until), "Radau", [])
        self.time, self.state = short.t[-1], short.y[:, -1]
        others = [j for j, status in enumerate(self.statuses) if status == "s"]
        if any(self._limit(j, self.time, self.state) < 0 for j in others):
            raise NotImplementedError("two slips begin at nearly the same time")
        force = self.reaction(self.time, self.state)
        for j, pad in enumerate(self.given.pads):
            if pad.normal is not None:
                apart = self.statuses[j] == "d"
                left = self.state[pad.normal] if apart else self.pressed(j, force)
                if left < 0:
                    raise NotImplementedError("a contact opens or closes just after a slip begins")

    def _stop(self, k: int) -> None:
        """End a slip of which little is left: the forces on the contact are constant."""
        pad = self.given.pads[k]
        place, own = np.array(pad.plane), self.n + np.array(pad.plane)
        every = self.reaction(self.time, self.state)
        w, force = self.slip(k, self.state), every[place]
        r, size, limit = np.hypot(*w), np.hypot(*force), pad.friction(w) * self.pressed(k, every)
        if size >= limit:
            # It passes close to rest.
            short = self._integrate(self.time + 1e-3, "DOP853", [])
            self.time, self.state = short.t[-1], short.y[:, -1]
            return
        mass = float(self.given.mass[place][0])
        left = mass * (r * limit + force @ w) / (limit**2 - size**2)
        self.state[place] += 0.5 * left * w + np.asarray(pad.speed) * left
        self.statuses[k] = "s"
        self.state[own] = pad.speed
        before = self.state[place].copy()
        self.state = self._integrate(self.time + left, "DOP853", []).y[:, -1]
        self.state[place] = before
        self.time += left
        self.events.append((self.time, k, "velocity"))
        if self._limit(k, self.time, self.state) < 0:
            self.statuses[k] = "o"


def end(run: ss.Trajectory) -> np.ndarray:
    """Return places and velocities at the end of a run."""
    last = run.sample(run.duration)
    return np.concatenate([last.position.values.ravel(), last.velocity.values.ravel()])


def turned_kinds(draw: Any, seeds: int) -> list[str]:
    """Compare runs of random scenes with those along turned directions; return the kinds of their events."""
    kinds: list[str] = []
    rng = np.random.default_rng(1)
    for seed in range(seeds):
        scene, start, duration = draw(np.random.default_rng(seed))
        first = ss.simulate(scene.scene(), duration, start)
        second = ss.simulate(scene.scene(rng.uniform(0.0, 2 * np.pi)), duration, start)
        assert list(first.events.kind) == list(second.events.kind)
        np.testing.assert_allclose(first.events.time, second.events.time, rtol=1e-13)
        np.testing.assert_allclose(end(first), end(second), atol=1e-13)
        kinds += list(first.events.kind)
    return kinds


def check_energy(draw: Any) -> None:
    """Check of random scenes that energy closes and that friction never gives any."""
    for seed in range(20):
        scene, start, duration = draw(np.random.default_rng(seed))
        run = ss.simulate(scene.scene(), duration, start)
        balance = run.balance()
        assert abs(balance.residual) < 1e-12 * max(abs(balance.external), 1.0)
        sampled = run.energy(np.linspace(0.0, duration, 200))
        heat = sampled.slider_power.to_numpy() - sampled.contact_power.to_numpy()
        assert heat.min() > -1e-13


def compared(seed: int, draw: Any = random_scene) -> tuple[int, float, float]:
    """Return the number of events of a random scene, and the largest differences of times and of the end."""
    rng = np.random.default_rng(seed)
    given, start, duration = draw(rng)
    reference = Reference(given, start)
    reference.run(duration)
    run = ss.simulate(given.scene(), duration, start)
    found = [(kind, contact // 2) for kind, contact in zip(run.events.kind, run.events.contact, strict=True)]
    known = [(kind, k) for _, k, kind in reference.events]
    if found != known:
        raise AssertionError(f"seed {seed}: {found} {run.events.time} is not {reference.events}")
    times = max((abs(a - b[0]) for a, b in zip(run.events.time, reference.events, strict=True)), default=0.0)
    return len(found), times, float(np.abs(end(run) - reference.state).max())


if __name__ == "__main__":
    first = int(sys.argv[2])
    draw = random_lifting_scene if "--lifting" in sys.argv else random_scene
    draw = with_laws(draw) if "--laws" in sys.argv else draw
    draw = with_springs(draw) if "--springs" in sys.argv else draw
    for seed in range(first, first + int(sys.argv[1])):
        try:
            print(seed, *compared(seed, draw), flush=True)
        except (AssertionError, NotImplementedError) as reason:
            print(seed, "not compared:", reason, flush=True)
