"""Critical points over a parameter: one of them, and the sequence of those of a range."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args, overload

import numpy as np
import xarray as xr

from stickslip.locus.criticality import Criticality
from stickslip.scene.parameters.values import apart
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Kind = Literal["hopf", "divergence", "lock_in", "crossing", "separation"]
#: All kinds of critical points.
KINDS: tuple[Kind, ...] = get_args(Kind)
#: Attributes of a point that a dataset has as they are.
_SAME = ("kind", "complex_value", "eigenvalue", "direction", "steady_sliding")
#: Markers of those that have a frequency.
MARKED = {"hopf": "o", "divergence": "s", "lock_in": "D", "crossing": "x"}


@dataclass(frozen=True)
class CriticalPoint:
    """A parameter value at which the spectrum changes its kind.

    Attributes
    ----------
    kind
        ``hopf``: a complex pair crosses the imaginary axis; ``divergence``: a real eigenvalue crosses zero;
        ``lock_in``: two eigenvalues and their vectors coalesce (exceptional point); ``crossing``: the largest
        real part passes from one branch to another; ``separation``: steady sliding begins or ends, because
        the normal force of a contact vanishes (or the gap of an open one).
    parameter
        Its name.
    value
        Its value; at a complex exceptional point the real part, near which the two branches come closest.
    complex_value
        Its value with the imaginary part.
    eigenvalue
        lambda at the point, 1/s; at a crossing that of the branch that leads beyond it; nan at a separation.
    other
        At a crossing the eigenvalue of the branch that has led before it; None elsewhere.
    slope
        At a Hopf point d Re(lambda) / d parameter. At a crossing the slope of the branch that takes the lead
        less the slope of the branch that loses it. None elsewhere.
    direction
        +1 where an eigenvalue becomes unstable as the parameter grows, -1 where one becomes stable, 0 for a
        lock-in or a crossing; at a separation +1 where the contact opens as the parameter grows, -1 where it
        closes.
    steady_sliding
        Whether steady sliding of the combination exists at the value (`sweep`); if it does not, only the
        linear system has the point. True at a separation.
    contact
        The index of the contact that a separation opens or closes; None elsewhere.
    name
        The name of that contact, its index where contacts have no names; None elsewhere.
    cause
        Cause of a Hopf point or divergence if friction depends on slip speed: ``falling friction`` if the
        eigenvalue would be stable with the friction of steady sliding held constant, ``mode coupling`` if it
        would not. None elsewhere.
    criticality
        At a Hopf point how motions grow from it. ``supercritical``: a stable cycle grows from zero beyond the
        point; ``subcritical``: an unstable cycle lies around stable sliding before the point, and beyond it
        the motion jumps to a large one; ``linear until a status changes``: friction along lines does not
        depend on slip speed, or not to third order. None elsewhere, where a contact sticks, and where
        equilibrium is not the only one.
    lyapunov
        The first Lyapunov coefficient l_1 of that, 1/m^2, for a mode whose largest displacement is 1 m:
        negative if supercritical. A cycle near the point has the amplitude ``a`` of this displacement with
        ``a^2 = -4 slope (p - value) / (2 pi frequency lyapunov)``. None where `criticality` is.
    """

    kind: Kind
    parameter: str
    value: float
    complex_value: complex
    eigenvalue: complex
    other: complex | None
    slope: float | None
    direction: int
    steady_sliding: bool = True
    contact: int | None = None
    name: str | None = None
    cause: str | None = None
    criticality: Criticality | None = None
    lyapunov: float | None = None

    @property
    def frequency(self) -> float:
        """``|lambda| / (2 pi)``, Hz."""
        return float(abs(self.eigenvalue) / (2.0 * np.pi))

    @property
    def remark(self) -> str:
        """What happens there as the parameter grows, in words."""
        if self.kind == "separation":
            return f"contact {self.name} {'opens' if self.direction > 0 else 'closes'}"
        toward = {1: "destabilising", -1: "stabilising", 0: ""}[self.direction]
        exists = "" if self.steady_sliding else "no steady sliding there"
        return ", ".join(filter(None, [toward, self.cause, self.criticality, exists]))

    def __repr__(self) -> str:
        place = f"{self.value:.14g}"
        if self.complex_value.imag:
            place += f" {self.complex_value.imag:+.3g}j"
        line = "" if self.kind == "separation" else f"{self.frequency:.4f} Hz"
        remarks = ", ".join(filter(None, [line, self.remark]))
        return f"CriticalPoint({self.kind} at {self.parameter} = {place}, {remarks})"


class CriticalPoints(Sequence[CriticalPoint], Shown):
    """The critical points over a range of one parameter: a sequence of `CriticalPoint`, ascending."""

    def __init__(self, parameter: str, points: Iterable[CriticalPoint], units: Mapping[str, str]) -> None:
        self.parameter = parameter
        self._points = tuple(points)
        self._units = dict(units)

    def __len__(self) -> int:
        return len(self._points)

    @overload
    def __getitem__(self, place: int) -> CriticalPoint: ...
    @overload
    def __getitem__(self, place: slice) -> CriticalPoints: ...
    def __getitem__(self, place: int | slice) -> CriticalPoint | CriticalPoints:
        """Return a point, or those of a slice."""
        if isinstance(place, slice):
            return CriticalPoints(self.parameter, self._points[place], self._units)
        return self._points[place]

    def to_dataset(self) -> xr.Dataset:
        """Return the points over ``point``, with the parameter as a coordinate.

        Variables are the attributes of `CriticalPoint`, and ``frequency``, Hz. Where a point has none,
        ``contact`` (a name or an index), ``cause`` and ``criticality`` are empty, ``contact_index`` is -1,
        and other numbers are nan.
        """

        def column(of: str, kind: Any, missing: Any, **attrs: str) -> tuple[str, Any, dict[str, str]]:
            given = [getattr(point, of) for point in self]
            return "point", np.array([missing if one is None else one for one in given], dtype=kind), attrs

        nothing, rate = complex(np.nan, np.nan), "1/s"
        per = self._units.get("units", "")
        slope = rate if per == "1" else f"1/s/({per})" if per else ""
        variables = {
            "kind": column("kind", str, ""),
            "frequency": column("frequency", float, np.nan, units="Hz"),
            "eigenvalue": column("eigenvalue", complex, nothing, units=rate),
            "other": column("other", complex, nothing, units=rate),
            "complex_value": column("complex_value", complex, nothing, **self._units),
            "slope": column("slope", float, np.nan, **({"units": slope} if slope else {})),
            "direction": column("direction", int, 0),
            "steady_sliding": column("steady_sliding", bool, False),
            "contact": column("name", str, ""),
            "contact_index": column("contact", int, -1),
            "cause": column("cause", str, ""),
            "criticality": column("criticality", str, ""),
            "lyapunov": column("lyapunov", float, np.nan, units="1/m^2"),
        }
        return xr.Dataset(
            apart(variables, [self.parameter]),
            coords={
                "point": np.arange(len(self)),
                self.parameter: column("value", float, np.nan, **self._units),
            },
        )

    @classmethod
    def from_dataset(cls, data: xr.Dataset) -> CriticalPoints:
        """Return the points of which `to_dataset` has made a dataset."""
        (parameter,) = (str(name) for name, held in data.coords.items() if held.dims != (name,))
        others = ("other", "slope", "cause", "criticality", "lyapunov", "contact", "contact_index")
        columns = {
            name: data[f"computed_{name}" if name == parameter else name].to_numpy().tolist()
            for name in (*_SAME, *others)
        }
        points = []
        for k, value in enumerate(data[parameter].to_numpy().tolist()):
            row = {name: column[k] for name, column in columns.items()}
            kind, index, label = row["kind"], row["contact_index"], row["contact"]
            # Contacts without names are labelled by their index.
            label = index if label == str(index) else label
            points.append(
                CriticalPoint(
                    **{name: row[name] for name in _SAME},
                    parameter=parameter,
                    value=value,
                    other=row["other"] if kind == "crossing" else None,
                    slope=row["slope"] if kind in ("hopf", "crossing") else None,
                    contact=None if index < 0 else index,
                    name=label if index >= 0 else None,
                    cause=row["cause"] or None,
                    criticality=row["criticality"] or None,
                    lyapunov=row["lyapunov"] if row["criticality"] else None,
                )
            )
        return cls(parameter, points, data[parameter].attrs)

    def to_dataframe(self) -> pd.DataFrame:
        """Return a `pandas.DataFrame` with the columns of `to_dataset`, one row per point."""
        return self.to_dataset().to_dataframe()

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the frequencies of the points over the parameter, a marker for each kind; return the Axes.

        A contact that opens or closes is a dashed line. Points without steady sliding are hollow.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.show.plots import axes_of
        from stickslip.show.style import OVERLAY, quantity

        axes, named = axes_of(ax), set[str]()
        for point in self:
            label = "" if point.kind in named else point.kind.replace("_", "-")
            named.add(point.kind)
            if point.kind == "separation":
                axes.axvline(point.value, color="black", linestyle="--", linewidth=0.8, label=label or None)
                continue
            fill = "full" if point.steady_sliding else "none"
            marker, colour = MARKED[point.kind], OVERLAY[0][0]
            axes.plot(point.value, point.frequency, marker, color=colour, fillstyle=fill, label=label or None)
        axes.set(xlabel=quantity(self.parameter, self._units.get("units", "")), ylabel="frequency, Hz")
        if named:
            axes.legend(frameon=False, fontsize="small")
        return axes

    def summary(self) -> Summary:
        """Return a table of the points."""
        unit = self._units.get("units", "1")
        heading = self.parameter if unit == "1" else f"{self.parameter}, {unit}"
        rows = [
            (
                point.kind.replace("_", "-"),
                f"{point.value:.12g}",
                "" if np.isnan(point.frequency) else f"{point.frequency:.4f}",
                point.remark,
            )
            for point in self
        ]
        return Summary(tables=[Table("Critical points", ("kind", heading, "frequency, Hz", ""), rows)])

    def __repr__(self) -> str:
        rows = [f"  {point!r}" for point in self._points]
        return "\n".join([f"CriticalPoints({len(self)} over {self.parameter})", *rows])
