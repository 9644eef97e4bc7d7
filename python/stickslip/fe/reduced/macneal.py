"""MacNeal's reduced matrices: modes of the free structure, and what the others cause statically at contacts.

MacNeal, A hybrid method of component mode synthesis, Computers and Structures 1 (1971); as a boundary without
mass: Monjaraz Tec, Gross, Krack, arXiv 2111.07693. Modes ``K Phi = M Phi diag(w^2)``, ``Phi' M Phi = 1``, of
the structure without its contacts move by themselves; those left out follow contact forces l and constant
forces f at once,

    x = Phi q + R (B l + f),   R = sum over modes left out of phi phi' / w^2.

The contact displacements ``p = B' x`` take the place of the forces: ``l = Y^-1 (p - B' Phi q - B' R f)`` with
``Y = B' R B``, so that

    K = [[Y^-1, -Y^-1 P], [-P' Y^-1, diag(w^2) + P' Y^-1 P]],   P = B' Phi,   M = diag(0, 1).

All that is static is exact. Damping and gyroscopic forces act on the modes alone: R is that of rest.

Of the inertia of the modes left out R knows nothing. One further mode per contact direction carries it: with
``V = R B``, ``m1 = V' M_z V``, ``m2 = V' M_z R M_z V`` these modes are ``psi = w^2 R M_z V z`` where
``m2 z = m1 z / w^2``, ``z' m1 z = 1``, and ``R - sum of psi psi' / w^2`` takes the place of R. Here
``M_z = P M P``, ``P = 1 - B (B' B)^-1 B'``, is the mass without that of the contact displacements, which
would strike against the contacts as if it were on stiff springs. As ``psi_i' K psi_j`` is w_i^2 for i = j and
else zero, the equations above hold as they stand, with any of these modes; the amplitude of such a mode in a
displacement x without the modes Phi is ``z' V' M_z x``. Where fewer modes are left out than there are
directions, some combinations of the directions have no inertia, and need no mode.

Where nothing has mass at the contacts, the flexibility ``B' (R + w^2 R M R + w^4 R M R M R + ...) B`` is
exact up to the terms written: this is the block Gauss-Radau rule with a node at infinite frequency (Golub,
Meurant, Matrices, Moments and Quadrature with Applications, 2010, chapter 6).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
from scipy.sparse.linalg import splu

from stickslip.faults import InputError
from stickslip.fe.reduced.contact_coordinates import INDEPENDENT, Coordinate, contact_directions, sparse
from stickslip.fe.reduced.lowest_modes import LowestModes
from stickslip.fe.reduced.model import Boundary, Model, dual, projected, symmetric
from stickslip.scene.checks import Real
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.scene import Scene

#: The shift that makes K regular where the structure moves freely, of the highest frequency wanted: the
#: correction for it shrinks by this number squared, over that of the first mode left out, in every step.
_SHIFT = 0.1
#: Part of the flexibility of every contact direction that must stay without mass: with less, contacts would
#: become rigid. Fewer further modes leave more.
_MASSLESS = 0.01
#: Part of the largest inertia of the modes left out, and of the largest 1 / w^2, below which it is rounding.
_CARRIED = 1e-11
#: Relative change of R that counts as none, and steps that may lead there.
_SETTLED, _STEPS = 1e-15, 200


class MacNeal:
    """The free structure: its lowest modes, and the reduced matrices with so many of them."""

    boundary: Boundary = "massless"

    def __init__(self, scene: Scene, highest: float) -> None:
        if scene.circulatory is not None:
            raise InputError(
                "boundary: 'massless' carries no circulatory matrix, which couples dofs without mass "
                "unsymmetrically; take 'lumped' or 'consistent'"
            )
        self.scene = scene
        self.kinds: tuple[Coordinate, ...]
        self.kinds, self.directions = contact_directions(scene)
        mass, stiffness = sparse(scene.mass, scene.size), sparse(scene.stiffness, scene.size)
        self.modes = LowestModes(stiffness, mass, (_SHIFT * 2.0 * np.pi * highest) ** 2)

    def model(self, count: int) -> Model:
        """Return the reduced matrices with so many modes of the structure, and the further ones.

        Raise `InputError` if directions of contacts depend on one another.
        """
        scene, b = self.scene, len(self.kinds)
        squares, shapes = self.modes(count)
        left = self._left_out(shapes, np.column_stack([self.directions.toarray(), scene.force]))
        caused, rest = left[:, :b], left[:, b]
        more, further, weights = self._further(shapes, caused)
        caused = caused - further @ ((further.T @ self.directions) / more[:, None])
        rest = rest - further @ (further.T @ scene.force / more)
        taken = np.vstack(
            [
                dual(scene, self.directions, shapes),
                weights - (weights @ shapes) @ (shapes.T @ self.modes.mass),
            ]
        )
        squares, shapes = np.r_[squares, more], np.hstack([shapes, further])
        count = squares.size
        flexible = symmetric(self.directions.T @ caused)
        sizes = np.sqrt(np.maximum(np.diag(flexible), 0.0))
        if not (sizes.min() > 0.0 and np.linalg.eigvalsh(flexible / np.outer(sizes, sizes))[0] > INDEPENDENT):
            raise InputError(
                "contacts: the modes left out do not move them independently; their directions depend on one "
                "another, or there are too many modes"
            )
        rigid = symmetric(scipy.linalg.inv(flexible))
        seen = self.directions.T @ shapes
        pushed = caused @ rigid
        tied = rigid @ seen
        stiffness = np.block([[rigid, -tied], [-tied.T, np.diag(squares) + seen.T @ tied]])
        zero = np.zeros((b, b))
        law = scene.damping
        damping: Real = np.zeros((b + count, b + count))
        if isinstance(law, Rayleigh):
            damping[b:, b:] = np.diag(law.mass + law.stiffness * squares)
        elif law is not None:
            damping[b:, b:] = projected(shapes, sparse(law, scene.size), 1.0)
        gyroscopic: Any = None
        if scene.gyroscopic is not None:
            gyroscopic = scipy.linalg.block_diag(
                zero, projected(shapes, sparse(scene.gyroscopic, scene.size), -1.0)
            )
        offset = rest - pushed @ (self.directions.T @ rest)
        basis = np.hstack([pushed, shapes - pushed @ seen])
        return Model(
            squares=squares,
            basis=basis,
            offset=offset,
            dual=taken,
            mass=scipy.linalg.block_diag(zero, np.eye(count)),
            damping=damping,
            gyroscopic=gyroscopic,
            stiffness=symmetric(stiffness),
            circulatory=None,
            force=basis.T @ (scene.force - self.modes.stiffness @ offset),
            lumping="",
        )

    def _further(self, shapes: Real, caused: Real) -> tuple[Real, Real, Real]:
        """Return squares, psi (n, k) and ``z' V' M_z`` (k, n) of the modes for the inertia of those left out.

        One per contact direction, without those that would leave a direction no flexibility; slow ones come
        first.
        """
        flexible = self.directions.T @ caused
        try:
            pushed = self._inner(self.modes.mass @ self._inner(caused))
            moved = self._left_out(shapes, pushed)
            first, second = caused.T @ pushed, pushed.T @ moved
            # Of fewer modes than directions, combinations of the directions have no inertia.
            sizes, span = scipy.linalg.eigh(symmetric(first), symmetric(flexible))
            every = scipy.linalg.eigvalsh(
                symmetric(caused.T @ (self.modes.mass @ caused)), symmetric(flexible)
            )
            has_inertia = sizes > _CARRIED * max(every[-1], 0.0)
            span = span[:, has_inertia] / np.sqrt(sizes[has_inertia])
            inverse, mix = np.linalg.eigh(symmetric(span.T @ second @ span))
            slow = inverse > _CARRIED * inverse.max(initial=0.0)
            inverse, mix = inverse[slow][::-1], span @ mix[:, slow][:, ::-1]
            carried = (mix / np.sqrt(inverse)).T @ first
            # Parts of the flexibility: what eigenvalues leave of 1 stays without mass.
            taken = symmetric(carried @ np.linalg.solve(flexible, carried.T))
        except scipy.linalg.LinAlgError:
            return np.zeros(0), shapes[:, :0], shapes[:, :0].T
        chosen: list[int] = []
        for k in range(inverse.size):
            more = [*chosen, k]
            if np.linalg.eigvalsh(taken[np.ix_(more, more)])[-1] < 1.0 - _MASSLESS:
                chosen = more
        squares, mix = 1.0 / inverse[chosen], mix[:, chosen]
        return squares, (moved @ mix) * squares, (pushed @ mix).T

    def _inner(self, vectors: Real) -> Real:
        """Return ``P vectors``: without their contact displacements.

        Raises
        ------
        scipy.linalg.LinAlgError
            If the directions depend on one another.
        """
        directions = self.directions
        try:
            factor = splu(scipy.sparse.csc_array(directions.T @ directions))
        except RuntimeError as error:
            raise scipy.linalg.LinAlgError(str(error)) from None
        inner: Real = vectors - directions @ factor.solve(directions.T @ vectors)
        return inner

    def _left_out(self, shapes: Real, forces: Real) -> Real:
        """Return ``R forces``, (n, k): ``(K + s M) y = g + s M y`` with modes taken out of g and of y."""
        mass = self.modes.mass
        given = forces - mass @ (shapes @ (shapes.T @ forces))
        found = np.zeros(given.shape)
        for _ in range(_STEPS):
            before = found
            found = self.modes.factor.solve(given + self.modes.shift * (mass @ found))
            found -= shapes @ (shapes.T @ (mass @ found))
            if np.abs(found - before).max() <= _SETTLED * np.abs(found).max():
                break
        return found
