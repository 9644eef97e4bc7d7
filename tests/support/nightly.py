"""Tests that run every night alone: they take seconds, and a smaller one beside each runs always."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def nightly(values: Iterable[Any], is_nightly: Callable[[Any], bool]) -> list[Any]:
    """Return the values of a parameter, of which some run every night alone."""
    return [pytest.param(value, marks=[pytest.mark.nightly] * is_nightly(value)) for value in values]
