"""What laws of friction, springs and dampers have in common: numbers with names, files, and formulas."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import described, finite, real_number
from stickslip.scene.laws.expression import Variable, check_names, depends, names, parsed, text
from stickslip.scene.laws.operations import Operation, operations, values
from stickslip.scene.laws.tracing import traced

L = TypeVar("L", bound="OneVariableLaw")
#: The kind of a law in the core, its numbers, the pieces of a table by rows of 4, and the operations of a
#: formula.
LawData = tuple[str, list[float], list[list[float]], list[Operation]]


@dataclasses.dataclass(frozen=True)
class OneVariableLaw(ABC):
    """A law of one variable with numbers that have names."""

    #: The name of the law in files.
    law: ClassVar[str]
    #: The argument that errors name.
    argument: ClassVar[str]

    def __post_init__(self) -> None:
        for name in self.parameters():
            value = real_number(f"{self.argument}: {name}", getattr(self, name))
            if not np.isfinite(value) or (name == "speed" and value <= 0.0):
                raise InputError(
                    f"{self.argument}: {name}: must be finite{' and > 0' * (name == 'speed')}, got {value}"
                )
            object.__setattr__(self, name, value)

    def parameters(self) -> dict[str, float]:
        """Return its numbers by name."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    def replace(self, **numbers: float) -> Self:
        """Return the law with other `numbers`, given by name."""
        given = {name: value for name, value in self.table().items() if name != "law"}
        return self.of_table({**given, **numbers})

    @abstractmethod
    def data(self) -> LawData | None:
        """Return the law as the core takes it; None where there is nothing to take."""

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {"law": self.law, **self.parameters()}

    @classmethod
    def of_table(cls, given: Mapping[str, Any]) -> Self:
        """Return the law of a table without its name.

        Raises
        ------
        InputError
            If its numbers are others.
        """
        fields = list(dataclasses.fields(cls))
        known = [field.name for field in fields]
        for key in given:
            if key not in known:
                raise InputError(
                    f"{cls.argument}: the law {cls.law!r} has no {key!r}; it has {', '.join(known)}"
                )
        for field in fields:
            if field.name not in given and field.default is dataclasses.MISSING:
                raise InputError(f"{cls.argument}: the law {cls.law!r} needs {field.name}")
        return cls(**given)

    def __format__(self, spec: str) -> str:
        return repr(self)


@dataclasses.dataclass(frozen=True)
class FrictionLaw(OneVariableLaw):
    """The dependence of friction on slip speed, of which every public class of this module is a form."""

    argument: ClassVar[str] = "friction"

    def data(self) -> LawData | None:
        """Return the law as the core takes it; None where friction is constant."""
        return self.law, list(self.parameters().values()), [], []

    @abstractmethod
    def coefficient(self, speed: float) -> float:
        """Return mu at a slip speed, m/s."""

    @property
    def at_rest(self) -> float:
        """Coefficient up to which a contact that sticks holds, without a `Contact.static_friction`."""
        return self.coefficient(0.0)


def read_formula(
    variable: Variable,
    formula: str | Callable[..., Any],
    numbers: Mapping[str, Any],
    taken: tuple[str, ...],
) -> tuple[str, dict[str, float]]:
    """Return the text of a formula and its numbers by name; `taken` are names that no number may have."""
    given = numbers
    if isinstance(formula, str):
        tree = parsed(variable, formula)
    elif callable(formula):
        tree, given = traced(variable, formula, numbers)
    else:
        variable.refuse(f"formula: expected a function or a text, got {described(formula)}")
    check_names(variable, given, tree, taken)
    found = {name: finite(f"{variable.argument}: {name}", given[name]) for name in names(tree)}
    told = text(variable, tree)
    if not depends(tree):
        meaning = variable.meaning.split(" >=")[0]
        variable.refuse(f"{told} does not depend on {meaning}: give the plain number")
    return told, found


@dataclasses.dataclass(frozen=True, init=False, repr=False)
class FormulaLaw(OneVariableLaw):
    """A formula of one variable and of named numbers, traced from a function or read from a text."""

    variable: ClassVar[Variable]
    formula: str
    _numbers: tuple[tuple[str, float], ...]

    def _read(self, formula: str | Callable[..., Any], numbers: Mapping[str, float]) -> None:
        """Set the formula and its numbers."""
        told, found = read_formula(self.variable, formula, numbers, ("law", "formula"))
        object.__setattr__(self, "formula", told)
        object.__setattr__(self, "_numbers", tuple(found.items()))

    @cached_property
    def _operations(self) -> list[Operation]:
        return operations(self.variable, parsed(self.variable, self.formula), self.parameters())

    def _value(self, at: Any) -> Any:
        return values(self._operations, at)[-1]

    def parameters(self) -> dict[str, float]:
        """Return its numbers by name."""
        return dict(self._numbers)

    def data(self) -> LawData | None:
        """Return the operations of the formula."""
        return "formula", [], [], self._operations

    def table(self) -> dict[str, Any]:
        """Return the law as a file has it."""
        return {"law": self.law, "formula": self.formula, **self.parameters()}

    @classmethod
    def of_table(cls, given: Mapping[str, Any]) -> Self:
        """Return the law of a table without its name.

        Raises
        ------
        InputError
            If it is none.
        """
        formula = given.get("formula")
        if not isinstance(formula, str):
            raise InputError(f"{cls.argument}: formula: expected a text, got {described(formula)}")
        return cls(  # type: ignore[call-arg]
            formula, **{name: value for name, value in given.items() if name != "formula"}
        )

    def __repr__(self) -> str:
        numbers = [f"{name}={value!r}" for name, value in self._numbers]
        return f"Law({', '.join([repr(self.formula), *numbers])})"


def law_among(laws: Mapping[str, type[L]], argument: str, table: Mapping[str, Any]) -> L:
    """Return the law of a table as files have it: ``{law = "stribeck", static = 0.5, ...}``."""
    given = dict(table)
    name = given.pop("law", None)
    kind = laws.get(name) if isinstance(name, str) else None
    if kind is None:
        raise InputError(f"{argument}: law: expected one of {', '.join(laws)}, got {described(name)}")
    return kind.of_table(given)
