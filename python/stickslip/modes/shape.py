"""What a complex mode does: orbits, phase lags, powers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stickslip.faults import InputError
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.modes import Modes
from stickslip.scene.checks import Complex, Real
from stickslip.scene.contact import dof_index
from stickslip.scene.laws.friction import Law
from stickslip.scene.scene import Scene
from stickslip.scene.structure import Structure, times

#: T / (mu N) of every status whose friction force Coulomb's law gives.
FRICTION_SIGN = {"+": 1.0, "-": -1.0, "s": 0.0, "d": 0.0}


def orbit(
    modes: Modes,
    mode: int,
    dofs: Sequence[int | str] | None = None,
    *,
    periods: float = 3.0,
    samples: int = 601,
) -> xr.DataArray:
    """Return the motion of a mode, ``x(t) = Re(shape e^{lambda t})``: spirals, growing where it is unstable.

    Parameters
    ----------
    modes
        Modes of a scene.
    mode
        Index into ``modes.eigenvalues``.
    dofs
        Names or indices of dofs; None: all.
    periods
        Length in periods ``2 pi / |Im lambda|``, or in time constants ``1 / |lambda|`` if lambda is real.
    samples
        Number of instants, the first at 0.

    Returns
    -------
    xarray.DataArray
        Displacement over ``time`` (s) and ``dof``; the largest one of the shape is 1.

    Raises
    ------
    InputError
        If there is no such mode or dof, or the eigenvalue is zero.
    """
    shape, eigenvalue = _shape(modes, mode)
    chosen = (
        list(range(len(modes.dofs))) if dofs is None else [dof_index("dofs", d, modes.dofs) for d in dofs]
    )
    rate = abs(eigenvalue.imag) / (2.0 * np.pi) or abs(eigenvalue)
    if rate == 0.0:
        raise InputError(f"mode: {mode} has eigenvalue 0 and no time of its own")
    if not (periods > 0.0 and samples >= 2):
        raise InputError(f"orbit: expected periods > 0 and samples >= 2, got {periods!r} and {samples!r}")
    times = np.linspace(0.0, periods / rate, samples)
    motion = (np.exp(eigenvalue * times)[:, None] * shape[chosen]).real
    names = [modes.dofs[k] for k in chosen]
    return xr.DataArray(
        motion,
        dims=("time", "dof"),
        coords={"time": ("time", times, {"units": "s"}), "dof": names},
        name="displacement",
        attrs={"units": "1"},
    )


def phase_lag(modes: Modes, leading: int | str, lagging: int | str) -> Real:
    """Return by how much one dof lags another in every mode.

    Parameters
    ----------
    modes
        Modes of a scene.
    leading, lagging
        Dofs by name or index, such as tangential and normal displacement of one mass.

    Returns
    -------
    array
        ``arg(shape[leading] / shape[lagging])`` in (-pi, pi], rad, (m,); nan where one of them does not move.
        A lag of 0 or pi is a straight orbit, any other lag an ellipse.

    Raises
    ------
    InputError
        If there is no such dof.
    """
    first, second = (
        modes.shapes[dof_index(name, dof, modes.dofs)]
        for name, dof in (("leading", leading), ("lagging", lagging))
    )
    # What rounding leaves of a dof at rest is no motion.
    moving = np.minimum(np.abs(first), np.abs(second)) > 64 * np.finfo(float).eps
    lag: Real = np.where(moving, np.angle(first * second.conj()), np.nan)
    return lag


def mode_power(scene: Scene, combination: str | None = None) -> xr.Dataset:
    """Return the power that every mode takes from contacts and loses to dampers.

    Parameters
    ----------
    scene
        The scene.
    combination
        One letter of ``+ - s d`` per contact; None: that of steady sliding, as for `complex_modes`.

    Returns
    -------
    xarray.Dataset
        Over ``mode``, and ``contact`` for the first: ``contact_power`` ``1/2 Re(T v*)``, ``damping_power``
        ``1/2 Re(u* C u)``, ``energy`` ``1/4 (u* M u + x* K x)``, all means over the oscillation of ``Re(shape
        e^{lambda t})`` at its amplitude of t = 0, in W and J for displacements in m. For a real eigenvalue
        they are the values at t = 0 itself, without the factor 1/2. ``circulatory_power`` ``-1/2 Re(u* H_a
        x)``, into the mode, comes from the skew part of the circulatory forces, which has no potential (K
        above includes the symmetric part). ``residual``: contact and circulatory power less damping power
        less ``2 Re(lambda)`` times energy; rounding alone makes it differ from zero.

    Notes
    -----
    The normal forces follow from the equations of motion, ``(lambda^2 M + lambda C + K) x = sum_i (n_i N_i +
    t_i T_i)``. Coulomb's law gives T of a contact that slides; a contact that sticks does no work. ``v =
    lambda t_i . x`` is the variation of the slip velocity. The static parts of N and T do no mean work.
    """
    return power_of(scene, complex_modes(scene, combination))


def power_of(scene: Scene, modes: Modes) -> xr.Dataset:
    """Return the result of `mode_power` for modes of a scene that are computed already."""
    structure = Structure.of(scene)
    value, shape = modes.eigenvalues, modes.shapes
    velocity = value * shape
    inertia, viscous, restoring, elastic, following = (
        times(matrix, shape)
        for matrix in (
            structure.mass,
            structure.damping,
            structure.stiffness,
            structure.elastic,
            structure.circulatory,
        )
    )
    share = np.where(value.imag == 0.0, 1.0, 0.5)
    friction = _friction(structure, scene, modes, value**2 * inertia + value * viscous + restoring)
    slip = times(structure.directions[:, ::2].T, velocity)
    contact = share * (friction * slip.conj()).real
    modulus = np.abs(value) ** 2
    # Re(x* matrix x) of every column x.
    lost = share * modulus * (shape.conj() * viscous).real.sum(axis=0)
    circulatory = -share * (velocity.conj() * following).real.sum(axis=0)
    stored = modulus * (shape.conj() * inertia).real.sum(axis=0) + (shape.conj() * elastic).real.sum(axis=0)
    energy = 0.5 * share * stored
    residual = contact.sum(axis=0) + circulatory - lost - 2.0 * value.real * energy
    labels = scene.contact_labels()
    return xr.Dataset(
        {
            "eigenvalue": ("mode", value, {"units": "1/s"}),
            "contact_power": (("contact", "mode"), contact, {"units": "W"}),
            "circulatory_power": ("mode", circulatory, {"units": "W"}),
            "damping_power": ("mode", lost, {"units": "W"}),
            "energy": ("mode", energy, {"units": "J"}),
            "residual": ("mode", residual, {"units": "W"}),
        },
        coords={"contact": labels, "mode": np.arange(value.size)},
    )


def mode_friction(structure: Structure, scene: Scene, modes: Modes) -> Complex:
    """Return the phasors of the friction forces T of every mode, (c, m), N per m of displacement.

    The normal forces hold the gaps closed; Coulomb's law gives T from them. A sticking contact does no work
    in a mode, its tangential displacement being prescribed: 0.
    """
    unbalanced = (structure.mass @ modes.shapes) * modes.eigenvalues**2
    unbalanced += (structure.damping @ modes.shapes) * modes.eigenvalues + structure.stiffness @ modes.shapes
    return _friction(structure, scene, modes, unbalanced)


def friction_factors(scene: Scene, combination: str) -> Real:
    """Return T / N of every contact in steady sliding; 0 where it sticks or is detached."""
    pairs = zip(combination, scene.contacts, strict=True)
    return np.array([FRICTION_SIGN[status] * contact.coefficient() for status, contact in pairs])


def _friction(structure: Structure, scene: Scene, modes: Modes, unbalanced: Complex) -> Complex:
    """Return the friction forces of modes from the loads that contact forces balance, (n, m)."""
    normal = times(structure.impulse_response[:, 1::2].T, unbalanced)
    phasors: Complex = friction_factors(scene, modes.combination)[:, None] * normal
    for i, (status, contact) in enumerate(zip(modes.combination, scene.contacts, strict=True)):
        if isinstance(contact.friction, Law) and status in "+-":
            # Beside mu N it changes with slip speed: what is left of the load along the contact.
            phasors[i] = times(structure.impulse_response[:, [2 * i]].T, unbalanced)[0]
    return phasors


def _shape(modes: Modes, mode: int) -> tuple[Complex, complex]:
    count = modes.eigenvalues.size
    if not 0 <= mode < count:
        raise InputError(f"mode: expected an index in 0..{count - 1}, got {mode!r}")
    return modes.shapes[:, mode], complex(modes.eigenvalues[mode])
