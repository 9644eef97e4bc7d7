"""HTML from text: escaped, with headings, captions and alternatives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_MINUS = str.maketrans({"-": "−"})


def number(value: float, digits: int = 6) -> str:
    """Return a number to so many significant digits, with a true minus sign."""
    # Adding zero takes the sign off a negative one.
    return f"{value + 0.0:.{digits}g}".translate(_MINUS)


def paragraph(text: str) -> str:
    """Return a paragraph of plain text."""
    return f"<p>{escape(text)}</p>"


def section(name: str, heading: str, *parts: str) -> str:
    """Return a section that the contents can point to."""
    body = "\n".join(part for part in parts if part)
    title = f'<h2 id="{name}-h">{escape(heading)}</h2>'
    return f'<section id="{name}" aria-labelledby="{name}-h">\n{title}\n{body}\n</section>'


def subsection(heading: str, *parts: str) -> str:
    """Return a titled part of a section."""
    return "\n".join([f"<h3>{escape(heading)}</h3>", *(part for part in parts if part)])


def note(text: str, kind: str = "note") -> str:
    """Return a remark that is set apart; `kind` is ``note`` or ``warning``."""
    role = ' role="alert"' if kind == "warning" else ""
    return f'<p class="{kind}"{role}>{escape(text)}</p>'


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Return names and their values as a list."""
    rows = "\n".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in pairs)
    return f'<dl class="facts">\n{rows}\n</dl>'


def table(
    caption: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    digits: int = 6,
    limit: int = 64,
    row_kinds: Sequence[str] | None = None,
) -> str:
    """Return a table; numbers stand to the right, the first column heads its row.

    Parameters
    ----------
    caption
        What the table shows; with more than `limit` rows it says how many are left out.
    headings
        One per column.
    rows
        Cells, text or numbers; a number is written to `digits` significant digits.
    digits, limit
        See above.
    row_kinds
        A class per row; None: none.
    """
    listed = [list(row) for row in rows]
    kinds = [""] * len(listed) if row_kinds is None else list(row_kinds)
    omitted = len(listed) - limit
    shown = caption if omitted <= 0 else f"{caption} ({limit} of {len(listed)} rows)"
    numeric = [any(isinstance(row[k], float | int) for row in listed) for k in range(len(headings))]
    head = "".join(
        f'<th scope="col"{_right(right)}>{escape(text)}</th>'
        for text, right in zip(headings, numeric, strict=True)
    )
    lines = []
    for row, kind in zip(listed[:limit], kinds, strict=False):
        named = f' class="{kind}"' if kind else ""
        first, *others = (
            (number(cell, digits) if isinstance(cell, float | int) else escape(str(cell)), right)
            for cell, right in zip(row, numeric, strict=True)
        )
        cells = [f'<th scope="row"{_right(first[1])}>{first[0]}</th>']
        cells += [f"<td{_right(right)}>{text}</td>" for text, right in others]
        lines.append(f"<tr{named}>{''.join(cells)}</tr>")
    body = "\n".join(lines)
    return (
        f'<div class="wide"><table>\n<caption>{escape(shown)}</caption>\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>"
    )


def figure(drawing: str, caption: str) -> str:
    """Return a drawing with its caption."""
    return (
        f'<figure>\n<div class="wide">{drawing}</div>\n<figcaption>{escape(caption)}</figcaption>\n</figure>'
    )


def columns(*figures: str) -> str:
    """Return narrow figures beside each other, as many as fit; nothing for none."""
    return '<div class="columns">\n' + "\n".join(figures) + "\n</div>" if figures else ""


def details(summary: str, *parts: str) -> str:
    """Return what is folded away until asked for."""
    body = "\n".join(parts)
    return f"<details>\n<summary>{escape(summary)}</summary>\n{body}\n</details>"


def _right(numeric: bool) -> str:
    return ' class="n"' if numeric else ""
