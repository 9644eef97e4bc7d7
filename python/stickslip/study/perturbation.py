"""Moments of eigenvalues by first-order perturbation, to stand beside Monte Carlo.

With ``lambda(p) = lambda(m) + g . (p - m) + ...`` about the mean m of the parameters, of covariance S,

    E lambda = lambda(m),    E |lambda - E lambda|^2 = g* S g,    Var Re lambda = (Re g)' S (Re g),

exact to first order of the spread; the gradients g are those of `sensitivity`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from stickslip.locus.sensitivity import sensitivity
from stickslip.scene.scene import Scene
from stickslip.study.parameters import Parameters


def eigenvalue_moments(
    parameters: Parameters, scene_of: Callable[[Any], Scene], combination: str | None
) -> xr.Dataset:
    """Return what `Study.eigenvalue_moments` does."""
    mean, covariance = parameters.moments()
    names = parameters.names

    def model(**values: float) -> Scene:
        return scene_of([values[name] for name in names])

    point = dict(zip(names, mean.tolist(), strict=True))
    found = sensitivity(model, point, combination=combination)
    gradient = found.derivative.to_numpy()
    value = found.eigenvalue.to_numpy()
    parts = np.stack([gradient.real, gradient.imag])  # (part, parameter, mode)
    joint = np.einsum("apm,pq,bqm->mab", parts, covariance, parts)
    alone = gradient.real**2 * np.diag(covariance)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        modulus = (np.conj(value) * gradient).real / np.abs(value)
        share = alone / joint[:, 0, 0]
    spread = np.einsum("pm,pq,qm->m", modulus, covariance, modulus)
    rate = {"units": "1/s"}
    variables: dict[str, Any] = {
        "eigenvalue": ("mode", value, rate),
        "covariance": (("mode", "part", "other"), joint, {"units": "1/s^2"}),
        "growth_deviation": ("mode", np.sqrt(joint[:, 0, 0]), rate),
        "frequency_deviation": ("mode", np.sqrt(spread) / (2.0 * np.pi), {"units": "Hz"}),
        "share": (("parameter", "mode"), share),
        "gradient": (("parameter", "mode"), gradient),
    }
    coords = {
        "mode": np.arange(value.size),
        "parameter": list(names),
        "part": ["real", "imaginary"],
        "other": ["real", "imaginary"],
    }
    return xr.Dataset(variables, coords=coords)
