"""A mass on a spring runs into a stop of finite stiffness.

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
    )
]
