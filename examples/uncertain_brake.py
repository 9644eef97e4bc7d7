# %% [markdown]
# # An uncertain brake: when does it squeal, at which frequency, and which spring matters
#
# Every stiffness of the published two-subsystem model is known to 5 %, and friction may be anything between
# 0.3 and 2.5. This example draws samples of the ten numbers, finds the verdict and the limit cycle of each,
# and ranks the springs by a Saltelli design. Run it as a script, or open it as a notebook (jupytext, VS
# Code, Spyder): it draws `uncertain-brake.png`.

# %%
import matplotlib.pyplot as plt
import numpy as np
from scipy import stats

import stickslip as ss

# %% [markdown]
# ## What is known
#
# The stiffnesses with their published values, N/m. Each is normal with a standard deviation of 5 %; friction
# is uniform.

# %%
SAMPLES, DESIGN = 1000, 64
FRICTION = (0.3, 2.5)
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
springs = {name: stats.norm(value, 0.05 * value) for name, value in STIFFNESSES.items()}
friction = {"friction": stats.uniform(FRICTION[0], FRICTION[1] - FRICTION[0])}

# %% [markdown]
# ## Verdicts, limit cycles and frequencies
#
# `run("squeal.zarr")` would keep the samples on the disk, and go on where it was interrupted.

# %%
results = ss.Study(
    ss.models.two_subsystems,
    friction | springs,
    outputs=["growth_rate", "frequency", "attractor", "amplitude", "cycle_frequency", "sequence"],
    samples=SAMPLES,
    seed=1,
    duration=0.6,
).run()
squealing = results.attractor == "cycle"
chance = ss.study.probability(results, "friction", bins=np.linspace(*FRICTION, 23))
whole = ss.study.probability(results)
print(
    f"P(unstable) = {whole.probability.item():.3f} [{whole.lower.item():.3f}, {whole.upper.item():.3f}]"
    " over all friction"
)
print(f"never below friction {chance.right[chance.probability == 0.0].max().item():.2f}")
print(f"always above friction {chance.left[chance.probability == 1.0].min().item():.2f}")
kinds, counts = np.unique(results.attractor.values, return_counts=True)
print("settles to " + ", ".join(f"{n} x {kind or 'nothing'}" for kind, n in zip(kinds, counts, strict=True)))
for name, scale, unit, labels in (
    ("cycle_frequency", 1.0, "Hz", {}),
    ("amplitude", 1e6, "µm", {"dof": "x2"}),
):
    found = ss.study.distribution(results, name, condition=lambda data: data.attractor == "cycle", **labels)
    low, middle, high = scale * found.value.values
    print(f"{name}: median {middle:.4g} {unit}, 5 % to 95 %: {low:.4g} to {high:.4g} {unit}")

# %% [markdown]
# ## Which spring matters
#
# Sobol' indices of the friction from which the model squeals, and of the frequency there.

# %%
thresholds = ss.Study(
    ss.models.two_subsystems,
    springs,
    outputs=["hopf_point", "hopf_frequency"],
    samples=DESIGN,
    sampler="saltelli",
    seed=1,
    hopf={"friction": (0.0, 4.0)},
).run()
indices = {name: ss.study.importance(thresholds, name) for name in ("hopf_point", "hopf_frequency")}
for name, of in indices.items():
    ranked = of.sortby("total", ascending=False).isel(parameter=slice(3))
    pairs = zip(ranked.parameter.values, ranked.total.values, strict=True)
    first = [f"{spring} {total:.2f}" for spring, total in pairs]
    print(f"{name}: total Sobol' indices {', '.join(first)}")

# %%
figure, ((when, height), (strength, which)) = plt.subplots(2, 2, figsize=(10.0, 7.6), layout="constrained")
ss.plot(chance, ax=when)
when.set(title="When does it squeal?", ylabel="probability of instability")
cycles = results.where(squealing, drop=True)
ss.plot(cycles, "cycle_frequency", ax=height)
height.set_title("At which frequency?")
strength.plot(cycles.friction, 1e6 * cycles.amplitude.sel(dof="x2"), ".", markersize=2, color="#004488")
strength.set(xlabel="friction coefficient", ylabel="amplitude of x2, µm", title="How strongly?")
ss.plot(indices["hopf_point"], ax=which)
which.set_title("Which spring matters?")
figure.savefig("uncertain-brake.png", dpi=110)

# %% [markdown]
# ## What it means
#
# Friction decides whether the brake squeals: no sample squeals below 0.5, all do above 1.0, and the springs
# only blur the threshold between. The tone is 112 Hz whatever the friction; the springs make it 108 to
# 115 Hz. How strong the squeal is has two answers: small cycles of 20 µm, in which the second contact sticks
# alone, and cycles of 45 to 70 µm in which both contacts stick. Between friction 0.7 and 1.06 the springs
# choose which, and a mean amplitude would describe no brake at all. Three springs of nine carry nine tenths
# of the variance of the threshold, so these are the ones to measure.
