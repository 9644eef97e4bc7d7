"""Stops without friction: a mass between a floor and a ceiling, and two oscillators that collide.

Between the stops ``v^2`` changes by ``2 g h`` and the time by the change of speed over g; each impact keeps e
of the speed. After the last ceiling the mass bounces on the floor alone, and a series that begins with the
speed v takes ``2 v / (g (1 - e))``.

Of two equal masses on equal springs that touch at rest, sum and distance are oscillators of their own with
the half period ``pi sqrt(m / k)``. An impact keeps the speed of the sum and e of that of the distance.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp


def between():
    """Compare the mass between floor and ceiling."""
    g, e, height, top, speed = map(decimal, (10.0, 0.8, 1.0, 1.5, 10.0))
    time, rows = mp.mpf(0), []
    while speed**2 > 2 * g * (top - height):
        arrival = mp.sqrt(speed**2 - 2 * g * (top - height))
        time += (speed - arrival) / g
        rows.append((time, e * arrival))
        landing = mp.sqrt((e * arrival) ** 2 + 2 * g * top)
        time += (landing - e * arrival) / g
        speed, height = e * landing, mp.mpf(0)
        rows.append((time, speed))
    rest = time + 2 * speed / (g * (1 - e))
    stops = [
        ss.Contact(normal=0, restitution=0.8, name="floor"),
        ss.Contact(normal=[-1.0], gap=1.5, restitution=0.8, name="ceiling"),
    ]
    scene = ss.Scene([1.0], [[0.0]], force=[-10.0], contacts=stops)
    run = ss.simulate(scene, 7.0, ss.State([1.0], [10.0], "dd"))
    assert (run.events.contact == 1).sum() == len(rows) // 2
    places = ["ceiling", "floor"]
    references = {0: "0.0513167019494862", 1: "0.228318780052882"}
    speeds = {0: "7.5894663844", 1: "7.48758973235"}
    after = np.abs(run.event_states()[1][:, 0])
    found = []
    for k, (expected, left) in enumerate(rows):
        place = f"{places[k % 2]} {k // 2 + 1}"
        found.append(
            Quantity(
                name=place,
                unit="s",
                expected=expected,
                computed=run.events.time[k],
                reference=references.get(k, ""),
            )
        )
        found.append(
            Quantity(
                name=f"speed after {place}",
                unit="m/s",
                expected=left,
                computed=after[k],
                reference=speeds.get(k, ""),
            )
        )
    end = Quantity(
        name="end of the bounces",
        unit="s",
        expected=rest,
        computed=run.events.time[-1],
        reference="6.20723724208631",
    )
    return [*found, end]


def colliding():
    """Compare the two oscillators."""
    mass, stiffness, e, speed = map(decimal, (2.0, 50.0, 0.5, 1.0))
    half = mp.pi * mp.sqrt(mass / stiffness)
    stop = ss.Contact(normal=[-1.0, 1.0], restitution=0.5)
    scene = ss.Scene([2.0, 2.0], np.diag([50.0, 50.0]), contacts=[stop])
    run = ss.simulate(scene, 4.0, ss.State([0.0, 0.0], [-1.0, 0.0], "d"))
    velocities = run.event_states()[1]
    rows = []
    for k in range(3):
        rows.append(
            Quantity(name=f"impact {k + 1}", unit="s", expected=(k + 1) * half, computed=run.events.time[k])
        )
        # The sum turns round every half period, the distance opens with e^(k + 1) of its first speed.
        total, apart = (-1) ** k * speed, speed * e ** (k + 1)
        rows.append(
            Quantity(
                name="velocity of the first mass after it",
                unit="m/s",
                expected=(total - apart) / 2,
                computed=velocities[k, 0],
                absolute=1e-13,
            )
        )
    return rows


CASES = [
    Case(
        title="Floor and ceiling",
        source="A ball between two walls, as in textbooks; times and speeds in closed form.",
        model=(
            "`m x'' = -10 N` with m = 1 kg between stops without friction at x = 0 and x = 1.5 m, "
            "restitution e = 0.8, from x = 1 m upwards with 10 m/s. Between stops `v^2` changes by `2 g h`; "
            "a series of bounces that begins with the speed v takes `2 v / (g (1 - e))`. The two directions "
            "depend on each other."
        ),
        tolerance="Closed form: 1e-12.",
        quantities=between,
    ),
    Case(
        title="Two oscillators that collide",
        source="Two pendulums that strike each other, linearised; in closed form.",
        model=(
            "Two masses of 2 kg on springs of 50 N/m each touch at rest, restitution e = 0.5; the first "
            "leaves with -1 m/s. Sum and distance are oscillators of their own, so that impacts follow at "
            "half periods `pi sqrt(m / k)`; each keeps e of the speed of the distance and leaves that of the "
            "sum. One stop along (-1, 1)."
        ),
        tolerance="Closed form: 1e-12; 1e-13 m/s where the velocity is a difference of larger ones.",
        quantities=colliding,
    ),
]
