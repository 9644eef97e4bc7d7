"""The part of the plane of eigenvalues that a band and a growth range bound, and a contour round it.

The region is ``low <= |lambda| <= high``, ``left <= Re lambda <= right``, mirrored in the real axis as the
spectrum is.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from stickslip.scene.checks import Complex, Real

_Curve: TypeAlias = Callable[[Any], Any]

#: Length of a panel of a contour in distances to where eigenvalues may lie.
_LENGTH = 1.5
#: Share of the distance to the imaginary axis that counts as that to the nearest eigenvalue.
_AWAY = 0.7


@dataclass(frozen=True)
class Region:
    """Bounds of moduli and real parts, 1/s; infinite where there is none."""

    low: float
    high: float
    left: float
    right: float

    def holds(self, values: Complex, margin: float = 0.0) -> np.ndarray:
        """Return which eigenvalues lie in it, (k,); a margin, 1/s, takes more."""
        size = np.abs(values)
        inside: np.ndarray = (
            (size >= self.low - margin)
            & (size <= self.high + margin)
            & (values.real >= self.left - margin)
            & (values.real <= self.right + margin)
        )
        return inside

    def border(self, values: Complex) -> Real:
        """Return the distance of each eigenvalue to the nearest bound, 1/s, (k,)."""
        size = np.abs(values)
        distances = [
            np.abs(size - self.high),
            np.abs(values.real - self.left),
            np.abs(values.real - self.right),
        ]
        if self.low > 0.0:
            distances.append(np.abs(size - self.low))
        nearest: Real = np.min(distances, axis=0)
        return nearest

    def wider(self, width: float) -> Region:
        """Return the region with bounds moved outwards; 0 lies at least `width` between those of growth."""
        low = self.low - width
        return Region(
            low if low > 0.0 else 0.0,
            self.high + width,
            min(self.left, 0.0) - width,
            max(self.right, 0.0) + width,
        )


@dataclass(frozen=True)
class Panel:
    """A piece of a contour: `place` and `slope` of a parameter between two numbers."""

    place: _Curve
    slope: _Curve
    start: float
    stop: float

    def halves(self) -> tuple[Panel, Panel]:
        """Return its two halves."""
        middle = 0.5 * (self.start + self.stop)
        return (
            Panel(self.place, self.slope, self.start, middle),
            Panel(self.place, self.slope, middle, self.stop),
        )

    @property
    def length(self) -> float:
        """Return the length of a piece of a line or an arc, 1/s."""
        return abs((self.stop - self.start) * complex(self.slope(self.start)))

    def ends(self) -> tuple[Complex, Complex]:
        """Return the places of both ends, and dz over the parameter there, (2,) each."""
        both = np.array([self.start, self.stop])
        return self.place(both), self.slope(both)


def contour(region: Region, distance: float) -> list[Panel]:
    """Return panels once round a region counterclockwise: round its upper half, if it contains real numbers.

    Eigenvalues keep a `distance` from its bounds, 1/s: those of a lightly damped structure lie near the
    imaginary axis, and away from it panels become longer.
    """
    low, high = region.low, region.high
    left, right = max(region.left, -high), min(region.right, high)

    def height(radius: float, across: float) -> float:
        return float(np.sqrt(max(radius * radius - across * across, 0.0)))

    def angle(radius: float, across: float) -> float:
        return float(np.arccos(np.clip(across / radius, -1.0, 1.0)))

    def line(across: float) -> tuple[_Curve, _Curve]:
        return (lambda t: across + 1j * np.asarray(t)), (lambda t: np.full(np.shape(t), 1j))

    def arc(radius: float) -> tuple[_Curve, _Curve]:
        return (lambda t: radius * np.exp(1j * np.asarray(t))), (
            lambda t: 1j * radius * np.exp(1j * np.asarray(t))
        )

    pieces = [
        (*line(right), height(low, right), height(high, right)),
        (*arc(high), angle(high, right), angle(high, left)),
        (*line(left), height(high, left), height(low, left)),
    ]
    if low > 0.0:
        pieces.append((*arc(low), angle(low, left), angle(low, right)))
    panels = []
    for place, slope, start, stop in pieces:
        if start == stop:
            continue
        at, rate, sign = start, abs(complex(slope(start))), np.sign(stop - start)

        def length(t: float, place: _Curve = place, rate: float = rate) -> float:
            return _LENGTH * max(distance, _AWAY * abs(complex(place(t)).real)) / rate

        lengths = []
        while (stop - at) * sign > 0.0:
            step = length(at)
            # Where the imaginary axis comes nearer the far end counts.
            while step > length(at + sign * step):
                step *= 0.8
            lengths.append(step)
            at += sign * step
        # The last one is not cut short: all shrink alike.
        ends = start + (stop - start) * np.concatenate([[0.0], np.cumsum(lengths) / np.sum(lengths)])
        panels += [Panel(place, slope, a, b) for a, b in itertools.pairwise(ends)]
    return panels


def is_mirrored(region: Region) -> bool:
    """Return whether the region contains parts of the real axis, so that its contour is half a contour."""
    return not (region.low > 0.0 and max(-region.left, region.right) < region.low)
