"""Many dofs: a row of blocks on a plate, and a string under a bow."""

from __future__ import annotations

import numpy as np
import scipy.sparse

from stickslip.faults import InputError
from stickslip.scene.checks import finite, positive, whole_number
from stickslip.scene.contact import Contact
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.laws.state import LuGre
from stickslip.scene.models.naming import named
from stickslip.scene.scene import Scene

#: Friction of the bow.
ROSIN = LuGre(static=0.8, kinetic=0.35, speed=0.1, stiffness=3e4, damping=0.05)


@named
def burridge_knopoff(
    *,
    blocks: int = 50,
    mass: float = 1.0,
    stiffness: float = 1.0,
    link_stiffness: float = 9.0,
    damping: float = 0.2,
    normal_force: float = 1.0,
    friction: float | FrictionLaw = 0.8,
    static_friction: float | None = 1.0,
    slider_speed: float = 0.01,
) -> Scene:
    """Return a row of blocks on a moving plate.

    ``m x_i'' + c x_i' + k x_i + kl (2 x_i - x_(i-1) - x_(i+1)) = T_i`` with friction forces T_i: each block
    hangs on a spring k and is tied to its neighbours by springs kl; the plate carries it until the springs
    overcome static friction. R. Burridge, L. Knopoff, "Model and theoretical seismicity", Bulletin of the
    Seismological Society of America 57 (1967) 341; the numbers are those of the example ``burridge_knopoff``.
    The scene is sparse.

    Parameters
    ----------
    blocks
        Number of blocks.
    mass
        m, kg.
    stiffness, link_stiffness
        k and kl, N/m.
    damping
        c / m, 1/s.
    normal_force
        Of each block, N.
    friction, static_friction
        Of each block: a number or a law, and the coefficient up to which it sticks; None: friction at rest.
    slider_speed
        Speed of the plate, m/s.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    count = whole_number("blocks", blocks, 1)
    link = finite("link_stiffness", link_stiffness, least=0.0)
    tied = np.zeros(count)
    tied[1:] += link
    tied[:-1] += link
    diagonals = [np.full(count - 1, -link), finite("stiffness", stiffness) + tied, np.full(count - 1, -link)]
    plate = [
        Contact(
            tangential=k,
            normal_force=normal_force,
            friction=friction,
            static_friction=static_friction,
            slider_speed=slider_speed,
        )
        for k in range(count)
    ]
    return Scene(
        np.full(count, positive("mass", mass)),
        scipy.sparse.diags_array(diagonals, offsets=[-1, 0, 1], shape=(count, count)).tocsr(),
        damping=Rayleigh(mass=finite("damping", damping, least=0.0)),
        contacts=plate,
    )


@named
def bowed_string(
    *,
    modes: int = 20,
    length: float = 0.33,
    tension: float = 50.0,
    density: float = 3e-3,
    quality: float = 300.0,
    bow_place: float = 1.0 / 9.0,
    bow_force: float = 1.0,
    bow_speed: float = 0.1,
    friction: float | FrictionLaw = ROSIN,
) -> Scene:
    """Return a string under a bow, by its modes.

    ``q_i'' + c_i q_i' + w_i^2 q_i = 2 / (rho L) sin(i pi b) T``, ``w_i = i pi / L sqrt(tension / rho)``; the
    bow rubs at b L with the friction force T. M. E. McIntyre, R. T. Schumacher, J. Woodhouse, "On the
    oscillations of musical instruments", Journal of the Acoustical Society of America 74 (1983) 1325, for the
    string; rosin creeps as the bristles of LuGre's law do. The numbers are those of the example
    ``bowed_string``.

    Parameters
    ----------
    modes
        Number of modes, which are the dofs.
    length, tension, density
        L, m; N; rho, kg/m.
    quality
        Higher modes fade faster: the quality of mode i is `quality` over ``1 + i / 10``.
    bow_place
        b, place of the bow over the length, between 0 and 1.
    bow_force, bow_speed
        N; m/s.
    friction
        Of the bow: a number or a law.

    Raises
    ------
    InputError
        If a parameter is ill-posed.
    """
    place = finite("bow_place", bow_place)
    if not 0.0 < place < 1.0:
        raise InputError(f"bow_place: must be between 0 and 1, got {place:g}")
    order = np.arange(1, whole_number("modes", modes, 1) + 1)
    rho, whole = positive("density", density), positive("length", length)
    rates = np.pi * order / whole * np.sqrt(positive("tension", tension) / rho)
    masses = np.full(order.size, 0.5 * rho * whole)
    bow = Contact(
        tangential=np.sin(np.pi * order * place),
        normal_force=bow_force,
        friction=friction,
        slider_speed=bow_speed,
    )
    damping = np.diag(masses * rates * (1.0 + 0.1 * order) / positive("quality", quality))
    return Scene(masses, np.diag(masses * rates**2), damping=damping, contacts=[bow])
