# %% [markdown]
# # Two motions at one friction: bifurcation diagram and basins
#
# A loaded block on a belt has static friction above kinetic friction. Steady sliding is stable, yet the
# block may stick and slip: which of the two motions it settles to depends on how it starts. This example
# follows both motions over the speed of the belt, finds the speed at which stick-slip ends, and maps the
# starts that lead to each motion. Run it as a script, or open it as a notebook (jupytext, VS Code, Spyder):
# it draws `bifurcation.png` and `basins.png`.

# %%
import numpy as np

import stickslip as ss

# %% [markdown]
# ## The model
#
# Two masses in a row; the first one rubs on the belt under a load of 100 N. Units are SI.

# %%
LAW = {"friction": 0.2, "static_friction": 0.5}
STIFFNESS = np.array([[7e4, -6e4, 0.0], [-6e4, 7e4, 0.0], [0.0, 0.0, 1e4]])


def block(speed: float = 0.3) -> ss.Scene:
    """Return the block on a belt with a speed in m/s."""
    contact = ss.Contact(tangential="block", normal="normal", slider_speed=speed, **LAW)
    return ss.Scene(
        mass=[1.0, 0.3, 1.0],
        stiffness=STIFFNESS,
        damping=ss.Rayleigh(stiffness=1e-4),
        force=[0.0, 0.0, -100.0],
        contacts=[contact],
        dofs=["block", "rider", "normal"],
    )


# %% [markdown]
# ## Both motions over the speed of the belt
#
# At every speed one motion starts near steady sliding and one after a strong push. The branch of stick-slip
# cycles is then followed beyond the speeds that the push reaches, to where it ends.

# %%
speeds = np.linspace(0.05, 0.9, 35)
gentle = ss.bifurcation(block, {"speed": speeds})
pushed = ss.bifurcation(
    block,
    {"speed": speeds},
    start=lambda scene: ss.steady_sliding(scene).perturbed(velocity={"block": -1.0}),
)
for name, diagram in (("gentle", gentle), ("pushed", pushed)):
    kinds, counts = np.unique(diagram.data.kind.values, return_counts=True)
    print(name, dict(zip(kinds.tolist(), counts.tolist(), strict=True)))
cycle = [cycle for cycle in pushed.cycles if cycle is not None][-1]
branch = ss.continuation(
    cycle, {"speed": (cycle.scene.contacts[0].slider_speed, 1.0)}, block, points=400, step=0.5
)
last = float(branch.data.speed[-1])
print(f"stick-slip ends at {last:.4f} m/s (end of the {branch.end})")

# %%
axes = branch.plot("block")
axes.axvline(last, color="0.5", linestyle="--")
axes.set(xlabel="slider speed, m/s")
axes.legend(loc="lower left", frameon=False, title="statuses of a cycle")
ss.save(axes.figure, "bifurcation.png", dpi=120)

# %% [markdown]
# ## Which starts lead to which motion
#
# At 0.3 m/s both motions are stable. The basins show what a start away from steady sliding settles to.

# %%
scene = block(0.3)
found = ss.basins(
    scene,
    start=ss.steady_sliding(scene),
    position={"block": np.linspace(-8e-3, 8e-3, 25)},
    velocity={"block": np.linspace(-1.6, 0.29, 25)},
)
ss.save(found.plot().figure, "basins.png", dpi=120)
print(*found.attractors, sep="\n")

# %% [markdown]
# ## What it means
#
# A brake that is silent on the test stand may squeal after a knock. The linear analysis of steady sliding
# finds no growing mode at any of these speeds, while stick-slip exists up to the speed at which the block
# no longer comes to stick. This speed, not the eigenvalues, says from where on the brake is certainly
# silent. Near it, only starts close to the cycle lead to stick-slip: the basin shrinks onto the cycle.
