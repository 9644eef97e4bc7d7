"""What a user can get wrong, and what can stop a search or a study: the errors that hold no motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr


class StickslipError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(StickslipError, ValueError):
    """Ill-posed input; the message names the argument and its value."""


class NoSteadySlidingError(InputError):
    """A scene has no steady sliding: a contact would have to pull, so the static load opens it.

    The message names the contact, its normal force and, where one is found, the combination with open
    contacts in which the structure is in equilibrium.
    """


class NoSteadyStateError(InputError):
    """A combination has no steady state about which motions are linear, and so no modes.

    One contact slides by a law of friction over slip speed while another one sticks.
    """


class SearchInterrupted(KeyboardInterrupt):
    """A search over many motions that the user interrupted.

    Attributes
    ----------
    partial
        What the search had found by then: a `Bifurcation` of the values that were done, a `FrequencyResponse`
        of the orbits found, or `Basins` with -2 where nothing was computed.
    done, of
        Number of motions that were followed to their end, and number of all motions.
    """

    def __init__(self, partial: Any, done: int, of: int) -> None:
        super().__init__(f"interrupted after {done} of {of} motions")
        self.partial = partial
        self.done = done
        self.of = of

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.partial, self.done, self.of)


class OrbitError(StickslipError, RuntimeError):
    """A periodic orbit that Newton's method does not find."""


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
