"""What a result says of itself: facts and tables, without knowing who shows them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field

from stickslip.show import html


@dataclass(frozen=True)
class Table:
    """Rows under headings.

    Parameters
    ----------
    caption
        What the table shows.
    headings
        One per column.
    rows
        Cells, text or numbers; the first column names its row.
    kinds
        A word per row that a rendering may set apart, such as ``unstable``; none: all rows are alike.
    """

    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[object]]
    kinds: Sequence[str] = ()


@dataclass(frozen=True)
class Summary:
    """Facts and tables of a result; printed it is text, in a notebook it is HTML.

    Parameters
    ----------
    facts
        Names and their values.
    tables
        The tables.
    """

    facts: Sequence[tuple[str, str]] = ()
    tables: Sequence[Table] = field(default_factory=tuple)

    def __str__(self) -> str:
        """Return the facts, one per line, and the tables in columns."""
        width = max((len(name) for name, _ in self.facts), default=0)
        parts = ["\n".join(f"{name:<{width}}  {value}" for name, value in self.facts)] if self.facts else []
        return "\n\n".join([*parts, *map(_columns, self.tables)])

    def _repr_html_(self) -> str:
        """Return the facts as a list and every table."""
        parts = [html.facts(self.facts)] if self.facts else []
        for table in self.tables:
            parts.append(html.table(table.caption, table.headings, table.rows, row_kinds=table.kinds))
        return "".join(parts)


class Shown(ABC):
    """A result that says what it is: printed as text, in a notebook as HTML."""

    @abstractmethod
    def summary(self) -> Summary:
        """Return its facts and tables."""

    def _repr_html_(self) -> str:
        return self.summary()._repr_html_()


def _columns(table: Table) -> str:
    numeric = [any(isinstance(row[k], float | int) for row in table.rows) for k in range(len(table.headings))]
    cells = [list(table.headings)]
    cells += [[f"{x + 0.0:.6g}" if isinstance(x, float | int) else str(x) for x in row] for row in table.rows]
    widths = [max(len(row[k]) for row in cells) for k in range(len(table.headings))]
    lines = [
        "  ".join(
            f"{cell:>{width}}" if right else f"{cell:<{width}}"
            for cell, width, right in zip(row, widths, numeric, strict=True)
        ).rstrip()
        for row in cells
    ]
    return "\n".join([table.caption, *lines])
