"""A case: a scene with a start, the settings of a run, and parameter values; what a scene file holds."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.faults import InputError
from stickslip.files.scene_file import (
    Matrices,
    known,
    located,
    model_from,
    parameter_values,
    read_tables,
    scene_from,
    scene_table,
)
from stickslip.files.toml_text import Inline, toml_text
from stickslip.scene import models
from stickslip.scene.checks import (
    FORMAT_KEY,
    FORMAT_VERSION,
    Real,
    check_format_version,
    described,
    file_path,
)
from stickslip.scene.laws.law import FrictionLaw
from stickslip.scene.parameters.family import Family
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, steady_sliding
from stickslip.study.run.identity import described_scene
from stickslip.transient.simulate import run_settings, simulate
from stickslip.transient.trajectory import Trajectory

if TYPE_CHECKING:
    from stickslip.study.study import Study

START_KEYS = ("position", "velocity", "combination")
#: Settings of `simulate` with their defaults; the duration has none.
RUN_DEFAULTS = {
    name: None if parameter.default is parameter.empty else parameter.default
    for name, parameter in inspect.signature(simulate).parameters.items()
    if name not in ("scene", "start")
}
#: Sections of a scene file; `study` belongs to `stickslip.study`.
SECTIONS = ("scene", "model", "start", "run", "sweep", "study")
HEADER = "# A scene for stickslip; SI units, angles in radians.\n\n"


@dataclass(frozen=True, eq=False)
class Case:
    """A scene with a start, the settings of a run, and the parameter values of a sweep.

    Parameters
    ----------
    model
        A `Scene`, or a function from keywords to one; a function of `stickslip.models`, or a
        `functools.partial` of one, can be saved.
    start
        ``position`` and ``velocity``: amounts that are added to the sliding equilibrium, m and m/s, by dof or
        as a vector (n,). With ``combination`` they are the start itself.
    run
        Arguments of `simulate`: ``duration``, s, ...
    sweep
        Parameter names to values (k,), or to ``{"from": ..., "to": ..., "count": ...}``.
    study
        The section `[study]`, as it stands in the file.
    """

    model: Scene | Callable[..., Scene]
    start: Mapping[str, Any] = field(default_factory=dict)
    run: Mapping[str, Any] = field(default_factory=dict)
    sweep: Mapping[str, Any] = field(default_factory=dict)
    study: Mapping[str, Any] = field(default_factory=dict)
    #: The scene, with the parameters of the model as they stand.
    scene: Scene = field(init=False)

    def __post_init__(self) -> None:
        for name, allowed in (("start", START_KEYS), ("run", tuple(RUN_DEFAULTS))):
            known(f"[{name}]", getattr(self, name), allowed)
        scene = self.model if isinstance(self.model, Scene) else self.model()
        if not isinstance(scene, Scene):
            raise InputError(
                f"model: expected a Scene or a function that returns one, got {described(scene)}"
            )
        object.__setattr__(self, "scene", scene)
        with located("[start]"):
            self._moved(State(np.zeros(scene.size), np.zeros(scene.size), "", scene.dofs))
            self._combination()
        with located("[run]"):
            run_settings(**{**RUN_DEFAULTS, "duration": 1.0, **self.run})
        with located("[sweep]"):
            self.values()

    def initial_state(self) -> State:
        """Return the state that a run starts from.

        Raises
        ------
        InputError
            If it is relative to sliding equilibrium and there is none.
        """
        combination = self._combination()
        if combination is None:
            return self._moved(steady_sliding(self.scene))
        zero = np.zeros(self.scene.size)
        return self._moved(State(zero, zero, combination, self.scene.dofs))

    def started(self, equilibrium: State) -> State:
        """Return the start in the same model at other parameters, of which a sliding equilibrium is given."""
        return self.initial_state() if self._combination() is not None else self._moved(equilibrium)

    def _combination(self) -> str | None:
        combination = self.start.get("combination")
        if combination is None or isinstance(combination, str):
            return combination
        raise InputError(f"combination: expected a string such as '+s', got {combination!r}")

    def _moved(self, state: State) -> State:
        return state.perturbed(self.start.get("position"), self.start.get("velocity"))

    def simulate(self, **changes: Any) -> Trajectory:
        """Return the motion from the start; `changes` go before the settings of `run`, see `simulate`.

        Raises
        ------
        InputError
            If there is no duration, or an argument is ill-posed.
        """
        settings = {**self.run, **{key: value for key, value in changes.items() if value is not None}}
        if "duration" not in settings:
            raise InputError("duration is missing: give it, or [run] duration in the file")
        return simulate(self.scene, start=self.initial_state(), **settings)

    def values(self) -> dict[str, Real]:
        """Return the parameter values of the sweep, (k,) each.

        Raises
        ------
        InputError
            If they are neither numbers nor a range.
        """
        return {name: parameter_values(name, value) for name, value in self.sweep.items()}

    def replace(self, **parameters: Any) -> Case:
        """Return the case with other parameters, by names as for `sweep`; arrays have a value for each entry.

        Raises
        ------
        InputError
            If one is unknown or ill-posed, or two of them set the same number.
        """
        model = Family(self.model).replaced(parameters)
        return Case(model, self.start, self.run, self.sweep, self.study)

    def to_study(self, **changes: Any) -> Study:
        """Return the study of the case: its section `[study]`, with duration and settings of `[run]`.

        Its start, if it has one, is added to the sliding equilibrium of every sample; else the fastest
        growing mode is.

        Parameters
        ----------
        **changes
            Arguments of `Study`, which go before what the section says; None: as it stands.

        Raises
        ------
        InputError
            If there are no parameters, or anything is ill-posed.
        """
        from stickslip.files.study_file import study_of

        return study_of(self.model, self.study, self.run, self.start, changes)

    def __repr__(self) -> str:
        lines = [f"Case of {self.scene!r}"]
        for name in ("start", "run", "sweep", "study"):
            if section := getattr(self, name):
                lines.append(f"  {name}: " + ", ".join(f"{key} = {value}" for key, value in section.items()))
        return "\n".join(lines)


def save_case(what: Scene | Case, path: str | Path, matrices: Matrices) -> None:
    """Write a scene or a case as TOML, see `stickslip.save`."""
    if matrices not in ("auto", "inline", "npz", "mat", "mtx"):
        raise InputError(f"matrices: expected auto, inline, npz, mat or mtx, got {matrices!r}")
    if isinstance(what, Scene):
        what = _named(what) if matrices == "auto" else Case(what)
    file = file_path(path)
    if file.suffix != ".toml":
        raise InputError(f"{file.name}: expected a file .toml of a scene or a case")
    older = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else HEADER
    file.write_text(_text(what, file, matrices, older), encoding="utf-8")


def case_text(what: Scene | Case, older: str = "") -> str:
    """Return a scene or a case as the text of a scene file that needs no other files."""
    return _text(_named(what) if isinstance(what, Scene) else what, Path(), "inline", older)


def _named(scene: Scene) -> Case:
    """Return a scene as the model and arguments that made it, if they still do."""
    model = scene.model
    return Case(scene if model is None or described_scene(model()) != described_scene(scene) else model)


def _text(case: Case, file: Path, matrices: Matrices, older: str) -> str:
    if isinstance(case.model, Scene):
        tables: dict[str, Any] = {"scene": scene_table(case.model, file, matrices)}
    else:
        tables = {"model": _model_table(case.model)}
    for name in ("start", "run", "sweep", "study"):
        if section := getattr(case, name):
            tables[name] = _section(section, case.scene)
    return toml_text({FORMAT_KEY: FORMAT_VERSION, **tables}, older)


def _section(section: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
    """Return a section without what is None, amounts by the name of their dof."""

    def amounts(table: Mapping[str | int, Any]) -> Inline:
        return Inline({key if isinstance(key, str) else scene.dofs[key]: one for key, one in table.items()})

    return {
        key: amounts(value) if isinstance(value, Mapping) else value
        for key, value in section.items()
        if value is not None
    }


def load_case(path: str | Path) -> Case:
    """Return the case that a scene file holds; see `Case` and `stickslip.files.scene_file`."""
    file = file_path(path)
    return _case(file, read_tables(file))


def case_of_text(text: str) -> Case:
    """Return the case that the text of a scene file holds."""
    return _case(Path("scene"), tomllib.loads(text))


def _case(file: Path, tables: dict[str, Any]) -> Case:
    with located(str(file)):
        check_format_version(tables.pop(FORMAT_KEY, None))
    known(str(file), tables, SECTIONS)
    if ("scene" in tables) == ("model" in tables):
        raise InputError(f"{file}: expected either [scene] or [model], got {', '.join(tables) or 'neither'}")
    if "scene" in tables:
        model: Scene | Callable[..., Scene] = scene_from(file, tables["scene"])
    else:
        model = model_from(file, tables["model"])
        with located(f"{file}: [model]"):
            model()
    sections = {name: tables.get(name, {}) for name in ("start", "run", "sweep", "study")}
    with located(str(file)):
        return Case(model, **sections)


def _model_table(model: Callable[..., Scene]) -> dict[str, Any]:
    function = model.func if isinstance(model, partial) else model
    names = {function: name for name, function in models.MODELS.items()}
    if function not in names or (isinstance(model, partial) and model.args):
        raise InputError(f"model: a file cannot name {model!r}; save model(...), a Scene, instead")
    table: dict[str, Any] = {"name": names[function]}
    for key, value in (model.keywords if isinstance(model, partial) else {}).items():
        if isinstance(value, FrictionLaw):
            value = Inline(value.table())
        elif key == "friction" and isinstance(value, Sequence):
            value = [Inline(one.table()) if isinstance(one, FrictionLaw) else one for one in value]
        if key in ("subsystems", "links"):
            table[key.removesuffix("s")] = [vars(entry) for entry in value]
        elif value is not None:
            table[key] = value
    return table
