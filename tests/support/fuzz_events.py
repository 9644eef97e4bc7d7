"""Events of two runs of one scene compared, with what rounding may change of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import stickslip as ss
from fuzz_terms import contact_directions, forces, matrices, slider_speeds

#: What may come of a scene; near ties are counted, since they are where a difference could hide. *Several* is
#: a run that ends where its contact problem has several solutions for a reason that holds (`undecided`).
PASSED = ("ok", "sensitive", "near tie", "several")
#: s; the figure that the campaign promises, far above what well-conditioned runs need
TIME_TOLERANCE = 1e-9
#: s; the time of a touch, where a force is level, is known to the root of rounding.
TOUCH = 1e-8
#: s, and ulp of the time or of a displacement: events that are less apart have no order.
UNORDERED, UNORDERED_ULP = 2e-16, 2
#: s; where contact directions depend on each other, events that follow each other faster, at more instants
#: than so many, are a series.
IN_TURN, SERIES = 1e-12, 4
#: Relative change of the states of nudged runs, entry by entry: some thousand ulp. The condition of the modes
#: lets rounding be some hundred.
NUDGE = 1e-12
#: Change besides, of the largest entry or of the displacements at which the loads would be held: a
#: superposition about these leaves some ulp of them in every entry, and a gap may be 1e-9 of them.
NOISE = 1e-15
#: Change of velocities besides, of such displacements times the fastest rate: a panel of a series lets
#: rounding grow up to seventyfold; 3e-15 were measured against 45 digits.
NOISE_OF_SERIES = 1e-14
#: Nudged runs besides the one from the start.
RESTARTS = 8
#: Directions of nudges: one, and more before a difference counts. A single one may hardly touch what grows.
DIRECTIONS = (1, 12)
#: Times the effect of one nudge: rounding acts in any direction.
SPREAD = 10.0
#: s; what a nudge moves further is not judged: collisions of several masses grow it tenfold each.
HORIZON = 1e-6


@dataclass(frozen=True)
class EventList:
    """Events by number, with what an accumulating contact does within the tolerance taken as one event.

    How many bounces there are before the clock can't tell them apart is a matter of rounding, and so is the
    sign of a slip velocity that the last of them left. Where mass couples contacts, each bounce may stop the
    slip of another one, which then vanishes at the limit.
    """

    time: np.ndarray
    contact: np.ndarray
    kind: np.ndarray
    after: np.ndarray

    @classmethod
    def of(cls, run: ss.Trajectory, limits: Sequence[tuple[float, int, str]] = ()) -> EventList:
        """Return the events of a run, to be compared with one of which these are the `limits`.

        An accumulation ends a series whose rest is below rounding. If the last impact of a series leaves the
        contact closed, by rounding as well, no accumulation comes any more: that impact counts as one.

        Where the other run touches a friction limit, this one may slip, and stick again at once: a body that
        a vibrating slider carries brings its node to one limit in every period, whatever its state is.
        """
        time, contact, after = (
            part.copy() for part in (run.events.time, run.events.contact, run.events.combination)
        )
        # Wide enough for any kind.
        kind = run.events.kind.astype("U12")
        listed = [(t, i, TIME_TOLERANCE) for t, i, what in limits if what == "accumulation"]
        if run.scene.core.dependent:
            # So does an impact in the instant in which the series of another contact ends.
            ends = [t for t, _, what in limits_of(run) if what == "accumulation"]
            listed += [(t, i, IN_TURN) for t in ends for i in range(len(run.scene.contacts))]
        for limit, which, apart in listed:
            own = np.flatnonzero((contact == which) & (np.abs(time - limit) <= apart))
            last = own[np.isin(kind[own], ["impact", "accumulation"])][-1:]
            kind[[k for k in last if after[k][which] != "d"]] = "accumulation"
        keep = np.ones(time.size, dtype=bool)
        for touch, which, what in limits:
            if what not in ("slip+", "slip-"):
                continue
            own = np.flatnonzero((contact == which) & (np.abs(time - touch) <= TOUCH))
            if list(kind[own]) == [what, "velocity"] and own[0] > 0 and after[own[1]] == after[own[0] - 1]:
                keep[own] = False
        coupled = run.scene.mass.ndim == 2 or run.scene.core.dependent
        # Where directions depend on each other, a contact may open and close again on the way to a limit.
        repeated = ["impact", "accumulation", "release"] if run.scene.core.dependent else ["impact"]
        # An accumulation that would be merged with the last events may be missing, or stops that follow it.
        until = time[-1] - 2.0 * TIME_TOLERANCE if run.stop_reason == "max_events" else np.inf
        for k in np.flatnonzero(kind == "accumulation"):
            first, last = np.searchsorted(time, [time[k] - TIME_TOLERANCE, time[k] + TIME_TOLERANCE])
            near = np.arange(first, last)
            own = contact[near] == contact[k]
            keep[near[own & np.isin(kind[near], repeated) & (near < k)]] = False
            stops = near[(kind[near] == "velocity") & own & (near > k)]
            if coupled:
                stops = near[np.isin(kind[near], ["velocity", "slip+", "slip-"])]
            keep[stops] = False
            # What has stopped has done so at the limit.
            for i in np.unique(contact[stops]):
                final = after[stops[contact[stops] == i][-1]][i]
                for j in range(min(k, stops[0]), max(k, stops[-1]) + 1):
                    after[j] = after[j][:i] + final + after[j][i + 1 :]
        if run.scene.core.dependent:
            # Slips and impacts in turn, without an accumulation: their limit is one event of all in it.
            for group in np.split(np.arange(time.size), np.flatnonzero(np.diff(time) > IN_TURN) + 1):
                if np.unique(time[group]).size <= SERIES or (kind[group] == "accumulation").any():
                    continue
                middle = np.median(time[group])
                if time[group[-1]] - middle < middle - time[group[0]]:
                    keep[group[:-1]] = False
                    taking_part = sum(1 << int(i) for i in np.unique(contact[group]))
                    contact[group[-1]], kind[group[-1]] = -1 - taking_part, "limit"
        keep &= time < until
        time, contact, kind, after = time[keep], contact[keep], kind[keep], after[keep]
        # Two nodes on one body that came to rest with it slip again at one place: by one method at once, by
        # the other one after the other.
        distance = np.diff(time)
        apart = distance > np.maximum(UNORDERED, UNORDERED_ULP * np.spacing(time[1:]))
        for k in np.flatnonzero(apart & (distance <= IN_TURN)):
            apart[k] = distance[k] > max(resolution(run, time[j], contact[j], kind[j]) for j in (k, k + 1))
        for group in np.split(np.arange(time.size), np.flatnonzero(apart) + 1):
            order = group[np.lexsort((kind[group], contact[group]))]
            contact[group], kind[group] = contact[order], kind[order]
            after[group] = after[group[-1:]]
        return cls(time, contact, kind, after)

    def since(self, begin: float) -> EventList:
        """Return the events from a time on."""
        later = self.time >= begin
        return EventList(*(part[later] for part in (self.time, self.contact, self.kind, self.after)))

    def __len__(self) -> int:
        return self.time.size

    def common(self, other: EventList) -> int:
        """Return how many events are the same before the first that is not."""
        n = min(len(self), len(other))
        differs = (
            (self.contact[:n] != other.contact[:n])
            | (self.kind[:n] != other.kind[:n])
            | (self.after[:n] != other.after[:n])
        )
        return int(np.argmax(differs)) if differs.any() else n


def limits_of(run: ss.Trajectory) -> list[tuple[float, int, str]]:
    """Return the accumulations and touches of a run: time, s, contact, and what a touch could have been."""
    listed = np.flatnonzero(run.events.kind == "accumulation")
    ends = [(float(run.events.time[k]), int(run.events.contact[k]), "accumulation") for k in listed]
    return ends + [(touch.time, touch.contact, touch.alternative) for touch in run.grazings]


def resolution(run: ss.Trajectory, time: float, contact: int, kind: str) -> float:
    """Return what two ulp of the displacements at its contact move an event at a place by, s.

    A gap closes at a place, and a node without mass slips at one; other events, and the limit of several
    contacts, have 0.
    """
    if contact < 0 or kind not in ("slip+", "slip-", "impact", "closing"):
        return 0.0
    scene, state = run.scene, run.state(np.nextafter(time, 0.0))
    tangential, normal = (directions[contact] for directions in contact_directions(scene))
    own = scene.contacts[contact]
    if kind in ("impact", "closing"):
        speed = normal @ state.velocity
        size = np.abs(normal) @ np.abs(state.position) + abs(own.gap)
    elif own.tangential_stiffness is None:
        return 0.0
    else:
        speed = tangential @ state.velocity - slider_speeds(scene, np.array([time]))[0, contact]
        size = np.abs(tangential) @ np.abs(state.position)
    return float(UNORDERED_ULP * np.spacing(size) / abs(speed)) if speed != 0.0 else 0.0


def at_rest(scene: ss.Scene) -> float:
    """Return a bound of the displacements at which the loads would be held without contacts, m."""
    loads = np.abs(forces(scene, np.linspace(0.0, 0.1, 64))).max(axis=0)
    return float((np.abs(np.linalg.inv(matrices(scene)[2])) @ loads).max())


def nearby(scene: ss.Scene, state: ss.State, direction: int = 0, time: float = 0.0) -> ss.State:
    """Return the state at a time moved by `NUDGE` and `NOISE`.

    What closed and sticking contacts hold stays so.
    """
    pattern = np.cos((1 + direction) * np.arange(state.velocity.size))
    status = list(enumerate(state.combination))
    tangential, normal = contact_directions(scene)
    closed = [dof for i, letter in status if letter != "d" for dof in np.flatnonzero(normal[i])]
    sticking = [dof for i, letter in status if letter == "s" for dof in np.flatnonzero(tangential[i])]

    def moved(entries: np.ndarray, size: float, pattern: np.ndarray, held: list[int]) -> np.ndarray:
        result = entries + (NUDGE * entries + NOISE * size) * pattern
        result[held] = entries[held]
        return result

    size = max(np.abs(state.position).max(), at_rest(scene))
    position = moved(state.position, size, pattern, closed)
    # What flies stays off its slider by what is nudged: a state on it and closing is no start.
    for (i, letter), contact in zip(status, scene.contacts, strict=True):
        if np.count_nonzero(normal[i]) == 1 and (letter == "d" or contact.normal_stiffness is None):
            (dof,) = np.flatnonzero(normal[i])
            least = NOISE * size if letter == "d" else 0.0
            position[dof] += max(least - normal[i, dof] * position[dof] - contact.gap, 0.0) / normal[i, dof]
    mass, _, stiffness = matrices(scene)
    rate = np.sqrt((np.abs(stiffness).sum(axis=1) / np.diag(mass)).max())
    speed = max(np.abs(state.velocity).max(), NOISE_OF_SERIES / NOISE * rate * size)
    velocity = moved(state.velocity, speed, pattern[::-1], closed + sticking)
    # What has hardly begun to slide goes on to.
    slip = tangential @ velocity - slider_speeds(scene, np.array([time]))[0]
    for (i, letter), along in zip(status, slip, strict=True):
        if (letter == "+" and along > 0.0) or (letter == "-" and along < 0.0):
            begins = tangential[i] != 0.0
            velocity[begins] = state.velocity[begins]
    return ss.State(position, velocity, state.combination, friction_force=state.friction_force)


def sensitivity(
    run: ss.Trajectory,
    follow: Callable[[ss.State, float, float], ss.Trajectory],
    directions: int = 1,
    limits: Sequence[tuple[float, int, str]] = (),
) -> np.ndarray:
    """Return what nudges have moved the time of each event by so far, s; infinite from where they change one.

    Rounding acts all along: a dissipative scene forgets its start, and amplifies what comes later. So the run
    is nudged at its start and within the longest phase of every eighth of its events, and followed again; in
    another direction of every ninth, and so on. The limits are those of the run to compare with.
    """
    events, edges = EventList.of(run, limits), np.concatenate([[0.0], run.events.time])
    spans, middles = np.diff(edges), 0.5 * (edges[:-1] + edges[1:])
    moved = np.zeros(len(events))
    for direction in range(directions):
        parts = [part for part in np.array_split(np.arange(spans.size), RESTARTS + direction) if part.size]
        starts = [(0.0, run.start)]
        starts += [
            (t, run.state(t)) for t in (float(middles[part[np.argmax(spans[part])]]) for part in parts)
        ]
        for begin, state in starts:
            nudged = follow(nearby(run.scene, state, direction, begin), run.duration - begin, begin)
            later = EventList.of(nudged, [(t - begin, *rest) for t, *rest in (*limits_of(run), *limits)])
            tail = events.since(begin)
            same = tail.common(later)
            effect = np.full(len(tail), np.inf)
            effect[:same] = np.abs(tail.time[:same] - begin - later.time[:same])
            moved[len(events) - len(tail) :] = np.maximum(moved[len(events) - len(tail) :], effect)
    return np.maximum.accumulate(moved)


@dataclass(frozen=True)
class Comparison:
    """How two runs of one scene differ."""

    #: ``ok``, ``sensitive``, ``near tie``, ``times`` or ``events``
    verdict: str
    detail: str
    #: number of events compared, and of events at all when bounces at their limit are one
    compared: int
    distinct: int
    #: largest difference of their times, s
    difference: float


def compare(
    modal: ss.Trajectory, taylor: ss.Trajectory, moved: Callable[[int], tuple[np.ndarray, np.ndarray]]
) -> Comparison:
    """Return how the events of a scene by modes and by Taylor series differ.

    Events that are the same at times less than `TIME_TOLERANCE` apart need no excuse. For the others `moved`
    is asked for the `sensitivity` of both runs, at first in one direction: that times `SPREAD` is what times
    may differ by; of the two methods the one that is moved less counts, so that a fault of one can't excuse
    itself. A *sensitive* scene is compared up to where that is `HORIZON`; a *near tie* is an event that
    nudged runs of neither method share. Nothing else excuses a difference.
    """
    one = EventList.of(modal, limits_of(taylor))
    other = EventList.of(taylor, limits_of(modal))
    common = one.common(other)
    difference = np.abs(one.time[:common] - other.time[:common])
    late = difference > TIME_TOLERANCE
    agreeing = int(np.argmax(late)) if late.any() else common
    cut = "max_events" in (modal.stop_reason, taylor.stop_reason)
    ends = min(len(one), len(other)) if cut else max(len(one), len(other))

    def verdict(name: str, judged: int, detail: str = "") -> Comparison:
        return Comparison(name, detail, judged, ends, float(difference[:judged].max(initial=0.0)))

    if agreeing == ends:
        return verdict("ok", ends)

    def judge(each: tuple[np.ndarray, np.ndarray]) -> Comparison:
        effect = np.minimum(*(np.concatenate([part, np.full(ends + 1, np.inf)])[: ends + 1] for part in each))
        horizon = int(np.searchsorted(effect, HORIZON))
        judged = min(common, horizon)
        allowed = np.maximum(TIME_TOLERANCE, SPREAD * effect[:judged])
        wrong = difference[:judged] > allowed
        if wrong.any():
            k = int(np.argmax(wrong))
            detail = f"event {k}: {difference[k]:.2e} s apart, allowed {allowed[k]:.2e}"
            return verdict("times", judged, detail)
        if judged == ends:
            return verdict("ok", judged)
        judged = max(judged, agreeing)
        if horizon <= common:
            name = "sensitive" if np.isfinite(effect[horizon]) else "near tie"
            return verdict(name, judged, f"from event {judged} on")
        at = [float(events.time[common]) if common < len(events) else None for events in (one, other)]
        return verdict("events", judged, f"event {common} differs: {at}")

    for directions in DIRECTIONS:
        comparison = judge(moved(directions))
        if comparison.verdict in PASSED:
            break
    return comparison
