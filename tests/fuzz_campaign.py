"""Random scenes, each run by modes and by Taylor series, and everything that must hold checked.

    python tests/fuzz_campaign.py --scenes 1000 --seed 1 --store out/fuzz.jsonl

Scene i depends on the seed and i alone. Every finished scene is a line of the store, and a scene that is there is
not run again, so a campaign goes on where it was stopped. Exit code 1 when a scene failed.

A scene is a chain of 1 to 6 subsystems with random parameters (half of them over ten orders of magnitude of stiffness
to mass), restitution, static friction, tangential impulses, started near sliding or in flight. Checked are

* modes against Taylor series: the same events, times within 1e-9 s or the bound below; a difference is a *near tie*
  only if a touch within rounding is reported there, or two events lie within the bound of each other;
* complementarity on a dense sample: g >= 0, N >= 0, |T| <= mu_static N, slip against friction, to rounding of the terms;
* energy: the change of 1/2 u'Mu + 1/2 x'Kx, impact losses taken out, against the quadrature of contact, external and
  damping power;
* the run ends by itself in bounded time, and nothing panics.

The bound on times: rounding of the state, grown with the largest growth seen between the two runs of nearby
starts. It is measured, not guessed: a third run starts 1e-12 relative away, and its events show how far 1e-12 goes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

import stickslip as ss

DURATION = 0.1
#: s; the issue's own figure, far above what well-conditioned runs need
TIME_TOLERANCE = 1e-9
#: events after which a scene is only compared so far: chatter at restitution near 1
MAX_EVENTS = 2000
#: s of wall clock that a scene of 0.1 s may take before it counts as hanging
HANG = 20.0
#: relative size of the perturbation that measures sensitivity
NUDGE = 1e-12


@dataclass
class Outcome:
    """What came of one scene."""

    index: int
    verdict: str
    detail: str = ""
    subsystems: int = 0
    events: int = 0
    grazings: int = 0
    time_difference: float = 0.0
    energy_residual: float = 0.0
    seconds: float = 0.0


def random_scene(rng: np.random.Generator) -> tuple[ss.Scene, ss.State]:
    """Return a scene and a start state that is consistent with it."""
    extreme = rng.random() < 0.5
    decades = 2.0 if extreme else 0.5

    def spread(centre: float) -> float:
        return centre * 10.0 ** rng.uniform(-decades, decades)

    count = int(rng.integers(1, 7))
    subsystems = [
        ss.models.Subsystem(
            upper_mass=spread(0.3),
            contact_mass=spread(0.3),
            inclination=rng.uniform(0.0, 1.2),
            vertical_stiffness=spread(2e5),
            horizontal_stiffness=spread(5e5),
            ceiling_stiffness=spread(1e5),
            preload_displacement=spread(1e-3),
            external_force=0.0 if rng.random() < 0.7 else spread(10.0),
        )
        for _ in range(count)
    ]
    links = [
        ss.models.Link(horizontal_stiffness=spread(1e6), vertical_stiffness=spread(1e5))
        for _ in range(count - 1)
    ]
    friction = rng.uniform(0.0, 2.5, count) * (rng.random(count) < 0.95)
    scene = ss.models.chain(
        subsystems,
        links,
        wall_stiffness=spread(1e6),
        friction=friction,
        static_friction=friction * np.where(rng.random(count) < 0.5, 1.0, rng.uniform(1.0, 1.6, count)),
        slider_speed=rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-3.0, 0.0, count),
        restitution=np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0.0, 0.9, count)),
        damping=0.0 if rng.random() < 0.1 else 10.0 ** rng.uniform(-6.0, -3.5),
        impact_friction=bool(rng.random() < 0.5),
    )
    try:
        start = ss.sliding_equilibrium(scene)
        kick = {name: rng.normal() * 10.0 ** rng.uniform(-4, -1) for name in scene.dofs if name[1:].isdigit()}
        normal = {f"x{4 * i + 4}" for i in range(count)}
        start = start.perturbed(velocity={name: v for name, v in kick.items() if name not in normal})
        slip = start.velocity[2::4] - np.array([contact.slider_speed for contact in scene.contacts])
        start = ss.State(start.position, start.velocity, "".join("+" if s < 0 else "-" for s in slip))
        ss.simulate(scene, start, 1e-9)
    except ss.InputError:
        position = np.zeros(4 * count)
        position[3::4] = 10.0 ** rng.uniform(-5, -3, count)
        velocity = 0.1 * rng.normal(size=4 * count)
        start = ss.State(position, velocity, "d" * count)
    return scene, start


def matrices(scene: ss.Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return dense M, C, K of a chain."""
    stiffness = scene.stiffness.toarray() if sparse.issparse(scene.stiffness) else np.asarray(scene.stiffness)
    mass = np.diag(scene.mass)
    return mass, scene.damping.mass * mass + scene.damping.stiffness * stiffness, stiffness


def nearby(start: ss.State) -> ss.State:
    """Return the start state moved by NUDGE, within its constraints."""
    velocity = start.velocity * (1.0 + NUDGE * np.cos(np.arange(start.velocity.size)))
    return ss.State(start.position, velocity, start.combination)


def common_events(one: ss.Trajectory, other: ss.Trajectory) -> int:
    """Return how many events agree in contact, kind and combination before the first difference."""
    n = min(len(one.events), len(other.events))
    same = (
        (one.events.contact[:n] == other.events.contact[:n])
        & (one.events.kind[:n] == other.events.kind[:n])
        & (one.events.combination[:n] == other.events.combination[:n])
    )
    return n if same.all() else int(np.argmin(same))


def compare(modal: ss.Trajectory, taylor: ss.Trajectory, nudged: ss.Trajectory) -> tuple[str, str, float]:
    """Return verdict, detail and the largest time difference of the events of two runs."""
    n = common_events(modal, taylor)
    difference = np.abs(modal.events.time[:n] - taylor.events.time[:n])
    m = min(n, common_events(taylor, nudged))
    grown = np.maximum.accumulate(np.abs(taylor.events.time[:m] - nudged.events.time[:m]))
    bound = np.full(n, np.inf)
    bound[:m] = grown
    allowed = np.maximum(TIME_TOLERANCE, bound)
    largest = float(difference.max(initial=0.0))
    if (difference > allowed).any():
        k = int(np.argmax(difference > allowed))
        return "times", f"event {k}: {difference[k]:.2e} s apart, allowed {allowed[k]:.2e}", largest
    if n == len(modal.events) == len(taylor.events):
        return "ok", "", largest
    if m < n or common_events(taylor, nudged) <= n < len(nudged.events):
        return "near tie", f"event {n} changes under a nudge of {NUDGE}", largest
    reach = max(
        TIME_TOLERANCE, 10.0 * float(allowed[-1] if n and np.isfinite(allowed[-1]) else TIME_TOLERANCE)
    )
    times = [run.events.time[n] if n < len(run.events) else run.duration for run in (modal, taylor)]
    touches = [touch.time for run in (modal, taylor) for touch in run.grazings]
    if any(abs(touch - t) <= reach for touch in touches for t in times):
        return "near tie", f"event {n}: a touch is reported there", largest
    close = [
        abs(run.events.time[n + 1] - run.events.time[n]) <= reach
        for run in (modal, taylor)
        if n + 1 < len(run.events)
    ]
    if any(close) or abs(times[0] - DURATION) <= reach or abs(times[1] - DURATION) <= reach:
        return "near tie", f"event {n}: two events within {reach:.1e} s", largest
    return "events", f"event {n} differs: {times[0]!r} and {times[1]!r}", largest


def check_complementarity(run: ss.Trajectory) -> str:
    """Return what is violated on a dense sample, or an empty string."""
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    inside = (edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.02, 0.98, 9)).ravel()
    # Not at the events themselves, where two statuses share an instant.
    data = run.sample(inside[(inside > 0.0) & (inside < run.duration) & ~np.isin(inside, edges)])
    contacts = run.scene.contacts
    position, velocity = data.position.values, data.velocity.values
    _, damping, stiffness = (np.abs(matrix) for matrix in matrices(run.scene))
    load = np.abs(position) @ stiffness + np.abs(velocity) @ damping + np.abs(run.scene.force)
    status = data.status.values
    for i, contact in enumerate(contacts):
        t, n = 4 * i + 2, 4 * i + 3
        # Rounding of a state by modes: some hundred ulp (the limit of their condition) of its terms.
        slack = 3e-12
        force = slack * load[:, n] + slack * load[:, t]
        length = slack * np.abs(position).max()
        speed = slack * max(np.abs(velocity).max(), abs(contact.slider_speed))
        gap, slip = position[:, n], velocity[:, t] - contact.slider_speed
        normal, friction = data.normal_force.values[:, i], data.friction_force.values[:, i]
        closed = status[:, i] != "d"
        checks = {
            "penetration": gap < -length,
            "gap of a closed contact": closed & (np.abs(gap) > 0.0),
            "tension": closed & (normal < -force),
            "force of an open contact": ~closed & ((normal != 0.0) | (friction != 0.0)),
            "friction cone": np.abs(friction)
            > contact.static_friction * normal + (1 + contact.static_friction) * force,
            "slip while sticking": (status[:, i] == "s") & (slip != 0.0),
            "slip along friction": (status[:, i] == "+") & (contact.friction > 0) & (slip > speed)
            | (status[:, i] == "-") & (contact.friction > 0) & (slip < -speed),
        }
        for name, violated in checks.items():
            if violated.any():
                k = int(np.argmax(violated))
                at = float(data.time[k])
                return f"{name} at contact {i}, t = {at!r}: N {normal[k]:.3e}, T {friction[k]:.3e}, g {gap[k]:.3e}, s {slip[k]:.3e}"
    return ""


def energy_residual(run: ss.Trajectory) -> float:
    """Return the residual of the energy balance relative to the sum of absolute work terms; nan if too costly."""
    scene = run.scene
    mass, damping, stiffness = matrices(scene)
    fastest = max(
        np.abs(ss.complex_modes(scene, c).eigenvalues).max()
        for c in set(run.events.combination) | {run.start.combination}
    )
    nodes, weights = np.polynomial.legendre.leggauss(12)
    edges = np.unique(np.concatenate([[0.0], run.events.time, [run.duration]]))
    pieces = []
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        count = max(1, int(np.ceil((b - a) * fastest / 2.0)))
        cuts = np.linspace(a, b, count + 1)
        pieces.append(np.column_stack([cuts[:-1], cuts[1:]]))
    spans = np.concatenate(pieces)
    if spans.shape[0] > 4000:
        return float("nan")
    middle, half = spans.mean(axis=1), 0.5 * (spans[:, 1] - spans[:, 0])
    data = run.sample((middle[:, None] + half[:, None] * nodes).ravel())
    weight = (half[:, None] * weights).ravel()
    velocity = data.velocity.values
    tangential = velocity[:, 2::4]
    contact = weight @ (data.friction_force.values * tangential)
    absolute = weight @ np.abs(data.friction_force.values * tangential)
    external = weight @ (velocity @ scene.force)
    damped = weight @ np.einsum("ki,ij,kj->k", velocity, damping, velocity)

    def energy(position: np.ndarray, velocity: np.ndarray) -> float:
        return float(0.5 * velocity @ mass @ velocity + 0.5 * position @ stiffness @ position)

    end = run.state(run.duration)
    change = energy(end.position, end.velocity) - energy(run.start.position, run.start.velocity)
    impact = 0.0
    positions, velocities = run.event_states()
    for k in np.flatnonzero((run.events.kind == "impact") | (run.events.kind == "accumulation")):
        before = run.sample([np.nextafter(run.events.time[k], 0.0)])
        impact += energy(positions[k], velocities[k]) - energy(positions[k], before.velocity.values[0])
    turnover = absolute.sum() + weight @ np.abs(velocity @ scene.force) + damped + abs(impact) + abs(change)
    return float(abs(change - contact.sum() - external + damped - impact) / turnover)


def run_scene(seed: int, index: int) -> Outcome:
    """Return the outcome of one scene."""
    began = time.perf_counter()
    rng = np.random.default_rng([seed, index])
    outcome = Outcome(index, "ok")
    try:
        scene, start = random_scene(rng)
        outcome.subsystems = len(scene.contacts)
        limits: dict[str, Any] = {"max_events": MAX_EVENTS, "time_limit": HANG}
        modal = ss.simulate(scene, start, DURATION, **limits)
        taylor = ss.simulate(scene, start, DURATION, method="taylor", **limits)
        nudged = ss.simulate(scene, nearby(start), DURATION, method="taylor", **limits)
        outcome.events, outcome.grazings = len(modal.events), len(modal.grazings)
        outcome.verdict, outcome.detail, outcome.time_difference = compare(modal, taylor, nudged)
        if "time_limit" in (modal.stop_reason, taylor.stop_reason):
            outcome.verdict, outcome.detail = "hang", f"{modal.stop_reason}, {taylor.stop_reason}"
        violated = check_complementarity(modal) or check_complementarity(taylor)
        if violated:
            outcome.verdict, outcome.detail = "complementarity", violated
        outcome.energy_residual = energy_residual(modal)
        if outcome.energy_residual > 1e-9:
            outcome.verdict, outcome.detail = "energy", f"residual {outcome.energy_residual:.2e}"
    except Exception as error:
        outcome.verdict, outcome.detail = "error", f"{type(error).__name__}: {error}"
    outcome.seconds = time.perf_counter() - began
    return outcome


def finished(store: Path, seed: int) -> dict[int, Outcome]:
    """Return the outcomes that a store already holds for a seed."""
    if not store.exists():
        return {}
    outcomes = {}
    for line in store.read_text().splitlines():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:  # the line that an interruption cut
            continue
        if record.pop("seed") == seed:
            outcomes[record["index"]] = Outcome(**record)
    return outcomes


def campaign(scenes: int, seed: int, store: Path | None, workers: int) -> list[Outcome]:
    """Run the scenes that the store does not hold yet; return all outcomes by index."""
    outcomes = finished(store, seed) if store else {}
    todo = [index for index in range(scenes) if index not in outcomes]
    sink = store.open("a") if store else None
    with ProcessPoolExecutor(workers) as pool:
        for outcome in pool.map(run_scene, [seed] * len(todo), todo, chunksize=8):
            outcomes[outcome.index] = outcome
            if sink:
                sink.write(json.dumps({"seed": seed, **asdict(outcome)}) + "\n")
                sink.flush()
    return [outcomes[index] for index in range(scenes)]


def summary(outcomes: list[Outcome]) -> str:
    """Return what a person wants to know of a campaign."""
    verdicts = Counter(outcome.verdict for outcome in outcomes)
    times = np.array([outcome.time_difference for outcome in outcomes if outcome.verdict == "ok"])
    energy = np.array([outcome.energy_residual for outcome in outcomes])
    lines = [
        f"{len(outcomes)} scenes, {sum(o.events for o in outcomes)} events, {sum(o.grazings for o in outcomes)} touches",
        *(f"  {count:6d} {verdict}" for verdict, count in verdicts.most_common()),
        f"largest time difference {times.max(initial=0):.2e} s, 99 % below {np.quantile(times, 0.99):.2e} s",
        f"energy residual: largest {np.nanmax(energy):.2e}, median {np.nanmedian(energy):.2e}",
        f"slowest scene {max(o.seconds for o in outcomes):.2f} s",
    ]
    failed = [o for o in outcomes if o.verdict not in ("ok", "near tie")]
    lines += [f"scene {o.index}: {o.verdict}: {o.detail}" for o in failed[:20]]
    return "\n".join(lines)


def main() -> int:
    """Run a campaign from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--store", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    if arguments.store:
        arguments.store.parent.mkdir(parents=True, exist_ok=True)
    outcomes = campaign(arguments.scenes, arguments.seed, arguments.store, arguments.workers)
    print(summary(outcomes))
    return int(any(outcome.verdict not in ("ok", "near tie") for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
