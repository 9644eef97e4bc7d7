"""A block is thrown up an inclined plane, stops, and slides back.

Up: ``s'' = -g (sin a + mu cos a)``, so it stops after ``v / |s''|`` at ``v^2 / (2 |s''|)``. It slides back if
``tan a > mu_s``, with ``g (sin a - mu cos a)``. Displacements are horizontal and vertical, so that both
directions of the contact are vectors, and nothing but the floor holds the block: every eigenvalue is a double
zero.
"""

import numpy as np

import stickslip as ss
from verification.case import Case, Quantity, decimal, mp

MASS, GRAVITY, ANGLE, FRICTION, SPEED = 2.0, 9.81, 0.5, 0.3, 4.0


def quantities():
    """Compare the turn, and place and speed when it passes the start again."""
    m, g, angle, mu, v = map(decimal, (MASS, GRAVITY, ANGLE, FRICTION, SPEED))
    slow, fast = g * (mp.sin(angle) + mu * mp.cos(angle)), g * (mp.sin(angle) - mu * mp.cos(angle))
    turn, height = v / slow, v**2 / (2 * slow)
    back = turn + mp.sqrt(2 * height / fast)
    plane = ss.Contact(
        tangential=[np.cos(ANGLE), np.sin(ANGLE)],
        normal=[-np.sin(ANGLE), np.cos(ANGLE)],
        friction=FRICTION,
    )
    weight = [0.0, -MASS * GRAVITY]
    scene = ss.Scene([MASS, MASS], np.zeros((2, 2)), force=weight, contacts=[plane], dofs=["x", "y"])
    thrown = SPEED * np.array(plane.tangential)
    run = ss.simulate(scene, float(back), ss.State([0.0, 0.0], thrown, "-"))
    assert run.events.combination.tolist() == ["+"]
    along = np.array(plane.tangential)
    end = run.sample(run.duration)
    return [
        Quantity(name="turn", unit="s", expected=turn, computed=run.events.time[0]),
        Quantity(
            name="distance at the turn", unit="m", expected=height, computed=along @ run.event_states()[0][0]
        ),
        Quantity(
            name="distance when it is back",
            unit="m",
            expected=0,
            computed=along @ end.position.values[0],
            absolute=1e-12 * float(height),
        ),
        Quantity(
            name="speed when it is back",
            unit="m/s",
            expected=-mp.sqrt(2 * fast * height),
            computed=along @ end.velocity.values[0],
        ),
        Quantity(
            name="normal force", unit="N", expected=m * g * mp.cos(angle), computed=end.normal_force.item()
        ),
    ]


CASES = [
    Case(
        title="Block on an inclined plane",
        source="Elementary mechanics; closed form.",
        model=(
            "A block of 2 kg is thrown with v = 4 m/s up a plane inclined by a = 0.5 rad, mu = 0.3, g = "
            "9.81 m/s^2: `s'' = -g (sin a + mu cos a)` up, `-g (sin a - mu cos a)` back, as tan a > mu."
        ),
        tolerance="Closed form: 1e-12, the distance when it is back relative to that at the turn.",
        quantities=quantities,
    )
]
