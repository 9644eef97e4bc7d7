"""Chains of equal subsystems."""

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
