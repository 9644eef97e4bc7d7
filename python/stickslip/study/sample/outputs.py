"""What a study asks of every sample: outputs by name, or functions of the scene, the motion or its cycle."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.contact import nearest
from stickslip.study.sample.fingerprint import described_function

#: What an output is computed from: stability, the Hopf point, the motion itself, what it settles to.
Group = Literal["growth", "eigenvalues", "normal_force", "hopf", "run", "settle", "energy", "custom"]


@dataclass(frozen=True)
class Column:
    """One variable of the results."""

    name: str
    group: Group
    #: Dimensions besides ``sample``.
    dims: tuple[str, ...]
    #: ``float64``, ``complex128``, ``int64`` or ``str``.
    dtype: str
    #: Units and meaning.
    attrs: dict[str, str]

    @property
    def missing(self) -> Any:
        """What stands where there is no value."""
        return {"float64": np.nan, "complex128": complex(np.nan, np.nan), "int64": -1, "str": ""}[self.dtype]

    def filled(self, *shape: int) -> np.ndarray[Any, Any]:
        """Return an array without values."""
        return np.full(shape, self.missing, dtype=object if self.dtype == "str" else self.dtype)


def _column(
    name: str, group: Group, meaning: str, units: str = "", dims: tuple[str, ...] = (), dtype: str = "float64"
) -> Column:
    attrs = {"long_name": meaning} | ({"units": units} if units else {})
    return Column(name, group, dims, dtype, attrs)


#: Outputs by name.
OUTPUTS: dict[str, Column] = {
    column.name: column
    for column in (
        _column("growth_rate", "growth", "largest real part of the eigenvalues of sliding", "1/s"),
        _column("frequency", "growth", "modulus of the least stable eigenvalue over 2 pi", "Hz"),
        _column("unstable_modes", "growth", "unstable modes, a conjugate pair being one", dtype="int64"),
        _column(
            "eigenvalue",
            "growth",
            "least stable eigenvalue, nonnegative imaginary part",
            "1/s",
            (),
            "complex128",
        ),
        _column(
            "eigenvalues",
            "eigenvalues",
            "all eigenvalues of sliding, by modulus, conjugates side by side",
            "1/s",
            ("root",),
            "complex128",
        ),
        _column("normal_force", "normal_force", "normal force of steady sliding", "N", ("contact",)),
        _column("hopf_point", "hopf", "lowest friction at which a mode becomes unstable"),
        _column("hopf_frequency", "hopf", "frequency of that mode at that point", "Hz"),
        _column("events", "run", "events within the duration", dtype="int64"),
        _column("attractor", "settle", "what the motion settles to", dtype="str"),
        _column("amplitude", "settle", "half the range of the displacement of the cycle", "m", ("dof",)),
        _column("period", "settle", "smallest period of the limit cycle", "s"),
        _column("cycle_frequency", "settle", "inverse of the period", "Hz"),
        _column("statuses", "settle", "status combinations on the attractor, sorted", dtype="str"),
        _column("sequence", "settle", "status combinations of one period, in order", dtype="str"),
        _column("largest_multiplier", "settle", "largest Floquet multiplier across the flow, modulus"),
        _column("stability", "settle", "of the cycle: stable, unstable or not known", dtype="str"),
        _column("exponent", "settle", "Lyapunov exponent where there is no cycle", "1/s"),
        _column("energy_per_cycle", "energy", "dissipated by dampers and impacts per period", "J"),
        _column(
            "contact_energy", "energy", "through a contact into the structure per period", "J", ("contact",)
        ),
        _column("slider_energy", "energy", "work of the slider of a contact per period", "J", ("contact",)),
    )
}
#: Written for every sample.
STATUS = _column("status", "custom", "ok, or why an output is missing", dtype="str")
REASON = _column("reason", "custom", "that in words", dtype="str")


@dataclass(frozen=True)
class Output:
    """An output of your own.

    Parameters
    ----------
    function
        A function of one argument that returns one number, or a vector of ``size`` numbers; it must be
        picklable if other processes run the study.
    of
        What the function takes: ``run``, the `Trajectory` of the duration; ``cycle``, the `Cycle` to which it
        settles; ``scene``, the `Scene`.
    dtype
        ``float`` or ``complex``.
    size
        None: one number; else the length of the vector, over the dimension ``<name>_index``.
    units
        For tables and figures.

    Raises
    ------
    InputError
        If the function cannot be called, or another argument is none of those.
    """

    function: Callable[[Any], Any]
    of: Literal["run", "cycle", "scene"] = "run"
    dtype: type = float
    size: int | None = None
    units: str = ""

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise InputError(f"outputs: expected a function, got {self.function!r}")
        if self.of not in ("run", "cycle", "scene"):
            raise InputError(f"outputs: of must be 'run', 'cycle' or 'scene', got {self.of!r}")
        if self.dtype not in (float, complex):
            raise InputError(f"outputs: dtype must be float or complex, got {self.dtype!r}")
        if self.size is not None and (not isinstance(self.size, int) or self.size < 1):
            raise InputError(f"outputs: size must be None or an integer >= 1, got {self.size!r}")

    def column(self, name: str) -> Column:
        """Return the variable it fills."""
        dims = () if self.size is None else (f"{name}_index",)
        dtype = "float64" if self.dtype is float else "complex128"
        return _column(name, "custom", f"function of the {self.of}", self.units, dims, dtype)

    def described(self) -> dict[str, Any]:
        """Return what identifies it, with its source as far as it is known."""
        return {"of": self.of, "size": self.size, **described_function(self.function)}


@dataclass(frozen=True)
class Outputs:
    """The outputs of a study, in order."""

    named: tuple[str, ...]
    own: dict[str, Output]

    @property
    def columns(self) -> tuple[Column, ...]:
        """The variables of the results, status and reason last."""
        own = (output.column(name) for name, output in self.own.items())
        return (*(OUTPUTS[name] for name in self.named), *own, STATUS, REASON)

    def asks(self, *groups: Group) -> bool:
        """Whether an output of one of these groups is asked."""
        return any(OUTPUTS[name].group in groups for name in self.named)

    def of(self, *kinds: str) -> dict[str, Output]:
        """Return the functions of these kinds."""
        return {name: output for name, output in self.own.items() if output.of in kinds}

    @property
    def moves(self) -> bool:
        """Whether a motion has to be computed."""
        return self.asks("run", "settle", "energy") or bool(self.of("run", "cycle"))

    def described(self) -> dict[str, Any]:
        """Return what identifies them."""
        own = {name: output.described() for name, output in self.own.items()}
        return dict.fromkeys(self.named, "by name") | own


def outputs(given: Any) -> Outputs:
    """Return the outputs of a study from what a user gives.

    That is a sequence of names, functions of the trajectory (named as they are) or mappings from a name to a
    function or `Output`; or one such mapping.
    """
    if isinstance(given, str | Mapping) or callable(given):
        given = [given]
    if not isinstance(given, Sequence) or not given:
        raise InputError(f"outputs: expected at least one name or function, got {given!r}")
    named: list[str] = []
    own: dict[str, Output] = {}
    for entry in given:
        if isinstance(entry, str):
            if entry not in OUTPUTS:
                raise InputError(f"outputs: unknown output {entry!r}{nearest(entry, list(OUTPUTS))}")
            found: Mapping[str, Any] = {entry: None}
        elif isinstance(entry, Mapping):
            found = entry
        elif callable(entry):
            name = getattr(entry, "__name__", "")
            if not name.isidentifier():
                raise InputError(f"outputs: {entry!r} has no name; give it as {{name: function}}")
            found = {name: entry}
        else:
            raise InputError(f"outputs: expected a name, a function or a mapping, got {entry!r}")
        for name, output in found.items():
            if (
                name in named
                or name in own
                or (output is not None and name in (*OUTPUTS, "status", "reason"))
            ):
                raise InputError(f"outputs: {name!r} comes more than once or is the name of another output")
            if output is None:
                named.append(name)
            else:
                own[name] = output if isinstance(output, Output) else Output(output)
    return Outputs(tuple(named), own)
