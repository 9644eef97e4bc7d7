"""Rigid rotation, as a velocity field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Real, real_number


@dataclass(frozen=True)
class Rotation:
    """A velocity field: rigid rotation, ``v = speed axis x (point - centre)``, m/s.

    Parameters
    ----------
    speed
        rad/s, counterclockwise about the axis.
    axis
        Vector of any length along the axis; in the plane it has no effect.
    centre
        A point of the axis, m.
    """

    speed: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)

    def __call__(self, points: Real) -> Real:
        """Return the velocities (k, d) at points (k, d)."""
        dimension = points.shape[1]
        axis = np.asarray(self.axis, dtype=float)
        length = np.linalg.norm(axis)
        if axis.shape != (3,) or not 0.0 < length < np.inf:
            raise InputError(f"axis: expected a vector of three numbers that is not zero, got {self.axis!r}")
        arm = np.zeros((len(points), 3))
        arm[:, :dimension] = points - np.asarray(self.centre, dtype=float)[:dimension]
        velocity: Real = real_number("speed", self.speed) * np.cross(axis / length, arm)[:, :dimension]
        return velocity
