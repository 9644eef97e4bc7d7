"""What is not known: distributions of parameters, alone or correlated, and grids.

Every distribution is reached from the unit cube by its inverse: a sampler knows nothing of distributions, and
a parameter nothing of samplers.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip.faults import InputError
from stickslip.scene.checks import Real, real_array, real_number
from stickslip.study.sample.fingerprint import fingerprint

#: Distance from 0 and 1 that quantiles keep, half an ulp of 1: no distribution gives infinity.
_EDGE = 2.0**-54


@dataclass(frozen=True, eq=False)
class GaussianCopula:
    """Correlated parameters: any distributions, tied by the correlation of normal variables.

    Parameters
    ----------
    marginals
        Frozen ``scipy.stats`` distributions.
    correlation
        (k, k) of the normal variables; for normal marginals that of the parameters themselves. The rank
        correlation is ``6 / pi asin(correlation / 2)``.

    Raises
    ------
    InputError
        If the correlation is no correlation matrix of that size.
    """

    marginals: tuple[Any, ...]
    correlation: Real

    def __init__(self, marginals: Sequence[Any], correlation: ArrayLike) -> None:
        listed = tuple(marginals)
        matrix = real_array("correlation", correlation, 2)
        size = len(listed)
        if matrix.shape != (size, size):
            raise InputError(f"correlation: expected shape ({size}, {size}), got {matrix.shape}")
        if not (np.isfinite(matrix).all() and (matrix == matrix.T).all() and (np.diag(matrix) == 1.0).all()):
            raise InputError(f"correlation: expected a symmetric matrix with ones, got {matrix.tolist()}")
        object.__setattr__(self, "marginals", listed)
        object.__setattr__(self, "correlation", matrix)


@dataclass(frozen=True)
class _Set:
    """Some parameters that belong together, and their map from the unit cube."""

    names: tuple[str, ...]
    marginals: tuple[Any, ...]
    #: lower triangle of what ties their normal variables; None: independent
    factor: Real | None = None
    mean: Real | None = None

    def values(self, unit: Real) -> Real:
        """Return values (n, k) of points (n, k) of the unit cube."""
        inside = np.clip(unit, _EDGE, 1.0 - 2.0 * _EDGE)
        if self.factor is not None:
            inside = self._tied(inside)
            if self.mean is not None:
                return inside + self.mean
        columns = [_quantile(law, column) for law, column in zip(self.marginals, inside.T, strict=True)]
        return np.stack(columns, axis=1)

    def _tied(self, inside: Real) -> Real:
        from scipy.special import ndtr, ndtri

        assert self.factor is not None
        normal = ndtri(inside)
        tied = np.zeros_like(normal)
        # Sums in the order of the columns: a product of matrices may round by the number of its rows.
        for i, j in zip(*np.tril_indices(len(self.factor)), strict=True):
            tied[:, i] += self.factor[i, j] * normal[:, j]
        return np.asarray(tied if self.mean is not None else ndtr(tied))


@dataclass(frozen=True)
class Parameters:
    """The parameters of a study, in order."""

    sets: tuple[_Set, ...]
    #: values of a grid; empty where there are distributions
    levels: dict[str, Real]
    given: Mapping[Any, Any]

    @property
    def names(self) -> tuple[str, ...]:
        """Names, in order."""
        if self.levels:
            return tuple(self.levels)
        return tuple(name for part in self.sets for name in part.names)

    @property
    def dependent(self) -> bool:
        """Whether some of them are correlated."""
        return any(part.factor is not None for part in self.sets)

    def grid(self) -> Real:
        """Return every combination of the values of a grid, (n, k), the last one changing fastest."""
        columns = np.meshgrid(*self.levels.values(), indexing="ij")
        return np.stack([column.ravel() for column in columns], axis=1)

    def values(self, unit: Real) -> Real:
        """Return values (n, k) of points (n, k) of the unit cube."""
        columns, first = [], 0
        for part in self.sets:
            last = first + len(part.names)
            columns.append(part.values(unit[:, first:last]))
            first = last
        return np.ascontiguousarray(np.concatenate(columns, axis=1))

    def moments(self) -> tuple[Real, Real]:
        """Return mean (k,) and covariance (k, k)."""
        if self.levels:
            raise InputError("parameters: a grid has no moments")
        means: list[float] = []
        blocks: list[Real] = []
        for part in self.sets:
            if part.mean is not None and part.factor is not None:
                means.extend(part.mean)
                blocks.append(part.factor @ part.factor.T)
                continue
            means.extend(float(law.mean()) for law in part.marginals)
            spread = np.array([float(law.std()) for law in part.marginals])
            blocks.append(np.outer(spread, spread) * _linear_correlation(part))
        from scipy.linalg import block_diag

        mean, covariance = np.array(means), np.array(block_diag(*blocks))
        if not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
            raise InputError("parameters: a distribution has no mean or no variance")
        return mean, covariance

    def described(self) -> dict[str, Any]:
        """Return what identifies them, of plain numbers and words."""
        return {
            " ".join(key) if isinstance(key, tuple) else str(key): _described(value)
            for key, value in self.given.items()
        }


def parameters(given: Any) -> Parameters:
    """Return the parameters of a study from what a user gives.

    That is name to frozen ``scipy.stats`` distribution; tuple of names to `GaussianCopula` or frozen
    ``scipy.stats.multivariate_normal``; or, for a grid, name to values (k,).
    """
    if not isinstance(given, Mapping) or not given:
        raise InputError(f"parameters: expected at least one name with its distribution, got {given!r}")
    flat = [name for key in given for name in (key if isinstance(key, tuple) else (key,))]
    for name in flat:
        if not isinstance(name, str):
            raise InputError(f"parameters: expected names, got {name!r}")
        if flat.count(name) > 1:
            raise InputError(f"parameters: {name!r} comes more than once")
    sets, levels = [], {}
    for key, value in given.items():
        if isinstance(key, tuple):
            sets.append(_correlated(key, value))
        elif _is_distribution(value):
            sets.append(_Set((key,), (value,)))
        else:
            levels[key] = _level_values(key, value)
    if sets and levels:
        raise InputError(
            f"parameters: {next(iter(levels))!r} has values and {sets[0].names[0]!r} a distribution; "
            "a study is either a grid or not"
        )
    return Parameters(tuple(sets), levels, dict(given))


def _level_values(name: str, value: Any) -> Real:
    expected = f"{name}: expected a frozen scipy.stats distribution, or values of a grid, got {value!r}"
    if hasattr(value, "rvs") or hasattr(value, "sample"):
        raise InputError(f"{expected}; freeze it by calling it with its parameters")
    if np.ndim(value) == 0 and isinstance(value, int | float | np.number) and not isinstance(value, bool):
        return np.array([real_number(name, value)])
    try:
        levels = real_array(name, value, 1)
    except InputError:
        raise InputError(expected) from None
    if levels.size == 0 or not np.isfinite(levels).all():
        raise InputError(f"{name}: expected finite values, at least one, got {value!r}")
    return levels


def _correlated(names: tuple[str, ...], value: Any) -> _Set:
    label = ", ".join(names)
    if isinstance(value, GaussianCopula):
        for law in value.marginals:
            if not _is_distribution(law):
                raise InputError(f"({label}): expected frozen scipy.stats distributions, got {law!r}")
        found = _Set(names, value.marginals, _lower(label, value.correlation))
        size = len(value.marginals)
    elif hasattr(value, "cov_object") or (hasattr(value, "mean") and hasattr(value, "cov")):
        covariance = value.cov_object.covariance if hasattr(value, "cov_object") else value.cov
        mean = np.atleast_1d(np.asarray(value.mean, dtype=float))
        size = mean.size
        found = _Set(names, (), _lower(label, np.asarray(covariance, dtype=float)), mean)
    else:
        raise InputError(
            f"({label}): expected a GaussianCopula or a frozen scipy.stats.multivariate_normal, got {value!r}"
        )
    if len(names) != size:
        raise InputError(f"({label}): expected {size} names, got {len(names)}")
    return found


def _lower(label: str, matrix: Real) -> Real:
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=float)
    except np.linalg.LinAlgError:
        raise InputError(f"({label}): the correlation must be positive definite") from None


def _is_distribution(value: Any) -> bool:
    # `scipy.stats.norm` has a ppf as well, but no parameters of its own yet.
    frozen = hasattr(value, "ppf") and not hasattr(value, "numargs")
    return frozen or (hasattr(value, "icdf") and not isinstance(value, type))


def _quantile(law: Any, unit: Real) -> Real:
    return np.asarray(law.icdf(unit) if hasattr(law, "icdf") else law.ppf(unit), dtype=float)


def _linear_correlation(part: _Set) -> Real:
    """Correlation of the parameters of a set, by a tensor rule for their normal variables where tied."""
    size = len(part.marginals)
    correlation = np.eye(size)
    if part.factor is None:
        return correlation
    from scipy.special import ndtr

    nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    weights = weights / weights.sum()
    tie = part.factor @ part.factor.T
    scaled = [
        lambda z, law=law: (
            (_quantile(law, np.clip(ndtr(z), _EDGE, 1.0 - 2.0 * _EDGE)) - law.mean()) / law.std()
        )
        for law in part.marginals
    ]
    for i, j in zip(*np.triu_indices(size, 1), strict=True):
        first, second = np.meshgrid(nodes, nodes, indexing="ij")
        other = tie[i, j] * first + np.sqrt(1.0 - tie[i, j] ** 2) * second
        product = scaled[i](first) * scaled[j](other)
        correlation[i, j] = correlation[j, i] = weights @ product @ weights
    return correlation


def _described(value: Any) -> Any:
    if isinstance(value, GaussianCopula):
        return {
            "copula": value.correlation.tolist(),
            "marginals": [_described(law) for law in value.marginals],
        }
    frozen = getattr(value, "dist", None)
    if frozen is not None and hasattr(value, "args"):
        from scipy import stats

        plain = [frozen.name, *map(_plain, value.args), {k: _plain(v) for k, v in value.kwds.items()}]
        try:
            json.dumps(plain)
        except TypeError:
            plain = []
        # Distributions of scipy are told by their names; those of data or of another class carry more.
        if plain and type(frozen) is type(getattr(stats, str(frozen.name), None)):
            return plain
    elif isinstance(value, int | float | list | tuple | np.ndarray | np.number):
        return np.asarray(value, dtype=float).tolist()
    elif hasattr(value, "cov") or hasattr(value, "cov_object"):
        covariance = value.cov_object.covariance if hasattr(value, "cov_object") else value.cov
        return ["multivariate_normal", np.asarray(value.mean).tolist(), np.asarray(covariance).tolist()]
    return fingerprint(value)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
