"""All curves that meet a map: traced from every critical point of its lines, and compared with its counts.

The lines run through the middles of cells, in both parameters, so that no line is the border, where damping
or friction may vanish. Every critical point of a line has to lie on a curve. The rows of a finer map have to
show the numbers of growing eigenvalues, and whether steady sliding exists, that follow from the curves that
cross them; a row that does not is searched as a line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from stickslip.faults import InputError
from stickslip.locus.boundary.conditions import (
    Condition,
    Divergence,
    Hopf,
    Separation,
    corrected,
    eigenvalues,
    growing,
    margins,
)
from stickslip.locus.boundary.curves import CurveKind
from stickslip.locus.boundary.plane import Plane
from stickslip.locus.boundary.tracing import Trace, hermite, traced
from stickslip.scene.checks import Complex, Flags, Index, Real

#: Rows of the map whose counts are compared, for each line.
FINER = 4
#: Distance, of the range, up to which a critical point of a line lies on a curve.
_SAME = 1e-6
#: Distance to a curve, of the range, within which a count may be that of either side.
_BESIDE = 1e-9
#: Distance from a curve, of the range, that tells its two sides apart.
_ACROSS = 1e-6
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


@dataclass(frozen=True)
class Crossing:
    """Where a line meets a curve: a critical point of the line, or what the curve says."""

    kind: CurveKind
    contact: int | None
    #: place along the line, of its range
    place: float
    #: rad/s, of Hopf points, else zero
    omega: float
    #: +1 where growth, or opening, begins as the parameter of the line grows
    direction: int
    steady: bool


@dataclass
class Search:
    """The curves of a plane, and what is known of its map."""

    plane: Plane
    #: Number of lines in each parameter.
    cells: int
    traces: list[Trace] = field(default_factory=list)
    #: What is not settled, in words.
    doubts: list[str] = field(default_factory=list)
    #: Largest growth rate, 1/s, rows of the second parameter; nan where it is not known.
    growth: Real = field(init=False)
    #: By bound of the band, 1/s: where on a line a growing mode crosses it.
    through: dict[float, list[Real]] = field(default_factory=dict)
    #: Numbers of growing modes, as `growth`.
    modes: Index = field(init=False)

    def __post_init__(self) -> None:
        self.growth = np.full((FINER * self.cells, FINER * self.cells), np.nan)
        self.modes = np.zeros(self.growth.shape, dtype=int)

    def run(self) -> Iterator[tuple[int, int]]:
        """Find everything; yield how many lines and rows of all are done, so that a caller may stop."""
        rows, total = FINER * self.cells, (2 + FINER) * self.cells
        places = (np.arange(self.cells) + 0.5) / self.cells
        for k, (axis, place) in enumerate((axis, float(place)) for axis in (0, 1) for place in places):
            self.search(axis, place)
            yield k + 1, total
        wrong: list[float] = []
        neutral = self.is_neutral()
        for k in range(rows):
            self.growth[k], self.modes[k], agrees = self.compare((k + 0.5) / rows, rows)
            if not agrees:
                wrong.append((k + 0.5) / rows)
            if wrong and neutral:
                raise InputError(
                    "model: a mode neither grows nor decays over all of the map, as without damping: its "
                    "flutter begins at a lock-in, which critical_points finds, and at no Hopf point"
                )
            yield 2 * self.cells + k + 1, total
        for place in self._extremes():
            self.search(0, place)
            yield total, total
        for _ in range(_ROUNDS):
            for place in wrong:
                self.search(0, place)
                yield total, total
            wrong = [place for place in wrong if not self.compare(place, rows)[2]]
        if self.plane.region is not None:
            self._leaves()
        self._join()
        name = self.plane.names[1]
        for place in wrong:
            self.doubts.append(f"counts contradict the curves at {name} = {self._value(1, place):.6g}")
        for bound, where in self.through.items():
            self.doubts.append(
                f"a growing mode crosses the bound of the band at {bound / (2.0 * np.pi):.6g} Hz near "
                f"{self.plane.described(where[0])}, and is not counted beyond; take a wider band"
            )

    def _join(self) -> None:
        """Tell curves that go on in another direction from those that could not be followed any further."""
        lost = [(trace, side) for trace in self.traces for side in (0, 1) if trace.ends[side] == "lost"]
        places = np.array([trace.points[-side][:2] for trace, side in lost]).reshape(-1, 2)
        for (trace, side), place in zip(lost, places, strict=True):
            if np.count_nonzero(np.abs(places - place).max(axis=1) <= _CORNER) > 1:
                trace.ends = ("corner", trace.ends[1]) if side == 0 else (trace.ends[0], "corner")
                continue
            kind, at = kind_of(trace.condition)[0], self.plane.described(place)
            self.doubts.append(f"a {kind} curve could not be followed beyond {at}")

    def _value(self, axis: int, place: float) -> float:
        return self.plane.values((place, place))[self.plane.names[axis]]

    def search(self, axis: int, place: float) -> None:
        """Trace every curve that meets a line and is not known yet."""
        known = self.crossings(axis, place)
        for point in self.points(axis, place):
            if any(_same(point, other) for other in known):
                continue
            where = np.array([point.place, place] if axis == 0 else [place, point.place])
            trace = traced(*self._condition(point, where))
            met = [] if trace is None else crossings(trace, axis, place)
            if trace is None or not any(_same(point, other) for other in met):
                at = self.plane.described(where)
                self.doubts.append(f"no curve is found through the {point.kind} point at {at}")
                continue
            known += met
            self.traces.append(trace)

    def _condition(self, point: Crossing, where: Real) -> tuple[Condition, Real]:
        condition: Hopf | Divergence | Separation
        if point.kind == "hopf":
            condition = Hopf(self.plane, where, point.omega)
        elif point.kind == "divergence":
            condition = Divergence(self.plane, where)
        else:
            assert point.contact is not None
            condition = Separation(self.plane, where, point.contact)
        return condition, condition.start

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
            if kind == "separation" or (kind in ("hopf", "divergence") and self._counts(eigenvalue))
        ]

    def _counts(self, eigenvalue: complex) -> bool:
        return bool(self.plane.seen(np.array([eigenvalue])).size)

    def crossings(self, axis: int, place: float) -> list[Crossing]:
        """Return where the known curves cross a line, in ascending order."""
        met = [point for trace in self.traces for point in crossings(trace, axis, place)]
        return sorted(met, key=lambda point: point.place)

    def compare(self, place: float, count: int) -> tuple[Real, Index, bool]:
        """Return growth rates and numbers of growing modes along a row, and whether curves tell these."""
        places = (np.arange(count) + 0.5) / count
        rates, modes, steady = self.verdicts(places, place)
        met = self.crossings(0, place)
        stable = [point for point in met if point.kind != "separation"]
        steps = np.array([(2 if point.kind == "hopf" else 1) * point.direction for point in stable])
        before = np.array([[point.place < at for point in stable] for at in places]).reshape(count, -1)
        near = np.array([any(abs(point.place - at) < _BESIDE for point in met) for at in places])
        first = self._count(places[0], place) if modes[0] else 0
        expected = first + before @ steps.astype(int) - (before[0] @ steps.astype(int))
        # A growing pair is one mode, and so is a growing real eigenvalue.
        wrong = np.flatnonzero((2 * modes != expected) & ~near)
        if wrong.size:
            whole = np.array([self._count(places[k], place) for k in wrong])
            if self.plane.region is not None:
                every = np.array([self._count(at, place) for at in places])
                whole += self._left(0, place, places, every)[wrong]
            wrong = wrong[whole != expected[wrong]]
        # Between neighbours; at a pole, where the stiffness is singular, forces change their sign as well.
        flips = steady[1:] != steady[:-1]
        kinds = np.array([point.kind if point.steady else "" for point in met], dtype=str)
        between = np.array([(a < point.place < b) for point in met for a, b in pairwise(places)])
        between = between.reshape(len(met), count - 1)
        poles = between[[point.kind == "divergence" for point in met]].any(axis=0)
        opens = between[kinds == "separation"].sum(axis=0) % 2 == 1
        unsteady = (flips != opens) & ~poles & ~(near[1:] | near[:-1])
        growth: Real = np.where(steady, rates, np.nan)
        return growth, modes, not (wrong.size or unsteady.any())

    def verdicts(self, places: Real, place: float) -> tuple[Real, Index, Flags]:
        """Return the largest growth rates, numbers of growing modes, and whether there is steady sliding."""
        if self.plane.region is None:
            found = self.plane.line(0, place).growth(np.array([self._value(0, at) for at in places]))
            return found["eigenvalue"].real, found["unstable_modes"], found["steady_sliding"]
        rates, modes = np.full(places.size, np.nan), np.zeros(places.size, dtype=int)
        steady = np.zeros(places.size, dtype=bool)
        for k, at in enumerate(places):
            y = np.array([at, place])
            seen = self.plane.seen(eigenvalues(self.plane, y))
            rates[k] = seen.real.max(initial=-np.inf)
            modes[k] = growing(seen[seen.imag >= 0.0])
            steady[k] = exists(self.plane, y)
        return np.where(np.isfinite(rates), rates, np.nan), modes, steady

    def _count(self, u: float, v: float) -> int:
        """Return how many eigenvalues grow at a point."""
        return growing(self.plane.seen(eigenvalues(self.plane, np.array([u, v]))))

    def _left(self, axis: int, place: float, places: Real, counts: Index) -> Index:
        """Return how many growing eigenvalues have left the band since the first place of a line."""
        met = [one for one in self.crossings(axis, place) if one.kind != "separation"]
        left = np.zeros(places.size, dtype=int)
        for k, (a, b) in enumerate(pairwise(places)):
            lost = counts[k] - counts[k + 1] + _begun(met, float(a), float(b))
            if lost and self._through(axis, place, float(a), float(b), met):
                left[k + 1 :] += lost
        return left

    def _through(self, axis: int, place: float, a: float, b: float, met: list[Crossing]) -> bool:
        """Return whether a growing eigenvalue crosses a bound of the band between a and b of a line."""
        region = self.plane.region
        assert region is not None

        def at(value: float) -> Real:
            return np.array([value, place] if axis == 0 else [place, value])

        begin, first = a, self._count(*at(a))
        for _ in range(_HALVINGS):
            middle = 0.5 * (a + b)
            same = self._count(*at(middle)) == first + _begun(met, begin, middle)
            a, b = (middle, b) if same else (a, middle)
        found = eigenvalues(self.plane, at(b))
        found = found[found.real > _AT_BOUND * np.abs(found)]
        for bound in (region.low, region.high):
            if bound and (np.abs(np.abs(found) - bound) <= _AT_BOUND * bound).any():
                self.through.setdefault(bound, []).append(at(b))
                return True
        return False

    def _leaves(self) -> None:
        """Find where growing modes cross a bound of the band along columns: along rows they are known."""
        rows = len(self.growth)
        places = (np.arange(rows) + 0.5) / rows
        for place, counts in zip(places, self.modes.T, strict=True):
            self._left(1, float(place), places, 2 * counts)

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
                rows += [] if place is None else [place]
        return rows

    def _peak(self, cell: Index, sign: float) -> float | None:
        """Return the row at which growth changes its sign near an extreme, None where it does not."""
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
                return float(centre[1])
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


def _begun(met: list[Crossing], a: float, b: float) -> int:
    """Return how many eigenvalues begin to grow between two places of a line, less those that cease to."""
    return sum((2 if one.kind == "hopf" else 1) * one.direction for one in met if a < one.place < b)


def _same(point: Crossing, other: Crossing) -> bool:
    """Return whether a critical point of a line is where a curve crosses it."""
    return (
        (point.kind, point.contact) == (other.kind, other.contact)
        and abs(point.place - other.place) <= _SAME
        and abs(point.omega - other.omega) <= 1e-3 * point.omega
    )


def crossings(trace: Trace, axis: int, place: float) -> list[Crossing]:
    """Return where a curve crosses a line along a parameter (`axis`), the other at a place."""
    across = trace.points[:, 1 - axis] - place
    found = []
    for k in np.flatnonzero((across[:-1] < 0.0) != (across[1:] < 0.0)):
        y = crossing_of(trace, int(k), 1 - axis, place)
        growth = trace.condition.growth(y)[axis]
        kind, contact = kind_of(trace.condition)
        omega = y[2] * trace.condition.scale if isinstance(trace.condition, Hopf) else 0.0
        direction, steady = int(np.sign(growth)), is_steady(trace.condition, y)
        found.append(Crossing(kind, contact, float(y[axis]), float(omega), direction, steady))
    return found


def crossing_of(trace: Trace, k: int, axis: int, value: float) -> Real:
    """Return the point between points k and k + 1 of a curve at which a coordinate has a value."""
    low, high = 0.0, 1.0
    below = trace.points[k, axis] < value
    for _ in range(12):
        middle = 0.5 * (low + high)
        if (hermite(trace, k, middle)[axis] < value) == below:
            low = middle
        else:
            high = middle
    guess = hermite(trace, k, 0.5 * (low + high))
    trace.condition.settle(trace.points[k])
    found = corrected(trace.condition, guess, np.eye(guess.size)[axis], value)
    ends = trace.points[k : k + 2]
    other = 1 - axis
    slack = 1e-9 + 1e-3 * abs(ends[1, other] - ends[0, other])
    if found is None or not ends[:, other].min() - slack <= found[0][other] <= ends[:, other].max() + slack:
        return guess
    y: Real = found[0]
    y[axis] = value
    return y


def kind_of(condition: Condition) -> tuple[CurveKind, int | None]:
    """Return the kind of a curve, and the contact of a separation."""
    if isinstance(condition, Hopf):
        return "hopf", None
    if isinstance(condition, Separation):
        return "separation", condition.contact
    return "divergence", None


def is_steady(condition: Condition, y: Real) -> bool:
    """Return whether steady sliding exists at a point, or on one side of it.

    It begins or ends at a separation, and at a divergence, where normal forces have a pole.
    """
    places = [y[:2]]
    if isinstance(condition, Divergence):
        across = condition.equations(y)[1][0]
        step = _ACROSS * across / np.linalg.norm(across)
        places = [y[:2] - step, y[:2] + step]
    for place in places:
        if exists(condition.plane, place, condition.contact if isinstance(condition, Separation) else None):
            return True
    return False


def exists(plane: Plane, place: Real, contact: int | None = None) -> bool:
    """Return whether steady sliding exists at a place, whatever the margin of one contact."""
    values, sizes = margins(plane, place)
    relative = values[0] / sizes
    if contact is not None:
        relative[contact] = 0.0
    return bool((relative >= -64 * np.finfo(float).eps).all())
