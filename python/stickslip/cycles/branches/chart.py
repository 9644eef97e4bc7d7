"""Orbits over two parameters around one of them, and steps along a curve on which a condition holds.

The orbits of a scene over two parameters form a surface. Around an orbit its points have the coordinates
``(a, c)``: the parameters move by c along the curve that is followed, and the orbit lies a length a along its
branch over the parameter across the curve (pseudo-arclength). The surface is regular in these at folds and
cusps of its projection on the parameters. A curve is then one equation in two unknowns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stickslip.cycles.branches.arclength import NEARLY, ROUNDING, Curve, Place
from stickslip.cycles.branches.conditions import Condition
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, OrbitError
from stickslip.scene.checks import Real
from stickslip.scene.parameters.family import Family
from stickslip.scene.scene import Scene

#: Half the distance by which slopes are differenced: their error is its square, and 1e-12 over it.
DIFFERENCE = 1e-5
#: Steps of the secant method.
SECANTS = 12
#: A way across the curve that is longer than this leads to another one.
ASIDE = 0.2


@dataclass(frozen=True)
class Plane:
    """The scenes over two parameters, as parts of their ranges."""

    family: Family
    ranges: Mapping[str, tuple[float, float]]
    fixed: Mapping[str, float]

    def values(self, at: Real) -> dict[str, float]:
        """Return the parameters at a point of the unit square."""
        ends = zip(self.ranges.items(), at, strict=True)
        return {name: float((1.0 - part) * low + part * high) for (name, (low, high)), part in ends}

    def parts(self, values: Mapping[str, float]) -> Real:
        """Return the point of the unit square at which the parameters have these values."""
        ranges = self.ranges.items()
        return np.array([(values[name] - low) / (high - low) for name, (low, high) in ranges])

    def scene(self, at: Real) -> Scene:
        """Return the scene at a point of the unit square, or a little outside.

        Raise `OrbitError` if there is none.
        """
        try:
            return self.family.scene({**self.fixed, **self.values(at)})
        except InputError as error:
            raise OrbitError(str(error)) from error


@dataclass(frozen=True, eq=False)
class Spot:
    """An orbit near a curve: its point of the unit square, and what vanishes on the curve."""

    plane: Plane
    condition: Condition
    at: Real
    place: Place

    @cached_property
    def cycle(self) -> Cycle:
        """The orbit."""
        return Cycle(self.plane.scene(self.at), self.place.orbit.cycle())

    @cached_property
    def value(self) -> float:
        """What vanishes on the curve."""
        return self.condition.value(self.place, lambda: self.cycle)


@dataclass(frozen=True, eq=False)
class Motion:
    """How a point of a curve moves: direction in (a, c), and velocity in the unit square."""

    direction: Real
    velocity: Real


@dataclass(frozen=True, eq=False)
class Chart:
    """Coordinates around an orbit: a unit vector along the curve in the unit square, the branch across."""

    spot: Spot
    along: Real
    place: Place

    @property
    def across(self) -> Real:
        """Unit vector in which the parameter of the branch through the orbit grows."""
        return np.array([self.along[1], -self.along[0]])

    @classmethod
    def at(cls, spot: Spot, along: Real) -> Chart:
        """Return the coordinates around an orbit, from the tangent of a branch in nearly that direction."""
        chart = cls(spot, along, spot.place)
        orbit, tangent = spot.place.orbit, spot.place.tangent
        return replace(chart, place=Place(orbit, 0.0, orbit.tangent(*chart.branch(0.0).sides(0.0), tangent)))

    def branch(self, c: float) -> Curve:
        """Return the scenes across, c along."""
        spot = self.spot
        return Curve(lambda r: spot.plane.scene(spot.at + c * self.along + r * self.across), 1.0)

    def orbit(self, point: Real) -> Spot:
        """Return the orbit with some coordinates (a, c).

        Raise `OrbitError` if Newton's method does not find it.
        """
        a, c = map(float, point)
        place = self.branch(c).solution(self.place, a)
        at = self.spot.at + c * self.along + place.value * self.across
        return Spot(self.spot.plane, self.spot.condition, at, place)

    def slopes(self, point: Real) -> tuple[Real, Real]:
        """Return the derivatives to (a, c) of what vanishes (2,), and of the unit square, (2, 2)."""
        sides = [
            (self.orbit(point + DIFFERENCE * step), self.orbit(point - DIFFERENCE * step))
            for step in np.eye(2)
        ]
        values = [(above.value - below.value) / (2.0 * DIFFERENCE) for above, below in sides]
        places = [(above.at - below.at) / (2.0 * DIFFERENCE) for above, below in sides]
        return np.array(values), np.array(places).T

    def motion(self, point: Real, before: Real) -> Motion:
        """Return how the curve goes on at a point of it, on the side of a direction before."""
        slope, places = self.slopes(point)
        direction = np.array([-slope[1], slope[0]])
        size = np.linalg.norm(direction)
        if not 0.0 < size < np.inf:
            raise OrbitError("the condition has no slope: two curves cross")
        direction /= size * np.sign(direction @ before or 1.0)
        return Motion(direction, places @ direction)

    def corrected(self, start: Real, direction: Real) -> tuple[Real, Spot]:
        """Return the point of the curve across a direction from a point, by the secant method.

        Raise `OrbitError` if there is none near.
        """
        aside = np.array([-direction[1], direction[0]])
        spot, z, step, last = self.orbit(start), 0.0, DIFFERENCE, np.inf
        for _ in range(SECANTS):
            z += step
            after = self.orbit(start + z * aside)
            change = after.value - spot.value
            stops = last <= NEARLY and abs(step) >= 0.5 * last
            if after.value == 0.0 or abs(step) <= ROUNDING or stops:
                return start + z * aside, after
            if change == 0.0:
                break
            spot, last, step = after, abs(step), -after.value * step / change
            if not abs(z + step) <= ASIDE:
                break
        raise OrbitError("the condition is not met near")
