"""Laws of friction over slip speed, for `Contact(friction=...)`.

With N the normal force and s the slip velocity, the friction force of a sliding contact is
``T = -sign(s) mu(|s|) N``. A plain number is constant friction. A contact that sticks holds up to its static
friction, which is mu(0) unless `Contact.static_friction` gives another value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy

from stickslip.faults import InputError
from stickslip.scene.checks import described, real_array
from stickslip.scene.laws.expression import Variable
from stickslip.scene.laws.law import FormulaLaw, FrictionLaw, LawData, law_among
from stickslip.scene.laws.operations import values
from stickslip.scene.laws.state import BoucWen, Dahl, ElastoPlastic, LuGre, RateState, StateLaw

__all__ = [
    *("BoucWen", "Constant", "Dahl", "ElastoPlastic", "Law", "Linear", "LuGre", "RateState", "Rational"),
    *("StateLaw", "Stribeck", "Tabulated"),
]


def __dir__() -> list[str]:
    return __all__


#: What the formula of a law depends on.
SLIP_SPEED = Variable("s", "the slip speed s >= 0", "friction", "Tabulated")


@dataclass(frozen=True)
class Constant(FrictionLaw):
    """``mu = friction`` at all speeds; the same as the plain number.

    Parameters
    ----------
    friction
        mu, >= 0.
    """

    friction: float
    law: ClassVar[str] = "constant"

    def data(self) -> LawData | None:
        """Return None: the core has constant friction without a law."""
        return None

    def coefficient(self, speed: float) -> float:
        """Return mu."""
        return self.friction


@dataclass(frozen=True)
class Linear(FrictionLaw):
    """``mu(s) = mu0 + slope |s|``.

    Parameters
    ----------
    mu0
        mu at rest, >= 0.
    slope
        s/m; negative if friction falls with slip speed. A run ends at the instant at which mu becomes
        negative.
    """

    mu0: float
    slope: float
    law: ClassVar[str] = "linear"

    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""
        return self.mu0 + self.slope * speed


@dataclass(frozen=True)
class Stribeck(FrictionLaw):
    """``mu(s) = kinetic + (static - kinetic) exp(-|s| / speed) + viscous |s|``.

    Parameters
    ----------
    static
        mu at rest, >= 0.
    kinetic
        mu at large slip speeds, >= 0.
    speed
        Scale of the slip speed over which mu falls, m/s, > 0.
    viscous
        Growth of mu with slip speed, s/m, >= 0.
    """

    static: float
    kinetic: float
    speed: float
    viscous: float = 0.0
    law: ClassVar[str] = "stribeck"

    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""
        falling = (self.static - self.kinetic) * np.exp(-speed / self.speed)
        return float(self.kinetic + falling + self.viscous * speed)


@dataclass(frozen=True)
class Rational(FrictionLaw):
    """``mu(s) = kinetic + (static - kinetic) / (1 + |s| / speed)``.

    Parameters
    ----------
    static
        mu at rest, >= 0.
    kinetic
        mu at large slip speeds, >= 0.
    speed
        Slip speed at which half of the difference remains, m/s, > 0.
    """

    static: float
    kinetic: float
    speed: float
    law: ClassVar[str] = "rational"

    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""
        return self.kinetic + (self.static - self.kinetic) / (1.0 + speed / self.speed)


@dataclass(frozen=True)
class Tabulated(FrictionLaw):
    """Measured mu between speeds by monotone cubics (Fritsch and Carlson 1980), constant beyond the last one.

    mu has a continuous slope, which is zero from the last speed on.

    Parameters
    ----------
    speeds
        Ascending from 0, at least two, m/s.
    values
        mu at each of them, >= 0.
    """

    speeds: Sequence[float]
    values: Sequence[float]
    law: ClassVar[str] = "tabulated"

    def __post_init__(self) -> None:
        for name in ("speeds", "values"):
            numbers = real_array(f"friction: {name}", getattr(self, name), 1)
            object.__setattr__(self, name, tuple(numbers.tolist()))
        speeds = np.asarray(self.speeds)
        if (
            speeds.size < 2
            or speeds[0] != 0.0
            or not (np.isfinite(speeds).all() and (np.diff(speeds) > 0).all())
        ):
            raise InputError(
                f"friction: speeds: must ascend from 0, at least two of them, got {self.speeds!r}"
            )
        if len(self.values) != speeds.size:
            raise InputError(
                f"friction: values: expected one for each of {speeds.size} speeds, got {len(self.values)}"
            )
        if not all(0.0 <= value < np.inf for value in self.values):
            raise InputError(f"friction: values: must be >= 0 and finite, got {self.values!r}")

    def parameters(self) -> dict[str, float]:
        """Return nothing: a table has no single numbers."""
        return {}

    @cached_property
    def _spline(self) -> scipy.interpolate.CubicHermiteSpline:
        slopes = scipy.interpolate.PchipInterpolator(self.speeds, self.values).derivative()(self.speeds)
        slopes[-1] = 0.0
        return scipy.interpolate.CubicHermiteSpline(self.speeds, self.values, slopes)

    def data(self) -> LawData | None:
        """Return speeds and pieces, ascending powers of the distance from the speed where each begins."""
        pieces = self._spline.c[::-1].T.tolist()
        return self.law, list(self.speeds), [*pieces, [self.values[-1], 0.0, 0.0, 0.0]], []

    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""
        return float(self._spline(min(speed, self.speeds[-1])))

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {"law": self.law, "speeds": list(self.speeds), "values": list(self.values)}


@dataclass(frozen=True, init=False, repr=False)
class Law(FormulaLaw, FrictionLaw):
    """A law of your own: mu as a formula of the slip speed s >= 0, m/s, and of named numbers.

    A formula has the signs ``+ - * / **``, with exponents that do not depend on s, and the functions exp,
    log, sqrt, tanh, arctan, sin and cos. It has no branches, and is smooth at rest. The numbers are
    parameters of a scene, such as ``friction_rise`` of all contacts whose law has this number and
    ``friction_rise_0`` of the first one.

    Parameters
    ----------
    formula
        A function of s and of numbers with defaults, ``lambda s, kinetic=0.3, rise=0.2: kinetic + rise *
        np.exp(-s / 0.1)``, with the functions of numpy. It is called once, and noted as a text. Or this text,
        ``"kinetic + rise * exp(-s / 0.1)"``, which is read and never run as code.
    **numbers
        The numbers that a text names, or others in place of the defaults of a function.

    Raises
    ------
    InputError
        If it is no such formula, a number is missing or has no place in it, or mu at rest is not finite and
        >= 0. A run ends at the instant at which mu becomes negative.
    """

    formula: str
    _numbers: tuple[tuple[str, float], ...]
    law: ClassVar[str] = "formula"
    variable: ClassVar[Variable] = SLIP_SPEED

    def __init__(self, formula: str | Callable[..., Any], /, **numbers: float) -> None:
        self._read(formula, numbers)
        self._check_rest()

    def _check_rest(self) -> None:
        """Refuse a law without a power series at rest, or with a negative mu there."""
        at_rest = values(self._operations, 0.0)
        for operation, first, _, exponent in self._operations:
            if operation == "power" and not exponent.is_integer() and at_rest[first] <= 0.0:
                raise InputError(
                    f"friction: {described(self)} is not smooth at rest: power {exponent:g} of"
                    f" {at_rest[first]:g}; add a small number to the base"
                )
        if not (np.isfinite(at_rest).all() and at_rest[-1] >= 0.0):
            raise InputError(
                f"friction: mu at rest must be finite and >= 0, got {at_rest[-1]:g} of {described(self)}"
            )

    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""
        return float(self._value(speed))


LAWS: dict[str, type[FrictionLaw]] = {
    kind.law: kind
    for kind in (
        BoucWen,
        Constant,
        Dahl,
        ElastoPlastic,
        LuGre,
        RateState,
        StateLaw,
        Linear,
        Stribeck,
        Rational,
        Tabulated,
        Law,
    )
}


def law_of(table: Mapping[str, Any]) -> FrictionLaw:
    """Return the law of friction of a table as files have it: ``{law = "stribeck", static = 0.5, ...}``."""
    return law_among(LAWS, "friction", table)
