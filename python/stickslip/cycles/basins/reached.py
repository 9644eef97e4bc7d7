"""The attractors that motions reach, numbered in order of appearance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stickslip.cycles.attractors import OUTSIDE, UNKNOWN, described, is_valid, settled
from stickslip.cycles.cycle import Cycle
from stickslip.scene.checks import Index
from stickslip.scene.scene import Scene
from stickslip.scene.state import State

#: Relative difference of period and extremes up to which two cycles are one.
SAME = 1e-6


def reached(
    scenes: Sequence[Scene],
    starts: Sequence[State],
    stretch: float,
    limit: float,
    attractors: list[Cycle | str],
    *,
    of_one_scene: bool,
) -> tuple[Index, BaseException | None]:
    """Return the number of the attractor that each start reaches, and what interrupted the search, if any.

    `OUTSIDE` where the start violates its combination, `UNKNOWN` where the search was interrupted before. An
    attractor that is none of `attractors` is appended to them.
    """
    valid = [k for k, (scene, state) in enumerate(zip(scenes, starts, strict=True)) if is_valid(scene, state)]
    found, interruption = settled([scenes[k] for k in valid], [starts[k] for k in valid], stretch, limit)
    numbers = np.full(len(starts), OUTSIDE)
    for k, outcome in zip(valid, found, strict=True):
        if outcome is None:
            numbers[k] = UNKNOWN
            continue
        (kind, core, growth, _), message = outcome
        attractor = described(kind, growth, message)[0] if core is None else Cycle(scenes[k], core)
        numbers[k] = next(
            (i for i, other in enumerate(attractors) if is_same(attractor, other, of_one_scene)),
            len(attractors),
        )
        if numbers[k] == len(attractors):
            attractors.append(attractor)
    return numbers, interruption


def is_same(a: Cycle | str, b: Cycle | str, of_one_scene: bool = True) -> bool:
    """Return whether two attractors are one; of scenes that differ, cycles with the same sequence are."""
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    if not of_one_scene:
        return _rotated(a.combinations) == _rotated(b.combinations)
    size = float(a.amplitude.max())
    apart = max(np.abs(a.core.minimum - b.core.minimum).max(), np.abs(a.core.maximum - b.core.maximum).max())
    return abs(a.period - b.period) <= SAME * a.period and apart <= SAME * size


def _rotated(sequence: tuple[str, ...]) -> tuple[str, ...]:
    """Return a sequence that recurs from the place on where it comes first in order."""
    return min((sequence[k:] + sequence[:k] for k in range(len(sequence))), default=())
