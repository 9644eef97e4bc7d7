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


def to_turn(x, e):
    """Return place, e, duration and the integral of u^2 from one turn to the next; e is that of u = 0."""
    u, time, area = mp.mpf(0), mp.mpf(0), mp.mpf(0)
    while True:
        xs, us, es, areas = series(x, u, e)
        step, sign = STEP, mp.sign(us[-1] if us[-1] != 0 else us[-2])
        turns = time > 0 and mp.sign(at(us, step)) != sign
        if turns:
            step = mp.findroot(lambda t, us=us: at(us, t), (0, STEP), solver="anderson", tol=1e-60)
        x, u, e, more = (at(coefficients, step) for coefficients in (xs, us, es, areas))
        time, area = time + step, area + more
        if turns:
            return x, e, time, area


@cache
def orbit(speed, guess):
    """Return amplitude about steady sliding, period and enclosed area of the unstable orbit."""
    v, decay = decimal(speed), decimal(DECAY)
    still = mp.exp(-v / decay)
    rest = decimal(KINETIC) * (1 + (decimal(RATIO) - 1) * still)

    def around(amplitude):
        low, e, first, _ = to_turn(rest + amplitude, still)
        high, _, second, above = to_turn(low, e)
        return high - rest - amplitude, first + second, above

    amplitude = mp.findroot(lambda a: around(a)[0], (guess, 1.0001 * guess), solver="secant", tol=1e-50)
    _, period, above = around(amplitude)
    return amplitude, period, above


def scene(speed):
    """Return the mass on a belt at a speed."""
    return ss.models.bistable_oscillator(
        damping_ratio=DAMPING, kinetic=KINETIC, static_ratio=RATIO, speed=DECAY, slider_speed=speed
    )


def cycle_at(speed, guess):
    """Return the unstable cycle that Newton's method finds from an amplitude, and its place of rest."""
    rest = ss.steady_sliding(scene(speed))
    run = ss.simulate(scene(speed), 14.0, rest.perturbed(position={"x": guess}))
    return run.closed_cycle(), float(rest.position[0])


def area_above(cycle):
    """Return the area between the orbit and u = 0, where u is positive: the integral of u^2 over time."""
    times = np.linspace(0.0, cycle.period, 65)
    velocity = cycle.run.sample(times).velocity.to_numpy()[:, 0]
    # From the turn at which u becomes positive to the next one, by Gauss on eight parts of one period.
    rises = np.flatnonzero((velocity[:-1] <= 0.0) & (velocity[1:] > 0.0))
    falls = np.flatnonzero((velocity[:-1] > 0.0) & (velocity[1:] <= 0.0))

    def turn(k):
        low, high = times[k], times[k + 1]
        sign = velocity[k] > 0.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            here = cycle.run.sample([middle]).velocity.to_numpy()[0, 0] > 0.0
            low, high = (middle, high) if here == sign else (low, middle)
        return high

    begin, end = turn(rises[0]), turn(falls[0])
    end += cycle.period * (end < begin)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    total = 0.0
    for a, b in zip(np.linspace(begin, end, 9)[:-1], np.linspace(begin, end, 9)[1:], strict=True):
        places = (0.5 * (a + b) + 0.5 * (b - a) * nodes) % cycle.period
        order = np.argsort(places)
        u = cycle.run.sample(places[order]).velocity.to_numpy()[:, 0]
        total += 0.5 * (b - a) * float(weights[order] @ u**2)
    return total


#: Belt speeds with a guess of the amplitude and printed digits of amplitude, period and fraction.
ORBITS = (
    (1.175, 0.3155, "0.315479587671", "6.284164274226", "0.018774"),
    (1.5, 1.3302, "1.330254955995", "6.295334793503", "0.3071261378"),
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
        cycle, rest = cycle_at(speed, guess)
        largest, duration, area = orbit(speed, guess)
        extreme = float(cycle.core.maximum[0]) - rest
        # Bounds of the box of starts: 4 m by 2 m/s.
        part = area_above(cycle) / 8.0
        for name, unit, expected, computed, printed in (
            ("amplitude", "m", largest, extreme, amplitude),
            ("period", "s", duration, cycle.period, period),
            ("basin of sliding", "", area / 8, part, fraction),
        ):
            title = f"{name} at {speed} m/s"
            found.append(
                Quantity(name=title, unit=unit, expected=expected, computed=computed, reference=printed)
            )
    branch = ss.continuation(cycle, {"slider_speed": (1.5, 1.9)})
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
            "x' is positive, over 8. Computed by `closed_cycle` from a motion near the orbit, and by "
            "`continuation` to where the orbit reaches the speed of the belt."
        ),
        tolerance=(
            "Taylor series of the orbit in 30 digits: 1e-12; an orbit that repels by 3 % in a period, at "
            "1.175 m/s, is as exact as its multiplier allows. The last speed is printed to 10 digits."
        ),
        quantities=quantities,
    )
]
