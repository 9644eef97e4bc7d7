"""Stick-slip of a block on a belt with a dashpot to the ground.

Carried by the belt the block breaks loose where spring and dashpot reach Fs, at ``x = (Fs - c V) / k``, and
is caught again when ``x' = V``. Between, with ``z = c / (2 m)``, ``w = sqrt(k / m - z^2)`` and ``y = x - Fd /
k``: ``y = exp(-z t) (y0 cos(w t) + (V + z y0) / w sin(w t))``. The time of slip is the first zero of ``y' -
V`` after the start, found in 40 digits. The belt then carries the block back to where it broke loose.
"""

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

MASS, STIFFNESS, DAMPING, STATIC, KINETIC, SPEED = 1.0, 100.0, 1.0, 10.0, 6.0, 0.1


def slip():
    """Return the duration of slip, and place of the block before and after it."""
    m, k, c, high, low, v = map(decimal, (MASS, STIFFNESS, DAMPING, STATIC, KINETIC, SPEED))
    rate = c / (2 * m)
    omega, begin = mp.sqrt(k / m - rate**2), (high - c * v) / k
    y = begin - low / k
    sine = (v + rate * y) / omega

    def place(t):
        return low / k + mp.exp(-rate * t) * (y * mp.cos(omega * t) + sine * mp.sin(omega * t))

    def velocity(t):
        cosine, sines = omega * sine - rate * y, omega * y + rate * sine
        return mp.exp(-rate * t) * (cosine * mp.cos(omega * t) - sines * mp.sin(omega * t))

    # In steps of 1 / 200 of a period the first sign change brackets the catch.
    step = mp.pi / (100 * omega)
    n = next(n for n in range(1, 200) if velocity((n + 1) * step) > v)
    bracket = (n * step, (n + 1) * step)
    duration = mp.findroot(lambda t: velocity(t) - v, bracket, solver="anderson", tol=1e-60)
    return duration, begin, place(duration)


def quantities():
    """Compare the cycle that a run from the relaxed spring settles to."""
    duration, loose, caught = slip()
    stick = (loose - caught) / decimal(SPEED)
    scene = ss.models.mass_on_belt(
        mass=MASS,
        stiffness=STIFFNESS,
        damping=DAMPING,
        normal_force=1.0,
        friction=KINETIC,
        static_friction=STATIC,
        slider_speed=SPEED,
    )
    start = ss.State([0.0], [SPEED], "s")
    cycle = ss.simulate(scene, 4.0 * float(stick + duration), start).limit_cycle()
    durations = dict(zip(cycle.combinations, cycle.durations, strict=True))
    return [
        Quantity(name="period", unit="s", expected=stick + duration, computed=cycle.period),
        Quantity(name="time of sticking", unit="s", expected=stick, computed=durations["s"]),
        Quantity(name="time of slip", unit="s", expected=duration, computed=durations["+"]),
    ]


CASES = [
    Case(
        title="Block on a belt, with a dashpot",
        source="Classical stick-slip with constant static and kinetic friction (Blok 1940); closed form.",
        model=(
            "`m x'' + c x' + k x = Fd` while the block slips behind the belt of speed V, x' = V while `|k "
            "x + c V| <= Fs`; m = 1 kg, c = 1 N s/m, k = 100 N/m, Fs = 10 N, Fd = 6 N, V = 0.1 m/s. The "
            "time of slip is the first zero of `x' - V`, x a decaying harmonic motion about `Fd / k` from "
            "`x = (Fs - c V) / k`. Computed by `limit_cycle`."
        ),
        tolerance="Closed form, the time of slip as a zero of it in 40 digits: 1e-12.",
        quantities=quantities,
    )
]
