"""Formulas of a variable and of named numbers, read from a text and told as one.

An expression is a tree of tuples, which compare and hash by what they say: ``("variable",)``,
``("number", name)``, ``("constant", value)``, and an operation with its operands, ``("add", a, b)``. A
formula of a contact with a state also has ``("state",)``, and of its variable, the slip velocity, the
``("speed",)`` and the ``("direction",)``.
"""

from __future__ import annotations

import ast
import keyword
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NoReturn

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import described, real_number

Tree = tuple[Any, ...]

FUNCTIONS = ("exp", "log", "sqrt", "tanh", "arctan", "sin", "cos")
#: Every operation with how it is evaluated; numpy calls these on an `Expression` too.
EVALUATED: dict[str, np.ufunc] = {
    name: getattr(np, name)
    for name in ("add", "subtract", "multiply", "divide", "power", "negative", *FUNCTIONS)
}
_SIGNS: dict[type[ast.AST], str] = {
    ast.Add: "add",
    ast.Sub: "subtract",
    ast.Mult: "multiply",
    ast.Div: "divide",
    ast.Pow: "power",
}
#: Sign and how closely it binds.
_TOLD = {"add": (" + ", 1), "subtract": (" - ", 1), "multiply": (" * ", 2), "divide": (" / ", 2)}
_NEGATIVE, _POWER, _WHOLE = 3, 4, 5
#: What abs and sign give of the variable of a formula with a state, by the names of Python and numpy.
OF_SLIP = {"abs": "speed", "absolute": "speed", "fabs": "speed", "sign": "direction"}
#: What a formula depends on.
_LEAVES = ("variable", "state", "speed", "direction")
#: Functions that would choose between formulas by a value.
CHOOSING = (
    *("abs", "absolute", "fabs", "min", "max", "minimum", "maximum", "fmin", "fmax", "where", "sign", "clip"),
    *("heaviside", "round", "floor", "ceil", "rint", "trunc", "interp", "piecewise", "select", "less"),
    *("less_equal", "greater", "greater_equal", "equal", "not_equal"),
)
#: Most operations and letters of a formula: a longer one is no law on one line.
OPERATIONS, LETTERS = 200, 10_000


@dataclass(frozen=True)
class Variable:
    """What a formula depends on."""

    #: How formulas call it, such as ``s``.
    name: str
    #: What it is, such as ``the slip speed s >= 0``.
    meaning: str
    #: The argument that errors name, such as ``friction``.
    argument: str
    #: What to use where no formula says it, such as ``Tabulated``.
    table: str
    #: How formulas call a second variable, the state of a contact, where there is one.
    state: str | None = None

    @property
    def names(self) -> dict[str, Tree]:
        """What formulas depend on, by name."""
        second: dict[str, Tree] = {} if self.state is None else {self.state: ("state",)}
        return {self.name: ("variable",), **second}

    def of_slip(self, function: str, operand: Tree) -> Tree | None:
        """Return the speed or the direction of slip, where a function of the variable stands for it."""
        known = self.state is not None and operand == ("variable",)
        return (OF_SLIP[function],) if known and function in OF_SLIP else None

    def refuse(self, reason: str) -> NoReturn:
        """Raise the error of a formula."""
        raise InputError(f"{self.argument}: {reason}")

    def refuse_choice(self, what: str) -> NoReturn:
        """Raise the error of a formula that is another one from some value of the variable on."""
        self.refuse(f"{what}: a law cannot branch on {self.meaning}: use {self.table}")


def constant(variable: Variable, value: Any) -> Tree:
    """Return a number as an expression."""
    number = real_number(f"{variable.argument}: a number of the formula", value)
    if not np.isfinite(number):
        variable.refuse(f"expected finite numbers in the formula, got {number}")
    return ("constant", number)


@lru_cache(maxsize=256)
def parsed(variable: Variable, formula: str) -> Tree:
    """Return the formula of a text, which is read, and never run as code."""
    if len(formula) > LETTERS:
        variable.refuse(f"formula: expected at most {LETTERS} letters, got {len(formula)}")
    try:
        read = ast.parse(formula.strip(), mode="eval").body
    except (SyntaxError, ValueError) as error:
        variable.refuse(f"formula: {described(formula)} cannot be read: {getattr(error, 'msg', error)}")
    except (RecursionError, MemoryError):
        variable.refuse(f"formula: {described(formula)} is nested too deeply")
    signs = sum(isinstance(one, ast.BinOp | ast.UnaryOp | ast.Call) for one in ast.walk(read))
    if signs > OPERATIONS:
        variable.refuse(f"formula: expected at most {OPERATIONS} operations, got {signs}")
    return _tree(variable, read)


def _tree(variable: Variable, read: ast.expr) -> Tree:
    match read:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return constant(variable, value)
        case ast.Name(id=name):
            return variable.names.get(name, ("number", name))
        case ast.UnaryOp(op=ast.UAdd(), operand=a):
            return _tree(variable, a)
        case ast.UnaryOp(op=ast.USub(), operand=a):
            return joined(variable, "negative", _tree(variable, a))
        case ast.BinOp(left=a, op=sign, right=b) if type(sign) in _SIGNS:
            return joined(variable, _SIGNS[type(sign)], _tree(variable, a), _tree(variable, b))
        case ast.Call(func=ast.Name(id=name), args=[a], keywords=[]) if name in FUNCTIONS:
            return joined(variable, name, _tree(variable, a))
        case ast.Call(func=ast.Name(id=name), args=[ast.Name(id=of)], keywords=[]) if (
            found := variable.of_slip(name, variable.names.get(of, ()))
        ):
            return found
        case ast.IfExp() | ast.Compare() | ast.BoolOp():
            variable.refuse_choice(f"formula: {described(ast.unparse(read))}")
        case ast.Call(func=ast.Name(id=name)) if name in CHOOSING:
            variable.refuse_choice(f"formula: {described(ast.unparse(read))}")
    power = "; a power is written **" if isinstance(getattr(read, "op", None), ast.BitXor) else ""
    variable.refuse(
        f"formula: expected numbers, names, + - * / ** and {', '.join(FUNCTIONS)},"
        f" got {described(ast.unparse(read))}{power}"
    )


def joined(variable: Variable, operation: str, *operands: Tree) -> Tree:
    """Return an operation on formulas; one on constants alone is its value."""
    if operation == "power" and depends(operands[1]):
        told = text(variable, operands[1])
        variable.refuse(f"the exponent {told} depends on {variable.meaning}: write exp(exponent * log(base))")
    if all(one[0] == "constant" for one in operands):
        return ("constant", value_of(variable, (operation, *operands), {}))
    if (operation, operands[0][0]) == ("negative", "negative"):
        return tuple(operands[0][1])
    tree = (operation, *operands)
    if _size(tree) > OPERATIONS:
        variable.refuse(f"expected a formula of at most {OPERATIONS} operations, got {_size(tree)}")
    return tree


def _operands(tree: Tree) -> Tree:
    return tree[1:] if tree[0] in EVALUATED else ()


def _size(tree: Tree) -> int:
    return len(_operands(tree)) and 1 + sum(map(_size, _operands(tree)))


def depends(tree: Tree) -> bool:
    """Return whether the variable stands in a formula."""
    return tree[0] in _LEAVES or any(map(depends, _operands(tree)))


def names(tree: Tree) -> list[str]:
    """Return the names of the numbers of a formula, in the order in which they come first."""
    inner = [name for one in _operands(tree) for name in names(one)]
    return [tree[1]] if tree[0] == "number" else list(dict.fromkeys(inner))


def check_names(variable: Variable, numbers: Mapping[str, Any], tree: Tree, taken: tuple[str, ...]) -> None:
    """Refuse names of numbers that cannot be written, mean something else, or are not those of a formula."""
    for name in numbers:
        stem, _, label = name.rpartition("_")
        known = (*taken, *FUNCTIONS, *variable.names)
        if not name.isidentifier() or keyword.iskeyword(name) or name in known:
            variable.refuse(f"{described(name)} cannot name a number of a formula")
        if stem and label.isdecimal():
            variable.refuse(f"{name}: _{label} at the end stands for one contact; call it {stem}{label}")
    told = text(variable, tree)
    for name in names(tree):
        if name not in numbers:
            variable.refuse(f"formula: {name} in {described(told)} has no value; give it as {name}=...")
    for name in numbers:
        if name not in names(tree):
            variable.refuse(f"{name}: is no number of the formula {described(told)}")


def text(variable: Variable, tree: Tree) -> str:
    """Return a formula as a text that `parsed` takes."""
    return _told(variable, tree)[0]


def _told(variable: Variable, tree: Tree) -> tuple[str, int]:
    """Return a formula, and how closely the sign binds that is outermost in it."""

    def part(k: int, least: int) -> str:
        told, binding = _told(variable, tree[k])
        return told if binding >= least else f"({told})"

    operation = tree[0]
    if operation in _TOLD:
        sign, binding = _TOLD[operation]
        return f"{part(1, binding)}{sign}{part(2, binding + 1)}", binding
    match operation:
        case "variable":
            return variable.name, _WHOLE
        case "state":
            return str(variable.state), _WHOLE
        case "speed" | "direction":
            function = "abs" if operation == "speed" else "sign"
            return f"{function}({variable.name})", _WHOLE
        case "number":
            return tree[1], _WHOLE
        case "constant":
            value = tree[1]
            told = str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
            return told, _NEGATIVE if told[0] == "-" else _WHOLE
        case "negative":
            return f"-{part(1, _NEGATIVE)}", _NEGATIVE
        case "power":
            return f"{part(1, _WHOLE)}**{part(2, _NEGATIVE)}", _POWER
    return f"{operation}({part(1, 0)})", _WHOLE


def value_of(variable: Variable, tree: Tree, numbers: Mapping[str, float]) -> float:
    """Return the value of a formula in which the variable does not stand."""
    if tree[0] in ("number", "constant"):
        return float(numbers[tree[1]] if tree[0] == "number" else tree[1])
    operands = [value_of(variable, one, numbers) for one in tree[1:]]
    with np.errstate(all="ignore"):
        value = float(EVALUATED[tree[0]](*operands))
    if not np.isfinite(value):
        at = ", ".join(f"{name}={numbers[name]:g}" for name in names(tree))
        variable.refuse(f"{text(variable, tree)} must be finite, got {value:g}{f' at {at}' if at else ''}")
    return value
