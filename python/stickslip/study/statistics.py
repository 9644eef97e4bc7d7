"""Statistics of the results of a study: grids, probabilities, distributions, convergence.

Confidence bands hold for independent samples (``random``); for ``latin_hypercube`` and ``sobol`` they are
as a rule wider than they have to be.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr

from stickslip.faults import InputError
from stickslip.scene.checks import Real, real_number
from stickslip.scene.contact import nearest

#: A yes or no per sample: a function from the results to booleans (sample,), or None: sliding is unstable.
Condition = Callable[[xr.Dataset], Any] | None
Band = Literal["wilson", "exact"]

#: Bins of a parameter unless told otherwise.
BINS = 20


def unstacked(results: xr.Dataset) -> xr.Dataset:
    """Return the results of a grid over its parameters instead of ``sample``.

    Raises
    ------
    InputError
        If they are not those of a grid.
    """
    described = json.loads(results.attrs.get("identity", "{}"))
    if described.get("sampler") != "grid":
        raise InputError("results: expected those of a grid")
    names = [name for name, values in described["parameters"].items() if np.size(values) > 0]
    indexed: xr.Dataset = results.load().set_index(sample=names)
    return indexed.unstack("sample") if len(names) > 1 else indexed.rename(sample=names[0])


def unstable(results: xr.Dataset) -> Any:
    """Return whether steady sliding is unstable, (sample,) float: nan where it is not known."""
    if "growth_rate" in results:
        rate = results.growth_rate.to_numpy()
    elif "eigenvalue" in results:
        rate = results.eigenvalue.to_numpy().real
    elif "unstable_modes" in results:
        modes = results.unstable_modes.to_numpy()
        return np.where(modes < 0, np.nan, modes > 0)
    else:
        raise InputError("results: expected growth_rate, eigenvalue or unstable_modes among the outputs")
    return np.where(np.isnan(rate), np.nan, rate > 0.0)


def probability(
    results: xr.Dataset,
    over: str | None = None,
    *,
    condition: Condition = None,
    bins: int | Sequence[float] = BINS,
    confidence: float = 0.95,
    band: Band = "wilson",
) -> xr.Dataset:
    """Return the probability that sliding is unstable, or of any condition, with its confidence band.

    Parameters
    ----------
    results
        Results of a study; samples without a value do not count.
    over
        Parameter whose range is divided into bins; None: one probability over all samples.
    condition
        None: sliding is unstable; otherwise a function from the results to booleans, or to floats with nan
        where the answer is not known, (sample,).
    bins
        Number of bins of equal width, or their edges.
    confidence
        Confidence level of the band, in (0, 1).
    band
        ``wilson``: the score interval of Wilson (1927), whose coverage is right on average; ``exact``: that
        of Clopper and Pearson (1934), whose coverage is never less than stated.

    Returns
    -------
    xarray.Dataset
        Over ``bin``: ``probability``, ``lower`` and ``upper`` end of the band, the number of ``samples`` that
        count and of those ``without_value``, as where steady sliding does not exist, and the coordinates
        ``left``, ``right`` and the parameter (its middle). Without `over` no dimension.

    Raises
    ------
    InputError
        If the parameter is unknown or another argument ill-posed.
    """
    if not 0.0 < real_number("confidence", confidence) < 1.0:
        raise InputError(f"confidence: expected a number between 0 and 1, got {confidence!r}")
    if band not in ("wilson", "exact"):
        raise InputError(f"band: expected 'wilson' or 'exact', got {band!r}")
    holds = np.asarray((condition or unstable)(results), dtype=float)
    if over is None:
        row = _proportion(holds, confidence, band)
        return xr.Dataset(
            {name: ((), value) for name, value in row.items()}, attrs={"confidence": confidence}
        )
    values = _parameter(results, over)
    edges = np.histogram_bin_edges(values, bins) if isinstance(bins, int) else np.asarray(bins, dtype=float)
    if edges.size < 2 or not (np.diff(edges) > 0.0).all():
        raise InputError(f"bins: expected ascending edges, got {bins!r}")
    # The last bin holds its right end, as in a histogram.
    place = np.searchsorted(edges, values, side="right") - 1
    place[values == edges[-1]] = edges.size - 2
    rows = [_proportion(holds[place == k], confidence, band) for k in range(edges.size - 1)]
    return xr.Dataset(
        {name: ("bin", np.array([row[name] for row in rows])) for name in rows[0]},
        coords={
            over: ("bin", 0.5 * (edges[1:] + edges[:-1])),
            "left": ("bin", edges[:-1]),
            "right": ("bin", edges[1:]),
        },
        attrs={"confidence": confidence, "over": over},
    )


def _proportion(holds: Real, confidence: float, band: Band) -> dict[str, float]:
    from scipy.stats import binomtest

    missing = int(np.isnan(holds).sum())
    holds = holds[~np.isnan(holds)]
    count = holds.size
    if count == 0:
        return {"probability": np.nan, "lower": 0.0, "upper": 1.0, "samples": 0, "without_value": missing}
    interval = binomtest(int(holds.sum()), count).proportion_ci(confidence, method=band)
    return {
        "probability": float(holds.mean()),
        "lower": float(interval.low),
        "upper": float(interval.high),
        "samples": count,
        "without_value": missing,
    }


def distribution(
    results: xr.Dataset,
    output: str,
    *,
    quantiles: Sequence[float] = (0.05, 0.5, 0.95),
    confidence: float = 0.95,
    condition: Condition = None,
    **labels: Any,
) -> xr.Dataset:
    """Return mean, standard deviation and quantiles of an output, with confidence.

    Parameters
    ----------
    results
        Results of a study.
    output
        A real output; samples without a value do not count.
    quantiles
        Probabilities of the quantiles, in (0, 1).
    confidence
        Confidence level of the bands, in (0, 1).
    condition
        Samples to count, a function from the results to booleans; None: all.
    **labels
        Which dof, contact or mode, where the output has several: ``dof="x1"``.

    Returns
    -------
    xarray.Dataset
        ``expectation`` and its ``standard_error``, ``deviation``, number of ``samples``; over ``quantile``:
        ``value`` with ``lower`` and ``upper`` end of its band, order statistics whose ranks are binomial
        quantiles: no distribution is assumed. The attribute ``output`` names it.

    Raises
    ------
    InputError
        If the output is unknown or complex, or has dimensions left.
    """
    from scipy.stats import binom

    values = sample_values(results, output, labels)
    if condition is not None:
        values = values[np.asarray(condition(results), dtype=bool)]
    values = np.sort(values[~np.isnan(values)])
    count = values.size
    at = np.asarray(quantiles, dtype=float)
    if count == 0 or not ((at > 0.0) & (at < 1.0)).all():
        raise InputError(f"{output}: expected samples with values and quantiles in (0, 1), got {quantiles!r}")
    tail = 0.5 * (1.0 - confidence)
    # Ranks outside the samples are no bound at all.
    low, high = binom.ppf(tail, count, at) - 1.0, binom.ppf(1.0 - tail, count, at)
    bounds = np.append(values, np.nan)
    lower = bounds[np.where(low >= 0.0, low, count).astype(int)]
    upper = bounds[np.where(high < count, high, count).astype(int)]
    deviation = float(values.std(ddof=1)) if count > 1 else np.nan
    return xr.Dataset(
        {
            "expectation": float(values.mean()),
            "standard_error": deviation / np.sqrt(count),
            "deviation": deviation,
            "samples": count,
            "value": ("quantile", np.quantile(values, at)),
            "lower": ("quantile", lower),
            "upper": ("quantile", upper),
        },
        coords={"quantile": at},
        attrs={"output": output, "units": results[output].attrs.get("units", ""), "confidence": confidence},
    )


def convergence(
    results: xr.Dataset,
    output: str | None = None,
    *,
    condition: Condition = None,
    points: int = 40,
    confidence: float = 0.95,
    **labels: Any,
) -> xr.Dataset:
    """Return how the estimate of a mean, or of a probability, settles with the number of samples.

    Parameters
    ----------
    results
        Results of a study.
    output
        Output whose mean is estimated; None: the probability of the condition.
    condition
        As for `probability`.
    points
        Number of sample numbers at which the estimate is given, in equal ratios.
    confidence
        Confidence level of the band, in (0, 1).
    **labels
        Which dof, contact or mode.

    Returns
    -------
    xarray.Dataset
        Over ``samples``: ``estimate``, and ``lower`` and ``upper`` end of the band of independent samples.
        The band of a mean is that of the normal distribution of means, the band of a probability is Wilson's.

    Raises
    ------
    InputError
        If the output is unknown or complex, or there are less than two samples with a value.
    """
    from scipy.stats import norm

    whole = (
        np.asarray((condition or unstable)(results), dtype=float)
        if output is None
        else sample_values(results, output, labels)
    )
    values = whole[~np.isnan(whole)]
    if values.size < 2:
        raise InputError("results: expected at least two samples with a value")
    counts = np.unique(np.geomspace(min(10, values.size), values.size, points).astype(int))
    total, square = np.cumsum(values), np.cumsum(values**2)
    mean = total[counts - 1] / counts
    variance = np.maximum(square[counts - 1] / counts - mean**2, 0.0) * counts / np.maximum(counts - 1, 1)
    z = norm.ppf(0.5 * (1.0 + confidence))
    centre, half = mean, z * np.sqrt(variance / counts)
    if output is None:
        # Wilson's, which stays between 0 and 1.
        shrunk = 1.0 + z**2 / counts
        centre = (mean + 0.5 * z**2 / counts) / shrunk
        half = z / shrunk * np.sqrt(mean * (1.0 - mean) / counts + 0.25 * (z / counts) ** 2)
    name = "probability" if output is None else output
    return xr.Dataset(
        {
            "estimate": ("samples", mean),
            "lower": ("samples", centre - half),
            "upper": ("samples", centre + half),
        },
        coords={"samples": counts},
        attrs={"output": name, "confidence": confidence, "units": units_of(results, output, condition)},
    )


def _parameter(results: xr.Dataset, name: str) -> Real:
    known = [str(key) for key, coord in results.coords.items() if coord.dims == ("sample",)]
    if name not in known:
        raise InputError(f"over: unknown parameter {name!r}{nearest(name, known)}")
    return np.asarray(results[name].to_numpy(), dtype=float)


def sample_values(results: xr.Dataset, output: str, labels: dict[str, Any]) -> Real:
    """Return a real output, (sample,), nan where there is no value; ``unstable`` for the verdict."""
    if output == "unstable" and output not in results:
        return np.asarray(unstable(results), dtype=float)
    if output not in results.data_vars:
        raise InputError(
            f"output: unknown output {output!r}{nearest(output, [str(k) for k in results.data_vars])}"
        )
    column = results[output]
    column = column.sel(labels) if labels else column
    if column.dims != ("sample",):
        left = [str(dim) for dim in column.dims if dim != "sample"]
        raise InputError(f"{output}: has a value for every {left[0]}; choose one, {left[0]}=...")
    if column.dtype.kind not in "fiub":
        raise InputError(f"{output}: expected a real output, got dtype {column.dtype}")
    values = column.to_numpy()
    return (
        np.where(values < 0, np.nan, values) if values.dtype.kind == "i" else np.asarray(values, dtype=float)
    )


def units_of(results: xr.Dataset, output: str | None, condition: Condition) -> str:
    """Return the units of an output; empty of a yes or no."""
    if output is None or condition is not None or output not in results:
        return ""
    return str(results[output].attrs.get("units", ""))
