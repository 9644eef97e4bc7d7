"""HTML from text and numbers: the parts of a page, by templates that escape."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Template
    from markupsafe import Markup

_MINUS = str.maketrans({"-": "−"})


@cache
def template(name: str) -> Template:
    """Return a template of the package, such as ``show/parts.html``; what it is given is escaped."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    loader = FunctionLoader(lambda path: files("stickslip").joinpath(path).read_text(encoding="utf-8"))
    strict: dict[str, Any] = {"autoescape": True, "undefined": StrictUndefined}
    return Environment(loader=loader, trim_blocks=True, lstrip_blocks=True, **strict).get_template(name)


def _part(macro: str, *told: Any) -> Markup:
    return getattr(template("show/parts.html").module, macro)(*told).strip()  # type: ignore[no-any-return]


def number(value: float, digits: int = 6) -> str:
    """Return a number to so many significant digits, with a true minus sign."""
    # Adding zero takes the sign off a negative one.
    return f"{value + 0.0:.{digits}g}".translate(_MINUS)


def paragraph(text: str) -> Markup:
    """Return a paragraph of plain text."""
    return _part("paragraph", text)


def section(name: str, heading: str, *parts: str) -> Markup:
    """Return a section that the contents can point to."""
    return _part("section", name, heading, parts)


def subsection(heading: str, *parts: str) -> Markup:
    """Return a titled part of a section."""
    return _part("subsection", heading, parts)


def note(text: str, kind: str = "note") -> Markup:
    """Return a remark that is set apart; `kind` is ``note`` or ``warning``."""
    return _part("note", text, kind)


def facts(pairs: Iterable[tuple[str, str]]) -> Markup:
    """Return names and their values as a list."""
    return _part("facts", pairs)


def table(
    caption: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    digits: int = 6,
    limit: int = 64,
    row_kinds: Sequence[str] = (),
) -> Markup:
    """Return a table; numbers stand to the right, the first column heads its row.

    Numbers are written to `digits` significant digits. Of more than `limit` rows the caption says how many
    are shown. `row_kinds` is a class per row.
    """
    listed = list(rows)
    shown = caption if len(listed) <= limit else f"{caption} ({limit} of {len(listed)} rows)"
    numeric = [any(isinstance(row[k], float | int) for row in listed) for k in range(len(headings))]
    cells = [
        [number(cell, digits) if isinstance(cell, float | int) else cell for cell in row]
        for row in listed[:limit]
    ]
    kinds = row_kinds or [""] * len(listed)
    return _part("table", shown, headings, numeric, list(zip(kinds, cells, strict=False)))


def figure(drawing: Markup, caption: str) -> Markup:
    """Return a drawing with its caption."""
    return _part("figure", drawing, caption)


def columns(*figures: Markup) -> Markup:
    """Return narrow figures beside each other, as many as fit; nothing for none."""
    return _part("columns", figures)


def details(summary: str, *parts: str) -> Markup:
    """Return what is folded away until asked for."""
    return _part("details", summary, parts)
