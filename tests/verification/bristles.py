"""Contacts with a state: LuGre's usual numbers, and Dahl's loop.

Under Dahl's law ``dF/dx = stiffness (1 - F sgn(x') / kinetic)``, so that F is a function of the place between
turns. A loop between ``-X`` and ``X`` turns at ``kinetic tanh(stiffness X / kinetic)`` and encloses
``4 kinetic (X - kinetic / stiffness tanh(stiffness X / kinetic))``.
"""

import numpy as np
from scipy.optimize import brentq

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

#: Times at which the mass turns, s, and its places there, m.
TURNS = ["10.2660909412841", "10.2764203978014", "10.2926632434272", "10.3009597155445"]
PLACES = ["0.63628438968428", "0.636282539413642", "0.636283162607228", "0.636283130162437"]
SPEED = 0.1


def dragged():
    """Compare the stick-slip run."""
    scene = ss.models.lugre_slider(pull_speed=SPEED)
    run = ss.simulate(scene, 36.0, ss.State([0.0], [-SPEED], "-"))
    times, places = run.events.time[:4], run.event_states()[0][:4, 0]
    rows = []
    for k, (time, place) in enumerate(zip(TURNS, PLACES, strict=True)):
        rows.append(Quantity(name=f"turn {k + 1}", unit="s", expected=mp.mpf(time), computed=times[k]))
        # The spring is pulled, and the scene moves with its end.
        there = float(places[k] + SPEED * times[k])
        rows.append(Quantity(name="place there", unit="m", expected=mp.mpf(place), computed=there))
    deflection = float(run.state(float(times[0])).internal[0])
    rows.append(
        Quantity(
            name="deflection at turn 1",
            unit="m",
            expected=mp.mpf("1.06108504680792e-05"),
            computed=deflection,
        )
    )
    period = run.limit_cycle().period
    rows.append(
        Quantity(name="period of the cycle", unit="s", expected=mp.mpf("6.362719821066"), computed=period)
    )
    return rows


def swung(force):
    """Return the cycle of a mass on a spring under Dahl's law, driven by a harmonic force."""
    scene = ss.models.dahl_oscillator(load=force)
    return ss.simulate(scene, 1.0, ss.State([0.0], [0.0], "-")).limit_cycle(further=10.0)


def amplitude(cycle):
    """Return half of the way between its turns."""
    return 0.5 * float(cycle.maximum[0] - cycle.minimum[0])


def loop():
    """Compare the loop of an amplitude."""
    wanted = decimal(1e-5)
    force = brentq(lambda force: amplitude(swung(force)) - 1e-5, 0.5, 1.5, xtol=1e-14)
    cycle = swung(force)
    turns = cycle.run.sample(cycle.run.events.time).friction_force.to_numpy()
    kinetic, stiffness = decimal(1.0), decimal(1e5)
    highest = kinetic * mp.tanh(stiffness * wanted / kinetic)
    return [
        Quantity(
            name="friction force at the turns",
            unit="N",
            expected=highest,
            computed=float(np.abs(turns).max()),
            reference="0.761594155955765",
            relative=1e-10,
        ),
        Quantity(
            name="loss per cycle",
            unit="J",
            expected=4 * kinetic * (wanted - highest / stiffness),
            computed=-float(cycle.balance().contact),
            reference="9.5362337617694e-6",
            relative=1e-9,
        ),
    ]


CASES = [
    Case(
        title="Bristles of LuGre",
        source=(
            "Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Transactions on Automatic Control 40 (1995) "
            "419, Table I; the digits by three integrators of others, which agree to nine digits and better."
        ),
        model=(
            "`z' = s - sigma_0 |s| z / g(s)`, `g = 1 + 0.5 exp(-(s / 0.001)^2)`, "
            "`F = sigma_0 z + sigma_1 z' + 0.4 s` with `sigma_0 = 1e5` and `sigma_1 = sqrt(1e5)`: a mass "
            "of 1 kg, whose spring of 2 N/m is pulled at 0.1 m/s from rest. Its velocity changes sign four "
            "times a period."
        ),
        tolerance="As many digits as are known: 1e-12.",
        quantities=dragged,
    ),
    Case(
        title="Loop of Dahl",
        source="Dahl, AIAA Journal 14 (1976) 1675; in closed form.",
        model=(
            "`F' = 1e5 s (1 - F sgn(s))`: a mass of 1 kg on a spring of 1000 N/m and a damper of 2 N s/m "
            "swings with an amplitude of 1e-5 m under a harmonic force of 20 Hz of the size for that."
        ),
        tolerance="1e-10, as the amplitude is met to 1e-15 m; the loss is a difference: 1e-9.",
        quantities=loop,
    ),
]
