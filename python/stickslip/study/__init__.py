"""Studies: Monte Carlo and parameter campaigns.

Data flows one way: parameters and samplers -> design -> outputs of every sample -> store -> dataset ->
statistics -> figures (`stickslip.study.figures`).
"""

from typing import TYPE_CHECKING, Any

from stickslip.study.sample.outputs import OUTPUTS, Output
from stickslip.study.parameters import GaussianCopula
from stickslip.study.perturbation import eigenvalue_moments
from stickslip.study.samplers import unit_design
from stickslip.study.statistics import (
    convergence,
    distribution,
    morris_effects,
    probability,
    sobol_indices,
    unstable,
)
from stickslip.study.study import Study, unstacked
from stickslip.files.study_file import study_of

if TYPE_CHECKING:
    from stickslip.study import figures as figures

__all__ = [
    "OUTPUTS",
    "GaussianCopula",
    "Output",
    "Study",
    "convergence",
    "distribution",
    "eigenvalue_moments",
    "figures",
    "morris_effects",
    "probability",
    "sobol_indices",
    "study_of",
    "unit_design",
    "unstable",
    "unstacked",
]


def __getattr__(name: str) -> Any:
    # Figures take matplotlib, which studies themselves do not need.
    if name == "figures":
        from importlib import import_module

        return import_module("stickslip.study.figures")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
