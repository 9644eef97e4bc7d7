"""LuGre's usual numbers, a mass that sticks and slips: beside heyoka and methods of scipy.

Every program follows the run of twelve seconds up to each change of sign of the velocity of the mass. The
error is the largest of the times of these four turns against the digits that others published. Times
are processor time, the least over all rounds.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
from clock import in_turns
from scipy.integrate import solve_ivp

import stickslip as ss
from report import Report, arguments, left_out

#: Table I of Canudas de Wit and others (1995): per newton of normal force, which is 1 N.
LAW = ss.friction.LuGre(static=1.5, kinetic=1.0, speed=1e-3, stiffness=1e5, damping=np.sqrt(1e5), viscous=0.4)
#: N/m, m/s and s.
SPRING, PULLED, DURATION = 2.0, 0.1, 12.0
#: Times at which the mass turns, s.
TURNS = np.array([10.2660909412841, 10.2764203978014, 10.2926632434272, 10.3009597155445])


def ours() -> np.ndarray:
    """Return the turns by stickslip, in the frame of the pulled end of the spring."""
    contact = ss.Contact(tangential=0, normal_force=1.0, friction=LAW, slider_speed=-PULLED)
    scene = ss.Scene([1.0], [[SPRING]], contacts=[contact])
    return ss.simulate(scene, DURATION, ss.State([0.0], [-PULLED], "-")).events.time


def rate(t: float, y: np.ndarray) -> list[float]:
    """Return (x', x'', z')."""
    x, v, z = y
    level = LAW.kinetic + (LAW.static - LAW.kinetic) * np.exp(-((v / LAW.speed) ** 2))
    bent = v - LAW.stiffness * abs(v) * z / level
    friction = LAW.stiffness * z + LAW.damping * bent + LAW.viscous * v
    return [v, SPRING * (PULLED * t - x) - friction, bent]


def by_scipy(method: str, relative: float) -> Callable[[], np.ndarray]:
    """Return the turns by a method of scipy, which looks for changes of sign in its dense output."""

    def turn(_: float, y: np.ndarray) -> float:
        return float(y[1])

    def run() -> np.ndarray:
        absolute = relative * np.array([1.0, 1.0, 1e-5])
        path = solve_ivp(
            rate, (0.0, DURATION), [0.0, 0.0, 0.0], method=method, rtol=relative, atol=absolute, events=turn
        )
        assert path.t_events is not None
        # The start is at rest.
        return path.t_events[0][path.t_events[0] > 1e-6]

    return run


def by_heyoka(tolerance: float = 0.0) -> Callable[[], np.ndarray]:
    """Return the turns by heyoka, an integrator for each sign of the velocity; tolerance 0: an ulp."""
    import heyoka as hy

    x, v, z = hy.make_vars("x", "v", "z")
    level = LAW.kinetic + (LAW.static - LAW.kinetic) * hy.exp(-((v / LAW.speed) ** 2.0))

    def integrator(sign: float) -> Any:
        bent = v - LAW.stiffness * sign * v * z / level
        friction = LAW.stiffness * z + LAW.damping * bent + LAW.viscous * v
        equations = [(x, v), (v, SPRING * (PULLED * hy.time - x) - friction), (z, bent)]
        falling = hy.event_direction.negative if sign > 0.0 else hy.event_direction.positive
        return hy.taylor_adaptive(
            equations, [0.0, 0.0, 0.0], t_events=[hy.t_event(v, direction=falling)], tol=tolerance
        )

    both = {sign: integrator(sign) for sign in (1.0, -1.0)}

    def run() -> np.ndarray:
        sign, time, state, turns = 1.0, 0.0, np.zeros(3), []
        while time < DURATION:
            own = both[sign]
            own.reset_cooldowns()
            own.time, own.state[:] = time, state
            own.propagate_until(DURATION)
            time, state = own.time, own.state.copy()
            if time < DURATION:
                turns.append(time)
                state[1], sign = 0.0, -sign
        return np.array(turns)

    return run


def error(turns: np.ndarray) -> str:
    """Return the largest error, or how many turns a program has found."""
    if turns.size != TURNS.size:
        return f"{turns.size} turns"
    return f"{np.abs(turns - TURNS).max():.1e}"


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    runs: dict[str, Callable[[], np.ndarray]] = {"stickslip": ours}
    if importlib.util.find_spec("heyoka") is None:
        left_out("heyoka", "the comparison")
    else:
        runs["heyoka, tolerance 1 ulp"] = by_heyoka()
    for method, relative in (("LSODA", 1e-8), ("LSODA", 1e-12), ("Radau", 1e-8), ("DOP853", 1e-8)):
        runs[f"{method}, relative {relative:.0e}"] = by_scipy(method, relative)
    found = {name: run() for name, run in runs.items()}
    times = in_turns(runs, options.rounds)
    least = {name: min(own) for name, own in times.items()}
    rows = [
        [name, f"{1e3 * least[name]:.0f}", f"{least[name] / least['stickslip']:.2f}", error(found[name])]
        for name in runs
    ]
    report = Report("bristles")
    report.table(("program", "ms", "x stickslip", "error, s"), rows)
    used = ["stickslip", "numpy", "scipy", *(["heyoka"] if "heyoka, tolerance 1 ulp" in runs else [])]
    report.finish(options.into, *used)


if __name__ == "__main__":
    main()
