"""Other ways to the motion of scenes with friction over slip speed: narrower panels, and an integrator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.integrate import solve_ivp

import stickslip as ss
from fuzz_checks import coefficients
from fuzz_events import SPREAD
from fuzz_terms import contact_directions, fastest, forces, matrices, slider_speeds
from stickslip.scene.laws.friction import FrictionLaw
from stickslip.scene.structure import directions

#: Phases that an integrator follows, how long it does, as a multiple of the time of the fastest mode, and by
#: what part of the largest entry it may end elsewhere: in general, and where rounding grows at most.
FOLLOWED, TURNS, FOLLOWED_ALIKE, MOST_GROWN = 3, 20.0, 1e-8, 1e-4
#: Relative tolerance of the integrator, and absolute one in parts of the largest entry.
ACCURACY, NEGLIGIBLE = 1e-13, 1e-14


def beside_a_faster_mass(scene: ss.Scene, start: ss.State, width: float) -> tuple[ss.Scene, ss.State]:
    """Return the scene beside a mass at rest, so fast that panels are narrower than a width, s.

    A panel begins with three times the reciprocal of ``omega + alpha + beta omega^2`` at most.
    """
    alpha, beta = scene.damping.mass, scene.damping.stiffness
    rate = max(3.0 / width - alpha, 1.0)
    rate = (np.sqrt(1.0 + 4.0 * beta * rate) - 1.0) / (2.0 * beta) if beta else rate

    def padded(matrix: np.ndarray, own: float, tie: float = 0.0) -> np.ndarray:
        whole = np.pad(np.asarray(matrix, dtype=float), (0, 1))
        # What ties it moves nothing; without it the mass would be searched for events by itself.
        whole[0, -1] = whole[-1, 0] = tie
        whole[-1, -1] = own
        return whole

    unsymmetric = {
        name: padded(matrix.toarray() if sparse.issparse(matrix) else matrix, 0.0)
        for name in ("gyroscopic", "circulatory")
        if (matrix := getattr(scene, name)) is not None
    }
    stored = scene.stiffness.toarray() if sparse.issparse(scene.stiffness) else scene.stiffness
    wider = ss.Scene(
        np.append(scene.mass, 1.0) if scene.mass.ndim == 1 else padded(scene.mass, 1.0),
        padded(stored, rate**2, 1e-250),
        damping=scene.damping,
        force=np.append(scene.force, 0.0),
        contacts=scene.contacts,
        impact_friction=scene.impact_friction,
        loads=scene.loads,
        elements=scene.elements,
        **unsymmetric,
    )
    position, velocity = np.append(start.position, 0.0), np.append(start.velocity, 0.0)
    return wider, ss.State(position, velocity, start.combination)


class PhaseEquations:
    """The equation of motion of a combination, with contact forces as unknowns.

    ``M a = F - C u - K x + sum (n + sign mu t) N`` with ``n'a = 0``, and where a contact sticks ``t'a = 0``
    with a force of its own. A given normal force is an equation for N. Where directions depend on each other,
    any forces that solve this will do.
    """

    def __init__(self, scene: ss.Scene, combination: str) -> None:
        self.scene, self.matrices = scene, matrices(scene)
        self.directions = directions(scene).toarray() if scene.elements else []
        tangential, normal = contact_directions(scene)
        self.tangential = tangential
        self.pressed = [i for i, status in enumerate(combination) if status != "d"]
        sticking = tangential[[i for i in self.pressed if combination[i] == "s"]]
        signs = {"+": 1.0, "-": -1.0, "s": 0.0}
        self.rubbing = (
            np.array([signs[combination[i]] for i in self.pressed])[:, None] * tangential[self.pressed]
        )
        self.held = np.vstack([normal[self.pressed], sticking])
        opening = [i for i in self.pressed if scene.contacts[i].normal is not None]
        rows = np.vstack([normal[opening], sticking])
        self.dependent = len(rows) > 0 and np.linalg.matrix_rank(rows) < len(rows)

    def rate(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return (x', x'') at (x, x')."""
        scene, size = self.scene, self.scene.size
        mass, damping, stiffness = self.matrices
        x, u = y[:size], y[size:]
        slip = (self.tangential @ u - slider_speeds(scene, np.array([t]))[0])[None]
        mu = coefficients(scene.contacts, slip)[0, self.pressed]
        acting = self.held.copy()
        acting[: mu.size] += mu[:, None] * self.rubbing
        count = size + len(acting)
        system, load = np.zeros((count, count)), np.zeros(count)
        system[:size, :size], system[:size, size:], system[size:, :size] = mass, -acting.T, self.held
        load[:size] = forces(scene, np.array([t]))[0] - damping @ u - stiffness @ x
        for one, d in zip(scene.elements, self.directions, strict=True):
            argument = d @ x - one.offset if isinstance(one, ss.Spring) else d @ u
            load[:size] -= one.law.force(argument) * d
        for row, i in enumerate(self.pressed, size):
            if scene.contacts[i].normal is None:
                system[row] = np.eye(count)[row]
                load[row] = scene.contacts[i].normal_force
        if self.dependent:
            return np.concatenate([u, np.linalg.lstsq(system, load, rcond=1e-12)[0][:size]])
        return np.concatenate([u, np.linalg.solve(system, load)[:size]])


def phases_by_integrator(run: ss.Trajectory) -> str:
    """Return where the motion of the longest phases that slide by a law differs from DOP853's, or ``""``."""
    scene, size = run.scene, run.scene.size
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    letters = [run.start.combination, *run.events.combination]
    _, rates = fastest(scene, letters)
    by_law = [isinstance(contact.friction, FrictionLaw) or bool(scene.elements) for contact in scene.contacts]
    slides = [
        any(law and status in "+-" for law, status in zip(by_law, combination, strict=True))
        for combination in letters
    ]
    spans = np.minimum(np.diff(edges), TURNS / rates[:, 0]) * slides
    for k in np.argsort(-spans)[:FOLLOWED]:
        if spans[k] == 0.0:
            break
        begin, end = edges[k] + 0.05 * spans[k], edges[k] + 0.95 * spans[k]
        first, last = (run.state(float(t)) for t in (begin, end))
        y = np.concatenate([first.position, first.velocity])
        largest = np.repeat([np.abs(y[:size]).max(), np.abs(y[size:]).max()], size)
        rate = PhaseEquations(scene, letters[k]).rate
        absolute = NEGLIGIBLE * largest
        # Forces that cancel leave their rounding: asked for less of a velocity, steps become ever shorter.
        absolute[size:] = np.maximum(absolute[size:], rounding_of_acceleration(scene, y) / rates[k, 0])
        reached = integrated(rate, begin, end, y, absolute)
        off = np.abs(reached - np.concatenate([last.position, last.velocity])) / largest
        if (off < FOLLOWED_ALIKE).all():
            continue
        # A motion that grows carries the integrator's own errors along.
        pattern = np.cos(np.arange(y.size))
        nudged = y + (ACCURACY * y + absolute) * pattern
        moved = np.abs(integrated(rate, begin, end, nudged, absolute) - reached) / largest
        allowed = np.clip(SPREAD * moved, FOLLOWED_ALIKE, MOST_GROWN)
        # A motion that is not a number is off, too.
        if not (off < allowed).all():
            worst = int(np.argmax(off / allowed))
            return (
                f"phase {k} from {begin!r} to {end!r} in {letters[k]!r}: entry {worst} of the state off by "
                f"{off[worst]:.2e}, rounding moves it by {moved[worst]:.2e}"
            )
    return ""


def rounding_of_acceleration(scene: ss.Scene, y: np.ndarray) -> np.ndarray:
    """Return what rounding of the forces of springs and dampers leaves in x'' at (x, x'), m/s^2."""
    mass, damping, stiffness = matrices(scene)
    x, u = np.abs(y).reshape(2, -1)
    forces = np.abs(stiffness) @ x + np.abs(damping) @ u
    return np.finfo(float).eps * np.abs(np.linalg.inv(mass)) @ forces


def integrated(
    rate: Callable[[float, np.ndarray], np.ndarray],
    begin: float,
    end: float,
    y: np.ndarray,
    absolute: np.ndarray,
) -> np.ndarray:
    """Return the state at the end of a phase by DOP853; nan if it does not come so far."""
    path = solve_ivp(rate, (begin, end), y, method="DOP853", rtol=ACCURACY, atol=absolute)
    return path.y[:, -1] if path.status == 0 else np.full(y.size, np.nan)
