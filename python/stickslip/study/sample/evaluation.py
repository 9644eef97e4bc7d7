"""The outputs of some samples: what every worker of a study computes.

An answer depends on the row of its sample alone: all numbers come from compiled code or from scalar
functions, nothing is computed over several samples at once.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from stickslip import _core
from stickslip.cycles.attractors import described
from stickslip.faults import InputError, StickslipError
from stickslip.locus.path import moved_friction
from stickslip.scene.checks import Real
from stickslip.scene.contact import driven_letter
from stickslip.scene.parameters.family import Family
from stickslip.scene.scene import Scene
from stickslip.scene.state import State, change_vector
from stickslip.study.sample.outputs import Column, Outputs
from stickslip.transient.trajectory import Trajectory

#: Values of one variable for some samples.
Columns = dict[str, "np.ndarray[Any, Any]"]


@dataclass(frozen=True)
class Settings:
    """How samples are computed."""

    #: Status combination for all stability outputs; None: that of steady sliding.
    combination: str | None = None
    #: Friction that varies, and the ends of its range; None: no Hopf point is asked for.
    hopf: tuple[str, float, float] | None = None
    #: Duration of a motion, and how much longer it is followed if it has not settled, s.
    duration: float = 0.0
    further: float = 0.0
    method: str = "auto"
    max_events: int | None = None
    #: None: the fastest growing mode of sliding (`disturbed_sliding`); otherwise the amounts added to the
    #: position and velocity of the sliding equilibrium.
    start: tuple[Any, Any] | None = None


@dataclass(frozen=True)
class Labels:
    """Names along the dimensions of a study, taken from its first scene that is well posed."""

    dofs: tuple[str, ...]
    contacts: tuple[Any, ...]
    modes: int
    #: contacts whose friction is moved for a Hopf point
    moved: tuple[int, ...]

    @staticmethod
    def of(scene: Scene, settings: Settings) -> Labels:
        """Return those of a scene."""
        contacts = tuple(scene.contact_labels())
        # Sliding either way leaves as many modes.
        letters = settings.combination or "".join(map(driven_letter, scene.contacts))
        name = None if settings.hopf is None else settings.hopf[0]
        moved = () if name is None else tuple(moved_friction(scene, name))
        if name is not None and not moved:
            raise InputError(f"hopf: expected the friction of contacts, such as 'friction', got {name!r}")
        return Labels(scene.dofs, contacts, 2 * scene.core.reduced(letters).mass.shape[0], moved)

    def size(self, column: Column, outputs: Outputs) -> tuple[int, ...]:
        """Return the shape of one sample of a variable."""
        if column.name in outputs.own:
            size = outputs.own[column.name].size
            return () if size is None else (size,)
        sizes = {"dof": len(self.dofs), "contact": len(self.contacts), "root": self.modes}
        return tuple(sizes[dim] for dim in column.dims)


@dataclass(frozen=True)
class Evaluation:
    """Rows of parameters to columns of outputs; can be sent to other processes."""

    family: Family
    names: tuple[str, ...]
    outputs: Outputs
    settings: Settings
    labels: Labels

    def columns(self, rows: Real, threads: int | None) -> Columns:
        """Return the outputs of samples (k, parameters), each (k, ...)."""
        functions = bool(self.outputs.own)
        if self.family.compiled(self.names) and not functions:
            return self._named((self._compiled, np.ascontiguousarray(rows)), threads)
        scenes, failures = [], []
        for row in rows:
            scene, failure = self._scene(row)
            scenes.append(scene)
            failures.append(failure)
        valid = [k for k, scene in enumerate(scenes) if scene is not None]
        answered = self._named([scenes[k].core for k in valid], threads)  # type: ignore[union-attr]
        runs = answered.pop("runs", None)
        found = self.empty(len(rows))
        for name, values in answered.items():
            found[name][valid] = values
        for k, failure in enumerate(failures):
            if failure is not None:
                found["status"][k], found["reason"][k] = failure
        for j, k in enumerate(valid):
            self._own(found, k, scenes[k], None if runs is None else runs[j])  # type: ignore[arg-type]
        return found

    def empty(self, count: int) -> Columns:
        """Return the columns of samples that have no values, (count, ...)."""
        return {
            column.name: column.filled(count, *self.labels.size(column, self.outputs))
            for column in self.outputs.columns
        }

    def _scene(self, row: Real) -> tuple[Scene | None, tuple[str, str] | None]:
        try:
            scene = self.family.scene(dict(zip(self.names, map(float, row), strict=True)))
        except StickslipError as error:
            return None, ("ill_posed", str(error))
        # A study does not end because the function of its model raises at one sample.
        except Exception as error:
            return None, ("error", f"model: {type(error).__name__}: {error}")
        shape = (scene.dofs, len(scene.contacts))
        if shape != (self.labels.dofs, len(self.labels.contacts)):
            expected = f"{len(self.labels.dofs)} dofs and {len(self.labels.contacts)} contacts"
            return None, (
                "ill_posed",
                f"model: expected {expected} as in the first scene, got {len(scene.dofs)} and {shape[1]}",
            )
        return scene, None

    def __getstate__(self) -> dict[str, Any]:
        # Compiled code does not travel to other processes; each makes its own.
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def _compiled(self) -> _core.Family:
        return self.family.compile(self.names)

    @cached_property
    def _questions(self) -> dict[str, Any]:
        asked, settings = self.outputs, self.settings
        motion = None
        if asked.moves:
            added = None
            if settings.start is not None:
                position, velocity = settings.start
                added = (
                    change_vector("position", position, self.labels.dofs),
                    change_vector("velocity", velocity, self.labels.dofs),
                )
            motion = (
                settings.duration,
                settings.further,
                settings.method,
                settings.max_events,
                added,
                asked.asks("settle", "energy"),
                asked.asks("energy"),
                bool(asked.of("run", "cycle")),
            )
        hopf = None
        if asked.asks("hopf") and settings.hopf is not None:
            _, lower, upper = settings.hopf
            hopf = (list(self.labels.moved), lower, upper)
        return {
            "sizes": (len(self.labels.dofs), len(self.labels.contacts), self.labels.modes),
            "combination": settings.combination,
            "growth": asked.asks("growth"),
            "eigenvalues": asked.asks("eigenvalues"),
            "normal_force": asked.asks("normal_force"),
            "hopf": hopf,
            "motion": motion,
        }

    def _named(self, samples: Any, threads: int | None) -> Columns:
        answers = _core.answers(samples, threads=threads, **self._questions)
        if "sequence" in answers:
            sequences = answers["sequence"]
            answers["stability"] = _words(answers["stability"])
            answers["sequence"] = _words([" ".join(sequence) for sequence in sequences])
            answers["statuses"] = _words([" ".join(sorted(set(sequence))) for sequence in sequences])
            rates = (answers["exponent"], answers.pop("exponent_error"), answers.pop("exponent_time"))
            growth = zip(*(rate.tolist() for rate in rates), strict=True)
            answers["attractor"] = _words(
                [
                    described(kind, rate, "")[0] if kind == "aperiodic" else kind
                    for kind, rate in zip(answers["attractor"], growth, strict=True)
                ]
            )
        kept = {name: answers[name] for name in (*self.outputs.named, "runs") if name in answers}
        return {**kept, "status": _words(answers["status"]), "reason": _words(answers["reason"])}

    def _own(self, found: Columns, k: int, scene: Scene, motion: Any) -> None:
        """Compute the functions of one sample; what they raise is the reason why there is no value."""
        run = None
        if motion is not None:
            position, velocity, combination, core = motion
            run = Trajectory(scene, State(position, velocity, combination, scene.dofs), core)
        cycle: Any = None
        for name, output in self.outputs.own.items():
            try:
                if output.of == "scene":
                    value = output.function(scene)
                elif run is None:
                    continue
                elif output.of == "run":
                    value = output.function(run)
                else:
                    cycle = run.limit_cycle(self.settings.further) if cycle is None else cycle
                    value = output.function(cycle)
                found[name][k] = value
            except Exception as error:
                if found["status"][k] == "ok":
                    found["status"][k] = "error"
                    found["reason"][k] = f"{name}: {type(error).__name__}: {error}"


def _words(values: list[str]) -> np.ndarray[Any, Any]:
    return np.array(values, dtype=object)
