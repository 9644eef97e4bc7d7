"""The public names, each from the module that holds it; `__init__.py` reads them here."""

from . import fe, study
from .cycles.attractors import disturbed_sliding
from .cycles.basins.basins import basins
from .cycles.bifurcation import bifurcation
from .cycles.branches.continuation import continuation
from .cycles.cycle import Cycle
from .cycles.frequency_response import frequency_response
from .energy.modal import modal_energy
from .energy.selection import mode_selection
from .explorer import explore
from .faults import InputError, Interrupted, NoSteadyStateError, OrbitError, StickslipError, StudyError
from .figures import plot
from .files.case import Case
from .files.saved import load, save
from .locus.boundary.boundary import stability_boundary
from .locus.critical import critical_points
from .locus.sensitivity import sensitivity
from .locus.stability import stability
from .locus.sweep import sweep
from .modes.complex_modes import complex_modes
from .modes.modes import Modes
from .modes.status_table import status_table
from .motion.errors import NotPeriodicError, RunError
from .report import write_report
from .scene import models
from .scene.contact import Contact
from .scene.elements import Damper, Spring
from .scene.laws import friction, spring
from .scene.laws.damping import Rayleigh
from .scene.loads.in_time import Harmonic, Switched
from .scene.reduction import equations_of
from .scene.scene import Scene
from .scene.state import State, steady_sliding
from .study.study import Study
from .transient.batch import simulate_many
from .transient.nonlinear_mode import nonlinear_mode
from .transient.simulate import simulate
from .transient.trajectory import Trajectory
from .version import __version__, show_versions

__all__ = [
    "Case",
    "Contact",
    "Cycle",
    "Damper",
    "Harmonic",
    "InputError",
    "Interrupted",
    "Modes",
    "NoSteadyStateError",
    "NotPeriodicError",
    "OrbitError",
    "Rayleigh",
    "RunError",
    "Scene",
    "Spring",
    "State",
    "StickslipError",
    "Study",
    "StudyError",
    "Switched",
    "Trajectory",
    "__version__",
    "basins",
    "bifurcation",
    "complex_modes",
    "continuation",
    "critical_points",
    "disturbed_sliding",
    "equations_of",
    "explore",
    "fe",
    "frequency_response",
    "friction",
    "load",
    "modal_energy",
    "mode_selection",
    "models",
    "nonlinear_mode",
    "plot",
    "save",
    "sensitivity",
    "show_versions",
    "simulate",
    "simulate_many",
    "spring",
    "stability",
    "stability_boundary",
    "status_table",
    "steady_sliding",
    "study",
    "sweep",
    "write_report",
]
