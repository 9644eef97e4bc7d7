# %% [markdown]
# # A pad on a rotating disc: from two meshes to a limit cycle
#
# A lining is pressed on an elastic disc that is held at its hub. This example meshes and assembles both
# bodies with scikit-fem, pairs the nodes of the lining with faces of the disc (the two meshes do not match),
# finds the modes that grow, with a count that says whether one is missing, reduces the model from 9964 to
# 116 dofs, follows the motion to its limit cycle, and asks which contacts feed it. It needs
# `pip install 'stickslip[fe]'`. Run it as a script, or open it as a notebook (jupytext, VS Code, Spyder): it
# draws `squealing-disc.png`, and writes the limit cycle and the mode that grows for Paraview into the folder
# `squeal`.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import stickslip as ss

# %% [markdown]
# ## Bodies
#
# Both meshes are parts of a ring of hexahedra; after a full turn the disc closes.


# %%
def ring(counts, radii, angles, heights):
    """Return hexahedra of a part of a ring, so many along radius, angle and thickness."""
    axes = [np.linspace(*ends, n + 1) for ends, n in zip((radii, angles, heights), counts, strict=True)]
    mesh = skfem.MeshHex.init_tensor(*axes)
    r, angle, z = mesh.p
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z])
    _, first, place = np.unique(np.round(points, 9), axis=1, return_index=True, return_inverse=True)
    return skfem.MeshHex(points[:, first], place.ravel()[mesh.t])


def elastic(mesh, young, poisson, density, damping, name):
    """Return the body of a mesh of one elastic material."""
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=2)
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    mass = density * skfem.BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis)
    return ss.fe.Body.from_skfem(basis, mass, stiffness, damping=damping, name=name)


ANGLE = np.radians(21.0)
disc_mesh = ring((10, 80, 3), (0.06, 0.16), (0.0, 2 * np.pi), (0.0, 0.019)).with_boundaries(
    {"hub": lambda x: np.hypot(x[0], x[1]) < 0.0601, "top": lambda x: x[2] > 0.0189}
)
pad_mesh = ring((3, 6, 4), (0.10, 0.15), (-ANGLE, ANGLE), (0.019, 0.038)).with_boundaries(
    {"face": lambda x: x[2] < 0.0191, "back": lambda x: x[2] > 0.0379}
)
disc = elastic(disc_mesh, 120e9, 0.25, 7200.0, ss.Proportional(mass=60.0, stiffness=1e-7), "disc")
disc = disc.held(disc.surface("hub"))
pad = elastic(pad_mesh, 0.9e9, 0.3, 2500.0, ss.Proportional(stiffness=5e-6), "pad")
# The back of the pad is guided: it moves along the axis of the disc only.
pad = pad.held(pad.surface("back"), directions=(1, 2))

# %% [markdown]
# ## Contacts, modes of steady sliding, and a reduced model
#
# The disc turns at 5 rad/s, and a pressure of 1 MPa presses the pad on it. The reduced model keeps every
# contact, and 60 modes of the structure with held contacts. The reduction computes all eigenvalues of the
# full model in the band, and `missing` is the number of those that it did not find; `errors` says how far
# those of the reduced model are off.

# %%
BAND = (500.0, 6e3)
pairs = ss.fe.contact_pairs(
    pad.surface("face"), disc.surface("top"), velocity=ss.fe.Rotation(5.0), friction=0.3
)
scene = ss.fe.assemble([pad, disc], pairs, force=pad.surface("back").pressure(1e6))
steady = ss.sliding_equilibrium(scene)
reduced = ss.fe.reduce(scene, BAND, combination=steady.combination, modes=60)
full, small = reduced.errors.full.to_numpy(), reduced.errors.reduced.to_numpy()
grows = full.real.argmax()
print(f"{scene.size} dofs, {len(scene.contacts)} contacts, {steady.combination.count('d')} of them open")
print(f"{full.size} modes in the band, {abs(reduced.errors.missing):.0e} missing")
frequency = full[grows].imag / (2.0 * np.pi)
print(f"{(full.real > 0).sum()} grows, at {frequency:.0f} Hz and {full[grows].real:.1f} 1/s")
print(f"reduced to {reduced.scene.size} dofs, where it grows at {small[grows].real:.1f} 1/s")

# %% [markdown]
# The reduced model is small enough for its modes at many values of friction.

# %%
modes = ss.complex_modes(reduced.scene, steady.combination)
growing = max(modes, key=lambda mode: mode.eigenvalue.real)
loci = []
for friction in np.linspace(0.0, 0.5, 26):
    slipping = reduced.scene.replace(friction=friction)
    for mode in ss.complex_modes(slipping, ss.sliding_equilibrium(slipping).combination).select(BAND):
        loci.append((friction, mode.frequency, mode.eigenvalue.real))
loci = np.array(loci)

# %% [markdown]
# ## The limit cycle
#
# The motion starts from steady sliding with the growing mode added to it. The work of every contact over one
# period says which contacts feed the squeal.

# %%
DURATION = 0.08
run = ss.simulate(reduced.scene, ss.disturbed_sliding(reduced.scene), DURATION)
cycle = run.limit_cycle()
print(f"{len(run.events)} events in {1e3 * DURATION:g} ms, energy to {run.balance().residual:.0e} J")
print(
    f"cycle at {cycle.frequency:.2f} Hz with {len(cycle.phases)} phases, {cycle.stability}, "
    f"largest multiplier {abs(cycle.largest_multiplier):.4f}"
)
power = cycle.balance().contacts.work.sum("status").to_numpy() / cycle.period
print(
    f"{(power > 0).sum()} contacts feed {power[power > 0].sum():.3g} W, "
    f"the others take {-power[power < 0].sum():.3g} W"
)
period = cycle.run.sample(np.linspace(0.0, cycle.period, 48))
Path("squeal").mkdir(exist_ok=True)
ss.fe.write_vtu("squeal/cycle.pvd", scene, reduced.expand(period))
ss.fe.write_vtu("squeal/mode.pvd", scene, reduced.expand(modes), mode=growing.number)

# %%
figure = plt.figure(figsize=(11.0, 11.5), layout="constrained")
axes = figure.add_subplot(3, 2, 1)
up = loci[:, 2] > 0.0
axes.plot(*loci[~up, :2].T, ".", color="#4477aa", markersize=3, label="decays")
axes.plot(*loci[up, :2].T, "^", color="#cc3311", markersize=4, label="grows")
axes.set(xlabel="friction", ylabel="frequency, Hz", ylim=(3e3, 5e3), title="Modes of steady sliding")
axes.legend(frameon=False, ncols=2)
axes = figure.add_subplot(3, 2, 2)
axes.plot(*loci[~up][:, [0, 2]].T, ".", color="#4477aa", markersize=3)
axes.plot(*loci[up][:, [0, 2]].T, "^", color="#cc3311", markersize=4)
axes.plot(np.full(full.size, 0.3), full.real, "o", color="black", markerfacecolor="none", markersize=5)
axes.set(
    xlabel="friction",
    ylabel="growth rate, 1/s",
    ylim=(-400.0, 600.0),
    title="Their growth; circles: the full model",
)
shape = reduced.expand(modes)["shape"].isel(mode=growing.number).to_numpy()
title = f"{growing.frequency:.0f} Hz, grows at {growing.eigenvalue.real:.1f} 1/s"
ss.fe.draw(scene, shape, figure.add_subplot(3, 2, 3, projection="3d"), title=title)
axes = figure.add_subplot(3, 2, 4)
times = np.linspace(0.0, DURATION, 20001)
axes.plot(1e3 * times, run.sample(times).normal_force.sum("contact"), color="#4477aa", linewidth=0.3)
axes.set(xlabel="time, ms", ylabel="sum of normal forces, N", title="From steady sliding to the limit cycle")
axes = figure.add_subplot(3, 2, 5)
strongest = int(power.argmax())
cycle.plot(contact=strongest, ax=axes)
axes.set_title(f"Contact {strongest} over one period")
axes = figure.add_subplot(3, 2, 6)
x, y = 1e3 * pairs.points[:, 0], 1e3 * pairs.points[:, 1]
shown = axes.scatter(x, y, c=power, cmap="coolwarm", vmin=-power.max(), vmax=power.max(), edgecolor="black")
figure.colorbar(shown, ax=axes, label="into the structure, W")
axes.set(xlabel="x, mm", ylabel="y, mm", aspect="equal", title="Power of every contact", xlim=(70.0, 160.0))
axes.annotate("disc", (80.0, 20.0), (80.0, -20.0), arrowprops={"arrowstyle": "->"}, ha="center")
figure.savefig("squealing-disc.png", dpi=110)

# %% [markdown]
# ## What it means
#
# At friction 0.3 one mode grows: a wave of the disc with four nodal diameters, at 3214 Hz, which runs round
# it against the rotation. Friction feeds this wave, and damps its twin, which runs with the rotation. The
# motion grows for 50 ms. Then contacts begin to stick and to lift off, and it settles to a stable limit cycle
# at 3209 Hz. Then 21 of the 28 contacts bring 181 W into the structure, most of it in the outer half of the
# lining, and seven take 8 W back.
#
# What the reduction changes: it lumps the mass that the modes leave at the contacts. The eigenvalue of the
# growing mode moves little (its growth is 35.5 instead of 34.5 1/s). But two other modes lock in at 4.6 kHz:
# one of them begins to grow at friction 0.32 in the reduced model, and at 0.33 in the full one. Between these
# numbers the reduced model has a second mode that grows, and the full one has not. So look at `errors` at the
# friction that you want before you trust a motion.
