"""Laws of friction with a state of their own: bristles, rate and state, and a law of a user."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
import scipy

from stickslip.faults import InputError
from stickslip.scene.checks import described
from stickslip.scene.laws.expression import Variable, names, parsed
from stickslip.scene.laws.law import FrictionLaw, LawData, read_formula
from stickslip.scene.laws.operations import Operation, operations, values

#: What the two formulas of a law with a state depend on.
SLIP_AND_STATE = {
    name: Variable(
        "s",
        "the slip velocity s and the state z",
        f"friction: {name}",
        "abs(s) and sign(s) alone, where slip turns",
        state="z",
    )
    for name in ("force", "rate")
}
#: The rate of the state of `RateState`, by the law that it follows.
_EVOLUTIONS = {
    "aging": "(speed * exp(-z) - abs(s)) / length",
    "slip": "-(abs(s) / length) * (log(abs(s) / speed) + z)",
}
#: Powers of ten, of either sign, between which the state of steady slip is sought.
_DECADES = 30


@dataclass(frozen=True)
class LawWithState(FrictionLaw):
    """Friction with a state of its own."""

    @property
    def at_rest(self) -> float:
        """Zero: a contact with a state creeps and never sticks."""
        return 0.0


@dataclass(frozen=True)
class Dahl(LawWithState):
    """Bristles with the deflection z, ``z' = s - stiffness |s| z / kinetic`` and ``T = -N stiffness z``.

    Where slip turns, the friction force follows it over the distance ``kinetic / stiffness`` like a spring
    that yields (Dahl, AIAA Journal 14 (1976) 1675). The contact needs mass along its slip; while it is open,
    z is 0. It has the statuses ``+`` and ``-``, and an event wherever its slip turns.

    Parameters
    ----------
    kinetic
        Coefficient of friction of steady slip, > 0.
    stiffness
        Friction force per normal force and deflection, 1/m, > 0.
    """

    kinetic: float
    stiffness: float
    law: ClassVar[str] = "dahl"

    def coefficient(self, speed: float) -> float:
        """Return mu of steady slip at a speed, m/s."""
        return self.kinetic


@dataclass(frozen=True)
class BoucWen(LawWithState):
    """Bristles with the deflection z and ``T = -N stiffness z``, whose loop has a shape of its own.

    ``z' = s - |s| (stiffness |z| / kinetic)^exponent (share sgn z + (1 - share) sgn s)`` (Bouc, 1967; Wen,
    Journal of the Engineering Mechanics Division 102 (1976) 249): the friction force comes to ``kinetic N``
    the more abruptly, the larger the exponent. With ``exponent=1, share=1`` it is Dahl's law. The contact
    needs mass along its slip; while it is open, z is 0. It has the statuses ``+`` and ``-``, and an event
    wherever its slip turns.

    Parameters
    ----------
    kinetic
        Coefficient of friction of steady slip, > 0.
    stiffness
        Friction force per normal force and deflection at z = 0, 1/m, > 0.
    exponent
        1, 2 or 3.
    share
        The part ``beta / (beta + gamma)`` of the loss that changes its sign with z, in [0, 1]: 0.5 unloads
        elastically.
    """

    kinetic: float
    stiffness: float
    exponent: float = 1.0
    share: float = 0.5
    law: ClassVar[str] = "boucwen"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.exponent not in (1.0, 2.0, 3.0):
            raise InputError(f"friction: exponent: must be 1, 2 or 3, got {self.exponent:g}")

    def coefficient(self, speed: float) -> float:
        """Return mu of steady slip at a speed, m/s."""
        return self.kinetic


@dataclass(frozen=True)
class LuGre(LawWithState):
    """Bristles with the deflection z and ``T = -N (stiffness z + damping z' + viscous s)``.

    Here ``z' = s - stiffness |s| z / g(s)`` with ``g = kinetic + (static - kinetic) exp(-(s / speed)^2)``
    (Canudas de Wit and others, IEEE Transactions on Automatic Control 40 (1995) 419, whose numbers are those
    for N = 1). The contact needs mass along its slip; while it is open, z is 0. It has the statuses ``+`` and
    ``-``, and an event wherever its slip turns.

    Parameters
    ----------
    static
        g at vanishing slip speed, > 0.
    kinetic
        g at large slip speeds, > 0.
    speed
        Scale of the slip speed over which g passes from one to the other, m/s, > 0.
    stiffness
        Friction force per normal force and deflection, 1/m, > 0.
    damping
        Friction force per normal force and rate of the deflection, s/m, >= 0.
    viscous
        Friction force per normal force and slip velocity, s/m, >= 0.
    """

    static: float
    kinetic: float
    speed: float
    stiffness: float
    damping: float = 0.0
    viscous: float = 0.0
    law: ClassVar[str] = "lugre"

    def coefficient(self, speed: float) -> float:
        """Return mu of steady slip at a speed, m/s, ``g + viscous s``."""
        falling = (self.static - self.kinetic) * np.exp(-((speed / self.speed) ** 2))
        return float(self.kinetic + falling + self.viscous * speed)


@dataclass(frozen=True)
class ElastoPlastic(LawWithState):
    """Bristles that are elastic up to a deflection, so that a contact does not drift under small loads.

    ``z' = s - |s| f(z)`` and ``T = -N (stiffness z + damping z' + viscous s)`` (Dupont, Hayward, Armstrong
    and Altpeter, IEEE Transactions on Automatic Control 47 (2002) 787). With ``z_1 = kinetic / stiffness``
    and slip in the positive direction, f is 0 below ``break_away z_1`` and ``z / z_1`` from z_1 on; between,
    f is the cubic that joins both smoothly, in place of the sine of the paper. The contact needs mass along
    its slip; while it is open, z is 0. It has the statuses ``+`` and ``-``, and an event wherever its slip
    turns.

    Parameters
    ----------
    kinetic
        Coefficient of friction of steady slip without its viscous part, > 0.
    stiffness
        Friction force per normal force and deflection, 1/m, > 0.
    break_away
        The part of the deflection of steady slip up to which bristles are elastic, in (0, 1).
    damping
        Friction force per normal force and rate of the deflection, s/m, >= 0.
    viscous
        Friction force per normal force and slip velocity, s/m, >= 0.
    """

    kinetic: float
    stiffness: float
    break_away: float = 0.7
    damping: float = 0.0
    viscous: float = 0.0
    law: ClassVar[str] = "elastoplastic"

    def coefficient(self, speed: float) -> float:
        """Return mu of steady slip at a speed, m/s."""
        return self.kinetic + self.viscous * speed


@dataclass(frozen=True, init=False, repr=False)
class StateLaw(LawWithState):
    """A law of your own with a state z: ``T = -N force(s, z)`` and ``z' = rate(s, z)``.

    Both are formulas of the slip velocity s, m/s, and of z, with the signs ``+ - * / **``, with exponents
    that are numbers, and the functions exp, log, sqrt, tanh, arctan, sin and cos. ``abs(s)`` and ``sign(s)``
    may stand in them: the instant at which slip turns is an event. Force and rate may not jump there. The
    contact needs mass along its slip; while it is open, z is 0. It has the statuses ``+`` and ``-``.

    For steady sliding at s there has to be one z at which the rate falls through zero. A motion whose start
    has no `State.internal` begins with it, or with ``z = 0`` where the slip velocity is zero. The energy that
    a state stores is not known: all work of
    the friction force counts as friction heat.

    Parameters
    ----------
    force
        A function of s, z and of numbers with defaults, ``lambda s, z, stiffness=1e5: stiffness * z``, with
        the functions of numpy. It is called once, and noted as a text. Or this text, ``"stiffness * z"``.
    rate
        The same of the rate of the state, ``lambda s, z, stiffness=1e5: s - stiffness * abs(s) * z``.
    **numbers
        The numbers that texts name, or others in place of the defaults of functions. A number that both
        formulas name is one number.

    Raises
    ------
    InputError
        If one of them is no such formula, or a number is missing, has no place, or has two defaults. A scene
        raises it if force or rate jump as slip turns, or if there is no steady slip at the speed of the
        slider.
    """

    force: str
    rate: str
    _numbers: tuple[tuple[str, float], ...]
    law: ClassVar[str] = "state"

    def __init__(
        self, force: str | Callable[..., Any], rate: str | Callable[..., Any], **numbers: float
    ) -> None:
        found: dict[str, float] = {}
        for name, formula in (("force", force), ("rate", rate)):
            own = {key: value for key, value in numbers.items() if _has_number(name, formula, key)}
            told, named = read_formula(SLIP_AND_STATE[name], formula, own, ("law", "force", "rate"))
            for key, value in named.items():
                if found.setdefault(key, value) != value:
                    two = f"{found[key]:g} and {value:g}"
                    raise InputError(f"friction: {key}: has two defaults, {two}; give it beside them")
            object.__setattr__(self, name, told)
        for key in numbers:
            if key not in found:
                raise InputError(f"friction: {key}: is no number of {self.force!r} and {self.rate!r}")
        object.__setattr__(self, "_numbers", tuple(found.items()))

    @cached_property
    def _operations(self) -> dict[str, list[Operation]]:
        numbers = self.parameters()
        return {
            name: operations(variable, parsed(variable, getattr(self, name)), numbers)
            for name, variable in SLIP_AND_STATE.items()
        }

    def parameters(self) -> dict[str, float]:
        """Return its numbers by name."""
        return dict(self._numbers)

    def data(self) -> LawData | None:
        """Return the operations of both formulas one after the other, and the number of the first ones."""
        force, rate = self._operations.values()
        return self.law, [float(len(force))], [], [*force, *rate]

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {"law": self.law, "force": self.force, "rate": self.rate, **self.parameters()}

    @classmethod
    def of_table(cls, given: Mapping[str, Any]) -> StateLaw:
        """Return the law of a table without its name.

        Raises
        ------
        InputError
            If it is none.
        """
        numbers = dict(given)
        texts = [numbers.pop(name, None) for name in SLIP_AND_STATE]
        for name, told in zip(SLIP_AND_STATE, texts, strict=True):
            if not isinstance(told, str):
                raise InputError(f"friction: {name}: expected a text, got {described(told)}")
        return cls(*texts, **numbers)

    def coefficient(self, speed: float) -> float:
        """Return mu of steady slip in the positive direction at a speed, m/s; NaN where there is none."""
        state = self.steady_state(speed)
        return float(values(self._operations["force"], speed, state)[-1])

    def steady_state(self, speed: float) -> float:
        """Return the state of steady slip at a speed, m/s; 0 at rest, and NaN where there is no such slip."""
        if speed == 0.0:
            return 0.0

        def rate(state: Any) -> Any:
            found = values(self._operations["rate"], speed, state)[-1]
            return np.broadcast_to(found, np.shape(state))

        above = 10.0 ** np.arange(-_DECADES, _DECADES + 1)
        states = np.concatenate([-above[::-1], [0.0], above])
        found = rate(states)
        falls = np.flatnonzero((found[:-1] > 0.0) & (found[1:] <= 0.0))
        if falls.size != 1:
            return float("nan")
        low, high = states[falls[0] : falls[0] + 2]
        return float(scipy.optimize.brentq(rate, low, high, xtol=5e-324, rtol=1e-15))

    def __repr__(self) -> str:
        numbers = [f"{name}={value!r}" for name, value in self._numbers]
        return f"StateLaw({', '.join([repr(self.force), repr(self.rate), *numbers])})"


def _has_number(name: str, formula: Any, key: str) -> bool:
    """Return whether a formula, a text or a function, may take a number of this name."""
    if callable(formula):
        return key in inspect.signature(formula).parameters
    return not isinstance(formula, str) or key in names(parsed(SLIP_AND_STATE[name], formula))


@dataclass(frozen=True)
class RateState(LawWithState):
    """Rate-and-state friction of rock, regularised at rest, with the state ``z = ln(speed theta / length)``.

    ``T = -N sign(s) direct asinh(|s| / (2 speed) exp((reference + evolution z) / direct))``, which is
    ``reference + direct ln(|s| / speed) + evolution z`` where that is large beside `direct` (Rice and
    Ben-Zion, PNAS 93 (1996) 3811; Dieterich, J. Geophys. Res. 84 (1979) 2161; Ruina, J. Geophys. Res. 88
    (1983) 10359). The state follows the aging law ``theta' = 1 - |s| theta / length`` (Dieterich), which is
    ``z' = (speed exp(-z) - |s|) / length``, or with ``state_evolution="slip"`` the slip law (Ruina)
    ``theta' = -(|s| theta / length) ln(|s| theta / length)``, ``z' = -|s| (ln(|s| / speed) + z) / length``.
    Slip at the speed v is steady with ``z = -ln(v / speed)`` under both. Steady slip of a mass m that a
    spring pulls is unstable below the stiffness ``(evolution - direct) N / length (1 + m v^2 / (N direct
    length))`` (Rice and Ruina, J. Appl. Mech. 50 (1983) 343), also under both. Under the slip law nothing
    heals at rest, and its rate has no slope there: a run stops where slip turns, with the ``stop_reason``
    "unbounded".

    The contact needs mass along its slip; while it is open, z is 0, so that a new contact is as old as one
    that has slid at `speed`. The rates of the law are about ``direct N / (m |s|)`` and ``|s| / length``:
    motions that nearly stick take very many panels.

    Parameters
    ----------
    reference
        Coefficient of friction of steady slip at `speed`, > 0.
    direct
        a, the immediate rise of friction per unit of the logarithm of the slip speed, > 0.
    evolution
        b, the rise per unit of z, > 0; friction of steady slip falls with the speed where b is above a.
    length
        The slip over which the state is renewed, m, > 0.
    speed
        A slip speed of reference, m/s, > 0.
    state_evolution
        ``"aging"`` or ``"slip"``, the law that the state follows.
    """

    reference: float
    direct: float
    evolution: float
    length: float
    speed: float
    state_evolution: Literal["aging", "slip"] = "aging"
    law: ClassVar[str] = "ratestate"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.state_evolution not in _EVOLUTIONS:
            raise InputError(
                f"friction: state_evolution: expected 'aging' or 'slip', got {self.state_evolution!r}"
            )
        for name, value in self.parameters().items():
            if value <= 0.0:
                raise InputError(f"friction: {name}: must be > 0, got {value:g}")

    @cached_property
    def _as_state_law(self) -> StateLaw:
        grown = "abs(s) / (2 * speed) * exp((reference + evolution * z) / direct)"
        return StateLaw(
            f"direct * sign(s) * log({grown} + sqrt(({grown})**2 + 1))",
            _EVOLUTIONS[self.state_evolution],
            **self.parameters(),
        )

    def parameters(self) -> dict[str, float]:
        """Return its numbers by name."""
        return {name: value for name, value in super().parameters().items() if name != "state_evolution"}

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {**super().table(), "state_evolution": self.state_evolution}

    def data(self) -> LawData | None:
        """Return the operations of force and rate."""
        return self._as_state_law.data()

    def coefficient(self, speed: float) -> float:
        """Return mu of steady slip at a speed, m/s."""
        return self._as_state_law.coefficient(speed)
