"""What a period consists of: its phases, and how close other events come."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stickslip import _core
from stickslip.motion.events import LOAD


class CyclePhase(NamedTuple):
    """One phase of a cycle."""

    combination: str
    #: start within the period, s
    start: float
    #: s
    duration: float
    #: index of the contact of the event that ends it; -1 where the period of the loads ends, kind ``load``
    contact: int
    #: kind of that event; ``turn`` where an orbit without events is cut: the contact turns along its slider
    event: str
    #: dimension of the admissible space: two per coordinate left free, one per sticking contact
    dimension: int
    #: directions of that space that the event forgets: the kernel of its saltation matrix
    loss: int
    #: name of the contact, its index where contacts have no names
    name: str


def phases_of(core: _core.Cycle, labels: Sequence[int | str]) -> tuple[CyclePhase, ...]:
    """Return the phases of a cycle, in order; `labels` name the contacts."""
    starts = np.concatenate([[0.0], np.cumsum(core.durations)[:-1]])
    rows = zip(
        core.combinations, starts, core.durations, core.events, core.dimensions, core.losses, strict=True
    )
    names = [*map(str, labels), LOAD]
    return tuple(
        CyclePhase(letters, float(start), float(length), contact, kind, size, loss, names[contact])
        for letters, start, length, (contact, kind), size, loss in rows
    )


class Margin(NamedTuple):
    """How close an event function that ends no phase comes to zero: what would change the sequence."""

    #: index into `Cycle.phases`
    phase: int
    #: index of the contact
    contact: int
    #: the event that would happen
    kind: str
    #: lowest value in the unit of the event function (m/s, N or m); negative: not a motion of the scene
    value: float
    #: where in the period, s
    time: float
    #: whether it is a local minimum (a touch there), or lies at the end of the phase (two events that meet)
    interior: bool
    #: name of the contact, its index where contacts have no names
    name: str
