"""Results that read back whole from a dataset: critical points, bifurcations, branches, basins.

An orbit is kept as the core's record of it, which a scene makes a `Cycle` again. The scenes along a parameter
are mostly the first one with another value; any other is kept as the text of a scene file.
"""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip import _core
from stickslip.cycles.basins.result import BasinBoundary, Basins
from stickslip.cycles.bifurcation import Bifurcation, Diagram
from stickslip.cycles.branches.branch import Branch, BranchPoint
from stickslip.cycles.cycle import Cycle
from stickslip.faults import InputError
from stickslip.files.case import case_of_text, case_text
from stickslip.locus.points import CriticalPoints
from stickslip.scene.parameters.family import Family
from stickslip.scene.parameters.values import parameter_of
from stickslip.scene.scene import Scene
from stickslip.scene.state import State
from stickslip.study.run.identity import described_scene

if TYPE_CHECKING:
    import xarray as xr

#: Attribute that names the class of a result.
RESULT = "stickslip_result"
#: Prefix of variables that only the file has.
KEPT = "kept_"
#: What a state has by contact, where it has them.
OF_CONTACTS = ("friction_force", "internal")


def kept(result: Any) -> xr.Dataset:
    """Return the dataset of a result, with all that makes the result again if it is one of `READERS`."""
    data: xr.Dataset = result.to_dataset()
    name = type(result).__name__
    if name not in READERS:
        return data
    if isinstance(result, Diagram):
        parameter = parameter_of(data.period)
        (along,) = data.period.dims
        data = data.assign(_orbits(str(along), parameter, data[parameter].to_numpy(), result.cycles))
        if isinstance(result, Branch):
            points = result.points
            columns = {field: [getattr(point, field) for point in points] for field in _POINT}
            columns |= {"contact": [-1 if one is None else one for one in columns["contact"]]}
            columns |= {"event": [one or "" for one in columns["event"]]}
            kinds = {"value": float, "multiplier": complex, "contact": int, "kind": str, "event": str}
            dim = f"{KEPT}change"
            variables: Any = {
                f"{dim}_{key}": (dim, np.array(columns[key], dtype=kinds[key])) for key in kinds
            }
            data = data.assign(variables).assign_attrs({f"{KEPT}end": result.end})
            orbits = [point.cycle for point in points]
            data = data.assign(_orbits(dim, parameter, columns["value"], orbits, f"{dim}_"))
    if isinstance(result, BasinBoundary):
        values = np.zeros(len(result.cycles))
        data = data.assign(_orbits("cycle", "", values, result.cycles, f"{KEPT}cycle_"))
    if isinstance(result, Basins | BasinBoundary):
        data = _with_basins(data, result if isinstance(result, Basins) else result.basins)
    return data.assign_attrs({RESULT: name})


def restored(file: Path, data: xr.Dataset) -> Any:
    """Return the result that `kept` has written, or the dataset if it is none."""
    name = data.attrs.pop(RESULT, None)
    if name is None:
        return data
    if name not in READERS:
        raise InputError(f"{file}: {RESULT}: expected one of {list(READERS)}, got {name!r}")
    # A broken file makes its reader fail in any way.
    try:
        return READERS[name](data)
    except Exception as error:
        raise InputError(f"{file}: not readable as {name}: {error}") from error


_POINT = [field.name for field in dataclasses.fields(BranchPoint)]


def _orbits(
    dim: str, parameter: str, values: Any, cycles: Sequence[Cycle | None], prefix: str = KEPT
) -> dict[str, Any]:
    """Return records and scenes of orbits over a dimension."""
    texts, records = [], []
    first: Scene | None = None
    for value, cycle in zip(values, cycles, strict=True):
        text = record = ""
        if cycle is not None:
            record = base64.b64encode(cycle.core.record()).decode()
            near = None if first is None else _at(first, parameter, value)
            if first is None or near is None or described_scene(near) != described_scene(cycle.scene):
                text = case_text(cycle.scene)
                first = cycle.scene if first is None else first
        texts.append(text)
        records.append(record)
    return {
        f"{prefix}scene": (dim, np.array(texts, dtype=str)),
        f"{prefix}orbit": (dim, np.array(records, dtype=str)),
    }


def _with_basins(data: xr.Dataset, basins: Basins) -> xr.Dataset:
    """Return a dataset of basins with the orbits of its attractors, and the scene and start of the map."""
    cycles = [None if isinstance(attractor, str) else attractor for attractor in basins.attractors]
    data = data.assign(_orbits("attractor", "", np.zeros(len(cycles)), cycles))
    times = {f"{KEPT}stretch": basins.stretch, f"{KEPT}limit": basins.limit}
    if basins.scene is None or basins.start is None:
        return data.assign_attrs(times)
    start, dim = basins.start.ordered(basins.scene.dofs), f"{KEPT}dof"
    variables: dict[str, Any] = {
        f"{KEPT}position": (dim, start.position),
        f"{KEPT}velocity": (dim, start.velocity),
    }
    for name in OF_CONTACTS:
        if (values := getattr(start, name)) is not None:
            variables[f"{KEPT}{name}"] = (f"{KEPT}contact", values)
    texts = {f"{KEPT}text": case_text(basins.scene), f"{KEPT}combination": start.combination}
    return data.assign(variables).assign_attrs(times | texts)


def _at(scene: Scene, parameter: str, value: float) -> Scene | None:
    if not parameter:
        return scene
    try:
        return Family(scene).scene({parameter: float(value)})
    except InputError:
        return None


def _cycles(data: xr.Dataset, parameter: str, values: Any, prefix: str = KEPT) -> tuple[Cycle | None, ...]:
    found: list[Cycle | None] = []
    first: Scene | None = None
    rows = zip(values, data[f"{prefix}scene"].to_numpy(), data[f"{prefix}orbit"].to_numpy(), strict=True)
    for value, text, record in rows:
        if not record:
            found.append(None)
            continue
        if text:
            scene = case_of_text(str(text)).scene
            first = scene if first is None else first
        elif first is None:
            raise InputError(f"{prefix}scene: expected a scene before the first orbit without one")
        elif parameter:
            scene = Family(first).scene({parameter: float(value)})
        else:
            scene = first
        found.append(Cycle(scene, _core.Cycle.from_record(scene.core, base64.b64decode(str(record)))))
    return tuple(found)


def _plain(data: xr.Dataset) -> xr.Dataset:
    """Return the dataset without what only the file has."""
    plain = data.drop_vars([name for name in data.variables if str(name).startswith(KEPT)])
    plain.attrs = {name: entry for name, entry in data.attrs.items() if not str(name).startswith(KEPT)}
    return plain


def _bifurcation(data: xr.Dataset) -> Bifurcation:
    parameter = parameter_of(data.period)
    return Bifurcation(_plain(data), _cycles(data, parameter, data[parameter].to_numpy()))


def _branch(data: xr.Dataset) -> Branch:
    parameter, dim = parameter_of(data.period), f"{KEPT}change"
    columns = {key: data[f"{dim}_{key}"].to_numpy() for key in ("value", "kind", "multiplier", "contact")}
    events = data[f"{dim}_event"].to_numpy()
    orbits = _cycles(data, parameter, columns["value"], f"{dim}_")
    points = tuple(
        BranchPoint(
            parameter=parameter,
            value=float(columns["value"][k]),
            kind=str(columns["kind"][k]),  # type: ignore[arg-type]
            multiplier=complex(columns["multiplier"][k]),
            contact=None if columns["contact"][k] < 0 else int(columns["contact"][k]),
            event=str(events[k]) or None,
            cycle=orbit,
        )
        for k, orbit in enumerate(orbits)
        if orbit is not None
    )
    cycles = _cycles(data, parameter, data[parameter].to_numpy())
    return Branch(_plain(data), cycles, points, data.attrs[f"{KEPT}end"])


def _basins(data: xr.Dataset) -> Basins:
    kinds = data.kind.to_numpy().tolist()
    cycles = _cycles(data, "", np.zeros(len(kinds)))
    attractors = tuple(kind if cycle is None else cycle for kind, cycle in zip(kinds, cycles, strict=True))
    text = data.attrs.get(f"{KEPT}text")
    scene = start = None
    if text is not None:
        scene = case_of_text(text).scene
        held = [data.get(f"{KEPT}{name}") for name in OF_CONTACTS]
        start = State(
            data[f"{KEPT}position"].to_numpy(),
            data[f"{KEPT}velocity"].to_numpy(),
            data.attrs[f"{KEPT}combination"],
            scene.dofs,
            *(None if values is None else values.to_numpy() for values in held),
        )
    times = float(data.attrs[f"{KEPT}stretch"]), float(data.attrs[f"{KEPT}limit"])
    return Basins(data.reached, attractors, scene, start, *times)


def _basin_boundary(data: xr.Dataset) -> BasinBoundary:
    basins = _basins(data)
    cycles = _cycles(data, "", np.zeros(data.sizes["cycle"]), f"{KEPT}cycle_")
    return BasinBoundary(
        basins,
        tuple(cycle for cycle in cycles if cycle is not None),
        np.stack([data.inside.to_numpy(), data.outside.to_numpy()], axis=1),
        np.stack([data[f"segment_{dim}"].to_numpy() for dim in basins.map.dims], axis=-1),
        data.segment_reached.to_numpy(),
        data.attrs["reason"],
    )


#: What reads a result back, by the name of its class.
READERS: dict[str, Callable[[xr.Dataset], Any]] = {
    "CriticalPoints": CriticalPoints.from_dataset,
    "Bifurcation": _bifurcation,
    "Branch": _branch,
    "Basins": _basins,
    "BasinBoundary": _basin_boundary,
}
