"""A mass falls on a rigid stop and bounces until it rests.

Above the stop ``m y'' + k y = -m g``. With ``d = m g / k`` and ``w = sqrt(k / m)`` the motion is a harmonic
one about -d; released at rest from y it arrives after ``acos(d / (d + y)) / w`` with ``w sqrt((d + y)^2 -
d^2)``. A flight that begins with speed v lasts ``2 atan(v / (w d)) / w``, as its phase runs from ``-atan(v /
(w d))`` to the opposite, and ends with the same speed. Newton's law keeps e of it. For k = 0: ``sqrt(2 y /
g)``, ``sqrt(2 g y)`` and ``2 v / g``. The flights sum to a finite time.
"""

import stickslip as ss
from verification.block import block
from verification.case import Case, Quantity, decimal, mp


def impacts(mass, stiffness, gravity, restitution, height):
    """Return the times of the impacts and, last, the limit of all of them to 40 digits."""
    mass, stiffness, gravity, restitution, height = map(
        decimal, (mass, stiffness, gravity, restitution, height)
    )
    if stiffness:
        omega, depth = mp.sqrt(stiffness / mass), mass * gravity / stiffness
        time = mp.acos(depth / (depth + height)) / omega
        speed = omega * mp.sqrt((depth + height) ** 2 - depth**2)
    else:
        time, speed = mp.sqrt(2 * height / gravity), mp.sqrt(2 * gravity * height)
    times = [time]
    while speed > mp.eps * times[0]:
        speed *= restitution
        flight = 2 * mp.atan(speed / (omega * depth)) / omega if stiffness else 2 * speed / gravity
        times.append(times[-1] + flight)
    return times


def compared(mass, stiffness, gravity, restitution, height, references, shown):
    """Compare impacts and their limit; the reference of an impact that has none is ""."""
    times = impacts(mass, stiffness, gravity, restitution, height)
    scene = block(mass=mass, stiffness=(1.0, stiffness), load=mass * gravity, restitution=restitution)
    run = ss.simulate(scene, 1.1 * float(times[-1]), ss.State([0.0, height], [0.0, 0.0], "d"))
    (limit,) = run.accumulations
    assert set(run.events.kind[: limit.event]) == {"impact"}
    assert run.state(run.duration).combination != "d"
    rows = [
        Quantity(
            name=f"impact {k + 1}",
            unit="s",
            expected=times[k],
            computed=run.events.time[k],
            reference=references.get(k, ""),
        )
        for k in shown
    ]
    end = Quantity(
        name="end of the bounces",
        unit="s",
        expected=times[-1],
        computed=run.events.time[limit.event],
        reference=references["end"],
    )
    return [*rows, end]


def siconos():
    """Compare with the oscillator on a stop."""
    references = {0: "0.00496698394388863", 1: "0.0149008829007754", "end": "0.870279607715797"}
    return compared(1e-3, 100.0, 9.81, 0.9, 1.0, references, (0, 1, 2, 9, 99))


def ball():
    """Compare with the bouncing ball."""
    references = {0: "0.451523640985731", 1: "1.26426619476005", "end": "8.57894917872889"}
    return compared(1.0, 0.0, 9.81, 0.9, 1.0, references, (0, 1, 2, 9, 99))


CASES = [
    Case(
        title="Oscillator on a stop",
        source=(
            "Siconos tutorials, `examples/mechanics/BouncingBallEventDriven/LinearOscillatorED`; its axis "
            "x in closed form."
        ),
        model=(
            "`m y'' + k y = -m g` above a stop at y = 0 with m = 1e-3 kg, k = 100 N/m, g = 9.81 m/s^2 and "
            "restitution e = 0.9, released at rest from y = 1 m. With `d = m g / k` and `w = sqrt(k / m)` "
            "the first impact is at `acos(d / (d + y)) / w`; a flight with initial speed v lasts `2 atan(v "
            "/ (w d)) / w`; each impact keeps e of the speed."
        ),
        tolerance="Closed form, the limit as the sum of all flights: 1e-12.",
        quantities=siconos,
    ),
    Case(
        title="Bouncing ball",
        source=(
            "Siconos tutorials, `examples/mechanics/BouncingBall`, as a point mass without a radius; times "
            "in closed form."
        ),
        model=(
            "`y'' = -g` above a floor at y = 0 with g = 9.81 m/s^2 and restitution e = 0.9, dropped from 1 "
            "m. The fall takes `sqrt(2 y / g)`, flight n `2 e^n sqrt(2 y / g)`; all together `sqrt(2 y / "
            "g) (1 + e) / (1 - e)`."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=ball,
    ),
]
