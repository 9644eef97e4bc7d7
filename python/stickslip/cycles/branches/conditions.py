"""What holds at a bifurcation of periodic orbits: functions of an orbit that vanish on its curve.

The functions are smooth where multipliers collide or pairs become real, so that Newton's method converges
there: products over all multipliers, not one of them (Kuznetsov 2004, chapter 10).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from stickslip.cycles.branches.arclength import Place
from stickslip.cycles.branches.branch import BranchPoint, Kind
from stickslip.cycles.cycle import Cycle
from stickslip.faults import OrbitError
from stickslip.scene.checks import Complex

#: A margin or a duration that is positive while the sequence holds: phase, contact, event, interior.
Key = tuple[Any, ...]
#: Part of the largest margin of an event, or of the longest phase, below which one vanishes.
VANISHES = 1e-8
#: Real multipliers whose sum is this far beyond 2 are no pair on the unit circle any more.
REAL = 2.0


def sequence_tests(cycle: Cycle) -> dict[Key, float]:
    """Return everything that is positive while the sequence holds, by what it belongs to."""
    margins = {(m.phase, m.contact, m.kind, m.interior): m.value for m in cycle.margins()}
    return margins | {(k, None, "duration", False): float(d) for k, d in enumerate(cycle.core.durations)}


def product(cycle: Cycle, target: float) -> float:
    """Return what vanishes where a multiplier is at a real target."""
    # Real, because multipliers come in conjugate pairs.
    return float(np.prod(cycle.transverse_multipliers - target).real)


def products_of_pairs(cycle: Cycle) -> float:
    """Return what vanishes where two multipliers have the product 1 (bialternate product)."""
    return float(np.prod([a * b - 1.0 for a, b in combinations(cycle.transverse_multipliers, 2)]).real)


def vanishing(point: BranchPoint) -> list[Key]:
    """Return the margins and durations that are zero at a change of the sequence.

    Of a grazing it is the least minimum of its event function within a phase. Of two events that meet they
    are the duration between them, if the orbit has a phase of it, and what belongs to it: zero to rounding,
    beside the largest margin of their event.
    """
    tests, grazes = sequence_tests(point.cycle), point.kind == "grazing"
    own = [key for key in tests if (key[1], key[2], key[3]) == (point.contact, point.event, grazes)]
    own = sorted(own, key=lambda key: abs(tests[key]))[:1]
    if grazes:
        return own
    largest: dict[str, float] = {}
    for (_, _, event, _), value in tests.items():
        largest[event] = max(largest.get(event, 0.0), abs(value))
    zero = [key for key, value in tests.items() if abs(value) <= VANISHES * largest[key[2]]]
    return own + [key for key in zero if key not in own]


@dataclass(frozen=True)
class Condition:
    """What vanishes on a curve."""

    #: As of a `BranchPoint`.
    kind: Kind
    #: The margins and durations that vanish where the sequence changes, those of two events that meet all
    #: together; none of the other kinds.
    keys: tuple[Key, ...] = ()
    #: The contact by whose event the sequence changes; None of the other kinds.
    contact: int | None = None

    @classmethod
    def of(cls, point: BranchPoint) -> Condition:
        """Return the condition that holds at a point of a branch.

        Raise `OrbitError` if no event function touches zero in the orbit of a change of the sequence.
        """
        if point.kind not in ("grazing", "switching"):
            return cls(point.kind)
        keys = vanishing(point)
        if not keys:
            raise OrbitError("no event function of the orbit touches zero")
        return cls(point.kind, tuple(keys), point.contact)

    def value(self, place: Place, cycle: Callable[[], Cycle]) -> float:
        """Return what vanishes, of an orbit and the tangent of its branch across the curve."""
        if self.kind == "fold":
            return place.tangent[1]
        if self.kind == "period_doubling":
            return product(cycle(), -1.0)
        if self.kind == "torus":
            return products_of_pairs(cycle())
        tests = sequence_tests(cycle())
        # The duration between two events that meet is a smooth function, the value at the second one another.
        if self.keys[-1] not in tests:
            raise OrbitError("the event function has no minimum within its phase any more")
        return tests[self.keys[-1]]

    def error(self, cycle: Cycle) -> float:
        """Return by how much the condition misses: of a multiplier, or in the unit of the event function."""
        if self.keys:
            return abs(sequence_tests(cycle)[self.keys[-1]])
        own = cycle.transverse_multipliers[self.own(cycle)]
        return float(np.abs(own + 1.0 if self.kind == "period_doubling" else np.abs(own) - 1.0).max())

    def own(self, cycle: Cycle) -> list[int]:
        """Return which of the transverse multipliers are on the unit circle by the condition."""
        multipliers = cycle.transverse_multipliers
        if self.kind == "torus":
            pairs = combinations(range(multipliers.size), 2)
            return list(min(pairs, key=lambda pair: abs(multipliers[list(pair)].prod() - 1.0)))
        if self.keys:
            return []
        return [int(np.argmin(np.abs(multipliers - (1.0 if self.kind == "fold" else -1.0))))]

    def others(self, cycle: Cycle) -> Complex:
        """Return the transverse multipliers that the condition does not concern."""
        others: Complex = np.delete(cycle.transverse_multipliers, self.own(cycle))
        return others

    def outside(self, cycle: Cycle) -> int:
        """Return how many of the others lie outside the unit circle."""
        return int((np.abs(self.others(cycle)) > 1.0).sum())

    def is_resonant(self, cycle: Cycle) -> bool:
        """Return whether a pair on the unit circle has become two real multipliers."""
        return self.kind == "torus" and abs(cycle.transverse_multipliers[self.own(cycle)].sum()) > REAL

    def breaks(self, cycle: Cycle) -> list[Key]:
        """Return the margins and durations, beside those of the condition, that are negative."""
        tests = sequence_tests(cycle).items()
        # In a phase that lasts no time what begins at zero is zero to rounding.
        gone = {phase for phase, _, event, _ in self.keys if event == "duration"}
        return [key for key, value in tests if value < 0.0 and key not in self.keys and key[0] not in gone]
