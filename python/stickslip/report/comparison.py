"""Every published figure and table of the two-subsystem model beside the computed one."""

from __future__ import annotations

from collections import Counter
from decimal import Decimal

import numpy as np
from matplotlib.figure import Figure

from stickslip import energy_figures, figures, mode_figures, portraits
from stickslip.cycle import Cycle
from stickslip.models import two_subsystems
from stickslip.modes import complex_modes
from stickslip.report import drawing
from stickslip.report.markup import figure, note, paragraph, section, subsection, table
from stickslip.reproduce import FRICTIONS, UPPER_VERTICAL, Row, attractor, rows, standard_run
from stickslip.sweep import sweep

#: A verdict after a count.
PLURAL = {"agrees": "agree", "erratum": "errata of the print", "differs": "differ"}
MASSES = {"m1": ("x1", "x2"), "m2": ("x3", "x4"), "m3": ("x5", "x6"), "m4": ("x7", "x8")}


def comparison_section() -> str:
    """Return the section; everything in it is computed at the published parameters."""
    found = rows()
    counts = Counter(row.verdict for row in found)
    summary = ", ".join(f"{count} {PLURAL.get(verdict, verdict)}" for verdict, count in counts.items())
    with drawing.style():
        drawn = _figures()
    parts = [
        paragraph(
            "Brunetti, Massi, D'Ambrogio, Berthier: Dynamic and energy analysis of frictional contact "
            "instabilities on a lumped system. Computed at the published parameters, whatever those of this "
            "scene. A value agrees if it differs by less than one unit of the last printed digit."
        ),
        note(f"{len(found)} published quantities: {summary}."),
    ]
    for source in dict.fromkeys(row.source for row in found):
        of_source = [row for row in found if row.source == source]
        parts.append(subsection(source, *drawn.pop(source, []), _compared(source, of_source)))
    for heading, pictures in drawn.items():
        parts.append(subsection(heading, *pictures))
    return section("published", "Published and computed", *parts)


def _compared(source: str, of_source: list[Row]) -> str:
    notes = list(dict.fromkeys(row.note for row in of_source if row.note))
    listed = table(
        f"{source}: published and computed",
        ["quantity", "published", "computed", "difference", "verdict"],
        [
            [
                row.quantity,
                row.published,
                row.computed,
                row.difference,
                row.verdict + (f" [{notes.index(row.note) + 1}]" if row.note else ""),
            ]
            for row in of_source
        ],
        row_kinds=[row.verdict.replace(" ", "-") for row in of_source],
    )
    return listed + "".join(paragraph(f"[{k}] {text}") for k, text in enumerate(notes, start=1))


def _figures() -> dict[str, list[str]]:
    """Return the figures by the source whose numbers they belong to, then those without numbers."""
    run = standard_run()
    cycle = run.limit_cycle()
    onset = float(run.events.time[0])
    growing = complex_modes(run.scene)
    leading = int(np.argmax(growing.eigenvalues.real))
    cycles = {}
    for friction, speed in (("1.5", "0.025"), ("2.2", "0.025"), ("3.0", "0.025")):
        cycles[f"friction {friction}"] = attractor(Decimal(friction), Decimal(speed))[1]
    speeds = {f"{v} m/s": attractor(Decimal("2.2"), Decimal(v))[1] for v in ("0.025", "0.05", "0.3", "0.9")}
    growth = energy_figures.energy_history(run, onset - 0.03, onset + 0.01)
    whole = energy_figures.energy_history(run)
    period = energy_figures.energy_history(cycle.run)
    for drawn in (growth, whole, period):
        drawn.set_size_inches(7.2, 6.0)
    return {
        "Fig. 2": [
            _one(
                "p2",
                mode_figures.shapes(complex_modes(two_subsystems(friction=0.0))),
                "Mode shapes without friction",
            )
        ],
        "Fig. 3": [
            _one(
                "p3",
                mode_figures.loci(sweep(two_subsystems(), friction=np.linspace(*FRICTIONS, 301))),
                "Eigenvalues over friction",
            )
        ],
        "Figs. 5-8, Table 2": [
            _one("p5", figures.history(run), "Displacements in the standard run (Fig. 5)"),
            _one("p6", figures.phase_plane(run), "Phase plane of the contact masses (Fig. 6)"),
            _one("p7", figures.contact_status(run), "Contact status (Fig. 7)"),
            _one(
                "p8",
                _spectra({"friction 1.5": cycle}),
                "Spectrum of the vertical of m1 in the limit cycle (Fig. 8)",
            ),
        ],
        "Figs. 9-10": [
            _one("p9", _overlay(cycles), "Limit cycles at three frictions (Fig. 9)"),
            _one("p10", _spectra(cycles), "Their spectra (Fig. 10)"),
        ],
        "Figs. 11-12, Table 3": [
            _one("p11", _overlay(speeds), "Limit cycles at four slider speeds (Fig. 11)"),
            _one("p12", _spectra(speeds), "Their spectra (Fig. 12)"),
        ],
        "Figs. 4 and 13-15, without printed numbers": [
            _one(
                "p4",
                mode_figures.orbits(growing, leading, MASSES),
                "Orbits of the masses in the unstable mode (Fig. 4)",
            ),
            _one("p13", whole, "Energy of the standard run (Fig. 13)"),
            _one("p14", period, "Energy over one period of the limit cycle (Fig. 14)"),
            _one("p15", growth, "Energy where the growth ends (Fig. 15)"),
        ],
    }


def _one(name: str, drawn: Figure, caption: str) -> str:
    return figure(drawing.svg(drawn, name, caption), caption + ".")


def _overlay(cycles: dict[str, Cycle]) -> Figure:
    drawn = Figure(figsize=(7.2, 3.4), layout="constrained")
    for contact, axes in enumerate(drawn.subplots(1, 2)):
        portraits.overlay(axes, cycles, contact).set_title(f"contact {contact}")
    return drawn


def _spectra(cycles: dict[str, Cycle]) -> Figure:
    drawn = Figure(figsize=(7.2, 0.6 + 1.2 * len(cycles)), layout="constrained")
    panels = drawn.subplots(len(cycles), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, (name, cycle) in zip(panels, cycles.items(), strict=True):
        lines = cycle.harmonics().swap_dims(harmonic="frequency").assign_attrs(method="exact")
        portraits.spectrum(axes, lines.sel(dof=UPPER_VERTICAL), name)
        axes.set(xlim=(0.0, 1000.0), title=f"{UPPER_VERTICAL}, {name}")
        axes.label_outer()
    return drawn
