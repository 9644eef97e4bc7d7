"""What holds on a curve: equations in the unit square, with the derivatives that Newton's method needs.

A point of a curve is ``y = (u, v)`` in the unit square, of Hopf curves ``(u, v, w)`` with the frequency
``omega = w scale``. Minimally augmented systems (Govaerts 2000, chapters 4 and 9): with borders b and c

    [P  b] [x]   [0]
    [c* 0] [g] = [1],    P = K + i omega C - omega^2 M,

g vanishes where P is singular, and ``dg = -z* dP x`` with the last row (z*, g) of the inverse. The borders
are the null vectors at the point before.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
import scipy.linalg

from stickslip.locus.boundary.curves import CurveKind
from stickslip.locus.boundary.plane import Plane
from stickslip.scene.checks import Complex, Real

#: Steps of Newton's method at most; quadratic convergence from a good start takes three.
_STEPS = 8
#: Step, in the unit square, below which Newton's method has converged.
_CONVERGED = 1e-13
#: Step up to which a point counts as found where rounding stops the method.
_FOUND = 1e-9
#: Reciprocal of an eigenvalue, of that of the stiffest direction, up to which it is of a massless one.
_INFINITE = 1e-13
#: Real part of an eigenvalue, of its modulus, up to which it neither grows nor decays.
_NEUTRAL = 1e-11
#: Condition up to which a mass, and a projected one, whose eigenvalues have fewer digits, is inverted: that
#: takes a tenth to a third of the time.
_REGULAR, _REGULAR_PROJECTED = 1e3, 1e8
#: Damping of a zero eigenvalue below this part of its terms is none.
_UNDAMPED = 1e-10
#: Distance from a curve, of the range, that tells its two sides apart.
_ACROSS = 1e-6


class Condition(ABC):
    """One or two equations in two or three unknowns."""

    kind: ClassVar[CurveKind]
    #: the contact that separates
    contact: int | None = None
    plane: Plane
    #: where it was found
    start: Real
    #: between which unknowns lie beyond the two of the square, (lowest, highest)
    limits: tuple[float, float] = (0.0, np.inf)

    def omega(self, y: Real) -> float:
        """Return the frequency at a point of a Hopf curve, rad/s, zero on others."""
        return 0.0

    @abstractmethod
    def equations(self, y: Real) -> tuple[Real, Real]:
        """Return residuals (n - 1,) and their derivatives (n - 1, n)."""

    @abstractmethod
    def settle(self, y: Real) -> float:
        """Take the borders from a point of the curve; return by how much the condition misses there."""

    @abstractmethod
    def growth(self, y: Real) -> Real:
        """Return d/du and d/dv of what passes zero across the curve."""


class Hopf(Condition):
    """Two eigenvalues ``+-i omega``, of the part of the spectrum that counts."""

    kind = "hopf"

    def __init__(self, plane: Plane, place: Real, omega: float) -> None:
        self.plane, self.scale = plane, omega
        region = plane.region
        self.limits = (0.0, np.inf) if region is None else (region.low / omega, region.high / omega)
        self._known: tuple[Real, Any] | None = None
        m, c, k = (part[0] for part in plane.at(*place)[:3])
        size = np.abs(k) + omega * np.abs(c) + omega**2 * np.abs(m)
        self.units = 1.0 / np.sqrt(np.maximum(size.max(axis=0), size.max(axis=1)))
        self.start = np.array([*place, 1.0])
        left, _, right = scipy.linalg.svd(self._pencil(self.start)[0])
        self.b, self.c = left[:, -1], right[-1].conj()

    def omega(self, y: Real) -> float:
        """Return the frequency at a point, rad/s."""
        return float(y[2] * self.scale)

    def _pencil(self, y: Real) -> tuple[Complex, list[Complex]]:
        """Return P, and its derivatives to u, v and w."""
        omega = self.omega(y)
        m, c, k = self.plane.at(y[0], y[1])[:3]
        all_parts = (k + 1j * omega * c - omega**2 * m) * self.units[:, None] * self.units
        by_omega = (1j * c[0] - 2.0 * omega * m[0]) * self.units[:, None] * self.units
        return all_parts[0], [all_parts[1], all_parts[2], self.scale * by_omega]

    def _bordered(self, y: Real) -> Any:
        """Return g, its derivatives, x and z*; at a point of the curve those of any borders will do."""
        if self._known is not None and (self._known[0] == y).all():
            return self._known[1]
        pencil, slopes = self._pencil(y)
        size = len(pencil)
        whole = np.zeros((size + 1, size + 1), dtype=complex)
        whole[:size, :size], whole[:size, size], whole[size, :size] = pencil, self.b, self.c.conj()
        inverse = np.linalg.inv(whole)
        x, z = inverse[:size, size], inverse[size, :size]
        found = complex(inverse[size, size]), [complex(-(z @ slope @ x)) for slope in slopes], x, z
        self._known = y.copy(), found
        return found

    def equations(self, y: Real) -> tuple[Real, Real]:
        """Return the real and the imaginary part of g, and their derivatives (2, 3)."""
        g, slopes, _, _ = self._bordered(y)
        row = np.array(slopes)
        return np.array([g.real, g.imag]), np.array([row.real, row.imag])

    def settle(self, y: Real) -> float:
        """Take the borders from a point; return |g|, of P with rows and columns of size 1."""
        g, _, x, z = self._bordered(y)
        sizes = np.linalg.norm(z), np.linalg.norm(x)
        self.b, self.c = z.conj() / sizes[0], x / sizes[1]
        return float(abs(g) / (sizes[0] * sizes[1]))

    def growth(self, y: Real) -> Real:
        """Return the derivatives of the real part of lambda, 1/s: ``lambda = i (w - g / g_w) scale``."""
        _, slopes, _, _ = self._bordered(y)
        return np.array([(-1j * self.scale * slope / slopes[2]).real for slope in slopes[:2]])


class Divergence(Condition):
    """An eigenvalue that is zero."""

    kind = "divergence"

    def __init__(self, plane: Plane, place: Real) -> None:
        self.plane, self.start = plane, np.array(place, dtype=float)
        mass, damping, stiffness = (part[0] for part in plane.at(*place)[:3])
        # What else acts on a direction sizes it where its stiffness is what vanishes.
        rate = _rate(mass, stiffness)
        size = np.abs(stiffness) + rate * np.abs(damping) + rate**2 * np.abs(mass)
        self.units = 1.0 / np.sqrt(np.maximum(size.max(axis=0), size.max(axis=1)))
        left, _, right = scipy.linalg.svd(stiffness * self.units[:, None] * self.units)
        self.b, self.c = left[:, -1], right[-1]

    def _bordered(self, y: Real) -> tuple[float, Real, Real, Real, float]:
        """Return g, its derivatives, x, z, and what has the sign of d lambda for a positive dg."""
        mass, damping, stiffness = self.plane.at(y[0], y[1])[:3]
        stiffness = stiffness * self.units[:, None] * self.units
        size = stiffness.shape[1]
        whole = np.zeros((size + 1, size + 1))
        whole[:size, :size], whole[:size, size], whole[size, :size] = stiffness[0], self.b, self.c
        inverse = np.linalg.inv(whole)
        x, z = inverse[:size, size], inverse[size, :size]
        slopes = np.array([-(z @ slope @ x) for slope in stiffness[1:]])
        # z' M x lambda^2 + z' C x lambda = dg: without the second term a pair meets at zero.
        left, right = z * self.units, x * self.units
        leading = float(left @ damping[0] @ right)
        if abs(leading) <= _UNDAMPED * (np.abs(left) @ np.abs(damping[0]) @ np.abs(right)):
            leading = float(left @ mass[0] @ right)
        return float(inverse[size, size]), slopes, x, z, leading

    def equations(self, y: Real) -> tuple[Real, Real]:
        """Return g (1,) and its derivatives (1, 2)."""
        g, slopes, *_ = self._bordered(y)
        return np.array([g]), slopes[None]

    def settle(self, y: Real) -> float:
        """Take the borders from a point; return |g|, of K with rows and columns of size 1."""
        g, _, x, z, _ = self._bordered(y)
        sizes = np.linalg.norm(z), np.linalg.norm(x)
        self.b, self.c = z / sizes[0], x / sizes[1]
        return float(abs(g) / (sizes[0] * sizes[1]))

    def growth(self, y: Real) -> Real:
        """Return the derivatives of lambda, up to a positive factor."""
        _, slopes, _, _, leading = self._bordered(y)
        growth: Real = slopes * np.sign(leading)
        return growth


class Separation(Condition):
    """The normal force of a contact, or the gap of an open one, that vanishes in steady sliding."""

    kind = "separation"
    contact: int

    def __init__(self, plane: Plane, place: Real, contact: int) -> None:
        self.plane, self.contact, self.start = plane, contact, np.array(place, dtype=float)

    def _margin(self, y: Real) -> tuple[float, Real, float]:
        """Return the margin, its derivatives and the size of its terms."""
        values, terms = margins(self.plane, y)
        return values[0, self.contact], values[1:, self.contact], terms[self.contact]

    def equations(self, y: Real) -> tuple[Real, Real]:
        """Return the margin, of the size of its terms, (1,), and its derivatives (1, 2)."""
        value, slopes, size = self._margin(y)
        return np.array([value / size]), slopes[None] / size

    def settle(self, y: Real) -> float:
        """Return the margin, of its terms."""
        value, _, size = self._margin(y)
        return abs(value / size)

    def growth(self, y: Real) -> Real:
        """Return the derivatives of the margin with the sign by which opening grows."""
        return -self._margin(y)[1]


def margins(plane: Plane, y: Any) -> tuple[Real, Real]:
    """Return margins of all contacts with d/du and d/dv (3, c), and the sizes of their terms (c,).

    Where the stiffness is singular, a margin has a pole, and is as large as its terms.
    """
    _, _, stiffness, load, rows, offsets = plane.at(float(y[0]), float(y[1]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scipy.linalg.LinAlgWarning)
        factors = scipy.linalg.lu_factor(stiffness[0], check_finite=False)
    if not np.diagonal(factors[0]).all():
        return np.ones((3, len(rows[0]))), np.ones(len(rows[0]))
    rest = scipy.linalg.lu_solve(factors, load[0], check_finite=False)
    moved = [
        scipy.linalg.lu_solve(factors, load[k] - stiffness[k] @ rest, check_finite=False) for k in (1, 2)
    ]
    slopes = [rows[0] @ moved[k - 1] + rows[k] @ rest - offsets[k] for k in (1, 2)]
    # Without load all terms vanish together; what they change by over the range remains.
    sizes = np.abs(rows[0]) @ np.abs(rest) + np.abs(offsets[0]) + np.abs(slopes).sum(axis=0)
    return np.array([rows[0] @ rest - offsets[0], *slopes]), np.maximum(sizes, 1e-300)


def slides(plane: Plane, place: Real, but: int | None = None) -> bool:
    """Return whether steady sliding exists at a place, whatever the margin of one contact (`but`)."""
    values, sizes = margins(plane, place)
    relative = values[0] / sizes
    if but is not None:
        relative[but] = 0.0
    return bool((relative >= -64 * np.finfo(float).eps).all())


def is_steady(condition: Condition, y: Real) -> bool:
    """Return whether steady sliding exists at a point of a curve, or on one side of it.

    It begins or ends at a separation, and at a divergence, where normal forces have a pole.
    """
    places = [y[:2]]
    if isinstance(condition, Divergence):
        across = condition.equations(y)[1][0]
        step = _ACROSS * across / np.linalg.norm(across)
        places = [y[:2] - step, y[:2] + step]
    return any(slides(condition.plane, place, condition.contact) for place in places)


def eigenvalues(plane: Plane, y: Real) -> Complex:
    """Return all finite eigenvalues at a point, also those that do not count."""
    mass, damping, stiffness = (part[0] for part in plane.at(float(y[0]), float(y[1]))[:3])
    size = len(mass)
    rate = _rate(mass, stiffness)
    if np.linalg.cond(mass) < (_REGULAR if plane.basis is None else _REGULAR_PROJECTED):
        factors = scipy.linalg.lu_factor(rate**2 * mass, check_finite=False)
        single = np.eye(2 * size, k=size)
        single[size:] = -scipy.linalg.lu_solve(factors, np.hstack([stiffness, rate * damping]))
        return np.asarray(rate * np.linalg.eigvals(single), dtype=complex)
    whole, right = np.zeros((2, 2 * size, 2 * size))
    whole[:size, size:] = right[:size, :size] = np.eye(size)
    whole[size:] = -np.hstack([stiffness, rate * damping]) / np.abs(stiffness).max()
    right[size:, size:] = rate**2 * mass / np.abs(stiffness).max()
    above, below = scipy.linalg.eigvals(whole, right, homogeneous_eigvals=True, check_finite=False)
    finite = np.abs(below) > _INFINITE * np.abs(above)
    found: Complex = rate * above[finite] / below[finite]
    return found


def _rate(mass: Real, stiffness: Real) -> float:
    """Return a rate at which inertia is as large as stiffness, 1/s."""
    return float(np.sqrt(np.abs(stiffness).max() / max(np.abs(mass).max(), 1e-300)))


def growing(values: Complex) -> int:
    """Return how many of some eigenvalues grow."""
    return int((values.real > _NEUTRAL * np.abs(values)).sum())


def tangent(slopes: Real) -> Real:
    """Return the direction in which equations with the derivatives (n - 1, n) stay zero, of length 1."""
    first = slopes[0]
    along: Real = np.array([-first[1], first[0]]) if len(slopes) == 1 else np.cross(first, slopes[1])
    return along / float(np.linalg.norm(along))


def corrected(condition: Condition, y: Real, row: Real, value: float) -> tuple[Real, int] | None:
    """Return the point of a curve at which ``row . y = value``, and the steps; None if none is near."""
    best, last = y, np.inf
    for steps in range(_STEPS):
        residual, slopes = condition.equations(best)
        matrix = np.vstack([slopes, row])
        try:
            step = np.linalg.solve(matrix, -np.append(residual, row @ best - value))
        except np.linalg.LinAlgError:
            return None
        length = float(np.abs(step).max())
        if not np.isfinite(length) or length > 1.0 or (steps > 3 and length > 0.5 * last):
            # Rounding stops the method, or it does not converge.
            return (best, steps) if last <= _FOUND else None
        best, last = best + step, length
        if length <= _CONVERGED:
            return best, steps
    return (best, _STEPS) if last <= _FOUND else None
