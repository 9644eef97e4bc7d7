"""TOML as text: what `tomllib` reads back to the same values, floats to the last bit."""

from __future__ import annotations

import numbers
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stickslip.faults import InputError

BARE = re.compile(r"[A-Za-z0-9_-]+")
#: Longest line of an array of numbers; longer ones are wrapped.
WIDTH = 100
ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables as TOML: mappings become tables, sequences of mappings arrays of tables.

    Raises
    ------
    InputError
        If a value has no form in TOML, or a text cannot be encoded.
    """
    return "\n".join(_lines(tables, ())).lstrip("\n") + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    lines, later = [], []
    for key, value in table.items():
        if isinstance(value, Mapping) and not isinstance(value, Inline):
            later += ["", f"[{_path((*path, key))}]", *_lines(value, (*path, key))]
        elif isinstance(value, Sequence) and not isinstance(value, str) and _are_tables(value):
            for entry in value:
                later += ["", f"[[{_path((*path, key))}]]", *_lines(entry, (*path, key))]
        else:
            lines.append(f"{_key(key)} = {_value(f'{_path((*path, key))}', value)}")
    return lines + later


class Inline(dict[str, Any]):
    """A table that is written in one line."""


def _are_tables(values: Sequence[Any]) -> bool:
    return len(values) > 0 and all(isinstance(value, Mapping) for value in values)


def _value(place: str, value: Any) -> str:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, str):
        return _text(place, value)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(k)} = {_value(place, v)}' for k, v in value.items())} }}"
    if isinstance(value, Sequence):
        return _array([_value(place, entry) for entry in value])
    raise InputError(f"{place}: {value!r} has no form in TOML")


def _array(entries: list[str]) -> str:
    """Write numbers in lines of `WIDTH`, the rows of a matrix in a line each where they fit."""
    short = f"[{', '.join(entries)}]"
    if len(short) <= WIDTH and not any(entry.startswith("[") for entry in entries):
        return short
    lines = [""]
    for entry in entries:
        if lines[-1] and (entry.startswith("[") or len(lines[-1]) + len(entry) > WIDTH):
            lines.append("")
        lines[-1] += f"{' ' if lines[-1] else ''}{entry},"
    body = "\n".join(lines).replace("\n", "\n  ")
    return f"[\n  {body}\n]"


def _path(keys: tuple[str, ...]) -> str:
    return ".".join(_key(key) for key in keys)


def _key(key: str) -> str:
    return key if BARE.fullmatch(key) else _text("key", key)


def _text(place: str, value: str) -> str:
    try:
        value.encode()
    except UnicodeEncodeError:
        raise InputError(f"{place}: {value!r} is no text that a file can hold") from None
    escaped = (
        ESCAPES.get(letter) or (f"\\u{ord(letter):04x}" if ord(letter) < 32 or ord(letter) == 127 else letter)
        for letter in value
    )
    return f'"{"".join(escaped)}"'
