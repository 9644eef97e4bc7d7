"""Scenes in which an event function dips below zero for a small part of a phase.

Each is `c (1 + cos(w t) / cos(pi part))` over one period: negative for `part` of it about its middle, by
`c (pi part)^2 / 2`; `part` zero is a touch.
"""

import numpy as np

import stickslip as ss

MASS = 1.5


class Dip:
    """One oscillating coordinate, `y'' = rate^2 (middle - y)`, and an event function of it."""

    def __init__(self, scene: ss.Scene, start: ss.State, dof: int, rate: float, middle: float, kind: str):
        self.scene, self.start, self.kind, self.rate, self.middle = scene, start, kind, rate, middle
        self.dof = dof
        self.initial = np.array([start.position[dof], start.velocity[dof]])
        self.period = 2.0 * np.pi / rate

    def shortened(self, factor: float) -> ss.State:
        """Return the start of a swing that is shorter by a factor."""
        centre = np.zeros(self.scene.size)
        centre[self.dof] = self.middle
        position = centre + factor * (self.start.position - centre)
        return ss.State(position, factor * self.start.velocity, self.start.combination)

    def function(self, y, speed):
        """The event function of the peers, from the numbers that the scene has."""
        contact = self.scene.contacts[0]
        match self.kind:
            case "impact":
                return y
            case "velocity":
                return contact.slider_speed - speed
            case _:
                return -self.scene.force[1] + self.scene.stiffness[1, 2] * y


def gap(part: float) -> Dip:
    """A mass in flight that swings down to its stop."""
    stiffness, force = 5e4, 40.0
    contact = ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=0.1, restitution=0.5)
    scene = ss.Scene([MASS, MASS], np.diag([3e4, stiffness]), force=[0.0, force], contacts=[contact])
    middle = force / stiffness
    start = ss.State([0.0, middle + middle / np.cos(np.pi * part)], [0.0, 0.0], "d")
    return Dip(scene, start, 1, np.sqrt(stiffness / MASS), middle, "impact")


def slip(part: float) -> Dip:
    """A mass that swings on a belt, up to the belt's speed."""
    stiffness, friction, load, speed = 3e4, 0.3, 20.0, 0.1
    contact = ss.Contact(tangential=0, normal=1, friction=friction, slider_speed=speed)
    scene = ss.Scene([MASS, MASS], np.diag([stiffness, 5e4]), force=[0.0, -load], contacts=[contact])
    middle = friction * load / stiffness
    start = ss.State([middle, 0.0], [-speed / np.cos(np.pi * part), 0.0], "+")
    return Dip(scene, start, 0, np.sqrt(stiffness / MASS), middle, "velocity")


def normal_force(part: float) -> Dip:
    """A mass at rest on its slider, lifted by the spring to another that swings above it."""
    tie, load = 1e4, 5.0
    contact = ss.Contact(tangential=0, normal=1, friction=0.0, slider_speed=0.1)
    stiffness = np.array([[1e4, 0.0, 0.0], [0.0, 3.0 * tie, -tie], [0.0, -tie, tie]])
    scene = ss.Scene([MASS] * 3, stiffness, force=[0.0, -load, 0.0], contacts=[contact])
    start = ss.State([0.0, 0.0, -load / tie / np.cos(np.pi * part)], [0.0, 0.0, 0.0], "+")
    return Dip(scene, start, 2, np.sqrt(tie / MASS), 0.0, "release")
