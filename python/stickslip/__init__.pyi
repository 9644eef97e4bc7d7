"""The public names, each from the module that holds it; `__init__.py` reads them here."""

from stickslip import energy_figures, figures, mode_figures, models, paper, portraits, study
from stickslip.arclength import trace_branch
from stickslip.attractors import disturbed_sliding
from stickslip.basins import Basins, basins
from stickslip.batch import Outcome, simulate_many
from stickslip.bifurcation import Bifurcation, bifurcation
from stickslip.branch import Branch, BranchPoint, follow_branch
from stickslip.branch_points import branch_points
from stickslip.case import Case, load_case, load_scene
from stickslip.contact import Contact
from stickslip.critical import CriticalPoint, critical_points, hopf_points
from stickslip.cycle import Cycle, CyclePhase, Margin
from stickslip.dataset_file import read_dataset, write_dataset
from stickslip.energy import Balance
from stickslip.errors import (
    InputError,
    NoSteadySlidingError,
    NotPeriodicError,
    OrbitError,
    RunError,
    RunInterrupted,
    SearchInterrupted,
    StickslipError,
    StoreError,
    StudyError,
    StudyInterrupted,
)
from stickslip.modal_energy import modal_energy
from stickslip.mode_selection import ModeSelection, mode_selection
from stickslip.mode_shape import mode_power, orbit, phase_lag
from stickslip.modes import Modes, complex_modes
from stickslip.reduction import Reduced, reduce
from stickslip.report import write_report
from stickslip.scene import Proportional, Scene
from stickslip.sensitivity import entry_sensitivity, sensitivity
from stickslip.stability import stability
from stickslip.state import State, sliding_equilibrium
from stickslip.status_table import StatusTable, status_table
from stickslip.study import Study
from stickslip.sweep import sweep
from stickslip.transient import Accumulation, Events, Grazing, Trajectory, simulate

__version__: str

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
    "Events",
    "Grazing",
    "InputError",
    "Margin",
    "ModeSelection",
    "Modes",
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
    "energy_figures",
    "entry_sensitivity",
    "figures",
    "follow_branch",
    "hopf_points",
    "load_case",
    "load_scene",
    "modal_energy",
    "mode_figures",
    "mode_power",
    "mode_selection",
    "models",
    "orbit",
    "paper",
    "phase_lag",
    "portraits",
    "read_dataset",
    "reduce",
    "sensitivity",
    "simulate",
    "simulate_many",
    "sliding_equilibrium",
    "stability",
    "status_table",
    "study",
    "sweep",
    "trace_branch",
    "write_dataset",
    "write_report",
]
