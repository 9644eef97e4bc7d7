"""A contact with a rigid moving slider: with friction, a stop, or friction under a given normal force."""

from __future__ import annotations

import dataclasses
import difflib
import numbers
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.scene.checks import (
    Real,
    axis_labels,
    by_label,
    described,
    real_array,
    real_number,
    whole_number,
)
from stickslip.scene.laws import spring
from stickslip.scene.laws.friction import LAWS, law_of
from stickslip.scene.laws.law import FrictionLaw, LawData, OneVariableLaw
from stickslip.scene.laws.state import LawWithState

if TYPE_CHECKING:
    from stickslip._core import _ContactData
    from stickslip.scene.loads.in_time import Harmonic

#: Entries by dof: a vector, or a mapping from indices or names of dofs.
EntriesLike: TypeAlias = "ArrayLike | Mapping[str, float] | Mapping[int, float]"
#: A direction: the index or the name of a dof, or entries by dof.
DirectionLike: TypeAlias = "int | str | EntriesLike"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Contact:
    """One contact: its directions in the space of the displacements x, and its law.

    With both directions it is unilateral contact with friction. Without a tangential one it is a *stop*: it
    has no friction, and is closed, written ``+``, or open, ``d``. Without a normal one it is friction under a
    given `normal_force`: it slides or sticks, and never opens.

    A direction is the index of a dof, the name of a dof, a vector (n,), or a mapping from dofs to its
    entries, such as ``{"12.1": 1.0, "907.1": -1.0}`` between two nodes; the other entries are 0.

    Parameters
    ----------
    tangential
        Direction t; the slip velocity is ``t . x' - slider_speed``, m/s. None: the contact is a stop.
        A pair of directions, ``("x", "y")``, perpendicular to each other in the plane of the contact, is
        friction in a plane: the friction force opposes the slip velocity
        ``w = (t_x . x' - v_x, t_y . x' - v_y)``, ``T = -friction N w / |w|``, and the contact sticks while
        ``|T| <= static_friction N``. A scene lists it as two contacts, one along each direction, whose
        letters are both ``o`` (it slips), both ``s``, or both ``d`` (it is open). The first one has the
        normal direction, and both have its gap and its normal force.
    normal
        Direction n, which points from the slider to the structure; the gap is ``n . x + gap`` >= 0, m. None:
        the contact has friction under `normal_force`.
    friction
        Coefficient of kinetic friction, >= 0: ``T = +friction N`` where the slip velocity is negative,
        ``-friction N`` where it is positive. A stop needs none. A coefficient that depends on slip speed is
        given as a law of `stickslip.friction`, or as its table in files, ``{"law": "stribeck", ...}``; in a
        plane it follows ``|w|`` and is positive at rest.
        Where slip has no mass, the law has to rise with the slip speed. Laws with a state of their own
        (`LuGre`, `Dahl`, `BoucWen`, `ElastoPlastic`, `RateState`, `StateLaw`) are for contacts whose slip has
        mass.
    static_friction
        Coefficient up to which a sticking contact holds, >= friction at rest; None: equal to the friction at
        rest.
    slider_speed
        Speed of the slider along t, m/s; in a plane a pair of speeds.
    restitution
        Ratio of normal velocities after and before an impact, in [0, 1]; 0 is plastic.
    gap
        Clearance at x = 0, m; a negative one is an interference.
    normal_stiffness, tangential_stiffness
        Stiffnesses of springs, N/m, between the contact and the dofs that its directions name; None: the
        contact is rigid. With springs the contact is a node without mass: its gap closes without an impact,
        and its slip velocity is that of the node. With a normal stiffness only, the slip velocity is that of
        the dofs. Along a line a tangential stiffness needs a normal one, or a given normal force. In a plane
        it is that in every direction, with a rigid normal direction or a given normal force: ``s`` while the
        node rests on the slider, ``o`` while it slips with ``|T| = friction N``. A normal stiffness may
        be a law of `stickslip.spring`, or its table in files: ``N = phi(u)``, N, at the penetration ``u =
        -(n . x + gap)``, m. The force is 0 at u = 0 and its slope there positive. It has to press at every
        penetration that occurs, and a tangential stiffness beside it is not computed.
    normal_force
        Normal force N > 0 of a contact without a normal direction, N; None for a contact that has one.
    name
        Name of the contact in tables; None: its index.
    slider_vibration
        `Harmonic` velocity, m/s, that is added to `slider_speed`; None: the slider does not vibrate. In a
        plane a pair, one along each direction.
    beside
        Index of the contact along the other direction of friction in a plane; a scene sets it.

    Raises
    ------
    InputError
        If a contact with a tangential direction has no friction.
    """

    tangential: DirectionLike | None = None
    normal: DirectionLike | None = None
    friction: float | FrictionLaw = None  # type: ignore[assignment]  # zero for a stop, else it has to be given
    static_friction: float | None = None
    #: A number; a pair only until a scene takes friction in a plane as two contacts.
    slider_speed: float | Any = 0.0
    restitution: float = 0.0
    gap: float = 0.0
    normal_stiffness: float | spring.SpringLaw | None = None
    tangential_stiffness: float | None = None
    normal_force: float | None = None
    name: str | None = None
    #: A `Harmonic`, whose file imports this one; or a pair, as the speed.
    slider_vibration: Harmonic | Any | None = None
    beside: int | None = None

    def __post_init__(self) -> None:
        if self.friction is None:
            if self.tangential is not None:
                raise InputError(
                    "friction: missing; only a contact without a tangential direction needs none"
                )
            object.__setattr__(self, "friction", 0.0)
        if isinstance(self.friction, Mapping):
            object.__setattr__(self, "friction", law_of(self.friction))
        if isinstance(self.normal_stiffness, Mapping):
            object.__setattr__(self, "normal_stiffness", spring.law_of(self.normal_stiffness))
        for name in ("tangential", "normal"):
            if isinstance(direction := by_label(getattr(self, name)), Mapping):
                object.__setattr__(self, name, dict(direction))
        for name in LAW:
            value = getattr(self, name)
            # Numbers of other kinds, such as fractions, become floats; what is no number, the scene refuses.
            if isinstance(value, numbers.Real) and not isinstance(value, float | int):
                object.__setattr__(self, name, real_number(name, value))

    def coefficient(self, speed: float | None = None) -> float:
        """Return the coefficient of kinetic friction at a slip speed, m/s; None: that of steady sliding.

        Raise `InputError` if the contact is one direction of friction in a plane that follows a law, and no
        speed is given: the speed of the slider has a part along the other direction.
        """
        if not isinstance(self.friction, FrictionLaw):
            return self.friction
        if speed is None and self.beside is not None:
            raise InputError("speed: expected a slip speed, m/s, of a contact in a plane, got None")
        given = self.slider_speed if speed is None else speed
        return self.friction.coefficient(float(np.linalg.norm(np.atleast_1d(given))))

    @property
    def holding(self) -> float:
        """Coefficient up to which the contact holds while it sticks."""
        if self.static_friction is not None:
            return self.static_friction
        return self.friction.at_rest if isinstance(self.friction, FrictionLaw) else self.friction

    def __repr__(self) -> str:
        given = {
            field.name: value
            for field in dataclasses.fields(self)
            # A direction may be an array.
            if (value := getattr(self, field.name)) is not None
            and (field.default is None or value != field.default)
        }
        return f"Contact({', '.join(f'{name}={value!r}' for name, value in given.items())})"


def is_in_plane(contact: Any) -> bool:
    """Return whether a contact has a pair of tangential directions, which a scene takes as two contacts."""
    given = getattr(contact, "tangential", None)
    return (
        isinstance(given, tuple | list)
        and len(given) == 2
        and not any(isinstance(one, numbers.Real) for one in given)
    )


def along_lines(contacts: Sequence[Any]) -> tuple[Any, ...]:
    """Return contacts with one tangential direction each: friction in a plane as two of them.

    Raise `InputError` if the speeds or vibrations of a slider are no pairs.
    """
    count = [2 if is_in_plane(contact) else 1 for contact in contacts]
    first = [sum(count[:k]) for k in range(len(count))]
    found: list[Any] = []
    for k, contact in enumerate(contacts):
        if not is_in_plane(contact):
            # Those of a scene know their planes by places, which others before them have moved.
            known = isinstance(contact, Contact) and contact.beside is not None
            moved = known and contact.beside < len(first) and first[contact.beside] != contact.beside
            found.append(dataclasses.replace(contact, beside=first[contact.beside]) if moved else contact)
            continue
        speeds = _pair(k, "slider_speed", contact.slider_speed, 0.0)
        waves = _pair(k, "slider_vibration", contact.slider_vibration, None)
        for place, direction in enumerate(contact.tangential):
            label = direction if isinstance(direction, str) else str(place + 1)
            one = dataclasses.replace(
                contact,
                tangential=direction,
                slider_speed=speeds[place],
                slider_vibration=waves[place],
                name=None if contact.name is None else f"{contact.name}_{label}",
                beside=first[k] + 1 - place,
            )
            # The first direction has what belongs to the normal one.
            found.append(
                one
                if place == 0
                else dataclasses.replace(one, normal=None, gap=0.0, restitution=0.0, normal_stiffness=None)
            )
    return tuple(found)


def steady_slips(contacts: Sequence[Contact]) -> Real:
    """Return the slip speeds of contacts of a scene in steady sliding, m/s, with both parts in a plane."""
    speeds = np.array([float(contact.slider_speed) for contact in contacts])
    others = [0.0 if contact.beside is None else speeds[contact.beside] for contact in contacts]
    slips: Real = np.hypot(speeds, others)
    return slips


def steady_coefficients(contacts: Sequence[Contact]) -> list[float]:
    """Return the coefficients of kinetic friction of contacts of a scene in steady sliding."""
    return [one.coefficient(speed) for one, speed in zip(contacts, steady_slips(contacts), strict=True)]


def _pair(contact: int, field: str, value: Any, none: Any) -> tuple[Any, Any]:
    """Return what a slider has along both directions; `none` is the default of one."""
    if np.ndim(value) == 0 and value == none:
        return none, none
    if isinstance(value, tuple | list | np.ndarray) and len(value) == 2:
        return value[0], value[1]
    raise InputError(
        f"contact {contact}: {field}: expected a pair, one along each direction of the plane, got {value!r}"
    )


#: Stiffnesses of a compliant contact, None where it is rigid.
SPRINGS = ("normal_stiffness", "tangential_stiffness")
#: Fields of a contact that `Scene.replace` takes as a scalar or as one value per contact.
LAW = ("friction", "static_friction", "slider_speed", "restitution", "gap", "normal_force", *SPRINGS)

#: Those that both directions of friction in a plane share.
SHARED = ("friction", "static_friction", "normal_force")

#: How parameters of laws begin: of friction, such as ``friction_kinetic``, and of the normal stiffness.
OF_LAW, OF_SPRING = "friction_", "normal_stiffness_"


def is_shared(field: str) -> bool:
    """Return whether a field is one of both directions of friction in a plane."""
    return field in SHARED or field.startswith(OF_LAW)


def concerns(field: str, contact: Contact) -> bool:
    """Return whether a field of the law is about a contact: it has the directions that the field needs."""
    if field == "normal_force":
        return contact.normal is None and (contact.beside is None or contact.normal_force is not None)
    if field in SPRINGS:
        return getattr(contact, field) is not None
    if field.startswith((OF_LAW, OF_SPRING)):
        return field in law_numbers(contact)
    direction = contact.normal if field in ("restitution", "gap") else contact.tangential
    return direction is not None


def law_numbers(contact: Contact) -> dict[str, float]:
    """Return the numbers of its laws of friction and normal stiffness by name; none where it has no law."""
    found: dict[str, float] = {}
    for field, law in laws_of(contact).items():
        found |= {f"{field}_{name}": value for name, value in law.parameters().items()}
    return found


def laws_of(contact: Contact) -> dict[str, OneVariableLaw]:
    """Return its laws by field: of friction over slip speed, and of the normal stiffness over penetration."""
    fields = {name: getattr(contact, name) for name in ("friction", "normal_stiffness")}
    return {name: law for name, law in fields.items() if isinstance(law, OneVariableLaw)}


def law_number(contact: Contact, field: str) -> Any:
    """Return a field of the contact law, or a parameter of one of its laws."""
    if field in LAW or not field.startswith((OF_LAW, OF_SPRING)):
        return getattr(contact, field)
    return law_numbers(contact).get(field)


def with_law_number(contact: Contact, field: str, value: Any) -> Contact:
    """Return the contact with another value of it."""
    if field in LAW:
        return dataclasses.replace(contact, **{field: value})
    if not concerns(field, contact):
        return contact
    owner = next(name for name in laws_of(contact) if field.startswith(f"{name}_"))
    law = laws_of(contact)[owner].replace(**{field.removeprefix(f"{owner}_"): value})
    changed: dict[str, Any] = {owner: law}
    return dataclasses.replace(contact, **changed)


def letters_of(contact: Contact) -> str:
    """Return the statuses that a contact can have."""
    if contact.tangential is None:
        return "+d"
    if contact.beside is not None:
        return "o" + "s" * (contact.holding > 0.0) + "d" * (contact.normal_force is None)
    return "+-" + ("s" if contact.holding > 0.0 else "") + ("" if contact.normal is None else "d")


def driven_letter(contact: Contact) -> str:
    """Return the status in which a contact slides as its slider drives it."""
    if contact.beside is not None:
        return "o"
    return "-" if contact.slider_speed < 0.0 else "+"


def contact_labels(contacts: Sequence[Contact]) -> list[int] | list[str]:
    """Return how tables label contacts: indices, or names as soon as one contact has a name."""
    if all(contact.name is None for contact in contacts):
        return list(range(len(contacts)))
    return [str(i) if contact.name is None else contact.name for i, contact in enumerate(contacts)]


def core_contact(contact: Contact, position: int, dofs: Sequence[str]) -> _ContactData:
    """Return a contact as the core takes it, its directions resolved against the dof names.

    Raise `InputError` if a direction is no index below n, no dof name and no vector, or a law entry is no
    real number.
    """
    if not isinstance(contact, Contact):
        raise InputError(f"contact {position}: expected a Contact, got {described(contact)}")
    place = f"contact {position}"
    if contact.name is not None and not (isinstance(contact.name, str) and contact.name.strip()):
        raise InputError(f"{place}: name: expected a text that is not empty, or None, got {contact.name!r}")
    law = contact.friction if isinstance(contact.friction, FrictionLaw) else None
    if law is not None and type(law) not in LAWS.values():
        raise InputError(
            f"{place}: friction: {type(law).__name__} is no law of stickslip.friction, for which motions are "
            "exact; give its formula, Law(lambda s: ...), or its values at some speeds, Tabulated(speeds, "
            "[law.coefficient(s) for s in speeds])"
        )
    # The core takes the law at rest beside the law.
    friction = real_number(f"{place}: friction", contact.friction if law is None else law.at_rest)
    static, speed = contact.static_friction, real_number(f"{place}: slider_speed", contact.slider_speed)
    if law is not None and np.isfinite(speed) and not np.isfinite(steady := law.coefficient(abs(speed))):
        one = isinstance(law, LawWithState)
        raise InputError(
            f"{place}: friction: must be finite at the slider speed {speed:g} m/s, got {steady:g}"
            f"{', as the rate has to fall through zero at one state z' * one}"
        )
    return (
        None if contact.tangential is None else _tangential(f"{place}: tangential", contact.tangential, dofs),
        None if contact.normal is None else _direction(f"{place}: normal", contact.normal, dofs),
        friction,
        friction if static is None else real_number(f"{place}: static_friction", static),
        speed,
        real_number(f"{place}: restitution", contact.restitution),
        real_number(f"{place}: gap", contact.gap),
        0.0 if contact.normal_force is None else real_number(f"{place}: normal_force", contact.normal_force),
        (
            _spring(place, contact, "normal_stiffness"),
            _spring(place, contact, "tangential_stiffness"),
            _spring_law(contact),
        ),
        None if law is None else law.data(),
        None if contact.beside is None else whole_number(f"{place}: beside", contact.beside, 0),
    )


def _spring(place: str, contact: Contact, name: str) -> float | None:
    value = getattr(contact, name)
    if name == "normal_stiffness" and isinstance(value, spring.SpringLaw):
        return None
    return None if value is None else real_number(f"{place}: {name}", value)


def _spring_law(contact: Contact) -> LawData | None:
    law = contact.normal_stiffness
    return law.data() if isinstance(law, spring.SpringLaw) else None


def dof_index(argument: str, value: int | str, dofs: Sequence[str]) -> int:
    """Return the index of a dof given by index or name.

    Raise `InputError` if the name is unknown (the nearest ones are offered) or the index outside 0..n-1.
    """
    if isinstance(value, str):
        try:
            return dofs.index(value)
        except ValueError:
            raise InputError(f"{argument}: unknown dof {value!r}{nearest(value, dofs)}") from None
    try:
        index = operator.index(value)
    except TypeError:
        raise InputError(f"{argument}: expected the name or index of a dof, got {described(value)}") from None
    if not 0 <= index < len(dofs):
        raise InputError(f"{argument}: dof index {index} is outside 0..{len(dofs) - 1}")
    return index


def contact_index(argument: str, value: int | str, contacts: Sequence[Contact]) -> int:
    """Return the index of a contact given by index or name; an index may be a text.

    Raise `InputError` if the name is unknown (the nearest ones are offered) or the index outside 0..n-1.
    """
    names = [str(label) for label in contact_labels(contacts)]
    if isinstance(value, str) and value in names:
        return names.index(value)
    if isinstance(value, str) and not value.isdecimal():
        raise InputError(f"{argument}: unknown contact {value!r}{nearest(value, names)}")
    index = whole_number(argument, int(value) if isinstance(value, str) else value, 0)
    if index >= len(contacts):
        raise InputError(f"{argument}: expected an index below {len(contacts)}, got {index}")
    return index


def aligned(argument: str, value: Any, dofs: Sequence[str]) -> Any:
    """Return a labelled vector or matrix (pandas, xarray) in the order of the dofs, others as they are.

    Raise `InputError` if the labels of an axis are not the names or indices of all dofs.
    """
    array = value
    for axis, labels in enumerate(axis_labels(value)):
        if labels is None:
            continue
        if not all(isinstance(label, str | int) for label in labels):
            raise InputError(f"{argument}: expected labels that name dofs, got {described(labels)}")
        places = [dof_index(argument, label, dofs) for label in labels]
        if sorted(places) != list(range(len(dofs))):
            raise InputError(
                f"{argument}: expected one label for each of {len(dofs)} dofs, got {described(labels)}"
            )
        array = np.asarray(array).take(np.argsort(places), axis)
    return array


def nearest(word: str, known: Sequence[str]) -> str:
    """Return the end of an error message that offers what a word may have meant."""
    plain = {name.casefold(): name for name in reversed(known)}
    close = difflib.get_close_matches(word.casefold(), plain, n=3, cutoff=0.6)
    if close:
        return f"; nearest: {', '.join(sorted((plain[name] for name in close), key=known.index))}"
    shown = ", ".join(known[:8])
    return f"; known: {shown}{', ...' if len(known) > 8 else ''}"


def described_direction(direction: Any, dofs: Sequence[str]) -> str:
    """Return a direction in the names of the dofs: ``x3``, or ``0.8 x1 + 0.6 x2``; ``none`` for None."""
    if direction is None:
        return "none"
    if isinstance(direction, str):
        return direction
    if isinstance(direction, Mapping):
        pairs = [(dofs[dof_index("direction", dof, dofs)], part) for dof, part in direction.items()]
    elif np.ndim(direction) == 0:
        return dofs[operator.index(direction)]
    else:
        pairs = list(zip(dofs, direction, strict=True))
    terms = [f"{part:g} {dof}" for dof, part in pairs if part]
    return " + ".join(terms if len(terms) <= 4 else [*terms[:3], "..."]).replace("+ -", "- ")


def _tangential(argument: str, value: Any, dofs: Sequence[str]) -> int | Real | list[tuple[int, float]]:
    """Return a tangential direction; `InputError` where two numbers are given as if for a plane."""
    direction = _direction(argument, value, dofs)
    if isinstance(direction, np.ndarray) and direction.size == 2 < len(dofs):
        raise InputError(
            f"{argument}: expected shape ({len(dofs)},), got (2,): numbers are entries of one direction, and "
            f"the two directions of a plane are names, like {tuple(dofs[:2])}, or vectors"
        )
    return direction


def _direction(argument: str, value: Any, dofs: Sequence[str]) -> int | Real | list[tuple[int, float]]:
    if isinstance(value, str):
        return dof_index(argument, value, dofs)
    if isinstance(value, Mapping):
        return _entries(argument, value, dofs)
    try:
        index = operator.index(value)
    except TypeError:
        return real_array(argument, value, 1)
    if isinstance(value, bool):
        raise InputError(f"{argument}: expected a dof index, a dof name or a vector, got {value!r}")
    return dof_index(argument, index, dofs)


def direction_entries(argument: str, value: Any, dofs: Sequence[str]) -> list[tuple[int, float]]:
    """Return the entries of a direction by the index of their dofs.

    Raise `InputError` if it is no index below n, no dof name, no vector (n,) and no mapping from dofs.
    """
    given = _direction(argument, value, dofs)
    if isinstance(given, np.ndarray):
        return entries_of(argument, given, dofs)
    return given if isinstance(given, list) else [(given, 1.0)]


def entries_of(argument: str, value: Any, dofs: Sequence[str]) -> list[tuple[int, float]]:
    """Return the entries of a load by the index of their dofs, given by dofs or as a vector.

    Raise `InputError` if it is neither, or has another number of entries than there are dofs.
    """
    if isinstance(value, Mapping):
        return _entries(argument, value, dofs)
    if np.ndim(value) == 0:
        raise InputError(f"{argument}: expected forces by dof or a vector, got {described(value)}")
    vector = real_array(argument, value, 1)
    if vector.shape != (len(dofs),):
        raise InputError(f"{argument}: expected shape ({len(dofs)},), got {vector.shape}")
    return [(k, entry) for k, entry in enumerate(vector.tolist()) if entry]


def _entries(argument: str, value: Mapping[Any, Any], dofs: Sequence[str]) -> list[tuple[int, float]]:
    """Return the entries of a direction that is given by some of them, by the index of their dofs."""
    entries: dict[int, float] = {}
    for dof, entry in value.items():
        if not isinstance(dof, str | int | np.integer) or isinstance(dof, bool):
            raise InputError(f"{argument}: expected dof indices or names as keys, got {dof!r}")
        index = dof_index(argument, dof if isinstance(dof, str) else int(dof), dofs)
        if index in entries:
            raise InputError(f"{argument}: {dof!r} names a dof that another key names too")
        entries[index] = real_number(f"{argument}: {dof}", entry)
    return sorted(entries.items())
