"""One mass on a slider: x along it, y normal to it, upwards."""

import stickslip as ss


def block(
    *,
    mass,
    stiffness=(0.0, 0.0),
    damping=0.0,
    load,
    friction=0.0,
    static_friction=None,
    speed=0.0,
    restitution=0.0,
):
    """Return the scene; damping acts along the slider, N s/m, the load presses the mass on it, N."""
    contact = ss.Contact(
        tangential="x",
        normal="y",
        friction=friction,
        static_friction=static_friction,
        slider_speed=speed,
        restitution=restitution,
    )
    return ss.Scene(
        [mass, mass],
        [[stiffness[0], 0.0], [0.0, stiffness[1]]],
        damping=[[damping, 0.0], [0.0, 0.0]] if damping else None,
        force=[0.0, -load],
        contacts=[contact],
        dofs=["x", "y"],
    )
