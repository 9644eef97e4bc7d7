"""Two equal oscillators that mirror each other collide as one does with a wall.

Both have ``m x'' + k x = 0`` and a clearance 2 c between them, so the gap is ``2 c + x2 - x1``. From x2 = -x1
it is 2 (c + x2), and Newton's law ``g'+ = -e g'-`` with equal and opposite impulses is ``x2'+ = -e x2'-``:
the second mass moves as if it struck a wall at -c. Released at rest from x2 = a the wall is met at ``w t =
acos(-c / a)`` with ``w sqrt(a^2 - c^2)``. A flight with initial speed v has amplitude ``A = hypot(c, v / w)``
and lasts ``2 (pi - acos(c / A)) / w``; it ends with the same speed.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

MASS, STIFFNESS, CLEARANCE, RESTITUTION, RELEASE = 1.0, 100.0, 0.01, 0.8, 0.05
DURATION, COUNT = 3.0, 6


def impacts():
    """Return the times of the first impacts of one oscillator with the wall."""
    m, k, c, e, a = map(decimal, (MASS, STIFFNESS, CLEARANCE, RESTITUTION, RELEASE))
    omega = mp.sqrt(k / m)
    times, speed = [mp.acos(-c / a) / omega], omega * mp.sqrt(a**2 - c**2)
    for _ in range(COUNT - 1):
        speed *= e
        times.append(times[-1] + 2 * (mp.pi - mp.acos(c / mp.hypot(c, speed / omega))) / omega)
    return times


def run(masses, normal, clearance):
    """Simulate masses in a row, without friction; the dof y is tangential and moves nowhere."""
    n = masses + 1
    contact = ss.Contact(
        tangential=n - 1, normal=normal, friction=0.0, restitution=RESTITUTION, gap=clearance
    )
    scene = ss.Scene([MASS] * n, STIFFNESS * np.eye(n), contacts=[contact])
    start = np.zeros(n)
    start[:masses] = RELEASE * np.array([-1.0, 1.0])[-masses:]
    return ss.simulate(scene, DURATION, ss.State(start, np.zeros(n), "d"))


def quantities():
    """Compare the pair with one oscillator at a wall, and both with the closed form."""
    pair, wall = run(2, [-1.0, 1.0, 0.0], 2.0 * CLEARANCE), run(1, [1.0, 0.0], CLEARANCE)
    assert pair.events.kind.tolist() == wall.events.kind.tolist()
    assert pair.events.kind[:COUNT].tolist() == ["impact"] * COUNT
    at = np.linspace(0.0, DURATION, 1000)
    # Beside an impact the rounding of its time decides which velocity is sampled; positions are continuous.
    both, one = pair.sample(at).position.values, wall.sample(at).position.values
    rows = [
        Quantity(name=f"impact {n + 1}", unit="s", expected=time, computed=pair.events.time[n])
        for n, time in enumerate(impacts())
    ]
    apart = max(np.abs(both[:, 1] - one[:, 0]).max(), np.abs(both[:, 0] + one[:, 0]).max())
    delay = np.abs(pair.events.time - wall.events.time).max()
    return [
        *rows,
        Quantity(name="pair less wall, x", unit="m", expected=0, computed=apart, absolute=1e-14),
        Quantity(name="pair less wall, impacts", unit="s", expected=0, computed=delay, absolute=1e-14),
    ]


CASES = [
    Case(
        title="Two equal oscillators that collide",
        source="Symmetry: the pair moves as one oscillator against a wall; impacts in closed form.",
        model=(
            "Two oscillators `m x'' + k x = 0`, m = 1 kg, k = 100 N/m, collide at the gap `2 c + x2 - x1`, "
            "c = 0.01 m, with restitution e = 0.8, released at rest from x2 = -x1 = 0.05 m. One of them "
            "against a wall at x2 = -c strikes at `acos(-c / a) / w`; a flight with initial speed v has "
            "amplitude `A = sqrt(c^2 + v^2 / w^2)` and lasts `2 (pi - acos(c / A)) / w`. Up to 3 s, at "
            "1000 instants."
        ),
        tolerance=(
            "Closed form: 1e-12. Between pair and wall 1e-14 m and s: some ulp of times up to 3 s and of "
            "displacements at 0.5 m/s."
        ),
        quantities=quantities,
    )
]
