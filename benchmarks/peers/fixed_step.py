"""Fixed steps of the Dormand-Prince method, compiled by numba.

Event functions are looked at after every step; where one has become negative, the last step is made again,
shorter, until it ends in the zero: the event is as exact as the method. The right side is one matrix of
accelerations, in the order the vector units like.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from peer_integrator import Mechanics, Motion
from peers.restart import MOST_EVENTS, OPEN, SLIPPING

STATUSES = "+-sd"
KINDS = ("velocity", "release", "slip+", "slip-", "impact")
#: Of the zero, relative to the step.
RESOLUTION = 1e-15
#: Dormand and Prince (1980), table 2: nodes are not needed, the system is autonomous.
STAGES = np.array(
    [
        [1 / 5, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ]
)
WEIGHTS = np.array([35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84])


@njit(fastmath={"contract"})
def rates(matrix, offset, y, rate):  # type: ignore[no-untyped-def]
    n = offset.size
    for i in range(n):
        rate[i] = y[n + i]
        rate[n + i] = offset[i]
    for j in range(2 * n):
        for i in range(n):
            rate[n + i] += matrix[j, i] * y[j]


@njit(fastmath={"contract"})
def step(matrix, offset, y, h, stages, work, end):  # type: ignore[no-untyped-def]
    """y after h, from y and its rate in stages[0]."""
    for s in range(5):
        work[:] = y
        for j in range(s + 1):
            factor = h * STAGES[s, j]
            for i in range(y.size):
                work[i] += factor * stages[j, i]
        rates(matrix, offset, work, stages[s + 1])
    end[:] = y
    for j in range(6):
        factor = h * WEIGHTS[j]
        for i in range(y.size):
            end[i] += factor * stages[j, i]


@njit
def value(row, y):  # type: ignore[no-untyped-def]
    total = row[y.size]
    for i in range(y.size):
        total += row[i] * y[i]
    return total


@njit
def march(matrices, offsets, rows, counts, kinds, owners, forces, normal, tangential, speed, static,
          code, y, h, duration, times, contacts, found, codes):  # type: ignore[no-untyped-def]  # fmt: skip
    """Follow the motion; returns the number of events."""
    n, c = offsets.shape[1], normal.size
    stages, work, end = np.empty((6, 2 * n)), np.empty(2 * n), np.empty(2 * n)
    events, time, phase, steps = 0, 0.0, 0.0, 0
    rates(matrices[code], offsets[code], y, stages[0])
    while time < duration and events < times.size:
        last = time + h >= duration
        width = duration - time if last else h
        step(matrices[code], offsets[code], y, width, stages, work, end)
        first, at = -1, width
        for k in range(counts[code]):
            row = rows[code, k]
            if value(row, end) >= 0.0:
                continue
            # Regula falsi with the Illinois rule on steps of other lengths.
            low, high, f_low, f_high, side = 0.0, at, value(row, y), value(row, end), 0
            if at < width:
                step(matrices[code], offsets[code], y, at, stages, work, end)
                f_high = value(row, end)
                if f_high >= 0.0:
                    continue
            best, least = high, -f_high
            for _ in range(60):
                if high - low <= RESOLUTION * width:
                    break
                middle = (low * f_high - high * f_low) / (f_high - f_low)
                if not low < middle < high:
                    break
                step(matrices[code], offsets[code], y, middle, stages, work, end)
                f = value(row, end)
                if abs(f) <= least:
                    best, least = middle, abs(f)
                if f < 0.0:
                    high, f_high = middle, f
                    f_low *= 0.5 if side == 1 else 1.0
                    side = 1
                else:
                    low, f_low = middle, f
                    f_high *= 0.5 if side == -1 else 1.0
                    side = -1
                if f == 0.0:
                    break
            first, at = k, best
            step(matrices[code], offsets[code], y, width, stages, work, end)
        if first < 0:
            # From the start of the phase, so that rounding does not add up over its steps.
            steps += 1
            time = duration if last else phase + steps * h
            y[:] = end
            rates(matrices[code], offsets[code], y, stages[0])
            continue
        step(matrices[code], offsets[code], y, at, stages, work, end)
        time += at
        phase, steps = time, 0
        y[:] = end
        contact, kind = owners[code, first], kinds[code, first]
        place = 4 ** (c - 1 - contact)
        others = code - (code // place) % 4 * place
        t, m = n + tangential[contact], normal[contact]
        if kind == 0:
            y[t] = speed[contact]
            sticking = others + 2 * place
            load = value(forces[sticking, contact, 1], y)
            limit = static[contact] * value(forces[sticking, contact, 0], y)
            status = 2 if abs(load) <= limit else (0 if load > 0.0 else 1)
        elif kind == 1:
            status = 3
        elif kind == 4:
            y[m] = 0.0
            y[n + m] = 0.0
            status = 0 if y[t] < speed[contact] else 1
            if value(forces[others + status * place, contact, 0], y) < 0.0:
                status = 3
        else:
            status = kind - 2
        if status == 3:
            y[m] = max(y[m], OPEN)
        elif status < 2 and y[t] == speed[contact]:
            y[t] *= 1.0 - SLIPPING if status == 0 else 1.0 + SLIPPING
        code = others + status * place
        rates(matrices[code], offsets[code], y, stages[0])
        times[events], contacts[events], found[events], codes[events] = time, contact, kind, code
        events += 1
    return events


def prepare(scene: Any, start: Any, duration: float, longest: float) -> Callable[[], Motion]:
    """Return the run with steps of `longest`, s."""
    mechanics = Mechanics(scene)
    n, c = scene.size, len(scene.contacts)
    total = 4**c
    matrices, offsets = np.zeros((total, 2 * n, n)), np.zeros((total, n))
    rows, counts = np.zeros((total, 2 * c, 2 * n + 1)), np.zeros(total, dtype=np.int64)
    kinds, owners = np.zeros((total, 2 * c), dtype=np.int64), np.zeros((total, 2 * c), dtype=np.int64)
    forces = np.zeros((total, c, 2, 2 * n + 1))
    names = []
    for code in range(total):
        name = "".join(STATUSES[(code // 4 ** (c - 1 - i)) % 4] for i in range(c))
        names.append(name)
        generator, offset, contact_forces = mechanics.linear(name)
        matrices[code], offsets[code] = generator[n:].T, offset[n:]
        for contact, pair in enumerate(contact_forces):
            for which, (row, constant) in enumerate(pair):
                forces[code, contact, which] = [*row, constant]
        for k, (contact, kind, row, constant) in enumerate(mechanics.event_functions(name)):
            rows[code, k], kinds[code, k], owners[code, k] = [*row, constant], KINDS.index(kind), contact
            counts[code] += 1
    normal = np.array([law.normal for law in scene.contacts])
    tangential = np.array([law.tangential for law in scene.contacts])
    speed = np.array([law.slider_speed for law in scene.contacts])
    static = np.array(mechanics.static)
    initial = np.concatenate([start.position, start.velocity])
    first = names.index(start.combination)
    times = np.zeros(MOST_EVENTS)
    contacts, found, codes = (np.zeros(MOST_EVENTS, dtype=np.int64) for _ in range(3))

    def run() -> Motion:
        count = march(
            matrices, offsets, rows, counts, kinds, owners, forces, normal, tangential, speed, static,
            first, initial.copy(), longest, duration, times, contacts, found, codes,
        )  # fmt: skip
        return Motion(
            times[:count].tolist(),
            contacts[:count].tolist(),
            [KINDS[kind] for kind in found[:count]],
            [names[code] for code in codes[:count]],
        )

    return run
