"""Bodies from files: CalculiX, Abaqus, Nastran, Ansys, Harwell-Boeing, Matrix Market, `.npz`, `.mat`."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io
import scipy.sparse

from stickslip.faults import InputError
from stickslip.fe.body import Body
from stickslip.fe.formats.bulk import BULK, bulk_constraints
from stickslip.fe.formats.cards import deck_constraints
from stickslip.fe.formats.constraints import Constraints, constrained
from stickslip.fe.formats.deck import numbered_mesh
from stickslip.fe.formats.entries import (
    Entries,
    check_triangles,
    coordinates,
    read_lines,
    symmetric_parts,
    table,
    whole,
)
from stickslip.fe.formats.harwell_boeing import read_harwell_boeing, read_mapping
from stickslip.fe.formats.punch import read_punch
from stickslip.scene.arrays.matrix_file import array_headers, read_array, readable
from stickslip.scene.checks import described
from stickslip.scene.contact import nearest
from stickslip.scene.laws.damping import Rayleigh

#: What a file holds by the end of its name: CalculiX, and Abaqus with the number of the step.
CALCULIX = {".sti": "stiffness", ".mas": "mass"}
ABAQUS = {"STIF": "stiffness", "MASS": "mass", "DMPV": "damping"}
#: Files that hold several arrays by name.
ARCHIVES = (".npz", ".mat", ".op4", ".pch")
#: Harwell-Boeing, also by the name that Ansys gives it.
HARWELL_BOEING = (".rsa", ".rua", ".hb", ".matrix")
#: Names of arrays in an archive; the last ones are those of Nastran.
ARRAYS = {
    "mass": ("mass", "M", "MAA", "MGG", "MAAX"),
    "stiffness": ("stiffness", "K", "KAA", "KGG", "KAAX"),
    "damping": ("damping", "C", "BAA", "BGG", "BAAX"),
    "gyroscopic": ("gyroscopic", "G"),
    "circulatory": ("circulatory", "H"),
}
#: Factors to SI of the units of length, mass and stiffness.
UNITS = {"m-kg-s": (1.0, 1.0, 1.0), "mm-t-s": (1e-3, 1e3, 1e3)}
#: A diagonal entry from which on a dof of an Abaqus matrix is constrained (it writes 1e36).
CONSTRAINED = 1e35


class Found(NamedTuple):
    """A matrix of a file: with the names of its dofs, if the file has them."""

    matrix: scipy.sparse.csr_array
    dofs: tuple[str, ...] | None
    note: str


def read(
    *files: str | Path,
    mass: str | Path | None = None,
    stiffness: str | Path | None = None,
    damping: Any = None,
    gyroscopic: str | Path | None = None,
    circulatory: str | Path | None = None,
    dofs: str | Path | Sequence[str] | None = None,
    points: Any = None,
    mesh: Any = None,
    surfaces: Any = None,
    units: str = "m-kg-s",
    name: str | None = None,
) -> Body:
    """Return a body whose matrices another program wrote.

    Parameters
    ----------
    *files
        Files whose name says what they hold: ``pad.sti``, ``pad.mas``, ``pad.dof`` of CalculiX
        (``*FREQUENCY, SOLVER=MATRIXSTORAGE``); ``pad_STIF2.mtx``, ``pad_MASS2.mtx``, ``pad_DMPV2.mtx`` of
        Abaqus (``*MATRIX OUTPUT, FORMAT=MATRIX INPUT`` or ``COORDINATE``); one ``.npz``, ``.mat``, ``.op4``
        or ``.pch`` with arrays ``mass`` or ``M``, ``stiffness`` or ``K``, and so on, of Nastran ``MAA`` and
        ``KAA`` or ``MGG`` and ``KGG``, punched ``MAAX`` and ``KAAX``. ``.op4`` is read by pyYeti, which has
        to be installed.
    mass, stiffness, damping, gyroscopic, circulatory
        Files of any other name: Harwell-Boeing ``.rsa``, ``.rua``, ``.hb``, of Ansys ``.matrix`` (``HBMAT``);
        Matrix Market or Abaqus ``.mtx``; a sparse ``.npz``; CalculiX. `damping` may be a `Rayleigh`.
    dofs
        Names "node.direction", a file with one name per line, or the ``.mapping`` file of Ansys. None: the
        names in the files, if they have any (CalculiX, MATRIX INPUT, ``.pch``), otherwise every direction of
        every node of `points`.
    points, surfaces
        As in `Body`; `points` in the unit of length of the files.
    mesh
        A file that meshio reads, or a `meshio.Mesh`, instead of `points`; its cells are kept. In a file of
        CalculiX or Abaqus (``.inp``) and of Nastran nodes have their numbers there. Its ties, equations,
        rigid elements and local systems are one transformation ``x = T x_free``; the matrices become
        ``T' K T`` and ``T' M T`` where the solver has not eliminated what depends on others. The points of
        any other mesh are the nodes 1, 2, ... The sets of nodes of a deck and its surfaces of solid elements
        are surfaces of the body, with their names in capitals.
    units
        ``"m-kg-s"``, or ``"mm-t-s"``: matrices in N/mm and tonnes, as most decks have them.
    name
        As in `Body`.

    Raises
    ------
    InputError
        If a file is missing, truncated or damaged; if an entry lies outside the matrix, is not finite, stands
        there twice, or lies in the triangle that the format does not hold; if mass, stiffness or damping have
        one triangle; if sizes or dofs of files differ; or if a constraint of the deck is not read, or the
        deck is of another run. The message names file and line.

    Notes
    -----
    `Body.notes` says what the reader mirrored, left out or split, whether it or the solver has eliminated
    dependent displacements, and which arrays of an archive it has no use for; it warns of those. An
    unsymmetric stiffness becomes ``stiffness`` and ``circulatory``, an unsymmetric damping ``damping`` and
    ``gyroscopic``. CalculiX writes only one triangle of the unsymmetric stiffness of a contact with friction,
    so that the friction is lost without a warning: export bodies without contact and let `contact_pairs` make
    the contacts.
    """
    if units not in UNITS:
        raise InputError(f"units: expected {' or '.join(map(repr, UNITS))}, got {units!r}")
    proportional = damping if isinstance(damping, Rayleigh) else None
    asked = {
        "mass": mass, "stiffness": stiffness, "damping": None if proportional else damping,
        "gyroscopic": gyroscopic, "circulatory": circulatory, "dofs": dofs,
    }  # fmt: skip
    for key, path in sorted_files(files).items():
        if asked[key] is not None:
            raise InputError(f"{key}: given by {path} and by {asked[key]}")
        asked[key] = path
    named = _names(asked.pop("dofs"))
    notes: list[str] = []
    for needed in ("stiffness", "mass"):
        if asked[needed] is None:
            raise InputError(f"{needed}: no file of it; files are told by their names, or by {needed}=")
    size = None if named is None else len(named)
    found = {key: _read(Path(str(path)), key, size) for key, path in asked.items() if path is not None}
    for key in ("mass", "stiffness", "damping"):
        if key in found:
            check_triangles(f"{asked[key]}: {key}", found[key].matrix)
    for file in files:
        if unread := _unread(Path(file)):
            notes.append(f"{Path(file).name}: not read: {', '.join(unread)}")
            warnings.warn(
                f"{file}: not read: {', '.join(unread)}; arrays are known as "
                f"{', '.join('/'.join(names) for names in ARRAYS.values())} and dofs",
                stacklevel=2,
            )
    named, matrices = _together(asked, found, named, notes)
    matrices = _split(matrices, notes)
    length, weight, spring = UNITS[units]
    matrices = {key: (weight if key == "mass" else spring) * matrix for key, matrix in matrices.items()}
    cells, dependent = None, dict[str, dict[str, float] | None]()
    if mesh is not None:
        if points is not None:
            raise InputError("mesh: given beside points")
        points, cells, deck = numbered_mesh(mesh)
        if deck is not None:
            surfaces = deck.surfaces(cells) | dict(surfaces or {})
            if deck.unread:
                names = ", ".join(deck.unread)
                notes.append(f"not read: surfaces {names}: neither nodes nor faces S1, S2, ... of solids")
        listed = named or tuple(f"{node}.{k}" for node in points for k in (1, 2, 3))
        present = frozenset((int(node), int(k)) for node, k in (one.split(".") for one in listed))
        constraints = Constraints()
        if deck is not None:
            constraints = deck_constraints(deck, points, cells, present)
        elif isinstance(mesh, str | Path) and Path(mesh).suffix.lower() in BULK:
            constraints = bulk_constraints(Path(mesh), points, present)
        if constraints.some:
            source = Path(str(asked["stiffness"]))
            named, matrices, dependent, told = constrained(
                constraints,
                list(points),
                cells,
                listed,
                matrices,
                local=bool(constraints.axes) and _along_axes_of_nodes(source),
                # CalculiX always eliminates; what is still there it has not tied.
                by_solver=source.suffix.lower() in CALCULIX or None,
            )
            dependent |= dict.fromkeys(f"{node}.{k}" for node, k in (deck.rotations if deck else ()))
            notes += told
    if points is not None and length != 1.0:
        points = (
            {node: length * np.asarray(row) for node, row in points.items()}
            if isinstance(points, dict)
            else length * np.asarray(points, dtype=float)
        )
    if proportional is not None:
        if "damping" in matrices:
            raise InputError("damping: given as Rayleigh and by an unsymmetric matrix")
        matrices["damping"] = proportional
    return Body(
        points=points, dofs=named, cells=cells, surfaces=surfaces, name=name, notes=notes,
        dependent=dependent, **matrices,
    )  # fmt: skip


def sorted_files(files: Sequence[str | Path]) -> dict[str, str]:
    """Return for each file what it holds, by its name.

    Raise `InputError` if a name does not say it, or two say the same.
    """
    found: dict[str, str] = {}
    for file in files:
        path = Path(file)
        suffix = path.suffix.lower()
        match = re.search(r"_(STIF|MASS|DMPV)\d+$", path.stem.upper())
        if suffix in ARCHIVES:
            keys = [key for key in ARRAYS if _array_name(path, key)]
            keys += ["dofs"] if "dofs" in _arrays(path) else []
        elif suffix in CALCULIX:
            keys = [CALCULIX[suffix]]
        elif suffix == ".dof":
            keys = ["dofs"]
        elif suffix == ".mtx" and match:
            keys = [ABAQUS[match[1]]]
        else:
            raise InputError(f"{path}: its name does not say what it holds; say mass=, stiffness=, ...")
        for key in keys:
            if key in found:
                raise InputError(f"{key}: given by {found[key]} and by {path}")
            found[key] = str(path)
    return found


def _along_axes_of_nodes(path: Path) -> bool:
    """Say whether the displacements of a matrix are along the local axes of nodes, not along global ones.

    CalculiX writes them along global axes, Abaqus and Nastran along those of the nodes.
    """
    suffix = path.suffix.lower()
    if suffix in CALCULIX:
        return False
    if suffix in NASTRAN or (suffix == ".mtx" and not read_lines(path)[0].startswith("%%")):
        return True
    raise InputError(
        f"{path}: whether its displacements are along the local axes of nodes (*TRANSFORM, CD) is not known; "
        "read the files of the program itself, or take the axes out of the deck if they are along global ones"
    )


def _read(path: Path, key: str, size: int | None) -> Found:
    suffix = path.suffix.lower()
    if suffix in ARCHIVES:
        return _from_archive(path, key)
    if suffix in HARWELL_BOEING:
        matrix, note = read_harwell_boeing(path)
        return Found(matrix, None, note)
    if suffix in CALCULIX:
        return _calculix(path, size)
    if suffix != ".mtx":
        known = (*CALCULIX, ".mtx", *HARWELL_BOEING, *ARCHIVES)
        raise InputError(f"{path}: expected {', '.join(known[:-1])} or {known[-1]}")
    lines = read_lines(path)
    if lines and lines[0].startswith("%%"):
        return _matrix_market(path, key)
    kept = ["" if line.lstrip().startswith("*") else line for line in lines]
    first = next((line for line in kept if line.strip()), "")
    if "," in first:
        return _matrix_input(path, kept)
    return _coordinate(path, kept, size)


def _calculix(path: Path, size: int | None) -> Found:
    """Read ``row column value`` lines: the upper triangle, every diagonal entry present."""
    entries = coordinates(path, read_lines(path), 0)
    count = size or int(entries.columns.max(initial=-1)) + 1
    entries.checked(count)
    missing = np.setdiff1d(np.arange(count), entries.rows[entries.rows == entries.columns])
    if missing.size or not count:
        raise InputError(
            f"{path}, line {int(entries.lines.max(initial=0))}: the file ends without an entry "
            f"({count and missing[0] + 1}, {count and missing[0] + 1}) of {count} rows"
        )
    matrix, note = entries.triangle(count, "upper")
    return Found(matrix, None, note)


def _matrix_market(path: Path, key: str) -> Found:
    """Read a Matrix Market file of real numbers; what is symmetric is mirrored."""
    with readable(path):
        *_, field, symmetry = scipy.io.mminfo(path)
    if field not in ("real", "integer") or symmetry == "hermitian":
        raise InputError(f"{path}, line 1: expected a real matrix, got {field} {symmetry}")
    found = _from_archive(path, key)
    if symmetry == "general":
        return found
    return found._replace(note=f"{path.name}: the triangle of a {symmetry} matrix mirrored, as its head says")


def _matrix_input(path: Path, lines: list[str]) -> Found:
    """Read lines ``node, direction, node, direction, value``; Abaqus numbers internal nodes from -1 down."""
    found, numbers = table(path, lines, 0, 5, ",")
    columns = [
        whole(path, found[:, k], numbers, what)
        for k, what in enumerate(("node", "direction", "node", "direction"))
    ]
    for column in (columns[1], columns[3]):
        if (wrong := (column < 1) | (column > 6)).any():
            k = int(np.flatnonzero(wrong)[0])
            raise InputError(f"{path}, line {numbers[k]}: expected a direction 1 to 6, got {column[k]}")
    ends = np.stack(columns, axis=1).reshape(-1, 2, 2)
    entries, names = Entries.of_dofs(path, ends, found[:, 4], numbers)
    if not names:
        raise InputError(f"{path}: no entries")
    matrix, note = entries.either(len(names))
    return Found(matrix, names, note)


def _coordinate(path: Path, lines: list[str], size: int | None) -> Found:
    """Read lines ``row column value`` of Abaqus."""
    entries = coordinates(path, lines, 0)
    if not entries.values.size:
        raise InputError(f"{path}: no entries")
    entries.refuse((entries.rows < 0) | (entries.columns < 0), "an internal node; write MATRIX INPUT instead")
    matrix, note = entries.either(size or int(max(entries.rows.max(), entries.columns.max())) + 1)
    return Found(matrix, None, note)


def _arrays(path: Path) -> list[str]:
    """Return the names of the arrays of a file."""
    return list(_of_nastran(path) if path.suffix.lower() in NASTRAN else array_headers(path))


def _of_nastran(path: Path) -> dict[str, Any]:
    """Return what a file of Nastran holds, which is read whole, once as long as it does not change."""
    if not path.is_file():
        return NASTRAN[path.suffix.lower()](path)
    stamp = path.stat()
    return _read_once(path, (stamp.st_mtime_ns, stamp.st_size, stamp.st_ino))


@lru_cache(maxsize=1)
def _read_once(path: Path, _: tuple[int, ...]) -> dict[str, Any]:
    return NASTRAN[path.suffix.lower()](path)


def _op4(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise InputError(f"no such file: {path}")
    try:
        op4 = import_module("pyyeti.nastran.op4")
    except ImportError:
        raise InputError(f"{path}: OP4 files are read by pyYeti; pip install pyyeti") from None
    try:
        # As a list: a file may hold several matrices of one name.
        names, matrices, *_ = op4.load(str(path), into="list", sparse=True)
    except Exception as error:  # A damaged file makes the reader raise anything.
        raise InputError(f"{path}: not readable: {error}") from None
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"{path}: holds {twice.upper()} twice")
    if not names:
        raise InputError(f"{path}: not readable: no matrix in it")
    return {name.upper(): matrix for name, matrix in zip(names, matrices, strict=True)}


#: Files of Nastran, which have no head that names their arrays.
NASTRAN: dict[str, Callable[[Path], dict[str, Any]]] = {".op4": _op4, ".pch": read_punch}


def _array_name(path: Path, key: str) -> str | None:
    held = _arrays(path)
    return next((name for name in ARRAYS[key] if name in held), None)


def _unread(path: Path) -> list[str]:
    """Return the arrays of an archive that a body has no place for."""
    if path.suffix.lower() not in ARCHIVES:
        return []
    used = {"dofs", *(_array_name(path, key) for key in ARRAYS)}
    return [name for name in _arrays(path) if name not in used]


def _from_archive(path: Path, key: str) -> Found:
    held = _arrays(path)
    name = _array_name(path, key) or (held[0] if len(held) == 1 else None)
    if name is None:
        raise InputError(f"{path}: holds no {key}{nearest(key, held)}")
    if path.suffix.lower() == ".pch":
        return Found(*_of_nastran(path)[name])
    array = _of_nastran(path)[name] if path.suffix.lower() == ".op4" else read_array(path, name)
    place = f"{path}, {name}"
    dense = not scipy.sparse.issparse(array)
    if dense and key == "mass" and 1 in array.shape and array.ndim <= 2 and array.size > 1:
        array, dense = scipy.sparse.diags_array(array.ravel()), False
    if array.dtype.kind not in "iuf" or array.ndim != 2 or array.shape[0] != array.shape[1]:
        raise InputError(
            f"{place}: expected a square matrix of real numbers, got {array.dtype} {array.shape}"
        )
    coo = scipy.sparse.coo_array(array, dtype=np.float64)
    rows = coo.tocsr()
    seen = coo.coords[0].astype(np.int64) * rows.shape[0] + coo.coords[1]
    if np.unique(seen).size < seen.size:
        raise InputError(f"{place}: holds an entry twice")
    if not np.isfinite(coo.data).all():
        k = int(np.flatnonzero(~np.isfinite(coo.data))[0])
        raise InputError(f"{place}: not finite: row {coo.coords[0][k] + 1}, column {coo.coords[1][k] + 1}")
    size = rows.shape[0]
    return Found(rows, None, f"{path.name}, {name}: all entries of {size} x {size}, nothing mirrored")


def _names(given: Any) -> tuple[str, ...] | None:
    """Return names of dofs that are given, or stand in a file one a line."""
    if given is None or not isinstance(given, str | Path):
        return None if given is None else tuple(given)
    path = Path(given)
    if path.suffix.lower() in (".npz", ".mat"):
        return tuple(str(np.ravel(one)[0]) for one in np.ravel(read_array(path, "dofs")))
    if path.suffix.lower() == ".mapping":
        return read_mapping(path)
    found = []
    for k, line in enumerate(read_lines(path)):
        if line.strip():
            if not re.fullmatch(r"\s*\d+\.[1-6]\s*", line):
                raise InputError(f"{path}, line {k + 1}: expected node.direction, got {described(line)}")
            found.append(line.strip())
    seen: set[str] = set()
    for k, dof in enumerate(found):
        if dof in seen:
            raise InputError(f"{path}, line {k + 1}: {dof} came before")
        seen.add(dof)
    return tuple(found)


def _together(
    asked: dict[str, Any], found: dict[str, Found], named: tuple[str, ...] | None, notes: list[str]
) -> tuple[tuple[str, ...] | None, dict[str, scipy.sparse.csr_array]]:
    """Return matrices over the same dofs: those of the stiffness, without constrained ones."""
    stiffness = found["stiffness"]
    notes += [one.note for one in found.values()]
    order = named if named is not None else stiffness.dofs
    matrices = {}
    for key, one in found.items():
        if one.dofs is None:
            size = stiffness.matrix.shape[0] if named is None else len(named)
            if one.matrix.shape[0] != size:
                told = asked["stiffness"] if named is None else "dofs"
                raise InputError(f"{asked[key]}: {one.matrix.shape[0]} rows, but {size} in {told}")
            matrices[key] = one.matrix
            continue
        if order is None:
            raise InputError(f"{asked[key]}: names its dofs, {asked['stiffness']} does not; say dofs=")
        place = {dof: k for k, dof in enumerate(order)}
        strange = [dof for dof in one.dofs if dof not in place]
        if strange:
            whose = asked["stiffness"] if named is None else "dofs"
            raise InputError(f"{asked[key]}: dof {strange[0]} is not one of {whose}")
        at = np.array([place[dof] for dof in one.dofs])
        coo = one.matrix.tocoo()
        matrices[key] = scipy.sparse.coo_array(
            (coo.data, (at[coo.coords[0]], at[coo.coords[1]])), shape=(len(order), len(order))
        ).tocsr()
    held = np.flatnonzero(matrices["stiffness"].diagonal() >= CONSTRAINED)
    if held.size:
        kept = np.setdiff1d(np.arange(matrices["stiffness"].shape[0]), held)
        if not kept.size:
            raise InputError(
                f"{asked['stiffness']}: every dof is constrained (diagonal from {CONSTRAINED:g} on)"
            )
        matrices = {key: matrix[kept][:, kept] for key, matrix in matrices.items()}
        if order is not None:
            order = tuple(order[k] for k in kept)
        notes.append(f"{held.size} dofs are constrained (diagonal from {CONSTRAINED:g} on) and left out")
    return order, matrices


def _split(matrices: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """Return matrices in which the skew parts of stiffness and damping stand for themselves."""
    for key, other in (("stiffness", "circulatory"), ("damping", "gyroscopic")):
        if key not in matrices:
            continue
        matrices[key], skew, note = symmetric_parts(key, matrices[key])
        if skew is not None and note is not None:
            if other in matrices:
                raise InputError(f"{key}: unsymmetric, and {other} is given too")
            matrices[other] = skew
            notes.append(note)
    return matrices
