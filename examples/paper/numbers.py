"""The published numbers, with the digits as printed, and the errata of the publication.

Source: Brunetti, Massi, D'Ambrogio, Berthier, "Dynamic and energy analysis of frictional contact
instabilities on a lumped system" (the paper). Numbers are kept as `Decimal`, so that 112.20 has two decimals.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any


@cache
def published() -> dict[str, Any]:
    """Return the record of published numbers; every number is a `Decimal` with its printed digits."""
    text = Path(__file__).with_name("published.json").read_text(encoding="utf-8")
    record: dict[str, Any] = json.loads(text, parse_float=Decimal, parse_int=Decimal)
    return record


def last_digit(printed: Decimal) -> float:
    """Return one unit of the last printed digit."""
    exponent = printed.as_tuple().exponent
    assert isinstance(exponent, int), "published numbers are finite"
    return float(10.0**exponent)


def agrees(printed: Decimal, computed: float) -> bool:
    """Whether a value differs by less than one unit of the last printed digit; some are truncated."""
    return abs(computed - float(printed)) < last_digit(printed)


@dataclass(frozen=True)
class Misprint:
    """A printed frequency that belongs elsewhere, with the value that the model has there."""

    table: str
    status: str
    #: place in the row, from 0
    column: int
    #: Hz
    model: Decimal
    #: combination whose frequency was printed instead, where it is known
    printed_from: str | None = None


@dataclass(frozen=True)
class Mislabel:
    """A status combination in the printed set of a limit cycle that the model replaces by another."""

    friction: Decimal
    slider_speed: Decimal
    printed: str
    model: str


MISPRINTS = (
    Misprint("Table 2", "s+", 3, Decimal("441.01"), printed_from="s-"),
    Misprint("Table 2", "s+", 4, Decimal("588.20"), printed_from="s-"),
    Misprint("Table 2", "+d", 6, Decimal("588.01")),
)

MISLABELS = (
    Mislabel(Decimal("2.2"), Decimal("0.05"), printed="d+", model="+d"),
    Mislabel(Decimal("2.2"), Decimal("0.3"), printed="+s", model="d+"),
)

#: Table 1 prints k3, k4, k5, k7 and k8 against the matrix of Eq. 21; with the printed labels the undamped
#: frictionless model starts at these natural frequencies, Hz, instead of the published ones.
TABLE_1_FREQUENCIES = (Decimal("44.58"), Decimal("122.60"))


def misprint(table: str, status: str, column: int) -> Misprint | None:
    """Return the erratum of a printed frequency, if it has one."""
    for erratum in MISPRINTS:
        if (erratum.table, erratum.status, erratum.column) == (table, status, column):
            return erratum
    return None


def mislabel(friction: Decimal, slider_speed: Decimal) -> Mislabel | None:
    """Return the erratum of a printed status set, if it has one."""
    for erratum in MISLABELS:
        if (erratum.friction, erratum.slider_speed) == (friction, slider_speed):
            return erratum
    return None
