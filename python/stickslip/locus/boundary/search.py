"""All curves that meet a map: traced from every critical point of its lines, and compared with its counts.

The lines run through the middles of cells, in both parameters, so that no line is the border, where damping
or friction may vanish. Every critical point of a line has to lie on a curve. The rows of a finer map have to
show the numbers of growing eigenvalues, and whether steady sliding exists, that follow from the curves that
cross them; a row that does not is searched as a line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np

from stickslip.faults import InputError
from stickslip.locus.boundary.conditions import (
    Condition,
    Divergence,
    Hopf,
    Separation,
    eigenvalues,
    growing,
    slides,
)
from stickslip.locus.boundary.plane import Plane
from stickslip.locus.boundary.tracing import Crossing, Trace, crossings, traced
from stickslip.scene.checks import Complex, Flags, Index, Real

#: Rows of the map whose counts are compared, for each line.
FINER = 4
#: Distance, of the range, up to which a critical point of a line lies on a curve.
_SAME = 1e-6
#: The same on the cubics of a curve, and distance of two critical points of which neither can be meant by the
#: other's curve then.
_OF_CUBIC, _APART = 3e-4, 1e-3
#: Distance to a curve, of the range, within which a count may be that of either side.
_BESIDE = 1e-9
#: Rounds of looking where counts contradict curves.
_ROUNDS = 3
#: Real parts below this part of the modulus don't tell growth from decay.
_NEUTRAL = 1e-10
#: Distance of the ends of two curves, of the range, at which one is the other's in another direction.
_CORNER = 1e-6
#: Nearest that a row comes to the border of the map, where a curve ends and does not cross it.
_INNER = 1e-6
#: How much further growth may rise beside an extreme of the map than it does to its neighbours.
_REACH = 2.0
#: Refinements around an extreme of growth, each twice as fine as the one before.
_REFINED = 8
#: Halvings between two places of a row until it is known where a count changes, and the distance of an
#: eigenvalue from a bound of the band, of its modulus, at which it crosses that bound there.
_HALVINGS, _AT_BOUND = 24, 1e-5


@dataclass
class Search:
    """The curves of a plane, and what is known of its map."""

    #: How many eigenvalues are missing at a point where they were not counted: none, as all are computed.
    uncounted: ClassVar[float] = 0.0

    plane: Plane
    #: Number of lines in each parameter.
    cells: int
    traces: list[Trace] = field(default_factory=list)
    #: What is not settled, in words.
    doubts: list[str] = field(default_factory=list)
    #: Largest growth rate, 1/s, rows of the second parameter; nan where it is not known.
    growth: Real = field(init=False)
    #: Numbers of growing eigenvalues, as `growth`.
    counts: Index = field(init=False)
    #: By bound of the band, 1/s: where on a line a growing mode crosses it.
    through: dict[float, list[Real]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.growth = np.full((FINER * self.cells, FINER * self.cells), np.nan)
        self.counts = np.zeros(self.growth.shape, dtype=int)

    def run(self) -> Iterator[tuple[int, int]]:
        """Find everything; yield how many lines and rows of all are done, so that a caller may stop."""
        rows, total = FINER * self.cells, (2 + FINER) * self.cells
        done = 0
        for axis in (0, 1):
            for place in _middles(self.cells):
                self.search(axis, place)
                done += 1
                yield done, total
        contradictory: list[float] = []
        for k, place in enumerate(_middles(rows)):
            self.growth[k], self.counts[k], agrees = self.compare(place, rows)
            if not agrees and self.is_neutral:
                raise InputError(
                    "model: a mode neither grows nor decays over all of the map, as without damping: its "
                    "flutter begins at a lock-in, which critical_points finds, and at no Hopf point"
                )
            contradictory += [] if agrees else [place]
            done += 1
            yield done, total
        for place in self._extremes():
            self.search(0, place)
            yield total, total
        for _ in range(_ROUNDS):
            for place in contradictory:
                self.search(0, place)
                yield total, total
            contradictory = [place for place in contradictory if not self.compare(place, rows)[2]]
        if self.plane.region is not None:
            # Along columns; along rows it is known from the comparison.
            for place, counts in zip(_middles(rows), self.counts.T, strict=True):
                self._departed(1, place, counts)
        self._name_corners()
        name = self.plane.names[1]
        for place in contradictory:
            self.doubts.append(f"counts contradict the curves at {name} = {self._value(1, place):.6g}")
        for bound, where in self.through.items():
            self.doubts.append(
                f"a growing mode crosses the bound of the band at {bound / (2.0 * np.pi):.6g} Hz near "
                f"{self.plane.described(where[0])}, and is not counted beyond; take a wider band"
            )

    def _name_corners(self) -> None:
        """Tell curves that go on in another direction from those that could not be followed any further."""
        lost = [(trace, side) for trace in self.traces for side in (0, 1) if trace.ends[side] == "lost"]
        places = np.array([trace.points[-side][:2] for trace, side in lost]).reshape(-1, 2)
        for (trace, side), place in zip(lost, places, strict=True):
            if np.count_nonzero(np.abs(places - place).max(axis=1) <= _CORNER) > 1:
                trace.ends = ("corner", trace.ends[1]) if side == 0 else (trace.ends[0], "corner")
                continue
            at = self.plane.described(place)
            self.doubts.append(f"a {trace.condition.kind} curve could not be followed beyond {at}")

    def _value(self, axis: int, place: float) -> float:
        return self.plane.values((place, place))[self.plane.names[axis]]

    def search(self, axis: int, place: float) -> None:
        """Trace every curve that meets a line and is not known yet."""
        points = self.points(axis, place)
        if _are_told_by(points, self.crossings(axis, place, exact=False)):
            return
        known = self.crossings(axis, place)
        for point in points:
            if any(_same(point, other) for other in known):
                continue
            where = np.array([point.place, place] if axis == 0 else [place, point.place])
            condition = self._condition(point, where)
            trace = traced(condition, condition.start)
            met = [] if trace is None else crossings(trace, axis, place, exact=True)
            if trace is None or not any(_same(point, other) for other in met):
                at = self.plane.described(where)
                self.doubts.append(f"no curve is found through the {point.kind} point at {at}")
                continue
            known += met
            self.traces.append(trace)

    def _condition(self, point: Crossing, where: Real) -> Condition:
        if point.kind == "hopf":
            return Hopf(self.plane, where, point.omega)
        if point.contact is not None:
            return Separation(self.plane, where, point.contact)
        return Divergence(self.plane, where)

    def points(self, axis: int, place: float) -> list[Crossing]:
        """Return the critical points of a line, in ascending order."""
        path = self.plane.line(axis, place)
        kinds, contacts, values, eigenvalues, _, slopes, steady = path.stability_limits()
        lower, upper = self.plane.lower[axis], self.plane.upper[axis]
        return [
            Crossing(
                kind,
                contact,
                (value.real - lower) / (upper - lower),
                abs(eigenvalue.imag) if kind == "hopf" else 0.0,
                int(np.sign(slope)),
                exists,
            )
            for kind, contact, value, eigenvalue, slope, exists in zip(
                kinds, contacts, values, eigenvalues, slopes, steady, strict=True
            )
            if kind == "separation"
            or (kind in ("hopf", "divergence") and self.plane.seen(np.array([eigenvalue])).size)
        ]

    def crossings(self, axis: int, place: float, *, exact: bool = True) -> list[Crossing]:
        """Return where the known curves cross a line, in ascending order; `exact` or on their cubics."""
        met = [point for trace in self.traces for point in crossings(trace, axis, place, exact=exact)]
        return sorted(met, key=lambda point: point.place)

    def compare(self, place: float, count: int) -> tuple[Real, Index, bool]:
        """Return growth rates and numbers of growing eigenvalues along a row, and whether curves tell these.

        Where the cubics between points of curves don't tell them, points of the curves themselves may.
        """
        places = np.array(_middles(count))
        rates, counts, steady = self.verdicts(places, place)
        agrees = False
        for exact in (False, True):
            met = self.crossings(0, place, exact=exact)
            at = np.array([point.place for point in met])
            near = (np.abs(places[:, None] - at) < _BESIDE).any(axis=1)
            agrees = self._tells_counts(place, places, counts, met, near) and _tells_sliding(
                places, steady, met, near
            )
            if agrees:
                break
        return np.where(steady, rates, np.nan), counts, agrees

    def _tells_counts(
        self, place: float, places: Real, counts: Index, met: list[Crossing], near: Flags
    ) -> bool:
        """Return whether numbers of growing eigenvalues change along a row only where curves cross it."""
        expected = counts[0] + np.array([_begun(met, places[0], at) for at in places])
        if (wrong := (counts != expected) & ~near).any() and self.plane.region is not None:
            wrong &= counts + self._departed(0, place, counts) != expected
        return not wrong.any()

    def verdicts(self, places: Real, place: float) -> tuple[Real, Index, Flags]:
        """Return largest growth rates, numbers of growing eigenvalues, whether there is steady sliding."""
        if self.plane.region is None:
            found = self.plane.line(0, place).growth(np.array([self._value(0, at) for at in places]))
            return found["eigenvalue"].real, found["unstable_eigenvalues"], found["steady_sliding"]
        points = np.column_stack([places, np.full(places.size, place)])
        seen = [self.plane.seen(values) for values in eigenvalues(self.plane, points)]
        rates = np.array([values.real.max(initial=-np.inf) for values in seen])
        counts = np.array([growing(values) for values in seen])
        return np.where(np.isfinite(rates), rates, np.nan), counts, slides(self.plane, points)

    def _count(self, u: float, v: float) -> int:
        """Return how many eigenvalues grow at a point."""
        (values,) = eigenvalues(self.plane, np.array([[u, v]]))
        return growing(self.plane.seen(values))

    def _departed(self, axis: int, place: float, counts: Index) -> Index:
        """Return how many growing eigenvalues have left the band since the first place of a line.

        `counts` are those of growing eigenvalues in the band at the places of a line of the finer map.
        """
        places, met = _middles(counts.size), self.crossings(axis, place)
        departed = np.zeros(counts.size, dtype=int)
        for k, (a, b) in enumerate(pairwise(places)):
            gone = counts[k] - counts[k + 1] + _begun(met, a, b)
            if gone and self._passes_bound(axis, place, (a, b), met):
                departed[k + 1 :] += gone
        return departed

    def _passes_bound(self, axis: int, place: float, ends: tuple[float, float], met: list[Crossing]) -> bool:
        """Return whether a growing eigenvalue crosses a bound of the band between two places of a line."""
        region = self.plane.region
        assert region is not None

        def at(value: float) -> Real:
            return np.array([value, place] if axis == 0 else [place, value])

        (a, b), first = ends, self._count(*at(ends[0]))
        for _ in range(_HALVINGS):
            middle = 0.5 * (a + b)
            same = self._count(*at(middle)) == first + _begun(met, ends[0], middle)
            a, b = (middle, b) if same else (a, middle)
        (found,) = eigenvalues(self.plane, at(b)[None])
        found = found[found.real > _AT_BOUND * np.abs(found)]
        for bound in (region.low, region.high):
            if bound and (np.abs(np.abs(found) - bound) <= _AT_BOUND * bound).any():
                self.through.setdefault(bound, []).append(at(b))
                return True
        return False

    @cached_property
    def is_neutral(self) -> bool:
        """Return whether some mode neither grows nor decays wherever one looks."""
        for place in (0.1371, 0.4142, 0.7321):
            values = np.array([self._value(0, at) for at in (0.2361, 0.5773, 0.8660)])
            eigenvalue: Complex = self.plane.line(0, place).sweep(values, False)["eigenvalue"]
            if self.plane.region is not None:
                eigenvalue = np.where(self.plane.region.holds(eigenvalue), eigenvalue, -1.0)
            if not (np.abs(eigenvalue.real) <= _NEUTRAL * np.abs(eigenvalue)).any(axis=1).all():
                return False
        return True

    def _extremes(self) -> list[float]:
        """Return rows through regions, smaller than the cells of the map, in which growth has another sign.

        They are searched for around every extreme of the largest growth rate whose neighbours leave room for
        a change of sign.
        """
        rows = []
        for sign in (1.0, -1.0):
            for j, i in np.argwhere(_peaks(sign * self.growth)):
                place = self._peak(np.array([i, j]), sign)
                rows += [] if place is None or self._tells_count(place) else [float(place[1])]
        return rows

    def _tells_count(self, place: Real) -> bool:
        """Return whether as many eigenvalues grow at a place as the curves say that cross its row."""
        u, v = map(float, place)
        first = 0.5 / len(self.growth)
        counts = self.verdicts(np.array([first, u]), v)[1]
        met = self.crossings(0, v, exact=False)
        return bool(counts[1] - counts[0] == _begun(met, first, u) - _begun(met, u, first))

    def _peak(self, cell: Index, sign: float) -> Real | None:
        """Return a place at which growth has another sign near an extreme, None where it has not."""
        count = len(self.growth)
        centre, half = (cell + 0.5) / count, 1.0 / count
        best = sign * self.growth[cell[1], cell[0]]
        for _ in range(_REFINED):
            steps = np.array([-1.0, -0.5, 0.0, 0.5, 1.0]) * half
            u, v = (np.clip(centre[axis] + steps, _INNER, 1.0 - _INNER) for axis in (0, 1))
            rates = sign * np.array([self.verdicts(u, at)[0] for at in v])
            rates[np.isnan(rates)] = -np.inf
            j, i = np.unravel_index(int(rates.argmax()), rates.shape)
            gained = rates[j, i] - best
            best, centre, half = rates[j, i], np.array([u[i], v[j]]), 0.5 * half
            if best > 0.0:
                return centre
            # Near an extreme what is gained shrinks by four each time; it may shrink by two at a corner.
            if best + _REACH * max(gained, 0.5 * np.ptp(rates)) < 0.0:
                return None
        return None


def _peaks(growth: Real) -> Flags:
    """Return where growth is negative, not smaller than at any neighbour, and within reach of zero."""
    padded = np.pad(np.nan_to_num(growth, nan=-np.inf), 1, constant_values=-np.inf)
    count = growth.shape
    around = [
        padded[1 + j : 1 + j + count[0], 1 + i : 1 + i + count[1]] for j in (-1, 0, 1) for i in (-1, 0, 1)
    ]
    known = np.where(np.isfinite(around), around, growth)
    rise = np.ptp(known, axis=0)
    highest: Flags = (growth >= known.max(axis=0)) & (growth < 0.0) & (growth + _REACH * rise > 0.0)
    return highest


def _middles(count: int) -> list[float]:
    """Return the middles of so many cells of the unit interval."""
    middles: list[float] = ((np.arange(count) + 0.5) / count).tolist()
    return middles


def _begun(met: list[Crossing], a: float, b: float) -> int:
    """Return how many eigenvalues begin to grow from a to b of a line, less those that cease to."""
    return sum(point.begun for point in met if a <= point.place < b)


def _tells_sliding(places: Real, steady: Flags, met: list[Crossing], near: Flags) -> bool:
    """Return whether steady sliding begins and ends along a row where separations say so.

    At a pole, where the stiffness is singular, normal forces change their sign as well.
    """
    separations, poles = np.zeros(places.size - 1, dtype=int), np.zeros(places.size - 1, dtype=bool)
    for point in met:
        between = (places[:-1] < point.place) & (point.place < places[1:])
        if point.kind == "divergence":
            poles |= between
        elif point.kind == "separation" and point.steady:
            separations += between
    wrong = (steady[1:] != steady[:-1]) != (separations % 2 == 1)
    return not (wrong & ~poles & ~(near[1:] | near[:-1])).any()


def _same(point: Crossing, other: Crossing, within: float = _SAME) -> bool:
    """Return whether a critical point of a line is where a curve crosses it."""
    return (
        (point.kind, point.contact) == (other.kind, other.contact)
        and abs(point.place - other.place) <= within
        and abs(point.omega - other.omega) <= 1e-3 * point.omega
    )


def _are_told_by(points: list[Crossing], met: list[Crossing]) -> bool:
    """Return whether the critical points of a line are where the cubics of curves cross it, both in order.

    A curve crosses the line next to its cubic, at a critical point. It is the one that lies there if no other
    does.
    """
    alone = all(b.place - a.place > _APART for a, b in pairwise(points))
    return (
        alone
        and len(points) == len(met)
        and all(_same(a, b, _OF_CUBIC) for a, b in zip(points, met, strict=True))
    )
