"""The public names, each from the module that holds it; `__init__.py` reads them here."""

from stickslip import study
from stickslip.energy import figures as energy_figures
from stickslip.motion import figures
from stickslip.modes import figures as mode_figures
from stickslip.scene import models
from stickslip.reference import figures as paper
from stickslip.cycles import figures as portraits
from stickslip.cycles.arclength import trace_branch
from stickslip.cycles.attractors import disturbed_sliding
from stickslip.cycles.basins import Basins, basins
from stickslip.transient.batch import Outcome, simulate_many
from stickslip.cycles.bifurcation import Bifurcation, bifurcation
from stickslip.cycles.branch import Branch, BranchPoint, follow_branch
from stickslip.cycles.branch_points import branch_points
from stickslip.files.case import Case, load_case, load_scene
from stickslip.scene.contact import Contact
from stickslip.locus.critical import CriticalPoint, critical_points, hopf_points
from stickslip.cycles.cycle import Cycle, CyclePhase, Margin
from stickslip.files.dataset_file import read_dataset, write_dataset
from stickslip.motion.energy import Balance
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
from stickslip.energy.modal import modal_energy
from stickslip.energy.selection import ModeSelection, mode_selection
from stickslip.modes.shape import mode_power, orbit, phase_lag
from stickslip.modes.modes import Modes, complex_modes
from stickslip.scene.reduction import Reduced, reduce
from stickslip.report import write_report
from stickslip.scene.scene import Proportional, Scene
from stickslip.locus.sensitivity import entry_sensitivity, sensitivity
from stickslip.locus.stability import stability
from stickslip.scene.state import State, sliding_equilibrium
from stickslip.modes.status_table import StatusTable, status_table
from stickslip.study import Study
from stickslip.locus.sweep import sweep
from stickslip.transient.trajectory import Accumulation, Events, Grazing, Trajectory, simulate

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
