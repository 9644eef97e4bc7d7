"""All eigenvalues of a region: by shifts whose discs cover it, then by where the certificate misses some."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stickslip.modes.sparse.certificate import FACTORIZATIONS, Certificate
from stickslip.modes.sparse.pencil import SparsePencil, on_all_cores
from stickslip.modes.sparse.region import Region, contour
from stickslip.modes.sparse.shift_invert import Found, clusters, search_near
from stickslip.scene.checks import Complex

#: Distance of the contour from the band, in widths of the band.
_DISTANCE = 0.1
#: Largest number of pairs of one shift: beyond, another factorization takes less time than a larger Krylov
#: space.
_PAIRS = 120
#: Shifts that a search may take.
_SHIFTS = 200
#: Relative distance up to which eigenvalues of two shifts are the same.
_SAME = 1e-6
#: Imaginary part, relative to the modulus, up to which an eigenvalue is real.
_REAL = 1e-9
#: Searches for eigenvalues that the certificate misses.
_ROUNDS = 6
#: Width of the margin round a region, relative to its outer radius: so far a correction may move one.
MARGIN = 1e-6
#: Pairs that a search for missing ones takes.
_AGAIN = 40


@dataclass
class Search:
    """What has been found so far in the upper half plane, by shift."""

    pencil: SparsePencil
    found: list[Found] = field(default_factory=list)

    def near(self, shifts: Sequence[complex], count: int, radius: float = np.inf) -> None:
        """Search round some shifts, on all cores; `radius` is that of each."""
        seed = len(self.found)
        jobs = list(enumerate(shifts, start=seed))
        self.found += on_all_cores(
            lambda job: search_near(self.pencil, job[1], count, radius, seed=job[0]), jobs
        )

    def merged(self) -> Found:
        """Return all pairs of the upper half plane once, conjugates left out, sorted by modulus.

        Those of rigid bodies come first, which no shift has to find.
        Of a cluster that several shifts have found the one that has found most of it counts.
        """
        parts = []
        for shift, found in enumerate(self.found):
            values = found.eigenvalues
            real = np.abs(values.imag) <= _REAL * np.abs(values)
            values = np.where(real, values.real + 0.0j, values)
            parts += [(value, shift, k) for k, value in enumerate(values) if value.imag >= 0.0]
        rigid = self.pencil.rigid_bodies
        if not parts:
            return Found(0.0, 0.0, rigid.eigenvalues, rigid.right, rigid.left)
        values = np.array([part[0] for part in parts])
        unit = float(np.median(np.abs(values))) or 1.0
        chosen = []
        for group in clusters(values, _SAME, unit):
            shifts = [parts[k][1] for k in group]

            def rank(
                shift: int, group: Sequence[int] = group, shifts: Sequence[int] = shifts
            ) -> tuple[int, float]:
                distance = abs(self.found[shift].shift - values[group[0]])
                return shifts.count(shift), -distance

            best = max(set(shifts), key=rank)
            chosen += [k for k in group if parts[k][1] == best]
        chosen.sort(key=lambda k: (abs(values[k]), values[k].imag, values[k].real))
        columns = [parts[k] for k in chosen]
        right = np.stack([self.found[shift].right[:, k] for _, shift, k in columns], axis=1)
        left = np.stack([self.found[shift].left[:, k] for _, shift, k in columns], axis=1)
        return Found(
            0.0,
            0.0,
            np.concatenate([rigid.eigenvalues, values[chosen]]),
            np.concatenate([rigid.right, right], axis=1),
            np.concatenate([rigid.left, left], axis=1),
        )

    def uncovered(self, low: float, high: float, width: float) -> list[tuple[float, float]]:
        """Return the parts of [low, high] on the imaginary axis that no disc covers to either side."""
        gaps = [(low, high)]
        for found in self.found:
            reach = found.radius**2 - (width + abs(found.shift.real)) ** 2
            if not reach > 0.0:
                continue
            start, stop = found.shift.imag - np.sqrt(reach), found.shift.imag + np.sqrt(reach)
            cut = [part for a, b in gaps for part in ((a, min(b, start)), (max(a, stop), b))]
            gaps = [(a, b) for a, b in cut if b - a > 1e-9 * (high - low)]
        return gaps


@dataclass(frozen=True)
class Answer:
    """Pairs of a region and of a margin round it, and what is known about those missing."""

    found: Found
    missing: float
    doubts: tuple[str, ...]
    factorizations: int
    shifts: int


def with_conjugates(values: Complex) -> Complex:
    """Return eigenvalues of the upper half plane with the conjugates of those that are not real."""
    return np.concatenate([values, values[values.imag != 0.0].conj()])


def search_region(pencil: SparsePencil, region: Region) -> Answer:
    """Return all pairs of a region, found by shifts that cover it and certified by the winding of det P."""
    search = Search(pencil)
    return certified(search, region, covered(search, region))


def covered(search: Search, region: Region) -> float:
    """Add shifts until their discs cover a region and its surroundings; return how wide these are, 1/s."""
    span = region.high - region.low
    width = _DISTANCE * span
    while True:
        low, high = max(region.low - 2.0 * width, 0.0), region.high + 2.0 * width
        gaps = search.uncovered(low, high, 2.0 * width)
        if not gaps or len(search.found) >= _SHIFTS or not width > 1e-9 * span:
            return width
        if not search.found:
            middle = 0.5 * (low + high)
            gaps = [(low, middle), (middle, high)]
        shifts = [0.5j * (a + b) for a, b in gaps]
        radius = max(float(np.hypot(0.5 * (b - a), 2.0 * width)) for a, b in gaps) * (1.0 + 1e-6)
        search.near(shifts, _PAIRS, radius)
        # Where eigenvalues are too many for discs of this width, it shrinks.
        width = min(width, min(found.radius for found in search.found) / 3.0)


def certified(search: Search, region: Region, width: float) -> Answer:
    """Return what a search has found in a region, after going on for what the certificate misses.

    The contour lies `width` beyond the bounds of the region, 1/s.
    """
    outer = region.wider(width)
    distance = width
    while 2 * (len(contour(outer, distance)) + 1) > FACTORIZATIONS:
        distance *= 1.2
    certificate = Certificate.of(search.pencil, outer, distance)
    merged = search.merged()
    for _ in range(_ROUNDS):
        known = with_conjugates(merged.eigenvalues)
        while certificate.refined(known):
            pass
        missing, first, second = certificate.moments(known)
        if round(missing) < 1:
            break
        # The mean of missing eigenvalues in the upper half plane, from sums over them and their conjugates.
        real = first / missing
        shift = complex(real, np.sqrt(max(real * real - second / missing, 0.0)))
        before = merged.eigenvalues.size
        search.near([shift * (1.0 + 1e-3), shift], _AGAIN)
        merged = search.merged()
        if merged.eigenvalues.size == before:
            break
    known = with_conjugates(merged.eigenvalues)
    missing = certificate.missing(known)
    doubts = []
    if abs(missing) >= 0.5:
        doubts.append(f"{missing:.2f} eigenvalues of the region round the band are missing")
    elif certificate.unresolved(known):
        doubts.append(
            "the winding of det P is not known: an eigenvalue lies near the contour, which "
            f"{certificate.factorizations} factorizations don't resolve"
        )
    inside = region.holds(merged.eigenvalues, MARGIN * region.high)
    return Answer(merged.kept(inside), missing, tuple(doubts), certificate.factorizations, len(search.found))
