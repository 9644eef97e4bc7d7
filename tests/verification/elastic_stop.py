"""A mass runs into a stop of finite stiffness, at once, behind a clearance, and falling.

While the stop is pressed, ``m x'' + (k + K) x = 0`` from x = 0 with the speed v: ``x = v / W sin W t`` with
``W = sqrt((k + K) / m)``. The largest force is ``K v / W``, contact lasts ``pi / W``, and the mass leaves
with -v; half a period of k alone later, ``pi sqrt(m / k)``, it is there again.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

MASS, SPRING, STOP, SPEED = 100.0, 1e4, 1e6, 1.0


def quantities():
    """Compare force and times with the closed form."""
    mass, spring, stop, speed = map(decimal, (MASS, SPRING, STOP, SPEED))
    rate = mp.sqrt((spring + stop) / mass)
    contact = ss.Contact(normal=[-1.0], normal_stiffness=STOP)
    scene = ss.Scene([MASS], [[SPRING]], contacts=[contact])
    run = ss.simulate(scene, 0.4, ss.State([0.0], [SPEED], "+"))
    release, closing = run.events.time[:2]
    assert run.events.kind[:2].tolist() == ["release", "closing"]
    largest = run.sample([0.5 * np.pi / float(rate)]).normal_force.item()
    flight = mp.pi * mp.sqrt(mass / spring)
    return [
        Quantity(
            name="largest force",
            unit="N",
            expected=stop * speed / rate,
            computed=largest,
            reference="9950.37",
        ),
        Quantity(name="contact", unit="s", expected=mp.pi / rate, computed=release, reference="0.0312600"),
        Quantity(name="closing again", unit="s", expected=mp.pi / rate + flight, computed=closing),
    ]


#: Mass, kg, stiffness, N/m^1.5, and speed, m/s, of an impact on a round body.
HERTZ = (1.0, 1e9, 1.0)

#: Mass, kg, spring and stop, N/m, and clearance, m, of a nonlinear mode, and its frequency by energy, J.
MODE = (1.0, 10.0, 50.0, 0.01)
FREQUENCIES = {
    0.00650108331626: "0.64663104063983704",
    0.002: "0.59865096232926885",
    0.05: "0.68880008929699642",
}


def mode():
    """Compare frequencies of free motion against a stop behind a clearance."""
    mass, spring, stop, clearance = MODE
    contact = ss.Contact(normal=[-1.0], gap=clearance, normal_stiffness=stop)
    scene = ss.Scene([mass], [[spring]], contacts=[contact])
    m, k, kc, j = map(decimal, MODE)
    found = []
    for energy, known in FREQUENCIES.items():
        e = decimal(energy)
        rate = mp.sqrt((k + kc) / m)
        # The mass swings about x1 while it presses the stop, and meets it with the speed v.
        x1, v = kc * j / (k + kc), mp.sqrt((2 * e - k * j**2) / m)
        pressed = 2 * mp.atan2(v / rate, j - x1) / rate
        free = (2 * mp.pi - 2 * mp.acos(j / mp.sqrt(2 * e / k))) * mp.sqrt(m / k)
        start = ss.State([0.0], [float(mp.sqrt(2 * e / m))], "d")
        run = ss.simulate(scene, 4.0, start)
        closings = run.events.time[run.events.kind == "closing"]
        found.append(
            Quantity(
                name=f"frequency at {energy:g} J",
                unit="Hz",
                expected=1 / (free + pressed),
                computed=float(1.0 / (closings[1] - closings[0])),
                reference=known,
            )
        )
    return found


def fallen():
    """Compare a mass that falls on a stop with the closed form."""
    speed, gravity, height, stop = map(decimal, (1.0, 10.0, 2.0, 100.0))
    meets = (-speed + mp.sqrt(speed**2 + 2 * gravity * height)) / gravity
    fast, rate, sunk = speed + gravity * meets, mp.sqrt(stop), gravity / stop
    # -sunk + sunk cos(phase) - fast / rate sin(phase) is zero where tan(phase / 2) = -fast / (rate sunk).
    lasts = 2 * (mp.pi - mp.atan(fast / (rate * sunk))) / rate
    leaves = meets + lasts

    def place(t):
        return -height + fast * (decimal(t) - leaves) - gravity / 2 * (decimal(t) - leaves) ** 2

    contact = ss.Contact(normal=[1.0], gap=2.0, normal_stiffness=100.0)
    scene = ss.Scene([1.0], [[0.0]], force=[-10.0], contacts=[contact])
    run = ss.simulate(scene, 1.1, ss.State([0.0], [-1.0], "d"))
    closing, release = run.events.time
    places = run.sample([1.0, 1.1]).position.to_numpy()[:, 0]
    return [
        Quantity(name="contact", unit="s", expected=meets, computed=closing, reference="0.54031242374329"),
        Quantity(name="end", unit="s", expected=leaves, computed=release, reference="0.88545615307643"),
        Quantity(
            name="place after 1 s",
            unit="m",
            expected=place(1.0),
            computed=float(places[0]),
            reference="-1.332162981855",
        ),
        Quantity(
            name="place after 1.1 s",
            unit="m",
            expected=place(1.1),
            computed=float(places[1]),
            reference="-0.856394405035",
        ),
    ]


def hertzian():
    """Compare the impact on a round body with Hertz's integral."""
    mass, stiffness, speed = map(decimal, HERTZ)
    deepest = (5 * mass * speed**2 / (4 * stiffness)) ** (mp.mpf(2) / 5)
    gammas = mp.gamma(mp.mpf(2) / 5) / mp.gamma(mp.mpf(9) / 10)
    lasts = mp.mpf(4) / 5 * mp.sqrt(mp.pi) * gammas * deepest / speed
    contact = ss.Contact(normal=[-1.0], normal_stiffness=ss.spring.Hertz(HERTZ[1]))
    scene = ss.Scene([HERTZ[0]], [[0.0]], contacts=[contact])
    run = ss.simulate(scene, 1e-3, ss.State([0.0], [HERTZ[2]], "+"))
    middle = run.sample([0.5 * float(lasts)])
    return [
        Quantity(
            name="largest penetration",
            unit="m",
            expected=deepest,
            computed=middle.position.item(),
            reference="2.7464013582652944e-4",
        ),
        Quantity(
            name="largest force",
            unit="N",
            expected=stiffness * deepest ** (mp.mpf(3) / 2),
            computed=middle.normal_force.item(),
            reference="4551.4105075652007",
        ),
        Quantity(
            name="contact",
            unit="s",
            expected=lasts,
            computed=run.events.time[0],
            reference="8.0834149639779036e-4",
        ),
        Quantity(name="speed after it", unit="m/s", expected=-speed, computed=run.state(1e-3).velocity[0]),
    ]


CASES = [
    Case(
        title="Oscillator on an elastic stop",
        source="Code_Aster, case SDND101: a mass on a spring against a stop, without friction.",
        model=(
            "`m x'' + k x = 0` with m = 100 kg, k = 1e4 N/m, and a stop of stiffness K = 1e6 N/m at x = 0, "
            "which it meets with v = 1 m/s. With `W = sqrt((k + K) / m)` the largest force is `K v / W`, "
            "contact lasts `pi / W` and the flight after it `pi sqrt(m / k)`."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=quantities,
    ),
    Case(
        title="Nonlinear mode of an oscillator on a one-sided stop",
        source=(
            "Code_Aster, case SDND122, whose deck prints 0.64621695338 Hz for 6.50108331626 mJ as "
            "analytical and 0.64669392749957 Hz as computed. The first drops the term `k k_c j^2` of the "
            "amplitude at the stop, `cos^2 = k^2 j^2 / (2 E (k + k_c) - k k_c j^2)`; the second has a "
            "regularised contact. Both pass its tolerance of 1e-3."
        ),
        model=(
            "`m x'' + k x = 0` with m = 1 kg, k = 10 N/m, and a stop of stiffness k_c = 50 N/m at j = 0.01 "
            "m. Free motion of the energy E has the period `(2 pi - 2 acos(j / A)) sqrt(m / k) + 2 atan2(v "
            "/ W, j - x1) / W`, `A = sqrt(2 E / k)`, `W = sqrt((k + k_c) / m)`, `x1 = k_c j / (k + k_c)`, "
            "`v^2 = (2 E - k j^2) / m`."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=mode,
    ),
    Case(
        title="Mass that falls on an elastic stop",
        source="Code_Aster, case SDND108, with the digits that its deck prints.",
        model=(
            "m = 1 kg falls with g = 10 m/s^2 from z = 0 at 1 m/s on a stop of 100 N/m at z = -2 m, and "
            "leaves it when its force is zero again."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=fallen,
    ),
    Case(
        title="Impact of a mass on a round body",
        source=(
            "H. Hertz, *J. reine angew. Math.* 92 (1882) 156; K. L. Johnson, *Contact Mechanics*, 1985, "
            "section 11.4."
        ),
        model=(
            "`m x'' = -K x^(3/2)` with m = 1 kg, K = 1e9 N/m^(3/2), from x = 0 with v = 1 m/s. The largest "
            "penetration is `d = (5 m v^2 / (4 K))^(2/5)`, contact lasts `(4/5) sqrt(pi) Gamma(2/5) / "
            "Gamma(9/10) d / v`, and the mass leaves with -v."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=hertzian,
    ),
]
