"""A function of the user as a formula: called once, with expressions that note what is done with them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from numbers import Real
from typing import Any, NoReturn

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import described, real_number
from stickslip.scene.laws.expression import (
    CHOOSING,
    EVALUATED,
    FUNCTIONS,
    Tree,
    Variable,
    constant,
    joined,
    text,
)


class Expression(np.lib.mixins.NDArrayOperatorsMixin):
    """What a function of the user sees in place of a number: it notes what is done with it.

    Its operators are those of numpy, which all come to `__array_ufunc__`.
    """

    def __init__(self, tree: Tree, variable: Variable) -> None:
        self.tree, self.variable = tree, variable

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **settings: Any) -> Expression:
        # In place, as in x += 1, the sum is given to itself.
        plain = method == "__call__" and settings in ({}, {"out": inputs[:1]})
        name = ufunc.__name__
        if plain and name in ("positive", "square", "reciprocal"):
            found: dict[str, Expression] = {"positive": self, "square": self * self, "reciprocal": 1.0 / self}
            return found[name]
        if plain and (of_slip := self.variable.of_slip(name, self.tree)):
            return Expression(of_slip, self.variable)
        if not plain or EVALUATED.get(name) is not ufunc:
            self._refuse_function(name)
        trees = [_operand(self.variable, one) for one in inputs]
        return Expression(joined(self.variable, name, *trees), self.variable)

    def __array_function__(self, function: Callable[..., Any], *_: Any) -> NoReturn:
        self._refuse_function(function.__name__)

    def _refuse_function(self, name: str) -> NoReturn:
        if name in CHOOSING:
            self.variable.refuse_choice(f"numpy.{name}")
        self.variable.refuse(f"numpy.{name} is none of + - * / ** and {', '.join(FUNCTIONS)}")

    def _choose(self, *_: Any) -> NoReturn:
        self.variable.refuse_choice("the function asks for a value")

    __bool__ = __round__ = __floor__ = __ceil__ = __int__ = _choose

    def __float__(self) -> float:
        self.variable.refuse("the formula needs functions of numpy, such as numpy.exp in place of math.exp")

    def __repr__(self) -> str:
        return text(self.variable, self.tree)


def _operand(variable: Variable, value: Any) -> Tree:
    """Return an expression or a number as a tree."""
    return value.tree if isinstance(value, Expression) else constant(variable, value)


def traced(variable: Variable, function: Callable[..., Any], given: Mapping[str, Any]) -> tuple[Tree, Any]:
    """Return the formula that a function stands for, and its numbers by name: its defaults, and those given.

    The function is called once, with an expression for the variable and one for each number.
    """
    try:
        every = list(inspect.signature(function).parameters.values())
    except ValueError:
        every = []
    first, others = every[: len(variable.names)], every[len(variable.names) :]
    if len(first) < len(variable.names):
        variable.refuse(f"expected a function of {variable.meaning}, got {described(function)}")
    for one in every:
        open_ended = one.kind in (one.VAR_POSITIONAL, one.VAR_KEYWORD)
        if open_ended or (one in first and one.kind is one.KEYWORD_ONLY):
            variable.refuse(
                f"{one}: expected a function of {variable.meaning} and of named numbers,"
                f" lambda {', '.join(variable.names)}, kinetic=0.3: ..."
            )
    numbers = {one.name: given.get(one.name, one.default) for one in others}
    for name, value in numbers.items():
        if value is inspect.Parameter.empty:
            variable.refuse(
                f"{name}: the number has no value; give it as a default, {name}=..., or beside the law"
            )
        real_number(f"{variable.argument}: {name}", value)
    for name in given.keys() - numbers.keys():
        variable.refuse(f"{name}: the function has no such number; it has {', '.join(numbers) or 'none'}")
    call = inspect.signature(function).bind_partial()
    for one, tree in zip(first, variable.names.values(), strict=True):
        call.arguments[one.name] = Expression(tree, variable)
    call.arguments |= {name: Expression(("number", name), variable) for name in numbers}
    try:
        found = function(*call.args, **call.kwargs)
    except (TypeError, AttributeError) as error:
        raise InputError(f"{variable.argument}: the function takes no expression: {error}") from error
    if not isinstance(found, Expression | Real):
        variable.refuse(
            f"expected a formula of {variable.meaning}, got a function that returns {described(found)}"
        )
    return _operand(variable, found), numbers
