"""What a user can get wrong, and what can stop a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.transient import Trajectory


class StickslipError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(StickslipError, ValueError):
    """Ill-posed input; the message names the argument and its value."""


class RunError(StickslipError, RuntimeError):
    """A run that cannot go on.

    Attributes
    ----------
    partial
        The motion computed so far, a `Trajectory`, or None where nothing was computed.
    """

    def __init__(self, message: str, partial: Trajectory | None = None) -> None:
        super().__init__(message)
        self.partial = partial

    # An exception is otherwise made again from its message alone.
    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.partial)


class RunInterrupted(KeyboardInterrupt):
    """A run that the user interrupted; `partial` is the motion computed so far, a `Trajectory`."""

    def __init__(self, partial: Trajectory) -> None:
        super().__init__(f"interrupted after {partial.duration:g} s of motion")
        self.partial = partial

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.partial,)


class OrbitError(RunError):
    """A periodic orbit that Newton's method does not find."""


class NotPeriodicError(RunError):
    """A motion without a limit cycle.

    Attributes
    ----------
    kind
        What it is instead: ``equilibrium``, ``chaotic``, ``quasi-periodic``, ``unsettled``, ``unbounded`` or
        ``stopped``.
    exponent
        Largest Lyapunov exponent across the flow, 1/s; nan where there is none to measure.
    """

    def __init__(self, message: str, partial: Trajectory | None, kind: str, exponent: float) -> None:
        super().__init__(message, partial)
        self.kind = kind
        self.exponent = exponent

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.partial, self.kind, self.exponent)


class StoreError(StickslipError, RuntimeError):
    """A store of results that holds another study, or that another process writes to."""


class StudyError(StickslipError, RuntimeError):
    """A study that could not go on.

    Attributes
    ----------
    partial
        Everything computed so far, an `xarray.Dataset`; the status of other samples is ``pending``.
    """

    def __init__(self, message: str, partial: xr.Dataset) -> None:
        super().__init__(message)
        self.partial = partial

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.partial)


class StudyInterrupted(KeyboardInterrupt):
    """A study that the user interrupted; `partial` is everything computed so far, an `xarray.Dataset`."""

    def __init__(self, message: str, partial: xr.Dataset) -> None:
        super().__init__(message)
        self.partial = partial

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.partial)
