"""What can stop a run or a search for what it settles to; each holds the motion computed so far."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.faults import StickslipError, Unfinished

if TYPE_CHECKING:
    from stickslip.motion.motion import Motion


class RunError(Unfinished, StickslipError, RuntimeError):
    """A run that cannot go on.

    Attributes
    ----------
    partial
        The motion computed so far (of a `simulate` it is a `Trajectory`), or None where nothing was computed.
    """

    partial: Motion | None


class NotPeriodicError(RunError):
    """A motion without a limit cycle.

    Attributes
    ----------
    kind
        What the motion is instead: ``equilibrium``, ``chaotic``, ``quasi-periodic``, ``unsettled``
        (neighbouring motions still approach each other), ``undecided`` (the motion does not recur, and it is
        not certain whether neighbouring motions part), ``unbounded`` or ``stopped``.
    exponent, error
        Largest Lyapunov exponent across the flow and its standard error, 1/s; nan where there is none.
    """

    def __init__(
        self, message: str, partial: Motion | None, kind: str, exponent: float, error: float
    ) -> None:
        super().__init__(message, partial)
        self.kind = kind
        self.exponent = exponent
        self.error = error

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.partial, self.kind, self.exponent, self.error)
