"""scipy's integrators, restarted at every event that `solve_ivp` stops at."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from peer_integrator import Mechanics, Motion
from peers.restart import Vector, follow

#: Of positions and velocities, m and m/s: what relative tolerances are relative to.
SCALES = (1e-4, 1e-1)


def prepare(scene: Any, start: Any, duration: float, method: str, rtol: float) -> Callable[[], Motion]:
    """Return the run by one of RK45, DOP853, LSODA, Radau."""
    mechanics = Mechanics(scene)
    atol = rtol * np.repeat(SCALES, scene.size)
    known: dict[str, tuple[Any, list[Any], Any]] = {}

    def phase(combination: str) -> tuple[Any, list[Any], Any]:
        if combination not in known:
            generator, offset, _ = mechanics.linear(combination)
            functions = mechanics.event_functions(combination)
            watched = [terminal(row, constant) for _, _, row, constant in functions]
            known[combination] = (lambda _, y: generator.dot(y) + offset, watched, generator)
        return known[combination]

    def advance(combination: str, time: float, y: Vector) -> tuple[float, Vector, int | None]:
        rates, watched, generator = phase(combination)
        jacobian = {"jac": generator} if method in ("Radau", "LSODA") else {}
        if method == "LSODA":
            jacobian = {"jac": lambda _, __: generator}
        solution = solve_ivp(
            rates, (time, duration), y, method=method, rtol=rtol, atol=atol, events=watched, **jacobian
        )
        if not solution.success:
            raise RuntimeError(solution.message)
        if solution.status == 0:
            return duration, solution.y[:, -1], None
        index = next(k for k, found in enumerate(solution.t_events) if found.size)
        return float(solution.t_events[index][0]), solution.y_events[index][0], index

    return lambda: follow(mechanics, start, advance)


def terminal(row: Vector, constant: float) -> Callable[[float, Vector], float]:
    """Return an event function that stops the integration where it becomes negative."""

    def function(_: float, y: Vector) -> float:
        return float(row.dot(y)) + constant

    function.terminal = True  # type: ignore[attr-defined]
    function.direction = -1.0  # type: ignore[attr-defined]
    return function
