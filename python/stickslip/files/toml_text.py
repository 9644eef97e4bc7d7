"""TOML by tomlkit: tables as text that `tomllib` reads back to the same values, floats to the last bit."""

from __future__ import annotations

import numbers
import tomllib
from collections.abc import Mapping, MutableMapping, Sequence
from typing import Any

import numpy as np
import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Array, Table, Trivia, Whitespace

from stickslip.faults import InputError


class Inline(dict[str, Any]):
    """A table that is written in one line."""


def toml_text(tables: Mapping[str, Any], older: str = "") -> str:
    """Return tables as TOML: mappings become tables, sequences of mappings arrays of tables.

    `older` is a text of which comments, order and form stay wherever its keys and values do; one that is no
    TOML is replaced.
    """
    new = tomlkit.document()
    _update(new, tables, ())
    try:
        document = tomlkit.parse(older)
        _update(document, tables, ())
        text = tomlkit.dumps(document)
        # Of a table that had only tables in it, tomlkit forgets the name with the last of them.
        return text if tomllib.loads(text) == new.unwrap() else tomlkit.dumps(new)
    except TOMLKitError:
        return tomlkit.dumps(new)


def _update(table: MutableMapping[str, Any], values: Mapping[str, Any], path: tuple[str, ...]) -> None:
    for key in [key for key in table if key not in values]:
        del table[key]
    for key, value in values.items():
        place = (*path, key)
        item = _item(".".join(place), value, isinstance(value, Inline))
        present = table.get(key)
        if isinstance(item, Table) and isinstance(present, Table):
            _update(present, value, place)
        elif repr(present) != repr(item):
            # A text without a form in UTF-8 is no key either.
            table[_encoded("key", key)] = item


def _item(place: str, value: Any, inline: bool) -> Any:
    """Return a value as tomlkit writes it; within a line tables are in it, too."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        table = tomlkit.inline_table() if inline else tomlkit.table()
        for key, entry in value.items():
            table[_encoded("key", key)] = _item(f"{place}.{key}", entry, inline or isinstance(entry, Inline))
        return table
    if isinstance(value, str):
        return tomlkit.string(_encoded(place, value))
    if isinstance(value, Sequence):
        if value and not inline and all(isinstance(entry, Mapping) for entry in value):
            tables = tomlkit.aot()
            for entry in value:
                tables.append(_item(place, dict(entry), False))
            return tables
        return _array([_item(place, entry, True) for entry in value])
    if isinstance(value, bool | int):
        return tomlkit.item(value)
    if isinstance(value, numbers.Real):
        return tomlkit.item(float(value))
    raise InputError(f"{place}: {value!r} has no form in TOML")


def _array(entries: list[Any]) -> Array:
    """Return an array, the rows of a matrix in a line each; put together at once, not in quadratic time."""
    matrix = any(isinstance(entry, Array) for entry in entries)
    before, last = ("\n  ", ",\n") if matrix else (" ", "")
    parts: list[Any] = []
    for k, entry in enumerate(entries):
        parts += [Whitespace(before if k or matrix else ""), entry, Whitespace(",")]
    return Array([*parts[:-1], Whitespace(last)], Trivia())


def _encoded(place: str, value: str) -> str:
    try:
        value.encode()
    except UnicodeEncodeError:
        raise InputError(f"{place}: {value!r} is no text that a file can hold") from None
    return value
