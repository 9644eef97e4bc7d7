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
from stickslip.scene.checks import Real
from stickslip.scene.contact import Contact
from stickslip.scene.elements import Element
from stickslip.scene.laws.damping import Rayleigh
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.loads.in_time import Load
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
    damping = scene.damping
    return {
        "mass": _matrix(scene.mass),
        "stiffness": _matrix(scene.stiffness),
        "damping": [damping.mass, damping.stiffness]
        if isinstance(damping, Rayleigh)
        else None
        if damping is None
        else _matrix(damping),
        **{name: _matrix(getattr(scene, name)) for name in scene.unsymmetric},
        "force": scene.force.tolist(),
        "contacts": [_contact(contact) for contact in scene.contacts],
        "dofs": list(scene.dofs),
        "impact_friction": scene.impact_friction,
        **({"loads": [_load(load) for load in scene.loads]} if scene.loads else {}),
        **({"elements": [_element(one) for one in scene.elements]} if scene.elements else {}),
    }


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


def _matrix(matrix: Real | scipy.sparse.csr_array) -> Any:
    if isinstance(matrix, np.ndarray):
        return matrix.tolist()
    return {
        "data": matrix.data.tolist(),
        "indices": matrix.indices.tolist(),
        "indptr": matrix.indptr.tolist(),
    }


def _contact(contact: Contact) -> dict[str, Any]:
    wave = contact.slider_vibration
    given = vars(contact) | {"slider_vibration": None if wave is None else _load(wave)}
    return {name: value if name == "slider_vibration" else _plain(value) for name, value in given.items()}


def _load(load: Load) -> dict[str, Any]:
    return {"kind": type(load).__name__, **{name: _plain(value) for name, value in vars(load).items()}}


def _element(element: Element) -> dict[str, Any]:
    given = {name: _plain(value) for name, value in vars(element).items() if name != "law"}
    return {"kind": element.kind, "law": element.law.table(), **given}


def _plain(value: Any) -> Any:
    """Return an index, number, name, direction or law of friction of a contact as a file keeps it."""
    if isinstance(value, FrictionLaw):
        return value.table()
    if isinstance(value, Mapping):
        return {str(name): float(weight) for name, weight in value.items()}
    vector = isinstance(value, np.ndarray | np.generic | list | tuple)
    return np.asarray(value).tolist() if vector else value
