"""Points in the unit cube: random, Latin hypercube, Sobol', and the designs of SALib.

Row i of a design depends on sampler, seed, number of samples and i; the rows of ``random`` and ``sobol`` do
not even depend on the number of samples, so that a longer study begins with the shorter one.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.checks import Real

#: Samplers of the unit cube by name, with the options each takes.
SAMPLERS: dict[str, tuple[str, ...]] = {
    "random": (),
    "latin_hypercube": (),
    "sobol": ("scramble",),
    "saltelli": ("second_order",),
    "morris": ("levels",),
}
#: Levels of a Morris design unless told otherwise.
LEVELS = 4


def unit_design(sampler: str, count: int, dimension: int, seed: int, options: Mapping[str, Any]) -> Real:
    """Return a design in the unit cube, (rows, dimension).

    ``sobol`` is scrambled unless ``scramble=False``. ``saltelli``, the design of Sobol' indices, has ``count
    (dimension + 2)`` rows, ``count (2 dimension + 2)`` with ``second_order=True`` (Saltelli 2002; Saltelli et
    al. 2010). ``morris`` has ``count`` trajectories of ``dimension + 1`` rows over ``levels`` levels (Morris
    1991), whose level k lies at (k + 1/2) / levels, so that no quantile is infinite.
    """
    if sampler not in SAMPLERS:
        raise InputError(f"sampler: expected one of {[*SAMPLERS, 'grid']}, got {sampler!r}")
    for name in options:
        if name not in SAMPLERS[sampler]:
            raise InputError(f"sampler_options: {sampler!r} takes {list(SAMPLERS[sampler])}, got {name!r}")
    if sampler == "random":
        return np.random.default_rng(seed).random((count, dimension))
    if sampler in ("sobol", "saltelli") and count & (count - 1):
        warnings.warn(
            f"samples: a Sobol' sequence is balanced for powers of two only, got {count}; "
            f"nearest {2 ** round(np.log2(count))}",
            stacklevel=2,
        )
    if sampler in ("latin_hypercube", "sobol"):
        from scipy.stats import qmc

        if sampler == "latin_hypercube":
            return np.asarray(qmc.LatinHypercube(dimension, seed=np.random.default_rng(seed)).random(count))
        engine = qmc.Sobol(
            dimension, scramble=bool(options.get("scramble", True)), seed=np.random.default_rng(seed)
        )
        with warnings.catch_warnings():
            # Said above, in the words of a study.
            warnings.simplefilter("ignore", UserWarning)
            return np.asarray(engine.random(count))
    return _salib_design(sampler, count, dimension, seed, options)


def problem(names: tuple[str, ...]) -> dict[str, Any]:
    """Return what SALib calls a problem: the unit cube over some names."""
    return {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}


def salib(module: str) -> Any:
    """Return a module of SALib."""
    try:
        return import_module(f"SALib.{module}")
    except ImportError:
        raise InputError("sampler: this needs SALib; pip install 'stickslip[study]'") from None


def _salib_design(sampler: str, count: int, dimension: int, seed: int, options: Mapping[str, Any]) -> Real:
    cube = problem(tuple(f"u{k}" for k in range(dimension)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if sampler == "saltelli":
            second = bool(options.get("second_order", False))
            return np.asarray(
                salib("sample.sobol").sample(cube, count, calc_second_order=second, seed=seed), dtype=float
            )
        levels = options.get("levels", LEVELS)
        if not isinstance(levels, int) or levels < 2 or levels % 2:
            raise InputError(f"sampler_options: levels must be an even integer >= 2, got {levels!r}")
        unit = salib("sample.morris").sample(cube, count, num_levels=levels, seed=seed)
        return np.asarray((unit * (levels - 1) + 0.5) / levels, dtype=float)
