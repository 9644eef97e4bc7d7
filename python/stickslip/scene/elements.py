"""Springs and dampers of a scene that are no entries of its matrices."""

from __future__ import annotations

import dataclasses
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import by_label, described, real_number
from stickslip.scene.contact import DirectionLike, described_direction, direction_entries
from stickslip.scene.laws.spring import Polynomial, SpringLaw, law_of

if TYPE_CHECKING:
    from stickslip._core import _ElementData


@dataclass(frozen=True, eq=False)
class _Element:
    direction: DirectionLike
    law: SpringLaw
    #: What it is called in files and tables.
    kind: ClassVar[str]
    name: str | None = dataclasses.field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if isinstance(self.law, Mapping):
            object.__setattr__(self, "law", law_of(self.law))
        elif isinstance(self.law, numbers.Real) and not isinstance(self.law, bool):
            object.__setattr__(self, "law", Polynomial(real_number("law", self.law)))
        if isinstance(direction := by_label(self.direction), Mapping):
            object.__setattr__(self, "direction", dict(direction))


@dataclass(frozen=True, eq=False)
class Spring(_Element):
    """A spring with the force ``-phi(u) d`` on the dofs, where ``u = d . x - offset`` is its stretch.

    The energy of the balance holds ``int phi``; modes and stability take its slope at steady sliding.

    Parameters
    ----------
    direction
        d: the index or the name of a dof, a vector (n,), or a mapping from dofs to entries, such as ``{"x1":
        1.0, "x5": -1.0}`` for a spring between two dofs.
    law
        phi, N over m: a law of `stickslip.spring`, its table in files, or a number, the stiffness of a linear
        spring, N/m.
    offset
        The value of ``d . x`` at which the stretch is zero, m.
    name
        Its name in tables and parameters, which are such as ``mount_k3``; None: ``element_`` and its place
        among the elements of the scene.
    """

    offset: float = 0.0
    kind: ClassVar[str] = "spring"


@dataclass(frozen=True, eq=False)
class Damper(_Element):
    """A damper with the force ``-phi(u) d`` on the dofs, where ``u = d . x'`` is its rate.

    Its power ``phi(u) u`` is dissipated. Modes and stability take its slope at rest.

    Parameters
    ----------
    direction
        d: the index or the name of a dof, a vector (n,), or a mapping from dofs to entries.
    law
        phi, N over m/s, zero at rest: a law of `stickslip.spring`, its table in files, or a number, N s/m.
    name
        Its name in tables and parameters, which are such as ``mount_k3``; None: ``element_`` and its place
        among the elements of the scene.
    """

    kind: ClassVar[str] = "damper"


Element: TypeAlias = Spring | Damper


def element_names(elements: Sequence[Element]) -> list[str]:
    """Return the names of elements as tables and parameters have them."""
    return [f"element_{k}" if one.name is None else one.name for k, one in enumerate(elements)]


def checked_elements(elements: Any) -> tuple[Element, ...]:
    """Return the springs and dampers of a scene."""
    if isinstance(elements, _Element) or not np.iterable(elements) or isinstance(elements, str | Mapping):
        raise InputError(f"elements: expected a sequence of Spring and Damper, got {described(elements)}")
    listed = tuple(elements)
    for k, one in enumerate(listed):
        if not isinstance(one, Spring | Damper):
            raise InputError(f"elements: expected Spring or Damper, got {described(one)} at {k}")
        if not isinstance(one.law, SpringLaw):
            raise InputError(
                f"element {k}: law: expected a law of stickslip.spring or a number, got {described(one.law)}"
            )
    names = element_names(listed)
    for name in names:
        if not (isinstance(name, str) and name.isidentifier()):
            raise InputError(f"elements: name: expected a word, as parameters have it, got {name!r}")
        if names.count(name) > 1:
            raise InputError(f"elements: {name!r} names more than one element")
    return listed


def core_elements(elements: Sequence[Element], dofs: Sequence[str]) -> list[_ElementData]:
    """Return elements as the core takes them."""
    found = []
    for k, one in enumerate(elements):
        place = f"element {k}"
        entries = direction_entries(f"{place}: direction", one.direction, dofs)
        if not any(entry for _, entry in entries):
            raise InputError(f"{place}: direction: must not be zero")
        offset = real_number(f"{place}: offset", getattr(one, "offset", 0.0))
        if not np.isfinite([offset, *(entry for _, entry in entries)]).all():
            raise InputError(f"{place}: offset and direction must be finite")
        data = one.law.data()
        assert data is not None
        found.append((one.kind, entries, offset, data))
    return found


def described_elements(elements: Sequence[Element], dofs: Sequence[str]) -> list[tuple[str, str]]:
    """Return names and words of springs and dampers."""
    rows = []
    for name, one in zip(element_names(elements), elements, strict=True):
        offset = getattr(one, "offset", 0.0)
        told = f"{one.kind} along {described_direction(one.direction, dofs)}, {one.law!r}"
        rows.append((name, told + (f", offset {offset:g} m" if offset else "")))
    return rows


def element_numbers(element: Element) -> dict[str, float]:
    """Return the numbers of an element by name: those of its law, and the offset of a spring."""
    offset = {"offset": element.offset} if isinstance(element, Spring) else {}
    return {**element.law.parameters(), **offset}


def with_element_number(element: Element, name: str, value: Any) -> Element:
    """Return the element with another number."""
    if name == "offset":
        return dataclasses.replace(element, offset=value)
    return dataclasses.replace(element, law=element.law.replace(**{name: value}))
