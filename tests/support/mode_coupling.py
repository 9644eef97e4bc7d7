"""The model of mode coupling of Hoffmann et al. (2002), whose contact spring lifts off."""

import stickslip as ss


def mode_coupling(rate: float = 1.0) -> ss.Scene:
    """Two coupled dofs on a belt, with one growing mode; `rate`: how much faster everything goes."""
    return ss.Scene(
        mass=[1.0 / rate**2] * 2,
        stiffness=[[0.93, 0.43907487971871034], [0.43907487971871034, 0.31]],
        damping=ss.Rayleigh(mass=0.02 * rate),
        force=[0.0, -1.0],
        contacts=[
            ss.Contact(
                tangential="x",
                normal="y",
                friction=0.6,
                slider_speed=-rate,
                normal_stiffness=4.0 / 3.0,
                name="belt",
            )
        ],
        dofs=["x", "y"],
    )
