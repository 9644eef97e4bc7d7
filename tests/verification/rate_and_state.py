"""Rate and state: a slider of rsfmodel's tests, and the stiffness at which steady slip ends.

The slider has no mass: ``mu' = k (v_lp - v)`` with ``mu = mu0 + a ln(v / v0) + b ln(v0 theta / L)``. The
program needs one. With a mass m the motion differs by a power series in m, once the first ``m v / a`` seconds
have passed, so that runs with masses m, m/2, m/4, ... are extrapolated to zero (Richardson).

With mass, steady slip at v under a normal force N ends at the stiffness
``(b - a) N / L (1 + m v^2 / (N a L))``, where it oscillates at ``v / L sqrt((b - a) / a)``.
"""

from functools import partial
from itertools import pairwise

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

MU, LENGTH, STIFFNESS, BEFORE, AFTER, JUMP = 0.6, 10.0, 1e-3, 1.0, 10.0, 10.0
#: Times, s, at which rsfmodel's tests print numbers.
TIMES = (11.0, 13.0, 20.0)
#: a, b, the rate of theta, the masses of the runs, and mu, theta and v at the times, by law.
LAWS = {
    "Dieterich": (
        0.005,
        0.01,
        "1 - s * z / 10",
        4e-7 / 2.0 ** np.arange(5),
        [
            ["0.6072048524683", "8.399937157949", "5.987609378593"],
            ["0.5840090974259", "0.542482373354", "13.876392880610"],
            ["0.5885831287296", "1.018768218063", "9.821829373066"],
        ],
    ),
    "Ruina": (
        0.01,
        0.005,
        "-(s * z / 10) * log(s * z / 10)",
        8e-7 / 2.0 ** np.arange(4),
        [
            ["0.6083929943449", "9.260985126672", "2.405329178881"],
            ["0.6166333524073", "2.478108270765", "10.600276118567"],
            ["0.6114978124555", "1.002739268997", "9.971250775571"],
        ],
    ),
}


def slid(law, mass):
    """Return mu, theta and v at the times: the pull is faster from the jump on, with which the run begins."""
    a, b, rate, _, _ = LAWS[law]
    friction = ss.friction.StateLaw("0.6 + a * log(s) + b * log(z / 10)", rate, a=a, b=b)
    contact = ss.Contact(tangential=0, normal_force=1.0, friction=friction, slider_speed=-AFTER)
    scene = ss.Scene([mass], [[STIFFNESS]], contacts=[contact])
    start = ss.State([-MU / STIFFNESS], [BEFORE - AFTER], "-", internal=[LENGTH / BEFORE])
    run = ss.simulate(scene, TIMES[-1] - JUMP, start)
    rows = []
    for time in TIMES:
        state = run.state(time - JUMP)
        speed, theta = state.velocity[0] + AFTER, state.internal[0]
        rows.append([MU + a * np.log(speed) + b * np.log(theta / LENGTH), theta, speed])
    return np.array(rows)


def slider():
    """Compare the two laws."""
    found = []
    for law, (_, _, _, masses, printed) in LAWS.items():
        runs = [slid(law, mass) for mass in masses]
        for order in range(1, len(masses)):
            runs = [(2.0**order * fine - coarse) / (2.0**order - 1.0) for coarse, fine in pairwise(runs)]
        for time, computed, expected in zip(TIMES, runs[0], printed, strict=True):
            for name, unit, number, digits in zip(
                ("mu", "theta", "v"), ("", "s", "m/s"), computed, expected, strict=True
            ):
                found.append(
                    Quantity(
                        name=f"{law}: {name} at {time:g} s",
                        unit=unit,
                        expected=mp.mpf(digits),
                        computed=float(number),
                        relative=2e-11,
                    )
                )
    return found


def critical():
    """Compare the stiffness at which steady slip of rock ends."""
    a, b, length, speed, pressed = 0.01, 0.015, 1e-5, 1e-3, 1e6
    rock = partial(
        ss.models.spring_slider,
        direct=a,
        evolution=b,
        length=length,
        normal_force=pressed,
        pull_speed=speed,
    )
    (point,) = ss.critical_points(rock, {"stiffness": (4e8, 6e8)})
    a, b, length, speed, pressed = map(decimal, (a, b, length, speed, pressed))
    return [
        Quantity(
            name="critical stiffness",
            unit="N/m",
            expected=(b - a) * pressed / length * (1 + speed**2 / (pressed * a * length)),
            computed=point.value,
            reference="500005000",
            relative=1e-12,
        ),
        Quantity(
            name="angular frequency there",
            unit="1/s",
            expected=speed / length * mp.sqrt((b - a) / a),
            computed=2.0 * np.pi * point.frequency,
            reference="70.7106781186547",
            relative=1e-12,
        ),
    ]


CASES = [
    Case(
        title="Slider of rate and state",
        source=(
            "rsfmodel (Leeman, May, Marone and Saffer 2016), `tests/rsf_tests.py`, which prints eight "
            "digits; thirteen digits by an integrator of others."
        ),
        model=(
            "`mu = 0.6 + a ln(v) + b ln(theta / 10)`, `mu' = 1e-3 (v_lp - v)`, from steady slip at 1 m/s on; "
            "at 10 s v_lp jumps from 1 to 10 m/s. Dieterich: `theta' = 1 - v theta / 10`, a = 0.005, "
            "b = 0.01. Ruina: `theta' = -(v theta / 10) ln(v theta / 10)`, a = 0.01, b = 0.005. Both are a "
            "user's own law (`StateLaw`) of a body with little mass, extrapolated to none."
        ),
        tolerance="2e-11, as much as is left of the mass.",
        quantities=slider,
    ),
    Case(
        title="Critical stiffness of rate and state",
        source="Rice and Ruina, Journal of Applied Mechanics 50 (1983) 343; in closed form.",
        model=(
            "`T / N = 0.6 + 0.01 ln(s / v0) + 0.015 ln(v0 theta / L)`, regularised at rest, "
            "`theta' = 1 - s theta / L` with `L = 1e-5 m`: a mass of 1 kg under a normal force of 1e6 N, "
            "pulled at 1 mm/s. Steady slip ends with a Hopf point at `(b - a) N / L (1 + m v^2 / (N a L))`."
        ),
        tolerance="1e-12.",
        quantities=critical,
    ),
]
