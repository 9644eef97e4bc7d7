"""Boundaries of stability over two parameters: one curve, points at which curves meet, and all of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args, overload

import numpy as np
import xarray as xr

from stickslip.scene.checks import Flags, Index, Real
from stickslip.scene.parameters.values import apart
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CurveKind = Literal["hopf", "divergence", "separation"]
#: All kinds of curves.
CURVES: tuple[CurveKind, ...] = get_args(CurveKind)
PointKind = Literal["double_hopf", "zero_hopf", "zero_frequency", "degenerate", "separation"]


@dataclass(frozen=True, repr=False, eq=False)
class BoundaryCurve:
    """A curve over two parameters on which stability, or steady sliding, begins or ends.

    Attributes
    ----------
    kind
        ``hopf``: a complex pair crosses the imaginary axis; ``divergence``: a real eigenvalue crosses zero;
        ``separation``: the normal force of a contact vanishes in steady sliding, or the gap of an open one.
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
    ends
        Why the curve ends at either side: ``range`` of a parameter, ``zero_frequency``, ``closed``, or
        ``lost`` if it could not be followed any further.
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
    ends: tuple[str, str]
    contact: int | None = None
    name: str | None = None

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
        what = f"{self.kind} of contact {self.name}" if self.kind == "separation" else self.kind
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
        ``separation``: a contact separates on a Hopf curve.
    values
        The two parameters by name.
    frequencies
        Those of the modes on the imaginary axis, Hz, ascending.
    parameter
        Of a degenerate point the parameter that has an extreme there on its curve; None elsewhere.
    contact, name
        Index and name of the contact that separates; None elsewhere.
    """

    kind: PointKind
    values: Mapping[str, float]
    frequencies: tuple[float, ...]
    parameter: str | None = None
    contact: int | None = None
    name: str | None = None

    @property
    def remark(self) -> str:
        """What the kind leaves open, in words."""
        if self.parameter is not None:
            return f"extreme of {self.parameter}"
        return "" if self.contact is None else f"contact {self.name}"


class StabilityBoundary(Sequence[BoundaryCurve], Shown):
    """The curves over two parameters on which stability of sliding ends, see `stability_boundary`.

    Attributes
    ----------
    parameters
        Ranges by name, two of them.
    points
        The points of codimension two.
    map
        Largest ``growth_rate``, 1/s (nan where there is no steady sliding), over the two parameters, at the
        places at which counts of growing modes were compared with the curves.
    resolution
        By name the distance of lines searched: a curve that is wider than it in a parameter meets a line, and
        is not missed.
    doubts
        What could not be settled, in words; none: every count agrees with the curves.
    """

    def __init__(
        self,
        parameters: Mapping[str, tuple[float, float]],
        curves: Iterable[BoundaryCurve],
        points: Iterable[CodimensionTwo],
        growth: xr.Dataset,
        resolution: Mapping[str, float],
        doubts: Iterable[str],
    ) -> None:
        self.parameters = dict(parameters)
        self._curves = tuple(curves)
        self.points = tuple(points)
        self.map = growth
        self.resolution = dict(resolution)
        self.doubts = tuple(doubts)

    def __len__(self) -> int:
        return len(self._curves)

    @overload
    def __getitem__(self, place: int) -> BoundaryCurve: ...
    @overload
    def __getitem__(self, place: slice) -> StabilityBoundary: ...
    def __getitem__(self, place: int | slice) -> BoundaryCurve | StabilityBoundary:
        """Return a curve, or the boundary with those of a slice."""
        if isinstance(place, slice):
            kept = self._curves[place]
            return StabilityBoundary(
                self.parameters, kept, self.points, self.map, self.resolution, self.doubts
            )
        return self._curves[place]

    @property
    def spans(self) -> tuple[float, float]:
        """Widths of the two ranges."""
        first, second = (upper - lower for lower, upper in self.parameters.values())
        return first, second

    def to_dataset(self) -> xr.Dataset:
        """Return all of it: curves over ``point``, those of codimension two over ``special``, and the map.

        ``curve`` is the number of the curve of a point. The parameters of a point are ``at_<name>``, those of
        a point of codimension two ``special_<name>``; the parameters themselves are the axes of the map.
        """
        sizes = [len(curve.values) for curve in self]

        def column(of: str, kind: Any, **attrs: str) -> tuple[str, Any, dict[str, str]]:
            parts = [np.broadcast_to(getattr(curve, of), n) for curve, n in zip(self, sizes, strict=True)]
            return "point", np.concatenate([np.zeros(0, dtype=kind), *parts]).astype(kind), attrs

        def texts(dim: str, given: Iterable[str]) -> tuple[str, Any]:
            return dim, np.array(list(given), dtype=str)

        places = np.concatenate([np.zeros((0, 2)), *(curve.values for curve in self)])
        tangents = np.concatenate([np.zeros((0, 2)), *(curve.tangents for curve in self)])
        variables: dict[str, Any] = {
            "curve": ("point", np.repeat(np.arange(len(self)), sizes)),
            "frequency": column("frequency", float, units="Hz"),
            "unstable_modes": column("unstable_modes", int),
            "steady_sliding": column("steady_sliding", bool),
            "error": column("error", float, units="1"),
            "kind": texts("number", (curve.kind for curve in self)),
            "contact": texts("number", (curve.name or "" for curve in self)),
            "begin": texts("number", (curve.ends[0] for curve in self)),
            "end": texts("number", (curve.ends[1] for curve in self)),
            "special_kind": texts("special", (point.kind for point in self.points)),
            "special_parameter": texts("special", (point.parameter or "" for point in self.points)),
            "special_contact": texts("special", (point.name or "" for point in self.points)),
            "growth_rate": self.map.growth_rate,
        }
        most = max((len(point.frequencies) for point in self.points), default=0)
        frequencies = np.full((len(self.points), most), np.nan)
        for row, point in zip(frequencies, self.points, strict=True):
            row[: len(point.frequencies)] = point.frequencies
        variables["special_frequency"] = (("special", "order"), frequencies, {"units": "Hz"})
        for axis, name in enumerate(self.parameters):
            units = self.map[name].attrs
            variables[f"at_{name}"] = ("point", places[:, axis], units)
            variables[f"tangent_{name}"] = ("point", tangents[:, axis], {"units": "1"})
            at = np.array([point.values[name] for point in self.points], dtype=float)
            variables[f"special_{name}"] = ("special", at, units)
        attrs: dict[str, Any] = {f"resolution_{name}": width for name, width in self.resolution.items()}
        attrs["doubts"] = list(self.doubts)
        return xr.Dataset(
            apart(variables, self.parameters),
            coords={"number": np.arange(len(self)), **{name: self.map[name] for name in self.parameters}},
            attrs=attrs,
        )

    def plot(self, *, growth: bool = True, ax: Axes | None = None) -> Axes:
        """Draw the curves on the map of growth, the second parameter across; return the Axes.

        Parameters
        ----------
        growth
            Whether to draw the map; without it curves are drawn on what the axes show.
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.locus.boundary.figures import stability_boundary

        return stability_boundary(self, growth=growth, ax=ax)

    def summary(self) -> Summary:
        """Return what was found and how it was checked, a table of curves and one of special points."""
        names = list(self.parameters)
        agrees = f"agree at {' x '.join(str(self.map.sizes[name]) for name in names)} places"
        widths = " or ".join(f"{width:.4g} in {name}" for name, width in self.resolution.items())
        facts = [
            ("counts of modes", "; ".join(self.doubts) if self.doubts else agrees),
            ("missed", f"no curve wider than {widths}" if not self.doubts else "not known"),
        ]
        curves = [
            (
                str(number),
                curve.kind if curve.name is None else f"{curve.kind} of {curve.name}",
                *(f"{low:.6g} to {high:.6g}" for low, high in _extremes(curve.values)),
                _frequencies(curve.frequency),
                str(int(curve.unstable_modes.min())),
                "closed" if curve.closed else ", ".join(end.replace("_", " ") for end in curve.ends),
            )
            for number, curve in enumerate(self)
        ]
        headings = ("curve", "kind", *names, "frequency, Hz", "other unstable modes, least", "ends")
        special = [
            (
                point.kind.replace("_", " "),
                *(f"{point.values[name]:.12g}" for name in names),
                ", ".join(f"{one:.4f}" for one in point.frequencies),
                point.remark,
            )
            for point in self.points
        ]
        tables = [Table("Curves", headings, curves)]
        if special:
            tables.append(Table("Points of codimension two", ("kind", *names, "frequency, Hz", ""), special))
        return Summary(facts, tables)

    def __repr__(self) -> str:
        rows = [f"  {curve!r}" for curve in self._curves]
        return "\n".join([f"StabilityBoundary({len(self)} curves, {len(self.points)} points)", *rows])


def _extremes(values: Real) -> Real:
    extremes: Real = np.array([values.min(axis=0), values.max(axis=0)]).T
    return extremes


def _frequencies(values: Real) -> str:
    if np.isnan(values).any():
        return ""
    low, high = values.min(), values.max()
    return f"{low:.4f}" if high - low <= 1e-4 * high else f"{low:.4f} to {high:.4f}"
