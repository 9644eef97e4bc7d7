# %% [markdown]
# # A joint with clearance: resonance between a floor and a ceiling
#
# A rocker hangs on springs in a slot. There is play below its left end and above its right end; when the
# play is used up, the end hits the slot. A shaker drives the rocker over both resonances of the free
# structure. This example computes all periodic answers, stable or not, shows one motion with its impacts,
# and asks how the play decides how hard the joint is hammered. Run it as a script, or open it as a notebook
# (jupytext, VS Code, Spyder): it draws `clearance-response.png`, `clearance-motion.png` and
# `clearance-hammering.png`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %% [markdown]
# ## The model
#
# The displacements of the two ends are the degrees of freedom. A contact without a tangential direction is a
# stop: it has no friction. The floor opens when the left end rises, the ceiling when the right end falls.
# Units are SI.


# %%
def joint(clearance: float = 0.2e-3, restitution: float = 0.6) -> ss.Scene:
    """Return the rocker with a play in m, in front of each stop, and the restitution of an impact."""
    floor = ss.Contact(normal="left", gap=clearance, restitution=restitution, name="floor")
    ceiling = ss.Contact(normal={"right": -1.0}, gap=clearance, restitution=restitution, name="ceiling")
    return ss.Scene(
        mass=[0.5, 0.5],
        stiffness=[[3e4, -1e4], [-1e4, 3e4]],
        damping=ss.Rayleigh(stiffness=4e-4),
        contacts=[floor, ceiling],
        dofs=["left", "right"],
        loads=[ss.Harmonic({"right": 3.0}, frequency=32.0, name="shaker")],
    )


REST = ss.State([0.0, 0.0], [0.0, 0.0], "dd")

# %% [markdown]
# ## All responses over the frequency
#
# The motion is followed to higher frequencies and back. Where the two ways end in different motions, the
# branch between them is traced around its fold.

# %%
scene = joint()
print(ss.complex_modes(scene, "dd"))
response = ss.frequency_response(
    scene, {"shaker_frequency": np.linspace(26.0, 60.0, 35)}, dofs=["right"], start=REST
)
axes = response.plot()
axes.axhline(0.2e-3, color="0.5", linestyle=":")
axes.annotate("play used up", (26.0, 0.19e-3), va="top", color="0.3")
ss.save(axes.figure, "clearance-response.png", dpi=120)
unstable = response.data.frequency[~response.data.stable]
print(f"{len(response.cycles)} periodic motions, {unstable.size} of them not known to be stable")

# %% [markdown]
# ## One motion
#
# At 46 Hz the rocker hits both stops in every period of the shaker.

# %%
run = ss.simulate(scene.replace(shaker_frequency=46.0), 2.0, REST)
cycle = run.limit_cycle()
print(cycle)
late = np.linspace(1.9, 2.0, 2001)
motion = run.sample(late)
figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
for dof, colour in (("left", "#4477aa"), ("right", "#cc3311")):
    axes.plot(1e3 * late, 1e3 * motion.position.sel(dof=dof), color=colour, label=f"{dof} end")
for level, name in ((-0.2, "floor of the left end"), (0.2, "ceiling of the right end")):
    axes.axhline(level, color="0.5", linestyle=":")
    axes.annotate(name, (1900.0, 1.4 * level), va="center", color="0.3")
axes.set(xlabel="time, ms", ylabel="displacement, mm", ylim=(-0.5, 0.5))
axes.legend(frameon=False, ncols=2)
figure.savefig("clearance-motion.png", dpi=120)

# %% [markdown]
# ## How much play is good
#
# The energy that impacts take per second says how hard the joint is hammered. It comes with the balance of
# every periodic motion.

# %%
plays = np.linspace(0.02e-3, 1.0e-3, 50)
diagram = ss.bifurcation(joint, {"clearance": plays}, start=REST)
hammering = np.array(
    [np.nan if cycle is None else cycle.balance().impact / cycle.period for cycle in diagram.cycles]
)
kinds, counts = np.unique(diagram.data.kind.values, return_counts=True)
print(dict(zip(kinds.tolist(), counts.tolist(), strict=True)))
figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
axes.plot(1e3 * plays, 1e3 * hammering, ".-", color="#4477aa")
axes.set(xlabel="play, mm", ylabel="power lost in impacts, mW")
figure.savefig("clearance-hammering.png", dpi=120)

# %% [markdown]
# ## What it means
#
# The stops cut the resonance at 32 Hz from 0.93 mm to 0.25 mm, at the price of two impacts in every period.
# The resonance at 45 Hz bends to higher frequencies: from 50 to 57 Hz the rocker may rattle or swing without
# touching, and the linear analysis shows the silent motion alone. A knock, or a shaker that comes from lower
# frequencies, brings it to rattle. More play means fewer joules in the joint, down to a play of 0.94 mm that
# the resonance of the free structure no longer uses up. At two plays about 0.7 mm the motion is chaotic, so
# the line has a gap there. Less play does not help before it is below 0.1 mm, and a little play is worst.
