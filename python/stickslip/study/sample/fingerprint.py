"""What identifies a value or a function from one process to the next, as far as that can be known."""

from __future__ import annotations

import hashlib
import inspect
import io
import pickle
from collections.abc import Callable, Mapping
from functools import partial
from types import CodeType
from typing import Any

import numpy as np

from stickslip.scene.models import Link, Subsystem

#: Letters of a hash that are kept: 64 bits.
KEPT = 16
#: Entries of an array up to which it is described by its values.
LISTED = 100


def described_function(function: Callable[..., Any], inside: tuple[int, ...] = ()) -> dict[str, Any]:
    """Return name, hash of the source and, where it has any, what a function carries along.

    That is the arguments of a partial, defaults, values of enclosing functions, and the instance of a method
    or callable; not what it reads from its module, nor the functions that it calls.
    """
    if isinstance(function, partial):
        given = {"arguments": [*function.args, dict(function.keywords)]}
        return described_function(function.func, inside) | fingerprints(given, inside)
    inner = inspect.unwrap(function)
    named = inner if hasattr(inner, "__qualname__") else type(inner)
    body = inner if hasattr(inner, "__code__") or inspect.ismethod(inner) else type(inner)
    try:
        source = inspect.getsource(body)
    except (OSError, TypeError):
        code = getattr(body, "__code__", None)
        source = "" if code is None else repr(_plain_code(code))
    carried: dict[str, Any] = {}
    cells = getattr(inner, "__closure__", None) or ()
    if cells:
        carried["enclosed"] = [_content(cell) for cell in cells]
    for key in ("__defaults__", "__kwdefaults__"):
        if value := getattr(inner, key, None):
            carried[key.strip("_")] = value
    if inspect.ismethod(inner):
        carried["instance"] = inner.__self__
    elif body is not inner:
        carried["instance"] = inner
    return {
        "name": f"{named.__module__}.{named.__qualname__}",
        "source": digest(source.encode()),
        **fingerprints(carried, (*inside, id(function))),
    }


def fingerprints(values: Mapping[str, Any], inside: tuple[int, ...] = ()) -> dict[str, Any]:
    """Return `fingerprint` of every value, in the order of the names."""
    return {str(name): fingerprint(values[name], inside) for name in sorted(values, key=str)}


def fingerprint(value: Any, inside: tuple[int, ...] = ()) -> Any:
    """Return a value as plain numbers and words where it is made of those, else its type and a hash.

    `inside` holds the ids of the functions and objects whose values these are: one may enclose itself.
    """
    if isinstance(value, str | int | float | bool | None):
        return value
    if isinstance(value, np.ndarray | np.generic):
        whole = [str(value.dtype), list(value.shape), digest(value.tobytes())]
        return value.tolist() if value.size <= LISTED else whole
    if isinstance(value, Subsystem | Link):
        return dict(vars(value))
    if isinstance(value, list | tuple):
        return [fingerprint(entry, inside) for entry in value]
    if isinstance(value, Mapping):
        return fingerprints(value, inside)
    if isinstance(value, set | frozenset):
        return sorted((fingerprint(entry, inside) for entry in value), key=repr)
    if id(value) in inside:
        return "itself"
    if inspect.isroutine(value) or isinstance(value, partial):
        return described_function(value, inside)
    try:
        stream = io.BytesIO()
        _Ordered(stream, (*inside, id(value))).dump(value)
        return [type(value).__name__, digest(stream.getvalue())]
    # Whatever refuses to be pickled, in its own way.
    except Exception:
        return [type(value).__name__]


class _Ordered(pickle.Pickler):
    """Pickles with sets and mappings in the order of their texts: that of hashes changes with the process."""

    def __init__(self, stream: io.BytesIO, inside: tuple[int, ...]) -> None:
        super().__init__(stream)
        self.inside = inside

    def persistent_id(self, value: Any) -> Any:
        """Return what stands for a set or a mapping, None for anything else."""
        return repr(fingerprint(value, self.inside)) if type(value) in (set, frozenset, dict) else None


def digest(data: bytes) -> str:
    """Return a hash."""
    return hashlib.sha256(data).hexdigest()[:KEPT]


def _plain_code(code: CodeType) -> tuple[Any, ...]:
    # The repr of a code object holds its address.
    inner = [_plain_code(one) if isinstance(one, CodeType) else repr(one) for one in code.co_consts]
    return (code.co_code, code.co_names, inner)


def _content(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not bound yet
        return None
