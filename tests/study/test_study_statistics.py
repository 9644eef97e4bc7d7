"""Statistics of studies, against closed forms."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from scipy import stats

import stickslip as ss
import study_models as models


def linear(**values: float) -> ss.Scene:
    """A scene that carries numbers to an output."""
    return ss.Scene([1.0], [[1.0]], force=[sum(weight * values[name] for name, weight in WEIGHTS.items())])


#: Output of `linear`: its variance over the unit cube is the sum of the weights squared over 12.
WEIGHTS = {"a": 3.0, "b": 2.0, "c": 0.5}


def force(scene: ss.Scene) -> float:
    return float(scene.force[0])


def linear_study(sampler: str, samples: int, **arguments: object) -> ss.Study:
    return ss.Study(
        linear,
        {name: stats.uniform(0.0, 1.0) for name in WEIGHTS},
        outputs=[{"force": ss.study.Output(force, of="scene", units="N")}],
        samples=samples,
        sampler=sampler,  # type: ignore[arg-type]
        seed=3,
        **arguments,  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("band", ["wilson", "exact"])
def test_a_known_probability_lies_in_its_band(band: str) -> None:
    """Friction is normal about the Hopf point of a one-dof model: P = 1 - Phi((2 - 1.8) / 0.4).

    A band of 95 % misses it in one study of twenty; 32 or fewer of forty hold it with probability 7e-4.
    """
    law = stats.norm(1.8, 0.4)
    exact = law.sf(models.HOPF)
    results = ss.Study(models.fed_oscillator(1.0), {"friction": law}, samples=40 * 200, seed=2).run()
    held = 0
    for first in range(0, 40 * 200, 200):
        found = ss.study.probability(results.isel(sample=slice(first, first + 200)), band=band)
        held += bool(found.lower <= exact <= found.upper)
        assert found.samples == 200
    assert held >= 33


def test_the_closed_form_of_the_verdict() -> None:
    """Re lambda = -(d / 2) (1 - friction COUPLING); the band over friction steps at the Hopf point."""
    study = ss.Study(
        models.fed_oscillator, {"friction": stats.uniform(1.0, 2.0)}, samples=512, sampler="sobol"
    )
    results = study.run()
    d = 2.0 * models.ZETA * models.OMEGA
    rate = -0.5 * d * (1.0 - results.friction * models.COUPLING)
    assert results.growth_rate.to_numpy() == pytest.approx(rate.to_numpy(), rel=1e-10, abs=1e-10 * d)
    steps = ss.study.probability(results, "friction", bins=np.linspace(1.0, 3.0, 9))
    assert steps.probability.to_numpy().tolist() == [0.0] * 4 + [1.0] * 4
    assert (steps.samples == 64).all()
    assert (steps.lower <= steps.probability).all()
    assert (steps.probability <= steps.upper).all()


@pytest.mark.slow
def test_sobol_points_have_less_variance_than_random_ones() -> None:
    """Of twenty estimates each of the mean growth rate, at equal number of samples."""

    def estimates(sampler: str) -> list[float]:
        return [
            float(models.verdicts(samples=256, seed=seed, sampler=sampler).run().growth_rate.mean())
            for seed in range(20)
        ]

    random, sobol = np.var(estimates("random")), np.var(estimates("sobol"))
    latin = np.var(estimates("latin_hypercube"))
    # A ratio of variances of 20 estimates each is below 1 / 5 with probability 5e-4 (F distribution).
    assert sobol < random / 5.0
    assert latin < random


@pytest.mark.slow
def test_sobol_indices_of_a_linear_output() -> None:
    results = linear_study("saltelli", 1024, sampler_options={"second_order": True}).run()
    assert results.sizes["sample"] == 1024 * 8
    found = ss.study.importance(results, "force")
    squares = np.array([weight**2 for weight in WEIGHTS.values()])
    share = squares / squares.sum()
    # Errors of scrambled Sobol' points at 1024 are some 1e-3.
    assert found.first.to_numpy() == pytest.approx(share, abs=0.01)
    assert found.total.to_numpy() == pytest.approx(share, abs=0.01)
    assert np.abs(found.second.to_numpy()).max() < 0.02
    assert (found.first_band < 0.1).all()


def test_morris_effects_of_a_linear_output() -> None:
    results = linear_study("morris", 10, sampler_options={"levels": 6}).run()
    assert results.sizes["sample"] == 10 * 4
    found = ss.study.importance(results, "force")
    # Every elementary effect is the weight: the parameters are their own probabilities.
    assert found.effect.to_numpy() == pytest.approx(list(WEIGHTS.values()), rel=1e-9)
    assert found.absolute_effect.to_numpy() == pytest.approx(list(WEIGHTS.values()), rel=1e-9)
    assert np.abs(found.deviation.to_numpy()).max() < 1e-9
    assert found.attrs["units"] == "N"


def test_quantiles_and_their_bands() -> None:
    """A band of 95 % for the median holds the median of a symmetric sum in most of sixty studies."""
    results = linear_study("random", 60 * 60).run()
    held = 0
    for first in range(0, 60 * 60, 60):
        few = results.isel(sample=slice(first, first + 60))
        found = ss.study.distribution(few, "force", quantiles=[0.5])
        held += bool(found.lower.item() <= 2.75 <= found.upper.item())
    # 50 or fewer of 60 have probability 7e-4 at 95 %.
    assert held > 50
    assert found.deviation.item() == pytest.approx(np.sqrt(13.25 / 12.0), rel=0.3)
    fewer = ss.study.distribution(results.isel(sample=slice(0, 5)), "force", quantiles=[0.01, 0.99])
    assert np.isnan(fewer.lower.item(0))
    assert np.isnan(fewer.upper.item(1))


def test_convergence_ends_at_the_estimate_of_all_samples() -> None:
    results = models.verdicts(samples=1000).run()
    rate = ss.study.convergence(results, "growth_rate")
    assert rate.estimate.to_numpy()[-1] == pytest.approx(results.growth_rate.mean().item(), rel=1e-12)
    width = (rate.upper - rate.lower).to_numpy()
    error = results.growth_rate.std(ddof=1).item() / np.sqrt(1000)
    assert width[-1] == pytest.approx(2 * stats.norm.ppf(0.975) * error, rel=1e-9)
    assert width[-1] < width[0]
    whole = ss.study.convergence(results)
    all_samples = ss.study.probability(results)
    assert whole.estimate.to_numpy()[-1] == all_samples.probability.item()
    for end in ("lower", "upper"):
        assert whole[end].to_numpy()[-1] == pytest.approx(all_samples[end].item(), rel=1e-12)
    assert (whole.lower >= 0.0).all()
    assert (whole.upper <= 1.0).all()


def test_wrong_questions_are_named() -> None:
    results = models.campaign(samples=16).run()
    for ask, message in (
        (lambda: ss.study.probability(results, "fricton"), "unknown parameter 'fricton'; nearest: friction"),
        (lambda: ss.study.probability(results, confidence=1.5), "confidence"),
        (lambda: ss.study.probability(results, "friction", bins=[1.0, 0.5]), "bins"),
        (lambda: ss.study.distribution(results, "amplitude"), "amplitude: has a value for every dof"),
        (lambda: ss.study.distribution(results, "eigenvalue"), "expected a real output"),
        (lambda: ss.study.importance(results, "period"), "sampler='saltelli' or 'morris', got 'random'"),
        (lambda: ss.study.unstacked(results), "expected those of a grid"),
        (lambda: ss.study.probability(xr.Dataset()), "expected growth_rate"),
    ):
        with pytest.raises(ss.InputError, match=message):
            ask()
    incomplete = models.campaign(samples=8, sampler="saltelli", outputs=["period"]).run()
    with pytest.raises(ss.InputError, match="indices need every sample"):
        ss.study.importance(incomplete, "period")


def test_figures_draw_on_the_axes_they_are_given() -> None:
    results = models.campaign(samples=64, outputs=["growth_rate", "amplitude", "eigenvalues"]).run()
    indices = ss.study.importance(linear_study("saltelli", 16).run(), "force")
    effects = ss.study.importance(linear_study("morris", 4).run(), "force")
    moments = models.campaign(samples=64).eigenvalue_moments()
    _, rows = plt.subplots(2, 3)
    axes = rows.ravel()
    drawn = [
        ss.plot(ss.study.probability(results, "friction"), ax=axes[0]),
        ss.plot(results, "amplitude", dof="x1", ax=axes[1]),
        ss.plot(indices, ax=axes[2]),
        ss.plot(effects, ax=axes[3]),
        ss.plot(ss.study.convergence(results), ax=axes[4]),
        ss.plot(moments, results=results, ax=axes[5]),
    ]
    assert drawn == list(axes)
    assert axes[0].get_xlabel() == "friction coefficient"
    assert axes[1].get_xlabel() == "amplitude, m"
    assert [label.get_text() for label in axes[2].get_yticklabels()] == ["c", "b", "a"]
    assert all(one.has_data() for one in axes)
    plt.close("all")
