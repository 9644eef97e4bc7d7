"""Figures of plain datasets; results draw themselves, such as ``run.plot()`` and ``cycle.plot.energy()``.

A function that draws one panel takes `ax` and returns the Axes, one that draws several takes `figure` and
returns the Figure.
"""

from stickslip.cycles.diagram_figures import basins, bifurcation
from stickslip.energy.figures import modal_shares
from stickslip.locus.figures import loci, stability_map
from stickslip.motion.energy_figures import energy_rate, power_terms, stored_energy
from stickslip.motion.figures import spectrum
from stickslip.study.figures import (
    convergence,
    distribution,
    eigenvalue_moments,
    morris_effects,
    probability,
    sobol_indices,
    study,
)

__all__ = [
    "basins",
    "bifurcation",
    "convergence",
    "distribution",
    "eigenvalue_moments",
    "energy_rate",
    "loci",
    "modal_shares",
    "morris_effects",
    "power_terms",
    "probability",
    "sobol_indices",
    "spectrum",
    "stability_map",
    "stored_energy",
    "study",
]
