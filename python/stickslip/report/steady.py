"""The part of a report that no motion is needed for: scene, equilibrium, modes, loci."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from markupsafe import Markup

from stickslip.faults import InputError
from stickslip.locus.figures import loci
from stickslip.modes.modes import Modes
from stickslip.report import mode_motion
from stickslip.report.findings import Findings
from stickslip.scene.drawing.schematic import schematic
from stickslip.scene.laws.damping import Rayleigh
from stickslip.show import svg as drawing
from stickslip.show.html import details, facts, figure, note, number, paragraph, section, table, template
from stickslip.show.plots import figure_of
from stickslip.show.units import LENGTHS, suited

#: Dofs up to which matrices are printed, modes that are drawn in motion, contacts of tables of modes.
PRINTED, DRAWN, COLUMNS = 12, 8, 4


def scene_section(found: Findings) -> Markup:
    """Return the scene: contacts, loads, matrices."""
    scene, summary = found.scene, found.scene.summary()
    lumped = scene.mass if scene.mass.ndim == 1 else scene.mass.diagonal()
    loads = table(
        "Mass and constant force of every dof"
        + ("" if scene.mass.ndim == 1 else " (diagonal of the mass matrix)"),
        ["dof", "mass, kg", "force, N"],
        [[name, float(m), float(f)] for name, m, f in zip(scene.dofs, lumped, scene.force, strict=True)],
    )
    matrices = []
    if scene.size <= PRINTED:
        named = {
            "Stiffness matrix, N/m": scene.stiffness,
            "Mass matrix, kg": scene.mass if scene.mass.ndim == 2 else None,
            "Damping matrix, N s/m": None if isinstance(scene.damping, Rayleigh) else scene.damping,
            "Gyroscopic matrix, N s/m": scene.gyroscopic,
            "Circulatory matrix, N/m": scene.circulatory,
        }
        for caption, matrix in named.items():
            if matrix is None:
                continue
            entries = scipy.sparse.csr_array(matrix).toarray()
            rows = [[name, *map(float, row)] for name, row in zip(scene.dofs, entries, strict=True)]
            matrices.append(table(caption, ["", *scene.dofs], rows))
    return section(
        "scene",
        "Scene",
        facts([*summary.facts, ("Coulomb impulse at impacts", "yes" if scene.impact_friction else "no")]),
        *(one.html() for one in summary.tables if one.rows),
        details("Masses, forces, matrices", loads, *matrices),
    )


def equilibrium_section(found: Findings) -> Markup:
    """Return steady sliding: contact forces and displacements."""
    if found.equilibrium is None:
        return section(
            "equilibrium",
            "Steady sliding",
            note(f"There is no steady sliding: {found.reasons['equilibrium']}", "warning"),
        )
    state, scene = found.equilibrium, found.scene
    unit, per_metre = suited(float(np.abs(state.position).max(initial=0.0)), LENGTHS)
    return section(
        "equilibrium",
        "Steady sliding",
        paragraph(
            "Every contact slides against its slider and the structure is at rest: "
            "K x = F plus the contact forces."
        ),
        *(one.html() for one in state.summary().tables if one.rows),
        details(
            "Displacements",
            table(
                "Displacements in steady sliding",
                ["dof", f"displacement, {unit}"],
                [[name, per_metre * float(x)] for name, x in zip(scene.dofs, state.position, strict=True)],
            ),
        ),
    )


def modes_section(found: Findings) -> Markup:
    """Return the complex modes: table, powers, and shapes in motion."""
    modes, scene = found.modes, found.scene
    labels = scene.contact_labels()
    try:
        power = modes.power()
    except InputError as error:
        shares, told = np.zeros((0, len(modes))), f"The table has no powers of contacts: {error}."
    else:
        energies = power.energy.to_numpy()
        powers = power.contact_power.transpose("contact", "mode").to_numpy()[:COLUMNS]
        shares = np.divide(powers, energies, out=np.full(powers.shape, np.nan), where=energies > 0.0)
        told = (
            "The power of a contact over the energy of the mode is the rate at which this contact "
            "alone would make that energy grow."
        )
    rows = [
        [
            str(k),
            *map(float, (mode.frequency, mode.eigenvalue.real, mode.damping_ratio, modes.condition[k])),
            *map(float, shares[:, k]),
            _verdict(modes, k),
        ]
        for k, mode in enumerate(modes)
    ]
    listed = table(
        f"Complex modes of status {modes.combination or '(no contact)'}",
        [
            "mode",
            "frequency, Hz",
            "growth rate, 1/s",
            "damping ratio",
            "condition",
            *(f"power of contact {label} over energy, 1/s" for label in labels[: len(shares)]),
            "verdict",
        ],
        rows,
        row_kinds=["unstable" if grows else "" for grows in modes.unstable],
    )
    # Unstable ones first, then from the lowest frequency.
    shown = sorted(sorted(range(len(modes)), key=lambda k: (not modes.unstable[k], k))[:DRAWN])
    cards, structure = [], schematic(scene, found.known.columns)
    for k in shown:
        verdict = "unstable" if modes.unstable[k] else "stable"
        moved = mode_motion.drawing(structure, modes, k)
        growth = number(modes.eigenvalues[k].real, 4)
        caption = f"mode {k}: {number(modes.frequencies[k])} Hz, growth rate {growth} 1/s"
        cards.append((verdict, moved, caption))
    omitted = len(modes) - len(shown)
    lead = (
        f"Status {modes.combination}; frequency is |λ| / 2π. "
        if modes.combination
        else "Frequency is |λ| / 2π. "
    )
    return section(
        "modes",
        "Complex modes",
        paragraph(lead + told),
        _of_band(found),
        listed,
        Markup(template("report/cards.html").render(cards=cards)),
        note(f"{omitted} more modes are in the table.") if omitted else "",
    )


def loci_section(found: Findings) -> Markup:
    """Return eigenvalues over friction and the critical values."""
    if found.loci is None:
        return section("loci", "Stability over a parameter", note(found.reasons["loci"]))
    factor = "factor on the friction of every contact"
    what = factor if found.parameter == "friction_factor" else found.parameter.replace("_", " ")
    unit = found.loci[found.parameter].attrs.get("units", "1")
    what += "" if unit == "1" else f", {unit}"
    heading = "Stability over " + ("friction" if what == factor else what.split(",")[0])
    with drawing.style():
        drawn = loci(found.loci, critical=found.critical)
    exists = found.loci.steady_sliding.to_numpy()
    hopf = [point for point in found.critical if point.kind == "hopf"]
    places = ", ".join(number(point.value) for point in hopf) or "none"
    alternative = f"Growth rates and frequencies of all modes over {what}; Hopf points: {places}"
    return section(
        "loci",
        heading,
        figure(
            drawing.svg(drawn, "loci", alternative),
            f"Growth rates and frequencies over {what}, branches tracked. Red: unstable.",
        ),
        found.critical.summary().tables[0].html()
        if found.critical
        else paragraph("Nothing changes its kind over this range."),
        note(
            f"At {int((~exists).sum())} of {exists.size} values there is no steady sliding: a contact would "
            "pull. Eigenvalues there are those of contacts held closed.",
            "warning",
        )
        if not exists.all()
        else "",
    )


def boundary_section(found: Findings) -> Markup:
    """Return the curves over two parameters on which stability ends, and the points at which they meet."""
    heading = "Stability over two parameters"
    if found.boundary is None:
        return section("boundary", heading, note(found.reasons["boundary"]))
    boundary, summary = found.boundary, found.boundary.summary()
    with drawing.style():
        drawn = figure_of(boundary.plot())
    upward, across = (name.replace("_", " ") for name in boundary.parameters)
    alternative = (
        f"Largest growth rate over {across} and {upward}; {len(boundary)} curves on which stability or "
        f"steady sliding ends, {len(boundary.points)} points of codimension two"
    )
    return section(
        "boundary",
        heading,
        figure(
            drawing.svg(drawn, "boundary", alternative),
            "Where stability ends. A thick line bounds a stable region, beside a thin one other modes grow, "
            "and on a grey one there is no steady sliding.",
        ),
        *(one.html() if one.rows else paragraph(f"{one.caption}: none.") for one in summary.tables),
        facts(summary.facts),
        note(f"A curve may be missing: {'; '.join(boundary.doubts)}.", "warning") if boundary.doubts else "",
    )


def _of_band(found: Findings) -> Markup | str:
    """Return which frequencies the modes have, and how many of these are missing."""
    if found.band is None:
        return ""
    modes, (low, high) = found.modes, map(number, found.band)
    missing = "an unknown number of" if modes.missing is None else f"{abs(round(modes.missing, 2)):.2f}"
    text = f"All modes from {low} to {high} Hz; {missing} eigenvalues of this band were not found"
    return note("; ".join([text, *modes.doubts]) + ".", "warning" if modes.doubts else "")


def _verdict(modes: Modes, mode: int) -> str:
    kind = "unstable" if modes.unstable[mode] else "marginal" if modes.marginal[mode] else "decays"
    return f"{kind}, defective" if modes.defective[mode] else kind
