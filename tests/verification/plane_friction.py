"""Friction in a plane: a puck on an incline, a mass under a rotating load, and vibration across sliding."""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

#: g, m/s^2, slope, coefficient and speed, m/s, of two pucks, and T, X and Y to 17 digits.
PUCKS = [
    ((9.81, 0.5, 0.8, 2.0), ("0.54413183608894114", "0.32871240846481622", "0.18578786053666366")),
    ((10.0, 0.3, 0.5, 1.0), ("0.33916928382884716", "0.11575127401113722", "0.052458677121198706")),
]


def puck(gravity, slope, friction):
    """Return a puck of 1 kg that falls along y."""
    contact = ss.Contact(
        tangential=("x", "y"), normal_force=gravity * np.cos(slope), friction=friction, name="puck"
    )
    force = [0.0, gravity * np.sin(slope)]
    return ss.Scene([1.0, 1.0], np.zeros((2, 2)), force=force, dofs=("x", "y"), contacts=[contact])


def thrown():
    """Compare where and when two pucks stop."""
    found = []
    for (gravity, slope, friction, speed), known in PUCKS:
        scene = puck(gravity, slope, friction)
        run = ss.simulate(scene, 1.0, ss.State([0.0, 0.0], [speed, 0.0], "oo"))
        (time,) = run.events.time
        across, down = run.sample(time).position.values.ravel()
        g, a, mu, v = map(decimal, (gravity, slope, friction, speed))
        pull, k = g * mp.sin(a), mu / mp.tan(a)
        expected = (
            v * k / (pull * (k**2 - 1)),
            2 * k * v**2 / (pull * (4 * k**2 - 1)),
            v**2 / (4 * pull * (k**2 - 1)),
        )
        for name, unit, computed, closed, digits in zip(
            ("time of the stop", "way across", "way down"),
            ("s", "m", "m"),
            (time, across, down),
            expected,
            known,
            strict=True,
        ):
            found.append(
                Quantity(
                    name=f"{name}, {speed:g} m/s",
                    unit=unit,
                    expected=closed,
                    computed=float(computed),
                    reference=digits,
                    relative=1e-14,
                )
            )
    return found


def limit():
    """Compare the last speed of a puck on the slope of its friction."""
    scene = puck(9.81, 0.5, float(np.tan(0.5)))
    run = ss.simulate(scene, 50.0, ss.State([0.0, 0.0], [2.0, 0.0], "oo"))
    _, down = run.sample(50.0).velocity.values.ravel()
    return [
        Quantity(
            name="speed down the slope", unit="m/s", expected=mp.mpf(1), computed=float(down), relative=1e-12
        )
    ]


def circle():
    """Compare a circle under a rotating load after one turn."""
    rate, friction, damping, radius = 0.8, 0.3, 0.05, 2.5437483730543945
    phase = np.angle((1.0 - rate**2) * radius + 1j * (damping * rate * radius + friction))
    belt = ss.models.mass_on_belt_in_plane(
        stiffness=1.0, damping=damping, normal_force=1.0, friction=friction, slider_speed=0.0
    )
    loads = [
        ss.Harmonic({"x": 1.0}, rate / (2 * np.pi)),
        ss.Harmonic({"y": 1.0}, rate / (2 * np.pi), phase=-np.pi / 2),
    ]
    scene = belt.replace(loads=loads)
    place = radius * np.array([np.cos(phase), -np.sin(phase)])
    start = ss.State(place, rate * np.array([-place[1], place[0]]), "oo")
    run = ss.simulate(scene, 2 * np.pi / rate, start)
    last = run.sample(run.duration).position.values.ravel()
    c, w, f = map(decimal, (damping, rate, friction))
    stiffness = 1 - w**2
    # P^2 = (s R)^2 + (c w R + f)^2
    both = stiffness**2 + (c * w) ** 2
    root = (mp.sqrt((c * w * f) ** 2 + both * (1 - f**2)) - c * w * f) / both
    cycle = ss.simulate(scene, 200.0, start).limit_cycle(further=1000.0)
    multipliers = sorted(np.abs(cycle.multipliers))
    lost = -float(run.balance().contacts.work.to_numpy().sum())
    return [
        Quantity(
            name="radius after a turn",
            unit="m",
            expected=root,
            computed=float(np.hypot(*last)),
            reference="2.5437483730543945",
            relative=1e-14,
        ),
        Quantity(
            name="friction loss of a turn",
            unit="J",
            expected=2 * mp.pi * f * root,
            computed=lost,
            relative=1e-13,
        ),
        *(
            Quantity(
                name=f"modulus of the {which} multipliers",
                unit="",
                expected=mp.mpf(digits),
                computed=float(multiplier),
                relative=1e-12,
            )
            for which, digits, multiplier in (
                ("smaller", "0.614690860013788", multipliers[0]),
                ("larger", "0.615708764022376", multipliers[2]),
            )
        ),
    ]


def circle_by_law():
    """Compare a circle under friction that falls with the slip speed, and its multipliers."""
    rate, damping = 0.8, 0.05
    static, kinetic, speed = 0.5, 0.2, 3.0
    belt = ss.models.mass_on_belt_in_plane(
        stiffness=1.0,
        damping=damping,
        normal_force=1.0,
        friction=ss.friction.Stribeck(static, kinetic, speed),
        slider_speed=0.0,
    )
    loads = [
        ss.Harmonic({"x": 1.0}, rate / (2 * np.pi)),
        ss.Harmonic({"y": 1.0}, rate / (2 * np.pi), phase=-np.pi / 2),
    ]
    scene = belt.replace(loads=loads)
    c, w, mu_s, mu_k, v = map(decimal, (damping, rate, static, kinetic, speed))
    stiffness = 1 - w**2

    def falling(slip):
        return (mu_s - mu_k) * mp.exp(-slip / v)

    def balance(radius):
        friction = mu_k + falling(w * radius)
        return (stiffness * radius) ** 2 + (c * w * radius + friction) ** 2 - 1

    root = mp.findroot(balance, 2.5)
    slip = w * root
    friction = mu_k + falling(slip)
    phase = float(mp.atan2(c * slip + friction, stiffness * root))
    place = float(root) * np.array([np.cos(phase), -np.sin(phase)])
    start = ss.State(place, rate * np.array([-place[1], place[0]]), "oo")
    run = ss.simulate(scene, 2 * np.pi / rate, start)
    last = run.sample(run.duration).position.values.ravel()
    cycle = ss.simulate(scene, 200.0, start).limit_cycle(further=1000.0)
    multipliers = sorted(np.abs(cycle.multipliers))
    # In the frame of the load, with the slip along the first direction: places, and velocities of slip.
    along, across = c - falling(slip) / v, c + friction / slip
    turning = mp.matrix([[0, w, 1, 0], [-w, 0, 0, 1], [-1, 0, -along, w], [0, -1, -w, -across]])
    exponents = mp.eig(turning, left=False, right=False)
    expected = sorted(mp.exp(2 * mp.pi / w * mp.re(exponent)) for exponent in exponents)
    return [
        Quantity(
            name="radius after a turn",
            unit="m",
            expected=root,
            computed=float(np.hypot(*last)),
            relative=1e-14,
        ),
        Quantity(
            name="friction loss of a turn",
            unit="J",
            expected=2 * mp.pi * friction * root,
            computed=-float(run.balance().contacts.work.to_numpy().sum()),
            relative=1e-13,
        ),
        *(
            Quantity(
                name=f"modulus of the {which} multipliers",
                unit="",
                expected=expected[place],
                computed=float(multipliers[place]),
                relative=1e-12,
            )
            for which, place in (("smaller", 0), ("larger", 2))
        ),
    ]


def across():
    """Compare the mean friction of a slider that vibrates across its sliding."""
    found = []
    speed, frequency, heavy = 0.5, 10.0, 1e9
    for ratio, digits in (
        (1.0, "0.83462684167407319"),
        (2.0, "0.64263768177312447"),
        (3.0, "0.51901337919042176"),
        (10.0, "0.23441565423091321"),
    ):
        contact = ss.Contact(
            tangential=("x", "y"),
            normal_force=1.0,
            friction=0.3,
            slider_speed=(speed, 0.0),
            slider_vibration=(None, ss.Harmonic(ratio * speed, frequency)),
        )
        scene = ss.Scene([heavy, heavy], np.zeros((2, 2)), dofs=("x", "y"), contacts=[contact])
        run = ss.simulate(scene, 1.0 / frequency, ss.State([0.0, 0.0], [0.0, 0.0], "oo"))
        work = float(run.balance().contacts.slider.to_numpy()[0].sum())
        a = decimal(ratio)
        m = a**2 / (1 + a**2)
        found.append(
            Quantity(
                name=f"mean friction over mu N, vibration {ratio:g} times as fast as the slider",
                unit="",
                expected=2 / mp.pi * mp.ellipk(m) / mp.sqrt(1 + a**2),
                computed=work * frequency / (0.3 * speed),
                reference=digits,
                relative=1e-10,
            )
        )
    return found


def along():
    """Compare the mean friction of a slider that vibrates along its sliding, and turns back."""
    found = []
    speed, frequency, heavy = 0.5, 10.0, 1e9
    for ratio, digits in ((2.0, "0.33333333333333333"), (3.0, "0.21634689593878546"), (10.0, "")):
        wave = ss.Harmonic(ratio * speed, frequency)
        contact = ss.Contact(
            tangential="x", normal_force=1.0, friction=0.3, slider_speed=speed, slider_vibration=wave
        )
        scene = ss.Scene([heavy], [[0.0]], dofs=("x",), contacts=[contact])
        run = ss.simulate(scene, 1.0 / frequency, ss.State([0.0], [0.0], "+"))
        # From event to event the friction force has one sign.
        turns = np.concatenate([[0.0], run.events.time, [1.0 / frequency]])
        signs = np.resize([1.0, -1.0], turns.size - 1)
        found.append(
            Quantity(
                name=f"mean friction over mu N, vibration {ratio:g} times as fast as the slider",
                unit="",
                expected=2 / mp.pi * mp.asin(1 / decimal(ratio)),
                computed=float(signs @ np.diff(turns)) * frequency,
                reference=digits,
                relative=1e-9,
            )
        )
    return found


CASES = [
    Case(
        title="Puck on an incline",
        source="Closed form of the hodograph, `v = v0 tan(phi/2)^k / sin(phi)`, `k = mu / tan(a)`.",
        model=(
            "A puck on a plane of slope a, thrown horizontally, with Coulomb friction in the plane: it turns "
            "down the slope as it stops, `T = v0 k / (A (k^2 - 1))`, `A = g sin(a)`, with a singularity of "
            "its direction that is no power series in time."
        ),
        tolerance="1e-14, relative.",
        quantities=thrown,
    ),
    Case(
        title="Puck on the slope of its friction",
        source="Closed form, `v (1 + cos(phi))` is constant.",
        model="The same with `k = 1`: the puck never stops, and ends with half its speed, down the slope.",
        tolerance="1e-12, relative.",
        quantities=limit,
    ),
    Case(
        title="Circle under a rotating load",
        source="Closed form, `P^2 = ((k - m W^2) R)^2 + (c W R + f)^2`.",
        model=(
            "A mass of 1 kg on springs of 1 N/m with dampers of 0.05 N s/m and friction of 0.3 N in the "
            "plane, under a load of 1 N that turns by 0.8 1/s. In the frame of the load the linearisation "
            "is constant, and gives the multipliers."
        ),
        tolerance="1e-14 to 1e-12, relative.",
        quantities=circle,
    ),
    Case(
        title="Circle under friction that falls with the slip speed",
        source=(
            "Closed form, `P^2 = ((k - m W^2) R)^2 + (c W R + mu(W R) N)^2`, and the eigenvalues of the "
            "linearisation in the frame of the load."
        ),
        model=(
            "The same with Stribeck's law, 0.5 at rest, 0.2 at large speeds, over 3 m/s: dampers `mu' N` "
            "along the slip and `mu N / |w|` across it in small motions."
        ),
        tolerance="1e-14 to 1e-12, relative.",
        quantities=circle_by_law,
    ),
    Case(
        title="Vibration across sliding",
        source="Closed form, `(2 / pi) K(m) / sqrt(1 + a^2)`, `m = a^2 / (1 + a^2)`.",
        model=(
            "A slider of 0.5 m/s that vibrates across its motion, with a times its speed, under a heavy "
            "mass: the mean friction along its motion, over that without vibration."
        ),
        tolerance="1e-10, relative: the mass moves a little.",
        quantities=across,
    ),
    Case(
        title="Vibration along sliding",
        source=(
            "Closed form, `(2 / pi) asin(1 / a)` for a >= 1; vibration that lowers friction, as in drives."
        ),
        model=(
            "A slider of 0.5 m/s that vibrates along its motion, with a times its speed, so that slip turns "
            "back twice a period, under a heavy mass: the mean friction over that without vibration."
        ),
        tolerance="1e-9, relative: the mass moves a little.",
        quantities=along,
    ),
]
