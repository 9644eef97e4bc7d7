"""A cycle of one mass as a closed curve in the plane of displacement and velocity, to rounding."""

from __future__ import annotations

from itertools import pairwise
from math import fsum
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.polynomial.chebyshev import chebpts1, chebvander

from stickslip.cycles.cycle import Cycle
from stickslip.faults import OrbitError
from stickslip.scene.checks import Real

#: Degree of the polynomials; a part of a phase whose last coefficients are larger than `TAIL` is halved.
DEGREE = 32
#: Size of the last coefficients, relative to displacement and velocity of the orbit, below which they are
#: rounding.
TAIL = 1e-13
#: Parts of a period at first; a part that was halved so often counts as not smooth.
PARTS, HALVINGS = 8, 20
#: Chebyshev points, and the matrix that makes coefficients of values there.
POINTS = chebpts1(DEGREE + 1)
FIT = chebvander(POINTS, DEGREE).T * np.r_[1.0, np.full(DEGREE, 2.0)][:, None] / (DEGREE + 1)
#: Gauss rule that integrates the square of a polynomial exactly.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(DEGREE + 1)


class _Part(NamedTuple):
    """A part of the period over which the motion is smooth: Chebyshev series over time, s."""

    position: Chebyshev
    velocity: Chebyshev

    def times(self, *crossings: tuple[Chebyshev, float]) -> Real:
        """Return both ends and the times at which a series crosses a value, ascending, s."""
        begin, end = self.position.domain
        found = [np.array([begin, end])]
        for series, value in crossings:
            # Where the value lies beyond what the coefficients sum to, the series does not reach it.
            if abs(series.coef[0] - value) <= 1.001 * np.abs(series.coef[1:]).sum():
                roots = (series - value).trim(np.finfo(float).eps * abs(value)).roots()
                real = roots.real[np.abs(roots.imag) <= 1e-6 * (end - begin)]
                found.append(real[(real > begin) & (real < end)])
        return np.sort(np.concatenate(found))


class OrbitCurve:
    """The closed curve of a cycle; it runs clockwise where x' points up.

    Every phase is a real analytic function of time. It is represented by Chebyshev series of degree 32 over
    parts so short that their last coefficients are rounding (Trefethen, Approximation Theory and
    Approximation Practice, ch. 8), so that crossings are eigenvalues and areas are exact sums.

    Raise `OrbitError` if the motion is not smooth within a phase.
    """

    def __init__(self, cycle: Cycle) -> None:
        scale = max(abs(cycle.core.minimum[0]), abs(cycle.core.maximum[0]))
        scales = np.array([[scale], [2.0 * np.pi * scale / cycle.period]])
        waiting = []
        for phase in cycle.phases:
            count = int(np.ceil(PARTS * phase.duration / cycle.period))
            ends = phase.start + phase.duration * np.linspace(0.0, 1.0, count + 1)
            waiting += [(begin, end, 0) for begin, end in pairwise(ends)]
        waiting.reverse()
        parts: list[_Part] = []
        while waiting:
            begin, end, halved = waiting.pop()
            middle = 0.5 * (begin + end)
            position, velocity, *_ = cycle.run.core.sample(middle + 0.5 * (end - begin) * POINTS)
            series = FIT @ position[:, 0], FIT @ velocity[:, 0]
            if (np.abs([one[-3:] for one in series]) <= TAIL * scales).all():
                parts.append(_Part(*(Chebyshev(one, [begin, end]) for one in series)))
            elif halved < HALVINGS:
                waiting += [(middle, end, halved + 1), (begin, middle, halved + 1)]
            else:
                raise OrbitError(f"the cycle is not smooth from {begin:g} s to {end:g} s")
        self._parts = tuple(parts)

    def encloses(self, position: float, velocity: float) -> bool:
        """Return whether a point, m and m/s, lies within: an odd number of crossings lies above it."""
        times, right, above = [], [], []
        for part in self._parts:
            cuts = part.times((part.position, position))
            # The side of each stretch counts, not the number of roots: one at a joint may be found twice.
            for begin, end in pairwise(cuts):
                if end > begin:
                    times.append(end)
                    above.append(part.velocity(end) > velocity)
                    right.append(part.position(0.5 * (begin + end)) > position)
        crossed = np.array(right) != np.roll(right, -1)
        return bool(np.count_nonzero(crossed & np.array(above)) % 2)

    def area(self, low: tuple[float, float], high: tuple[float, float]) -> float:
        """Return the enclosed area that lies within a rectangle, m^2/s.

        It is the integral of ``clip(x', low, high) x'`` over the time in which x lies in the rectangle
        (Green's theorem).

        Parameters
        ----------
        low, high
            Least and largest displacement and velocity of the rectangle, m and m/s.
        """
        terms = []
        for part in self._parts:
            position, velocity = part
            cuts = part.times(
                *((position, bound) for bound in (low[0], high[0])),
                *((velocity, bound) for bound in (low[1], high[1])),
            )
            for begin, end in pairwise(cuts):
                half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
                if low[0] <= position(middle) <= high[0]:
                    v = velocity(middle + half * NODES)
                    terms.append(half * float(WEIGHTS @ (np.clip(v, low[1], high[1]) * v)))
        return fsum(terms)
