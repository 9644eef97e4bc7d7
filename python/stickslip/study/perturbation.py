"""Moments of eigenvalues by first-order perturbation, to stand beside Monte Carlo.

With ``lambda(p) = lambda(m) + g . (p - m) + ...`` about the mean m of the parameters, of covariance S,

    E lambda = lambda(m),    E |lambda - E lambda|^2 = g* S g,    Var Re lambda = (Re g)' S (Re g),

exact to first order of the spread; the gradients g are those of `sensitivity`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stickslip.locus.sensitivity import sensitivity
from stickslip.scene.scene import Scene

if TYPE_CHECKING:
    from stickslip.study.study import Study


def eigenvalue_moments(study: Study) -> xr.Dataset:
    """Return mean and covariance of the eigenvalues of sliding, to first order of the spread.

    Parameters
    ----------
    study
        A study whose distributions have a variance.

    Returns
    -------
    xarray.Dataset
        Over ``mode``, the modes at the mean of the parameters: ``eigenvalue`` there, 1/s; ``covariance``
        (mode, part, other) of real and imaginary part, 1/s^2; ``growth_deviation``, standard deviation of the
        real part, 1/s; ``frequency_deviation`` of the modulus over 2 pi, Hz; ``share`` (parameter, mode) of
        the variance of the real part that a parameter has alone (sums to 1 where they are independent);
        ``gradient`` (parameter, mode). Values of a defective mode are
        nan: its derivative is unbounded, so first order says nothing about it.

    Raises
    ------
    InputError
        If a distribution has no variance, or the model is not smooth at the mean.
    """
    mean, covariance = study.parameters.moments()
    names = study.parameters.names

    def model(**values: float) -> Scene:
        return study.scene_of([values[name] for name in names])

    point = dict(zip(names, mean.tolist(), strict=True))
    found = sensitivity(model, point, combination=study.settings.combination)
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
