"""The public names, each from the module that holds it; `__init__.py` reads them here."""

from . import plot, reference, study
from .cycles.arclength import trace_branch
from .cycles.attractors import disturbed_sliding
from .cycles.basins import Basins, basins
from .cycles.bifurcation import Bifurcation, bifurcation
from .cycles.branch import Branch, BranchPoint, follow_branch
from .cycles.branch_points import branch_points
from .cycles.cycle import Cycle, CyclePhase, Margin
from .energy.modal import modal_energy
from .energy.selection import ModeSelection, mode_selection
from .errors import (
    InputError,
    NoSteadySlidingError,
    OrbitError,
    SearchInterrupted,
    StickslipError,
    StoreError,
    StudyError,
    StudyInterrupted,
)
from .files.case import Case, load_case, load_scene, save
from .files.dataset_file import read_dataset, write_dataset
from .files.study_file import study_of
from .locus.critical import CriticalPoint, critical_points, hopf_points
from .locus.sensitivity import entry_sensitivity, sensitivity
from .locus.stability import stability
from .locus.sweep import sweep
from .modes.modes import Mode, Modes, complex_modes
from .modes.shape import mode_power, orbit, phase_lag
from .modes.status_table import StatusTable, status_table
from .motion.energy import Balance
from .motion.errors import NotPeriodicError, RunError, RunInterrupted
from .motion.events import Accumulation, Event, Events, Grazing
from .motion.motion import Motion
from .report import write_report
from .scene import models
from .scene.contact import Contact
from .scene.reduction import Reduced, reduce
from .scene.scene import Proportional, Scene
from .scene.state import State, sliding_equilibrium
from .study import Study
from .transient.batch import Outcome, simulate_many
from .transient.simulate import simulate
from .transient.trajectory import Trajectory
from .version import __version__

__all__ = [
    "Accumulation",
    "Balance",
    "Basins",
    "Bifurcation",
    "Branch",
    "BranchPoint",
    "Case",
    "Contact",
    "CriticalPoint",
    "Cycle",
    "CyclePhase",
    "Event",
    "Events",
    "Grazing",
    "InputError",
    "Margin",
    "Mode",
    "ModeSelection",
    "Modes",
    "Motion",
    "NoSteadySlidingError",
    "NotPeriodicError",
    "OrbitError",
    "Outcome",
    "Proportional",
    "Reduced",
    "RunError",
    "RunInterrupted",
    "Scene",
    "SearchInterrupted",
    "State",
    "StatusTable",
    "StickslipError",
    "StoreError",
    "Study",
    "StudyError",
    "StudyInterrupted",
    "Trajectory",
    "__version__",
    "basins",
    "bifurcation",
    "branch_points",
    "complex_modes",
    "critical_points",
    "disturbed_sliding",
    "entry_sensitivity",
    "follow_branch",
    "hopf_points",
    "load_case",
    "load_scene",
    "modal_energy",
    "mode_power",
    "mode_selection",
    "models",
    "orbit",
    "phase_lag",
    "plot",
    "read_dataset",
    "reduce",
    "reference",
    "save",
    "sensitivity",
    "simulate",
    "simulate_many",
    "sliding_equilibrium",
    "stability",
    "status_table",
    "study",
    "study_of",
    "sweep",
    "trace_branch",
    "write_dataset",
    "write_report",
]
