"""Every stiffness known to 5 %: when does the model squeal, at which frequency, and which spring matters.

Run it: ``python examples/stiffness_uncertainty.py --figure stiffness-uncertainty.png``. Two studies of the
two-subsystem model: independent samples for probabilities, amplitudes and frequencies, and a Saltelli design
for Sobol' indices.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from scipy import stats

import stickslip as ss
from stickslip.study import figures

#: Standard deviation of a stiffness, in parts of its nominal value.
SPREAD = 0.05
FRICTION = (0.3, 2.5)
#: Every stiffness of the model with its published value, N/m.
STIFFNESSES = {
    "wall_stiffness": 1.8e6,
    "vertical_stiffness_0": 4.5e5,
    "vertical_stiffness_1": 3.0e4,
    "horizontal_stiffness_0": 3.0e5,
    "horizontal_stiffness_1": 2.4e6,
    "ceiling_stiffness_0": 6.0e4,
    "ceiling_stiffness_1": 1.8e5,
    "link_horizontal_stiffness": 1.5e6,
    "link_vertical_stiffness": 2.4e5,
}


def parameters(friction: bool = True) -> dict[str, object]:
    """Return the distributions: friction uniform, or not at all; stiffnesses normal."""
    lower, upper = FRICTION
    known = {"friction": stats.uniform(lower, upper - lower)} if friction else {}
    return known | {name: stats.norm(value, SPREAD * value) for name, value in STIFFNESSES.items()}


def squeal(samples: int, store: Path | None = None) -> xr.Dataset:
    """Verdict, limit cycle and frequency of independent samples."""
    study = ss.Study(
        ss.models.two_subsystems,
        parameters(),
        outputs=["growth_rate", "frequency", "attractor", "amplitude", "cycle_frequency", "sequence"],
        samples=samples,
        seed=1,
        duration=0.6,
    )
    return study.run(store)


def importance(samples: int) -> dict[str, xr.Dataset]:
    """Sobol' indices of the friction from which the model squeals, and of the frequency there."""
    study = ss.Study(
        ss.models.two_subsystems,
        parameters(friction=False),
        outputs=["hopf_point", "hopf_frequency"],
        samples=samples,
        sampler="saltelli",
        seed=1,
        hopf={"friction": (0.0, 4.0)},
    )
    results = study.run()
    return {name: ss.study.sobol_indices(results, name) for name in ("hopf_point", "hopf_frequency")}


def answer(results: xr.Dataset, indices: dict[str, xr.Dataset]) -> str:
    """Return the answers in words."""
    chance = ss.study.probability(results, "friction", bins=np.linspace(*FRICTION, 23))
    always = chance.left.to_numpy()[(chance.probability == 1.0).to_numpy()]
    never = chance.right.to_numpy()[(chance.probability == 0.0).to_numpy()]
    whole = ss.study.probability(results)
    lines = [
        f"P(unstable) = {whole.probability.item():.3f} "
        f"[{whole.lower.item():.3f}, {whole.upper.item():.3f}] over all friction",
        f"never below friction {never.max() if never.size else FRICTION[0]:.2f}, "
        f"always above {always.min() if always.size else FRICTION[1]:.2f}",
    ]
    kinds, counts = np.unique(results.attractor.to_numpy(), return_counts=True)
    lines.append(
        "settles to " + ", ".join(f"{n} x {kind or 'nothing'}" for kind, n in zip(kinds, counts, strict=True))
    )
    for name, scale, unit in (("cycle_frequency", 1.0, "Hz"), ("amplitude", 1e6, "um")):
        labels = {"dof": "x2"} if name == "amplitude" else {}
        found = ss.study.distribution(results, name, condition=squealing, **labels)
        low, middle, high = scale * found.value.to_numpy()
        lines.append(f"{name}: median {middle:.4g} {unit}, 5 % to 95 %: {low:.4g} to {high:.4g} {unit}")
    for name, index in indices.items():
        ranked = index.sortby("total", ascending=False)
        first = ", ".join(
            f"{parameter} {total:.2f}"
            for parameter, total in zip(
                ranked.parameter.to_numpy()[:3], ranked.total.to_numpy()[:3], strict=True
            )
        )
        lines.append(f"{name}: total Sobol' indices {first}")
    return "\n".join(lines)


def squealing(results: xr.Dataset) -> xr.DataArray:
    """Return whether a sample has settled to a limit cycle."""
    return results.attractor == "cycle"


def drawn(results: xr.Dataset, indices: dict[str, xr.Dataset]) -> plt.Figure:
    """Draw the four answers."""
    figure, rows = plt.subplots(2, 2, figsize=(10.0, 7.6), layout="constrained")
    (when, height), (strength, which) = rows
    figures.probability(when, ss.study.probability(results, "friction", bins=22))
    when.set(title="When does it squeal?", ylabel="probability of instability")
    cycles = results.where(squealing(results), drop=True)
    figures.distribution(height, cycles, "cycle_frequency")
    height.set_title("At which frequency?")
    strength.plot(
        cycles.friction, 1e6 * cycles.amplitude.sel(dof="x2"), ".", markersize=1.5, color=figures.DARK
    )
    strength.set(xlabel="friction", ylabel="amplitude of x2, $\\mu$m", title="How strongly?")
    figures.sobol_indices(which, indices["hopf_point"])
    which.set_title("Which spring matters?")
    return figure


def main() -> None:
    """Run both studies, print the answers, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--store", type=Path, default=None, help="zarr store that survives an interruption")
    parser.add_argument("--figure", type=Path, default=None, help="where to draw, .png or .pdf")
    options = parser.parse_args()
    results = squeal(options.samples, options.store)
    indices = importance(max(16, 2 ** int(np.log2(options.samples / 64))))
    print(answer(results, indices))
    if options.figure is not None:
        drawn(results, indices).savefig(options.figure, dpi=110)


if __name__ == "__main__":
    main()
