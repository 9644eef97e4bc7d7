"""One status combination of a scene along one of its parameters.

The reduced matrices along a parameter are what sweeps, critical points and sensitivities are computed from.
Friction enters them linearly, and the core forms that path exactly. Any other parameter belongs to a model
function, which is sampled at Chebyshev points until the interpolating polynomials leave rounding (Trefethen
2013, chapters 2 to 8); where they don't, the interval is halved.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeGuard

import numpy as np
import scipy.fft
from scipy.optimize import brentq

from stickslip import _core
from stickslip.faults import InputError
from stickslip.scene.checks import Real
from stickslip.scene.contact import concerns, steady_slips
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.laws.friction import Tabulated
from stickslip.scene.parameters.family import Family
from stickslip.scene.parameters.numbers import number_of
from stickslip.scene.scene import Scene

#: Numbers of Chebyshev points tried on one interval, each twice as fine as the one before.
_POINTS = (3, 5, 9, 17, 33)
#: Where interpolants are compared with the model, in (-1, 1), away from every Chebyshev point.
CHECKS = (-0.61803398875, 0.2360679775)
#: Largest error of an interpolant, of the largest entry of its row: some rounding errors of forming an entry.
INTERPOLATED = 64 * np.finfo(float).eps
#: How many of the sampled arrays are `Reduced.statics`.
STATICS = 4
#: Which of them, from the end, are the rows of contact forces.
ROWS = 3
#: Halvings of the range after which a model counts as not smooth.
_HALVINGS = 12


@dataclass(frozen=True)
class Sliding:
    """A family of scenes in one status combination; None: in that of steady sliding."""

    family: Family
    combination: str | None = None

    def letters(self, scene: Scene) -> str:
        """Return the status combination for a scene of the family."""
        return scene.core.sliding_combination() if self.combination is None else self.combination

    def check_direction(
        self, letters: str, name: str, ends: tuple[float, float], fixed: Mapping[str, float]
    ) -> None:
        """Refuse a path on which sliding turns round or contacts open: no branch leads across.

        `letters` is the combination at the first of the `ends`.
        """

        def scene_at(value: float) -> Scene:
            return self.family.scene({**fixed, name: value})

        if self.combination is not None or self.letters(scene_at(ends[1])) == letters:
            return
        before, after = ends
        while min(before, after) < (middle := 0.5 * (before + after)) < max(before, after):
            scene = scene_at(middle)
            sliding = [concerns("slider_speed", contact) for contact in scene.contacts]
            if np.any(steady_slips(scene.contacts)[sliding] == 0.0):
                after = middle
                break
            if self.letters(scene) == letters:
                before = middle
            else:
                after = middle
        other = self.letters(scene_at(ends[1]))
        # Zero without a sign.
        value = after + 0.0
        opens = [(one == "d") != (two == "d") for one, two in zip(letters, other, strict=True)]
        turns = [one != two and not open for one, two, open in zip(letters, other, opens, strict=True)]
        what = ["contacts open or close"] * any(opens) + ["slider speeds change their sign"] * any(turns)
        raise InputError(
            f"{name}: {' and '.join(what)} at {value:.6g}, and steady sliding changes from {letters!r} to "
            f"{other!r}; take either side by itself, or pass combination"
        )

    def path(self, name: str, lower: float, upper: float, fixed: Mapping[str, float]) -> _core.Path:
        """Return the path from `lower` to `upper` of one parameter, the others at `fixed` values."""
        if not is_linear(self.family.model, name):
            return Interpolation(self, name, fixed).path(lower, upper)
        # Both ends are validated; what lies between them is then valid as well.
        scene = self.family.scene({**fixed, name: lower})
        other = self.family.scene({**fixed, name: upper})
        letters = self.letters(scene)
        self.check_direction(letters, name, (lower, upper), fixed)
        moving = moved_friction(scene, name)
        return _core.Path.contact_law(scene.core, other.core, letters, moving, lower, upper)


def is_linear(model: object, name: str) -> TypeGuard[Scene]:
    """Return whether the reduced matrices of a scene change with a number of its contacts linearly.

    Friction does, and no other number of a contact changes them. This does not hold where dofs have no mass,
    directions depend on each other, friction is a law over slip speed or acts in a plane, or springs are no
    entries of K.
    """
    if not isinstance(model, Scene) or number_of(model, name).owner != "contact":
        return False
    core = model.core
    return not (core.has_massless or core.dependent or core.has_elements or _bends(core))


def _bends(core: _core.Scene) -> bool:
    """Return whether friction changes with the slip velocity, beside its sign."""
    return core.has_friction_laws or core.has_planes


def moved_friction(scene: Scene, name: str) -> list[int]:
    """Return the contacts whose friction a parameter of a scene moves: none if it is another one."""
    if scene.core.has_elements or _bends(scene.core):
        return []
    number = number_of(scene, name)
    return list(number.places) if (number.owner, number.field) == ("contact", "friction") else []


@dataclass
class Interpolation:
    """Samples of the reduced matrices of a model over one parameter."""

    sliding: Sliding
    name: str
    fixed: Mapping[str, float]
    #: Largest error of an interpolant, of the largest entry of its row.
    error: float = INTERPOLATED

    def path(self, lower: float, upper: float) -> _core.Path:
        """Return the path from `lower` to `upper`."""
        pieces = self.fitted(lower, upper)
        return _core.Path(self.letters, self.size, pieces)

    def fitted(self, lower: float, upper: float) -> list[Any]:
        """Return the Chebyshev series from `lower` to `upper`, piece by piece."""
        scene = self.scene(lower)
        self.letters, self.lower = self.sliding.letters(scene), lower
        self.proportional, self.dependent = self.is_proportional(scene), scene.core.dependent
        self.elements = scene.core.has_elements
        self.known: dict[float, tuple[Real, ...]] = {lower: self.matrices(scene)}
        self.size = self.known[lower][0].shape[0]
        ends = [lower, *self.knots(scene, upper), upper]
        return [piece for a, b in pairwise(ends) for piece in self.pieces(a, b, _HALVINGS)]

    def knots(self, scene: Scene, upper: float) -> list[float]:
        """Return where contacts slide at a speed of their tables, ascending: two cubics of mu meet there.

        These are the speeds between those of `scene`, at the lower end, and those at `upper`.
        """
        lower = self.lower

        def excess(value: float, contact: int, knot: float) -> float:
            return float(steady_slips(self.scene(value).contacts)[contact]) - knot

        found: set[float] = set()
        for k, contact in enumerate(scene.contacts):
            for knot in contact.friction.speeds if isinstance(contact.friction, Tabulated) else ():
                if excess(lower, k, knot) * excess(upper, k, knot) < 0.0:
                    place = brentq(excess, lower, upper, (k, knot), xtol=1e-300, rtol=4 * np.finfo(float).eps)
                    found.add(float(place))
        return sorted(found - {lower, upper})

    def scene(self, value: float) -> Scene:
        """Return the scene at a value."""
        return self.sliding.family.scene({**self.fixed, self.name: value})

    def sample(self, value: float) -> tuple[Real, ...]:
        """Return M, C (or alpha and beta), K and statics; matrices (m, m), numbers (1, 1)."""
        if value not in self.known:
            scene = self.scene(value)
            if self.sliding.letters(scene) != self.letters:
                self.sliding.check_direction(self.letters, self.name, (self.lower, value), self.fixed)
            if self.is_proportional(scene) != self.proportional:
                raise InputError(
                    f"{self.name}: the kind of damping must not change along it, as at {value!r}"
                )
            sampled = self.matrices(scene)
            if sampled[0].shape[0] != self.size:
                raise InputError(f"{self.name}: the number of dofs must not change along it, as at {value!r}")
            self.known[value] = sampled
        return self.known[value]

    def is_proportional(self, scene: Scene) -> bool:
        """Return whether alpha and beta stand for C."""
        return is_proportional(scene)

    def matrices(self, scene: Scene) -> tuple[Real, ...]:
        """Return what is sampled of a scene."""
        core = scene.core.reduced(self.letters)
        damping: tuple[Real, ...] = (core.damping,)
        if self.proportional:
            law = scene.damping if isinstance(scene.damping, Rayleigh) else Rayleigh()
            damping = (np.array([[law.mass]]), np.array([[law.stiffness]]))
        return (core.mass, *damping, core.stiffness, *core.statics)

    def least(self, sampled: tuple[Real, ...], k: int) -> float:
        """Return the size of which the rounding of a sampled array is a part, whatever its entries.

        Where directions depend on each other, rows of contact forces are what is left of rows of K. Loads
        beside the tangents of elements are what is left of forces as large as those of the contacts.
        """
        if self.elements and k == len(sampled) - STATICS:
            return float(np.abs(sampled[-STATICS + 2]).max(initial=0.0))
        if not self.dependent or k != len(sampled) - ROWS:
            return 0.0
        return float(np.abs(sampled[-STATICS - 1]).max(initial=0.0))

    def pieces(self, lower: float, upper: float, halvings: int) -> list[Any]:
        """Return Chebyshev series on adjacent intervals, each halved at most so often."""
        centre, half = 0.5 * (lower + upper), 0.5 * (upper - lower)

        def at(t: float) -> tuple[Real, ...]:
            # The ends of adjacent intervals are the same point, exactly.
            return self.sample({-1.0: lower, 1.0: upper}.get(t, centre + half * t))

        checks = [at(t) for t in CHECKS]
        for points in _POINTS:
            nodes = np.cos(np.pi * np.arange(points) / (points - 1))
            nodes[0], nodes[-1] = 1.0, -1.0
            sampled = [at(float(t)) for t in nodes]
            series = [coefficients_of(np.array(values)) for values in zip(*sampled, strict=True)]
            if all(
                # Loads may vanish on the way: their error counts beside their largest value.
                agrees(coefficients, t, value, len(check) - k <= STATICS, self.error, self.least(check, k))
                for t, check in zip(CHECKS, checks, strict=True)
                for k, (coefficients, value) in enumerate(zip(series, check, strict=True))
            ):
                shortened = [_shortened(coefficients) for coefficients in series]
                mass, *damping, stiffness = shortened[:-STATICS]
                law = tuple(c[:, 0, 0].copy() for c in damping) if self.proportional else damping[0]
                return [(lower, upper, mass, law, stiffness, shortened[-STATICS:])]
        if halvings == 0:
            raise InputError(
                f"{self.name}: the model is not a smooth function of it near {centre!r}; "
                "sweep the ranges in which it is, one by one"
            )
        return [
            *self.pieces(lower, centre, halvings - 1),
            *self.pieces(centre, upper, halvings - 1),
        ]


def is_proportional(scene: Scene) -> bool:
    """Return whether ``C + G = alpha M + beta (K + H)`` by what is stated, whatever the numbers."""
    if scene.core.has_massless or scene.core.has_elements or _bends(scene.core):
        return False
    if scene.damping is None:
        return scene.gyroscopic is None
    return isinstance(scene.damping, Rayleigh) and not scene.unsymmetric


def coefficients_of(values: Real) -> Real:
    """Return Chebyshev coefficients of values at ``cos(pi j / (k - 1))``, (k, ...)."""
    coefficients: Real = scipy.fft.dct(values, type=1, axis=0) / (len(values) - 1)
    coefficients[[0, -1]] *= 0.5
    return coefficients


def agrees(coefficients: Real, t: float, value: Real, whole: bool, error: float, least: float = 0.0) -> bool:
    """Return whether a series has a value at t; `whole`: to an error of its largest value, or of `least`."""
    interpolated = np.polynomial.chebyshev.chebval(t, coefficients)
    largest = np.abs(coefficients).sum(axis=0).max(initial=0.0)
    scale = np.maximum(
        np.abs(value).max(axis=1, keepdims=True, initial=least), largest * (1.0 if whole else 1e-300)
    )
    return bool((np.abs(interpolated - value) <= error * scale).all())


def _shortened(coefficients: Real) -> Real:
    """Drop the last coefficients where they are rounding."""
    scale = np.abs(coefficients).sum(axis=0).max(axis=-1, keepdims=True, initial=0.0)
    significant = (np.abs(coefficients) > 8 * np.finfo(float).eps * scale).any(axis=(1, 2))
    last = int(np.flatnonzero(significant).max(initial=0))
    return np.ascontiguousarray(coefficients[: last + 1])
