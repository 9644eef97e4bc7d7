"""What is known of a scene beyond its numbers: how to draw it, how it starts, a section of its report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.drawing.schematic import Column, masses
from stickslip.scene.models.subsystems import two_subsystems
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, steady_sliding
from stickslip.scene.structure import Structure


@dataclass(frozen=True)
class Known:
    """What a report is told of a scene."""

    #: State in which the motion of the report starts; None: steady sliding with its leading mode set in
    #: motion.
    start: State | None = None
    #: The masses, from left to right; if none are given, each contact is drawn in its own directions.
    columns: Sequence[Column] = ()
    #: A name, a heading, and what makes one more section of the report, as HTML; None: no section.
    section: tuple[str, str, Callable[[], str]] | None = None


def known_of(scene: Scene) -> Known:
    """Return places and start of the model of two subsystems, whatever its friction, slider speeds and loads.

    Of any other scene nothing is known.
    """
    if not _is_two_subsystems(scene):
        return Known()
    columns = masses(two_subsystems())
    try:
        return Known(steady_sliding(scene).perturbed(velocity={"x1": 1e-3}), columns)
    except InputError:
        # Without steady sliding nothing can be disturbed.
        return Known(None, columns)


def _is_two_subsystems(scene: Scene) -> bool:
    """Return whether a scene has the matrices and directions of the model."""
    model = two_subsystems()
    if scene.dofs != model.dofs or len(scene.contacts) != 2 or scene.damping != model.damping:
        return False
    if scene.unsymmetric or scene.elements:
        return False
    ours, theirs = (Structure.dense(one) for one in (scene, model))
    names = ("mass", "stiffness", "directions")
    return all(np.array_equal(getattr(ours, name), getattr(theirs, name)) for name in names)
