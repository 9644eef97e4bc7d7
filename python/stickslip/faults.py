"""What a user can get wrong, and what can stop a search or a study: the errors that hold no motion."""

from __future__ import annotations

from typing import Any


class StickslipError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(StickslipError, ValueError):
    """Ill-posed input; the message names the argument and its value."""


class NoSteadyStateError(InputError):
    """There is no steady state about which motions are linear, and so there are no modes.

    In steady sliding a contact would have to pull, so that the static load opens it: the message names the
    contact, its normal force and, where one is found, the combination with open contacts in which the
    structure is in equilibrium. Or one contact of a combination slides by a law of friction over slip speed
    while another one sticks.
    """


class Unfinished(BaseException):
    """An error that holds what had been computed by then, also once it is pickled."""

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial

    # An exception is otherwise made again from its message alone.
    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.partial)


class Interrupted(Unfinished, KeyboardInterrupt):
    """A run, a search or a study that the user interrupted.

    Attributes
    ----------
    partial
        What had been computed by then: the `Trajectory` of a run, the last stretch of a search for a limit
        cycle, the `Bifurcation` of the values that were done, a `FrequencyResponse` of the orbits found, the
        `Branch` of a nonlinear mode, `Basins` with -2 where nothing was computed, a `StabilityBoundary` with
        the curves found, or the dataset of a study.
    """


class OrbitError(Unfinished, StickslipError, RuntimeError):
    """A periodic orbit that Newton's method does not find.

    Attributes
    ----------
    partial
        The `Branch` of the orbits that `nonlinear_mode` had found before; None of other calls.
    """


class StudyError(Unfinished, StickslipError, RuntimeError):
    """A study that could not go on.

    Attributes
    ----------
    partial
        Everything computed so far, an `xarray.Dataset`; the status of other samples is ``pending``.
    """
