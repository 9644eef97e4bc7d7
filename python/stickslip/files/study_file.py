"""The section `[study]` of a scene file.

Its keys are the arguments of `Study`; `[study.parameters]` has a line for each parameter, which is one of

    { uniform = [lower, upper] }
    { normal = [mean, deviation] }
    { lognormal = [mean, deviation] }
    { triangular = [lower, mode, upper] }
    { distribution = "weibull_min", c = 1.5, scale = 2.0 }   # any of scipy.stats
    [values] or { from = ..., to = ..., count = ... }        # a grid
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.files.scene_file import RANGE_KEYS, known, located, parameter_values
from stickslip.scene.checks import real_number
from stickslip.scene.contact import nearest
from stickslip.scene.parameters.family import Model
from stickslip.study.study import Study

#: Arguments of `Study` that a file may have; the rest comes from its other sections.
KEYS = (
    "parameters",
    "outputs",
    "samples",
    "seed",
    "sampler",
    "sampler_options",
    "combination",
    "hopf",
    "duration",
    "further",
    "method",
    "max_events",
)
#: Distributions by name, with what their numbers are.
SHORT = {
    "uniform": ("lower", "upper"),
    "normal": ("mean", "deviation"),
    "lognormal": ("mean", "deviation"),
    "triangular": ("lower", "mode", "upper"),
}


def study_of(
    model: Model,
    section: Mapping[str, Any],
    run: Mapping[str, Any],
    start: Mapping[str, Any],
    changes: Mapping[str, Any],
) -> Study:
    """Return the study of a case, see `Case.to_study`; None in `changes` leaves an argument as it stands."""
    known("[study]", section, KEYS)
    changed = {key: value for key, value in changes.items() if value is not None}
    given = {**section, **changed}
    parameters = given.pop("parameters", {})
    with located("[study]"):
        if not isinstance(parameters, Mapping) or not parameters:
            raise InputError(f"parameters: expected names with distributions, got {parameters!r}")
        laws = {name: distribution(name, value) for name, value in parameters.items()}
        if not any(hasattr(law, "ppf") for law in laws.values()) and "samples" not in changed:
            # The number of the section belongs to its distributions.
            given.pop("samples", None)
        if "combination" in start:
            raise InputError("[start]: a study starts beside sliding equilibrium, without a combination")
        of_run = {key: run[key] for key in ("duration", "method", "max_events") if key in run}
        return Study(model, laws, **{**of_run, **start, **given})


def distribution(name: str, value: Any) -> Any:
    """Return a frozen distribution, or the values of a grid, from what a file says of a parameter."""
    if not isinstance(value, Mapping) or set(value) & set(RANGE_KEYS):
        return parameter_values(name, value)
    from scipy import stats

    if "distribution" in value:
        numbers = {
            key: real_number(f"{name}: {key}", one) for key, one in value.items() if key != "distribution"
        }
        law = getattr(stats, str(value["distribution"]), None)
        if not isinstance(law, stats.rv_continuous | stats.rv_discrete):
            raise InputError(f"{name}: scipy.stats has no distribution {value['distribution']!r}")
        try:
            frozen = law(**numbers)
        except TypeError as error:
            raise InputError(f"{name}: {value['distribution']}: {error}") from None
        if not np.isfinite(frozen.ppf(0.5)):
            raise InputError(f"{name}: {value['distribution']} does not take {numbers}")
        return frozen
    if len(value) != 1 or next(iter(value)) not in SHORT:
        wrong = str(next(iter(value), ""))
        raise InputError(
            f"{name}: expected one of {', '.join(SHORT)}, got {dict(value)!r}{nearest(wrong, list(SHORT))}"
        )
    ((kind, entries),) = value.items()
    meanings = SHORT[kind]
    if not isinstance(entries, list | tuple) or len(entries) != len(meanings):
        raise InputError(f"{name}: {kind}: expected [{', '.join(meanings)}], got {entries!r}")
    first, second, *third = (
        real_number(f"{name}: {kind}: {meaning}", entry)
        for meaning, entry in zip(meanings, entries, strict=True)
    )
    return _short(name, kind, first, second, *third)


def _short(name: str, kind: str, first: float, second: float, third: float = 0.0) -> Any:
    from scipy import stats

    said = f"{name}: {kind}: got {[first, second]}"
    if kind == "uniform":
        if not first < second:
            raise InputError(f"{said}, expected lower < upper")
        return stats.uniform(first, second - first)
    if kind == "triangular":
        if not (first <= second <= third and first < third):
            raise InputError(f"{name}: {kind}: got {[first, second, third]}, expected lower <= mode <= upper")
        return stats.triang((second - first) / (third - first), first, third - first)
    if not second > 0.0:
        raise InputError(f"{said}, expected a positive deviation")
    if kind == "normal":
        return stats.norm(first, second)
    if not first > 0.0:
        raise InputError(f"{said}, expected a positive mean")
    variance = np.log1p((second / first) ** 2)
    return stats.lognorm(np.sqrt(variance), scale=first * np.exp(-0.5 * variance))
