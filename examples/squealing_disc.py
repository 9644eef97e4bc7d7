# %% [markdown]
# # A pad on a rotating disc: from two meshes to squeal
#
# A lining of 60 degrees is pressed on an elastic disc that is held at its hub. This example meshes and
# assembles both bodies with scikit-fem, pairs the nodes of the lining with faces of the disc (the two
# meshes do not match), reduces the model, finds the modes that grow, follows the motion into squeal, and
# asks which contacts feed it. It needs `pip install 'stickslip[fe]'`. Run it as a script, or open it as a
# notebook (jupytext, VS Code, Spyder): it draws `squealing-disc.png`, and writes the motion and the mode
# that grows most for Paraview into the folder `squeal`.

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
# Both meshes are parts of a ring of hexahedra; after a full turn the disc closes. The damping of both
# bodies is 2e-8 s times their stiffness.


# %%
def ring(counts, radii, angles, heights):
    """Return hexahedra of a part of a ring, so many along radius, angle and thickness."""
    axes = [np.linspace(*ends, n + 1) for ends, n in zip((radii, angles, heights), counts, strict=True)]
    mesh = skfem.MeshHex.init_tensor(*axes)
    r, angle, z = mesh.p
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z])
    _, first, place = np.unique(np.round(points, 9), axis=1, return_index=True, return_inverse=True)
    return skfem.MeshHex(points[:, first], place.ravel()[mesh.t])


def elastic(mesh, young, poisson, density, name):
    """Return the body of a mesh of one elastic material."""
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=2)
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    mass = density * skfem.BilinearForm(lambda u, v, w: dot(u, v)).assemble(basis)
    damping = ss.Proportional(stiffness=2e-8)
    return ss.fe.Body.from_skfem(basis, mass, stiffness, damping=damping, name=name)


disc_mesh = ring((6, 36, 1), (0.06, 0.16), (0.0, 2 * np.pi), (0.0, 0.012)).with_boundaries(
    {"hub": lambda x: np.hypot(x[0], x[1]) < 0.0601, "top": lambda x: x[2] > 0.0119}
)
pad_mesh = ring((3, 6, 2), (0.10, 0.15), (-np.pi / 6, np.pi / 6), (0.012, 0.020)).with_boundaries(
    {"face": lambda x: x[2] < 0.0121, "back": lambda x: x[2] > 0.0199}
)
disc = elastic(disc_mesh, 120e9, 0.25, 7200.0, "disc")
disc = disc.held(disc.surface("hub"))
pad = elastic(pad_mesh, 1e9, 0.3, 2500.0, "pad")
# The back of the pad is guided: it moves along the axis of the disc only.
pad = pad.held(pad.surface("back"), directions=(1, 2))

# %% [markdown]
# ## Contacts, and a reduced model
#
# The disc turns at 5 rad/s, and a pressure of 1 MPa presses the pad on it. The reduced model keeps every
# contact and has the eigenvalues of the full model from 0.5 to 12 kHz.

# %%
BAND = (500.0, 12e3)
pairs = ss.fe.contact_pairs(
    pad.surface("face"), disc.surface("top"), velocity=ss.fe.Rotation(5.0), friction=0.5
)
scene = ss.fe.assemble([pad, disc], pairs, force=pad.surface("back").pressure(1e6))
steady = ss.sliding_equilibrium(scene)
reduced = ss.fe.reduce(scene, BAND, combination=steady.combination, tolerance=1e-2)
print(f"{scene.size} dofs, {len(scene.contacts)} contacts, {steady.combination.count('d')} of them open")
print(f"reduced to {reduced.scene.size} dofs, eigenvalues right to {reduced.errors.error.max():.1g}")

# %% [markdown]
# ## Modes that grow
#
# The modes of steady sliding are computed at 25 values of friction, each at its own equilibrium.

# %%
modes = ss.complex_modes(reduced.scene, steady.combination)
growing = modes.select(BAND, unstable=True)
worst = max(growing, key=lambda mode: mode.eigenvalue.real)
print(f"{len(growing)} modes grow; that at {worst.frequency:.0f} Hz at {worst.eigenvalue.real:.1f} 1/s")
loci = []
for friction in np.linspace(0.0, 0.6, 25):
    slipping = reduced.scene.replace(friction=friction)
    for mode in ss.complex_modes(slipping, ss.sliding_equilibrium(slipping).combination).select(BAND):
        loci.append((friction, mode.frequency, mode.eigenvalue.real))
loci = np.array(loci)

# %% [markdown]
# ## The motion
#
# A small push sets the pad in motion. The work of every contact over the last millisecond says which
# contacts feed the motion.

# %%
DURATION, BEGIN = 2.5e-3, 1.5e-3
start = ss.sliding_equilibrium(reduced.scene).perturbed(velocity={"q0": 1e-3})
run = ss.simulate(reduced.scene, start, DURATION)
power = run.balance(BEGIN, DURATION).contacts.work.sum("status").to_numpy() / (DURATION - BEGIN)
print(f"{len(run.events)} events in {1e3 * DURATION:g} ms, energy to {run.balance().residual:.0e} J")
print(
    f"{(power > 0).sum()} contacts feed {power[power > 0].sum():.3g} W, "
    f"the others take {-power[power < 0].sum():.3g} W"
)
late = run.sample(np.linspace(BEGIN, BEGIN + 5.0 / worst.frequency, 120))
Path("squeal").mkdir(exist_ok=True)
ss.fe.write_vtu("squeal/motion.pvd", scene, reduced.expand(late))
ss.fe.write_vtu("squeal/mode.pvd", scene, reduced.expand(modes), mode=worst.number)

# %%
figure = plt.figure(figsize=(11.0, 8.0), layout="constrained")
axes = figure.add_subplot(2, 2, 1)
grows = loci[:, 2] > 0.0
axes.plot(*loci[~grows, :2].T, ".", color="#4477aa", markersize=3, label="decays")
axes.plot(*loci[grows, :2].T, "^", color="#cc3311", markersize=4, label="grows")
axes.set(xlabel="friction", ylabel="frequency, Hz", ylim=(0.0, 14e3), title="Modes of steady sliding")
axes.legend(frameon=False, ncols=2)
shape = reduced.expand(modes)["shape"].isel(mode=worst.number).to_numpy()
title = f"{worst.frequency:.0f} Hz, grows at {worst.eigenvalue.real:.0f} 1/s"
ss.fe.draw(scene, shape, figure.add_subplot(2, 2, 2, projection="3d"), title=title)
axes = figure.add_subplot(2, 2, 3)
times = np.linspace(0.0, DURATION, 4001)
axes.plot(1e3 * times, run.sample(times).normal_force.sum("contact"), color="#4477aa", linewidth=0.7)
axes.set(xlabel="time, ms", ylabel="sum of normal forces, N", title="From steady sliding to squeal")
axes = figure.add_subplot(2, 2, 4)
axes.bar(np.arange(power.size), power, color=np.where(power > 0.0, "#cc3311", "#4477aa"))
axes.set(xlabel="contact", ylabel="mean power into the structure, W", title="Which contacts feed the squeal")
figure.savefig("squealing-disc.png", dpi=110)

# %% [markdown]
# ## What it means
#
# Seven modes of the band grow at friction 0.5, and each begins to grow at a friction of its own, so the
# eigenvalues alone do not say at which frequency this brake squeals. The motion leaves steady sliding within
# a millisecond and goes on irregularly. In the last millisecond 23 of the 28 contacts bring 364 W into the
# structure, and the other five take 42 W back: nearly the whole lining feeds the squeal. Modes of the soft
# lining above the band grow faster still. They dominate this motion, and a study of them needs a wider band
# and a finer mesh.
