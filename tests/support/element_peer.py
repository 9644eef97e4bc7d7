"""Motions with springs on one contact by scipy's DOP853, event by event: what is compared with ours."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

#: How long an event function may be at zero where a phase begins, s.
SETTLED = 1e-9
TOLERANCES = {"rtol": 1e-13, "atol": 1e-14, "max_step": 1e-2}


def watched(function: Callable[[Any], float], begin: float) -> Any:
    """Return an event function for scipy, which is not at zero where the phase begins."""

    def value(at: float, y: Any) -> float:
        return function(y) if at > begin + SETTLED else 1.0

    value.terminal, value.direction = True, -1.0
    return value


class EventPeer(ABC):
    """A motion with statuses, each with a field and with event functions that fall through zero."""

    #: Events after which a run ends.
    most = 60

    @abstractmethod
    def field(self, y: Any, status: str) -> Any:
        """Return y'."""

    @abstractmethod
    def functions(self, status: str) -> dict[str, Callable[[Any], float]]:
        """Return the event functions of a status by the kind of event."""

    @abstractmethod
    def settled(self, kind: str, y: Any) -> str:
        """Return the status after an event, whose state is brought to its zeros."""

    def run(self, y: Sequence[float], status: str, duration: float) -> tuple[list[tuple[float, str]], Any]:
        """Return the events as (time, kind), and the state at the end."""
        time, events, state = 0.0, [], np.array(y, dtype=float)
        while time < duration and len(events) < self.most:
            functions = self.functions(status)
            found = solve_ivp(
                lambda _, y, status=status: self.field(y, status),
                (time, duration),
                state,
                "DOP853",
                events=[watched(function, time) for function in functions.values()],
                **TOLERANCES,
            )
            time, state = float(found.t[-1]), found.y[:, -1]
            if found.status != 1:
                break
            kind = next(kind for kind, at in zip(functions, found.t_events, strict=True) if at.size)
            events.append((time, kind))
            status = self.settled(kind, state)
        return events, state


@dataclass(frozen=True)
class Peer(EventPeer):
    """``M x'' + C x' + K x = F - D' phi(D x) + t T + n N``, M lumped, t the first dof, n the second."""

    mass: Any
    stiffness: Any
    damping: Any
    force: Any
    directions: Any
    law: Callable[[Any], Any]
    friction: float
    static_friction: float
    speed: float

    def free(self, y: Any) -> Any:
        """Return the force on the dofs without contact forces."""
        x, u = np.split(y, 2)
        springs = self.directions.T @ self.law(self.directions @ x)
        return self.force - self.stiffness @ x - self.damping @ u - springs

    def field(self, y: Any, status: str) -> Any:
        """Return y'."""
        force = self.free(y)
        normal = -force[1]
        if status != "d":
            force[0] = (
                0.0 if status == "s" else force[0] + (1.0 if status == "+" else -1.0) * self.friction * normal
            )
            force[1] = 0.0
        return np.concatenate([y[len(self.mass) :], force / self.mass])

    def functions(self, status: str) -> dict[str, Callable[[Any], float]]:
        """Return the event functions of a status by the kind of event."""
        slip = len(self.mass)
        if status == "d":
            return {"impact": lambda y: y[1]}
        if status == "s":
            limit = self.static_friction
            return {
                "slip+": lambda y: -limit * self.free(y)[1] + self.free(y)[0],
                "slip-": lambda y: -limit * self.free(y)[1] - self.free(y)[0],
            }
        sign = -1.0 if status == "+" else 1.0
        return {
            "velocity": lambda y: sign * (y[slip] - self.speed),
            "release": lambda y: -self.free(y)[1],
        }

    def settled(self, kind: str, y: Any) -> str:
        """Return the status after an event, whose state is brought to its zeros."""
        slip = len(self.mass)
        if kind in ("release", "slip+", "slip-"):
            return {"release": "d", "slip+": "+", "slip-": "-"}[kind]
        if kind == "impact":
            y[[1, slip + 1]] = 0.0
            return "d" if self.free(y)[1] > 0.0 else "+" if y[slip] < self.speed else "-"
        y[slip] = self.speed
        required, normal = -self.free(y)[:2]
        if abs(required) <= self.static_friction * normal:
            return "s"
        return "+" if required > 0.0 else "-"
