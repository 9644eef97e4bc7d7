"""What a result says of itself: facts and tables, without knowing who shows them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stickslip.show import html

if TYPE_CHECKING:
    from markupsafe import Markup


@dataclass(frozen=True)
class Table:
    """Rows under headings."""

    caption: str
    #: One per column.
    headings: Sequence[str]
    #: Cells, text or numbers; the first column names its row.
    rows: Sequence[Sequence[object]]
    #: A word per row that a rendering may set apart, such as ``unstable``; none: all rows are alike.
    kinds: Sequence[str] = ()

    def html(self, digits: int = 6) -> Markup:
        """Return it as HTML, numbers to so many significant digits."""
        return html.table(self.caption, self.headings, self.rows, digits=digits, row_kinds=self.kinds)


@dataclass(frozen=True)
class Summary:
    """Facts and tables of a result; printed it is text, in a notebook it is HTML."""

    #: Names and their values.
    facts: Sequence[tuple[str, str]] = ()
    tables: Sequence[Table] = field(default_factory=tuple)

    def __str__(self) -> str:
        """Return the facts, one per line, and the tables in columns."""
        width = max((len(name) for name, _ in self.facts), default=0)
        parts = ["\n".join(f"{name:<{width}}  {value}" for name, value in self.facts)] if self.facts else []
        return "\n\n".join([*parts, *map(_columns, self.tables)])

    def _repr_html_(self) -> str:
        """Return the facts as a list and every table."""
        return "".join([html.facts(self.facts) if self.facts else "", *(one.html() for one in self.tables)])


class Shown(ABC):
    """A result that says what it is: printed as text, in a notebook as HTML."""

    @abstractmethod
    def summary(self) -> Summary:
        """Return its facts and tables."""

    def _repr_html_(self) -> str:
        return self.summary()._repr_html_()


def cell(entry: object) -> str:
    """Return an entry of a table as text; a zero has no sign."""
    return f"{entry + 0.0:.6g}" if isinstance(entry, float | int) else str(entry)


def _columns(table: Table) -> str:
    cells = [list(table.headings), *(list(map(cell, row)) for row in table.rows)]
    columns = [[row[k] for row in cells] for k in range(len(table.headings))]
    lines = zip(*map(_aligned, columns), strict=True)
    return "\n".join([table.caption, *("  ".join(line).rstrip() for line in lines)])


def _aligned(column: list[str]) -> list[str]:
    """Return the cells of a column, the first its heading, as wide as the widest, numbers to the right."""
    width = max(map(len, column))
    numbers = column[1:] and all(map(is_number, filter(None, column[1:])))
    return [f"{text:>{width}}" if numbers else f"{text:<{width}}" for text in column]


def is_number(text: str) -> bool:
    """Return whether a text is a real number."""
    try:
        float(text)
    except ValueError:
        return False
    return True
