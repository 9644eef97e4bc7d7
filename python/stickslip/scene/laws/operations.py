"""A formula as a list of operations, as the core takes it, and its values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stickslip.scene.laws.expression import EVALUATED, FUNCTIONS, Tree, Variable, depends, value_of

#: An operation: its name, the slots of its operands, a number. Slot 0 is the variable, of a formula with a
#: state the speed of slip, and slot k + 1 is what the k-th operation gives.
Operation = tuple[str, int, int, float]
#: The largest exponent; up to it the core makes whole powers of products, which hold where the base is zero.
EXPONENT = 64.0


def operations(variable: Variable, tree: Tree, numbers: Mapping[str, float]) -> list[Operation]:
    """Return a formula as the core takes it; the last operation gives its value, and none stands twice."""
    tape = _Tape(variable, numbers)
    if tape.slot(tree) == 0:
        tape.times(0, 1.0)
    return list(tape.slots)


class _Tape:
    """Operations in the order in which they come, with the slots of what they give."""

    def __init__(self, variable: Variable, numbers: Mapping[str, float]) -> None:
        self.variable, self.numbers = variable, numbers
        self.slots: dict[Operation, int] = {}

    def put(self, operation: str, first: int = 0, second: int = 0, number: float = 0.0) -> int:
        if operation in ("add", "multiply") and first > second:
            first, second = second, first
        return self.slots.setdefault((operation, first, second, number), len(self.slots) + 1)

    def times(self, slot: int, number: float) -> int:
        return self.put("multiply", slot, self.put("constant", number=number))

    def slot(self, tree: Tree, minus: bool = False) -> int:
        """Return the slot of a formula or, with `minus`, of its negative, which is no operation more."""
        if not depends(tree):
            value = value_of(self.variable, tree, self.numbers)
            return self.put("constant", number=-value if minus else value)
        match tree:
            case ("variable",) if self.variable.state is not None:
                slot = self.put("multiply", 0, self.put("direction"))
            case ("variable" | "speed",):
                return self.times(0, -1.0) if minus else 0
            case ("state" | "direction",):
                slot = self.put(tree[0])
            case ("negative", a):
                return self.slot(a, not minus)
            case ("add" | "subtract", a, b):
                (a, minus_a), (b, minus_b) = _unsigned(a), _unsigned(b)
                return self.sum(a, minus_a != minus, b, minus_b != (minus != (tree[0] == "subtract")))
            case ("multiply" | "divide", a, b):
                (a, minus_a), (b, minus_b) = _unsigned(a), _unsigned(b)
                minus = minus != (minus_a != minus_b)
                # A constant takes the sign, if there is one.
                first = self.slot(a, minus and depends(b))
                return self.put(tree[0], first, self.slot(b, minus and not depends(b)))
            case ("tanh" | "arctan" | "sin" as odd, a):
                return self.put(odd, self.slot(a, minus))
            case ("power", a, b):
                slot = self.power(a, value_of(self.variable, b, self.numbers))
            case ("sqrt", a):
                slot = self.power(a, 0.5)
            case (function, a):
                slot = self.put(function, self.slot(a))
        return self.times(slot, -1.0) if minus else slot

    def sum(self, a: Tree, minus_a: bool, b: Tree, minus_b: bool) -> int:
        if minus_a and not minus_b:
            return self.sum(b, minus_b, a, minus_a)
        first, second = self.slot(a, minus_a), self.slot(b)
        return self.put("subtract" if minus_b else "add", first, second)

    def power(self, base: Tree, exponent: float) -> int:
        if abs(exponent) > EXPONENT:
            self.variable.refuse(f"expected exponents up to {EXPONENT:g}, got {exponent:g}")
        return self.put("power", self.slot(base), number=exponent)


def _unsigned(tree: Tree) -> tuple[Tree, bool]:
    """Return a formula without the sign before it, and whether there is one."""
    return (tree[1], True) if tree[0] == "negative" else (tree, False)


def values(tape: Sequence[Operation], variable: Any, state: Any = 0.0) -> list[Any]:
    """Return what the slots of operations hold, for slip in the positive direction where there is a state."""
    found = [variable]
    given = {"state": state, "direction": 1.0}
    with np.errstate(all="ignore"):
        for name, first, second, number in tape:
            if name in given:
                found.append(given[name])
                continue
            operands = {"constant": (), "power": (found[first], number)}.get(name)
            if operands is None:
                operands = (found[first],) if name in FUNCTIONS else (found[first], found[second])
            found.append(EVALUATED[name](*operands) if operands else number)
    return found
