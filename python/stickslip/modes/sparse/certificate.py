"""How many eigenvalues inside a contour are not among those found: the winding of what is left of det P.

``det P(z) = c prod (z - lambda_j)`` winds about zero once for every eigenvalue inside. With the found ones
and a factor without zeros divided out

    f(z) = det P(z) / (e^p(z) prod_found (z - lambda_j)),   missing = 1 / (2 pi j)  integral of d log f

is zero if they are all. The polynomial p takes what the many eigenvalues far outside do; it is the one that
leaves the smallest slopes on the contour. Then log f knows no eigenvalue nearer than those not found, and few
places suffice where counting all takes thousands. Two factorizations next to a place give the slope of log f
there, and its value up to whole turns of its phase. Over a panel of length h the slopes at its ends tell how
far log f turns, so that no whole turn is lost:

    log f(z_1) - log f(z_0) = (z_1 - z_0) / 2 (s_0 + s_1) + e,   s = d log f / dz

An eigenvalue at the distance d from the middle of a panel leaves a difference e of ``2 atan(h / 2 d) - h d /
(d^2 + h^2 / 4)`` in the phase, and changes the slope by ``h / (d^2 + h^2 / 4)``. Several that lie together,
whose turns may add up to a whole one, change the slope so much more. Panels on which one of both is large are
halved. The moments with z and z^2, by the cubics through values and slopes, tell where the missing ones are.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stickslip.modes.sparse.pencil import SparsePencil, on_all_cores
from stickslip.modes.sparse.region import Panel, Region, contour, is_mirrored
from stickslip.scene.checks import Complex, Real

#: Distance of the two factorizations from a place, in lengths of its panel: rounding of log det P, some
#: 1e-11, and the curvature of its slope both stay below 1e-6.
_STEP = 1e-3
#: Factorizations that a certificate may take.
FACTORIZATIONS = 150
#: Largest difference e, and largest change of the slope times the length, of a panel that is not halved.
_DIFFERENCE, _BEND = 0.4, 2.0
#: Degree of the slope of p.
_DEGREE = 4
#: Gauss points of a panel for the moments.
_POINTS = 4


@dataclass
class Certificate:
    """Samples of det P on a contour; found eigenvalues are divided out afterwards, as often as wanted."""

    pencil: SparsePencil
    region: Region
    panels: list[Panel]
    #: The places before and behind each end of a panel, and log det P there.
    samples: dict[complex, tuple[Complex, Complex]] = field(default_factory=dict)

    @classmethod
    def of(cls, pencil: SparsePencil, region: Region, distance: float) -> Certificate:
        """Return samples round a region; eigenvalues keep a distance, 1/s, from its bounds."""
        certificate = cls(pencil, region, contour(region, distance))
        certificate._sample(certificate.panels)
        return certificate

    @property
    def factorizations(self) -> int:
        """Return the number of factorizations taken."""
        return 2 * len(self.samples)

    def _key(self, place: complex) -> complex:
        # Curves meet up to rounding.
        return complex(np.round(place / self.region.high, 12))

    def _sample(self, panels: list[Panel]) -> None:
        pairs = {}
        for panel in panels:
            places, slopes = panel.ends()
            steps = _STEP * panel.length * slopes / np.abs(slopes)
            for place, step in zip(places, steps, strict=True):
                if (key := self._key(place)) not in self.samples:
                    pairs[key] = np.array([place - step, place + step])
        wanted = [z for pair in pairs.values() for z in pair]
        logs = np.array(on_all_cores(self.pencil.log_determinant, wanted)).reshape(-1, 2)
        self.samples |= {key: (pairs[key], log) for key, log in zip(pairs, logs, strict=True)}

    def _changes(self, found: Complex) -> tuple[Complex, Complex, Complex]:
        """Return the change of log f over each panel, (k,), both ends, and the slopes there, (k, 2) each."""
        before, behind = np.array([pair for pair, _ in self.samples.values()]).T
        logs = np.array([log for _, log in self.samples.values()])
        logs = logs - np.stack([np.log(z[:, None] - found).sum(axis=1) for z in (before, behind)], axis=1)
        step = _whole_turns_less(logs[:, 1] - logs[:, 0])
        places, values, slopes = 0.5 * (before + behind), logs[:, 0] + 0.5 * step, step / (behind - before)
        row = {key: k for k, key in enumerate(self.samples)}
        rows = np.array([[row[self._key(place)] for place in panel.ends()[0]] for panel in self.panels])
        ends = places[rows]
        # Where an eigenvalue is near, panels are short.
        nearest = np.bincount(rows.ravel(), np.repeat(np.abs(ends[:, 1] - ends[:, 0]), 2)).astype(float)
        smooth = _fit(places, slopes, nearest, self.region.high)
        values, slopes = values - smooth.integ()(places), (slopes - smooth(places))[rows]
        by_slopes = (ends[:, 1] - ends[:, 0]) * slopes.mean(axis=1)
        change = by_slopes + _whole_turns_less(values[rows[:, 1]] - values[rows[:, 0]] - by_slopes)
        return change, ends, slopes

    def moments(self, found: Complex) -> Real:
        """Return the sums of 1, z and z^2 over the missing eigenvalues, conjugates included, (3,).

        `found` holds eigenvalues inside and outside, conjugates included.
        """
        change, ends, slopes = self._changes(found)
        way = ends[:, 1] - ends[:, 0]
        first, last = (way * slope for slope in slopes.T)
        total = np.zeros(3, dtype=complex)
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
        for t, weight in zip(0.5 * (1.0 + nodes), 0.5 * weights, strict=True):
            slope = 6.0 * t * (1.0 - t) * change
            slope += (1.0 - t) * (1.0 - 3.0 * t) * first + t * (3.0 * t - 2.0) * last
            total += [(weight * slope * (ends[:, 0] + t * way) ** k).sum() for k in range(3)]
        if is_mirrored(self.region):
            # The other half is the conjugate run backwards.
            return np.asarray(total.imag / np.pi)
        # The mirrored contour has the conjugates inside.
        return np.asarray(2.0 * (total / (2j * np.pi)).real)

    def missing(self, found: Complex) -> float:
        """Return the number of eigenvalues inside that are not among those found, conjugates included."""
        return float(self.moments(found)[0])

    def unresolved(self, found: Complex) -> list[int]:
        """Return the panels whose slopes do not tell how far log f turns, the worst first."""
        change, ends, slopes = self._changes(found)
        way = ends[:, 1] - ends[:, 0]
        difference, bend = change - way * slopes.mean(axis=1), way * (slopes[:, 1] - slopes[:, 0])
        doubt = np.maximum(np.abs(difference) / _DIFFERENCE, np.abs(bend) / _BEND)
        return [int(k) for k in np.argsort(-doubt) if not doubt[k] <= 1.0]

    def refined(self, found: Complex) -> bool:
        """Halve panels that are not resolved while factorizations are left; say whether any."""
        room = (FACTORIZATIONS - self.factorizations) // 2
        halved = self.unresolved(found)[:room]
        halves = [half for k in halved for half in self.panels[k].halves()]
        self._sample(halves)
        self.panels = [panel for k, panel in enumerate(self.panels) if k not in halved] + halves
        return bool(halved)


def _fit(places: Complex, slopes: Complex, weights: Real, unit: float) -> np.polynomial.Polynomial:
    """Return the polynomial with real coefficients nearest to slopes at places."""
    powers = weights[:, None] * (places / unit)[:, None] ** np.arange(min(_DEGREE, places.size - 1) + 1)
    weighted = weights * slopes
    coefficients = np.linalg.lstsq(
        np.concatenate([powers.real, powers.imag]), np.concatenate([weighted.real, weighted.imag]), rcond=None
    )[0]
    return np.polynomial.Polynomial(coefficients / unit ** np.arange(coefficients.size))


def _whole_turns_less(change: Complex) -> Complex:
    """Return changes of a logarithm without whole turns: by at most half a turn."""
    return change.real + 1j * (np.mod(change.imag + np.pi, 2.0 * np.pi) - np.pi)
