"""Studies: Monte Carlo and parameter campaigns.

Data flows one way: parameters and samplers -> design -> outputs of every sample -> store -> dataset ->
statistics -> figures (`stickslip.plot`).
"""

from stickslip.study.importance import morris_effects, sobol_indices
from stickslip.study.parameters import GaussianCopula
from stickslip.study.perturbation import eigenvalue_moments
from stickslip.study.sample.outputs import OUTPUTS, Output
from stickslip.study.samplers import unit_design
from stickslip.study.statistics import convergence, distribution, probability, unstable, unstacked
from stickslip.study.study import Study

__all__ = [
    "OUTPUTS",
    "GaussianCopula",
    "Output",
    "Study",
    "convergence",
    "distribution",
    "eigenvalue_moments",
    "morris_effects",
    "probability",
    "sobol_indices",
    "unit_design",
    "unstable",
    "unstacked",
]


def __dir__() -> list[str]:
    return __all__
