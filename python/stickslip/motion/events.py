"""What happens in a motion: changes of status, impacts, touches within rounding, ends of bouncing."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from stickslip import _core
from stickslip.scene.checks import Index, Names, Real
from stickslip.show.summary import Summary, Table

#: Events that a table shows.
SHOWN = 12


class Events:
    """Every status change and impact of a run, in order; one entry per contact and instant.

    Each array is made when it is first asked for.
    """

    def __init__(self, core: _core.Trajectory) -> None:
        self._core = core

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("time", "contact", "kind", "combination")}

    @cached_property
    def time(self) -> Real:
        """(e,), s."""
        return self._core.event_time

    @cached_property
    def contact(self) -> Index:
        """Index of the contact, (e,)."""
        return self._core.event_contact

    @cached_property
    def kind(self) -> Names:
        """What happened, (e,).

        One of ``velocity`` (slip velocity reached zero), ``slip+``, ``slip-`` (onset of slip), ``release``,
        ``impact``, ``accumulation``. An impact counts even if the combination stays.
        """
        return np.array(self._core.event_kind, dtype=np.str_)

    @cached_property
    def combination(self) -> Names:
        """The combination after the instant, (e,)."""
        return np.array(self._core.event_combination, dtype=np.str_)

    def __len__(self) -> int:
        return self.time.size

    def __repr__(self) -> str:
        rows = [
            f"  {t:.12f} s  contact {i}  {kind:<9} -> {combination}"
            for t, i, kind, combination in zip(
                self.time[:10], self.contact, self.kind, self.combination, strict=False
            )
        ]
        more = [f"  ... {len(self) - 10} more"] if len(self) > 10 else []
        return "\n".join([f"Events({len(self)})", *rows, *more])

    def summary(self) -> Summary:
        """Return a table of the first events."""
        rows = [
            (f"{t:.12f}", int(contact), str(kind), str(combination))
            for t, contact, kind, combination in zip(
                self.time[:SHOWN], self.contact, self.kind, self.combination, strict=False
            )
        ]
        caption = f"{len(self)} events" + (f", the first {SHOWN}" if len(self) > SHOWN else "")
        headings = ("time, s", "contact", "kind", "combination after")
        return Summary(tables=[Table(caption, headings, rows)])

    def _repr_html_(self) -> str:
        return self.summary()._repr_html_()


class Grazing(NamedTuple):
    """A touch of an event function within rounding: the status was kept, the alternative may be true."""

    #: s
    time: float
    #: index of the contact
    contact: int
    #: kind of the event that was not taken
    alternative: str
    #: the event function at the touch, in its own unit (m/s, N or m)
    value: float
    #: bound on the error of `value`, same unit
    uncertainty: float


class Accumulation(NamedTuple):
    """The limit of a series of bounces, taken instead of the rest of them."""

    #: index of its event
    event: int
    #: bounces left out whose remaining time is at least one ulp of t
    bounces: int
    #: bound of the error of its time, s: the gap's acceleration is taken as constant over the rest; of a
    #: series over several contacts that mass couples, its rest
    error: float
