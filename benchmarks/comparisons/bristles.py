"""LuGre's usual numbers, a mass that sticks and slips, by this program and by others.

All programs follow the run of twelve seconds up to each change of sign of the velocity of the mass. The
error is the largest of the times of these four turns against the digits that others published.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import stickslip as ss

#: Table I of Canudas de Wit and others (1995): per newton of normal force, which is 1 N.
LAW = ss.friction.LuGre(static=1.5, kinetic=1.0, speed=1e-3, stiffness=1e5, damping=np.sqrt(1e5), viscous=0.4)
#: N/m, m/s and s.
SPRING, PULLED, DURATION = 2.0, 0.1, 12.0
#: Of place, velocity and deflection.
SIZES = np.array([1.0, 1.0, 1e-5])
#: Times at which the mass turns, s.
TURNS = np.array([10.2660909412841, 10.2764203978014, 10.2926632434272, 10.3009597155445])


def ours() -> np.ndarray:
    """Return the turns by stickslip, in the frame of the pulled end of the spring."""
    contact = ss.Contact(tangential=0, normal_force=1.0, friction=LAW, slider_speed=-PULLED)
    scene = ss.Scene([1.0], [[SPRING]], contacts=[contact])
    return ss.simulate(scene, DURATION, ss.State([0.0], [-PULLED], "-")).events.time


def by_heyoka(tolerance: float = 0.0) -> Callable[[], np.ndarray]:
    """Return the turns by heyoka, an integrator for each sign of the velocity; tolerance 0: an ulp."""
    import heyoka as hy

    variables = hy.make_vars("x", "v", "z")

    def integrator(sign: float) -> Any:
        equations = zip(variables, rates(hy.time, variables, sign, hy.exp), strict=True)
        falling = hy.event_direction.negative if sign > 0.0 else hy.event_direction.positive
        turned = hy.t_event(variables[1], direction=falling)
        return hy.taylor_adaptive(list(equations), [0.0, 0.0, 0.0], t_events=[turned], tol=tolerance)

    both = {sign: integrator(sign) for sign in (1.0, -1.0)}

    def advance(sign: float, time: float, state: np.ndarray) -> tuple[float, np.ndarray]:
        own = both[sign]
        own.reset_cooldowns()
        own.time, own.state[:] = time, state
        own.propagate_until(DURATION)
        return own.time, own.state.copy()

    return partial(turns_by, advance)


def turns_by(advance: Callable[[float, float, np.ndarray], tuple[float, np.ndarray]]) -> np.ndarray:
    """Return the turns by what goes to the next one from a sign of the velocity, a time and a state."""
    sign, time, state, turns = 1.0, 0.0, np.zeros(3), []
    while True:
        time, state = advance(sign, time, state)
        if time >= DURATION:
            return np.array(turns)
        turns.append(time)
        state[1], sign = 0.0, -sign


def rates(time: Any, state: Any, sign: float, exp: Callable[[Any], Any] = math.exp) -> list[Any]:
    """Return the rates of place, velocity and deflection while the velocity has a sign; also of variables."""
    x, v, z = state
    level = LAW.kinetic + (LAW.static - LAW.kinetic) * exp(-((v / LAW.speed) ** 2.0))
    bent = v - LAW.stiffness * sign * v * z / level
    friction = LAW.stiffness * z + LAW.damping * bent + LAW.viscous * v
    return [v, SPRING * (PULLED * time - x) - friction, bent]


def by_lsoda(tolerance: float) -> Callable[[], np.ndarray]:
    """Return the turns by scipy's LSODA, whose roots are those of its interpolant."""
    from scipy.integrate import solve_ivp

    def advance(sign: float, time: float, state: np.ndarray) -> tuple[float, np.ndarray]:
        def turned(_: float, state: np.ndarray, __: float) -> float:
            return float(state[1])

        turned.terminal, turned.direction = True, -sign  # type: ignore[attr-defined]
        solution = solve_ivp(
            rates, (time, DURATION), state, "LSODA", events=turned, args=(sign,),
            rtol=tolerance, atol=tolerance * SIZES,
        )  # fmt: skip
        return solution.t[-1], solution.y[:, -1].copy()

    return partial(turns_by, advance)


def by_cvode(tolerance: float) -> Callable[[], np.ndarray]:
    """Return the turns by CVODE's backward differentiation with its own search for roots."""
    from sksundae.cvode import CVODE

    def solver(sign: float) -> Any:
        def changes(time: float, state: np.ndarray, found: np.ndarray) -> None:
            found[:] = rates(time, state, sign)

        def turned(_: float, state: np.ndarray, value: np.ndarray) -> None:
            value[0] = state[1]

        turned.terminal, turned.direction = [True], [int(-sign)]  # type: ignore[attr-defined]
        return CVODE(
            changes, method="BDF", rtol=tolerance, atol=tolerance * SIZES,
            eventsfn=turned, num_events=1, max_num_steps=1_000_000,
        )  # fmt: skip

    both = {sign: solver(sign) for sign in (1.0, -1.0)}

    def advance(sign: float, time: float, state: np.ndarray) -> tuple[float, np.ndarray]:
        both[sign].init_step(time, state)
        found = both[sign].step(DURATION, "normal", DURATION)
        return found.t, found.y.copy()

    return partial(turns_by, advance)


def error(turns: np.ndarray) -> str:
    """Return the largest error, or how many turns a program has found."""
    if turns.size != TURNS.size:
        return f"{turns.size} turns"
    return f"{np.abs(turns - TURNS).max():.1e}"
