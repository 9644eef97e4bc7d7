"""Studies: Monte Carlo and parameter campaigns.

Data flows one way: parameters and samplers -> design -> outputs of every sample -> store -> dataset ->
statistics -> figures (`stickslip.plot`).
"""

from stickslip.study.importance import importance
from stickslip.study.parameters import GaussianCopula
from stickslip.study.sample.outputs import Output
from stickslip.study.statistics import convergence, distribution, probability, unstacked

__all__ = [
    "GaussianCopula",
    "Output",
    "convergence",
    "distribution",
    "importance",
    "probability",
    "unstacked",
]


def __dir__() -> list[str]:
    return __all__
