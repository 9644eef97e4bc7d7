"""Scene files: a scene as TOML, its large matrices in files beside it.

`[scene]` has the arguments of `Scene`, its `[[scene.contact]]`, `[[scene.load]]` and `[[scene.element]]`; or
`[model]` has the name of a function of `stickslip.models` and its arguments. A matrix is rows of numbers,
``{ file = "k.npz", name = "K" }`` relative to the scene file, or ``{ shape = [n, n], row = [...], column =
[...], value = [...] }`` if it is sparse.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import operator
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from stickslip.faults import InputError
from stickslip.files.toml_text import Inline
from stickslip.scene import models
from stickslip.scene.arrays.matrix_file import Header, matrix_header, read_matrix, write_matrix
from stickslip.scene.checks import Real, check_memory, described, real_array, real_number
from stickslip.scene.contact import Contact, nearest
from stickslip.scene.elements import Damper, Element, Spring
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.laws.law import OneVariableLaw
from stickslip.scene.loads.in_time import Harmonic, Load, Switched
from stickslip.scene.scene import Scene

#: Numbers of a matrix up to which it is written into the scene file itself.
INLINE = 600
#: Arguments of `Scene` that are matrices or vectors.
MATRICES = ("mass", "stiffness", "damping", "gyroscopic", "circulatory", "force")
SCENE_KEYS = (*MATRICES, "dofs", "impact_friction", "contact", "load", "element")
CONTACT_KEYS = tuple(field.name for field in dataclasses.fields(Contact))
ELEMENTS = {kind.kind: kind for kind in (Spring, Damper)}
HARMONIC_KEYS, STEPS_KEYS = (
    tuple(field.name for field in dataclasses.fields(kind)) for kind in (Harmonic, Switched)
)

Matrices = Literal["auto", "inline", "npz", "mat", "mtx"]
RANGE_KEYS = ("from", "to", "count")


def read_tables(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"{path}: expected a regular file")
    try:
        # Some editors begin a file with the mark of its byte order.
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: no valid TOML: {error}") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None


@contextmanager
def located(place: str) -> Iterator[None]:
    """Put the file and the section in front of what an `InputError` says."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}") from None


def known(place: str, table: Any, keys: tuple[str, ...], needs: tuple[str, ...] = ()) -> None:
    """Refuse a table with other keys than `keys`, or without one of `needs`."""
    if not isinstance(table, Mapping):
        raise InputError(f"{place}: expected a table, got {table!r}")
    for key, value in table.items():
        if key not in keys:
            # A table or a list is too long for a message.
            shown = "" if isinstance(value, Mapping | list) else f" (= {value!r})"
            raise InputError(f"{place}: unknown key {key!r}{shown}{nearest(key, keys)}")
    for key in needs:
        if key not in table:
            raise InputError(f"{place}: {key} is missing")


def scene_from(path: Path, table: dict[str, Any]) -> Scene:
    """Return the scene of a table `[scene]`."""
    known(f"{path}: [scene]", table, SCENE_KEYS, ("mass", "stiffness"))
    contacts = _tables(f"{path}: [scene]", "scene", "contact", table)
    for i, contact in enumerate(contacts):
        # A stop has no tangential direction and no friction.
        needs = ("normal",) if "tangential" not in contact else ("tangential", "friction")
        known(f"{path}: contact {i}", contact, CONTACT_KEYS, needs)
    _check_sizes(path, table)
    arguments = {key: _matrix(path, key, table[key]) for key in MATRICES if key in table}
    loads, elements = (_tables(f"{path}: [scene]", "scene", key, table) for key in ("load", "element"))
    with located(f"{path}: [scene]"):
        return Scene(
            **arguments,
            contacts=[_contact(path, i, contact) for i, contact in enumerate(contacts)],
            dofs=table.get("dofs"),
            impact_friction=table.get("impact_friction", False),
            loads=[_load(path, i, load) for i, load in enumerate(loads)],
            elements=[_element(path, i, element) for i, element in enumerate(elements)],
        )


def _tables(place: str, section: str, key: str, table: Mapping[str, Any]) -> list[Any]:
    """Return the tables of one name in a section; none: an empty list."""
    found = table.get(key, [])
    if not isinstance(found, list):
        raise InputError(f"{place}: {key}: expected tables [[{section}.{key}]], got {found!r}")
    return found


def _check_sizes(path: Path, table: Mapping[str, Any]) -> None:
    """Refuse matrices of other sizes than the dofs, by what they say of themselves, before any is made."""
    given = {key: header for key in MATRICES if (header := _header(path, key, table.get(key)))}
    listed = [len(table[key]) for key in ("dofs", *MATRICES) if isinstance(table.get(key), list)]
    sizes = listed or [max(header.shape, default=1) for header in given.values()]
    for key, header in given.items():
        size = sizes[0]
        if max(header.shape, default=1) != size or math.prod(header.shape) not in (size, size**2):
            place = f"{path}: [scene]: {key}"
            raise InputError(f"{place}: expected {size} rows, one per dof, got shape {header.shape}")
    # An entry is in one row and one column, and every dof has one in some matrix.
    entries = sum(header.entries for header in given.values())
    if not listed and sizes and 2 * entries < sizes[0]:
        raise InputError(f"{path}: [scene]: {sizes[0]} rows, but {entries} entries in all matrices")


def _header(path: Path, key: str, value: Any) -> Header | None:
    """Return what a matrix of entries or of a file says of itself; None: there is none, or no such table."""
    if not isinstance(value, dict):
        return None
    if isinstance(value.get("file"), str):
        with located(f"{path}: [scene]: {key}"):
            return matrix_header(path.parent / value["file"], value.get("name"), key)
    shape, entries = value.get("shape"), value.get("value")
    if isinstance(entries, list) and isinstance(shape, list) and all(type(one) is int for one in shape):
        return Header(tuple(shape), len(entries))
    return None


def _contact(path: Path, place: int, table: dict[str, Any]) -> Contact:
    given = dict(table)
    if "slider_vibration" in given:
        wave = given["slider_vibration"]
        known(f"{path}: contact {place}: slider_vibration", wave, HARMONIC_KEYS, HARMONIC_KEYS[:2])
        given["slider_vibration"] = Harmonic(**wave)
    return Contact(**given)


def _load(path: Path, place: int, table: Any) -> Load:
    """Return a load: a harmonic one where there is a frequency, else a switched one."""
    where = f"{path}: load {place}"
    keys = (*HARMONIC_KEYS, *STEPS_KEYS[1:3])
    known(where, table, keys)
    if "frequency" in table:
        known(where, table, HARMONIC_KEYS, HARMONIC_KEYS[:2])
        return Harmonic(**table)
    known(where, table, STEPS_KEYS, STEPS_KEYS[:3])
    return Switched(**table)


def _element(path: Path, place: int, table: Any) -> Element:
    """Return a spring or a damper."""
    where = f"{path}: element {place}"
    known(where, table, ("kind", "direction", "law", "offset", "name"), ("kind", "direction", "law"))
    given = dict(table)
    kind = ELEMENTS.get(given.pop("kind"))
    if kind is None:
        raise InputError(f"{where}: kind: expected one of {', '.join(ELEMENTS)}, got {table['kind']!r}")
    if kind is Damper and "offset" in given:
        raise InputError(f"{where}: offset: a damper has none")
    with located(where):
        return kind(**given)


def model_from(path: Path, table: dict[str, Any]) -> Callable[..., Scene]:
    """Return the model function of a table `[model]` with the parameters that stand there."""
    place = f"{path}: [model]"
    if not isinstance(table, Mapping) or "name" not in table:
        raise InputError(f"{place}: name is missing; known: {', '.join(models.MODELS)}")
    name = table["name"]
    if name not in models.MODELS:
        raise InputError(f"{place}: name: unknown model {name!r}{nearest(str(name), list(models.MODELS))}")
    model = models.MODELS[name]
    given = {key: value for key, value in table.items() if key != "name"}
    lists = {"subsystems": ("subsystem", models.Subsystem), "links": ("link", models.Link)}
    keys = [lists.get(key, (key,))[0] for key in inspect.signature(model).parameters]
    known(place, given, tuple(keys))
    for argument, (key, kind) in lists.items():
        if key in keys:
            given[argument] = _entries(place, key, _tables(place, "model", key, given), kind)
            given.pop(key, None)
    return partial(model, **given)


def _entries(place: str, key: str, entries: list[Any], kind: Any) -> list[Any]:
    """Return the subsystems or links of a chain."""
    fields = dataclasses.fields(kind)
    needs = tuple(field.name for field in fields if field.default is dataclasses.MISSING)
    for i, entry in enumerate(entries):
        known(f"{place}: {key} {i}", entry, tuple(field.name for field in fields), needs)
    return [kind(**entry) for entry in entries]


def _matrix(path: Path, key: str, value: Any) -> Any:
    """Return a matrix or vector from rows, a file, entries, or the factors of proportional damping."""
    if not isinstance(value, dict):
        return value
    place = f"{path}: [scene]: {key}"
    if "file" in value:
        known(place, value, ("file", "name"))
        if not isinstance(value["file"], str):
            raise InputError(f"{place}: file: expected a name, got {value['file']!r}")
        with located(place):
            return read_matrix(path.parent / value["file"], value.get("name"), key)
    if "shape" in value:
        parts = ("shape", "row", "column", "value")
        known(place, value, parts, parts)
        try:
            entries = real_array(f"{place}: value", value["value"], 1)
            indices = [_places(f"{place}: {part}", value[part]) for part in ("row", "column")]
            return scipy.sparse.csr_array((entries, indices), shape=tuple(value["shape"]))
        except (ValueError, TypeError, OverflowError) as error:
            raise InputError(f"{place}: no sparse matrix: {error}") from None
    if key != "damping":
        raise InputError(f"{place}: expected rows of numbers or a table with file or shape, got {value!r}")
    known(place, value, ("mass", "stiffness", "file", "shape"))
    return Rayleigh(**value)


def _places(place: str, given: Any) -> NDArray[np.int64]:
    """Return rows or columns of entries."""
    found = real_array(place, given, 1)
    if (found != np.round(found)).any():
        raise InputError(f"{place}: expected whole numbers, got {described(given)}")
    return found.astype(np.int64)


def scene_table(scene: Scene, path: Path, matrices: Matrices) -> dict[str, Any]:
    """Return the table `[scene]` of a scene; writes what is too large for it to files beside `path`."""
    table: dict[str, Any] = {"dofs": list(scene.dofs)}
    for key in MATRICES:
        value = getattr(scene, key)
        if isinstance(value, Rayleigh):
            table[key] = Inline(mass=value.mass, stiffness=value.stiffness)
        elif value is not None:
            table[key] = _written(path, key, value, matrices)
    table["impact_friction"] = scene.impact_friction
    if scene.loads:
        table["load"] = [_load_table(load, scene.dofs) for load in scene.loads]
    if scene.elements:
        table["element"] = [_element_table(one, scene.dofs) for one in scene.elements]
    table["contact"] = [
        {
            key: _contact_entry(key, value, scene.dofs)
            for key in CONTACT_KEYS
            if (value := getattr(contact, key)) is not None
        }
        for contact in scene.contacts
    ]
    return table


def _contact_entry(key: str, value: Any, dofs: Sequence[str]) -> Any:
    if key in ("tangential", "normal"):
        return _named(value, dofs)
    if isinstance(value, OneVariableLaw):
        return Inline(value.table())
    return Inline(_load_table(value, dofs)) if isinstance(value, Harmonic) else value


def _element_table(element: Element, dofs: Sequence[str]) -> dict[str, Any]:
    table = {"kind": element.kind, "direction": _named(element.direction, dofs)}
    table["law"] = Inline(element.law.table())
    offset = getattr(element, "offset", 0.0)
    return table | ({"offset": offset} if offset else {}) | ({"name": element.name} if element.name else {})


def _load_table(load: Load, dofs: Sequence[str]) -> dict[str, Any]:
    entries = {field.name: getattr(load, field.name) for field in dataclasses.fields(load)}
    if np.ndim(load.amplitude) or isinstance(load.amplitude, Mapping):
        entries["amplitude"] = _named(load.amplitude, dofs)
    given = {key: value for key, value in entries.items() if value is not None}
    return {key: list(value) if isinstance(value, tuple) else value for key, value in given.items()}


def _named(direction: Any, dofs: Sequence[str]) -> Any:
    """Return a direction along one dof as the name of the dof, and entries by the names of their dofs."""
    if isinstance(direction, Mapping):
        return Inline({dof if isinstance(dof, str) else dofs[dof]: entry for dof, entry in direction.items()})
    return (
        dofs[operator.index(direction)]
        if np.ndim(direction) == 0 and not isinstance(direction, str)
        else direction
    )


def _written(path: Path, key: str, value: Any, matrices: Matrices) -> Any:
    sparse = scipy.sparse.issparse(value)
    # A vector has no form of its own in .mat and .mtx where it has one entry.
    inline = matrices == "inline" or value.shape == (1,)
    if matrices == "auto":
        inline = (3 * value.nnz if sparse else value.size) <= INLINE
    if not inline:
        kind = "npz" if matrices == "auto" else matrices
        beside = path.with_name(f"{path.stem}.{key}.{kind}")
        write_matrix(beside, key, value)
        return Inline(file=beside.name)
    if not sparse:
        return value
    entries = scipy.sparse.coo_array(value)
    return {
        "shape": list(entries.shape),
        "row": entries.coords[0],
        "column": entries.coords[1],
        "value": entries.data,
    }


def parameter_values(name: str, value: Any) -> Real:
    """Return the values of a parameter, (k,), from numbers or from ``{from, to, count}``."""
    if isinstance(value, Mapping):
        known(name, value, RANGE_KEYS, RANGE_KEYS)
        count = value["count"]
        if not isinstance(count, int) or isinstance(count, bool) or count < 2:
            raise InputError(f"{name}: count: expected an integer >= 2, got {described(count)}")
        # Each value is a scene, with one pair of modes at least.
        check_memory(f"{name}: count", 16 * count, count)
        first, last = (real_number(f"{name}: {key}", value[key]) for key in ("from", "to"))
        if not np.isfinite([first, last]).all():
            raise InputError(f"{name}: from and to must be finite, got {first:g} and {last:g}")
        return np.linspace(first, last, count)
    if isinstance(value, str) or not np.iterable(value):
        raise InputError(f"{name}: expected values or {{ from, to, count }}, got {value!r}")
    return np.array([real_number(name, one) for one in value])
