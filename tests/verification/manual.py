"""The page of the verification manual; `python -m verification.manual` writes it to docs/verification.md."""

import re
import sys
import textwrap
from pathlib import Path

from verification import CASES
from verification.case import mp

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"
COLUMNS = ("quantity", "unit", "reference", "expected", "computed", "difference", "relative", "tolerance")
#: Columns that depend on the machine's rounding.
ROUNDED = slice(4, 7)

INTRODUCTION = """\
# Verification

Models that others published, with what they or a closed form say, beside what the program computes.

- *Reference*: digits that were known before the program computed them, published with the model or evaluated
  independently from it.
- *Expected*: the closed form, evaluated with 40 digits, or the reference itself where there is none. The
  closed form lies within one unit of the last digit of the reference.
- *Difference*: computed less expected, in the unit of the quantity; *relative* to the expected value.
- *Tolerance*: the largest absolute difference that passes.

`make verify` writes this page, and fails if a number leaves its tolerance. The tests run every case on every
platform; the last digits of the computed numbers and the differences are those of the machine that wrote the
page. Each closed form is derived in the file of its case in `tests/verification`.
"""


def page(results):
    """Return the page for pairs of a case and its quantities."""
    return "\n".join([INTRODUCTION, *(section(case, quantities) for case, quantities in results)])


def section(case, quantities):
    """Return the part of the page about one case."""
    rows = [COLUMNS, ("---",) * len(COLUMNS), *map(cells, quantities)]
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    parts = [f"## {case.title}", f"*Source.* {case.source}", f"*Model.* {case.model}"]
    parts = [*map(wrapped, parts), table, wrapped(f"*Tolerance.* {case.tolerance}")]
    return "\n\n".join(parts) + "\n"


def wrapped(text):
    """Return text in lines as long as those of the other pages; formulas and `a = 1` stay in one line."""
    kept = re.sub(r"`[^`]*`| = \S+", lambda match: match.group().replace(" ", "\0"), text)
    return textwrap.fill(kept, 120, break_long_words=False, break_on_hyphens=False).replace("\0", " ")


def cells(quantity):
    """Return the row of a quantity."""
    relative = quantity.difference / float(quantity.expected) if quantity.expected else 0.0
    return (
        quantity.name,
        quantity.unit,
        quantity.reference,
        number(quantity.expected),
        number(quantity.computed, digits=17),
        small(quantity.difference),
        small(relative) if quantity.expected else "",
        "exact" if isinstance(quantity.expected, int) and not quantity.absolute else small(quantity.allowed),
    )


def number(value, digits=15):
    """Return a number with so many significant digits; integers as they are."""
    return str(value) if isinstance(value, int) else str(mp.nstr(mp.mpf(value), digits))


def small(value):
    """Return the size of a difference."""
    return f"{value:.1e}" if value else "0"


def masked(text):
    """Return a page without what depends on rounding, and the cells taken out of it, row by row."""
    taken = []

    def replaced(match):
        row = match.group(0).strip("| ").split(" | ")
        taken.append(row[ROUNDED])
        row[ROUNDED] = ["..."] * len(row[ROUNDED])
        return f"| {' | '.join(row)} |"

    return re.sub(r"^\| (?!quantity |---).*\|$", replaced, text, flags=re.MULTILINE), taken


def main():
    """Write the page; name what leaves its tolerance."""
    results = [(case, case.quantities()) for case in CASES]
    PAGE.write_text(page(results), encoding="utf-8", newline="\n")
    wrong = [
        f"{case.title}: {quantity.name}: expected {number(quantity.expected)}, computed {quantity.computed!r}"
        for case, quantities in results
        for quantity in quantities
        if not (quantity.agrees and quantity.matches_reference)
    ]
    sys.exit("\n".join(wrong) or None)


if __name__ == "__main__":
    main()
