# %% [markdown]
# # Stable by its eigenvalues, and it squeals
#
# The published model of two subsystems slides under friction that falls with the slip speed. Complex
# eigenvalues say from which slider speed on steady sliding is stable. This example asks how far one may
# trust them: it says that the Hopf point is subcritical, follows two motions at a speed at which sliding
# is stable, and finds the speed up to which squeal exists. Run it as a script, or open it as a notebook
# (jupytext, VS Code, Spyder): it draws `stable-but-squealing.png`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

LAW = ss.friction.Stribeck(static=0.8, kinetic=0.3, speed=0.05)
SPEED = 0.23


def model(speed: float) -> ss.Scene:
    """Return the model at a slider speed in m/s."""
    return ss.models.two_subsystems(friction=LAW, slider_speed=speed)


# %% [markdown]
# ## What eigenvalues say
#
# At 0.23 m/s every mode decays. The last mode to become stable does so at the Hopf point, which is
# subcritical: an unstable cycle lies around stable sliding above it.

# %%
scene = model(SPEED)
print(ss.complex_modes(scene))
point = ss.critical_points(model, {"speed": (0.1, 0.4)}, kinds=("hopf",))[-1]
print(point)
speeds = np.linspace(0.1, 0.4, 151)
growth = ss.sweep(model, {"speed": speeds}).eigenvalue.real.max("branch")

# %% [markdown]
# ## Two motions
#
# Both start with the mode that was the last to become stable. A start of 0.12 mm dies out. One of 0.2 mm
# grows until contacts stick and lift off: the brake squeals while its eigenvalues say that it is stable.


# %%
def shape(scene: ss.Scene) -> tuple[complex, np.ndarray]:
    """Return the eigenvalue of that mode and its displacements, the largest of them 1."""
    modes = ss.complex_modes(scene)
    mode = int(np.abs(modes.eigenvalues - point.eigenvalue).argmin())
    moved = modes.shapes[:, mode]
    return modes.eigenvalues[mode], moved / moved[np.abs(moved).argmax()]


def start(scene: ss.Scene, amplitude: float) -> ss.State:
    """Return steady sliding and the mode with an amplitude of its largest displacement, m."""
    rate, moved = shape(scene)
    return ss.steady_sliding(scene).perturbed(
        position=dict(zip(scene.dofs, amplitude * moved.real, strict=True)),
        velocity=dict(zip(scene.dofs, amplitude * (rate * moved).real, strict=True)),
    )


dof = scene.dofs[int(np.abs(shape(scene)[1]).argmax())]
runs = {f"start {1e3 * size:g} mm": ss.simulate(scene, 0.1, start(scene, size)) for size in (1.2e-4, 2e-4)}
for name, run in runs.items():
    print(f"{name}: {len(run.events)} events in {run.duration:g} s")

# %% [markdown]
# ## Where squeal ends
#
# The unstable cycle begins at the Hopf point with the amplitude that the Lyapunov coefficient gives. It
# divides starts that die out from starts that squeal, and is followed up to the speed at which a contact
# opens in it. Squeal is followed from speed to speed until it ceases.

# %%
near = model(1.01 * point.value)
gap = near.contacts[0].slider_speed - point.value
amplitude = np.sqrt(-4.0 * point.slope * gap / (2.0 * np.pi * point.frequency * point.lyapunov))
born = ss.simulate(near, 0.05, start(near, amplitude)).closed_cycle()
print(born)
unstable = ss.continuation(born, {"slider_speed": (1.01 * point.value, 0.24)})
squeal = ss.bifurcation(
    model, {"speed": np.linspace(0.16, 0.4, 49)}, start=lambda scene: start(scene, 3e-4), follow=True
)
squeals = squeal.data.kind == "cycle"
last = float(squeal.data.speed[squeals.values].max())
print(f"eigenvalues: stable from {point.value:.3f} m/s on; squeal exists up to {last:.3f} m/s")

# %%
figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11.0, 3.6), layout="constrained")
left.plot(speeds, growth, color="#4477aa")
left.plot(point.value, 0.0, "o", color="#cc3311")
left.axhline(0.0, color="0.5", linewidth=0.8)
left.axvline(SPEED, color="0.5", linestyle="--", linewidth=0.8)
left.set(title="Eigenvalues", xlabel="slider speed, m/s", ylabel="largest growth rate, 1/s")
for (name, run), colour in zip(reversed(runs.items()), ("#cc3311", "#4477aa"), strict=True):
    times = np.linspace(0.0, run.duration, 4001)
    offset = ss.steady_sliding(scene).position[scene.dofs.index(dof)]
    moved = run.sample(times).position.sel(dof=dof) - offset
    middle.plot(1e3 * times, 1e3 * moved, color=colour, linewidth=0.7, label=name)
middle.set_ylim(top=0.5)
middle.set(title=f"Motions at {SPEED} m/s", xlabel="time, ms", ylabel=f"{dof} off steady sliding, mm")
middle.legend(frameon=False, loc="upper right")
branch = unstable.to_dataset()
cycles = squeal.data.isel(speed=np.flatnonzero(squeals))
right.plot(cycles.speed, 1e3 * cycles.amplitude.sel(dof=dof), ".", color="#cc3311", label="squeal")
sizes = 1e3 * branch.amplitude.sel(dof=dof)
right.plot(branch.slider_speed, sizes, "--", color="#4477aa", label="unstable cycle")
right.plot(speeds, np.where(speeds > point.value, 0.0, np.nan), color="#4477aa", label="stable sliding")
right.plot(point.value, 0.0, "o", color="#cc3311")
right.axvline(SPEED, color="0.5", linestyle="--", linewidth=0.8)
right.set(title="Motions over the speed", xlabel="slider speed, m/s", ylabel=f"amplitude of {dof}, mm")
right.legend(frameon=False)
ss.save(figure, "stable-but-squealing.png", dpi=120)

# %% [markdown]
# ## What it means
#
# Complex eigenvalues tell whether a small disturbance dies out, not whether a brake can squeal. At a
# subcritical point the two differ: a disturbance larger than the unstable cycle goes on to squeal.
# `criticality` of a Hopf point says which kind it is, and costs one more solution of the linear equations.
