"""The reduced matrices of a scene over two parameters, as Chebyshev series in both.

Along either parameter alone the series of `stickslip.locus.path` say into which pieces the range has to be
divided and how many terms a piece needs; products of these terms are compared with the scene between the
points at which it was sampled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from stickslip import _core
from stickslip.faults import InputError
from stickslip.locus.band.space import INTERPOLATED, Projected
from stickslip.locus.path import (
    CHECKS,
    STATICS,
    Interpolation,
    Sliding,
    agrees,
    coefficients_of,
)
from stickslip.modes.sparse.region import Region
from stickslip.scene.checks import Complex, Real

#: Largest error of an interpolant, in errors of one parameter: twice that, in each.
_ERROR = 4.0
#: Terms added to each parameter where the products of those of either one don't suffice.
_MORE = 4
#: Terms in one parameter after which the scene counts as not smooth.
_MOST = 41


class Expansion(NamedTuple):
    """M, C, K, load, rows and offsets at a point of the unit square, each with d/du and d/dv, (3, ...)."""

    mass: Real
    damping: Real
    stiffness: Real
    load: Real
    rows: Real
    offsets: Real


@dataclass(frozen=True)
class _Piece:
    """Coefficients of every sampled array, (terms in p, terms in q, ...), on a rectangle."""

    lower: tuple[float, float]
    upper: tuple[float, float]
    series: tuple[Real, ...]

    @property
    def terms(self) -> tuple[int, ...]:
        """How many terms there are in p and in q."""
        return self.series[0].shape[:2]

    @cached_property
    def whole(self) -> Real:
        """The coefficients of all arrays side by side, (products of terms, entries)."""
        return np.concatenate([c.reshape(math.prod(self.terms), -1) for c in self.series], axis=1)

    @cached_property
    def parts(self) -> list[tuple[slice, tuple[int, ...]]]:
        """Where every array stands in `whole`, and its shape."""
        ends = np.cumsum([0, *(c[0, 0].size for c in self.series)])
        return [(slice(a, b), c.shape[2:]) for a, b, c in zip(ends, ends[1:], self.series, strict=False)]

    def along(self, t: float, axis: int) -> list[Real]:
        """Return the coefficients of all arrays in the other parameter, that of `axis` at t in [-1, 1]."""
        terms = np.array(_polynomials(t, self.terms[axis], 1.0)[0])
        whole = np.tensordot(terms, self.whole.reshape(*self.terms, -1), (0, axis))
        return [
            np.ascontiguousarray(whole[:, part]).reshape(len(whole), *shape) for part, shape in self.parts
        ]

    def local(self, value: float, axis: int) -> float:
        """Return t in [-1, 1] of a value of one parameter."""
        centre = 0.5 * (self.lower[axis] + self.upper[axis])
        return (value - centre) / (0.5 * (self.upper[axis] - self.lower[axis]))


class Plane:
    """A family of scenes over two parameters.

    `sliding` has the scenes and their status combination, `ranges` the lower and upper value of two
    parameters by name, `fixed` the values of others. `region` is the part of the plane of eigenvalues that
    counts; None: all of it. `basis`, (m, r), are directions on which the matrices are projected; None: they
    are not.
    """

    def __init__(
        self,
        sliding: Sliding,
        ranges: Mapping[str, tuple[float, float]],
        fixed: Mapping[str, float],
        region: Region | None = None,
        basis: Real | None = None,
    ) -> None:
        self.sliding, self.fixed = sliding, dict(fixed)
        self.region, self.basis = region, basis
        first, second = ranges
        self.names = (first, second)
        self.lower = tuple(ranges[name][0] for name in self.names)
        self.upper = tuple(ranges[name][1] for name in self.names)
        # Ranges are divided, and terms counted, along the middle of the square; an odd part of it, because
        # a middle may be a place of symmetry.
        middle = [a + 0.4871 * (b - a) for a, b in zip(self.lower, self.upper, strict=True)]
        breaks: list[list[float]] = []
        terms: list[int] = []
        for axis in (0, 1):
            fixed_there = {**self.fixed, self.names[1 - axis]: middle[1 - axis]}
            along = (
                Interpolation(sliding, self.names[axis], fixed_there)
                if basis is None
                else Projected(sliding, self.names[axis], fixed_there, INTERPOLATED, basis)
            )
            pieces = along.fitted(self.lower[axis], self.upper[axis])
            breaks.append([self.lower[axis], *(piece[1] for piece in pieces)])
            terms.append(max(len(series) for piece in pieces for series in _flat(piece)))
        self.letters, self.size, self.proportional = along.letters, along.size, along.proportional
        self._along = along
        self.pieces = [
            self._fitted((a, c), (b, d), (terms[0], terms[1]))
            for a, b in pairwise(breaks[0])
            for c, d in pairwise(breaks[1])
        ]

    def seen(self, eigenvalues: Complex) -> Complex:
        """Return those of some eigenvalues that count."""
        return eigenvalues if self.region is None else eigenvalues[self.region.holds(eigenvalues)]

    def values(self, place: Any) -> dict[str, float]:
        """Return the parameters at a point (u, v) of the unit square."""
        ends = zip(self.names, self.lower, self.upper, place, strict=True)
        return {name: float(a + u * (b - a)) for name, a, b, u in ends}

    def described(self, place: Any) -> str:
        """Return the parameters at a point of the unit square in words."""
        return ", ".join(f"{name} = {value:.6g}" for name, value in self.values(place).items())

    def _sample(self, p: float, q: float) -> tuple[Real, ...]:
        values = dict(zip(self.names, (p, q), strict=True))
        scene = self.sliding.family.scene({**self.fixed, **values})
        if self.sliding.letters(scene) != self.letters:
            start = dict(zip(self.names, self.lower, strict=True))
            for name, at in values.items():
                self.sliding.check_direction(self.letters, name, (start[name], at), {**self.fixed, **start})
                start[name] = at
        sampled = self._along.matrices(scene)
        if sampled[0].shape[0] != self.size or self._along.is_proportional(scene) != self.proportional:
            raise InputError(f"parameters: the kind of scene must not change over them, as at {values}")
        return sampled

    def _fitted(
        self, lower: tuple[float, float], upper: tuple[float, float], terms: tuple[int, int]
    ) -> _Piece:
        centre, half = 0.5 * np.add(lower, upper), 0.5 * np.subtract(upper, lower)

        def at(s: float, t: float) -> tuple[Real, ...]:
            place = np.where(np.array([s, t]) == -1.0, lower, centre + half * np.array([s, t]))
            return self._sample(*map(float, np.where(np.array([s, t]) == 1.0, upper, place)))

        checks = {(s, t): at(s, t) for s in CHECKS for t in CHECKS}
        first, second = (max(count, 2) for count in terms)
        while max(first, second) <= _MOST:
            nodes = [np.cos(np.pi * np.arange(count) / (count - 1)) for count in (first, second)]
            for points in nodes:
                points[0], points[-1] = 1.0, -1.0
            sampled = [[at(float(s), float(t)) for t in nodes[1]] for s in nodes[0]]
            series = []
            for k in range(len(sampled[0][0])):
                grid = np.array([[entry[k] for entry in row] for row in sampled])
                grid = np.moveaxis(coefficients_of(np.moveaxis(grid, 1, 0)), 0, 1)
                series.append(coefficients_of(grid))
            piece = _Piece(lower, upper, tuple(series))
            if all(
                agrees(c, t, value, len(check) - k <= STATICS, _ERROR * self._along.error)
                for (s, t), check in checks.items()
                for k, (c, value) in enumerate(zip(piece.along(s, 0), check, strict=True))
            ):
                return piece
            tails = [max(_tail(c, axis) for c in series) for axis in (0, 1)]
            first, second = (first + _MORE, second) if tails[0] > tails[1] else (first, second + _MORE)
        raise InputError(
            f"{self.names[0]}, {self.names[1]}: the model is not a smooth function of both near "
            f"{centre.tolist()}; take smaller ranges"
        )

    def _piece(self, values: tuple[float, float]) -> _Piece:
        """Return the piece that holds a point, or the nearest one."""

        def outside(piece: _Piece) -> float:
            excess = np.maximum(np.subtract(piece.lower, values), np.subtract(values, piece.upper))
            return float((excess / np.subtract(self.upper, self.lower)).max())

        return self.pieces[0] if len(self.pieces) == 1 else min(self.pieces, key=outside)

    def at(self, u: float, v: float) -> Expansion:
        """Return the matrices and their derivatives at a point of the unit square."""
        spans = [b - a for a, b in zip(self.lower, self.upper, strict=True)]
        values = (self.lower[0] + u * spans[0], self.lower[1] + v * spans[1])
        piece = self._piece(values)
        (first, by_first), (second, by_second) = (
            _polynomials(
                piece.local(values[axis], axis),
                terms,
                2.0 * spans[axis] / (piece.upper[axis] - piece.lower[axis]),
            )
            for axis, terms in enumerate(piece.terms)
        )
        # Of the values, of d/du and of d/dv.
        weights = (
            np.array([first, by_first, first])[:, :, None] * np.array([second, second, by_second])[:, None]
        )
        whole = weights.reshape(3, -1) @ piece.whole
        expanded = [whole[:, part].reshape(3, *shape) for part, shape in piece.parts]
        mass, *damping, stiffness = expanded[:-STATICS]
        load, rows, offsets, _ = expanded[-STATICS:]
        if self.proportional:
            alpha, beta = damping
            viscous = alpha[0] * mass + beta[0] * stiffness
            if alpha[1:].any() or beta[1:].any():
                viscous[1:] += alpha[1:] * mass[0] + beta[1:] * stiffness[0]
            damping = [viscous]
        return Expansion(mass, damping[0], stiffness, load[:, 0], rows, offsets[:, 0])

    def line(self, axis: int, place: float) -> _core.Path:
        """Return the path along one parameter (`axis` 0 or 1), the other at a place of the unit interval."""
        other = 1 - axis
        value = self.lower[other] + place * (self.upper[other] - self.lower[other])
        row = [
            piece
            for piece in self.pieces
            if piece.lower[other] <= value < piece.upper[other]
            or value == piece.upper[other] == self.upper[other]
        ]
        pieces = []
        for piece in row:
            series = piece.along(piece.local(value, other), other)
            mass, *damping, stiffness = series[:-STATICS]
            law: Any = tuple(c[:, 0, 0] for c in damping) if self.proportional else damping[0]
            pieces.append((piece.lower[axis], piece.upper[axis], mass, law, stiffness, series[-STATICS:]))
        return _core.Path(self.letters, self.size, pieces)


def _flat(piece: tuple[Any, ...]) -> list[Real]:
    """Return all series of a piece of a path."""
    _, _, mass, damping, stiffness, statics = piece
    return [mass, *(damping if isinstance(damping, tuple) else (damping,)), stiffness, *statics]


def _tail(series: Real, axis: int) -> float:
    """Return the largest coefficient of the last two terms in one parameter, of all coefficients."""
    last = np.moveaxis(np.abs(series), axis, 0)[-2 if series.shape[axis] > 2 else -1 :]
    return float(last.max(initial=0.0) / max(np.abs(series).max(initial=0.0), 1e-300))


def _polynomials(t: float, terms: int, rate: float) -> tuple[list[float], list[float]]:
    """Return so many Chebyshev polynomials, and their derivatives times `rate`."""
    values, slopes = [1.0, t], [0.0, rate]
    for _ in range(2, terms):
        slopes.append(2.0 * (rate * values[-1] + t * slopes[-1]) - slopes[-2])
        values.append(2.0 * t * values[-1] - values[-2])
    return values[:terms], slopes[:terms]
