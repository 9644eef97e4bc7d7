"""A store takes results of one model only: what a model reads and calls is part of what identifies it."""

import functools
import importlib
import json
import linecache
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import stickslip as ss
import study_models as models
from stickslip.study.parameters import parameters
from stickslip.study.sample.fingerprint import described_function

#: A module of a user: a constant, a table, a set, a helper, a class, and a module of constants beside it.
MODULE = """
import functools
import numpy as np
import study_models as models
import {name}_constants as constants

FACTOR = {FACTOR}
TABLE = {{"weights": np.array([1.0, {ENTRY}])}}
KINDS = {{"pad", "disc", "{KIND}"}}
count = 0


class Part:
    share = {SHARE}

    def __init__(self, weight):
        self.weight = weight

    @property
    def factor(self):
        return self.weight * self.share


PART = Part({WEIGHT})


def scaled(factor):
    def decorated(function):
        @functools.wraps(function)
        def inner(friction):
            return function(factor * friction)
        return inner
    return decorated


@functools.lru_cache
def weight(of=1.0):
    return of * {HELPED}


def helper():
    return {HELPER} * weight()


@scaled({DECORATED})
def model(friction):
    global count
    count += 1
    factors = [FACTOR * constants.FACTOR for _ in range(1)]
    factor = factors[0] * helper() * TABLE["weights"].sum() * len(KINDS) * PART.factor
    return models.fed_oscillator(friction * factor)
"""
NUMBERS = {
    "FACTOR": 1.0, "ENTRY": 1.0, "KIND": "belt", "SHARE": 1.0, "WEIGHT": 1.0, "HELPED": 1.0, "HELPER": 1.0,
    "DECORATED": 1.0, "CONSTANT": 1.0,
}  # fmt: skip


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Return a function that writes the module with other numbers, and imports it anew."""
    monkeypatch.syspath_prepend(tmp_path)

    def written(**changes):
        numbers = NUMBERS | changes
        name = "model_of_a_user"
        (tmp_path / f"{name}.py").write_text(MODULE.format(name=name, **numbers))
        (tmp_path / f"{name}_constants.py").write_text(f"FACTOR = {numbers['CONSTANT']}\n")
        for one in (f"{name}_constants", name):
            sys.modules.pop(one, None)
            Path(importlib.util.cache_from_source(str(tmp_path / f"{one}.py"))).unlink(missing_ok=True)
        importlib.invalidate_caches()
        linecache.clearcache()
        return importlib.import_module(name)

    return written


def study(model):
    return ss.Study(model, {"friction": stats.uniform(0.3, 0.1)}, samples=4)


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"FACTOR": 2.0}, "FACTOR: 1.0 here, 2.0 there"),
        ({"CONSTANT": 2.0}, "constants.FACTOR: 1.0 here, 2.0 there"),
        ({"ENTRY": 2.0}, "TABLE"),
        ({"KIND": "pin"}, "KINDS"),
        ({"SHARE": 2.0}, "PART"),
        ({"WEIGHT": 2.0}, "PART"),
        ({"HELPER": 2.0}, "helper"),
        ({"HELPED": 2.0}, "helper.reads.weight"),
        ({"DECORATED": 2.0}, "enclosed.factor: 1.0 here, 2.0 there"),
    ],
    ids=str,
)
def test_a_store_refuses_a_model_that_reads_or_calls_something_else(module, tmp_path, change, place):
    """Before, 15 samples of FACTOR = 1 and 25 of FACTOR = 2 came to lie in one store."""
    study(module(**change).model).run(tmp_path / "x.zarr")
    with pytest.raises(ss.InputError, match=f"another study; model.*{place}"):
        study(module().model).run(tmp_path / "x.zarr")
    # The same numbers, written anew: the same study.
    assert (study(module(**change).model).run(tmp_path / "x.zarr").status == "ok").all()


def test_laws_of_scipy_are_told_by_name_and_arguments_and_others_by_what_they_hold():
    def described(law):
        return json.loads(json.dumps(parameters({"friction": law}).described()))["friction"]

    assert described(stats.uniform(0.3, 0.1)) == ["uniform", 0.3, 0.1, {}]
    assert described(stats.poisson(mu=3.0)) == ["poisson", {"mu": 3.0}]

    class Uniform(type(stats.uniform)):
        """Of the name of one of scipy, and another one."""

    for other in (Uniform(name="uniform")(0.3, 0.1), stats.rv_histogram(np.histogram([1.0, 2.0], 2))()):
        assert described(other)[0] == "rv_continuous_frozen"


class Weighted:
    """A function with a number."""

    def __init__(self, weight):
        self.weight = weight

    def __call__(self, scene):
        return self.weight * partner(3)


def partner(count):
    return 0.0 if count == 0 else other(count - 1)


def other(count):
    return partner(count) + len(NUMBERS)


def test_functions_that_call_each_other_and_callable_objects():
    assert described_function(partner) == described_function(partner)
    assert "NUMBERS" in described_function(partner)["reads"]["other"]["reads"]
    first, second = (json.dumps(described_function(Weighted(weight))) for weight in (1.0, 2.0))
    assert first != second
    assert first == json.dumps(described_function(Weighted(1.0)))
    # What is installed is told apart by its version.
    assert "reads" not in described_function(functools.partial(models.stats.uniform, 1.0))
