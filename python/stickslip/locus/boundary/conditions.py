"""What holds on a curve: equations in the unit square, with the derivatives that Newton's method needs.

A point of a curve is ``y = (u, v)`` in the unit square, of Hopf curves ``(u, v, w)`` with the frequency
``omega = w scale``. Minimally augmented systems (Govaerts 2000, chapters 4 and 9): with borders b and c

    [P  b] [x]   [0]
    [c* 0] [g] = [1],    P = K + i omega C - omega^2 M,

g vanishes where P is singular, and ``dg = -z* dP x`` with the last row (z*, g) of the inverse. The borders
are the null vectors at the point before.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
import scipy.linalg

from stickslip.locus.boundary.curves import CurveKind
from stickslip.locus.boundary.plane import Plane
from stickslip.scene.checks import Complex, Flags, Real

#: Steps of Newton's method at most; quadratic convergence from a good start takes three.
_STEPS = 8
#: Step, in the unit square, below which Newton's method has converged.
_CONVERGED = 1e-13
#: Step, in the unit square, that need not be taken.
_NEGLIGIBLE = 1e-15
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
        self._sizes = self.units[:, None] * self.units
        self.start = np.array([*place, 1.0])
        left, _, right = scipy.linalg.svd(self._pencil(self.start)[0])
        self.b, self.c = left[:, -1], right[-1].conj()

    def omega(self, y: Real) -> float:
        """Return the frequency at a point, rad/s."""
        return float(y[2] * self.scale)

    def _pencil(self, y: Real) -> tuple[Complex, Complex]:
        """Return P, and its derivatives to u, v and w, (3, n, n)."""
        omega = self.omega(y)
        m, c, k = self.plane.at(y[0], y[1])[:3]
        parts = np.empty((4, *self._sizes.shape), dtype=complex)
        parts[:3].real, parts[:3].imag = (k - omega**2 * m) * self._sizes, omega * c * self._sizes
        parts[3].real, parts[3].imag = -2.0 * omega * m[0] * self._sizes, c[0] * self._sizes
        parts[3] *= self.scale
        return parts[0], parts[1:]

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
        found = complex(inverse[size, size]), -(slopes @ x) @ z, x, z
        self._known = y.copy(), found
        return found

    def equations(self, y: Real) -> tuple[Real, Real]:
        """Return the real and the imaginary part of g, and their derivatives (2, 3)."""
        g, slopes, _, _ = self._bordered(y)
        return np.array([g.real, g.imag]), np.array([slopes.real, slopes.imag])

    def settle(self, y: Real) -> float:
        """Take the borders from a point; return |g|, of P with rows and columns of size 1."""
        g, _, x, z = self._bordered(y)
        sizes = np.linalg.norm(z), np.linalg.norm(x)
        self.b, self.c = z.conj() / sizes[0], x / sizes[1]
        return float(abs(g) / (sizes[0] * sizes[1]))

    def growth(self, y: Real) -> Real:
        """Return the derivatives of the real part of lambda, 1/s: ``lambda = i (w - g / g_w) scale``."""
        _, slopes, _, _ = self._bordered(y)
        by_omega = slopes[2].conjugate() / max(abs(slopes[2]) ** 2, 1e-300)
        growth: Real = (-1j * self.scale * slopes[:2] * by_omega).real
        return growth


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
        ((value, *slopes),), (size,) = (found[..., self.contact] for found in margins(self.plane, y[None]))
        return value, np.array(slopes), size

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


def margins(plane: Plane, places: Real) -> tuple[Real, Real]:
    """Return margins of all contacts with d/du and d/dv (n, 3, c), and sizes of their terms (n, c).

    `places` are n points of the plane. Where the stiffness is singular, a margin has a pole, and is as large
    as its terms.
    """
    expanded = [plane.at(float(y[0]), float(y[1])) for y in places]
    stiffness, load, rows, offsets = (np.stack([part[k] for part in expanded]) for k in range(2, 6))
    try:
        rest = np.linalg.solve(stiffness[:, 0], load[:, 0, :, None])
        loads = load[:, 1:, :, None] - stiffness[:, 1:] @ rest[:, None]
        moved = np.linalg.solve(stiffness[:, :1], loads)
    except np.linalg.LinAlgError:
        if len(places) == 1:
            count = rows.shape[2]
            return np.ones((1, 3, count)), np.ones((1, count))
        one_by_one = [margins(plane, y[None]) for y in places]
        return np.concatenate([one[0] for one in one_by_one]), np.concatenate([one[1] for one in one_by_one])
    at = rows[:, 0] @ rest
    slopes = rows[:, :1] @ moved + rows[:, 1:] @ rest[:, None]
    values: Real = np.concatenate([at[:, None], slopes], axis=1)[..., 0] - offsets
    # Without load all terms vanish together; what they change by over the range remains.
    sizes = (np.abs(rows[:, 0]) @ np.abs(rest))[..., 0] + np.abs(offsets[:, 0])
    sizes += np.abs(values[:, 1:]).sum(axis=1)
    return values, np.maximum(sizes, 1e-300)


def slides(plane: Plane, places: Real, but: int | None = None) -> Flags:
    """Return whether steady sliding exists at points (n,), whatever the margin of one contact (`but`)."""
    values, sizes = margins(plane, places)
    relative = values[:, 0] / sizes
    if but is not None:
        relative[:, but] = 0.0
    return np.asarray((relative >= -64 * np.finfo(float).eps).all(axis=1))


def is_steady(condition: Condition, points: Real) -> Flags:
    """Return whether steady sliding exists at points of a curve (n,), or on one side of it.

    It begins or ends at a separation, and at a divergence, where normal forces have a pole.
    """
    places = points[:, :2]
    if not isinstance(condition, Divergence):
        return slides(condition.plane, places, condition.contact)
    across = np.concatenate([condition.equations(y)[1] for y in places])
    steps = _ACROSS * across / np.linalg.norm(across, axis=1)[:, None]
    return slides(condition.plane, places - steps) | slides(condition.plane, places + steps)


def eigenvalues(plane: Plane, places: Real) -> list[Complex]:
    """Return all finite eigenvalues at each of some points, also those that do not count."""
    expanded = [plane.at(float(y[0]), float(y[1])) for y in places]
    mass, damping, stiffness = (np.stack([part[k][0] for part in expanded]) for k in range(3))
    count, size = mass.shape[:2]
    rates = [_rate(*pair) for pair in zip(mass, stiffness, strict=True)]
    rate = np.array(rates)[:, None, None]
    limit = _REGULAR if plane.basis is None else _REGULAR_PROJECTED
    if (np.linalg.cond(mass) < limit).all():
        single = np.zeros((count, 2 * size, 2 * size))
        single[:, :size, size:] = np.eye(size)
        single[:, size:] = -np.linalg.solve(rate**2 * mass, np.dstack([stiffness, rate * damping]))
        return [*(rate[:, 0] * np.linalg.eigvals(single)).astype(complex)]
    return [_finite(*parts) for parts in zip(mass, damping, stiffness, rates, strict=True)]


def _finite(mass: Real, damping: Real, stiffness: Real, rate: float) -> Complex:
    """Return the finite eigenvalues where the mass may be singular."""
    size = len(mass)
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
        try:
            step = np.linalg.solve(np.vstack([slopes, row]), -np.append(residual, row @ best - value))
        except np.linalg.LinAlgError:
            return None
        length = float(np.abs(step).max())
        if not np.isfinite(length) or length > 1.0 or (steps > 3 and length > 0.5 * last):
            # Rounding stops the method, or it does not converge.
            return (best, steps) if last <= _FOUND else None
        if length <= _NEGLIGIBLE:
            # What holds there is known already.
            return best, steps
        best, last = best + step, length
        if length <= _CONVERGED:
            return best, steps
    return (best, _STEPS) if last <= _FOUND else None
