"""SUNDIALS CVODE by scikit-sundae, with its own root finding and exact Jacobians."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from sksundae.cvode import CVODE

from peer_integrator import Mechanics, Motion
from peers.restart import Vector, follow
from peers.solve_ivp import SCALES

#: Between two outputs, here the whole run.
MOST_STEPS = 10_000_000
#: Status of a result at an event.
EVENT = 2


def prepare(
    scene: Any, start: Any, duration: float, method: Literal["Adams", "BDF"], rtol: float
) -> Callable[[], Motion]:
    """Return the run; one solver per combination."""
    mechanics = Mechanics(scene)
    atol = rtol * np.repeat(SCALES, scene.size)
    known: dict[str, CVODE] = {}

    def solver(combination: str) -> CVODE:
        if combination not in known:
            generator, offset, _ = mechanics.linear(combination)
            functions = mechanics.event_functions(combination)
            rows = np.array([row for _, _, row, _ in functions])
            constants = np.array([constant for _, _, _, constant in functions])

            def rates(_: float, y: Vector, rate: Vector) -> None:
                generator.dot(y, rate)
                rate += offset

            def watched(_: float, y: Vector, value: Vector) -> None:
                rows.dot(y, value)
                value += constants

            def jacobian(_: float, __: Vector, ___: Vector, matrix: Vector) -> None:
                matrix[:] = generator

            watched.terminal = [True] * len(functions)  # type: ignore[attr-defined]
            watched.direction = [-1] * len(functions)  # type: ignore[attr-defined]
            known[combination] = CVODE(
                rates,
                method=method,
                rtol=rtol,
                atol=atol,
                jacfn=jacobian,
                eventsfn=watched,
                num_events=len(functions),
                max_num_steps=MOST_STEPS,
            )
        return known[combination]

    def advance(combination: str, time: float, y: Vector) -> tuple[float, Vector, int | None]:
        cvode = solver(combination)
        cvode.init_step(time, y)
        result = cvode.step(duration, "normal", duration)
        if not result.success:
            raise RuntimeError(result.message)
        if result.status != EVENT:
            return duration, result.y, None
        return result.t, result.y.copy(), int(np.flatnonzero(result.i_events[-1])[0])

    return lambda: follow(mechanics, start, advance)
