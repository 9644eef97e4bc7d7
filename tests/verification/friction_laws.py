"""Friction over slip speed: a block on a Stribeck belt, and a mass with Stribeck friction between stops.

Both are ``x'' = a0 + ax x + av x' + b exp(g x')`` while they slide. With ``e = exp(g v)`` the powers of time
follow from

    (k + 1) x_(k+1) = v_k,   (k + 1) v_(k+1) = a0 [k = 0] + ax x_k + av v_k + b e_k,
    (k + 1) e_(k+1) = g sum_(j = 1)^(k + 1) j v_j e_(k + 1 - j),

here 40 of them over steps of 5 ms, in 40 digits. About a cycle without events the multiplier beside 1 is
``exp(int (av + b g e) dt)`` over its period: the area between neighbours grows by the divergence (Liouville).
"""

from functools import cache

import stickslip as ss
from law_blocks import block, small_cycle
from stickslip.scene.laws.friction import Stribeck
from verification.case import Case, Quantity, decimal, mp

ORDER = 40
STEP = mp.mpf(1) / 200
#: Steps of the secant method, which then is in the rounding of its series; it checks itself to 25 digits.
STEPS = 8
STATIC, KINETIC, SCALE, FORCE, DAMPING, STIFFNESS = map(decimal, (0.5, 0.3, 0.1, 10.0, 1.0, 100.0))
HOPF = SCALE * mp.log(FORCE * (STATIC - KINETIC) / (SCALE * DAMPING))


class Slide:
    """Motion with ``a0, ax, av, b, g`` from a state on."""

    def __init__(self, numbers, x, v):
        self.numbers = numbers
        self.state = (x, v)
        self.time = mp.mpf(0)
        #: Integral of the divergence.
        self.divergence = mp.mpf(0)

    def acceleration(self, x, v):
        a0, ax, av, b, g = self.numbers
        return a0 + ax * x + av * v + b * mp.exp(g * v)

    def series(self):
        """Return the coefficients of x, v and the integral of the divergence."""
        a0, ax, av, b, g = self.numbers
        x, v = [self.state[0]], [self.state[1]]
        e, d = [mp.exp(g * v[0])], [self.divergence]
        for k in range(ORDER):
            constant = a0 if k == 0 else 0
            x.append(v[k] / (k + 1))
            v.append((constant + ax * x[k] + av * v[k] + b * e[k]) / (k + 1))
            d.append(((av if k == 0 else 0) + b * g * e[k]) / (k + 1))
            e.append(g * mp.fsum(j * v[j] * e[k + 1 - j] for j in range(1, k + 2)) / (k + 1))
        return x, v, d

    def until(self, event, after=0):
        """Go on to where a function of the state falls through zero, later than a time."""
        while True:
            rows = self.series()

            def at(time, rows=rows):
                return [evaluated(row, time) for row in rows]

            begin, end = event(*self.state), event(*at(STEP)[:2])
            found = STEP
            if begin > 0 >= end and self.time + STEP > after:
                bracket = (mp.mpf(0), STEP)
                found = mp.findroot(lambda t: event(*at(t)[:2]), bracket, solver="anderson", tol=1e-70)
            *state, self.divergence = at(found)
            self.state = tuple(state)
            self.time += found
            if found is not STEP:
                return self


def evaluated(coefficients, time):
    """Return the value of a polynomial, by Horner's scheme."""
    value = mp.mpf(0)
    for c in reversed(coefficients):
        value = value * time + c
    return value


def on_belt(speed, x, v):
    """Return the block that slips behind a belt."""
    falling = FORCE * (STATIC - KINETIC) * mp.exp(-speed / SCALE)
    return Slide((FORCE * KINETIC, -STIFFNESS, -DAMPING, falling, 1 / SCALE), x, v)


@cache
def fold():
    """Return the speed of the belt at which the slide from the end of sticking comes back to that speed."""

    def excess(speed):
        slide = on_belt(speed, (FORCE * STATIC - DAMPING * speed) / STIFFNESS, speed)
        return slide.until(slide.acceleration, after=0.3).state[1] - speed

    return mp.findroot(excess, (mp.mpf("0.602"), mp.mpf("0.603")), solver="secant", tol=1e-50, maxsteps=STEPS)


def closed(speed, guess):
    """Return the period and the multiplier of the cycle that turns back near a place."""

    def turned(x):
        slide = on_belt(speed, x, mp.mpf(0))
        # Down to the other end, and up again.
        return slide.until(lambda _, v: -v).until(lambda _, v: v)

    def excess(x):
        return turned(x).state[0] - x

    place = mp.findroot(
        excess, (guess, guess * (1 + mp.mpf(10) ** -6)), solver="secant", tol=1e-50, maxsteps=STEPS
    )
    end = turned(place)
    return end.time, mp.exp(end.divergence)


def belt():
    """Compare the Hopf point, the fold of the branch that is born there, and cycles on that branch."""
    hopf = ss.critical_points(block(0.2), {"slider_speed": (0.1, 0.5)})[0]
    first = small_cycle(1.01 * float(HOPF))
    end = ss.continuation(first, {"slider_speed": (1.01 * float(HOPF), 0.8)}).points[0]
    rows = [
        Quantity(name="Hopf speed", unit="m/s", expected=HOPF, computed=hopf.value),
        Quantity(
            name="speed of the fold",
            unit="m/s",
            expected=fold(),
            computed=end.value,
            reference="0.602517768755",
        ),
    ]
    for speed, guess in ((0.33, 0.17),):
        cycle = small_cycle(speed, guess)
        largest = ss.steady_sliding(cycle.scene).position[0] + cycle.amplitude[0]
        period, multiplier = closed(decimal(speed), decimal(float(largest)))
        computed = max(abs(m) for m in cycle.multipliers)
        named = f"of the cycle at {speed} m/s"
        rows += [
            Quantity(name=f"period {named}", unit="s", expected=period, computed=cycle.period),
            Quantity(name=f"multiplier {named}", unit="", expected=multiplier, computed=computed),
        ]
    return rows


def swing(x, v, sign):
    """Return the mass of the Modelica library that slides in the direction of `sign`."""
    return Slide(
        (mp.mpf(-125 - 3 * sign), mp.mpf(-500), mp.mpf(-1), mp.mpf(-5 * sign), mp.mpf(-2 * sign)), x, v
    )


def turning(x, sign):
    """Return the times and places at which the mass turns back, until it sticks."""
    time, found = mp.mpf(0), []
    while abs(-500 * x - 125) > 8:
        slide = swing(x, mp.mpf(0), sign).until(lambda _, v, sign=sign: sign * v)
        time += slide.time
        x = slide.state[0]
        found.append((time, x))
        sign = -sign
    return found


def between_stops():
    """Compare the mass between stops with the times and places that the library's example has."""
    struck = swing(mp.mpf(0), mp.mpf(-5), -1).until(lambda x, _: x + decimal(0.4))
    turns = [(struck.time + time, x) for time, x in turning(-decimal(0.4), 1)]
    law = Stribeck(8.0, 3.0, 0.5, viscous=1.0)
    contacts = [
        ss.Contact(tangential="x", normal_force=1.0, friction=law),
        ss.Contact(normal={"x": 1.0}, gap=0.4),
        ss.Contact(normal={"x": -1.0}, gap=0.4),
    ]
    scene = ss.Scene([1.0], [[500.0]], force=[-125.0], contacts=contacts, dofs=["x"])
    run = ss.simulate(scene, 2.0, ss.State([0.0], [-5.0], "+dd", dofs=scene.dofs))
    before = run.state(float(run.events.time[0]) * (1.0 - 2.0**-52)).velocity[0]
    rows = [
        Quantity(
            name="lower stop",
            unit="s",
            expected=struck.time,
            computed=run.events.time[0],
            reference="0.060597095609",
        ),
        Quantity(
            name="velocity before it",
            unit="m/s",
            expected=struck.state[1],
            computed=before,
            reference="-6.10565384",
        ),
    ]
    # The first one belongs to the stop.
    kinds = [k for k, kind in enumerate(run.events.kind) if kind == "velocity"][1:]
    assert len(kinds) == len(turns)
    references = {
        0: ("0.201105952", "-0.12232672"),
        1: ("0.341617058", "-0.35661463"),
        len(turns) - 1: ("1.045973749", "-0.24751399"),
    }
    for k, (time, x) in enumerate(turns):
        name = "sticks" if k == len(turns) - 1 else f"turn {k + 1}"
        known = references.get(k, ("", ""))
        computed = run.events.time[kinds[k]]
        place = run.state(float(computed)).position[0]
        rows += [
            Quantity(name=name, unit="s", expected=time, computed=computed, reference=known[0]),
            Quantity(name=f"place, {name}", unit="m", expected=x, computed=place, reference=known[1]),
        ]
    return rows


CASES = [
    Case(
        title="Block on a Stribeck belt",
        source=(
            "Negative damping by falling friction. Hopf speed in closed form; the branch that is born there"
            " by the equation of motion in 40 digits."
        ),
        model=(
            "`m x'' + c x' + k x = N mu(v - x')`, `mu(s) = 0.3 + 0.2 exp(-s / 0.1)`; m = 1 kg, c = 1 N s/m,"
            " k = 100 N/m, N = 10 N. Steady sliding loses stability where `c + N mu'(v) = 0`, v = 0.1 log "
            "20. The unstable cycles born there end where they touch the speed of the belt: there the slide"
            " from the end of sticking, `k x + c v = N mu(0)`, comes back to it. Their multiplier is the "
            "exponential of the integral of `-c - N mu'` over a period. Computed by `critical_points`, "
            "`closed_cycle` and `continuation`."
        ),
        tolerance="Closed form and 40 digits: 1e-12.",
        quantities=belt,
    ),
    Case(
        title="Stribeck friction between stops",
        source=(
            "Modelica Standard Library, Mechanics.Translational.Examples.Friction with stops; evaluated "
            "from its equations in 40 digits."
        ),
        model=(
            "`x'' + 500 (x + 0.25) = -x' - sign(x') (3 + 5 exp(-2 |x'|))`, static friction 8 N, m = 1 kg, "
            "from x = 0 with x' = -5 m/s, between plastic stops at x = -0.4 and 0.4 m. The mass strikes the"
            " lower stop, swings and sticks. Friction `viscous = 1`, `speed = 0.5` under a normal force of "
            "1 N; three contacts along one dof."
        ),
        tolerance="40 digits: 1e-12.",
        quantities=between_stops,
    ),
]
