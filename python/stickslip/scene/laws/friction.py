"""Laws of friction over slip speed, for `Contact(friction=...)`.

With N the normal force and s the slip velocity, the friction force of a sliding contact is
``T = -sign(s) mu(|s|) N``. A plain number is constant friction. A contact that sticks holds up to its static
friction, which is mu(0) unless `Contact.static_friction` gives another value.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy

from stickslip.faults import InputError
from stickslip.scene.checks import described, real_array, real_number

__all__ = ["Constant", "Law", "Linear", "Rational", "Stribeck", "Tabulated"]


def __dir__() -> list[str]:
    return __all__


#: The kind of a law in the core, its numbers, and the pieces of a table by rows of 4.
LawData = tuple[str, list[float], list[list[float]]]


@dataclass(frozen=True)
class Law(ABC):
    """The dependence of friction on slip speed; every other class of this module is such a law.

    The numbers of a law are parameters of a scene by their names: ``friction_kinetic`` sets all contacts
    whose law has this number, ``friction_kinetic_0`` the first contact.
    """

    #: The name of the law in files.
    law: ClassVar[str]

    def __post_init__(self) -> None:
        for name in self.parameters():
            value = real_number(f"friction: {name}", getattr(self, name))
            if not np.isfinite(value) or (name == "speed" and value <= 0.0):
                raise InputError(
                    f"friction: {name}: must be finite{' and > 0' * (name == 'speed')}, got {value}"
                )
            object.__setattr__(self, name, value)

    @classmethod
    def parameters(cls) -> tuple[str, ...]:
        """Return the names of its numbers."""
        return tuple(field.name for field in dataclasses.fields(cls))

    def data(self) -> LawData | None:
        """Return the law as the core takes it; None where friction is constant."""
        return self.law, [getattr(self, name) for name in self.parameters()], []

    @abstractmethod
    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {"law": self.law, **dataclasses.asdict(self)}

    def __format__(self, spec: str) -> str:
        return repr(self)


@dataclass(frozen=True)
class Constant(Law):
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
class Linear(Law):
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
class Stribeck(Law):
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
class Rational(Law):
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
class Tabulated(Law):
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

    @classmethod
    def parameters(cls) -> tuple[str, ...]:
        """Return no names: a table has no single numbers."""
        return ()

    @cached_property
    def _spline(self) -> scipy.interpolate.CubicHermiteSpline:
        slopes = scipy.interpolate.PchipInterpolator(self.speeds, self.values).derivative()(self.speeds)
        slopes[-1] = 0.0
        return scipy.interpolate.CubicHermiteSpline(self.speeds, self.values, slopes)

    def data(self) -> LawData | None:
        """Return speeds and pieces, ascending powers of the distance from the speed where each begins."""
        pieces = self._spline.c[::-1].T.tolist()
        return self.law, list(self.speeds), [*pieces, [self.values[-1], 0.0, 0.0, 0.0]]

    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""
        return float(self._spline(min(speed, self.speeds[-1])))

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {"law": self.law, "speeds": list(self.speeds), "values": list(self.values)}


LAWS: dict[str, type[Law]] = {
    kind.law: kind
    for kind in (
        Constant,
        Linear,
        Stribeck,
        Rational,
        Tabulated,
    )
}


def law_of(table: Mapping[str, Any]) -> Law:
    """Return the law of a table as files have it: ``{law = "stribeck", static = 0.5, ...}``.

    Raises
    ------
    InputError
        If there is no such law, or its numbers are others.
    """
    given = dict(table)
    name = given.pop("law", None)
    kind = LAWS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise InputError(f"friction: law: expected one of {', '.join(LAWS)}, got {described(name)}")
    fields = list(dataclasses.fields(kind))
    known = [field.name for field in fields]
    for key in given:
        if key not in known:
            raise InputError(f"friction: the law {name!r} has no {key!r}; it has {', '.join(known)}")
    for field in fields:
        if field.name not in given and field.default is dataclasses.MISSING:
            raise InputError(f"friction: the law {name!r} needs {field.name}")
    return kind(**given)
