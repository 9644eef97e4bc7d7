"""What a user can get wrong, and what can stop a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from stickslip.cycles.basins import Basins
    from stickslip.cycles.bifurcation import Bifurcation
    from stickslip.transient.trajectory import Trajectory


class StickslipError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(StickslipError, ValueError):
    """Ill-posed input; the message names the argument and its value."""


class NoSteadySlidingError(InputError):
    """A scene without steady sliding: a contact would pull, and the static load opens it.

    The message names the contact, its normal force and, where one is found, the combination with open
    contacts
    in which the structure is in equilibrium.
    """


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


class SearchInterrupted(KeyboardInterrupt):
    """A search over many motions that the user interrupted.

    Attributes
    ----------
    partial
        What was found by then: a `Bifurcation` of the values done, or `Basins` with -2 where nothing was
        computed.
    done, of
        How many motions were followed to their end, of how many.
    """

    def __init__(self, partial: Bifurcation | Basins, done: int, of: int) -> None:
        super().__init__(f"interrupted after {done} of {of} motions")
        self.partial = partial
        self.done = done
        self.of = of

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.partial, self.done, self.of)


class OrbitError(RunError):
    """A periodic orbit that Newton's method does not find."""


class NotPeriodicError(RunError):
    """A motion without a limit cycle.

    Attributes
    ----------
    kind
        What it is instead: ``equilibrium``, ``chaotic``, ``quasi-periodic``, ``unsettled`` (its neighbours
        still meet), ``undecided`` (it does not recur, and whether they part is not sure), ``unbounded`` or
        ``stopped``.
    exponent, error
        Largest Lyapunov exponent across the flow and its standard error, 1/s; nan where there is none.
    """

    def __init__(
        self, message: str, partial: Trajectory | None, kind: str, exponent: float, error: float
    ) -> None:
        super().__init__(message, partial)
        self.kind = kind
        self.exponent = exponent
        self.error = error

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.partial, self.kind, self.exponent, self.error)


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
