"""Two modes that friction couples: the minimal model of mode coupling, and waves of a rotating disc."""

from __future__ import annotations

import numpy as np

from stickslip.scene.checks import Pair, finite, pair, positive
from stickslip.scene.contact import Contact
from stickslip.scene.elements import Spring
from stickslip.scene.laws.spring import Polynomial
from stickslip.scene.models.naming import named
from stickslip.scene.scene import Scene

#: Stiffness, N/m, and angle, degrees, of the springs that hold the mass; and stiffness of that to the belt.
HOLDING = ((2 / 3 * (2 - np.sqrt(3)), 150.0), (2 / 3 * (2 + np.sqrt(3)), 30.0))
CONTACT = 4.0 / 3.0


@named
def hoffmann(
    *,
    friction: float = 0.5,
    damping: Pair = (0.0, 0.0),
    cubic: float = 0.0,
    preload: float = 1.0,
    slider_speed: float = -1.0,
) -> Scene:
    """Return the minimal model of mode coupling: a mass of 1 kg that presses on a belt through a spring.

    About steady sliding, with the force ``phi(y) = 4/3 y + cubic y^3`` of the contact spring,

        ``x'' + c_x x' + 2 x + y - friction phi(y) = 0``
        ``y'' + c_y y' + x + 2/3 y + phi(y) = 0``

    N. Hoffmann, M. Fischer, R. Allgaier, L. Gaul, "A minimal model for studying properties of the
    mode-coupling type instability in friction induced oscillations", Mechanics Research Communications 29
    (2002) 197, Eq. 1; with damping N. Hoffmann, L. Gaul, "Effects of damping on mode-coupling instability in
    friction induced oscillations", ZAMM 83 (2003) 524. Without damping the modes merge at friction 3/4. The
    dof n is the end of the contact spring, which touches the belt. A constant force on x holds steady sliding
    at zero; on a belt that runs along -x its combination is ``-``.

    Parameters
    ----------
    friction
        Coefficient of friction on the belt.
    damping
        c_x and c_y, N s/m: a number for both, or a pair.
    cubic
        Cubic stiffness of the contact spring, N/m^3.
    preload
        Normal force of steady sliding, N; the contact opens where phi(y) exceeds it.
    slider_speed
        Speed of the belt along x, m/s; the mass sticks where its velocity reaches it.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    stiffness = np.zeros((3, 3))
    for spring, angle in HOLDING:
        along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
        stiffness += spring * np.outer(along, along)
    stretch = np.array([0.0, 1.0, -1.0])
    stiffness += CONTACT * np.outer(stretch, stretch)
    c, pressed = pair("damping", damping), positive("preload", preload)
    hard = finite("cubic", cubic)
    held = finite("friction", friction, least=0.0) * pressed
    belt = Contact(tangential="x", normal="n", friction=friction, slider_speed=slider_speed)
    spring = Spring({"y": 1.0, "n": -1.0}, Polynomial(0.0, 0.0, hard), name="contact_spring")
    return Scene(
        [1.0, 1.0, 1.0],
        stiffness,
        damping=np.diag([*c, 0.0]) if any(c) else None,
        force=[held, 0.0, -pressed],
        contacts=[belt],
        dofs=["x", "y", "n"],
        elements=[spring] if hard else [],
    )


@named
def rotating_disc(
    *,
    frequency: float = 1000.0,
    diameters: int = 4,
    speed: float = 5.0,
    damping: float = 10.0,
    pad_stiffness: float = 0.0,
    follower_stiffness: float = 0.0,
) -> Scene:
    """Return two modes of a rotating disc between pads.

    ``x'' + (D + 2 n W J) x' + (w^2 - n^2 W^2 + K + p J) x = 0``: the dofs are the coordinates of the modes
    cos(n theta) and sin(n theta) in the space in which the pads rest, for unit modal mass; ``J = [[0, -1],
    [1, 0]]``, ``K = diag(pad_stiffness, 0)``. O. N. Kirillov, "How to play a disc brake", arXiv:0708.0967
    (2007), for the doublet of any body of revolution; the numbers are chosen here. Without pad stiffness the
    wave of the angular frequency ``w + n W`` grows where ``p > D (w + n W)``, and that of ``w - n W`` where
    ``-p > D (w - n W)``.

    Parameters
    ----------
    frequency
        w / (2 pi), natural frequency of the disc at rest, Hz.
    diameters
        n, number of nodal diameters.
    speed
        W, 1/s; the rotation of the disc.
    damping
        D, 1/s, of both modes.
    pad_stiffness
        Stiffness of the pads over the modal mass, 1/s^2: against the first mode.
    follower_stiffness
        p, 1/s^2: friction of the pads, a force along one mode by the displacement of the other.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    turning = finite("diameters", diameters, least=0.0) * finite("speed", speed)
    rate = 2.0 * np.pi * positive("frequency", frequency)
    skew = np.array([[0.0, -1.0], [1.0, 0.0]])
    held = np.diag([finite("pad_stiffness", pad_stiffness), 0.0])
    return Scene(
        [1.0, 1.0],
        (rate**2 - turning**2) * np.eye(2) + held,
        damping=finite("damping", damping) * np.eye(2),
        gyroscopic=2.0 * turning * skew,
        circulatory=finite("follower_stiffness", follower_stiffness) * skew,
        dofs=["cosine", "sine"],
    )
