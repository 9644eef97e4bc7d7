"""Units that suit what is shown: s or ms, m or µm, J or mJ."""

from __future__ import annotations

from collections.abc import Mapping

from stickslip.show.html import number

MICROMETRES = 1e6
#: What rounding may take from a quantity of one unit.
ROUNDING = 1e-9
#: Units of time, length and energy from large to small, by how many of them the SI unit has.
TIMES = {"s": 1.0, "ms": 1e3, "µs": 1e6}
LENGTHS = {"m": 1.0, "mm": 1e3, "µm": MICROMETRES}
ENERGIES = {"J": 1.0, "mJ": 1e3, "µJ": 1e6, "nJ": 1e9}


def suited(largest: float, units: Mapping[str, float]) -> tuple[str, float]:
    """Return the largest unit in which a quantity is 1 or more, and how many of them the SI unit has.

    `largest` is in the SI unit; what is less than 1 in every unit, by more than rounding, has the smallest
    one, and zero the first.
    """
    if largest == 0.0:
        return next(iter(units.items()))
    least = 1.0 - ROUNDING
    found = next((name for name, count in units.items() if abs(largest) * count >= least), [*units][-1])
    return found, units[found]


def measured(value: float, units: Mapping[str, float], digits: int = 6) -> str:
    """Return a quantity, given in the SI unit, as a number and the unit that suits it."""
    unit, count = suited(value, units)
    return f"{number(value * count, digits)} {unit}"
