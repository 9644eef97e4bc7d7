"""A mass on a belt under falling friction: steady sliding and stick-slip are both stable, an orbit between.

``x'' + 2 z x' + x = F(v - x')``, ``F(s) = k + k (r - 1) exp(-s / v0)``. With ``e = exp(-(v - u) / v0)``, u =
x', Taylor series of x, u and e follow from each other: ``u' = -2 z u - x + k + k (r - 1) e``, ``e' = e u' /
v0``; the area within an orbit is the integral of u^2 over the time in which u is positive, twice. The
unstable orbit without events is the zero of ``x(T) - x(0)`` over its amplitude, where T is the second zero of
u, found with 30 digits by secants. Starts inside come to steady sliding, all others to stick-slip. Both
orbits meet where the unstable one reaches the speed of the belt.
"""

from functools import cache, reduce

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

DAMPING, KINETIC, RATIO, DECAY = 0.05, 0.5, 2.0, 0.5
#: Terms of a Taylor series, and steps of 0.2: its radius is about 1, so that 0.2^45 is 1e-31.
TERMS, STEP = 45, mp.mpf("0.2")
#: Steps of the secant method, which then is in the rounding of its series; it checks itself to 25 digits.
STEPS = 8
#: Largest displacement and velocity of the starts, m and m/s: x from -2, x' from 0.
BOX = 2, 2


def series(x, u, e):
    """Return Taylor coefficients of x, u, e and the integral of u^2."""
    z, k, r, decay = map(decimal, (DAMPING, KINETIC, RATIO, DECAY))
    xs, us, es, area, rises = [x], [u], [e], [mp.mpf(0)], []
    for n in range(TERMS):
        rise = -2 * z * us[n] - xs[n] + k * (r - 1) * es[n] + (k if n == 0 else 0)
        rises.append(rise)
        xs.append(us[n] / (n + 1))
        us.append(rise / (n + 1))
        es.append(mp.fsum(es[j] * rises[n - j] for j in range(n + 1)) / decay / (n + 1))
        area.append(mp.fsum(us[j] * us[n - j] for j in range(n + 1)) / (n + 1))
    return [coefficients[::-1] for coefficients in (xs, us, es, area)]


def at(coefficients, t):
    """Return a polynomial, its highest coefficient first, at t."""
    return reduce(lambda value, coefficient: value * t + coefficient, coefficients, mp.mpf(0))


def root(coefficients, value=0):
    """Return the time within a step at which a polynomial has a value."""
    return mp.findroot(lambda t: at(coefficients, t) - value, (0, STEP), solver="anderson", tol=1e-60)


def to_turn(x, e, border=None):
    """Return place, e, duration and the integral of u^2 from one turn to the next; e is that of u = 0.

    The integral ends where x reaches a border, if one is given and reached.
    """
    u, time, area, clipped = mp.mpf(0), mp.mpf(0), mp.mpf(0), None
    while True:
        xs, us, es, areas = series(x, u, e)
        step, sign = STEP, mp.sign(us[-1] if us[-1] != 0 else us[-2])
        turns = time > 0 and mp.sign(at(us, step)) != sign
        if turns:
            step = root(us)
        if border is not None and clipped is None and at(xs, step) > border:
            clipped = area + at(areas, root(xs, border))
        x, u, e, more = (at(coefficients, step) for coefficients in (xs, us, es, areas))
        time, area = time + step, area + more
        if turns:
            return x, e, time, area if clipped is None else clipped


@cache
def orbit(speed, guess):
    """Return amplitude about steady sliding, period, and area with u > 0, x < 2 of the unstable orbit."""
    v, decay = decimal(speed), decimal(DECAY)
    still = mp.exp(-v / decay)
    rest = decimal(KINETIC) * (1 + (decimal(RATIO) - 1) * still)

    def around(amplitude):
        low, e, first, _ = to_turn(rest + amplitude, still)
        high, _, second, above = to_turn(low, e, BOX[0])
        return high - rest - amplitude, first + second, above

    amplitude = mp.findroot(
        lambda a: around(a)[0], (guess, 1.0001 * guess), solver="secant", tol=1e-50, maxsteps=STEPS
    )
    _, period, above = around(amplitude)
    return amplitude, period, above


def scene(speed):
    """Return the mass on a belt at a speed."""
    return ss.models.bistable_oscillator(
        damping_ratio=DAMPING, kinetic=KINETIC, static_ratio=RATIO, speed=DECAY, slider_speed=speed
    )


def boundary_at(speed):
    """Return the boundary between the basins of sliding and of stick-slip over bSTAB's box of starts."""
    found = ss.basins(
        scene(speed),
        start=ss.State([0.0], [0.0], "+", ["x"]),
        position={"x": np.linspace(-BOX[0], BOX[0], 9)},
        velocity={"x": np.linspace(0.0, BOX[1], 6)},
    )
    return found.boundary()


#: Belt speeds with a guess of the amplitude and printed digits of amplitude, period and fraction.
ORBITS = (
    (1.175, 0.3155, "0.315479587671", "6.284164274226", "0.018774"),
    (1.5, 1.3302, "1.330254955995", "6.295334793503", "0.3071261378"),
    (1.55, 1.4369, "1.436881604021", "6.296768376680", "0.356596"),
    (1.625, 1.5887, "1.588738633772", "6.298812843941", "0.42810"),
    (1.775, 1.8713, "1.871341138980", "6.302575863696", "0.55837"),
)


def quantities():
    """Compare the Hopf point, unstable cycles with what they enclose, and the speed at which they end."""
    (hopf,) = ss.critical_points(scene(1.0), {"slider_speed": (1.0, 1.5)}, kinds=("hopf",))
    found = [
        Quantity(
            name="speed at which sliding becomes stable",
            unit="m/s",
            # z = k (r - 1) exp(-v / v0) / (2 v0)
            expected=decimal(DECAY) * mp.log(10),
            computed=hopf.value,
            reference="1.15129254649702",
        )
    ]
    for speed, guess, amplitude, period, fraction in ORBITS:
        boundary = boundary_at(speed)
        (cycle,), (part,) = boundary.cycles, boundary.fractions
        largest, duration, area = orbit(speed, guess)
        extreme = float(cycle.maximum[0] - ss.steady_sliding(cycle.scene).position[0])
        for name, unit, expected, computed, printed in (
            ("amplitude", "m", largest, extreme, amplitude),
            ("period", "s", duration, cycle.period, period),
            ("basin of sliding", "", area / 8, part, fraction),
        ):
            title = f"{name} at {speed} m/s"
            found.append(
                Quantity(name=title, unit=unit, expected=expected, computed=computed, reference=printed)
            )
    branch = ss.continuation(cycle, {"slider_speed": (speed, 1.9)})
    ends = next(point for point in branch.points if point.kind == "grazing")
    found.append(
        Quantity(
            name="speed at which both cycles meet",
            unit="m/s",
            expected=mp.mpf("1.836600972"),
            computed=ends.value,
            reference="1.836600972",
            relative=5e-10,
        )
    )
    return found


CASES = [
    Case(
        title="Bistable mass on a belt, with the basin of sliding",
        source=(
            "bSTAB (Stender and Hoffmann, *Nonlinear Dynamics* 107, 2022), `case_friction`; the integral "
            "over the unstable orbit in 30 digits, of which its Monte Carlo fractions are estimates."
        ),
        model=(
            "`x'' + 2 z x' + x = F(v - x')`, `F(s) = k + k (r - 1) exp(-s / v0)`; z = 0.05, k = 0.5, r = 2, "
            "v0 = 0.5. Starts with x in [-2, 2], x' in [0, 2]: those within the unstable orbit without "
            "events come to steady sliding. Their part is the integral of `x'^2` over the time in which "
            "x' is positive and x at most 2, over 8; x passes 2 from 1.625 m/s on. Computed by "
            "`Basins.boundary` from a map of 9 by 6 starts, and by `continuation` of the last cycle to where "
            "it reaches the speed of the belt."
        ),
        tolerance=(
            "Taylor series of the orbit in 30 digits: 1e-12; an orbit that repels by 3 % in a period, at "
            "1.175 m/s, is as exact as its multiplier allows. The last speed is printed to 10 digits."
        ),
        quantities=quantities,
    )
]
