"""Contacts without mass by brute force: an independent reference of the theory, slow and short.

``M_ii x_i'' + C_ii x_i' + (K x)_i = F_i`` and ``(K x)_b = F_b + B p``. In each status combination ``x_b``
and the contact forces ``p`` solve one linear system; the rest is integrated numerically, and after each
event every combination is tried against the inequalities of the quasi-static contact problem.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

SIGN = {"+": 1.0, "-": -1.0}


@dataclass
class Node:
    """A contact whose directions ``t`` and ``n`` touch only massless entries of x."""

    t: np.ndarray
    n: np.ndarray
    friction: float = 0.0
    static: float = 0.0
    speed: float = 0.0
    gap: float = 0.0


@dataclass
class QuasiStatic:
    """A scene of ``len(mass)`` dofs with mass, first in x, and others without."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray
    nodes: list[Node]
    events: list[tuple[float, str, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.m = len(self.mass)
        self.b = len(self.force) - self.m

    def held(self, combination, x_i, places, rate):
        """(x, p) of a combination, or their rates (velocities in place of ``x_i``)."""
        m, b, c = self.m, self.b, len(self.nodes)
        matrix, rhs = np.zeros((b + 2 * c, b + 2 * c)), np.zeros(b + 2 * c)
        matrix[:b, :b] = self.stiffness[m:, m:]
        rhs[:b] = (0.0 if rate else self.force[m:]) - self.stiffness[m:, :m] @ x_i
        for k, (node, status) in enumerate(zip(self.nodes, combination, strict=True)):
            t, n = b + 2 * k, b + 2 * k + 1
            matrix[:b, t], matrix[:b, n] = -node.t[m:], -node.n[m:]
            if status == "d":
                matrix[t, t] = matrix[n, n] = 1.0
                continue
            matrix[n, :b], rhs[n] = node.n[m:], 0.0 if rate else -node.gap
            if status == "s":
                matrix[t, :b], rhs[t] = node.t[m:], node.speed if rate else places[k]
            else:
                matrix[t, t], matrix[t, n] = 1.0, -SIGN[status] * node.friction
        solution = np.linalg.solve(matrix, rhs)
        return np.concatenate([x_i, solution[:b]]), solution[b:]

    def functions(self, combination, y, places):
        """{(contact, kind): value} of the event functions."""
        x, p = self.held(combination, y[: self.m], places, rate=False)
        v, _ = self.held(combination, y[self.m :], places, rate=True)
        values = {}
        for k, (node, status) in enumerate(zip(self.nodes, combination, strict=True)):
            friction, normal = p[2 * k : 2 * k + 2]
            if status == "d":
                values[k, "closing"] = node.n @ x + node.gap
            elif status == "s":
                values[k, "slip+"] = node.static * normal - friction
                values[k, "slip-"] = node.static * normal + friction
            else:
                values[k, "release"] = normal
                if node.static > 0.0:
                    values[k, "velocity"] = -SIGN[status] * (node.t @ v - node.speed)
        return values

    def solutions(self, choices, x_i, places, rate, holds):
        """Every combination of ``choices`` whose solution ``holds``, as (combination, x, p)."""
        found = []
        for combination in itertools.product(*choices):
            try:
                x, p = self.held(combination, x_i, places, rate)
            except np.linalg.LinAlgError:
                continue
            same = any(np.allclose(p, other[2], rtol=1e-9, atol=1e-12) for other in found)
            if holds(combination, x, p) and not same:
                found.append(("".join(combination), x, p))
        return found

    def after(self, combination, kinds, y, places):
        """The combination after an event; static friction jumps first, then rates decide."""
        x, p = self.held(combination, y[: self.m], places, rate=False)
        x_v, _ = self.held(combination, y[self.m :], places, rate=True)
        jumping = {
            k: kind[4]
            for k, kind in kinds
            if kind.startswith("slip") and self.nodes[k].static > self.nodes[k].friction
        }
        zero = 1e-9 * max(np.abs(p).max(), 1e-300)
        opening = {k for k, kind in kinds if kind in ("release", "closing")}
        # A stick force at both ends of its cone vanishes with the normal force.
        opening |= {k for k, _ in kinds if abs(p[2 * k + 1]) <= zero and combination[k] == "s"}
        if jumping:
            start = x
            # What slides goes on, what sticks holds, if it can.
            options = [
                jumping[k] + "d" if k in jumping else "d" if status == "d" else status + "s+-d"
                for k, status in enumerate(combination)
            ]
            at = [node.t @ x for node in self.nodes]

            def settled(statuses, x, p):
                for k, (node, status) in enumerate(zip(self.nodes, statuses, strict=True)):
                    moved, gap = node.t @ (x - start), node.n @ x + node.gap
                    friction, normal = p[2 * k : 2 * k + 2]
                    wrong = {
                        "d": gap < -1e-12,
                        "s": abs(friction) > node.static * normal,
                    }.get(status, SIGN.get(status, 0.0) * moved > 1e-14)
                    if wrong or normal < 0.0:
                        return False
                return True

            found = self.solutions(options, y[: self.m], at, False, settled)
            assert found, "no static solution"
            combination, x, p = found[0]
            places = [node.t @ x for node in self.nodes]
        options = []
        for k, status in enumerate(combination):
            node = self.nodes[k]
            if k in opening:
                options.append("s+-d" if node.static > 0.0 else "+d")
            elif status == "d":
                options.append("d")
            elif status == "s":
                slips = {kind[4] for c, kind in kinds if c == k and kind.startswith("slip")}
                options.append("s" + "".join(slips - {jumping.get(k)}))
            elif (k, "velocity") in kinds:
                options.append("s" + status)
            else:
                options.append(status + "s" if node.static > 0.0 else status)

        def violations(k, before, status, v, rates, tie, scale):
            """Yield what must not be true of contact k."""
            node = self.nodes[k]
            friction, normal = rates[2 * k : 2 * k + 2]
            slip, gap = node.t @ v - node.speed, node.n @ v
            if status in SIGN and node.static > 0.0:
                yield SIGN[status] * slip > 1e-11 * scale
            if k in opening:
                yield status == "d" and gap < -1e-12 * scale
                yield status != "d" and normal < -tie
                yield status == "s" and abs(friction) > node.static * normal + tie
            elif status == "s" and node.static == node.friction and len(options[k]) > 1:
                # At the bound of its cone, which must not be crossed.
                sign = SIGN[before] if before != "s" else SIGN[options[k][1]]
                yield sign * friction > node.friction * normal + tie

        def consistent(statuses, v, rates):
            scale = np.abs(v).max() + np.abs(x_v).max()
            tie = 1e-11 * np.abs(rates).max()
            each = enumerate(zip(combination, statuses, strict=True))
            return not any(
                any(violations(k, before, status, v, rates, tie, scale)) for k, (before, status) in each
            )

        found = self.solutions(options, y[self.m :], places, True, consistent)
        assert found, f"no solution of the rate problem after {kinds} in {combination}"
        return found[0][0], places, len(found)

    def run(self, y, combination, duration, places=None, rtol=1e-12):
        """States at ``duration``; the events (time, kinds, combination) are in ``events``."""
        time, y = 0.0, np.asarray(y, dtype=float)
        places = [0.0] * len(self.nodes) if places is None else list(places)
        while True:
            keys = list(self.functions(combination, y, places))
            begun, at = time, list(places)

            def held(t, begun=begun, at=at):
                return [a + n.speed * (t - begun) for a, n in zip(at, self.nodes, strict=True)]

            def field(t, y, combination=combination, held=held):
                x, _ = self.held(combination, y[: self.m], held(t), rate=False)
                load = self.force[: self.m] - self.stiffness[: self.m] @ x
                load = load - self.damping @ y[self.m :]
                return np.concatenate([y[self.m :], load / self.mass])

            def event(key, combination=combination, held=held, begun=begun):
                def value(t, state):
                    found = self.functions(combination, state, held(t))[key]
                    # What has just vanished leaves from zero, on either side by rounding.
                    return abs(found) if t - begun < 1e-10 else found

                value.terminal, value.direction = True, -1.0
                return value

            solution = solve_ivp(
                field,
                (time, duration),
                y,
                "DOP853",
                rtol=rtol,
                atol=1e-14,
                events=[event(key) for key in keys],
                max_step=duration / 200,
            )
            time, y = solution.t[-1], solution.y[:, -1]
            places = held(time)
            if solution.status == 0:
                return y
            x, _ = self.held(combination, y[: self.m], places, rate=False)
            places = [node.t @ x for node in self.nodes]
            assert len(self.events) < 200, "too many events"
            hit = [key for key, times in zip(keys, solution.t_events, strict=True) if len(times)]
            combination, places, _ = self.after(combination, hit, y, places)
            self.events.append((time, "/".join(f"{k}:{kind}" for k, kind in hit), combination))


def compliant(mass, damping, stiffness, force, contacts):
    """Compliant contacts (dicts of ``t``, ``n``, ``kn``, ``kt`` and the law) as nodes without mass."""
    size, count = len(mass), len(contacts)
    whole = np.zeros((size + 2 * count,) * 2)
    whole[:size, :size] = stiffness
    nodes = []
    for k, contact in enumerate(contacts):
        directions = []
        for place, (direction, spring) in enumerate([("t", "kt"), ("n", "kn")]):
            unit = np.zeros(size + 2 * count)
            unit[size + 2 * k + place] = 1.0
            stretch = unit.copy()
            stretch[:size] -= contact[direction]
            whole += contact[spring] * np.outer(stretch, stretch)
            directions.append(unit)
        law = {key: contact[key] for key in ("friction", "static", "speed", "gap") if key in contact}
        law.setdefault("static", law.get("friction", 0.0))
        nodes.append(Node(*directions, **law))
    load = np.concatenate([force, np.zeros(2 * count)])
    return QuasiStatic(np.asarray(mass), np.asarray(damping), whole, load, nodes)
