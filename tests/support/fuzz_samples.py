"""A run of the fuzz campaign at the times that the checks look at."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

import stickslip as ss
from fuzz_terms import fastest, matrices

#: Quadrature: Gauss nodes, and the largest rate times span for which they leave less than 1e-12 of a power,
#: which turns twice as fast as the motion.
RULES = ((3, 0.05), (5, 0.5), (8, 2.3), (12, 6.0), (20, 16.0), (32, 34.0))
#: Quadrature points, about, after which the energy of a scene is not followed further.
MOST_POINTS = 30_000
#: Panels of a Taylor run that are computed once more to sample it.
MOST_PANELS = 3000


@dataclass(frozen=True)
class Instants:
    """Motion and contact forces at some times of a run: (k,), (k, n) and (k, c)."""

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    status: np.ndarray


class Sampled:
    """A run and what the checks need of it, up to a time, in one pass over the motion."""

    def __init__(self, run: ss.Trajectory, powers: bool = True, density: float = 1.0) -> None:
        self.run = run
        self.matrices = matrices(run.scene)
        self.until = run.duration
        if run.counters["taylor_phases"]:
            self.until *= min(1.0, MOST_PANELS / run.counters["panels"])
        time = run.events.time
        closing = np.isin(run.events.kind, ["impact", "accumulation"]) & (time <= self.until)
        #: The last event of every instant at which a gap closed.
        self.impacts = np.searchsorted(time, np.unique(time[closing]), side="right") - 1
        groups = [self._between(), np.nextafter(time[self.impacts], 0.0)]
        self.weights, self.powers_until = np.empty(0), 0.0
        if powers:
            points, self.weights, self.powers_until = quadrature(run, self.until, density)
            groups.append(points)
        times = np.concatenate(groups)
        order = np.argsort(times, kind="stable")
        place = np.empty_like(order)
        place[order] = np.arange(order.size)
        data = run.core.sample(times[order])
        rows = np.split(place, np.cumsum([group.size for group in groups])[:-1])
        parts = [
            Instants(group, *(np.asarray(values)[at] for values in data))
            for group, at in zip(groups, rows, strict=True)
        ]
        self.between, self.before = parts[:2]
        self.at_nodes = parts[-1]

    def _between(self) -> np.ndarray:
        """Return times between events; not at these, where two statuses share an instant."""
        edges = np.concatenate([[0.0], self.run.events.time, [self.run.duration]])
        inside = (edges[:-1, None] + np.diff(edges)[:, None] * np.array([0.01, 0.3, 0.6, 0.99])).ravel()
        times = np.unique(np.concatenate([inside, np.linspace(0.0, self.run.duration, 301)]))
        times = times[(times > 0.0) & (times < self.until)]
        return times[edges[np.searchsorted(edges, times)] != times]

    @cached_property
    def after(self) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity just after the impacts."""
        position, velocity = self.run.event_states()
        return position[self.impacts], velocity[self.impacts]


@cache
def gauss(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes in [0, 1] and weights of the Gauss rule."""
    nodes, weights = np.polynomial.legendre.leggauss(size)
    return 0.5 * (1.0 + nodes), 0.5 * weights


def quadrature(run: ss.Trajectory, end: float, density: float = 1.0) -> tuple[np.ndarray, np.ndarray, float]:
    """Return Gauss points and weights between the events, and the time up to which they reach.

    They are as dense as the fastest motion asks that has not died out in its phase, or a multiple of that, up
    to `MOST_POINTS`.
    """
    edges = np.minimum(np.concatenate([[0.0], run.events.time, [run.duration]]), end)
    combinations = np.concatenate([[run.start.combination], run.events.combination])
    names, which = np.unique(combinations, return_inverse=True)
    # Stages of the phases: rates that fall as modes die out, with the local times at which they do.
    fades, rates = fastest(run.scene, [str(name) for name in names])
    lasting = np.minimum(fades[which], np.diff(edges)[:, None])
    begin = np.column_stack([np.zeros(which.size), lasting[:, :-1]])
    phase, stage = np.nonzero(lasting > begin)
    begin, span = edges[phase] + begin[phase, stage], (lasting - begin)[phase, stage]
    turn = density * rates[which][phase, stage] * span
    # The sparsest rule spends so many points on a turn of one, and some on every stage.
    size, largest = RULES[-1]
    within = np.cumsum(turn * size / largest + RULES[0][0]) <= MOST_POINTS
    until = end if within.all() else float(begin[np.argmin(within)])
    begin, span, turn = begin[within], span[within], turn[within]
    times, weights = [], []
    smallest = -1.0
    for size, largest in RULES:
        last = size == RULES[-1][0]
        chosen = np.flatnonzero((turn > smallest) & ((turn <= largest) | last))
        smallest = largest
        pieces = np.maximum(np.ceil(turn[chosen] / largest), 1).astype(int)
        part = np.repeat(chosen, pieces)
        step = span[part] / np.repeat(pieces, pieces)
        number = np.arange(part.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        nodes, shares = gauss(size)
        times.append(((begin[part] + number * step)[:, None] + step[:, None] * nodes).ravel())
        weights.append((step[:, None] * shares).ravel())
    return np.concatenate(times), np.concatenate(weights), until
