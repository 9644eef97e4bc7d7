"""A case of the verification manual: a model that others published, and numbers to compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import mpmath

#: Closed forms are evaluated with 40 digits.
mp: Any = mpmath.MPContext()
mp.dps = 40

#: Relative tolerance where a closed form exists: some thousand roundings of a double.
CLOSED_FORM = 1e-12


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One number of a case.

    Parameters
    ----------
    name, unit
        What it is; "" for a pure number.
    expected
        The closed form, or the number of the reference, in 40 digits.
    computed
        What the program says.
    reference
        Digits that were known before the program computed them: published, or evaluated by others from the
        published model. The closed form must round to them. "": none.
    relative, absolute
        The difference may be as large as the larger of ``relative * abs(expected)`` and ``absolute``.
    """

    name: str
    unit: str
    expected: Any
    computed: float
    reference: str = ""
    relative: float = CLOSED_FORM
    absolute: float = 0.0

    @property
    def difference(self) -> float:
        """Computed less expected, in `unit`."""
        return float(mp.mpf(self.computed) - mp.mpf(self.expected))

    @property
    def allowed(self) -> float:
        """Largest difference that passes, in `unit`."""
        return max(self.relative * abs(float(self.expected)), self.absolute)

    @property
    def agrees(self) -> bool:
        """Whether the computed number lies within the tolerance; nan does not."""
        return abs(self.difference) <= self.allowed

    @property
    def matches_reference(self) -> bool:
        """Whether the expected number lies within one unit of the last digit of the reference."""
        if not self.reference:
            return True
        printed = Decimal(self.reference)
        unit = mp.mpf(10) ** printed.as_tuple().exponent
        return bool(abs(mp.mpf(self.expected) - mp.mpf(self.reference)) <= unit)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A model with its source, and a function that computes its numbers.

    Parameters
    ----------
    title
        Heading on the page.
    source
        Who published it, and where.
    model
        Equations, parameters and start, in Markdown.
    tolerance
        The reason for the tolerances, in Markdown.
    quantities
        Builds the scene, computes with the public interface, and returns what to compare.
    """

    title: str
    source: str
    model: str
    tolerance: str
    quantities: Callable[[], list[Quantity]]


def decimal(value: float) -> Any:
    """Return the decimal number that a parameter was written as, in 40 digits."""
    return mp.mpf(repr(value))
