"""What a user can get wrong, and what can stop a run: every error by its name."""

from stickslip.faults import (
    InputError,
    NoSteadySlidingError,
    NoSteadyStateError,
    OrbitError,
    SearchInterrupted,
    StickslipError,
    StoreError,
    StudyError,
    StudyInterrupted,
)
from stickslip.motion.errors import NotPeriodicError, RunError, RunInterrupted

__all__ = [
    "InputError",
    "NoSteadySlidingError",
    "NoSteadyStateError",
    "NotPeriodicError",
    "OrbitError",
    "RunError",
    "RunInterrupted",
    "SearchInterrupted",
    "StickslipError",
    "StoreError",
    "StudyError",
    "StudyInterrupted",
]


def __dir__() -> list[str]:
    return __all__
