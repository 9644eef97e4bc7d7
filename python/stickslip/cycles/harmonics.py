"""A periodic motion by harmonics of its period: its series, and their energy.

With ``x = c_0 + 2 Re sum_k c_k e^{i k omega t}`` and ``u_k = i k omega c_k`` the structure, being linear,
passes no energy from one harmonic to another: for each of them, over one period T,

    work of the contact forces  2 T Re(u_k* D f_k) = 2 T u_k* C u_k + 2 T Re(u_k* H_a c_k),

which dampers dissipate and circulatory forces take, with ``D f_k = (K + H + i k omega (C + G) - (k omega)^2
M) c_k`` for k > 0 and the skew part ``H_a = (H - H') / 2`` of H, which has no potential. Only the contacts
pass energy from one harmonic to another. The impulses of impacts belong to f_k: their normal part has the
impact losses.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from stickslip.scene.checks import Complex
from stickslip.scene.scene import Scene
from stickslip.scene.structure import Structure


def fourier_series(scene: Scene, period: float, coefficients: Complex) -> xr.Dataset:
    """Return the series of coefficients c_k, (harmonic, dof), m, as a dataset; see `Cycle.harmonics`."""
    order = np.arange(len(coefficients))
    amplitude = np.abs(coefficients) * np.where(order == 0, 1.0, 2.0)[:, None]
    return xr.Dataset(
        {
            "coefficient": (("harmonic", "dof"), coefficients, {"units": "m"}),
            "amplitude": (("harmonic", "dof"), amplitude, {"units": "m"}),
        },
        coords={
            "harmonic": order,
            "frequency": ("harmonic", order * (1.0 / period), {"units": "Hz"}),
            "dof": list(scene.dofs),
        },
    )


def harmonic_energy(scene: Scene, period: float, series: xr.Dataset) -> xr.Dataset:
    """Return mean energies and works per period of a Fourier series; see `Cycle.harmonic_energy`."""
    structure = Structure.dense(scene)
    c = series.coefficient.to_numpy().T
    omega = 2.0 * np.pi * series.frequency.to_numpy()
    u = 1j * omega * c
    # The mean counts once, an oscillation as two conjugate halves.
    weight = np.where(omega == 0.0, 0.5, 1.0)
    unbalanced = structure.stiffness @ c + structure.damping @ u - structure.mass @ (c * omega**2)
    force = structure.impulse_response.T @ unbalanced
    moving = structure.directions.T @ u
    work = 2.0 * period * np.real(force * moving.conj())
    mass, damping, stiffness, circulatory = (
        np.einsum("ik,ij,jk->k", a.conj(), matrix, b).real
        for a, matrix, b in (
            (u, structure.mass, u),
            (u, structure.damping, u),
            (c, structure.elastic, c),
            (u, structure.circulatory, c),
        )
    )
    by_contact, joule, taken = ("harmonic", "contact"), {"units": "J"}, -2.0 * period * circulatory
    return xr.Dataset(
        {
            "kinetic": ("harmonic", weight * mass, joule),
            "elastic": ("harmonic", weight * stiffness, joule),
            "friction_work": (by_contact, work[::2].T, joule | {"sign": "into the structure"}),
            "normal_work": (by_contact, work[1::2].T, joule | {"sign": "into the structure"}),
            "circulatory": ("harmonic", taken, joule | {"sign": "into the structure"}),
            "damping": ("harmonic", 2.0 * period * damping, joule | {"sign": "dissipated"}),
        },
        coords={
            "harmonic": series.harmonic.to_numpy(),
            "frequency": ("harmonic", series.frequency.to_numpy(), {"units": "Hz"}),
            "contact": scene.contact_labels(),
        },
    )
