"""A pad of two halves on an elastic disc: mass couples its contacts."""

import numpy as np

import stickslip as ss


def pad_on_disc(friction=0.6, restitution=0.0):
    """Two halves (x, y each) pressed on one disc (w) that yields: an impact of one half lifts the other.

    Every half hangs on an inclined spring, a link ties them to each other. An impact of one pushes the disc
    away from the other, whose gap opens and closes again: the two strike in turn, ever faster, up to a limit.
    """
    dofs = ("x1", "y1", "x2", "y2", "w")
    stiffness = np.zeros((5, 5))
    for half, inclination, inclined, vertical, horizontal in (
        (0, 0.436, 4.85e5, 8.5e4, 1.29e5),
        (2, -1.01, 2.07e5, 5.7e4, 1.27e5),
    ):
        across = np.zeros(5)
        across[half], across[half + 1] = np.cos(inclination), -np.sin(inclination)
        stiffness += inclined * np.outer(across, across)
        stiffness[half, half] += horizontal
        stiffness[half + 1, half + 1] += vertical
    for a, b, link in ((0, 2, 1.26e5), (1, 3, 9.9e5)):
        tie = np.zeros(5)
        tie[a], tie[b] = 1.0, -1.0
        stiffness += link * np.outer(tie, tie)
    stiffness[4, 4] = 3.15e6
    contacts = [
        ss.Contact(
            name=name,
            tangential=f"x{i}",
            normal=[float(dof == f"y{i}") - float(dof == "w") for dof in dofs],
            friction=friction,
            slider_speed=0.05,
            restitution=restitution,
        )
        for i, name in ((1, "lead"), (2, "trail"))
    ]
    return ss.Scene(
        mass=[0.54, 0.54, 0.264, 0.264, 1.34],
        stiffness=stiffness,
        damping=ss.Rayleigh(stiffness=2e-5),
        force=[0.0, -55.5, 0.0, -135.0, 0.0],
        contacts=contacts,
        dofs=dofs,
        impact_friction=True,
    )
