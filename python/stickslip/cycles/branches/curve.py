"""A curve over two parameters on which a periodic orbit bifurcates, followed from a point of a branch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stickslip.cycles.bifurcation import table
from stickslip.cycles.branches.arclength import Curve, Place
from stickslip.cycles.branches.branch import BranchPoint
from stickslip.cycles.branches.chart import Plane, Spot
from stickslip.cycles.branches.conditions import Condition
from stickslip.cycles.branches.plane_curve import Node, Side, Special, follow, started, turned
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError, Interrupted, OrbitError
from stickslip.locus.boundary.curves import BoundaryCurve, CodimensionTwo
from stickslip.scene.checks import Real
from stickslip.scene.parameters.family import Family, Model
from stickslip.scene.parameters.values import apart, divided, interval
from stickslip.show.summary import Shown, Summary, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Part of a range by which the value of a point may differ from that of the scene of its orbit.
SAME = 1e-4
#: Part of a range within which the start of a curve has to lie from where its point is said to be.
NEAR = 1e-4
#: How a change of the sequence is found to which the orbit comes with a phase that shrinks.
OTHER_SIDE = "; where a phase shrinks to nothing, take the same point from the branch on its other side"


@dataclass(frozen=True, repr=False, eq=False)
class BifurcationCurve(Shown):
    """A curve over two parameters on which a periodic orbit bifurcates, see `continuation`.

    Attributes
    ----------
    parameters
        Ranges by name, two of them.
    curve
        The curve with its direction. Its ``kind`` is that of the `BranchPoint` followed; ``frequency`` is
        that of the orbit; ``unstable_modes`` counts other multipliers outside the unit circle, and where
        there are none a stable orbit ends there; ``steady_sliding`` is whether the contact laws hold all
        along the orbit. ``error``: of a fold or period doubling the distance of the multiplier
        from 1 or -1; of a torus by how much a modulus differs from 1; of a change of the sequence the event
        function (m/s, N or m) or the duration (s) that vanishes. ``ends``: ``range``, ``closed``, ``points``
        (as many as were allowed), ``sequence``, ``resonance``, ``tangency``, or ``lost`` if it could not be
        followed and the cause is not known.
    cycles
        The orbit at every point.
    points
        Points of codimension two, in order. ``cusp``: a fold curve turns back in both parameters;
        ``second_multiplier``: another multiplier is on the unit circle as well; ``resonance``: the pair of a
        torus meets at 1 or -1, and the curve ends; ``sequence``: the sequence of events changes, and beyond
        the contact laws do not hold; ``tangency``: the event function of a contact comes to touch zero
        instead of crossing it, as where a phase shrinks to nothing, and the curve ends, since the orbits
        have no derivative there; ``degenerate``: the curve turns in one of the parameters.
    """

    parameters: Mapping[str, tuple[float, float]]
    curve: BoundaryCurve
    cycles: tuple[Cycle, ...]
    points: tuple[CodimensionTwo, ...]
    units: Mapping[str, str]

    def to_dataset(self) -> xr.Dataset:
        """Return the orbits over ``point`` as of `bifurcation`, both parameters as coordinates.

        With ``frequency``, ``unstable_others``, ``followed`` and ``error`` of the curve; points of
        codimension two stand over ``special``.
        """
        curve = self.curve
        data = table("point", np.arange(len(self.cycles)), self.cycles, {})
        units = {name: {"units": unit} if unit else {} for name, unit in self.units.items()}
        missed = "1" if curve.contact is None else "that of the event function"
        multipliers = [np.nan if one.multiplier is None else one.multiplier for one in self.points]
        variables: dict[str, Any] = {
            **{str(name): one for name, one in data.data_vars.items()},
            "frequency": ("point", curve.frequency, {"units": "Hz"}),
            "unstable_others": ("point", curve.unstable_modes),
            "followed": ("point", curve.steady_sliding),
            "error": ("point", curve.error, {"units": missed}),
            "special_kind": ("special", np.array([one.kind for one in self.points], dtype=str)),
            "special_remark": ("special", np.array([one.remark for one in self.points], dtype=str)),
            "special_multiplier": ("special", np.array(multipliers, dtype=complex), {"units": "1"}),
        }
        places = {}
        for axis, name in enumerate(self.parameters):
            at = np.array([one.values[name] for one in self.points], dtype=float)
            places[f"special_{name}"] = ("special", at, units[name])
            places[name] = ("point", curve.values[:, axis], units[name])
            variables[f"tangent_{name}"] = ("point", curve.tangents[:, axis], {"units": "1"})
        attrs = {"kind": curve.kind, "begin": curve.ends[0], "end": curve.ends[1]}
        return xr.Dataset(apart(variables, self.parameters), coords={**data.coords, **places}, attrs=attrs)

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the curve and its points over the two parameters; return the Axes.

        The second parameter is the horizontal axis. The curve is thick where a stable orbit ends, thin where
        other multipliers are outside the unit circle, and grey where the orbit is no motion of the scene.

        Parameters
        ----------
        ax
            Where to draw, as on `StabilityBoundary.plot` of the same parameters; None: on axes of its own.
        """
        from stickslip.locus.boundary.figures import stability_boundary

        return stability_boundary([self.curve], self.points, self.parameters, self.units, growth=None, ax=ax)

    def summary(self) -> Summary:
        """Return what is followed, how the curve ends, a table of its points and one of special points."""
        curve, names = self.curve, list(self.parameters)
        facts = [
            ("kind", curve.kind if curve.name is None else f"{curve.kind} of contact {curve.name}"),
            ("ends", ", ".join(dict.fromkeys(curve.ends))),
            ("largest error of the condition", f"{curve.error.max():.1e}"),
        ]
        rows = [
            (*(f"{value:.9g}" for value in at), f"{cycle.frequency:.6g}", str(others), f"{error:.1e}")
            for at, cycle, others, error in zip(
                curve.values, self.cycles, curve.unstable_modes, curve.error, strict=True
            )
        ]
        headings = (*names, "frequency, Hz", "others outside", "error")
        special = [
            (one.kind.replace("_", " "), *(f"{one.values[name]:.9g}" for name in names), one.remark)
            for one in self.points
        ]
        found = [Table("Points of codimension two", ("kind", *names, ""), special)] if special else []
        return Summary(facts, [Table("Points of the curve", headings, rows), *found])

    def __repr__(self) -> str:
        rows = [
            f"  {one.kind} at {', '.join(f'{name} = {value:.9g}' for name, value in one.values.items())}"
            for one in self.points
        ]
        return "\n".join([f"BifurcationCurve({self.curve!r})", *rows])


def bifurcation_curve(
    point: BranchPoint, parameters: Mapping[str, Any], model: Model | None, step: float, points: int
) -> BifurcationCurve:
    """Return the curve over two parameters through a point of a branch, arguments as of `continuation`."""
    if point.kind == "hopf":
        raise InputError("cycle: a Hopf point has no orbit to follow; stability_boundary returns its curve")
    family, known = Family(point.cycle.scene if model is None else model), point.parameter
    ranges, fixed = divided(family.given, parameters)
    ends = {name: interval(name, value) for name, value in ranges.items()}
    if len(ends) != 2 or known not in ends:
        raise InputError(
            f"parameters: expected ranges of {known!r}, over which the point was found, and of another one, "
            f"got {list(ends)}"
        )
    low, high = ends[known]
    start = {name: family.value(name) for name in ends}
    if model is None and abs(start[known] - point.value) > SAME * (high - low):
        raise InputError(
            f"model: {known} is {start[known]:g} in the scene of the orbit, {point.value:g} at the point; "
            "pass the scene or function with which the branch was computed"
        )
    start[known] = point.value
    for name, (lower, upper) in ends.items():
        if not lower <= start[name] <= upper:
            raise InputError(
                f"{name}: expected a range that holds the point, {start[name]:g}, got ({lower:g}, {upper:g})"
            )
    plane = Plane(family, ends, fixed)
    node = _started(point, plane, plane.parts(start), list(ends).index(known))
    sides = [Side([node]), Side([turned(node)])]
    try:
        for side in sides:
            # A closed curve is whole on its first side.
            if sides[0].end == "closed":
                break
            budget = points if side is sides[0] else points - len(sides[0].nodes) + 1
            follow(side, step, budget)
        return _result(plane, node, sides)
    except KeyboardInterrupt:
        found = _result(plane, node, sides)
        raise Interrupted(f"interrupted after {len(found.cycles)} points", found) from None


def _started(point: BranchPoint, plane: Plane, at: Real, axis: int) -> Node:
    """Return the node at the point, whose branch is over the parameter of an axis."""
    along = np.eye(2)[1 - axis]
    across = np.array([along[1], -along[0]])
    branch = Curve(lambda r: plane.scene(at + r * across), 1.0)
    try:
        place: Place = branch.begin(point.cycle.core.orbit(), 0.0, 1.0)
        node = started(Spot(plane, Condition.of(point), at, place), along)
    except OrbitError as error:
        remedy = OTHER_SIDE if point.kind == "grazing" else ""
        raise OrbitError(f"cycle: the {point.kind} is not found at the point ({error}{remedy})") from error
    if np.abs(node.spot.at - at).max() > NEAR:
        raise OrbitError(
            f"cycle: the {point.kind} is not at the point but at {plane.values(node.spot.at)}; other "
            f"parameters have to be those of its branch{OTHER_SIDE if point.kind == 'grazing' else ''}"
        )
    return node


def _result(plane: Plane, node: Node, sides: Sequence[Side]) -> BifurcationCurve:
    """Return what has been followed by now."""
    forward, backward = sides
    nodes = [*backward.nodes[:0:-1], *forward.nodes]
    flips = [-1.0] * (len(backward.nodes) - 1) + [1.0] * len(forward.nodes)
    condition = node.spot.condition
    first, second = plane.ranges
    spots = [one.spot for one in nodes]
    cycles = tuple(spot.cycle for spot in spots)
    labels = [str(label) for label in cycles[0].scene.contact_labels()]
    contact = condition.contact
    curve = BoundaryCurve(
        kind=condition.kind,
        names=(first, second),
        values=np.array([list(plane.values(spot.at).values()) for spot in spots]),
        tangents=np.array([flip * one.heading[:2] for flip, one in zip(flips, nodes, strict=True)]),
        frequency=np.array([cycle.frequency for cycle in cycles]),
        unstable_modes=np.array([condition.outside(cycle) for cycle in cycles]),
        steady_sliding=np.array([not condition.breaks(cycle) for cycle in cycles]),
        error=np.array([condition.error(cycle) for cycle in cycles]),
        missing=np.zeros(len(nodes)),
        ends=("closed", "closed") if forward.end == "closed" else (backward.end, forward.end),
        contact=contact,
        name=None if contact is None else labels[contact],
    )
    specials = chain(reversed(backward.specials), forward.specials)
    return BifurcationCurve(
        dict(plane.ranges),
        curve,
        cycles,
        tuple(_codimension_two(plane, one, labels) for one in specials),
        {name: plane.family.units(name).get("units", "") for name in plane.ranges},
    )


def _codimension_two(plane: Plane, special: Special, labels: Sequence[str]) -> CodimensionTwo:
    spot = special.node.spot
    return CodimensionTwo(
        kind=special.kind,
        values=plane.values(spot.at),
        frequencies=(spot.cycle.frequency,),
        parameter=None if special.axis is None else list(plane.ranges)[special.axis],
        contact=special.contact,
        name=None if special.contact is None else labels[special.contact],
        multiplier=special.multiplier,
    )
