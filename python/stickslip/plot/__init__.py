"""Every figure of the package, by one list; each is drawn where its subject belongs."""

from stickslip.cycles.figures import basins, bifurcation, limit_cycle, overlay
from stickslip.energy.figures import (
    energy_flow,
    energy_history,
    energy_rate,
    gain_over_amplitude,
    modal_shares,
    power_terms,
    stored_energy,
)
from stickslip.locus.figures import draw_loci, loci, stability_map
from stickslip.modes.drawing import schematic
from stickslip.modes.figures import animated, draw_shape, orbits, shapes
from stickslip.motion.figures import (
    contact_status,
    displacement,
    displacements,
    history,
    phase_plane,
    phase_portrait,
    phase_portraits,
    spectrum,
)
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
    "animated",
    "basins",
    "bifurcation",
    "contact_status",
    "convergence",
    "displacement",
    "displacements",
    "distribution",
    "draw_loci",
    "draw_shape",
    "eigenvalue_moments",
    "energy_flow",
    "energy_history",
    "energy_rate",
    "gain_over_amplitude",
    "history",
    "limit_cycle",
    "loci",
    "modal_shares",
    "morris_effects",
    "orbits",
    "overlay",
    "phase_plane",
    "phase_portrait",
    "phase_portraits",
    "power_terms",
    "probability",
    "schematic",
    "shapes",
    "sobol_indices",
    "spectrum",
    "stability_map",
    "stored_energy",
    "study",
]
