"""All curves over two parameters on which stability ends, and how it was checked that none is missed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import xarray as xr

from stickslip.locus.boundary.curves import BoundaryCurve, CodimensionTwo
from stickslip.scene.checks import Real
from stickslip.scene.parameters.values import apart
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
            "missing": column("missing", float, units="1"),
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
        """Draw the curves on the map of growth; return the Axes.

        The second parameter is the horizontal axis, as in `ss.plot.stability_map`. Curves at which a stable
        region ends are thick, those beside which other modes grow are thin, those without steady sliding
        grey. A cross marks a point at which an eigenvalue of the `band` was not found.

        Parameters
        ----------
        growth
            Whether to draw the map; without it curves are drawn on what the axes show.
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.locus.boundary.figures import stability_boundary

        rates = self.map.growth_rate if growth else None
        return stability_boundary(self, self.points, self.parameters, self._units(), growth=rates, ax=ax)

    def _units(self) -> dict[str, str]:
        return {name: self.map[name].attrs.get("units", "") for name in self.parameters}

    def summary(self) -> Summary:
        """Return what was found and how it was checked, a table of curves and one of special points."""
        names = list(self.parameters)
        agrees = f"agree at {' x '.join(str(self.map.sizes[name]) for name in names)} places"
        widths = " or ".join(f"{width:.4g} in {name}" for name, width in self.resolution.items())
        facts = [
            ("counts of modes", "; ".join(self.doubts) if self.doubts else agrees),
            ("missed", f"no curve wider than {widths}" if not self.doubts else "not known"),
        ]
        counted = np.concatenate([np.zeros(0), *(curve.missing for curve in self)])
        of_band = bool(np.isnan(counted).any())
        if of_band:
            facts.append(("eigenvalues missing", f"{_missing(counted)} of curves"))
        curves = [
            (
                str(number),
                curve.kind if curve.name is None else f"{curve.kind} of {curve.name}",
                *(f"{low:.6g} to {high:.6g}" for low, high in _extremes(curve.values)),
                _frequencies(curve.frequency),
                str(int(curve.unstable_modes.min())),
                *([_missing(curve.missing)] if of_band else []),
                "closed" if curve.closed else ", ".join(end.replace("_", " ") for end in curve.ends),
            )
            for number, curve in enumerate(self)
        ]
        headings = (
            *("curve", "kind", *names, "frequency, Hz", "other unstable modes, least"),
            *(["eigenvalues missing"] if of_band else []),
            "ends",
        )
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


def _missing(values: Real) -> str:
    """Return how many eigenvalues are missing at most, and at how many points they were counted."""
    counted = values[~np.isnan(values)]
    if not counted.size:
        return "not counted"
    worst = abs(np.abs(counted).max().round(2))
    return f"{worst:.2f} at {counted.size} of {values.size} points"


def _frequencies(values: Real) -> str:
    if np.isnan(values).any():
        return ""
    low, high = values.min(), values.max()
    return f"{low:.4f}" if high - low <= 1e-4 * high else f"{low:.4f} to {high:.4f}"
