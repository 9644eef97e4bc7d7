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
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.faults import InputError
from stickslip.fe.reduced.contact_coordinates import Coordinate, contact_directions, sparse
from stickslip.fe.reduced.lowest_modes import LowestModes
from stickslip.fe.reduced.model import Model, dual, projected
from stickslip.scene.checks import Real
from stickslip.scene.laws.damping import Proportional
from stickslip.scene.scene import Scene

#: The shift that makes K regular where the structure moves freely, of the highest frequency wanted: the
#: correction for it shrinks by this number squared, over that of the first mode left out, in every step.
_SHIFT = 0.1
#: Relative change of R that counts as none, and steps that may lead there.
_SETTLED, _STEPS = 1e-15, 200


class MacNeal:
    """The free structure: its lowest modes, and the reduced matrices with so many of them."""

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
        """Return the reduced matrices with so many modes.

        Raises
        ------
        InputError
            If directions of contacts depend on one another.
        """
        scene, b = self.scene, len(self.kinds)
        squares, shapes = self.modes(count)
        left = self._left_out(shapes)
        caused, rest = left[:, :b], left[:, b]
        flexible = self.directions.T @ caused
        try:
            rigid = scipy.linalg.cho_solve(scipy.linalg.cho_factor(0.5 * (flexible + flexible.T)), np.eye(b))
        except scipy.linalg.LinAlgError:
            raise InputError(
                "contacts: the modes left out do not move them independently; their directions depend on one "
                "another, or there are too many modes"
            ) from None
        rigid = 0.5 * (rigid + rigid.T)
        seen = self.directions.T @ shapes
        pushed = caused @ rigid
        tied = rigid @ seen
        stiffness = np.block([[rigid, -tied], [-tied.T, np.diag(squares) + seen.T @ tied]])
        zero = np.zeros((b, b))
        law = scene.damping
        damping: Real = np.zeros((b + count, b + count))
        if isinstance(law, Proportional):
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
            dual=dual(scene, self.directions, shapes),
            mass=scipy.linalg.block_diag(zero, np.eye(count)),
            damping=damping,
            gyroscopic=gyroscopic,
            stiffness=0.5 * (stiffness + stiffness.T),
            circulatory=None,
            force=basis.T @ (scene.force - self.modes.stiffness @ offset),
            lumping="",
        )

    def _left_out(self, shapes: Real) -> Real:
        """Return ``R [B, f]``, (n, b + 1): ``(K + s M) y = g + s M y`` with modes taken out of g and of y."""
        mass = self.modes.mass
        given = np.column_stack([self.directions.toarray(), self.scene.force])
        given -= mass @ (shapes @ (shapes.T @ given))
        found = np.zeros(given.shape)
        for _ in range(_STEPS):
            before = found
            found = self.modes.factor.solve(given + self.modes.shift * (mass @ found))
            found -= shapes @ (shapes.T @ (mass @ found))
            if np.abs(found - before).max() <= _SETTLED * np.abs(found).max():
                break
        return found
