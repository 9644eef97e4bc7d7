"""Friction-induced vibration: complex modes, stick-slip transients and their limit cycles.

A `Scene` holds the model; `complex_modes` says whether steady sliding is stable, `simulate` what happens when
it is not. SI units throughout.
"""

from importlib.metadata import version

from stickslip import models
from stickslip.contact import Contact
from stickslip.energy import Balance
from stickslip.errors import InputError, RunError, RunInterrupted, StickslipError
from stickslip.modes import Modes, complex_modes
from stickslip.reduction import Reduced, reduce
from stickslip.scene import Proportional, Scene
from stickslip.state import State, sliding_equilibrium
from stickslip.transient import Accumulation, Events, Grazing, Trajectory, simulate

__version__ = version("stickslip")

__all__ = [
    "Accumulation",
    "Balance",
    "Contact",
    "Events",
    "Grazing",
    "InputError",
    "Modes",
    "Proportional",
    "Reduced",
    "RunError",
    "RunInterrupted",
    "Scene",
    "State",
    "StickslipError",
    "Trajectory",
    "__version__",
    "complex_modes",
    "models",
    "reduce",
    "simulate",
    "sliding_equilibrium",
]
