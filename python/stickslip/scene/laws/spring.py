"""Laws of springs and dampers, for `Spring(law=...)` and `Damper(law=...)`.

A spring has the force ``-phi(u) d`` on the dofs, with the stretch ``u = d . x - offset``; a damper the force
``-phi(u) d``, with the rate ``u = d . x'``. A law is phi in newtons over u, of either sign.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
import scipy

from stickslip.faults import InputError
from stickslip.scene.checks import finite, real_array
from stickslip.scene.laws.expression import Variable, parsed
from stickslip.scene.laws.law import FormulaLaw, LawData, OneVariableLaw, law_among
from stickslip.scene.laws.operations import operations

__all__ = ["Gap", "Hertz", "Law", "Polynomial", "Tabulated"]


def __dir__() -> list[str]:
    return __all__


#: What the formula of a law depends on.
STRETCH = Variable("u", "the stretch u, or its rate for a damper", "law", "Tabulated or Gap")


@dataclass(frozen=True)
class SpringLaw(OneVariableLaw):
    """The force of a spring or damper, of which every public class of this module is a form."""

    argument: ClassVar[str] = "law"

    @abstractmethod
    def force(self, u: float) -> float:
        """Return phi, N, at a stretch, m, or of a damper at a rate, m/s."""


@dataclass(frozen=True, init=False, repr=False)
class Polynomial(SpringLaw):
    """``phi(u) = k1 u + k2 u^2 + k3 u^3 + ...``.

    The coefficients are parameters of a scene, such as ``mount_k3`` of an element named "mount".

    Parameters
    ----------
    *coefficients
        k1, k2, k3, ..., N/m, N/m^2, N/m^3, ..., at most 12.

    Raises
    ------
    InputError
        If there is none, or one is not finite.
    """

    coefficients: tuple[float, ...]
    law: ClassVar[str] = "polynomial"

    def __init__(self, *coefficients: float) -> None:
        if not 1 <= len(coefficients) <= 12:
            raise InputError(f"law: expected 1 to 12 coefficients k1, k2, ..., got {len(coefficients)}")
        found = tuple(finite(f"law: k{k + 1}", one) for k, one in enumerate(coefficients))
        object.__setattr__(self, "coefficients", found)

    def parameters(self) -> dict[str, float]:
        """Return k1, k2, ... by name."""
        return {f"k{k + 1}": one for k, one in enumerate(self.coefficients)}

    def data(self) -> LawData:
        """Return the operations of the polynomial."""
        terms = [f"{name}*u**{k + 1}" for k, (name, one) in enumerate(self.parameters().items()) if one]
        tree = parsed(STRETCH, " + ".join(terms or ["k1*u"]))
        return "formula", [], [], operations(STRETCH, tree, self.parameters())

    def force(self, u: float) -> float:
        """Return phi, N, at a stretch, m, or of a damper at a rate, m/s."""
        return float(np.polynomial.polynomial.polyval(u, [0.0, *self.coefficients]))

    @classmethod
    def of_table(cls, given: Mapping[str, Any]) -> Self:
        """Return the law of a table without its name.

        Raises
        ------
        InputError
            If its numbers are others than k1, k2, ... without a gap.
        """
        for name in given:
            if not (name.startswith("k") and name[1:].isdecimal() and 1 <= int(name[1:]) <= 12):
                raise InputError(f"law: the law 'polynomial' has no {name!r}; it has k1, k2, k3, ...")
        count = max((int(name[1:]) for name in given), default=0)
        return cls(*(given.get(f"k{k + 1}", 0.0) for k in range(count)))

    def __repr__(self) -> str:
        return f"Polynomial({', '.join(f'{one!r}' for one in self.coefficients)})"


@dataclass(frozen=True)
class Gap(SpringLaw):
    """``phi(u) = stiffness (u - clearance)`` beyond the clearance, and no force before it.

    An elastic stop. Where it begins, the slope jumps and the force does not: a motion passes this instant
    exactly, and it is no event.

    Parameters
    ----------
    stiffness
        N/m.
    clearance
        m.
    """

    stiffness: float
    clearance: float
    law: ClassVar[str] = "gap"

    def data(self) -> LawData:
        """Return the pieces before and beyond the clearance."""
        # The first piece has no beginning.
        before = self.clearance - max(1.0, abs(self.clearance))
        pieces = [[0.0, 0.0, 0.0, 0.0], [0.0, self.stiffness, 0.0, 0.0]]
        return "tabulated", [before, self.clearance], pieces, []

    def force(self, u: float) -> float:
        """Return phi, N, at a stretch, m, or of a damper at a rate, m/s."""
        return self.stiffness * max(u - self.clearance, 0.0)


@dataclass(frozen=True)
class Hertz(SpringLaw):
    """``phi(u) = stiffness u^exponent`` for a penetration u > 0, and no force for u < 0.

    The contact of two round bodies (H. Hertz 1882; K. L. Johnson, Contact Mechanics, 1985, section 4.2) has
    the exponent 3/2 and, of radii R1 and R2, moduli E1 and E2 and Poisson's ratios n1 and n2, the stiffness
    ``4/3 E sqrt(R)`` with ``1/R = 1/R1 + 1/R2`` and ``1/E = (1 - n1^2)/E1 + (1 - n2^2)/E2``. A mass m that
    meets it with the speed v penetrates by ``u = (5 m v^2/(4 stiffness))^(2/5)`` and is in contact for
    ``(4/5) sqrt(pi) Gamma(2/5)/Gamma(9/10) u/v``, about ``2.943 u/v``.

    u^(3/2) has no Taylor series at u = 0. Up to the penetration delta of a small force `straight_below`, the
    straight line through zero takes its place. There the force is off by less than `straight_below`; beyond,
    the law is exact, and the energy of a penetration u is off by the part
    ``(exponent - 1)/2 (delta/u)^(exponent + 1)`` of it: 2.5e-16 for a force of 1 N.

    Parameters
    ----------
    stiffness
        N/m^exponent, positive.
    exponent
        Greater than 1.
    straight_below
        N, positive; about 1e-9 of the forces that matter. Where delta comes to the rounding of places, some
        1e-13 of them, instants of release are as uncertain as these.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    stiffness: float
    exponent: float = 1.5
    straight_below: float = 1e-9
    law: ClassVar[str] = "hertz"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, least in (("stiffness", 0.0), ("exponent", 1.0), ("straight_below", 0.0)):
            if not (value := getattr(self, name)) > least:
                raise InputError(f"law: {name}: must be > {least:g}, got {value}")

    def data(self) -> LawData:
        """Return stiffness, exponent and the force below which the law is a line."""
        return self.law, [self.stiffness, self.exponent, self.straight_below], [], []

    def force(self, u: float) -> float:
        """Return phi, N, at a stretch, m, or of a damper at a rate, m/s."""
        border = (self.straight_below / self.stiffness) ** (1.0 / self.exponent)
        if u < border:
            return float(self.straight_below / border * max(u, 0.0))
        return float(self.stiffness * u**self.exponent)


@dataclass(frozen=True)
class Tabulated(SpringLaw):
    """Measured forces by monotone cubics (Fritsch and Carlson 1980), straight on beyond both ends.

    phi has a continuous slope.

    Parameters
    ----------
    positions
        u, ascending, at least two, m or m/s.
    forces
        phi at each of them, N.
    """

    positions: Sequence[float]
    forces: Sequence[float]
    law: ClassVar[str] = "tabulated"

    def __post_init__(self) -> None:
        for name in ("positions", "forces"):
            numbers = real_array(f"law: {name}", getattr(self, name), 1)
            if not np.isfinite(numbers).all():
                raise InputError(f"law: {name}: must be finite, got {numbers.tolist()!r}")
            object.__setattr__(self, name, tuple(numbers.tolist()))
        if len(self.positions) < 2 or not (np.diff(self.positions) > 0).all():
            raise InputError(f"law: positions: must ascend, at least two of them, got {self.positions!r}")
        if len(self.forces) != len(self.positions):
            raise InputError(
                f"law: forces: expected one for each of {len(self.positions)} positions, got"
                f" {len(self.forces)}"
            )

    def parameters(self) -> dict[str, float]:
        """Return nothing: a table has no single numbers."""
        return {}

    @cached_property
    def _spline(self) -> scipy.interpolate.PchipInterpolator:
        return scipy.interpolate.PchipInterpolator(self.positions, self.forces)

    @cached_property
    def _slopes(self) -> tuple[float, float]:
        first, last = self._spline.derivative()([self.positions[0], self.positions[-1]])
        return float(first), float(last)

    def data(self) -> LawData:
        """Return positions and pieces, ascending powers of the distance from where each begins."""
        first, last = self._slopes
        width = self.positions[1] - self.positions[0]
        before = self.positions[0] - width
        pieces = [
            [self.forces[0] - first * width, first, 0.0, 0.0],
            *self._spline.c[::-1].T.tolist(),
            [self.forces[-1], last, 0.0, 0.0],
        ]
        return "tabulated", [before, *self.positions], pieces, []

    def force(self, u: float) -> float:
        """Return phi, N, at a stretch, m, or of a damper at a rate, m/s."""
        first, last = self._slopes
        within = min(max(u, self.positions[0]), self.positions[-1])
        return float(self._spline(within)) + (first if u < within else last) * (u - within)

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {"law": self.law, "positions": list(self.positions), "forces": list(self.forces)}


@dataclass(frozen=True, init=False, repr=False)
class Law(FormulaLaw, SpringLaw):
    """A law of your own: phi as a formula of the stretch u, m, or rate, m/s, and of named numbers.

    A formula has the signs ``+ - * / **``, with exponents that do not depend on u, and the functions exp,
    log, sqrt, tanh, arctan, sin and cos. It has no branches, and is smooth where it is used and at u = 0. The
    numbers are parameters of a scene, such as ``mount_hard`` of an element named "mount".

    Parameters
    ----------
    formula
        A function of u and of numbers with defaults, ``lambda u, soft=1e4, hard=1e9: soft * u + hard *
        u**3``, with the functions of numpy. It is called once, and noted as a text. Or this text, ``"soft * u
        + hard * u**3"``, which is read and never run as code.
    **numbers
        The numbers that a text names, or others in place of the defaults of a function.

    Raises
    ------
    InputError
        If it is no such formula, or a number has no value.
    """

    formula: str
    _numbers: tuple[tuple[str, float], ...]
    law: ClassVar[str] = "formula"
    variable: ClassVar[Variable] = STRETCH

    def __init__(self, formula: str | Callable[..., Any], /, **numbers: float) -> None:
        self._read(formula, numbers)

    def force(self, u: float) -> float:
        """Return phi, N, at a stretch, m, or of a damper at a rate, m/s."""
        return float(self._value(u))


LAWS: dict[str, type[SpringLaw]] = {kind.law: kind for kind in (Polynomial, Gap, Hertz, Tabulated, Law)}


def law_of(table: Mapping[str, Any]) -> SpringLaw:
    """Return the law of a table as files have it: ``{law = "polynomial", k1 = 1e4, k3 = 1e9}``."""
    return law_among(LAWS, "law", table)
