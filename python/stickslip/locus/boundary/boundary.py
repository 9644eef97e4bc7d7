"""Where stability of sliding ends over two parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from stickslip.faults import InputError, Interrupted
from stickslip.locus.band.path import is_large, wanted_region
from stickslip.locus.band.plane import BandSearch
from stickslip.locus.boundary.codimension import meetings, others, without_repetitions
from stickslip.locus.boundary.conditions import Separation, growing
from stickslip.locus.boundary.curves import BoundaryCurve, CodimensionTwo
from stickslip.locus.boundary.plane import Plane
from stickslip.locus.boundary.result import StabilityBoundary
from stickslip.locus.boundary.search import FINER, Search
from stickslip.locus.boundary.tracing import Trace
from stickslip.locus.path import Sliding
from stickslip.scene.checks import Complex, whole_number
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import divided, interval
from stickslip.show.progress import LONG, watched


def stability_boundary(
    model: Model,
    parameters: Mapping[str, Any],
    *,
    combination: str | None = None,
    cells: int = 16,
    band: Sequence[float] | None = None,
    progress: bool | None = None,
) -> StabilityBoundary:
    """Return the curves over two parameters on which steady sliding becomes unstable, or ends.

    Parameters
    ----------
    model, combination
        As for `sweep`.
    parameters
        Values by name as for `sweep`, two of them a range ``(lower, upper)``.
    cells
        Number of lines searched in each parameter: a curve that is wider than a ``cells``-th part of a range
        is not missed. Counts are compared at four times as many places.
    band
        For a large scene: lowest and highest frequency in Hz of the modes that count, as for `complex_modes`.
        A curve ends where its frequency leaves the band, and `BoundaryCurve.missing` counts the eigenvalues
        of the band that were not found along it.
    progress
        Whether to show what is done; None: on a terminal, if it takes long.

    Raises
    ------
    InputError
        If there are not exactly two ranges, a parameter is unknown, a scene is ill-posed, a slider speed is
        zero or changes its sign where no combination is given, or the scene has no damping: a mode that
        neither grows nor decays reaches the imaginary axis nowhere, and flutter begins at a lock-in.
    Interrupted
        On Ctrl-C; a `KeyboardInterrupt` whose ``partial`` holds the curves found by then.

    Notes
    -----
    The reduced matrices are Chebyshev series in both parameters, to rounding. On every line the critical
    points are found as by `critical_points`. From each a curve is followed by pseudo-arclength, its points by
    Newton's method for a minimally augmented system (Govaerts 2000): the dynamic stiffness, bordered by the
    null vectors of the point before, is singular where the last entry of its inverse vanishes.

    Curves and map are then compared: every critical point of a line has to lie on a curve, and along every
    row of the finer map the number of growing eigenvalues, and whether steady sliding exists, have to change
    where curves say so. A row that contradicts them is searched as a line; so are rows through extremes of
    the largest growth rate that may hide a closed curve within a cell. What stays contradictory is told in
    ``doubts``.

    With `band` the modes of the band at some places of the plane, right and left, span the space on which the
    matrices are projected. Places are added until the projected eigenvalues and normal forces are those of
    the scene. The modes at the points of curves join the space, and the points move by what that changes. A
    growing mode that crosses a bound of the band is a doubt: beyond it nothing in the band grows.
    """
    search = search_over(model, parameters, combination, cells, band)
    done = [0]
    total = (2 + FINER) * cells
    try:
        # Matrices of some hundred rows at most: more threads take longer wherever anything else runs.
        with (
            threadpool_limits(1, user_api="blas"),
            watched(lambda: done[0], total, "stability boundary", progress, LONG),
        ):
            for done[0], _ in search.run():
                pass
            return boundary_of(search)
    except KeyboardInterrupt:
        search.doubts.append(f"interrupted after {done[0]} of {total} lines")
        found = boundary_of(search)
        raise Interrupted(f"interrupted after {done[0]} of {total} lines", found) from None


def search_over(
    model: Model,
    parameters: Mapping[str, Any],
    combination: str | None,
    cells: int,
    band: Sequence[float] | None = None,
) -> Search:
    """Return the search for the curves, arguments as in `stability_boundary`; nothing is searched yet."""
    ranges, fixed = divided(model, parameters)
    if len(ranges) != 2:
        raise InputError(f"parameters: expected two with a range, got {list(ranges)}")
    ends = {name: interval(name, value) for name, value in ranges.items()}
    if (cells := whole_number("cells", cells, 2)) > 1000:
        raise InputError(f"cells: expected at most 1000, got {cells}")
    region, sliding = wanted_region(band, (None, None)), Sliding(Family(model), combination)
    first, second = ends.items()
    if region is not None and is_large(sliding, first[0], first[1][0], {**fixed, second[0]: second[1][0]}):
        return BandSearch.over(sliding, ends, fixed, region, cells)
    return Search(Plane(sliding, ends, fixed, region), cells)


def boundary_of(search: Search) -> StabilityBoundary:
    """Return what a search has found by now."""
    plane = search.plane
    family = plane.sliding.family
    ends = dict(zip(plane.names, zip(plane.lower, plane.upper, strict=True), strict=True))
    scene = family.scene({**plane.fixed, **plane.values((0.0, 0.0))})
    labels = [str(label) for label in scene.contact_labels()]
    steady = np.arange(len(labels))
    traced = [(trace, others(trace, trace.points)) for trace in search.traces]
    found = [one for trace, along in traced for one in meetings(trace, along, steady)]
    points = [
        CodimensionTwo(
            kind=one.kind,
            values=plane.values(one.place),
            frequencies=tuple(omega / (2.0 * np.pi) for omega in one.omegas),
            parameter=None if one.axis is None else plane.names[one.axis],
            contact=one.contact,
            name=None if one.contact is None else labels[one.contact],
        )
        for one in without_repetitions(found)
    ]
    rows = len(search.growth)
    places = (np.arange(rows) + 0.5) / rows
    axes = {
        name: (name, lower + places * (upper - lower), family.units(name))
        for name, (lower, upper) in ends.items()
    }
    growth = xr.DataArray(search.growth.T, coords=axes, dims=list(ends), attrs={"units": "1/s"})
    return StabilityBoundary(
        ends,
        [_curve(trace, along, labels, search.uncounted) for trace, along in traced],
        points,
        xr.Dataset({"growth_rate": growth}),
        {name: (upper - lower) / search.cells for name, (lower, upper) in ends.items()},
        search.doubts,
    )


def _curve(trace: Trace, beside: list[Complex], labels: list[str], uncounted: float) -> BoundaryCurve:
    condition = trace.condition
    plane = condition.plane
    contact, frequency = condition.contact, np.full(len(trace.points), np.nan)
    if not isinstance(condition, Separation):
        frequency = np.array([abs(condition.omega(y)) for y in trace.points]) / (2.0 * np.pi)
    spans = np.subtract(plane.upper, plane.lower)
    return BoundaryCurve(
        kind=condition.kind,
        names=plane.names,
        values=np.add(plane.lower, trace.points[:, :2] * spans),
        tangents=trace.tangents[:, :2],
        frequency=frequency,
        # Of a pair one mode grows.
        unstable_modes=np.array([growing(values[values.imag >= 0.0]) for values in beside]),
        steady_sliding=trace.steady,
        error=trace.errors,
        missing=np.full(len(trace.points), uncounted) if trace.missing is None else trace.missing,
        ends=trace.ends,
        contact=contact,
        name=None if contact is None else labels[contact],
    )
