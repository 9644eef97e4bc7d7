"""Elastic slip in a plane: a node on a spring that a point drags along a circle."""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

#: Radius, m, rate of the point, 1/s, spring, N/m, and friction limit, N; the spring gives d = 6e-4 m.
RADIUS, RATE, STIFFNESS, LIMIT = 1e-3, 100.0, 1e6, 600.0
#: Normal force, N, with mu = 0.5.
PRESSED = 1200.0
#: A mass, kg, that hardly feels the spring, and the mass of a body under a load that turns.
HEAVY, BODY = 1e12, 10.0


def scene(mass, stiffness, loads=()):
    """Return a body on springs that a node with friction holds."""
    node = ss.Contact(
        tangential=("x", "y"),
        normal_force=PRESSED,
        friction=LIMIT / PRESSED,
        tangential_stiffness=STIFFNESS,
        name="node",
    )
    return ss.Scene([mass] * 2, np.eye(2) * stiffness, dofs=("x", "y"), contacts=[node], loads=loads)


def angle(run, time):
    """Return the angle from the spring to the velocity of the point, rad."""
    state = run.state(time)
    x, y = -state.friction_force
    u, v = state.velocity
    return float(np.arctan2(x * v - y * u, x * u + y * v))


def dragged():
    """Compare the first slip, and how the spring turns then."""
    run = ss.simulate(scene(HEAVY, HEAVY * RATE**2), 0.1, ss.State([RADIUS, 0.0], [0.0, RADIUS * RATE], "ss"))
    r, w, d = decimal(RADIUS), decimal(RATE), decimal(LIMIT) / decimal(STIFFNESS)
    first = 2 / w * mp.asin(d / (2 * r))

    def psi(time):
        # With t = tan(psi / 2) the equation is that of Riccati, t' = w (1 + t^2) / 2 - (w r / d) t.
        p, q = r / d, mp.sqrt((r / d) ** 2 - 1)
        begun = mp.tan(w * first / 4)
        ratio = (begun - p + q) / (begun - p - q) * mp.exp(-w * q * (time - first))
        return 2 * mp.atan((p - q - ratio * (p + q)) / (1 - ratio))

    found = [
        Quantity(
            name="time of the first slip",
            unit="s",
            expected=first,
            computed=float(run.events.time[0]),
            reference="0.0060938530803079502",
            relative=1e-9,
        )
    ]
    for time, digits in ((0.015, "0.547782739878904"), (0.02, "0.595174376402465"), (0.1, "")):
        found.append(
            Quantity(
                name=f"angle of the spring at {time:g} s",
                unit="rad",
                expected=psi(decimal(time)),
                computed=angle(run, time),
                reference=digits,
                relative=1e-8,
            )
        )
    return found


def turning():
    """Compare a body that a load drives along the circle."""
    d = LIMIT / STIFFNESS
    along, across = LIMIT * d / RADIUS, LIMIT * np.sqrt(1.0 - (d / RADIUS) ** 2)
    stiffness = 5e5
    radial = (stiffness - BODY * RATE**2) * RADIUS + along
    size, phase = np.hypot(radial, across), np.arctan2(across, radial)
    loads = [
        ss.Harmonic({"x": size}, RATE / (2 * np.pi), phase=phase),
        ss.Harmonic({"y": size}, RATE / (2 * np.pi), phase=phase - np.pi / 2),
    ]
    start = ss.State([RADIUS, 0.0], [0.0, RADIUS * RATE], "oo", friction_force=[-along, -across])
    turn = 2 * np.pi / RATE
    run = ss.simulate(scene(BODY, stiffness, loads), 10 * turn, start)
    last = run.state(10 * turn)
    outward = last.position / np.hypot(*last.position)
    x, y = last.friction_force
    lost = -float(run.balance(9 * turn, 10 * turn).contacts.work.to_numpy().sum())
    r, limit = decimal(RADIUS), decimal(LIMIT)
    extent = limit / decimal(STIFFNESS)
    reach = mp.sqrt(r**2 - extent**2)
    values = [
        ("radius of the body", "m", r, np.hypot(*last.position), ""),
        (
            "radius of the node",
            "m",
            reach,
            np.hypot(*(last.position + last.friction_force / STIFFNESS)),
            "8e-4",
        ),
        ("loss of a turn", "J", 2 * mp.pi * limit * reach, lost, "3.0159289474462015"),
        ("force towards the centre", "N", limit * extent / r, -(outward @ [x, y]), "360"),
        ("force against the motion", "N", limit * reach / r, -(outward[0] * y - outward[1] * x), "480"),
    ]
    return [
        Quantity(name=name, unit=unit, expected=expected, computed=float(computed), reference=digits)
        for name, unit, expected, computed, digits in values
    ]


CASES = [
    Case(
        title="Elastic slip on a circle",
        source="Closed form: `t1 = (2 / w) asin(d / (2 R))`, then `psi' = w - (R w / d) sin(psi)`.",
        model=(
            "A node without mass with friction of 600 N in the plane, on a spring of 1e6 N/m, at a heavy "
            "mass that moves along a circle of 1 mm with 100 1/s. The node stays for a time t1, and slips "
            "then; psi is the angle from the spring to the velocity, and d = 0.6 mm the stretch of the "
            "spring as it slips."
        ),
        tolerance=(
            "1e-9 and 1e-8, relative: the mass moves a little, and its velocity is large beside the spring."
        ),
        quantities=dragged,
    ),
    Case(
        title="Steady elastic slip on a circle",
        source=(
            "Closed form, `sin(psi) = d / R`: the node moves along a circle of `sqrt(R^2 - d^2)`. Two "
            "elements along x and y, the usual shortcut, would lose 1.92 J a turn."
        ),
        model=(
            "The same node at a mass of 10 kg on springs of 5e5 N/m, under a load that turns, after ten "
            "turns."
        ),
        tolerance="1e-12, relative.",
        quantities=turning,
    ),
]
