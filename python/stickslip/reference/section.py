"""Every published figure and table of the two-subsystem model beside the computed one."""

from __future__ import annotations

from collections import Counter

from stickslip.reference import figures as paper
from stickslip.show.html import columns, figure, note, paragraph, section, subsection, table
from stickslip.show import svg as drawing
from stickslip.reference.comparison import Row, rows

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


def comparison_section() -> str:
    """Return the section; everything in it is computed at the published parameters."""
    found = rows()
    counts = Counter(row.verdict for row in found)
    summary = ", ".join(f"{count} {PLURAL.get(verdict, verdict)}" for verdict, count in counts.items())
    drawn = dict(FIGURES)
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
        parts.append(subsection(source, _figures(drawn.pop(source, ())), _compared(source, of_source)))
    for heading, numbers in drawn.items():
        parts.append(subsection(heading, _figures(numbers)))
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


def _figures(numbers: tuple[int, ...]) -> str:
    return columns(*map(_figure, numbers))


def _figure(number: int) -> str:
    draw = paper.FIGURES[number]
    caption = f"Fig. {number}. {(draw.__doc__ or '').strip()}"
    return figure(drawing.svg(draw(), f"p{number}", caption), caption)
