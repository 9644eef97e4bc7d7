"""Energy of a motion by complex modes: the energy of each mode, and the power it takes from the contacts.

A mode of a status combination moves independently of the others, under its dampers and the part of the
contact forces that is linear in the state. So its energy changes by its own contact and circulatory power
less its own damping power (Brunetti, Massi, D'Ambrogio, Berthier, Eq. 17, at every instant instead of in the
mean).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.modes.complex_modes import complex_modes
from stickslip.modes.shape import friction_factors, mode_friction
from stickslip.scene.checks import Complex, Real, real_array
from stickslip.scene.laws.friction import Constant
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.reduction import equations_of
from stickslip.scene.scene import Scene
from stickslip.scene.structure import Structure

if TYPE_CHECKING:
    from stickslip.motion.motion import Motion


def modal_energy(run: Motion, times: ArrayLike) -> xr.Dataset:
    """Return the energy and the power of every complex mode, in the combination of each instant.

    The motion less the quasi-static one of the combination (its equilibrium, carried along by sticking
    contacts) is a sum of modes, each of which moves as ``e^{lambda t}`` by itself. Modes of an asymmetric
    system are not orthogonal in energy: beside the energy of its own motion a mode has a share, its part of
    the bilinear form with the whole, and the shares add up.

    Parameters
    ----------
    run
        The motion.
    times
        k times in [0, duration], s.

    Returns
    -------
    xarray.Dataset
        (time, pair), one of each conjugate pair in the order of `Modes`, nan beyond those of a combination
        that has fewer: ``energy`` J of the mode alone, ``share`` J (adds up to ``total`` (time); may be
        negative), ``contact_power`` and ``circulatory_power`` W into the mode, ``damping_power`` W out of it:
        contact plus circulatory less damping power is the rate of ``energy``; ``frequency`` Hz,
        ``growth_rate`` 1/s. ``combination`` (time). Defective modes and those with lambda = 0 are nan.

    Raises
    ------
    InputError
        If a time lies outside the motion, or friction depends on slip speed.
    """
    at = np.atleast_1d(real_array("times", times, 0, 1))
    scene = run.scene
    laws = [contact.friction for contact in scene.contacts if isinstance(contact.friction, FrictionLaw)]
    if not all(isinstance(law, Constant) for law in laws):
        raise InputError(
            "modal_energy: friction depends on slip speed, so a finite motion is no sum of modes;"
            " Trajectory.energy and Trajectory.balance have its energy"
        )
    sample = run.sample(at)
    combinations = np.array(["".join(row) for row in sample.status.to_numpy()], dtype=np.str_)
    parts = {name: Deviations.of(scene, str(name)) for name in np.unique(combinations)}
    width = max((part.rates.size for part in parts.values()), default=0)
    table = {name: np.full((at.size, width), np.nan) for name in MODAL_TERMS}
    total = np.full(at.size, np.nan)
    for name, part in parts.items():
        rows = combinations == name
        position, velocity = sample.position.to_numpy()[rows], sample.velocity.to_numpy()[rows]
        held = np.ix_(np.flatnonzero(rows), np.arange(part.rates.size))
        values, whole = part.energies(position, velocity)
        for term, value in zip(MODAL_TERMS, values, strict=True):
            table[term][held] = value
        total[rows] = whole
    return xr.Dataset(
        {name: (("time", "pair"), table[name], {"units": unit}) for name, unit in MODAL_TERMS.items()}
        | {"total": ("time", total, {"units": "J"}), "combination": ("time", combinations)},
        coords={"time": ("time", at, {"units": "s"})},
    )


#: Terms of `modal_energy` and their units.
MODAL_TERMS = {
    "energy": "J",
    "share": "J",
    "contact_power": "W",
    "circulatory_power": "W",
    "damping_power": "W",
    "frequency": "Hz",
    "growth_rate": "1/s",
}


@dataclass(frozen=True, eq=False)
class Deviations:
    """The modes of one combination, and how the deviation from its quasi-static motion is made of them.

    With c the free coordinates, ``x = R c + S x``, where S x is what the contacts prescribe: closed gaps, and
    sticking contacts that move with their sliders. In modes ``z' = lambda z + p0 + p1 t`` has the solution
    ``-p / lambda - p1 / lambda^2``; what is left moves as ``e^{lambda t}``.
    """

    scene: Scene
    structure: Structure
    combination: str
    shapes: Complex
    rates: Complex
    #: phasors of T, (c, m)
    friction: Complex
    #: z = from_position x + from_velocity x' + steady, (m, n), (m, n), (m,)
    from_position: Complex
    from_velocity: Complex
    steady: Complex

    @classmethod
    def of(cls, scene: Scene, combination: str) -> Deviations:
        """Return the modes of a combination and the projections on them."""
        structure = Structure.dense(scene)
        modes, reduced = complex_modes(scene, combination), equations_of(scene, combination)
        free = reduced.mass.shape[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            left = (modes.left / modes.a).T
            rate = modes.eigenvalues[:, None]
            inverse = 1.0 / rate
            prescribed, velocity = _prescribed(scene, structure, combination)
            coordinates = np.linalg.pinv(reduced.right_basis) @ (np.eye(scene.size) - prescribed)
            momentum: Complex = left @ modes.state_a
            load = left[:, :free] @ reduced.left_basis.T
            # The load on the free coordinates: F - C x_p' - K x_p, which changes as -K x_p'.
            change = -load @ structure.stiffness @ velocity
            given = np.array([contact.normal_force or 0.0 for contact in scene.contacts])
            friction = friction_factors(scene, combination) * given
            force = structure.force + structure.directions[:, ::2] @ friction
            constant = load @ (force - structure.damping @ velocity)
            return cls(
                scene,
                structure,
                combination,
                modes.shapes,
                modes.eigenvalues,
                mode_friction(structure, scene, modes),
                momentum[:, :free] @ coordinates - inverse * (load @ structure.stiffness @ prescribed),
                momentum[:, free:] @ coordinates,
                inverse[:, 0] * (constant + inverse[:, 0] * change),
            )

    def energies(self, position: Real, velocity: Real) -> tuple[tuple[Real, ...], Real]:
        """Return the terms of `modal_energy`, (k, m) each, and the energy of the whole deviation, (k,)."""
        structure = self.structure
        z = position @ self.from_position.T + velocity @ self.from_velocity.T + self.steady
        z = np.where(self.rates.imag > 0.0, 2.0, 1.0) * z
        moved = np.real(self.shapes[None] * z[:, None])
        moving = np.real((self.shapes * self.rates)[None] * z[:, None])
        friction = np.real(self.friction[None] * z[:, None])
        whole, speed = moved.sum(axis=2), moving.sum(axis=2)

        def form(matrix: Real, a: Real, b: Real) -> Real:
            value: Real = np.einsum("kim,ij,kjm->km", a, matrix, b)
            return value

        def share(matrix: Real, part: Real, all_of_it: Real) -> Real:
            value: Real = np.einsum("kim,ij,kj->km", part, matrix, all_of_it)
            return value

        energy = 0.5 * (form(structure.mass, moving, moving) + form(structure.elastic, moved, moved))
        shares = 0.5 * (share(structure.mass, moving, speed) + share(structure.elastic, moved, whole))
        slip = np.einsum("ic,kim->kcm", structure.directions[:, ::2], moving)
        count = position.shape[0]
        terms = (
            energy,
            shares,
            (friction * slip).sum(axis=1),
            -form(structure.circulatory, moving, moved),
            form(structure.damping, moving, moving),
            np.broadcast_to(np.abs(self.rates) / (2.0 * np.pi), (count, self.rates.size)),
            np.broadcast_to(self.rates.real, (count, self.rates.size)),
        )
        return terms, shares.sum(axis=1)


def _prescribed(scene: Scene, structure: Structure, combination: str) -> tuple[Real, Real]:
    """S, (n, n), and the velocity that sticking contacts prescribe, (n,)."""
    held, speed = np.zeros(2 * len(scene.contacts)), np.zeros(2 * len(scene.contacts))
    for i, (status, contact) in enumerate(zip(combination, scene.contacts, strict=True)):
        held[2 * i : 2 * i + 2] = status == "s", status != "d"
        speed[2 * i] = contact.slider_speed if status == "s" else 0.0
    response = structure.impulse_response
    return response @ (held[:, None] * structure.directions.T), response @ speed
