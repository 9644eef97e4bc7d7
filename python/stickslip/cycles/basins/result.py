"""Basins of attraction as a map of starts, and their boundary."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stickslip.cycles.attractors import OUTSIDE
from stickslip.cycles.basins.boundary import WITHOUT_CYCLE, Search, beyond_the_plane, bisected, neighbours
from stickslip.cycles.basins.curve import OrbitCurve
from stickslip.cycles.basins.reached import reached
from stickslip.cycles.bifurcation import table
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, Interrupted
from stickslip.scene.checks import Index, Real, real_number
from stickslip.scene.scene import Scene
from stickslip.scene.state import State
from stickslip.show.summary import Shown, Summary, Table
from stickslip.show.units import TIMES, measured

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Instants of a cycle in a dataset, both ends included, and bisected segments that a summary lists.
INSTANTS, LISTED = 513, 24
#: Words for motions that say nothing of an attractor.
NONE = ("undecided", "unsettled", "stopped")


class Mapped(Shown):
    """A result that is drawn as a map of starts."""

    @abstractmethod
    def to_dataset(self) -> xr.Dataset:
        """Return the map, and what bounds its basins if that is known."""

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the map, one shade for each attractor; return the Axes.

        Of a boundary the cycles are lines and the bisected segments dots.

        Parameters
        ----------
        ax
            Where to draw; None: on axes of its own.
        """
        from stickslip.cycles.diagram_figures import basins

        return basins(self.to_dataset(), ax=ax)


@dataclass(frozen=True, repr=False, eq=False)
class Basins(Mapped):
    """Which attractor is reached over two initial coordinates or parameters.

    Attributes
    ----------
    map
        Index into `attractors` over (first, second) axis; -1 where the start violates its combination, -2
        where the search was interrupted before this start.
    attractors
        The attractors in order of appearance: a `Cycle`, or a word for any other motion. If a parameter is an
        axis, all cycles with the same sequence of combinations count as one attractor, given by the first.
    scene, start
        The scene, and the state to which amounts are added; None if a parameter is an axis.
    stretch, limit
        As `basins` used them, s.
    """

    map: xr.DataArray
    attractors: tuple[Cycle | str, ...]
    scene: Scene | None = None
    start: State | None = None
    stretch: float = np.nan
    limit: float = np.nan

    def boundary(self, tolerance: float = 1e-6) -> BasinBoundary:
        """Return what lies between the starts that reach different attractors.

        Segments between neighbouring starts are bisected, and Newton's method closes cycles from there. A
        cycle counts if one Floquet multiplier lies outside the unit circle, if the scene follows it, and if
        motions from a point just inside and one just outside end on two attractors. In the plane of
        displacement and velocity of one mass no motion crosses it, so that it bounds both basins. It
        separates two neighbours if one of them lies inside, the other outside, and they reach the attractors
        of these sides. Of all other neighbours nothing is said but the bisected segment.

        Parameters
        ----------
        tolerance
            Length of a bisected segment relative to the distance of the neighbours, above 0 and below 1; also
            the distance of both points from a cycle. Motions take longer the nearer they begin.

        Raises
        ------
        InputError
            If an axis of the map is a parameter, or the tolerance lies outside its bounds.
        Interrupted
            On Ctrl-C; a `KeyboardInterrupt` whose ``partial`` is this map.
        """
        width = real_number("tolerance", tolerance)
        if not 0.0 < width < 1.0:
            raise InputError(f"tolerance: must be above 0 and below 1, got {tolerance!r}")
        if self.scene is None or self.start is None:
            names = " and ".join(map(str, self.map.dims))
            raise InputError(f"boundary: expected two initial coordinates as axes, got {names}")
        scene, attractors = self.scene, list(self.attractors)

        def numbers(amounts: Real) -> Index:
            states = [self._moved(row) for row in amounts]
            scenes = [scene] * len(states)
            found, interruption = reached(
                scenes, states, self.stretch, self.limit, attractors, of_one_scene=True
            )
            if interruption is not None:
                raise interruption
            return known(found)

        def known(found: Index) -> Index:
            silent = [number for number, attractor in enumerate(attractors) if attractor in NONE]
            return np.where(np.isin(found, silent), OUTSIDE, found)

        axes = [self.map[dim].to_numpy() for dim in self.map.dims]
        segments = neighbours(known(self.map.to_numpy()), axes)
        search = Search(scene, width, self._moved, numbers, self.stretch)
        reason = beyond_the_plane(scene)
        try:
            rest = bisected(segments, width, numbers) if reason else search.run(segments)
        except KeyboardInterrupt:
            raise Interrupted("interrupted while the boundary was searched", self) from None
        sides = np.array([[one.inside, one.outside] for one in search.bounds], dtype=int).reshape(-1, 2)
        last = max([len(self.attractors) - 1, *sides.ravel(), *rest.reached.ravel()])
        return BasinBoundary(
            replace(self, attractors=tuple(attractors[: last + 1])),
            tuple(bound.cycle for bound in search.bounds),
            sides,
            *rest,
            reason=(reason or WITHOUT_CYCLE) if len(rest.ends) else "",
        )

    def _moved(self, amounts: Sequence[float] | Real) -> State:
        """Return the start with an amount added to each axis."""
        assert self.start is not None
        changes: dict[str, dict[str | int, float]] = {"position": {}, "velocity": {}}
        for dim, amount in zip(self.map.dims, amounts, strict=True):
            kind, _, dof = str(dim).partition("_")
            changes[kind][dof if dof in self.start.dofs else int(dof)] = float(amount)
        return self.start.perturbed(**changes)

    def to_dataset(self) -> xr.Dataset:
        """Return the map as ``reached``; over ``attractor`` its ``kind`` and cycle as in `bifurcation`."""
        cycles = [None if isinstance(reached, str) else reached for reached in self.attractors]
        kinds = [reached if isinstance(reached, str) else "cycle" for reached in self.attractors]
        listed = table("attractor", np.arange(len(cycles)), cycles, {})
        return listed.assign(kind=("attractor", np.array(kinds, dtype=str)), reached=self.map)

    def summary(self) -> Summary:
        """Return a table of the attractors, and from how many starts each is reached."""
        counts = [int((self.map == number).sum()) for number in range(len(self.attractors))]
        rows = [
            (str(number), reached if isinstance(reached, str) else repr(reached), count)
            for number, (reached, count) in enumerate(zip(self.attractors, counts, strict=True))
        ]
        facts = [("starts", f"{self.map.size} over {' and '.join(map(str, self.map.dims))}")]
        return Summary(facts, [Table("Attractors", ("number", "attractor", "starts"), rows)])

    def __repr__(self) -> str:
        listed = "\n".join(f"  {k}: {reached!r}" for k, reached in enumerate(self.attractors))
        return f"Basins of {len(self.attractors)} attractors\n{listed}\n{self.map!r}"


@dataclass(frozen=True, repr=False, eq=False)
class BasinBoundary(Mapped):
    """What bounds the basins of a map, see `Basins.boundary`.

    Attributes
    ----------
    basins
        The map; its attractors also hold those that only bisected starts reach.
    cycles
        The unstable cycles that bound basins, each the whole boundary between the two attractors near it.
    sides
        Attractors just inside and just outside of each cycle, (cycle, 2).
    segments
        Bisected segments between starts that no cycle separates, (segment, end, coordinate), amounts along
        the axes of the map, m or m/s. The boundary crosses each of them; more is not known.
    reached
        Attractors that the ends of the segments reach, (segment, end).
    reason
        Why no cycle separates these, in words; empty without segments.
    """

    basins: Basins
    cycles: tuple[Cycle, ...]
    sides: Index
    segments: Real
    reached: Index
    reason: str

    @cached_property
    def fractions(self) -> Real:
        """Part of the rectangle of starts, from first to last value, that lies within each cycle.

        The enclosed area is an integral over the pieces of the orbit to rounding, and the rectangle clips it.
        nan if the rectangle has no area.
        """
        low, high = self._rectangle()
        size = float(np.prod(high - low))
        areas = [OrbitCurve(cycle).area((low[0], low[1]), (high[0], high[1])) for cycle in self.cycles]
        return np.array(areas) / size if size > 0.0 else np.full(len(areas), np.nan)

    def _rectangle(self) -> tuple[Real, Real]:
        """Return least and largest displacement and velocity of the starts of one mass, m and m/s."""
        values = [self.basins.map[dim].to_numpy() for dim in self.basins.map.dims]
        corners = [self.basins._moved([axis.min() for axis in values])]
        corners.append(self.basins._moved([axis.max() for axis in values]))
        low, high = (np.array([state.position[0], state.velocity[0]]) for state in corners)
        return low, high

    def _curves(self) -> list[Real]:
        """Return the cycles as amounts along the axes of the map, (instant, coordinate) each."""
        start, found = self.basins.start, []
        assert start is not None
        for cycle in self.cycles:
            position, velocity, *_ = cycle.run.core.sample(np.linspace(0.0, cycle.period, INSTANTS))
            amounts = {"position": position - start.position, "velocity": velocity - start.velocity}
            kinds = [str(dim).partition("_")[0] for dim in self.basins.map.dims]
            found.append(np.stack([amounts[kind][:, 0] for kind in kinds], axis=1))
        return found

    def to_dataset(self) -> xr.Dataset:
        """Return the dataset of the map with its boundary.

        Over ``cycle``: ``inside`` and ``outside``, numbers of attractors; ``fraction``; ``cycle_period``, s;
        ``cycle_multiplier``. The cycles as ``curve_<axis>`` (cycle, instant), the segments as
        ``segment_<axis>`` and ``segment_reached`` (segment, end). The attribute ``reason``.
        """
        curves = np.reshape(self._curves(), (len(self.cycles), INSTANTS, 2))
        variables: dict[str, Any] = {
            "inside": ("cycle", self.sides[:, 0]),
            "outside": ("cycle", self.sides[:, 1]),
            "fraction": ("cycle", self.fractions, {"units": "1"}),
            "cycle_period": ("cycle", np.array([one.period for one in self.cycles]), {"units": "s"}),
            "cycle_multiplier": (
                "cycle",
                np.array([one.transverse_multipliers[0] for one in self.cycles], dtype=complex),
                {"units": "1"},
            ),
            "segment_reached": (("segment", "end"), self.reached),
        }
        for axis, dim in enumerate(self.basins.map.dims):
            units = {"units": self.basins.map[dim].attrs["units"]}
            variables[f"curve_{dim}"] = (("cycle", "instant"), curves[:, :, axis], units)
            variables[f"segment_{dim}"] = (("segment", "end"), self.segments[:, :, axis], units)
        return self.basins.to_dataset().assign(variables).assign_attrs(reason=self.reason)

    def summary(self) -> Summary:
        """Return the cycles with what they enclose, and the segments that no cycle separates."""
        names = [
            attractor if isinstance(attractor, str) else f"cycle {number}"
            for number, attractor in enumerate(self.basins.attractors)
        ]
        cycles = [
            (
                str(number),
                measured(cycle.period, TIMES, 9),
                f"{cycle.largest_multiplier:.6g}",
                *(names[side] for side in sides),
                f"{fraction:.12g}",
            )
            for number, (cycle, sides, fraction) in enumerate(
                zip(self.cycles, self.sides, self.fractions, strict=True)
            )
        ]
        widths = np.abs(np.diff(self.segments, axis=1)).max(initial=0.0)
        facts = [
            ("cycles", f"{len(cycles)}, each repels and separates two attractors"),
            ("segments", f"{len(self.segments)} that no cycle separates, up to {widths:.3g} long"),
            *([("reason", self.reason)] if self.reason else []),
        ]
        headings = ("cycle", "period", "multiplier", "inside", "outside", "part of the rectangle")
        tables = [Table("Cycles", headings, cycles)] if cycles else []
        segments = [
            (str(number), *(f"{value:.9g}" for value in ends.mean(axis=0)), *(names[k] for k in numbers))
            for number, (ends, numbers) in enumerate(zip(self.segments, self.reached, strict=True))
        ]
        if segments:
            columns = ("segment", *map(str, self.basins.map.dims), "one end", "other end")
            tables.append(Table("Bisected segments, middles", columns, segments[:LISTED]))
        return Summary(facts, tables)

    def __repr__(self) -> str:
        rows = [
            f"  {cycle!r}, {fraction:.9g} of the rectangle within"
            for cycle, fraction in zip(self.cycles, self.fractions, strict=True)
        ]
        rows += [f"  {len(self.segments)} bisected segments: {self.reason}"] if self.reason else []
        return "\n".join([f"BasinBoundary(cycles: {len(self.cycles)})", *rows])
