"""A curve over two parameters on which stability ends, and a point at which two conditions hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from stickslip.scene.checks import Flags, Index, Real

OrbitKind = Literal["fold", "period_doubling", "torus", "grazing", "switching"]
CurveKind = Literal["hopf", "divergence", "separation"] | OrbitKind
PointKind = Literal[
    "double_hopf", "zero_hopf", "zero_frequency", "degenerate", "separation",
    "cusp", "second_multiplier", "resonance", "sequence", "tangency",
]  # fmt: skip


@dataclass(frozen=True, repr=False, eq=False)
class BoundaryCurve:
    """A curve over two parameters on which stability, or steady sliding, begins or ends.

    Attributes
    ----------
    kind
        ``hopf``: a complex pair crosses the imaginary axis; ``divergence``: a real eigenvalue crosses zero;
        ``separation``: the normal force of a contact vanishes in steady sliding, or the gap of an open one;
        a kind of `BranchPoint`: it holds of a periodic orbit, see `BifurcationCurve`.
    names
        Names of the two parameters.
    values
        The parameters at the points of the curve, in order, (k, 2). Of a closed curve the last point is the
        first.
    tangents
        Directions of the curve at its points, as parts of the ranges, (k, 2); of length 1 or, where the
        frequency changes as well, less. The cubic with these tangents is the curve between its points.
    frequency
        ``|lambda| / 2 pi`` at the points, Hz; zero of a divergence, nan of a separation, (k,).
    unstable_modes
        How many other modes grow there, (k,): where none does, a stable region ends at the curve.
    steady_sliding
        Whether steady sliding exists at the points, (k,): on a separation, whether all other contacts stay as
        they are. Where it is False, only the linear system has the curve.
    error
        By how much the condition misses at the points, (k,): the least singular value of the dynamic
        stiffness, whose rows and columns have size 1; of a separation the normal force, of its terms.
        For a large scene with a `band`, on a Hopf curve: the growth rate of the mode of the scene, of its
        modulus.
    missing
        How many eigenvalues of a `band` were not found at the points, (k,): 0.00 to some digits if none is
        missing; nan where they are not counted, which is at three of four points, and at all after Ctrl-C.
        Zero where all eigenvalues are computed.
    ends
        Why the curve ends at either side: ``range`` of a parameter, ``band`` where the frequency leaves it,
        ``zero_frequency``, ``closed``;
        ``corner`` where another curve goes on in another direction, as at a knot of a table or where two
        modes become one; ``lost`` if it could not be followed any further, which is a doubt.
    contact, name
        Index and name of the contact that separates; None elsewhere.
    """

    kind: CurveKind
    names: tuple[str, str]
    values: Real
    tangents: Real
    frequency: Real
    unstable_modes: Index
    steady_sliding: Flags
    error: Real
    missing: Real
    ends: tuple[str, str]
    contact: int | None = None
    name: str | None = None

    @property
    def incomplete(self) -> Flags:
        """Whether an eigenvalue of the band was not found at the points, (k,)."""
        found: Flags = np.abs(self.missing) >= 0.5
        return found

    @property
    def closed(self) -> bool:
        """Whether it comes back to where it starts."""
        return self.ends[0] == "closed"

    def drawn(self, spans: tuple[float, float], parts: int = 12) -> Real:
        """Return points on the cubics between the points of the curve, (n, 2).

        Parameters
        ----------
        spans
            Widths of the ranges.
        parts
            Points drawn for each point of the curve.
        """
        places, tangents = self.values / spans, self.tangents
        t = np.linspace(0.0, 1.0, parts, endpoint=False)[None, :, None]
        step = np.diff(places, axis=0)
        ways = np.linalg.norm(step, axis=1)[:, None]
        lengths = np.maximum(np.linalg.norm(tangents, axis=1), 1e-300)[:, None]
        unit = tangents / lengths
        s, r = t * t * (3.0 - 2.0 * t), t * (1.0 - t)
        bends = (1.0 - t) * (ways * unit[:-1])[:, None] - t * (ways * unit[1:])[:, None]
        between = places[:-1, None] + s * step[:, None] + r * bends
        whole: Real = np.concatenate([between.reshape(-1, 2), places[-1:]]) * spans
        return whole

    def __repr__(self) -> str:
        places = " to ".join(f"({a:.6g}, {b:.6g})" for a, b in self.values[[0, -1]])
        what = self.kind if self.name is None else f"{self.kind} of contact {self.name}"
        shape = "closed" if self.closed else places
        return f"BoundaryCurve({what} over {', '.join(self.names)}: {shape}, {len(self.values)} points)"


@dataclass(frozen=True)
class CodimensionTwo:
    """A point over two parameters at which two conditions hold.

    Attributes
    ----------
    kind
        ``double_hopf``: two pairs are on the imaginary axis; ``zero_hopf``: a pair and a real eigenvalue;
        ``zero_frequency``: the frequency of a Hopf curve vanishes, and it ends on a divergence;
        ``degenerate``: the curve turns in one of the parameters, over the other one growth touches zero;
        ``separation``: a contact separates on a Hopf curve; those of periodic orbits: see `BifurcationCurve`.
    values
        The two parameters by name.
    frequencies
        Those of the modes on the imaginary axis, Hz, ascending.
    parameter
        Of a degenerate point the parameter that has an extreme there on its curve; None elsewhere.
    contact, name
        Index and name of the contact that separates, or at whose event a sequence changes; None elsewhere.
    multiplier
        Of a periodic orbit the second one on the unit circle, or that which a pair becomes; None elsewhere.
    """

    kind: PointKind
    values: Mapping[str, float]
    frequencies: tuple[float, ...]
    parameter: str | None = None
    contact: int | None = None
    name: str | None = None
    multiplier: complex | None = None

    @property
    def remark(self) -> str:
        """What the kind leaves open, in words."""
        if self.multiplier is not None:
            return f"multiplier {self.multiplier:.6g}"
        if self.parameter is not None:
            return f"extreme of {self.parameter}"
        return "" if self.contact is None else f"contact {self.name}"


def pieces(
    curve: BoundaryCurve, spans: tuple[float, float], points: Sequence[CodimensionTwo]
) -> list[tuple[Real, int]]:
    """Return the stretches of a curve that look alike: points as of `drawn`, and how they look.

    0: there is no steady sliding; 1: other modes grow; 2: stability ends there. A look changes at a point of
    codimension two, or half way between two points of the curve where none is near.
    """
    drawn = curve.drawn(spans)
    parts = (len(drawn) - 1) // max(len(curve.values) - 1, 1)
    looks = np.where(curve.steady_sliding, 1 + (curve.unstable_modes == 0), 0)
    meet = [[point.values[name] for name in curve.names] for point in points if point.kind != "degenerate"]
    places = np.reshape(meet, (-1, 2)) / spans
    steps = np.repeat(looks[:-1], parts)
    for k in np.flatnonzero(np.diff(looks)):
        way = drawn[k * parts : (k + 1) * parts + 1] / spans
        distances = np.linalg.norm(way - places[:, None], axis=2).min(axis=0, initial=np.inf)
        near = distances.min() < np.linalg.norm(way[-1] - way[0])
        cut = int(distances.argmin()) if near else parts // 2
        steps[k * parts + cut : (k + 1) * parts] = looks[k + 1]
    begins = [0, *(np.flatnonzero(np.diff(steps)) + 1), len(steps)]
    return [(drawn[a : b + 1], int(steps[a])) for a, b in pairwise(begins) if b > a]
