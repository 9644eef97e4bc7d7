# %% [markdown]
# # A fault: how stiff the rock may be before slip comes in events
#
# Two sides of a fault are pulled past each other at a constant speed. Friction of rock rises at once with the
# slip speed, and falls as contacts are renewed by slip: rate and state. Where the rock around the fault is
# stiff, slip is steady. Below a critical stiffness it comes in events, in which slip is faster by orders of
# magnitude than between them. Run this example as a script, or open it as a notebook (jupytext, VS Code,
# Spyder): it draws `fault.png`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %% [markdown]
# ## Cells on a line
#
# The fault is one unit long. Its cells slip in the direction out of the plane, and each presses its slip on
# all others through the elastic rock: a cell of the width w that slips by one unit changes the stress at the
# distance d by `G / (2 pi) (1 / (d - w/2) - 1 / (d + w/2))`, so that the stiffness matrix is dense. Waves
# that leave the fault carry energy away, as dampers do. Stresses are in units of the normal stress, speeds in
# units of the pull, and slips in units of the length over which contacts are renewed.

# %%
CELLS = 10
DIRECT, EVOLUTION = 0.05, 0.08
INERTIA, RADIATION = 5e-3, 2e-3
rock = ss.friction.RateState(reference=0.3, direct=DIRECT, evolution=EVOLUTION, length=1.0, speed=1.0)


def fault(stiffness: float = 0.5) -> ss.Scene:
    """Return a fault whose softest mode of slip has this part of the stiffness `EVOLUTION - DIRECT`."""
    width = 1.0 / CELLS
    distance = width * np.subtract.outer(np.arange(CELLS), np.arange(CELLS))
    springs = 1.0 / (distance + 0.5 * width) - 1.0 / (distance - 0.5 * width)
    springs *= stiffness * (EVOLUTION - DIRECT) / np.linalg.eigvalsh(springs)[0]
    contacts = [
        # In the frame of the moving rock the other side moves back.
        ss.Contact(tangential=k, normal_force=width, friction=rock, slider_speed=-1.0)
        for k in range(CELLS)
    ]
    return ss.Scene(
        np.full(CELLS, width * INERTIA),
        width * springs,
        damping=width * RADIATION * np.eye(CELLS),
        contacts=contacts,
    )


# %% [markdown]
# ## Where steady slip ends
#
# A single block on a spring slips steadily down to the stiffness `(b - a) N / L`, a little more with inertia
# and a little less with radiation.

# %%
points = ss.critical_points(fault, {"stiffness": (0.5, 1.2)}, kinds=("hopf",))
end, period = points[-1].value, 1.0 / points[-1].frequency
print(f"steady slip ends at {end:.5f} of (b - a) N / L, with a period of {period:.2f}")

# %% [markdown]
# ## Slip at four stiffnesses
#
# Each motion begins near steady slip. What is left after the first part is a cycle of slips, or steady slip.

# %%
DURATION, LAST = 150.0, 50.0
times = np.linspace(DURATION - LAST, DURATION, 2001)
stiffnesses = (0.5, 0.7, 0.9, 1.1)
speeds = {}
for stiffness in stiffnesses:
    scene = fault(stiffness)
    start = ss.steady_sliding(scene).perturbed(velocity={scene.dofs[CELLS // 3]: 0.2})
    run = ss.simulate(scene, DURATION, start)
    speeds[stiffness] = 1.0 + run.sample(times).velocity.to_numpy()
    fast, slow = speeds[stiffness].max(), speeds[stiffness].min()
    print(f"{stiffness}: slip speeds from {slow:.4f} to {fast:.3f}")

# %%
figure, panels = plt.subplots(
    len(stiffnesses), 1, figsize=(7.0, 7.0), sharex=True, sharey=True, layout="constrained"
)
edges = np.linspace(0.0, 1.0, CELLS + 1)
for axes, (stiffness, speed) in zip(panels, speeds.items(), strict=True):
    shown = axes.pcolormesh(
        np.append(times, DURATION + LAST / 2000) - times[0],
        edges,
        np.log10(speed.T),
        cmap="RdBu_r",
        vmin=-2.0,
        vmax=2.0,
        rasterized=True,
    )
    axes.set(ylabel="place", title=f"stiffness {stiffness} (b - a) N / L")
panels[-1].set_xlabel("time, renewal length over speed of pull")
figure.colorbar(shown, ax=panels, label="slip speed over speed of pull, power of ten")
ss.save(figure, "fault.png", dpi=120)

# %% [markdown]
# ## What it means
#
# Above the critical stiffness a disturbance fades. Below it slip comes in cycles, and the softer the rock,
# the longer they are and the faster its slip. Nothing sticks on the way: between events slip goes on slowly,
# and its rate, `a N / (m s)`, sets the number of panels.
