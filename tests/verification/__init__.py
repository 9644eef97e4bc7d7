"""Cases of the verification manual, in the order of its page."""

from verification import (
    belt,
    bistable,
    bounces,
    bouncing_bar,
    bristles,
    collision,
    damped_belt,
    den_hartog,
    drum_brake,
    elastic_stop,
    friction_laws,
    inclined_plane,
    mode_coupling,
    nonlinear_mode,
    nonlinear_springs,
    resting_slider,
    shaking_plate,
    stops,
    two_masses,
    two_subsystems,
)

#: A new file of cases is listed here.
FAMILIES = (
    inclined_plane,
    resting_slider,
    two_masses,
    shaking_plate,
    den_hartog,
    nonlinear_mode,
    belt,
    damped_belt,
    bistable,
    friction_laws,
    bristles,
    bounces,
    collision,
    elastic_stop,
    nonlinear_springs,
    bouncing_bar,
    stops,
    mode_coupling,
    drum_brake,
    two_subsystems,
)
CASES = [case for family in FAMILIES for case in family.CASES]
