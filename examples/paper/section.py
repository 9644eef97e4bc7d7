"""A section of a report: all that was published of the two-subsystem model beside the computed one."""

from __future__ import annotations

import dataclasses
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from paper.numbers import published
from stickslip.scene.known import Known, known_of
from stickslip.scene.models import two_subsystems
from stickslip.scene.scene import Scene
from stickslip.show import svg as drawing
from stickslip.show.html import columns, details, figure, note, paragraph, section, subsection, table

if TYPE_CHECKING:
    from paper.comparison import Row

#: Name of the section of a report, and its heading.
NAMED = ("published", "Published and computed")
#: A verdict after a count.
PLURAL = {"agrees": "agree", "erratum": "errata of the print", "differs": "differ"}
#: Figures by the source whose numbers they belong to, then those without numbers.
FIGURES = {
    "Fig. 2": (2,),
    "Fig. 3": (3,),
    "Figs. 5-8, Table 2": (5, 6, 7, 8),
    "Figs. 9-10": (9, 10),
    "Figs. 11-12, Table 3": (11, 12),
    "Figs. 4 and 13-15, without printed numbers": (4, 13, 14, 15),
}


def known(scene: Scene) -> Known:
    """Return what is known of a scene, with the section of its report that the published model has.

    The section compares every published number and figure with the computed one, for a scene at parameters of
    which the paper has results.
    """
    found = known_of(scene)
    if not found.columns:
        return found
    cases = published()["limit_cycles"]
    models = [
        two_subsystems(friction=float(case["friction"]), slider_speed=float(case["slider_speed"]))
        for case in cases
    ]
    same = any(_is_as(scene, model) for model in models)
    return dataclasses.replace(found, section=(*NAMED, comparison_section) if same else None)


def _is_as(scene: Scene, other: Scene) -> bool:
    """Return whether two scenes of the same matrices have the same loads and laws."""
    laws = [
        [(c.friction, c.static_friction, c.slider_speed, c.restitution, c.gap) for c in one.contacts]
        for one in (scene, other)
    ]
    same = laws[0] == laws[1] and scene.impact_friction == other.impact_friction
    return same and np.array_equal(scene.force, other.force)


def comparison_section() -> str:
    """Return the section; everything in it is computed at the published parameters."""
    # Most scenes are not the paper's and need neither its numbers nor its figures.
    from paper.comparison import rows

    found = rows()
    counts = Counter(row.verdict for row in found)
    summary = ", ".join(f"{count} {PLURAL.get(verdict, verdict)}" for verdict, count in counts.items())
    drawn = dict(FIGURES)
    said = [
        paragraph(
            "Brunetti, Massi, D'Ambrogio, Berthier: Dynamic and energy analysis of frictional contact "
            "instabilities on a lumped system. Computed at the published parameters, whatever those of this "
            "scene. A value agrees if it differs by less than one unit of the last printed digit."
        ),
        note(f"{len(found)} published quantities: {summary}."),
    ]
    parts = []
    for source in dict.fromkeys(row.source for row in found):
        of_source = [row for row in found if row.source == source]
        parts.append(subsection(source, _figures(drawn.pop(source, ())), _compared(source, of_source)))
    for heading, numbers in drawn.items():
        parts.append(subsection(heading, _figures(numbers)))
    return section(*NAMED, *said, details("All of them, with their figures", *parts))


def _compared(source: str, of_source: list[Row]) -> Markup:
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
    return Markup("").join([listed, *(paragraph(f"[{k}] {text}") for k, text in enumerate(notes, start=1))])


def _figures(numbers: tuple[int, ...]) -> Markup:
    return columns(*map(_figure, numbers))


def _figure(number: int) -> Markup:
    from paper import figures as paper

    draw = paper.FIGURES[number]
    caption = f"Fig. {number}. {(draw.__doc__ or '').strip()}"
    return figure(drawing.svg(draw(), f"p{number}", caption), caption)
