"""Rigid rotation, as a velocity field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.scene.checks import Real, described, real_array, real_number


@dataclass(frozen=True)
class Rotation:
    """A velocity field: rigid rotation, ``v = speed axis x (point - centre)`` with a unit axis, m/s.

    Parameters
    ----------
    speed
        rad/s, counterclockwise for one against whom the axis points.
    axis
        Vector of any length along the axis. Of points in the plane it is normal to the plane: ``(0, 0, 1)``
        or, clockwise, ``(0, 0, -1)``.
    centre
        A point of the axis, m; of points in the plane, its third coordinate may be left out.

    Raises
    ------
    InputError
        If a number is not finite, the axis is not three numbers or is zero, or the centre is not two or three
        numbers; where the field is evaluated, if the points do not fit these.
    """

    speed: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        speed = real_number("speed", self.speed)
        if not np.isfinite(speed):
            raise InputError(f"speed: must be finite, got {speed:g}")
        axis, centre = real_array("axis", self.axis, 1), real_array("centre", self.centre, 1)
        if axis.shape != (3,) or not np.isfinite(axis).all() or not axis.any():
            raise InputError(
                f"axis: expected a vector of three numbers that is not zero, got {described(self.axis)}"
            )
        if centre.size not in (2, 3) or not np.isfinite(centre).all():
            raise InputError(f"centre: expected two or three finite numbers, got {described(self.centre)}")
        object.__setattr__(self, "speed", speed)
        object.__setattr__(self, "axis", tuple(axis.tolist()))
        object.__setattr__(self, "centre", tuple(centre.tolist()))

    def __call__(self, points: ArrayLike) -> Real:
        """Return the velocities (k, d), m/s, at points (k, d), m."""
        places = real_array("points", points, 2)
        dimension = places.shape[1]
        if dimension not in (2, 3):
            raise InputError(f"points: expected 2 or 3 coordinates each, got {dimension}")
        if len(self.centre) < dimension:
            raise InputError(f"centre: expected three numbers for points in space, got {self.centre}")
        if dimension == 2 and any(self.axis[:2]):
            raise InputError(
                f"axis: expected (0, 0, 1) or (0, 0, -1) for points in the plane, got {self.axis}"
            )
        # Scaled first, so that no square of a component over- or underflows.
        axis = np.array(self.axis) / np.abs(self.axis).max()
        arm = np.zeros((len(places), 3))
        arm[:, :dimension] = places - np.array(self.centre[:dimension])
        velocity: Real = self.speed * np.cross(axis / np.linalg.norm(axis), arm)[:, :dimension]
        return velocity
