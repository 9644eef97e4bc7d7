"""One mass on a slider, in closed form the simplest scene."""

import numpy as np

import stickslip as ss

MASS = 1.5


def oscillator(
    *,
    friction=0.0,
    static=None,
    speed=0.0,
    restitution=0.0,
    stiffness=(3e4, 5e4),
    load=(0.0, -20.0),
    damping=None,
):
    """One mass: x1 along a slider, x2 normal to it."""
    contact = ss.Contact(
        tangential=0,
        normal=1,
        friction=friction,
        static_friction=static,
        slider_speed=speed,
        restitution=restitution,
    )
    return ss.Scene([MASS, MASS], np.diag(stiffness), damping=damping, force=load, contacts=[contact])
