"""How well the eigenvalues of a reduced scene agree with those of the full one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from stickslip.scene.checks import Complex, Real

#: Relative distance up to which an eigenvalue of the reduced scene can stand for one of the full scene.
COUNTERPART = 0.05
#: Damping ratio below which the error of a growth rate is relative to the growth rate of this ratio.
LEAST_RATIO = 1e-4
#: Growth rates up to this part of |lambda| are rounding, as those of undamped modes.
NEUTRAL = 1e-10
#: What an eigenvalue without counterpart counts, in tolerances.
LOST = 1e9
#: Eigenvalues up to this part of the largest one are compared with this part: they can be zero.
ZERO = 1e-9


@dataclass(frozen=True, eq=False)
class Agreement:
    """Eigenvalues of a band of the full scene, those that stand for them, and those that stand for none."""

    #: (m,), 1/s
    full: Complex
    #: (m,), 1/s; nan where none is within the relative distance `COUNTERPART`
    reduced: Complex
    #: ``| |lambda_r| - |lambda| | / |lambda|``, (m,); infinite without counterpart
    frequency: Real
    #: ``|Re lambda_r - Re lambda| / max(|Re lambda|, LEAST_RATIO |lambda|)``, (m,)
    growth: Real
    #: Eigenvalues of the reduced scene inside the band that stand for none of the full scene, 1/s
    spurious: Complex
    #: Eigenvalues of the reduced scene outside the band that grow, 1/s
    outside: Complex

    def excess(self, tolerance: float, growth_tolerance: float) -> float:
        """Return the largest ratio of an error and its tolerance.

        Eigenvalues of which only one of the two scenes has a counterpart count `LOST` each.
        """
        lost = self.spurious.size + np.count_nonzero(np.isinf(self.frequency))
        if lost:
            return LOST * lost
        return float(max(self.frequency.max() / tolerance, self.growth.max() / growth_tolerance))

    def lacking(self, tolerance: float, growth_tolerance: float) -> str:
        """Return in words what exceeds its tolerance most."""
        if np.isinf(self.frequency).any():
            return f"{self._mode(int(self.frequency.argmax()))} without counterpart"
        if self.spurious.size:
            return f"the spurious eigenvalue {shown(self.spurious[0])}"
        if self._off_frequency(tolerance, growth_tolerance):
            errors, what = self.frequency, "frequency"
        else:
            errors, what = self.growth, "growth rate"
        worst = int(errors.argmax())
        return f"an error of {errors[worst]:.2g} in the {what} of {self._mode(worst)}"

    def unmet(self, tolerance: float, growth_tolerance: float) -> str:
        """Return name and value of the tolerance that is exceeded most."""
        if self._off_frequency(tolerance, growth_tolerance):
            return f"tolerance: {tolerance:g}"
        return f"growth_tolerance: {growth_tolerance:g}"

    def attainable(self, tolerance: float, growth_tolerance: float) -> str:
        """Return in words the tolerances that would have to be larger, and from what on they hold."""
        if np.isinf(self.frequency).any() or self.spurious.size:
            return "a larger tolerance"
        found = (
            ("tolerance", float(self.frequency.max()), tolerance),
            ("growth_tolerance", float(self.growth.max()), growth_tolerance),
        )
        exceeded = [f"{name}={_not_below(error)}" for name, error, asked in found if error > asked]
        return " and ".join(exceeded)

    def _off_frequency(self, tolerance: float, growth_tolerance: float) -> bool:
        if self.spurious.size or np.isinf(self.frequency).any():
            return True
        return bool(self.frequency.max() / tolerance > self.growth.max() / growth_tolerance)

    def _mode(self, number: int) -> str:
        return f"mode {number} at {shown(self.full[number])}"

    def remarks(self) -> list[str]:
        """Return a sentence for each mode that one of the two scenes lacks or that grows in one alone.

        Errors of frequencies say little of growth rates.
        """
        told = [
            f"{self._mode(k)} has no counterpart in the reduced scene; take more modes"
            for k in np.flatnonzero(np.isinf(self.frequency)).tolist()
        ]
        told += [
            f"the reduced scene has a spurious eigenvalue, {shown(value)}; take more modes"
            for value in self.spurious.tolist()
        ]
        least = NEUTRAL * np.abs(self.full)
        changed = (self.full.real > least) != (self.reduced.real > least)
        return told + [
            f"mode {k} at {abs(self.full[k]) / (2.0 * np.pi):.5g} Hz has the growth rate "
            f"{self.full[k].real:.3g} 1/s in the full scene and {self.reduced[k].real:.3g} 1/s in the "
            "reduced one; take more modes, a smaller tolerance or another boundary"
            for k in np.flatnonzero(changed & np.isfinite(self.frequency)).tolist()
        ]


def _not_below(value: float) -> str:
    """Return a tolerance of at least this value in two digits, or None: an error of 1 says nothing."""
    digit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    rounded = float(np.ceil(value / digit * (1.0 + 1e-9)) * digit)
    return f"{rounded:.2g}" if rounded < 1.0 else "None"


def shown(value: complex) -> str:
    """Return frequency and growth rate of an eigenvalue."""
    return f"{abs(value) / (2.0 * np.pi):.5g} Hz with the growth rate {value.real:.3g} 1/s"


def moves_on(values: Complex) -> NDArray[np.bool_]:
    """Return which eigenvalues oscillate or grow: the others have no frequency and decay without a trace.

    Friction across the sliding makes one or two of them for each contact.
    """
    kept: NDArray[np.bool_] = (values.imag != 0.0) | (values.real > 0.0)
    return kept


def compared(full: Complex, offered: Complex, band: Real, tolerance: float) -> Agreement:
    """Return how eigenvalues of a reduced scene agree with those of a band, Hz, of the full one.

    Both are of the upper half plane; those of the reduced scene count that oscillate or grow. Pairs are those
    with the least sum of relative distances. An eigenvalue that is nearer to an end of the band than the
    accuracy of frequencies can belong to a mode outside the band, and is not called spurious.
    """
    offered = offered[moves_on(offered)]
    sizes = np.abs(full)
    sizes = np.maximum(sizes, ZERO * sizes.max())
    distance = np.abs(full[:, None] - offered[None, :]) / sizes[:, None]
    rows, columns = linear_sum_assignment(np.minimum(distance, 1.0))
    near = distance[rows, columns] <= max(COUNTERPART, tolerance)
    rows, columns = rows[near], columns[near]
    reduced = np.full(full.size, complex(np.nan, np.nan))
    reduced[rows] = offered[columns]
    frequency, growth = np.full(full.size, np.inf), np.full(full.size, np.inf)
    frequency[rows] = np.abs(np.abs(reduced[rows]) - np.abs(full[rows])) / sizes[rows]
    growth[rows] = np.abs(reduced[rows].real - full[rows].real) / np.maximum(
        np.abs(full[rows].real), LEAST_RATIO * sizes[rows]
    )
    edge = max(tolerance, frequency[rows].max(initial=0.0))
    rest = np.delete(offered, columns)
    rates = np.abs(rest) / (2.0 * np.pi)
    grows = rest.real > NEUTRAL * np.abs(rest)
    return Agreement(
        full,
        reduced,
        frequency,
        growth,
        spurious=rest[(rates > band[0] * (1.0 + edge)) & (rates < band[1] * (1.0 - edge))],
        outside=rest[grows & ((rates < band[0]) | (rates > band[1]))],
    )
