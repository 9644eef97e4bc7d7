# %% [markdown]
# # Earthquakes in a row of blocks: how large are the slips?
#
# Burridge and Knopoff (1967) put blocks on a moving plate, tied to each other and to a wall by springs. Each
# block sticks until the springs overcome static friction; when it slips it loads its neighbours, which may
# slip with it. This example follows 1000 blocks through thousands of slips and asks how large they are. Run
# it as a script, or open it as a notebook (jupytext, VS Code, Spyder): it draws `burridge-knopoff.png`.

# %%
import time

import matplotlib.pyplot as plt
import numpy as np
import scipy.sparse as sp

import stickslip as ss

# %% [markdown]
# ## The model
#
# All blocks have the mass 1 kg and a spring of 1 N/m to the wall; the springs between them are nine times as
# stiff. A contact without a normal direction is friction under a given normal force. The scene is sparse, and
# `method="local"` lets every event cost what it touches: some dozen blocks, not a thousand.

# %%
BLOCKS, SPEED, DURATION = 1000, 0.01, 250.0
scene = ss.models.burridge_knopoff(blocks=BLOCKS, slider_speed=SPEED)
rng = np.random.default_rng(1967)
# Stretched at random, but nowhere beyond static friction.
start = ss.State(rng.uniform(-0.02, 0.02, BLOCKS), np.full(BLOCKS, SPEED), "s" * BLOCKS)
begin = time.perf_counter()
run = ss.simulate(scene, DURATION, start, method="local")
print(f"{len(run.events)} events in {time.perf_counter() - begin:.0f} s")
counters = run.counters
per_event = (counters["expansions"] - BLOCKS * counters["panels"]) / (counters["phases"] - 1)
print(f"an event expands {per_event:.0f} of {BLOCKS} blocks anew")

# %% [markdown]
# ## Slips and their sizes
#
# Blocks slip together where one starts before its neighbour has come to rest. The size of such a slip is the
# number of slides in it: how often a block left the plate's motion and was caught again.

# %%
events = run.events
slides: list[tuple[int, float, float]] = []
began = np.full(BLOCKS, np.nan)
for at, block, kind in zip(events.time, events.contact, events.kind, strict=True):
    if kind in ("slip+", "slip-"):
        began[block] = at
    elif kind == "velocity" and np.isfinite(began[block]):
        slides.append((int(block), float(began[block]), float(at)))
        began[block] = np.nan

of_block: dict[int, list[int]] = {}
for k, (block, _, _) in enumerate(slides):
    of_block.setdefault(block, []).append(k)
pairs = [
    (k, j)
    for k, (block, first, last) in enumerate(slides)
    for j in of_block.get(block + 1, [])
    if slides[j][1] <= last and slides[j][2] >= first
]
ones = np.ones(len(pairs))
graph = sp.coo_array((ones, tuple(np.array(pairs).reshape(-1, 2).T)), shape=(len(slides), len(slides)))
count, label = sp.csgraph.connected_components(graph, directed=False)
size = np.bincount(label, minlength=count)
print(f"{len(slides)} slides of blocks in {count} slips, the largest of {size.max()} slides")

figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 4.0), layout="constrained")
for block, first, last in slides:
    left.plot([block, block], [first, last], color="C0", linewidth=0.6)
left.set(xlabel="block", ylabel="time, s", title="which blocks slip, and when")
sizes = np.sort(size)
right.loglog(sizes, 1.0 - np.arange(count) / count, ".")
right.set(xlabel="slides of a slip", ylabel="part of the slips that are at least as large")
figure.savefig("burridge-knopoff.png", dpi=120)

# %% [markdown]
# ## What it means
#
# The blocks wait until the plate has carried the springs to static friction. Most slips are short: 60 % are a
# single slide of one block, and 4 % have a hundred slides or more. The two largest hold 38 % of all slides:
# fronts run along the row, and every block that they pass slips and is caught. Sizes spread over almost four
# decades, as those of earthquakes do.
#
# An event expands 59 blocks anew on average. That number is set by springs, masses and the time step; it does
# not grow with the row.
