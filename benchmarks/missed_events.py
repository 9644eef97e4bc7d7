"""Events that last a small part of a phase, by this program, scipy and heyoka.

In each scene one event function dips below zero for a part of its period, or touches it. The table says who
finds the event, and with what error of its time relative to the period. A touch is a double root, whose place
rounding moves by the square root of itself; a dip shallower than an ulp of its terms is not in the data.
"""

from __future__ import annotations

import importlib.util
import sys
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import stickslip as ss
from report import Report, arguments, left_out

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))
from dip_scenes import Dip, gap, normal_force, slip

PARTS = (1e-3, 1e-9, 0.0)
#: scipy's relative tolerances: tighter ones take shorter steps, and see a dip if one happens to end in it
TOLERANCES = (1e-12,)


def answer(dip: Dip, part: float, times: NDArray[np.float64]) -> str:
    """Return what a list of event times is worth."""
    if len(times) == 0:
        return "missed"
    error = abs(times[0] / dip.period - (0.5 - 0.5 * part))
    return f"found, {error:.0e}"


def by_stickslip(dip: Dip, part: float) -> str:
    """Return what the certified search says."""
    run = ss.simulate(dip.scene, dip.period, dip.start)
    if len(run.events) == 0 and run.grazings:
        touch = run.grazings[0]
        return f"grazing, {abs(touch.time / dip.period - 0.5):.0e}"
    return answer(dip, part, run.events.time)


def by_scipy(dip: Dip, part: float, tolerance: float) -> str:
    """Return what `solve_ivp` with DOP853 finds."""
    solution = solve_ivp(
        lambda _, y: [y[1], dip.rate**2 * (dip.middle - y[0])],
        (0.0, dip.period),
        dip.initial,
        method="DOP853",
        rtol=tolerance,
        atol=tolerance * np.abs(dip.initial).max() * 1e-3,
        events=lambda _, y: dip.function(*y),
    )
    return answer(dip, part, solution.t_events[0])


def by_heyoka(dip: Dip, part: float) -> str:
    """Return what heyoka's polynomial root isolation finds at its default tolerance, an ulp."""
    import heyoka

    y, speed = heyoka.make_vars("y", "speed")
    times: list[float] = []
    event = heyoka.nt_event(dip.function(y, speed), lambda _, at, __: times.append(at))
    integrator = heyoka.taylor_adaptive(
        [(y, speed), (speed, dip.rate**2 * (dip.middle - y))], dip.initial.copy(), nt_events=[event]
    )
    integrator.propagate_until(dip.period)
    return answer(dip, part, np.array(times))


def main() -> None:
    """Print the table."""
    chosen = arguments(__doc__).parse_args()
    with_heyoka = importlib.util.find_spec("heyoka") is not None
    if not with_heyoka:
        left_out("heyoka", "the comparison")
    headings = ["event function", "part of the period", "depth", "stickslip"]
    headings += [f"DOP853, rtol {tolerance:.0e}" for tolerance in TOLERANCES]
    rows = []
    for name, make in (("gap", gap), ("slip velocity", slip), ("normal force", normal_force)):
        for part in PARTS:
            dip = make(part)
            row = [name, f"{part:.0e}" if part else "touch", f"{0.5 * (np.pi * part) ** 2:.0e}"]
            row += [by_stickslip(dip, part)]
            row += [by_scipy(dip, part, tolerance) for tolerance in TOLERANCES]
            if with_heyoka:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    row.append(by_heyoka(dip, part))
            rows.append(row)
    report = Report("missed-events")
    report.table([*headings, *(["heyoka"] if with_heyoka else [])], rows)
    report.finish(chosen.into, "stickslip", "scipy", *(["heyoka"] if with_heyoka else []))


if __name__ == "__main__":
    main()
