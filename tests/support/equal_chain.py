"""Chains of equal subsystems."""

import numpy as np

import stickslip as ss

PART = ss.models.Subsystem(
    upper_mass=0.3,
    contact_mass=0.5,
    inclination=0.4,
    vertical_stiffness=3e5,
    horizontal_stiffness=6e5,
    ceiling_stiffness=1e5,
    preload_displacement=1e-3,
)
LINK = ss.models.Link(horizontal_stiffness=4e5, vertical_stiffness=1e5)


def equal_chain(count, **arguments):
    """Equal subsystems on sliders of 50 mm/s."""
    arguments = {"slider_speed": 0.05, **arguments}
    return ss.models.chain([PART] * count, [LINK] * (count - 1), wall_stiffness=1e6, **arguments)


def long_chain(count=1000):
    """4000 coordinates, so that a panel takes milliseconds: masses that fall on their sliders one by one."""
    scene = equal_chain(count, friction=0.5)
    position = np.zeros(4 * count)
    position[3::4] = np.linspace(1e-5, 1e-4, count)
    return scene, ss.State(position, np.zeros(4 * count), "d" * count)
