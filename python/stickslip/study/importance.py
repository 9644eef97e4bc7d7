"""Which parameters matter: Sobol' indices and Morris' elementary effects of the outputs of a study."""

from __future__ import annotations

import json
import warnings
from typing import Any

import numpy as np
import xarray as xr

from stickslip.faults import InputError
from stickslip.scene.checks import Real
from stickslip.study.samplers import LEVELS, problem, salib, unit_design
from stickslip.study.statistics import Condition, sample_values, units_of

#: Seed of the bootstrap of indices: it has no part in the samples.
BOOTSTRAP = 0


def importance(
    results: xr.Dataset, output: str, *, condition: Condition = None, confidence: float = 0.95, **labels: Any
) -> xr.Dataset:
    """Return how much each parameter counts for an output: Sobol' indices or Morris' elementary effects.

    Parameters
    ----------
    results
        Results of a study with the sampler ``saltelli`` or ``morris``.
    output
        A real output with a value for every sample; ``unstable`` says whether sliding is unstable.
    condition
        A function from the results to booleans, which takes the place of the output.
    confidence
        Confidence level of the bands, which come from a bootstrap.
    **labels
        Which dof, contact or mode.

    Returns
    -------
    xarray.Dataset
        Over ``parameter``. ``saltelli``: Sobol' indices, the part of the variance that a parameter explains,
        ``first`` (alone), ``total`` (with all interactions), ``first_band`` and ``total_band``, half-widths;
        of a design with ``second_order``: ``second`` (parameter, other). ``morris``: elementary effects, the
        change of the output as the parameter crosses its distribution, in the unit of the output per unit of
        probability: means ``effect`` and ``absolute_effect`` with its ``band`` (half-width), and
        ``deviation``, large for interactions and nonlinearity.

    Raises
    ------
    InputError
        If the design is another one, SALib is missing, or a sample has no value.
    """
    described = json.loads(results.attrs.get("identity", "{}"))
    sampler = described.get("sampler")
    if sampler not in ("saltelli", "morris"):
        raise InputError(f"results: expected a study with sampler='saltelli' or 'morris', got {sampler!r}")
    y = _complete(results, output, condition, labels)
    found = (_sobol if sampler == "saltelli" else _morris)(described, y, confidence)
    units = {} if sampler == "saltelli" else {"units": units_of(results, output, condition)}
    return found.assign_attrs(output=output, confidence=confidence, **units)


def _sobol(described: dict[str, Any], y: Real, confidence: float) -> xr.Dataset:
    names = list(described["parameters"])
    second = bool(described["sampler_options"].get("second_order", False))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = salib("analyze.sobol").analyze(
            problem(tuple(names)), y, calc_second_order=second, conf_level=confidence, seed=BOOTSTRAP
        )
    keys = {"first": "S1", "first_band": "S1_conf", "total": "ST", "total_band": "ST_conf"}
    rows: dict[str, Any] = {name: ("parameter", found[key]) for name, key in keys.items()}
    if second:
        pairs = np.nan_to_num(found["S2"])
        rows["second"] = (("parameter", "other"), pairs + pairs.T)
    return xr.Dataset(rows, coords={"parameter": names} | ({"other": names} if second else {}))


def _morris(described: dict[str, Any], y: Real, confidence: float) -> xr.Dataset:
    names, options = list(described["parameters"]), described["sampler_options"]
    levels = options.get("levels", LEVELS)
    unit = unit_design("morris", described["samples"], len(names), described["seed"], options)
    # As SALib made it: its levels are k / (levels - 1).
    x = np.rint(unit * levels - 0.5) / (levels - 1)
    found = salib("analyze.morris").analyze(
        problem(tuple(names)), x, y, num_levels=levels, conf_level=confidence, seed=BOOTSTRAP
    )
    # A step between levels is shorter in probability than in SALib's unit cube.
    scale = levels / (levels - 1)
    keys = {"effect": "mu", "absolute_effect": "mu_star", "deviation": "sigma", "band": "mu_star_conf"}
    return xr.Dataset(
        {name: ("parameter", scale * np.asarray(found[key], dtype=float)) for name, key in keys.items()},
        coords={"parameter": names},
    )


def _complete(results: xr.Dataset, output: str, condition: Condition, labels: dict[str, Any]) -> Real:
    values = (
        sample_values(results, output, labels)
        if condition is None
        else np.asarray(condition(results), dtype=float)
    )
    missing = np.flatnonzero(np.isnan(values))
    if missing.size:
        first = int(missing[0])
        reason = results.isel(sample=first)
        raise InputError(
            f"{output}: indices need every sample, {missing.size} have no value; sample {first} is "
            f"{str(reason.status.item())!r} {str(reason.reason.item())!r}"
        )
    return values
