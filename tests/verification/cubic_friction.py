"""A mass on a belt whose friction falls and rises again: pure slip, and where it begins to stick.

``x'' + 2 beta x' + x = mu(v - x')`` with ``mu(s) = a - b s + d s^3``, ``b = 3/2 (a - m) / s0`` and
``d = 1/2 (a - m) / s0^3``. Steady sliding is stable above the speed at which ``2 beta = b - 3 d v^2``. The
cycle born there is a fixed point of the map from one largest x to the next; it ends where it touches the
speed of the belt: there the slide from ``x' = v``, ``x'' = 0`` comes back to it. Both by Taylor series in
40 digits. At first order its largest velocity is ``2 sqrt(v1^2 - v^2)``, which touches at ``v1 sqrt(4/5)``.
"""

from functools import cache

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp
from verification.taylor import closed_orbit, product, until

DAMPING, STATIC, LEAST, SCALE, SPEED = 0.05, 0.4, 0.25, 0.5, 0.42
STEP = mp.mpf("0.1")
#: Steps of the secant method, which then is in the rounding of its series; it checks itself to 25 digits.
STEPS = 8


def rates_at(v):
    """Return the field on a belt with a speed."""
    beta, a, m, scale = map(decimal, (DAMPING, STATIC, LEAST, SCALE))
    b, d = (a - m) * mp.mpf(3) / 2 / scale, (a - m) / 2 / scale**3

    def rates(rows, k):
        x, u = rows[:2]
        if k == 0:
            rows[2:] = [[], [], []]
        slip, square, cube = rows[2:]
        slip.append((v if k == 0 else 0) - u[k])
        square.append(product(slip, slip, k))
        cube.append(product(square, slip, k))
        return [u[k], -2 * beta * u[k] - x[k] + (a if k == 0 else 0) - b * slip[k] + d * cube[k]]

    return rates


@cache
def orbit():
    """Return largest x and period at SPEED, and the multiplier."""
    rates = rates_at(decimal(SPEED))

    def round_trip(x):
        return until(rates, [x, mp.mpf(0)], lambda state: state[1], step=STEP, after=3)

    (place,), jacobian = closed_orbit(lambda place: round_trip(place[0])[1][:1], ["0.53"])
    return place, round_trip(place)[0], jacobian[0]


@cache
def touching():
    """Return the speed of the belt that the cycle touches."""
    beta, a = decimal(DAMPING), decimal(STATIC)

    def excess(v):
        rates = rates_at(v)

        def acceleration(state):
            return rates([[value] for value in state], 0)[1]

        start = [a - 2 * beta * v, v]
        return until(rates, start, acceleration, step=STEP, after=3)[1][1] - v

    return mp.findroot(excess, (mp.mpf("0.394"), mp.mpf("0.396")), solver="secant", tol=1e-50, maxsteps=STEPS)


def touched(cycle):
    """Return the lowest speed at which the orbit of the branch is one of the contact law, to 1e-9 m/s."""
    low, high = 0.3, SPEED
    while high - low > 1e-9:
        speeds = np.linspace(low, high, 102)
        branch = ss.continuation(cycle, {"slider_speed": (SPEED, 0.3)}, at=speeds[1:-1]).data
        inner = branch.swap_dims(point="slider_speed").sel(slider_speed=speeds[1:-1])
        first = int(np.argmax(inner.followed.to_numpy()))
        low, high = speeds[first], speeds[first + 1]
    return float(high)


def quantities():
    """Compare the Hopf point, the cycle at a speed, and the speed at which it begins to stick."""
    model = ss.models.thomsen_fidlin
    (hopf,) = ss.critical_points(model, {"slider_speed": (0.2, 0.49)}, kinds=("hopf",))
    assert hopf.criticality == "supercritical"
    beta, a, m, scale = map(decimal, (DAMPING, STATIC, LEAST, SCALE))
    limit = scale * mp.sqrt(1 - 4 * beta * scale / (3 * (a - m)))
    scene = model(slider_speed=SPEED)
    largest, period, multiplier = orbit()
    push = float(largest) - float(ss.steady_sliding(scene).position[0])
    start = ss.steady_sliding(scene).perturbed(position={"x": push})
    cycle = ss.simulate(scene, 2.4 * float(period), start).closed_cycle()
    return [
        Quantity(name="Hopf speed", unit="m/s", expected=limit, computed=hopf.value),
        Quantity(name=f"period at {SPEED} m/s", unit="s", expected=period, computed=cycle.period),
        Quantity(
            name=f"largest x at {SPEED} m/s", unit="m", expected=largest, computed=cycle.maximum[0].item()
        ),
        Quantity(
            name=f"multiplier at {SPEED} m/s",
            unit="",
            expected=multiplier,
            computed=float(min(abs(one) for one in cycle.multipliers)),
        ),
        Quantity(
            name="speed at which the cycle begins to stick",
            unit="m/s",
            expected=touching(),
            computed=touched(cycle),
            absolute=2e-9,
        ),
    ]


CASES = [
    Case(
        title="Mass on a belt under a cubic law of friction",
        source=(
            "J. J. Thomsen, A. Fidlin, *Analytical approximations for stick-slip vibration amplitudes*, "
            "International Journal of Non-Linear Mechanics 38, 2003, for law and equation; the numbers are "
            "chosen here, and the solution is by the equation of motion in 40 digits."
        ),
        model=(
            "`x'' + 2 beta x' + x = mu(v - x')`, `mu(s) = 0.4 - 0.45 s + 0.6 s^3` with its least value 0.25 "
            "at 0.5 m/s, beta = 0.05. Steady sliding is stable above `v1 = 0.5 sqrt(7/9)` m/s. Below, the "
            "mass oscillates without sticking, down to the speed at which its velocity touches that of the "
            "belt; averaging gives `v1 sqrt(4/5)` = 0.39441 m/s for it."
        ),
        tolerance="Closed form and 40 digits: 1e-12; the last speed is bracketed to 1e-9 m/s.",
        quantities=quantities,
    )
]
