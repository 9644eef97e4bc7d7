"""The free motion of one mode over time."""

from __future__ import annotations

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Real


def spiral(eigenvalue: complex, shape: Complex, periods: float, samples: int) -> tuple[Real, Real]:
    """Return times, (samples,), s, and ``Re(shape e^{lambda t})`` at them, (samples, dofs).

    `periods` are ``2 pi / |Im lambda|``, or time constants ``1 / |lambda|`` if lambda is real.
    """
    rate = abs(eigenvalue.imag) / (2.0 * np.pi) or abs(eigenvalue)
    if rate == 0.0:
        raise InputError("mode: it has eigenvalue 0 and no time of its own")
    if not (periods > 0.0 and samples >= 2):
        raise InputError(f"orbit: expected periods > 0 and samples >= 2, got {periods!r} and {samples!r}")
    times = np.linspace(0.0, periods / rate, samples)
    return times, (np.exp(eigenvalue * times)[:, None] * shape).real
