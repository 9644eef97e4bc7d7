# %% [markdown]
# # A pad on a rotating disc: from two meshes to a limit cycle
#
# A lining is pressed on an elastic disc that is held at its hub and rotates. This example meshes both bodies,
# pairs the nodes of the lining with faces of the disc (the two meshes do not match), finds the modes that
# grow, with a count that says whether one is missing, reduces the model from 9964 to 144 dofs, follows the
# motion to its limit cycle, and asks which contacts feed it. It needs `pip install 'stickslip[fe]'`. Run it
# as a script, or open it as a notebook (jupytext, VS Code, Spyder): it draws `squealing-disc.png`, and writes
# the limit cycle and the mode that grows for Paraview into the folder `squeal`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %% [markdown]
# ## Bodies and contacts
#
# Both bodies are hexahedra of a ring. The disc turns at 5 rad/s, and a pressure of 1 MPa presses the lining
# on it. The back of the lining is guided: it moves along the axis of the disc only. Friction acts in the
# plane of the surface, against the slip velocity, whatever direction that has; each of the 28 pairs is a
# contact with two directions.

# %%
turning = ss.fe.Rotation(5.0)
iron = {"young": 120e9, "poisson": 0.25, "density": 7200.0, "damping": ss.Rayleigh(60.0, 1e-7)}
lining = {"young": 0.9e9, "poisson": 0.3, "density": 2500.0, "damping": ss.Rayleigh(stiffness=5e-6)}
disc = ss.fe.ring((10, 80, 3), radii=(0.06, 0.16), angles=(0.0, 2.0 * np.pi), heights=(0.0, 0.019))
pad = ss.fe.ring((3, 6, 4), radii=(0.10, 0.15), angles=np.radians((-21.0, 21.0)), heights=(0.019, 0.038))
disc = ss.fe.Body.elastic(disc, **iron, rotation=turning, name="disc")
pad = ss.fe.Body.elastic(pad, **lining, name="pad")
disc, pad = disc.held(disc.surface("inner")), pad.held(pad.surface("top"), directions=(1, 2))
faces = pad.surface("bottom"), disc.surface("top")
pairs = ss.fe.contact_pairs(*faces, velocity=turning, friction=0.34)
scene = ss.fe.assemble([pad, disc], pairs, force=pad.surface("top").pressure(1e6))

# %% [markdown]
# ## Modes of steady sliding, and a reduced model
#
# The reduced model keeps every contact, and 60 modes of the structure with held contacts. The reduction
# computes all eigenvalues of the full model in the band, counts how many of them it did not find, and says
# how far those of the reduced model are off. The reduced model is small enough for its modes over friction.

# %%
steady = ss.steady_sliding(scene)
reduced = ss.fe.reduce(scene, band=(500.0, 6e3), combination=steady.combination, modes=60)
print(reduced)
branches = ss.sweep(reduced.scene, {"friction": np.linspace(0.0, 0.5, 26)}, band=(3e3, 5e3))

# %% [markdown]
# ## The limit cycle
#
# The motion starts from steady sliding with the growing mode added to it. The work of every contact over one
# period, along both directions, says which contacts feed the squeal.

# %%
run = ss.simulate(reduced.scene, 0.05, ss.disturbed_sliding(reduced.scene))
cycle = run.limit_cycle()
power = cycle.balance().contacts.work.sum("status").to_numpy().reshape(-1, 2).sum(1) / cycle.period
feeds = power > 0.0
print(run, f"{cycle.stability} cycle at {cycle.frequency:.2f} Hz, {len(cycle.phases)} phases", sep="\n")
print(f"{feeds.sum()} contacts feed {power[feeds].sum():.3g} W, the others {power[~feeds].sum():.3g} W")
modes = reduced.expand(ss.complex_modes(reduced.scene, steady.combination))
growing = int(modes.eigenvalue.real.argmax("mode"))
period = cycle.run.sample(np.linspace(0.0, cycle.period, 48))
ss.fe.write_vtu("squeal/cycle.pvd", scene, reduced.expand(period))
ss.fe.write_vtu("squeal/mode.pvd", scene, modes, mode=growing)

# %%
figure = plt.figure(figsize=(11.0, 11.5), layout="constrained")
upper, lower = figure.subfigures(2, 1, height_ratios=[1.0, 2.0])
# Shape, forces, cycle, power.
axes = lower.subplot_mosaic("sf;cp", per_subplot_kw={"s": {"projection": "3d"}})
ss.plot(branches, figure=upper)
scene.plot.mesh(modes["shape"][growing], ax=axes["s"], title="The mode that grows")
times = np.linspace(0.0, run.duration, 20001)
axes["f"].plot(1e3 * times, run.sample(times).normal_force.sum("contact"), linewidth=0.3)
axes["f"].set(xlabel="time, ms", ylabel="sum of normal forces, N")
cycle.plot(contact=2 * int(power.argmax()), ax=axes["c"])
pairs.plot(power, ax=axes["p"], label="power of every contact, W")
figure.savefig("squealing-disc.png", dpi=110)

# %% [markdown]
# ## What it means
#
# At friction 0.34 a mode grows at 4650 Hz in which the lining moves most, by 47.5 1/s, and a wave of the disc
# at 3219 Hz, by 4.9 1/s. The motion grows for 25 ms. Then contacts begin to stick and to lift off, and it
# settles to a stable limit cycle at 4673 Hz with 24 phases. 24 of the 28 contacts bring 97 W into the
# structure, most of it in the middle of the lining, and the others take 4 W back.
#
# What the reduction changes: it lumps the mass that the modes leave at the contacts. No frequency moves by
# more than 2.2 %. But growth is what friction feeds less what damping takes, a small difference: the growing
# mode has 86.3 instead of 47.5 1/s, and grows from friction 0.314 on instead of 0.325. So look at
# `reduced.errors` at the friction that you want before you trust a motion.
