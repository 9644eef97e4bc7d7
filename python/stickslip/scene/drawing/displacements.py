"""Displacements that a mesh can show: of a state, of a motion at its instants, of a complex mode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Complex, Real, described, whole_number
from stickslip.scene.drawing.schematic import Structured
from stickslip.show.mesh import Mesh

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Instants:
    """Displacements at k instants."""

    #: (k, n), m.
    position: Real
    #: (k, n), m/s; None: not known.
    velocity: Real | None = None
    #: (k,), s; None: the displacement has no time.
    times: Real | None = None


@dataclass(frozen=True, eq=False)
class ModeShape:
    """A complex mode shape."""

    #: (n,).
    values: Complex
    #: lambda, 1/s; None: not known.
    eigenvalue: complex | None = None
    #: Number of the mode; None: not known.
    number: int | None = None


@runtime_checkable
class _Placed(Protocol):
    """A `State`."""

    @property
    def position(self) -> Real: ...
    @property
    def velocity(self) -> Real: ...
    def ordered(self, dofs: tuple[str, ...]) -> _Placed: ...


@runtime_checkable
class _Shaped(Protocol):
    """`Modes`."""

    @property
    def eigenvalues(self) -> Complex: ...
    @property
    def shapes(self) -> Complex: ...


def mesh_of(scene: Structured) -> Mesh:
    """Return the mesh of a scene."""
    if scene.mesh is None:
        raise InputError("scene: it has no points; make it by stickslip.fe.assemble of bodies with points")
    return scene.mesh


def displacements_of(given: Any, dofs: tuple[str, ...], mode: int | None) -> Instants | ModeShape:
    """Return what a caller gives as `displacements`.

    That is what `Motion.sample` or `Reduction.expand` return, a `State`, a real vector (n,), or complex
    modes: `Modes`, their Dataset, or one shape, a complex vector (n,). Of several modes, None is the fastest
    growing one.
    """
    import xarray as xr

    size = len(dofs)
    if isinstance(given, xr.Dataset):
        if "position" in given:
            return _motion(given, size)
        if "shape" in given:
            return _shape_of_dataset(given, size, mode)
    elif isinstance(given, _Shaped):
        number = _number(mode, given.eigenvalues)
        values = _fitting(given.shapes[:, number], size)
        return ModeShape(values, complex(given.eigenvalues[number]), number)
    elif isinstance(given, _Placed):
        _fitting(given.position, size)
        state = given.ordered(dofs)
        return Instants(state.position[None, :], state.velocity[None, :])
    else:
        try:
            array = np.asarray(given)
        except ValueError:
            array = np.zeros(0)
        if array.ndim == 1 and array.dtype.kind == "c":
            return ModeShape(_fitting(array, size))
        if array.ndim == 1 and array.dtype.kind in "iuf":
            return Instants(_fitting(array.astype(float), size)[None, :])
    raise InputError(
        "displacements: expected what sample, expand or complex_modes return, a State, or a vector, got "
        f"{described(given)}"
    )


def _motion(data: xr.Dataset, size: int) -> Instants:
    """Return the instants of a motion."""
    position = _fitting(data["position"].transpose(..., "dof").to_numpy(), size).reshape(-1, size)
    velocity = None
    if "velocity" in data:
        velocity = data["velocity"].transpose(..., "dof").to_numpy().reshape(-1, size)
    times = np.atleast_1d(data["time"].to_numpy()) if "time" in data.coords else None
    return Instants(position, velocity, times)


def _shape_of_dataset(data: xr.Dataset, size: int, mode: int | None) -> ModeShape:
    """Return the shape of a mode; a Dataset that holds one mode alone keeps the number of it."""
    number = _number(mode, np.atleast_1d(data["eigenvalue"].to_numpy()))
    one = data.isel(mode=number) if "mode" in data.dims else data
    label = int(one["mode"].item()) if "mode" in one.coords else number
    values = _fitting(one["shape"].to_numpy(), size)
    return ModeShape(values, complex(one["eigenvalue"].item()), label)


def _number(mode: int | None, eigenvalues: Complex) -> int:
    count = eigenvalues.size
    if not count:
        raise InputError("displacements: expected at least one mode, got none")
    if mode is None:
        return int(np.argmax(eigenvalues.real))
    if (number := whole_number("mode", mode, 0)) >= count:
        raise InputError(f"mode: expected a mode in 0..{count - 1}, got {mode}")
    return number


def _fitting(values: Any, size: int) -> Any:
    if values.shape[-1] != size:
        raise InputError(
            f"displacements: expected {size} dofs of the scene, got shape {values.shape}; "
            "those of a reduced scene go through expand first"
        )
    if not np.isfinite(values).all():
        raise InputError("displacements: must be finite")
    return values
