"""What must hold of every run of the fuzz campaign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import stickslip as ss
from fuzz_scenes import matrices

#: s; the figure that the campaign promises, far above what well-conditioned runs need
TIME_TOLERANCE = 1e-9
#: Times the effect of one nudge: rounding acts at every event, in any direction.
SPREAD = 10.0
#: s; events that a nudge moves further are not compared: collisions of several masses grow it tenfold each.
HORIZON = 1e-6
#: Rounding of a state: some hundred ulp, the limit of the condition of modes, over some dozens of phases.
SLACK = 3e-12
#: Quadrature: Gauss nodes, and the largest rate times span for which they leave less than 1e-12 of a power,
#: which turns twice as fast as the motion.
RULES = ((3, 0.05), (5, 0.6), (8, 2.0), (12, 6.0))
#: Quadrature points, about, after which the energy of a scene is not followed further.
MOST_POINTS = 60_000


@dataclass(frozen=True)
class EventList:
    """Events by number, with what an accumulating contact does within the tolerance taken as one event.

    How many bounces there are before the clock can't tell them apart is a matter of rounding, and so is the
    sign of a slip velocity that the last of them left.
    """

    time: np.ndarray
    what: list[tuple[int, str, str]]

    @classmethod
    def of(cls, run: ss.Trajectory) -> EventList:
        time, contact, kind = run.events.time, run.events.contact, run.events.kind
        after = [str(combination) for combination in run.events.combination]
        keep = np.ones(len(run.events), dtype=bool)
        for k in np.flatnonzero(kind == "accumulation"):
            own = (contact == contact[k]) & (np.abs(time - time[k]) <= TIME_TOLERANCE)
            keep[:k] &= ~(own & (kind == "impact"))[:k]
            for stop in np.flatnonzero(own & (kind == "velocity") & (np.arange(time.size) > k))[:1]:
                keep[stop] = False
                after[k : stop + 1] = [
                    letters[: contact[k]] + after[stop][contact[k]] + letters[contact[k] + 1 :]
                    for letters in after[k : stop + 1]
                ]
        what = [(int(contact[k]), str(kind[k]), after[k]) for k in np.flatnonzero(keep)]
        return cls(time[keep], what)

    def common(self, other: EventList) -> int:
        """Return how many events are the same before the first that is not."""
        pairs = zip(self.what, other.what, strict=False)
        shortest = min(len(self.what), len(other.what))
        return next((k for k, (a, b) in enumerate(pairs) if a != b), shortest)


def effect(one: EventList, nudged: EventList) -> np.ndarray:
    """Return what the nudge has moved event times by so far, s, for the events it has kept."""
    steady = one.common(nudged)
    return np.maximum.accumulate(np.abs(one.time[:steady] - nudged.time[:steady]))


@dataclass(frozen=True)
class Comparison:
    """How two runs of one scene differ."""

    #: ``ok``, ``sensitive``, ``near tie``, ``times`` or ``events``
    verdict: str
    detail: str
    #: number of events compared
    compared: int
    #: largest difference of their times, s
    difference: float


def compare(
    modal: ss.Trajectory, taylor: ss.Trajectory, nudged: tuple[ss.Trajectory, ss.Trajectory]
) -> Comparison:
    """Return how the events of a scene by modes and by Taylor series differ.

    `nudged` are runs by modes and by Taylor series that start as near to these as rounding leaves them. What
    the nudge moves event times by, so far, times `SPREAD`, is what they may differ by, or `TIME_TOLERANCE` if
    more; of the two methods the one that it moves less counts, so that a fault of one can't excuse itself. A
    *sensitive* scene is compared up to where that is `HORIZON`; a *near tie* is an event that neither nudged
    run shares. Nothing else excuses a difference.
    """
    one, other = EventList.of(modal), EventList.of(taylor)
    effects = [effect(first, EventList.of(run)) for first, run in zip((one, other), nudged, strict=True)]
    common, steady = one.common(other), max(len(moved) for moved in effects)
    known = [np.concatenate([moved, np.full(steady - len(moved), np.inf)]) for moved in effects]
    moved = np.minimum(*known)
    horizon = int(np.searchsorted(moved, HORIZON))
    judged = min(common, horizon)
    difference = np.abs(one.time[:judged] - other.time[:judged])
    allowed = np.maximum(TIME_TOLERANCE, SPREAD * moved[:judged])
    largest = float(difference.max(initial=0.0))
    if (difference > allowed).any():
        k = int(np.argmax(difference > allowed))
        detail = f"event {k}: {difference[k]:.2e} s apart, allowed {allowed[k]:.2e}"
        return Comparison("times", detail, judged, largest)
    cut = "max_events" in (modal.stop_reason, taylor.stop_reason)
    ends = min(len(one.what), len(other.what)) if cut else max(len(one.what), len(other.what))
    if common == ends:
        return Comparison("ok" if judged == ends else "sensitive", "", judged, largest)
    if horizon <= common:
        verdict = "sensitive" if horizon < steady else "near tie"
        return Comparison(verdict, f"from event {horizon} on", judged, largest)
    at = [float(events.time[common]) if common < len(events.time) else None for events in (one, other)]
    return Comparison("events", f"event {common} differs: {at}", judged, largest)


def complementarity(run: ss.Trajectory) -> str:
    """Return where g >= 0, N >= 0, the friction cone or slip against friction fails, or ``""``.

    Between events, to rounding of the terms.
    """
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    inside = (edges[:-1, None] + np.diff(edges)[:, None] * np.array([0.01, 0.3, 0.6, 0.99])).ravel()
    times = np.union1d(inside, np.linspace(0.0, run.duration, 301))
    # Not at the events themselves, where two statuses share an instant.
    data = run.sample(times[(times > 0.0) & (times < run.duration) & ~np.isin(times, edges)])
    position, velocity, status = data.position.values, data.velocity.values, data.status.values
    _, damping, stiffness = (np.abs(matrix) for matrix in matrices(run.scene))
    load = np.abs(position) @ stiffness + np.abs(velocity) @ damping + np.abs(run.scene.force)
    length = SLACK * np.abs(position).max()
    for i, contact in enumerate(run.scene.contacts):
        t, n = 4 * i + 2, 4 * i + 3
        static = contact.static_friction
        force = SLACK * (load[:, n] + load[:, t])
        speed = SLACK * max(np.abs(velocity).max(), abs(contact.slider_speed))
        gap, slip = position[:, n], velocity[:, t] - contact.slider_speed
        normal, friction = data.normal_force.values[:, i], data.friction_force.values[:, i]
        letter = status[:, i]
        closed = letter != "d"
        checks = {
            "penetration": gap < -length,
            "gap of a closed contact": closed & (gap != 0.0),
            "tension": closed & (normal < -force),
            "force of an open contact": ~closed & ((normal != 0.0) | (friction != 0.0)),
            "friction cone": np.abs(friction) > static * normal + (1 + static) * force,
            "slip while sticking": (letter == "s") & (slip != 0.0),
            "slip along friction": ((letter == "+") & (slip > speed) | (letter == "-") & (slip < -speed))
            & (contact.friction > 0.0),
        }
        for name, violated in checks.items():
            if violated.any():
                k = int(np.argmax(violated))
                values = f"N {normal[k]:.3e}, T {friction[k]:.3e}, g {gap[k]:.3e}, s {slip[k]:.3e}"
                return f"{name} at contact {i}, t = {float(data.time[k])!r}: {values}"
    return ""


def impact_instants(run: ss.Trajectory) -> np.ndarray:
    """Return the last event of every instant at which a gap closed."""
    closing = np.isin(run.events.kind, ["impact", "accumulation"])
    return np.searchsorted(run.events.time, np.unique(run.events.time[closing]), side="right") - 1


def impact_law(run: ss.Trajectory) -> str:
    """Return where ``g'+ = -e g'-`` or the Coulomb impulse fails, or something else jumps, or ``""``.

    At instants of one impact.
    """
    events, contacts = run.events, run.scene.contacts
    instants = impact_instants(run)
    single = (events.kind[instants] == "impact") & (np.diff(events.time, prepend=-1.0)[instants] > 0.0)
    single &= events.time[instants] > 0.0
    instants = instants[single]
    if instants.size == 0:
        return ""
    before = run.sample(np.nextafter(events.time[instants], 0.0))
    after = run.event_states()[1][instants]
    velocity = before.velocity.values
    mass, damping, stiffness = matrices(run.scene)
    # What forces change within the two ulp of time between the states compared.
    load = np.abs(before.position.values) @ np.abs(stiffness) + np.abs(velocity) @ np.abs(damping)
    drift = 2.0 * np.spacing(events.time[instants])[:, None] * (load + np.abs(run.scene.force)) / mass
    slack = drift + SLACK * np.abs(velocity).max(axis=1)[:, None]
    which = events.contact[instants]
    row = np.arange(instants.size)
    t, n = 4 * which + 2, 4 * which + 3
    restitution = np.array([contact.restitution for contact in contacts])[which]
    friction = np.array([contact.friction for contact in contacts])[which] * run.scene.impact_friction
    speed = np.array([contact.slider_speed for contact in contacts])[which]
    approach = -velocity[row, n]
    expected = velocity.copy()
    expected[row, n] = restitution * approach
    slip = velocity[row, t] - speed
    reach = friction * (1.0 + restitution) * approach * mass[n] / mass[t]
    expected[row, t] -= np.clip(slip, -reach, reach)
    off = np.abs(after - expected) > slack
    if off.any():
        k, dof = np.unravel_index(np.argmax(off), off.shape)
        values = f"{velocity[k, dof]!r} -> {after[k, dof]!r}, expected {expected[k, dof]!r}"
        return f"impact of contact {which[k]} at {events.time[instants[k]]!r}: velocity {dof} {values}"
    return ""


def energy_residual(run: ss.Trajectory) -> float:
    """Return the residual of the energy balance over the sum of absolute work terms.

    The change of ``1/2 u' M u + 1/2 x' K x``, less what impacts change it by, against the Gauss quadrature of
    contact, external and damping power.
    """
    mass, damping, stiffness = matrices(run.scene)
    times, weights, until = quadrature(run)
    data = run.sample(times)
    velocity = data.velocity.values
    powers = [
        *(data.friction_force.values * velocity[:, 2::4]).T,
        velocity @ run.scene.force,
        -np.sum((velocity @ damping) * velocity, axis=1),
    ]

    def energy(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        return 0.5 * (velocity**2 @ mass + np.sum((position @ stiffness) * position, axis=-1))

    end = run.state(until)
    change = float(energy(end.position, end.velocity) - energy(run.start.position, run.start.velocity))
    instants = impact_instants(run)
    instants = instants[run.events.time[instants] <= until]
    before = run.sample(np.nextafter(run.events.time[instants], 0.0))
    position, velocity = (states[instants] for states in run.event_states())
    jumps = energy(position, velocity) - energy(before.position.values, before.velocity.values)
    works = [weights @ power for power in powers]
    turnover = sum(weights @ np.abs(power) for power in powers) + np.abs(jumps).sum() + abs(change)
    return float(abs(change - sum(works) - jumps.sum()) / turnover)


def quadrature(run: ss.Trajectory) -> tuple[np.ndarray, np.ndarray, float]:
    """Return Gauss points and weights between the events, and the time up to which they reach.

    They are as dense as the fastest motion of a phase asks, up to `MOST_POINTS`.
    """
    edges = np.concatenate([[0.0], run.events.time, [run.duration]])
    combinations = np.concatenate([[run.start.combination], run.events.combination])
    names, which = np.unique(combinations, return_inverse=True)
    fastest = np.array([np.abs(ss.complex_modes(run.scene, str(name)).eigenvalues).max() for name in names])
    turn = fastest[which] * np.diff(edges)
    # The sparsest rule spends so many points on a turn of one, and some on every phase.
    size, largest = RULES[-1]
    points = np.concatenate([[0.0], np.cumsum(turn * size / largest + RULES[0][0])])
    until = float(np.interp(MOST_POINTS, points, edges))
    edges = np.minimum(edges, until)
    turn = fastest[which] * np.diff(edges)
    times, weights = [], []
    smallest = 0.0
    for size, largest in RULES:
        last = size == RULES[-1][0]
        chosen = np.flatnonzero((turn > smallest) & ((turn <= largest) | last))
        smallest = largest
        pieces = np.ceil(turn[chosen] / largest).astype(int)
        phase = np.repeat(chosen, pieces)
        step = np.diff(edges)[phase] / np.repeat(pieces, pieces)
        number = np.arange(phase.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        nodes, gauss = np.polynomial.legendre.leggauss(size)
        begin = edges[phase] + number * step
        times.append((begin[:, None] + 0.5 * step[:, None] * (1.0 + nodes)).ravel())
        weights.append((0.5 * step[:, None] * gauss).ravel())
    order = np.argsort(np.concatenate(times), kind="stable")
    return np.concatenate(times)[order], np.concatenate(weights)[order], until
