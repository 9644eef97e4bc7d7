"""The types of results, each from the module that holds it; `types.py` reads them here."""

from .cycles.basins.result import BasinBoundary, Basins
from .cycles.bifurcation import Bifurcation
from .cycles.branches.branch import Branch, BranchPoint
from .cycles.branches.curve import BifurcationCurve
from .cycles.frequency_response import FrequencyResponse
from .cycles.phases import CyclePhase, Margin
from .energy.selection import ModeSelection
from .locus.boundary.curves import BoundaryCurve, CodimensionTwo
from .locus.boundary.result import StabilityBoundary
from .locus.points import CriticalPoint, CriticalPoints
from .modes.modes import Mode
from .modes.status_table import StatusTable
from .motion.energy import Balance
from .motion.events import Accumulation, Event, Events, Grazing
from .motion.motion import Motion
from .scene.drawing.view import View
from .scene.reduction import Reduced
from .scene.state import Equilibrium
from .transient.batch import Outcome

__all__ = [
    "Accumulation",
    "Balance",
    "BasinBoundary",
    "Basins",
    "Bifurcation",
    "BifurcationCurve",
    "BoundaryCurve",
    "Branch",
    "BranchPoint",
    "CodimensionTwo",
    "CriticalPoint",
    "CriticalPoints",
    "CyclePhase",
    "Equilibrium",
    "Event",
    "Events",
    "FrequencyResponse",
    "Grazing",
    "Margin",
    "Mode",
    "ModeSelection",
    "Motion",
    "Outcome",
    "Reduced",
    "StabilityBoundary",
    "StatusTable",
    "View",
]
