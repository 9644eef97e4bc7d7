"""Craig and Bampton's reduced matrices in contact coordinates, which keep an inertia at the contacts.

Craig, Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968): displacements are those
that the contact coordinates p cause statically, and modes with these held, ``x = x0 + Psi p + Phi q``,
``K_zz Psi_z = -K_zp``, ``K_zz Phi = M_zz Phi diag(w^2)``, ``Phi' M_zz Phi = 1``. With ``r = q + M_qp p`` mass
does not couple p and r: ``M = diag(S, 1)``, ``S = M_pp - M_pq M_qp``, the inertia that the modes leave at
the contacts. What is done with S is the choice of `boundary`.

Complex shapes of the full structure can be added to the basis, real and imaginary part each. A part x adds
``v = z - Psi_z p`` without the modes, ``(1 - Phi Phi' M_zz) v``. As ``Phi' K_zz v = diag(w^2) Phi' M_zz v =
0``, the vectors V that diagonalize K_zz and M_zz in the space of these v stand beside Phi as further modes,
with the squares ``V' K_zz V``. A basis that holds the shape of a complex mode has its eigenvalue exactly
(Galerkin), as far as S is kept.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.faults import InputError
from stickslip.fe.reduced.contact_coordinates import Coordinate, contact_matrices
from stickslip.fe.reduced.lowest_modes import LowestModes
from stickslip.fe.reduced.model import Boundary, Model, dual, projected, symmetric
from stickslip.scene.checks import Complex, Real
from stickslip.scene.laws.damping import Rayleigh, rayleigh_matrix
from stickslip.scene.scene import Scene

#: A part of a shape of which the modes leave less than this, relative to the shape, adds nothing.
ADDS = 1e-6
#: A mode whose stiffness is below this part of the largest one, by mass, is a free motion.
STIFFLESS = 1e-13
FREE = "scene: with its contacts held, the structure can still move freely; hold it somewhere, or by springs"


class CraigBampton:
    """The structure with held contacts: what contact coordinates cause statically, and its lowest modes."""

    def __init__(self, scene: Scene, boundary: Boundary) -> None:
        self.scene, self.boundary = scene, boundary
        self.matrices = matrices = contact_matrices(scene)
        self.kinds, b = matrices.kinds, matrices.count
        try:
            self.modes = LowestModes(matrices.stiffness[b:, b:], matrices.mass[b:, b:], 0.0)
        except RuntimeError:
            raise InputError(FREE) from None
        force = matrices.transform.T @ scene.force
        solve = self.modes.factor.solve
        self.static: Real = np.vstack([np.eye(b), -solve(matrices.stiffness[b:, :b].toarray())])
        #: How constant forces displace it, over contact coordinates.
        self.moved: Real = np.concatenate([np.zeros(b), solve(force[b:])])
        self._bound = projected(self.static, matrices.stiffness, 1.0)
        self._mass = _Projection(matrices.mass, self.static, 1.0)
        self._gyroscopic = (
            None if matrices.gyroscopic is None else _Projection(matrices.gyroscopic, self.static, -1.0)
        )

    @cached_property
    def _damping(self) -> _Projection:
        """Of damping other than `Rayleigh`, which follows from the reduced matrices."""
        return _Projection(self.matrices.damping, self.static, 1.0)

    def model(self, count: int, added: Complex | None = None) -> Model:
        """Return the reduced matrices with so many modes, and with complex shapes (n, k) in their basis.

        Raise `InputError` if a mode is a free motion, or the inertia left at the contacts is not positive.
        """
        scene, matrices, b = self.scene, self.matrices, self.matrices.count
        squares, shapes = self.modes(count)
        largest = np.abs(self.modes.stiffness.diagonal()).max() / np.abs(self.modes.mass.diagonal()).max()
        if not squares[0] > STIFFLESS * largest:
            raise InputError(FREE)
        if added is not None:
            further, vectors = self._further(shapes, added)
            squares, shapes = np.r_[squares, further], np.hstack([shapes, vectors])
            count = squares.size
        modal = np.vstack([np.zeros((b, count)), shapes])
        coupling = self._mass.across(shapes)
        local = np.hstack([self.static - modal @ coupling, modal])
        left = self._mass.static - coupling.T @ coupling
        inertia, lumping = _inertia(left, self.boundary, matrices.kinds)
        mass = scipy.linalg.block_diag(inertia, np.eye(count))
        bound = self._bound + coupling.T @ (squares[:, None] * coupling)
        side = -coupling.T * squares
        stiffness = np.block([[0.5 * (bound + bound.T), side], [side.T, np.diag(squares)]])
        if isinstance(scene.damping, Rayleigh):
            # Of the reduced matrices, so that it stays proportional.
            damping = rayleigh_matrix(scene.damping, mass, stiffness)
        else:
            damping = self._damping.onto(shapes, coupling)
        gyroscopic = None if self._gyroscopic is None else self._gyroscopic.onto(shapes, coupling)
        force = matrices.transform.T @ scene.force - matrices.stiffness @ self.moved
        circulatory = None
        if matrices.circulatory is not None:
            circulatory = local.T @ (matrices.circulatory @ local)
            force = force - matrices.circulatory @ self.moved
        basis = matrices.transform @ local
        return Model(
            squares=squares,
            basis=basis,
            offset=matrices.transform @ self.moved,
            dual=dual(scene, matrices.directions, basis[:, b:]),
            mass=mass,
            damping=damping,
            gyroscopic=gyroscopic,
            stiffness=stiffness,
            circulatory=circulatory,
            force=local.T @ force,
            lumping=lumping,
        )

    def _further(self, shapes: Real, added: Complex) -> tuple[Real, Real]:
        """Return squares (k,) and vectors (z, k) of what complex shapes add to the modes."""
        b, mass = self.matrices.count, self.modes.mass
        moved = np.vstack([self.matrices.directions.T @ added, added[self.matrices.left]])
        whole = moved[b:] - self.static[b:] @ moved[:b]
        sizes = np.sqrt(np.sum(whole.conj() * (mass @ whole), axis=0).real)
        whole /= np.where(sizes > 0.0, sizes, 1.0)
        inner: Real = np.hstack([whole.real, whole.imag])
        for _ in range(2):
            inner = inner - shapes @ (shapes.T @ (mass @ inner))
        sizes, mix = np.linalg.eigh(projected(inner, mass, 1.0))
        new = sizes > ADDS**2
        inner = inner @ (mix[:, new] / np.sqrt(sizes[new]))
        squares, mix = scipy.linalg.eigh(
            projected(inner, self.modes.stiffness, 1.0), projected(inner, mass, 1.0)
        )
        return squares, inner @ mix


class _Projection:
    """A symmetric (sign 1) or skew symmetric (-1) matrix A of y = (p, z), projected on Psi and modes Phi.

    What the static shapes Psi take part in without the modes is computed once: they are many, and modes are
    added step by step.
    """

    def __init__(self, matrix: Any, static: Real, sign: float) -> None:
        b, self.sign = static.shape[1], sign
        pushed = matrix @ static
        #: ``Psi' A Psi``
        self.static: Real = symmetric(static.T @ pushed, sign)
        self._pushed, self._inner = pushed[b:], scipy.sparse.csr_array(matrix[b:, b:])

    def across(self, shapes: Real) -> Real:
        """Return ``Phi' A Psi``, (modes, contact coordinates)."""
        found: Real = shapes.T @ self._pushed
        return found

    def onto(self, shapes: Real, coupling: Real) -> Real:
        """Return ``L' A L``, ``L = [Psi - Phi M_qp, Phi]``, with `coupling` M_qp."""
        across, modal = self.across(shapes), projected(shapes, self._inner, self.sign)
        side = across - modal @ coupling
        mixed = coupling.T @ across
        bound = self.static - mixed - self.sign * mixed.T + coupling.T @ modal @ coupling
        return np.block([[symmetric(bound, self.sign), self.sign * side.T], [side, modal]])


def _inertia(left: Real, boundary: Boundary, kinds: tuple[Coordinate, ...]) -> tuple[Real, str]:
    """Return the inertia at the contacts that is kept, and how it was lumped.

    Raise `InputError` if it is not positive.
    """
    if boundary == "consistent":
        if not np.linalg.eigvalsh(left).min() > 0.0:
            raise InputError("boundary: the inertia left at the contacts is not positive; use fewer modes")
        return left, ""
    lumped, told = np.zeros(len(left)), []
    for kind in ("tangential", "normal"):
        chosen = np.array([one.kind == kind for one in kinds])
        part = left[np.ix_(chosen, chosen)]
        if not part.size:
            continue
        sums, how = part.sum(axis=1), "row sums"
        if not (sums > 0.0).all():
            sums, how = np.diag(part) * (part.sum() / np.trace(part)), "scaled diagonal"
        if not (sums > 0.0).all():
            raise InputError(
                f"boundary: the inertia left at the contacts along their {kind} directions is not positive; "
                "use fewer modes, or boundary='consistent'"
            )
        lumped[chosen] = sums
        told.append(f"{kind} by {how}")
    return np.diag(lumped), f", {', '.join(told)}"
