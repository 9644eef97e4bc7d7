# %% [markdown]
# # A chain of blocks: how slip spreads
#
# A row of blocks is tied together by springs, and each block hangs on a spring of its own above a slow belt.
# Static friction exceeds kinetic friction, and differs a little from block to block. Blocks stick until one
# gives way and takes its neighbours along: the model of Burridge and Knopoff for earthquakes, and of a brake
# lining that creaks. Run it as a script, or open it as a notebook (jupytext, VS Code, Spyder): it draws
# `chain-slip.png` and `chain-sizes.png`.

# %%
import matplotlib.pyplot as plt
import numpy as np
from scipy import ndimage

import stickslip as ss

# %% [markdown]
# ## The model
#
# The random numbers are the same in every run. Units are SI.

# %%
BLOCKS, BELT, DURATION = 40, 0.01, 40.0
random = np.random.default_rng(1)
static = random.uniform(0.5, 0.6, BLOCKS)
links = 400.0 * (2.0 * np.eye(BLOCKS) - np.eye(BLOCKS, k=1) - np.eye(BLOCKS, k=-1))
links[0, 0] = links[-1, -1] = 400.0
scene = ss.Scene(
    mass=np.ones(BLOCKS),
    stiffness=links + 50.0 * np.eye(BLOCKS),
    damping=ss.Proportional(stiffness=5e-3),
    contacts=[
        ss.Contact(tangential=k, normal_force=10.0, friction=0.4, static_friction=mu, slider_speed=BELT)
        for k, mu in enumerate(static)
    ],
)
start = ss.State(random.uniform(0.0, 4e-3, BLOCKS), np.full(BLOCKS, BELT), "s" * BLOCKS)
run = ss.simulate(scene, start, DURATION)
print(run)

# %% [markdown]
# ## Who slips when
#
# Black is slip. A slip begins at one block and spreads to its neighbours.

# %%
times = np.arange(0.0, DURATION, 0.01)
slips = run.sample(times).status.to_numpy() != "s"
figure, axes = plt.subplots(figsize=(9.0, 4.2), layout="constrained")
axes.imshow(
    slips.T, "Greys", aspect="auto", origin="lower", interpolation="none", extent=(0.0, DURATION, 0, BLOCKS)
)
axes.set(xlabel="time, s", ylabel="block")
figure.savefig("chain-slip.png", dpi=120)

# %% [markdown]
# ## How large slips are
#
# A slip is a set of blocks and instants that hang together; its size is the number of its blocks.

# %%
labels, count = ndimage.label(slips)
sizes = np.array([(labels == k).any(axis=0).sum() for k in range(1, count + 1)])
figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
axes.hist(sizes, bins=np.arange(0.5, BLOCKS + 1.5), color="#4477aa")
axes.set(xlabel="blocks that take part in a slip", ylabel="number of slips", yscale="log")
figure.savefig("chain-sizes.png", dpi=120)
print(f"{count} slips, {np.sum(sizes == 1)} of a single block, {np.sum(sizes == BLOCKS)} of all blocks")

# %% [markdown]
# ## What it means
#
# Slips are either small or run through most of the chain. Half of them stay with one block, and no slip has
# between eleven and twenty-two. A large slip runs through the chain as a pulse: each block slips for a
# fraction of a second, and sticks again behind the pulse while the blocks ahead still wait. A model with one
# block would show a regular sawtooth, and a sum over all blocks would hide that they never slip all at once.
