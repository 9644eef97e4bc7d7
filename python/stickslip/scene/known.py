"""What is known of a scene beyond its numbers: how to draw it, how it starts, what was published of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from stickslip.scene.drawing.schematic import Column
from stickslip.scene.state import State


@dataclass(frozen=True)
class Known:
    """What a report is told of a scene.

    Parameters
    ----------
    start
        State in which the motion of the report starts; None: steady sliding with its leading mode set in
        motion.
    columns
        The masses, from left to right; if none are given, each contact is drawn in its own directions.
    section
        A name, a heading, and what makes one more section of the report, as HTML; None: no section.
    """

    start: State | None = None
    columns: Sequence[Column] = ()
    section: tuple[str, str, Callable[[], str]] | None = None
