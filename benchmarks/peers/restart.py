"""The loop around an integrator that stops at events: what happens there, and where the next phase begins."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from peer_integrator import Mechanics, Motion

Vector = NDArray[np.float64]
#: From (combination, time, y) to the next event or the end: time, y, which event function (None: the end).
Advance = Callable[[str, float, Vector], tuple[float, Vector, int | None]]

#: m, by which a released contact starts open, and the part of the slider's speed by which a slip starts: an
#: ulp or less, and enough that the zero the phase starts from is not found again.
OPEN, SLIPPING = 1e-20, 2.3e-16
#: A run that makes more events than this goes in circles.
MOST_EVENTS = 2000


def follow(mechanics: Mechanics, start: Any, advance: Advance) -> Motion:
    """Run from phase to phase."""
    y = np.concatenate([start.position, start.velocity])
    combination, time, motion = start.combination, 0.0, Motion()
    labels = {}
    while len(motion.time) < MOST_EVENTS:
        time, y, index = advance(combination, time, y)
        if index is None:
            break
        if combination not in labels:
            labels[combination] = [(i, kind) for i, kind, _, _ in mechanics.event_functions(combination)]
        contact, kind = labels[combination][index]
        combination, y = mechanics.after(combination, y, contact, kind)
        leave(mechanics, combination, y, contact)
        motion.time.append(time)
        motion.contact.append(contact)
        motion.kind.append(kind)
        motion.combination.append(combination)
    return motion


def leave(mechanics: Mechanics, combination: str, y: Vector, contact: int) -> None:
    """Move y off the zero that the phase starts from, into the side where the status holds."""
    status, law = combination[contact], mechanics.contacts[contact]
    if status == "d":
        y[law.normal] = max(y[law.normal], OPEN)
    elif status in "+-":
        speed = mechanics.size + law.tangential
        if y[speed] == law.slider_speed:
            y[speed] *= 1.0 - SLIPPING if status == "+" else 1.0 + SLIPPING
