"""The errors that the compiled core raises, by name."""

from stickslip.faults import InputError, NoSteadyStateError, OrbitError
from stickslip.motion.errors import RunError

__all__ = ["InputError", "NoSteadyStateError", "OrbitError", "RunError"]
