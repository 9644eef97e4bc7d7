"""The space that the modes of a band of some scenes span, and the matrices projected on it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from stickslip.locus.path import Interpolation
from stickslip.modes.complex_modes import band_modes
from stickslip.modes.modes import Modes
from stickslip.modes.sparse.pencil import SparsePencil, sparse_array
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Complex, Flags, Real
from stickslip.scene.scene import Scene

#: Relative error of a projected eigenvalue, times its condition, up to which the space is large enough.
_PROJECTED = 1e-9
#: Directions of the space smaller than this, of vectors of length 1, are left out: an eigenvalue errs by the
#: square.
_DIRECTION = 1e-7
#: The same of equilibria: normal forces err by what is left out itself.
_FORCE = 1e-11
#: Error of an interpolant of projected entries, of the largest of its row: sums of large terms that cancel.
INTERPOLATED = 1e-9
#: Width beyond the band, of its own, from which modes are taken into the space.
_BEYOND = 0.1


@dataclass
class BandSpace:
    """What right and left modes of a band, and equilibria, of some scenes of a family span."""

    #: The status combination of all of them.
    letters: str
    region: Region
    #: Units of coordinates; empty before any modes are taken.
    scaling: Real = field(default_factory=lambda: np.zeros(0))
    #: Which coordinates slip without mass, (m,).
    first_order: Flags = field(default_factory=lambda: np.zeros(0, dtype=bool))
    #: Real and imaginary parts of vectors of length 1, (m, k) each.
    columns: list[Real] = field(default_factory=list)
    #: Equilibria of length 1, (m,) each.
    equilibria: list[Real] = field(default_factory=list)

    def modes(self, scene: Scene, certify: bool) -> Modes:
        """Return the modes of the band of a scene and of its surroundings, counted if wanted."""
        wide = self.region.wider(_BEYOND * (self.region.high - self.region.low))
        return band_modes(scene, self.letters, SparsePencil.of(scene, self.letters), wide, certify)

    def take(self, scene: Scene, modes: Modes) -> Modes:
        """Take modes of a scene and its equilibrium into the space; return those that have vectors."""
        modes = modes[~modes.defective]
        if not self.scaling.size:
            inertia = np.abs(modes.mass.diagonal())
            self.scaling = 1.0 / np.sqrt(np.where(inertia > 0.0, inertia, 1.0))
            self.first_order = inertia == 0.0
        parts = []
        for vectors in (modes.right_displacement, modes.left_displacement):
            scaled = vectors / self.scaling[:, None]
            # Parts that are rounding of a vector stay small beside it.
            lengths = np.linalg.norm(scaled, axis=0)
            parts += [scaled.real / lengths, scaled.imag / lengths]
        self.columns.append(np.concatenate(parts, axis=1))
        self.take_equilibrium(scene)
        return modes

    def take_equilibrium(self, scene: Scene) -> None:
        """Take the equilibrium of a scene into the space: normal forces are those of it."""
        rest = self._equilibrium(scene)
        if rest is not None and rest.any():
            scaled = rest / self.scaling
            self.equilibria.append(scaled / np.linalg.norm(scaled))

    def _equilibrium(self, scene: Scene) -> Real | None:
        """Return displacements in equilibrium, (m,); None where the stiffness is singular."""
        load: Real = scene.core.statics(self.letters)[0][0]
        if not load.any():
            return load
        stiffness = sparse_array(scene.core.sparse_pencil(self.letters)[2]).tocsc()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", scipy.sparse.linalg.MatrixRankWarning)
            rest: Real = scipy.sparse.linalg.spsolve(stiffness, load)
        return rest if np.isfinite(rest).all() else None

    def margins(self, scene: Scene) -> Real | None:
        """Return the margins of a scene, (c,); None where the stiffness is singular."""
        rest = self._equilibrium(scene)
        _, rows, offsets, _ = scene.core.statics(self.letters)
        return None if rest is None else rows @ rest - offsets[0]

    def basis(self) -> Real:
        """Return independent directions of the space, (m, r)."""
        spaces = []
        # Slip under a law may have no mass: directions of its own have none in the space either.
        for part in (~self.first_order, self.first_order):
            modes = _space(np.concatenate(self.columns, axis=1), part, _DIRECTION)
            spaces.append(modes)
            if self.equilibria:
                rests = np.stack(self.equilibria, axis=1)
                # Twice, so that rounding leaves nothing of the modes.
                for _ in range(2):
                    rests = rests - modes @ (modes.T @ rests)
                spaces.append(_space(rests, part, _FORCE))
        basis: Real = np.concatenate(spaces, axis=1) * self.scaling[:, None]
        return basis


def agree(region: Region, exact: Complex, condition: Real, ritz: Complex) -> bool:
    """Return whether projected eigenvalues are the exact ones (k,) of a band, with conditions (k,)."""
    inside = region.holds(exact)
    projected = ritz[region.holds(ritz) & (ritz.imag >= 0.0)]
    if not inside.any():
        return projected.size == 0
    error = np.abs(exact[inside][:, None] - ritz).min(axis=1)
    close = error <= _PROJECTED * condition[inside] * np.abs(exact[inside])
    return bool(close.all()) and projected.size == np.count_nonzero(inside)


@dataclass
class Projected(Interpolation):
    """Samples of the reduced matrices projected on a basis, (m, r)."""

    basis: Real = field(default_factory=lambda: np.zeros((0, 0)))

    def is_proportional(self, scene: Scene) -> bool:
        """Return False: C is projected as it is."""
        return False

    def matrices(self, scene: Scene) -> tuple[Real, ...]:
        """Return the projected M, C and K and the statics."""
        pencil = [sparse_array(parts) for parts in scene.core.sparse_pencil(self.letters)]
        load, rows, offsets, speeds = scene.core.statics(self.letters)
        projected = [np.ascontiguousarray(self.basis.T @ (matrix @ self.basis)) for matrix in pencil]
        return (*projected, load @ self.basis, rows @ self.basis, offsets, speeds)


def _space(columns: Real, part: Flags, least: float) -> Real:
    """Return orthonormal directions of what columns span in a part of their rows; zero in the others.

    Directions smaller than `least`, of the largest column or of 1, are left out.
    """
    directions, sizes, _ = scipy.linalg.svd(columns[part], full_matrices=False)
    wanted = sizes > least * max(sizes.max(initial=0.0), 1.0)
    space = np.zeros((part.size, np.count_nonzero(wanted)))
    space[part] = directions[:, wanted]
    return space
