"""What makes two studies the same one, and what their arithmetic depends on."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import scipy.sparse

from stickslip import _core
from stickslip.scene.contact import Contact
from stickslip.scene.elements import Damper, Spring
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.laws.law import OneVariableLaw
from stickslip.scene.loads.in_time import Harmonic, Switched
from stickslip.scene.scene import Scene
from stickslip.study.sample.fingerprint import described_function, fingerprints

#: Packages on whose numbers a study depends.
PACKAGES = ("stickslip", "numpy", "scipy")


def described_model(model: Any, fixed: Mapping[str, Any]) -> dict[str, Any]:
    """Return what identifies a model: a scene by its numbers, a function by name, source and arguments."""
    if isinstance(model, Scene):
        return {"name": "Scene", "scene": described_scene(model)}
    found: dict[str, Any] = dict(described_function(model))
    if fixed:
        found["fixed"] = fingerprints(fixed)
    return found


def described_scene(scene: Scene) -> dict[str, Any]:
    """Return all numbers of a scene, of plain types: it can be built again from them."""
    beside = [name for name in ("loads", "elements") if getattr(scene, name)]
    own = ("mass", "stiffness", "damping", *scene.unsymmetric, "force", "contacts", "dofs", "impact_friction")
    return {name: _plain(getattr(scene, name)) for name in (*own, *beside)}


def machine() -> dict[str, Any]:
    """Return what the last bits of results depend on besides the study itself."""
    target, extensions = _core.arithmetic()
    return {
        "target": target,
        "extensions": extensions,
        "libc": " ".join(platform.libc_ver()),
        "python": platform.python_version(),
        "stickslip": versions()["stickslip"],
    }


def release_series() -> str:
    """Return the major and the minor version of this package.

    Releases that differ in the patch number alone compute the same quantities, if not the same last bits.
    """
    return ".".join(versions()["stickslip"].split(".")[:2])


def versions() -> dict[str, str]:
    """Return the versions of the packages involved."""
    found = {}
    for name in (*PACKAGES, "xarray", "zarr", "SALib"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def differences(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> list[str]:
    """Return in words what two descriptions differ in."""
    found = []
    for name in dict.fromkeys((*ours, *theirs)):
        here, there = plain(ours.get(name)), plain(theirs.get(name))
        if here == there:
            continue
        if isinstance(here, dict) and isinstance(there, dict):
            found += [f"{name}.{inner}" for inner in differences(here, there)]
        else:
            found.append(f"{name}: {_short(here)} here, {_short(there)} there")
    return found


def plain(value: Any) -> Any:
    """Return a description as it comes back from a file."""
    return json.loads(json.dumps(value))


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _plain(value: Any) -> Any:
    """Return a part of a scene, and what that is made of, as numbers and words."""
    match value:
        case Rayleigh():
            return [value.mass, value.stiffness]
        case OneVariableLaw():
            return value.table()
        case Contact():
            return {name: _plain(part) for name, part in vars(value).items()}
        case Harmonic() | Switched() | Spring() | Damper():
            kind = getattr(value, "kind", type(value).__name__)
            return {"kind": kind, **{name: _plain(part) for name, part in vars(value).items()}}
        case Mapping():
            return {str(name): float(weight) for name, weight in value.items()}
        case list() | tuple():
            return [_plain(part) for part in value]
        case np.ndarray() | np.generic():
            return value.tolist()
    if scipy.sparse.issparse(value):
        return {name: getattr(value, name).tolist() for name in ("data", "indices", "indptr")}
    return value
