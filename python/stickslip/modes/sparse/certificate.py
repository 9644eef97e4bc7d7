"""How many eigenvalues inside a contour are not among those found: the winding of what is left of det P.

``det P(z) = c prod (z - lambda_j)`` winds about zero once for every eigenvalue inside. With the found ones
divided out

    missing = 1 / (2 pi j)  integral of d/dz (log det P(z) - sum_found log(z - lambda_j)) dz

is zero if they are all, and the integrand knows no eigenvalue nearer than those not found: few Gauss points
suffice where counting all takes thousands. The slope of log det P comes from two factorizations next to each
point, whose phases differ by less than half a turn, so that nothing is counted wrong by a whole one. The
moments with z and z^2 tell where the missing ones are.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stickslip.modes.sparse.pencil import SparsePencil, on_all_cores
from stickslip.modes.sparse.region import POINTS, Panel, Region, contour, is_mirrored
from stickslip.scene.checks import Complex, Real

#: Distance of the two factorizations from a point, in lengths of its panel: rounding of log det P, some
#: 1e-11, and the curvature of its slope both stay below 1e-6.
_STEP = 1e-3
#: Factorizations that a certificate may take.
FACTORIZATIONS = 150


@dataclass
class Certificate:
    """Samples of det P on a contour; found eigenvalues are divided out afterwards, as often as wanted."""

    pencil: SparsePencil
    region: Region
    panels: list[Panel]
    #: log det P behind less before each Gauss point, by panel
    differences: list[Complex] = field(default_factory=list)

    @classmethod
    def of(cls, pencil: SparsePencil, region: Region, distance: float) -> Certificate:
        """Return samples round a region; eigenvalues keep a distance, 1/s, from its bounds."""
        certificate = cls(pencil, region, contour(region, distance))
        certificate.differences = certificate._sampled(certificate.panels)
        return certificate

    @property
    def factorizations(self) -> int:
        """Return the number of factorizations taken."""
        return 2 * POINTS * len(self.panels)

    def _sampled(self, panels: list[Panel]) -> list[Complex]:
        places = [z for panel in panels for pair in _pairs(panel) for z in pair]
        logs = np.array(on_all_cores(self.pencil.log_determinant, places)).reshape(len(panels), POINTS, 2)
        return list(logs[:, :, 1] - logs[:, :, 0])

    def slopes(self, found: Complex) -> list[Complex]:
        """Return the integrand at the Gauss points of each panel."""
        result = []
        for panel, differences in zip(self.panels, self.differences, strict=True):
            before, behind = _pairs(panel).T
            divided = np.log((behind[:, None] - found) / (before[:, None] - found)).sum(axis=1)
            change = differences - divided
            # The phase is known up to whole turns, and changes by less than half of one.
            change = change.real + 1j * (np.mod(change.imag + np.pi, 2.0 * np.pi) - np.pi)
            result.append(change / (behind - before))
        return result

    def moments(self, found: Complex) -> Real:
        """Return the sums of 1, z and z^2 over the missing eigenvalues, conjugates included, (3,).

        `found` holds eigenvalues inside and outside, conjugates included.
        """
        total = np.zeros(3, dtype=complex)
        for panel, slopes in zip(self.panels, self.slopes(found), strict=True):
            places, weights = panel.nodes()
            total += [(weights * slopes * places**k).sum() for k in range(3)]
        if is_mirrored(self.region):
            # The other half is the conjugate run backwards.
            return np.asarray(total.imag / np.pi)
        # The mirrored contour has the conjugates inside.
        return np.asarray(2.0 * (total / (2j * np.pi)).real)

    def missing(self, found: Complex) -> float:
        """Return the number of eigenvalues inside that are not among those found, conjugates included."""
        return float(self.moments(found)[0])

    def doubt(self, found: Complex) -> float:
        """Return the largest part of the winding that a panel leaves unresolved: its last Legendre terms."""
        return float(max(self._tails(found), default=0.0))

    def _tails(self, found: Complex) -> list[float]:
        nodes, weights = np.polynomial.legendre.leggauss(POINTS)
        # The last two coefficients of the interpolating Legendre series.
        degrees = np.array([POINTS - 2, POINTS - 1])
        series = np.polynomial.legendre.legvander(nodes, POINTS - 1)[:, degrees]
        project = (degrees + 0.5)[:, None] * (series * weights[:, None]).T
        tails = []
        for panel, slopes in zip(self.panels, self.slopes(found), strict=True):
            _, dz = panel.nodes()
            parts = project @ (slopes * dz / weights)
            # Gauss quadrature squares the decay of the series.
            tails.append(float(np.abs(parts).max()) ** 2 / max(float(np.abs(slopes * dz).sum()), 1e-300))
        return tails

    def refined(self, found: Complex, tolerance: float) -> bool:
        """Halve panels that leave most unresolved while factorizations are left; say whether any."""
        room = (FACTORIZATIONS - self.factorizations) // (2 * POINTS)
        tails = self._tails(found)
        worst = [k for k in np.argsort(tails)[::-1][:room] if tails[k] > tolerance]
        if not worst:
            return False
        chosen = set(worst)
        halves = [half for k in worst for half in self.panels[k].halves()]
        samples = self._sampled(halves)
        kept = [k for k in range(len(self.panels)) if k not in chosen]
        self.panels = [self.panels[k] for k in kept] + halves
        self.differences = [self.differences[k] for k in kept] + samples
        return True


def _pairs(panel: Panel) -> Complex:
    """Return the two places next to each Gauss point at which det P is taken, (points, 2)."""
    places, weights = panel.nodes()
    along = weights / np.abs(weights)
    step = _STEP * np.abs(weights).sum() * along
    return np.stack([places - step, places + step], axis=1)
