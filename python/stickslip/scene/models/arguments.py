"""Checks of arguments that several models share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Real, real_array, real_number

#: One number for both directions, or a pair.
Pair = float | Sequence[float] | Real


def finite(argument: str, value: Any, *, least: float = -np.inf) -> float:
    """Return a finite number that is at least so large.

    Raises
    ------
    InputError
        If it is none.
    """
    number = real_number(argument, value)
    if not np.isfinite(number):
        raise InputError(f"{argument}: must be finite, got {number}")
    if number < least:
        raise InputError(f"{argument}: must be >= {least:g}, got {number:g}")
    return number


def positive(argument: str, value: Any) -> float:
    """Return a positive finite number.

    Raises
    ------
    InputError
        If it is none.
    """
    number = finite(argument, value)
    if number <= 0.0:
        raise InputError(f"{argument}: must be positive, got {number:g}")
    return number


def pair(argument: str, value: Any, *, least: float = -np.inf) -> tuple[float, float]:
    """Return two finite numbers, from one for both or two.

    Raises
    ------
    InputError
        If they are none, or one is too small.
    """
    values = [value, value] if np.ndim(value) == 0 else real_array(argument, value, 1)
    if len(values) != 2:
        raise InputError(f"{argument}: expected a number or two, got {len(values)}")
    first, second = (finite(argument, one, least=least) for one in values)
    return first, second
