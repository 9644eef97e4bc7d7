"""What happens in a motion: changes of status, impacts, touches within rounding, ends of bouncing."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import cycle
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np

from stickslip import _core
from stickslip.scene.checks import Index, Names, Real
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

#: Events that a table shows.
SHOWN = 12
#: What happens at an event of a kind.
KINDS = {
    "velocity": "the slip velocity reaches zero",
    "slip+": "sticking ends, positive sliding begins",
    "slip-": "sticking ends, negative sliding begins",
    "slip": "sticking in a plane ends, slip begins",
    "release": "the contact opens",
    "impact": "the contact closes",
    "accumulation": "infinitely many bounces end",
    "closing": "a contact without mass closes; nothing bounces",
    "jump": "sticking of a contact without mass ends, and falling friction moves it at once",
    "load": "a load is switched",
    "turn": "the place of a sliding contact turns back along its slider",
    "exhausted": "friction that falls with slip speed reaches zero, which ends the run",
}


#: The name of what no contact did.
LOAD = "load"


def labelled(labels: Sequence[int | str] | Names | Index, contacts: Index) -> Index | Names:
    """Return the labels of contacts, ``load`` for -1."""
    if contacts.size and contacts.min() < 0:
        return np.array([*map(str, labels), LOAD])[contacts]
    return np.array(labels)[contacts]


class Event(NamedTuple):
    """What happened to one contact at one instant."""

    #: s
    time: float
    #: index of the contact; -1 where a load was switched
    contact: int
    #: see `Events.kind`
    kind: str
    #: the combination after the instant
    combination: str
    #: name of the contact, its index where contacts have no names; ``load`` where a load was switched
    name: str

    def __str__(self) -> str:
        """Return the event as a line of text."""
        what = "load switched" if self.contact < 0 else f"contact {self.name}  {self.kind:<9}"
        return f"{self.time:.12f} s  {what} -> {self.combination}"


class Events(Sequence[Event], Shown):
    """Every status change and impact of a run, in order; one entry per contact and instant.

    A sequence of `Event`; the same by columns are the arrays `time`, `contact`, `kind` and `combination`,
    each made when it is first asked for.
    """

    def __init__(self, core: _core.Trajectory, labels: Sequence[int | str]) -> None:
        self._core = core
        self._labels = tuple(labels)

    def __getstate__(self) -> dict[str, Any]:
        columns = {name: getattr(self, name) for name in ("time", "contact", "kind", "combination")}
        return {**columns, "_labels": self._labels}

    @cached_property
    def time(self) -> Real:
        """(e,), s."""
        return self._core.event_time

    @cached_property
    def contact(self) -> Index:
        """Index of the contact, (e,); -1 where a load was switched."""
        return self._core.event_contact

    @cached_property
    def kind(self) -> Names:
        """What happened, (e,).

        One of ``velocity`` (slip velocity reached zero), ``slip+``, ``slip-``, and in a plane ``slip`` (onset
        of slip), ``release``, ``impact``, ``accumulation``, and ``load`` (a load was switched, of no
        contact). An impact counts even if the combination stays. Of friction in a plane an event counts
        once, at the contact along the first direction.
        """
        return np.array(self._core.event_kind, dtype=np.str_)

    @cached_property
    def combination(self) -> Names:
        """The combination after the instant, (e,)."""
        return np.array(self._core.event_combination, dtype=np.str_)

    def __len__(self) -> int:
        return self.time.size

    @overload
    def __getitem__(self, place: int) -> Event: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[Event, ...]: ...
    def __getitem__(self, place: int | slice) -> Event | tuple[Event, ...]:
        """Return an event, or those of a slice."""
        if isinstance(place, slice):
            return tuple(self[k] for k in range(*place.indices(len(self))))
        contact = int(self.contact[place])
        return Event(
            float(self.time[place]),
            contact,
            str(self.kind[place]),
            str(self.combination[place]),
            self._name(contact),
        )

    def _name(self, contact: int) -> str:
        return LOAD if contact < 0 else str(self._labels[contact])

    def to_dataset(self) -> xr.Dataset:
        """Return the columns over ``event``: ``time`` s, ``contact`` by name, ``kind``, ``combination``."""
        import xarray as xr

        return xr.Dataset(
            {
                "time": ("event", self.time, {"units": "s"}),
                "contact": ("event", labelled(self._labels, self.contact)),
                "kind": ("event", self.kind),
                "combination": ("event", self.combination),
            },
            coords={"event": np.arange(len(self))},
        )

    def to_dataframe(self) -> pd.DataFrame:
        """Return a `pandas.DataFrame` with the columns of `to_dataset`, one row per event."""
        return self.to_dataset().to_dataframe()

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw events over time, a row for each contact, in it a lane for each kind; return the Axes.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.show.plots import axes_of
        from stickslip.show.style import COLOURS, CONTACT

        axes = axes_of(ax)
        own = self.kind != LOAD
        for time in self.time[~own]:
            axes.axvline(time, color="0.7", linewidth=0.8)
        kinds = list(dict.fromkeys(self.kind[own].tolist()))
        lane = 0.8 / max(len(kinds), 1)
        for k, (kind, colour) in enumerate(zip(kinds, cycle((*COLOURS.values(), *CONTACT)), strict=False)):
            chosen = self.kind == kind
            above = self.contact[chosen] - 0.4 + k * lane
            axes.vlines(self.time[chosen], above, above + 0.8 * lane, color=colour, linewidth=0.8, label=kind)
        labels = [f"contact {label}" for label in self._labels]
        axes.set(xlabel="time, s", yticks=range(len(labels)), yticklabels=labels)
        # The first kind of the legend has the uppermost lane.
        axes.set_ylim(max(len(labels), 1) - 0.5, -0.5)
        if own.any():
            axes.legend(frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return axes

    def __repr__(self) -> str:
        rows = [f"  {event}" for event in self[:10]]
        more = [f"  ... {len(self) - 10} more"] if len(self) > 10 else []
        return "\n".join([f"Events({len(self)})", *rows, *more])

    def summary(self) -> Summary:
        """Return a table of the last events, and what their kinds mean."""
        first = max(0, len(self) - SHOWN)
        rows = [(f"{one.time:.12f}", one.name, one.kind, one.combination) for one in self[first:]]
        caption = f"Events {first + 1} to {len(self)}" if first else "Events"
        headings = ("time, s", "contact", "kind", "combination after")
        tables = [Table(caption, headings, rows)]
        if rows:
            kinds = dict.fromkeys(one.kind for one in self[first:])
            tables.append(Table("Kinds", ("kind", "what happens"), [(kind, KINDS[kind]) for kind in kinds]))
        return Summary(tables=tables)


class Grazing(NamedTuple):
    """An event function that touches zero within rounding: the run kept the status; the event may be true."""

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
    #: name of the contact, its index where contacts have no names
    name: str


class Accumulation(NamedTuple):
    """The limit of a series of bounces, which replaces the bounces that remain."""

    #: index of its event
    event: int
    #: bounces left out whose remaining time is at least one ulp of t
    bounces: int
    #: bound of the error of its time, s: the gap's acceleration is taken as constant over the rest; of a
    #: series over several contacts that mass couples, its rest
    error: float
