"""What identifies a value or a function from one process to the next, as far as that can be known."""

from __future__ import annotations

import dis
import hashlib
import inspect
import io
import json
import pickle
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from stickslip.scene.models import Link, Subsystem

#: Letters of a hash that are kept: 64 bits.
KEPT = 16
#: Entries of an array up to which it is described by its values.
LISTED = 100
#: Functions, classes and objects that are described already, by id; a second time their name is enough.
Seen = dict[int, Any]


def described_function(function: Callable[..., Any], seen: Seen | None = None) -> dict[str, Any]:
    """Return name, hash of the source and, where it has any, what a function carries along and reads.

    It carries the arguments of a partial, defaults, values of enclosing functions, and the instance of a
    method or callable. A function of the user's own modules also reads global values, and calls other
    functions of those modules, which are described in the same way. Modules that it imports itself, and
    installed packages, are not looked into.
    """
    seen = {} if seen is None else seen
    seen[id(function)] = function
    if isinstance(function, partial):
        given = {"arguments": [*function.args, dict(function.keywords)]}
        return described_function(function.func, seen) | fingerprints(given, seen)
    # A decorated function holds the inner one among its enclosed values; compiled wrappers do not.
    inner = function if hasattr(function, "__code__") else inspect.unwrap(function)
    named = inner if hasattr(inner, "__qualname__") else type(inner)
    carried: dict[str, Any] = {}
    cells = getattr(inner, "__closure__", None) or ()
    if cells:
        names = inner.__code__.co_freevars
        carried["enclosed"] = {name: _content(cell) for name, cell in zip(names, cells, strict=True)}
    for key in ("__defaults__", "__kwdefaults__"):
        if value := getattr(inner, key, None):
            carried[key.strip("_")] = value
    if inspect.ismethod(inner):
        carried["instance"] = inner.__self__
        inner = inner.__func__
    if isinstance(inner, FunctionType) and _is_own(inner) and (read := dict(sorted(_read(inner)))):
        carried["reads"] = read
    has_source = hasattr(inner, "__code__") or isinstance(inner, type)
    return {
        "name": f"{named.__module__}.{named.__qualname__}",
        "source": _source(inner if has_source else type(inner)),
        **fingerprints(carried, seen),
        **({} if hasattr(inner, "__code__") else {"instance": _described_object(inner, seen)}),
    }


def fingerprints(values: Mapping[str, Any], seen: Seen | None = None) -> dict[str, Any]:
    """Return `fingerprint` of every value, in the order of the names."""
    seen = {} if seen is None else seen
    return {str(name): fingerprint(values[name], seen) for name in sorted(values, key=str)}


def fingerprint(value: Any, seen: Seen | None = None) -> Any:
    """Return a value as plain numbers and words where it is made of those, else its type and a hash."""
    seen = {} if seen is None else seen
    if isinstance(value, str | int | float | bool | None):
        return value
    if isinstance(value, np.ndarray | np.generic):
        whole = [str(value.dtype), list(value.shape), digest(value.tobytes())]
        return value.tolist() if value.size <= LISTED else whole
    if isinstance(value, Subsystem | Link):
        return dict(vars(value))
    if id(value) in seen:
        return getattr(value, "__qualname__", type(value).__qualname__)
    if isinstance(value, list | Mapping):
        # One may hold itself.
        seen[id(value)] = value
    if isinstance(value, list | tuple):
        return [fingerprint(entry, seen) for entry in value]
    if isinstance(value, set | frozenset):
        # The order of a set is another one in every process.
        return sorted((fingerprint(entry, seen) for entry in value), key=json.dumps)
    if isinstance(value, Mapping):
        return fingerprints(value, seen)
    if inspect.isroutine(value) or isinstance(value, partial):
        return described_function(value, seen)
    return _described_object(value, seen)


def digest(data: bytes) -> str:
    """Return a hash."""
    return hashlib.sha256(data).hexdigest()[:KEPT]


def _described_object(value: Any, seen: Seen) -> Any:
    """Return class and attributes of an object of the user, else the type and a hash of what is pickled."""
    if isinstance(value, type) and _is_own(value):
        return _described_class(value, seen)
    if _is_own(type(value)) and hasattr(value, "__dict__"):
        seen[id(value)] = value
        return {"class": fingerprint(type(value), seen), **fingerprints(vars(value), seen)}
    try:
        stream = io.BytesIO()
        _Ordered(stream, seen).dump(value)
        return [type(value).__name__, digest(stream.getvalue())]
    # Whatever refuses to be pickled, in its own way.
    except Exception:
        return [type(value).__name__]


def _described_class(kind: type, seen: Seen) -> dict[str, Any]:
    """Return name and source of a class of the user, its functions and values, and the classes below it."""
    seen[id(kind)] = kind
    held = {}
    for name, value in vars(kind).items():
        function = next(
            (inner for key in ("__func__", "fget", "func") if (inner := getattr(value, key, None))), value
        )
        if isinstance(function, FunctionType) or not name.startswith("__"):
            held[name] = function
    bases = [base for base in kind.__bases__ if _is_own(base)]
    return {
        "name": f"{kind.__module__}.{kind.__qualname__}",
        "source": _source(kind),
        **fingerprints({"holds": held, "bases": bases}, seen),
    }


def _is_own(thing: Any) -> bool:
    """Return whether a function, class or module is the user's: not Python's, not installed, not ours."""
    name = thing.__name__ if isinstance(thing, ModuleType) else getattr(thing, "__module__", None)
    root = str(name or "builtins").partition(".")[0]
    if root in sys.stdlib_module_names or root == "stickslip":
        return False
    file = getattr(sys.modules.get(str(name)), "__file__", None)
    return file is None or not {"site-packages", "dist-packages"} & set(Path(file).parts)


def _read(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Give name and value of what a function reads from its module and, by a dot, from other own modules."""
    instructions = [one for code in _codes(function.__code__) for one in dis.get_instructions(code)]
    assigned = {one.argval for one in instructions if one.opname == "STORE_GLOBAL"}
    for k, one in enumerate(instructions):
        name = one.argval
        if one.opname not in ("LOAD_GLOBAL", "LOAD_NAME") or name not in function.__globals__:
            continue
        value = function.__globals__[name]
        for after in instructions[k + 1 :]:
            if not isinstance(value, ModuleType) or after.opname not in ("LOAD_ATTR", "LOAD_METHOD"):
                break
            value, name = getattr(value, after.argval, None), f"{name}.{after.argval}"
        # What a function assigns itself is no constant.
        if one.argval not in assigned and not isinstance(value, ModuleType) and _counts(value):
            yield name, value


def _counts(value: Any) -> bool:
    """Return whether a value can change while the versions of all packages stay."""
    is_code = inspect.isroutine(value) or isinstance(value, type)
    return not is_code or _is_own(value)


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Give a code and those inside it."""
    yield code
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _codes(one)


def _source(body: Any) -> str:
    # Of a function its own code: its source would be that of the function it wraps.
    code = getattr(body, "__code__", None)
    try:
        source = inspect.getsource(code or body)
    except (OSError, TypeError):
        source = "" if code is None else repr(_plain_code(code))
    return digest(source.encode())


class _Ordered(pickle.Pickler):
    """Pickles with sets and mappings in the order of their texts: that of hashes changes with the process."""

    def __init__(self, stream: io.BytesIO, seen: Seen) -> None:
        super().__init__(stream)
        self.seen = seen

    def persistent_id(self, value: Any) -> Any:
        """Return what stands for a set or a mapping, None for anything else."""
        return repr(fingerprint(value, self.seen)) if type(value) in (set, frozenset, dict) else None


def _plain_code(code: CodeType) -> tuple[Any, ...]:
    def plain(constant: Any) -> Any:
        # The repr of a code object holds its address, that of a set has the order of hashes.
        if isinstance(constant, CodeType):
            return _plain_code(constant)
        return sorted(map(repr, constant)) if isinstance(constant, frozenset) else repr(constant)

    return (code.co_code, code.co_names, [plain(constant) for constant in code.co_consts])


def _content(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not bound yet
        return None
