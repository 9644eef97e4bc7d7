# %% [markdown]
# # A finite-element pad on a belt: from a mesh to squeal
#
# A block of friction material is held at its back and pressed on a belt. This example meshes the block with
# scikit-fem, pairs its face with the belt, finds the friction from which steady sliding is
# unstable, and follows the motion of a reduced model into squeal. It needs `pip install 'stickslip[fe]'`.
# Run it as a script, or open it as a notebook (jupytext, VS Code, Spyder): it draws `pad-modes.png` and
# `pad-squeal.png`.

# %%
import matplotlib.colors
import matplotlib.pyplot as plt
import numpy as np
import skfem

import stickslip as ss

# %% [markdown]
# ## Mesh, matrices and contacts
#
# The block is 40 mm long, 20 mm high and 10 mm thick, in plane strain. Its back is held, and it stands on
# the belt with an interference of 2 µm, which presses it on. Units are SI.

# %%
mesh = skfem.MeshQuad.init_tensor(np.linspace(0.0, 0.04, 13), np.linspace(0.0, 0.02, 7)).with_defaults()
pad = ss.fe.Body.elastic(
    mesh, young=1e9, poisson=0.3, density=2500.0, thickness=0.01, damping=ss.Rayleigh(stiffness=4e-7)
)
pad = pad.held(pad.surface("top"))
pairs = ss.fe.contact_pairs(pad.surface("bottom"), None, velocity=(0.5, 0.0), friction=0.5, gap=-2e-6)
scene = ss.fe.assemble(pad, pairs)
steady = ss.steady_sliding(scene)
print(f"{scene.size} dofs, {len(scene.contacts)} contacts, {steady.combination} in steady sliding")

# %% [markdown]
# ## A reduced model
#
# It keeps the contacts, without mass of their own, and adds modes until the eigenvalues of the full model up
# to 30 kHz are met: frequencies within 2 %, growth rates within 50 %, of the mode that grows most within 5 %.
# A boundary with lumped mass would take the growth from the mode at 24 kHz.

# %%
reduced = ss.fe.reduce(
    scene,
    band=(0.0, 30e3),
    tolerance=2e-2,
    growth_tolerance=0.5,
    boundary="massless",
    combination=steady.combination,
)
print(reduced)

# %% [markdown]
# ## From which friction on does it squeal
#
# The Hopf points are where a mode of steady sliding begins to grow. At friction 0.5 the last contact, at the
# end to which the belt runs, is open.

# %%
for point in ss.critical_points(reduced.scene, {"friction": (0.0, 0.39)}, kinds=("hopf",)):
    print(point)
rows = []
for friction in np.linspace(0.0, 0.6, 31):
    slipping = reduced.scene.replace(friction=friction)
    combination = ss.steady_sliding(slipping).combination
    for mode in ss.complex_modes(slipping, combination).select((1e3, 30e3)):
        rows.append((friction, 1e-3 * mode.frequency, mode.eigenvalue.real))
of, frequency, growth = np.array(rows).T
modes = ss.complex_modes(reduced.scene, steady.combination)
worst = max(modes, key=lambda mode: mode.eigenvalue.real)
figure = plt.figure(figsize=(10.0, 4.0), layout="constrained")
axes = figure.add_subplot(1, 2, 1)
axes.plot(of[growth <= 0.0], frequency[growth <= 0.0], ".", color="#4477aa", markersize=3, label="decays")
axes.plot(of[growth > 0.0], frequency[growth > 0.0], "^", color="#cc3311", markersize=4, label="grows")
axes.set(xlabel="friction", ylabel="frequency, kHz", ylim=(0.0, 32.0))
axes.legend(frameon=False, loc="lower right", ncols=2)
shape = reduced.expand(modes)["shape"].isel(mode=worst.number).to_numpy()
title = f"{worst.frequency:.0f} Hz, grows at {worst.eigenvalue.real:.0f} 1/s"
scene.plot.mesh(shape, ax=figure.add_subplot(1, 2, 2), title=title)
figure.savefig("pad-modes.png", dpi=120)

# %% [markdown]
# ## From steady sliding into squeal
#
# The disturbance grows until contacts stick and open. Which contact does what, and when, is the picture of
# the squeal.

# %%
start = ss.steady_sliding(reduced.scene).perturbed(velocity={"q0": 1e-3})
run = ss.simulate(reduced.scene, 2e-3, start)
print(run)
times = np.linspace(0.0, run.duration, 4001)
motion = run.sample(times)
figure, (above, below) = plt.subplots(2, 1, figsize=(9.0, 6.0), sharex=True, layout="constrained")
above.plot(1e3 * times, motion.normal_force.sum("contact"), color="#4477aa", label="normal forces")
above.plot(1e3 * times, motion.friction_force.sum("contact"), color="#cc3311", label="friction forces")
above.set(ylabel="sum over all contacts, N")
above.legend(frameon=False, ncols=2)
letters = "+-sd"
colours = matplotlib.colors.ListedColormap(["#bbccee", "#ee99aa", "#222255", "white"])
status = np.vectorize(letters.index)(motion.status.to_numpy())
extent = (0.0, 1e3 * run.duration, 0.0, 40.0)
picture = below.imshow(
    status.T, colours, vmin=-0.5, vmax=3.5, aspect="auto", origin="lower", interpolation="none", extent=extent
)
bar = figure.colorbar(picture, ax=below, ticks=range(4))
bar.ax.set_yticklabels(["slides +", "slides -", "sticks", "open"])
below.set(xlabel="time, ms", ylabel="place on the face, mm")
figure.savefig("pad-squeal.png", dpi=120)
balance = run.balance(1e-3, 2e-3)
for name in ("slider", "friction_heat", "damping"):
    print(f"{name}: {1e3 * getattr(balance, name):.1f} W over the last millisecond")

# %% [markdown]
# ## What it means
#
# Two modes begin to grow at nearly the same friction, 0.233 and 0.236, and at 0.5 both are unstable. The mode
# at 20 kHz grows faster, so a linear analysis would expect its tone. The motion goes another way: once
# contacts open, it repeats at some 14 kHz, below the other mode. The pad does not stick and slip as a whole.
# In every period nearly the whole face lifts off for a moment; only contacts beside its two ends stick, and
# only for some microseconds. A mesh as coarse as this one shows the kind of motion; its numbers change as the
# mesh is refined.
