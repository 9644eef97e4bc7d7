"""Numbers of the laws of contacts by name: which contacts one concerns, how it is read and set."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.contact import LAW, SPRINGS, Contact, contact_labels, nearest
from stickslip.scene.laws.friction import Law

#: How the parameters of a law of friction begin, such as ``friction_kinetic``.
OF_LAW = "friction_"


def concerns(field: str, contact: Contact) -> bool:
    """Return whether a field of the law is about a contact: it has the directions that the field needs."""
    if field == "normal_force":
        return contact.normal is None
    if field in SPRINGS:
        return getattr(contact, field) is not None
    if field.startswith(OF_LAW):
        return has_parameter(contact, field)
    direction = contact.normal if field in ("restitution", "gap") else contact.tangential
    return direction is not None


def has_parameter(contact: Contact, field: str) -> bool:
    """Return whether the friction of a contact is a law with such a parameter."""
    law = contact.friction
    return isinstance(law, Law) and field.removeprefix(OF_LAW) in law.parameters()


def law_number(contact: Contact, field: str) -> Any:
    """Return a field of the contact law, or a parameter of its law of friction."""
    if field in LAW or not field.startswith(OF_LAW):
        return getattr(contact, field)
    return getattr(contact.friction, field.removeprefix(OF_LAW), None)


def with_law_number(contact: Contact, field: str, value: Any) -> Contact:
    """Return the contact with another value of it."""
    if field in LAW or not field.startswith(OF_LAW):
        return dataclasses.replace(contact, **{field: value})
    if not isinstance(contact.friction, Law) or not has_parameter(contact, field):
        return contact
    law = dataclasses.replace(contact.friction, **{field.removeprefix(OF_LAW): value})
    return dataclasses.replace(contact, friction=law)


def law_entry(contacts: Sequence[Contact], name: str) -> tuple[str, int | None]:
    """Return the field of the contact law that a name stands for, and whose it is; None: of all contacts.

    Raises
    ------
    InputError
        If it is no field of the contact law, with or without the index or the name of a contact.
    """
    laws = [one.friction for one in contacts if isinstance(one.friction, Law)]
    of_laws = list(dict.fromkeys(f"{OF_LAW}{parameter}" for law in laws for parameter in law.parameters()))
    if name in LAW or name in of_laws:
        return name, None
    # A contact whose name is a number goes before the contact of that index.
    labels = [(str(i), i) for i in range(len(contacts))]
    labels += [(str(label), i) for i, label in enumerate(contact_labels(contacts))]
    known = {
        f"{field}_{label}": (field, i)
        for field in (*of_laws, *LAW)
        for label, i in labels
        if concerns(field, contacts[i]) or field in LAW
    }
    if name in known:
        return known[name]
    raise InputError(
        f"{name}: a scene has no such parameter{nearest(name, [*LAW, *of_laws, *known])}; for others pass a"
        " function from parameters to a Scene"
    )


def check_laws_kept(contacts: Sequence[Contact], entry: str, place: int | None, value: Any = 0.0) -> None:
    """Refuse a number as friction of a contact whose friction is a law over slip speed.

    Raises
    ------
    InputError
        Naming the contact and the numbers of its law.
    """
    if entry != "friction" or isinstance(value, Law | Mapping):
        return
    for k, contact in enumerate(contacts):
        law = contact.friction
        if place in (None, k) and isinstance(law, Law) and law.data() is not None:
            suffix = f"_{k}" if len(contacts) > 1 else ""
            numbers = ", ".join(f"{OF_LAW}{name}{suffix}" for name in law.parameters())
            known = f"; its numbers are {numbers}" if numbers else "; a table has no numbers to vary"
            raise InputError(
                f"friction: a number would replace the law of contact {contact_labels(contacts)[k]}, "
                f"{law.law} over slip speed{known}; scene.replace(friction=...) gives a scene without the law"
            )


def per_contact(argument: str, value: Any, count: int) -> list[Any]:
    """Return a scalar, or a sequence of one value per contact, as a list of one value per contact.

    Raises
    ------
    InputError
        If the number of values is not `count`.
    """
    if isinstance(value, str):
        raise InputError(f"{argument}: expected a number, or one per contact, got {value!r}")
    if isinstance(value, Mapping):  # the table of a law
        return [value] * count
    try:
        values = list(value)
    except TypeError:
        return [value] * count
    if len(values) != count:
        raise InputError(
            f"{argument}: expected a scalar or one value per contact ({count}), got {len(values)}: {value!r}"
        )
    return values


def changed_laws(
    contacts: Sequence[Contact], changes: Mapping[str, Any], known: Sequence[str]
) -> dict[str, list[Any]]:
    """Return the changed fields of the contact law, one value per contact each.

    Parameters
    ----------
    contacts
        The contacts.
    changes
        Fields of the contact law, or of one contact of them, by name.
    known
        What else could have been meant by a name that is none.

    Raises
    ------
    InputError
        If a name is unknown, two set the same number, or the number of values is not the number of contacts.
    """
    law: dict[str, list[Any]] = {}
    setting: dict[tuple[str, int], str] = {}
    for name, value in changes.items():
        try:
            field, place = law_entry(contacts, name)
        except InputError:
            raise InputError(f"replace: unknown field {name!r}{nearest(name, [*known, *LAW])}") from None
        values = law.setdefault(field, [law_number(contact, field) for contact in contacts])
        given = per_contact(name, value, len(contacts) if place is None else 1)
        places = range(len(contacts)) if place is None else [place]
        if place is None and np.ndim(value) == 0:
            places = [k for k in places if concerns(field, contacts[k])]
        if not places:
            raise InputError(f"replace: no contact of the scene takes {name!r}")
        for k in places:
            if (field, k) in setting:
                raise InputError(f"replace: {name!r} and {setting[field, k]!r} set the same number")
            setting[field, k] = name
            values[k] = given[k if place is None else 0]
    return law


def law_numbers(contacts: Sequence[Contact], fields: Iterable[str]) -> dict[str, float | None]:
    """Return fields of the law of every contact by the names of single parameters."""
    several = len(contacts) > 1
    found: dict[str, float | None] = {}
    for name in fields:
        for k, contact in enumerate(contacts):
            if name in ("normal_force", *SPRINGS) and not concerns(name, contact):
                continue
            law = contact.friction if name == "friction" else None
            names = [f"{OF_LAW}{one}" for one in law.parameters()] if isinstance(law, Law) else [name]
            for one in names:
                found[f"{one}_{k}" if several else one] = law_number(contact, one)
    return found
