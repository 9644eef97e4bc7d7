"""Motions of masses on one contact spring by scipy's DOP853, event by event: what is compared with ours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from tests.support.element_peer import EventPeer


@dataclass(frozen=True)
class ContactSpringPeer(EventPeer):
    """``M x'' + C x' + K x = F + t T + n phi(u)``, M lumped, t the first dof, ``u = -(n . x + gap) > 0``."""

    mass: Any
    stiffness: Any
    damping: Any
    force: Any
    normal: Any
    gap: float
    law: Callable[[float], float]
    friction: float
    static_friction: float
    speed: float

    most = 80

    def penetration(self, y: Any) -> float:
        """Return u."""
        return -(float(self.normal @ y[: len(self.mass)]) + self.gap)

    def parts(self, y: Any, status: str) -> tuple[Any, float]:
        """Return the force on the dofs without friction, and N."""
        x, u = np.split(y, 2)
        pressed = 0.0 if status == "d" else self.law(self.penetration(y))
        return self.force - self.stiffness @ x - self.damping @ u + self.normal * pressed, pressed

    def field(self, y: Any, status: str) -> Any:
        """Return y'."""
        force, pressed = self.parts(y, status)
        if status == "s":
            force[0] = 0.0
        elif status != "d":
            force[0] += (1.0 if status == "+" else -1.0) * self.friction * pressed
        return np.concatenate([y[len(self.mass) :], force / self.mass])

    def functions(self, status: str) -> dict[str, Callable[[Any], float]]:
        """Return the event functions of a status by the kind of event."""
        slip = len(self.mass)
        if status == "d":
            return {"closing": lambda y: -self.penetration(y)}

        def margin(sign: float) -> Callable[[Any], float]:
            def value(y: Any) -> float:
                force, pressed = self.parts(y, "s")
                return self.static_friction * pressed + sign * force[0]

            return value

        if status == "s":
            return {"slip+": margin(1.0), "slip-": margin(-1.0)}
        sign = -1.0 if status == "+" else 1.0
        return {"velocity": lambda y: sign * (y[slip] - self.speed), "release": self.penetration}

    def settled(self, kind: str, y: Any) -> str:
        """Return the status after an event."""
        slip = len(self.mass)
        if kind in ("release", "slip+", "slip-"):
            return {"release": "d", "slip+": "+", "slip-": "-"}[kind]
        if kind == "closing":
            return "+" if y[slip] < self.speed else "-"
        y[slip] = self.speed
        force, pressed = self.parts(y, "s")
        if abs(force[0]) <= self.static_friction * pressed:
            return "s"
        return "+" if force[0] < 0.0 else "-"
