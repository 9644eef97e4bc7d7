"""What complex modes do: orbits, phase lags, powers, and which is which in another scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, cast

import numpy as np
import scipy.optimize
import xarray as xr

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Flags, Real
from stickslip.scene.contact import dof_index, steady_coefficients
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.scene import Scene
from stickslip.scene.structure import Structure, times

#: T / (mu N) of every status whose friction force Coulomb's law gives.
FRICTION_SIGN = {"+": 1.0, "-": -1.0, "s": 0.0, "d": 0.0, "o": 0.0}


class Computed(Protocol):
    """What functions of modes take: `Modes`, whose methods they are."""

    @property
    def combination(self) -> str:
        """The status combination."""

    @property
    def eigenvalues(self) -> Complex:
        """lambda, (m,), 1/s."""

    @property
    def frequencies(self) -> Real:
        """``|lambda| / 2 pi``, (m,), Hz."""

    @property
    def unstable(self) -> Flags:
        """Whether a mode grows, (m,)."""

    @property
    def shapes(self) -> Complex:
        """Displacements, (n, m)."""

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the dofs."""

    @property
    def scene(self) -> Scene:
        """The scene."""

    def described(self, mode: int) -> str:
        """Return frequency and growth in words."""


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


def orbit(
    modes: Computed, mode: int, dofs: Sequence[int | str] | None, periods: float, samples: int
) -> xr.DataArray:
    """Return what `Modes.orbit` does."""
    shape, eigenvalue = _shape(modes, mode)
    chosen = (
        list(range(len(modes.dofs))) if dofs is None else [dof_index("dofs", d, modes.dofs) for d in dofs]
    )
    times, motion = spiral(eigenvalue, shape[chosen], periods, samples)
    names = [modes.dofs[k] for k in chosen]
    return xr.DataArray(
        motion,
        dims=("time", "dof"),
        coords={"time": ("time", times, {"units": "s"}), "dof": names},
        name="displacement",
        attrs={"units": "1"},
    )


def phase_lag(modes: Computed, leading: int | str, lagging: int | str) -> Real:
    """Return what `Modes.phase_lag` does."""
    first, second = (
        modes.shapes[dof_index(name, dof, modes.dofs)]
        for name, dof in (("leading", leading), ("lagging", lagging))
    )
    # What rounding leaves of a dof at rest is no motion.
    moving = np.minimum(np.abs(first), np.abs(second)) > 64 * np.finfo(float).eps
    lag: Real = np.where(moving, np.angle(first * second.conj()), np.nan)
    return lag


def power(modes: Computed) -> xr.Dataset:
    """Return what `Modes.power` does."""
    scene = modes.scene
    structure = Structure.of(scene, modes.combination)
    value, shape = modes.eigenvalues, modes.shapes
    velocity = value * shape
    matrices = ("mass", "damping", "stiffness", "elastic", "circulatory")
    inertia, viscous, restoring, elastic, following = (
        times(getattr(structure, name), shape) for name in matrices
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


def mode_friction(structure: Structure, scene: Scene, modes: Computed) -> Complex:
    """Return the phasors of the friction forces T of every mode, (c, m), N per m of displacement.

    The normal forces hold the gaps closed; Coulomb's law gives T from them. A sticking contact does no work
    in a mode, its tangential displacement being prescribed: 0.
    """
    unbalanced = (structure.mass @ modes.shapes) * modes.eigenvalues**2
    unbalanced += (structure.damping @ modes.shapes) * modes.eigenvalues + structure.stiffness @ modes.shapes
    return _friction(structure, scene, modes, unbalanced)


def friction_factors(scene: Scene, combination: str) -> Real:
    """Return T / N of contacts that slide steadily along lines; 0 of all others."""
    pairs = zip(combination, steady_coefficients(scene.contacts), strict=True)
    return np.array([FRICTION_SIGN[status] * friction for status, friction in pairs])


def _friction(structure: Structure, scene: Scene, modes: Computed, unbalanced: Complex) -> Complex:
    """Return the friction forces of modes from the loads that contact forces balance, (n, m)."""
    normal = times(structure.impulse_response[:, 1::2].T, unbalanced)
    phasors: Complex = friction_factors(scene, modes.combination)[:, None] * normal
    for i, (status, contact) in enumerate(zip(modes.combination, scene.contacts, strict=True)):
        if status == "o" or (isinstance(contact.friction, FrictionLaw) and status in "+-"):
            # Beside mu N it changes with the slip velocity: what is left of the load along the contact.
            phasors[i] = times(structure.impulse_response[:, [2 * i]].T, unbalanced)[0]
    return phasors


def _shape(modes: Computed, mode: int) -> tuple[Complex, complex]:
    count = modes.eigenvalues.size
    if not 0 <= mode < count:
        raise InputError(f"number: expected a mode in 0..{count - 1}, got {mode!r}")
    return modes.shapes[:, mode], complex(modes.eigenvalues[mode])


def mac(a: Computed, b: Computed) -> xr.DataArray:
    """Return what `Modes.mac` does."""
    dofs = _shared(a, b)
    first, second = (_unit(modes, dofs) for modes in (a, b))
    alike = np.abs(first.conj().T @ second) ** 2
    return xr.DataArray(
        alike,
        dims=("first", "second"),
        coords={"first": np.arange(first.shape[1]), "second": np.arange(second.shape[1])},
        name="mac",
        attrs={"units": "1", "long_name": "modal assurance criterion"},
    )


def pairing(a: Computed, b: Computed) -> xr.Dataset:
    """Return what `Modes.pairing` does."""
    table = mac(a, b)
    rows, columns = scipy.optimize.linear_sum_assignment(-np.nan_to_num(table.to_numpy()))
    first, second = table.first.to_numpy()[rows], table.second.to_numpy()[columns]
    value = np.stack([a.eigenvalues[first], b.eigenvalues[second]], axis=1)
    frequency = np.abs(value) / (2.0 * np.pi)
    hertz = {"units": "Hz"}
    return xr.Dataset(
        {
            "first": ("pair", first),
            "second": ("pair", second),
            "mac": ("pair", table.to_numpy()[rows, columns], {"units": "1"}),
            "frequency": (("pair", "side"), frequency, hertz),
            "shift": ("pair", frequency[:, 1] - frequency[:, 0], hertz),
            "eigenvalue": (("pair", "side"), value, {"units": "1/s"}),
        },
        coords={"pair": np.arange(first.size), "side": ["first", "second"]},
    )


def _shared(a: Computed, b: Computed) -> list[str]:
    found = [dof for dof in a.dofs if dof in set(b.dofs)]
    if not found:
        raise InputError(
            f"other: expected a dof that these modes have, such as {a.dofs[0]!r}, got {b.dofs[0]!r}, ..."
        )
    return found


def _unit(modes: Computed, dofs: list[str]) -> Complex:
    """Return the displacements of some dofs in every mode, of length 1; nan where none of them moves."""
    place = {dof: k for k, dof in enumerate(modes.dofs)}
    shapes = modes.shapes[[place[dof] for dof in dofs]]
    with np.errstate(invalid="ignore"):
        return cast(Complex, shapes / np.linalg.norm(shapes, axis=0))
