# %% [markdown]
# # A block from CalculiX's matrices: from three files to a limit cycle
#
# CalculiX wrote mass and stiffness of a block of friction material, 18 x 8 x 6 mm, held at its top
# (`*FREQUENCY, SOLVER=MATRIXSTORAGE`; the deck is `tests/fe/calculix/pad.inp`, in mm and tonnes). This
# example reads the files, puts the lower face on a belt, computes the modes of steady sliding over friction,
# and follows the motion to its limit cycle. It draws `calculix-block.png`.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

examples = Path(__file__).parent if "__file__" in globals() else Path.cwd()
files = examples.parent / "tests" / "fe" / "calculix" / "pad"

# %% [markdown]
# ## The body and its contacts
#
# The lower face is three facets, each given by its nodes. The belt presses 1 um into the face, and friction
# acts along its motion. A lumped mass keeps impacts with their own node.

# %%
matrices = [files.with_suffix(suffix) for suffix in (".sti", ".mas", ".dof")]
block = ss.fe.read(
    *matrices,
    mesh=files.with_suffix(".inp"),
    units="mm-t-s",
    surfaces={"face": [(1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4)]},
    damping=ss.Rayleigh(stiffness=2e-8),
).lumped()
pairs = ss.fe.contact_pairs(
    block.surface("face"), None, velocity=(1, 0, 0), friction=0.1, gap=-1e-6, plane=False
)
scene = ss.fe.assemble(block, pairs)
steady = ss.steady_sliding(scene)
print(block)
print(pairs, "in steady sliding:", steady.combination)

# %% [markdown]
# ## Modes over friction, and the limit cycle

# %%
loci = []
for friction in np.linspace(0.0, 0.2, 61):
    modes = ss.complex_modes(scene.replace(friction=friction), steady.combination).select((60e3, 70e3))
    loci += [(friction, mode.frequency / 1e3, mode.unstable) for mode in modes]
loci = np.array(loci)
growing = max(ss.complex_modes(scene), key=lambda mode: mode.eigenvalue.real)
print(f"at friction 0.1 a mode grows by {growing.eigenvalue.real:.0f} 1/s at {growing.frequency:.0f} Hz")
run = ss.simulate(scene, 0.01, ss.disturbed_sliding(scene))
cycle = run.limit_cycle()
power = cycle.balance().contacts.work.sum("status").to_numpy() / cycle.period
print(f"cycle at {cycle.frequency:.0f} Hz with {len(cycle.phases)} phases, {cycle.stability}")
print(f"power of the contacts, W: {np.round(power, 3)}")

# %%
figure, axes = plt.subplots(1, 3, figsize=(13.0, 3.6), layout="constrained")
up = loci[:, 2] == 1.0
axes[0].plot(*loci[~up, :2].T, ".", color="#4477aa", markersize=3, label="decays")
axes[0].plot(*loci[up, :2].T, "^", color="#cc3311", markersize=4, label="grows")
axes[0].set(xlabel="friction", ylabel="frequency, kHz", title="Modes of steady sliding")
axes[0].legend(loc="center right")
cycle.plot(contact=2, ax=axes[1])
axes[1].set_title("Contact 2 over one period")
pairs.plot(power, ax=axes[2], label="power of every contact, W")
figure.savefig("calculix-block.png", dpi=110)

# %% [markdown]
# ## What it means
#
# Two modes at 65.4 kHz lock in at friction 0.06, and from 0.091 on one of them grows. At friction 0.1 the
# motion settles to a stable limit cycle at 65 425 Hz. In every period contacts 2 and 6, which lie opposite to
# each other, stick to the belt in turn; no contact opens. The four middle contacts bring 0.86 W into the
# block; the outer ones and the damping take this power. The mesh is far too coarse for a real block; a finer
# one takes the same lines.
# CalculiX leaves held dofs out, so that the lumped mass lacks what belongs between them and their neighbours.
