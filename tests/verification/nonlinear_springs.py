"""Nonlinear springs: Duffing, free and forced, a pendulum, a one-sided spring, a manufactured motion.

The free oscillator ``x'' + x + g x^3 = 0`` from rest at A has the period ``4 K(m) / sqrt(1 + g A^2)`` with
``m = g A^2 / (2 (1 + g A^2))`` and K the complete elliptic integral, the pendulum ``x'' + w^2 sin x = 0``
the period ``4 K(sin^2(A / 2)) / w``. The folds of the forced one are double
multipliers 1 of its return map; those of two masses with a one-sided spring are from piecewise matrix
exponentials, both with residuals below 1e-12.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

HARDENING, AMPLITUDE = (1.0, 0.1, 0.5), (1.0, 2.0, 1.0)
#: Of ``x'' + 0.05 x' + x + 0.1 x^3 = 0.18 cos W t``.
FOLDS = ("1.269601955546", "1.115700251771")
#: The program and the book that has it.
KRACK = "M. Krack, J. Gross, *Harmonic Balance for Nonlinear Vibration Problems*, 2019, NLvib, "
#: Of the first of two masses, by the rate of the force.
RMS = {"0.7": "0.799742770942", "0.72": "0.862020295078", "0.73": "0.903013150486"}


def free():
    """Compare the place after a period with the start."""
    found = []
    for g, a in zip(HARDENING, AMPLITUDE, strict=True):
        hard = decimal(g) * decimal(a) ** 2
        period = 4 * mp.ellipk(hard / (2 * (1 + hard))) / mp.sqrt(1 + hard)
        spring = ss.Spring(0, ss.spring.Polynomial(1.0, 0.0, g))
        run = ss.simulate(
            ss.Scene([1.0], [[0.0]], elements=[spring]), float(period), ss.State([a], [0.0], "")
        )
        found.append(
            Quantity(
                name=f"place after a period, g = {g:g}",
                unit="m",
                expected=decimal(a),
                computed=run.state(float(period)).position[0],
            )
        )
    return found


def pendulum():
    """Compare the angle after a period with the start."""
    found, rate = [], 2.0
    spring = ss.Spring(0, ss.spring.Law(lambda u, weight=rate**2: weight * np.sin(u)))
    scene = ss.Scene([1.0], [[0.0]], elements=[spring])
    for angle in (0.5, 2.0, 3.1):
        period = 4 * mp.ellipk(mp.sin(decimal(angle) / 2) ** 2) / decimal(rate)
        run = ss.simulate(scene, float(period), ss.State([angle], [0.0], ""))
        swing = run.state(0.25 * float(period))
        found += [
            Quantity(
                name=f"angle after a period from {angle:g}",
                unit="rad",
                expected=decimal(angle),
                computed=float(run.state(float(period)).position[0]),
            ),
            Quantity(
                name=f"velocity after a fourth of it from {angle:g}",
                unit="rad/s",
                expected=-2 * decimal(rate) * mp.sin(decimal(angle) / 2),
                computed=float(swing.velocity[0]),
            ),
        ]
    return found


def forced():
    """Compare the folds of the resonance with those of the return map."""
    rate = 2.0 * np.pi
    load = ss.Harmonic({"x1": 0.18}, 1.0 / rate, name="shaker")
    spring = ss.Spring(0, ss.spring.Polynomial(0.0, 0.0, 0.1))
    scene = ss.Scene([1.0], [[1.0]], [[0.05]], loads=[load], elements=[spring])
    cycle = ss.simulate(scene, 400.0, ss.State([0.0], [0.0], "")).limit_cycle(further=800.0)
    branch = ss.continuation(cycle, {"shaker_frequency": (1.0 / rate, 1.4 / rate)})
    return [
        Quantity(
            name=f"fold {k + 1}, W",
            unit="rad/s",
            expected=mp.mpf(reference),
            computed=rate * point.value,
            reference=reference,
        )
        for k, (reference, point) in enumerate(zip(FOLDS, branch.folds, strict=True))
    ]


def one_sided():
    """Compare mean squares of the cycle that presses the spring."""
    stiffness = np.array([[1.0, -1.0], [-1.0, 2.0]])
    found = []
    for rate, reference in RMS.items():
        period = 2.0 * np.pi / float(rate)
        load = ss.Harmonic({"x2": 0.1}, 1.0 / period)
        stop = ss.Spring("x1", ss.spring.Gap(100.0, 1.0))
        scene = ss.Scene([1.0, 1.0], stiffness, 0.03 * stiffness, loads=[load], elements=[stop])
        start = ss.State([1.0, 0.5], [0.3, 0.0], "")
        cycle = ss.simulate(scene, 150.0 * period, start).limit_cycle(further=100.0 * period)
        times = np.linspace(0.0, cycle.period, 20_001)[:-1]
        place = cycle.run.sample(times).position.to_numpy()[:, 0]
        found.append(
            Quantity(
                name=f"root mean square of x1, W = {rate} rad/s",
                unit="m",
                expected=mp.mpf(reference),
                computed=float(np.sqrt(np.mean(place**2))),
                reference=reference,
                relative=2e-12,
            )
        )
    return found


def manufactured():
    """Compare a motion that was chosen before its load, over both half swings."""
    mass, stiffness, length, amplitude, rate = 450.0, 1e5, 0.1, 0.01, np.pi / 4.0
    frequency, half = rate / (2.0 * np.pi), np.pi / rate
    # The load of x = A sin(w t) > 0; sin^2 = (1 - cos 2 w t) / 2.
    sine = amplitude * (stiffness - mass * rate**2)
    square = stiffness * amplitude**2 / length
    found, state = [], ss.State([0.0], [amplitude * rate], "")
    for number, sign in enumerate((1.0, -1.0)):
        scene = ss.Scene(
            [mass],
            [[0.0]],
            force=[-sign * square / 2.0],
            loads=[
                ss.Harmonic({0: sine}, frequency, number * np.pi - np.pi / 2.0),
                ss.Harmonic({0: sign * square / 2.0}, 2.0 * frequency),
            ],
            elements=[ss.Spring(0, ss.spring.Polynomial(stiffness, -sign * stiffness / length))],
        )
        run = ss.simulate(scene, half, state)
        found.append(
            Quantity(
                name=f"place after {2 + 4 * number} s",
                unit="m",
                expected=sign * decimal(amplitude),
                computed=float(run.state(0.5 * half).position[0]),
            )
        )
        end = run.state(half)
        found.append(
            Quantity(
                name=f"velocity after {4 + 4 * number} s",
                unit="m/s",
                expected=-sign * decimal(amplitude) * mp.pi / 4,
                computed=float(end.velocity[0]),
            )
        )
        state = ss.State(end.position, end.velocity, "")
    return found


CASES = [
    Case(
        title="Free oscillator of Duffing",
        source="Closed form by elliptic integrals.",
        model="`x'' + x + g x^3 = 0` from rest at A = 1, 2 and 1 m with g = 1, 0.1 and 0.5 1/m^2.",
        tolerance="Closed form: 1e-12.",
        quantities=free,
    ),
    Case(
        title="Pendulum",
        source="Closed form by elliptic integrals.",
        model=(
            "`x'' + w^2 sin x = 0`, a user's own spring, from rest at A = 0.5, 2 and 3.1 rad with w = 2 1/s. "
            "The period is `4 K(sin^2(A / 2)) / w`, and the velocity at the bottom `2 w sin(A / 2)`."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=pendulum,
    ),
    Case(
        title="Forced oscillator of Duffing",
        source=(KRACK + "example 01."),
        model=(
            "`x'' + 0.05 x' + x + 0.1 x^3 = 0.18 cos W t`. Two folds of the resonance, as double multipliers "
            "1 of the return map. By harmonic balance the peak is printed at W = 1.2687 and 1.2688."
        ),
        tolerance="All 13 digits that are known.",
        quantities=forced,
    ),
    Case(
        title="Two masses with a one-sided spring",
        source=(KRACK + "example 03."),
        model=(
            "Masses of 1 kg, springs of 1 N/m between both and from the second to the ground, dampers of "
            "0.03 N s/m beside them, 0.1 N cos W t on the second, and a spring of 100 N/m that the first one "
            "presses beyond 1 m."
        ),
        tolerance="The 12 digits that are known, from piecewise matrix exponentials: 2e-12.",
        quantities=one_sided,
    ),
    Case(
        title="Manufactured motion against a softening spring",
        source="Code_Aster, case SDND103, whose load makes the motion a sine.",
        model=(
            "m = 450 kg, spring force `k x (1 - |x| / x0)` with k = 1e5 N/m and x0 = 0.1 m, under the load "
            "that gives `x = A sin(w t)`, A = 0.01 m, w = pi / 4 1/s. Each half swing is a scene with a "
            "polynomial spring and harmonic loads, as x does not change its sign there."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=manufactured,
    ),
]
