"""Sweeps and derivatives of modes over a number on which the place at rest depends, beside single calls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import stickslip as ss


def check_small_motions(scene: ss.Scene, name: str, values: Sequence[float]) -> None:
    """Check a sweep against the modes at each value, and a sensitivity against a difference of them."""
    swept = ss.sweep(scene, {name: values})
    for value in values:
        modes = ss.complex_modes(scene.replace(**{name: value}))
        found = swept.eigenvalue.sel({name: value}).to_numpy()
        found = np.sort_complex(found[found.imag > 0.0])
        np.testing.assert_allclose(found, np.sort_complex(modes.eigenvalues), rtol=1e-11)
    middle, step = values[1], 1e-4 * values[1]
    derivative = ss.sensitivity(scene, {name: middle}).derivative.to_numpy()[0]
    beside = [ss.complex_modes(scene.replace(**{name: middle + s})).eigenvalues for s in (step, -step)]
    np.testing.assert_allclose(derivative, (beside[0] - beside[1]) / (2.0 * step), rtol=1e-5)
