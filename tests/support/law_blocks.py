"""A block on a belt under friction over slip speed, and the cycle that is born at its Hopf point."""

import numpy as np

import stickslip as ss
from stickslip.scene.laws.friction import FrictionLaw, Stribeck

STRIBECK = Stribeck(0.5, 0.3, 0.1)
#: Steps of differences, m and m/s, for motions of centimetres.
STEPS = (1e-7, 1e-6)
#: Speed of the belt, m/s: ``N (static - kinetic) / speed exp(-v / speed) = c``.
HOPF = 0.1 * np.log(10.0 * 0.2 / 0.1 / 1.0)


def block(speed: float, law: FrictionLaw = STRIBECK, damping: float = 1.0, **given) -> ss.Scene:
    """Return a block of 1 kg, pressed with 10 N on a belt."""
    scene = ss.models.mass_on_belt(friction=law, damping=damping, slider_speed=speed)
    return scene.replace(**given) if given else scene


def small_cycle(speed: float, guess: float = 0.05) -> ss.Cycle:
    """Return the cycle without events near the Hopf point, from a guess of its largest speed."""
    scene = block(speed)
    start = ss.steady_sliding(scene).perturbed(velocity={"x": guess})
    return ss.simulate(scene, 1.5, start).closed_cycle()
