# %% [markdown]
# # A bowed string: how hard to press for one slip per period
#
# A violinist who presses too lightly gets a surface sound, with several slips in every period of the
# string, and one who presses too hard a creak. Between the two the string sticks to the bow but for one short
# slip per period: the motion that Helmholtz saw. The rosin of the bow creeps before it slips, as the bristles
# of LuGre's law do. This example bows one string with three forces. Run it as a script, or open it as a
# notebook (jupytext, VS Code, Spyder): it draws `bowed-string.png`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %% [markdown]
# ## The string
#
# Twenty modes of a string between two fixed ends, bowed at a ninth of its length: `ss.models.bowed_string`.
# The dofs are the coordinates of the modes, and the direction of the contact holds their shapes at the bow.
# Higher modes fade faster. Units are SI.

# %%
BOWED, BOW_SPEED = 1.0 / 9.0, 0.1
string = ss.models.bowed_string(bow_place=BOWED, bow_speed=BOW_SPEED)
shapes = string.tangential_direction(0)
period = 2.0 * np.pi / np.sqrt(string.stiffness[0, 0] / string.mass[0])

# %% [markdown]
# ## Three forces
#
# Each motion begins with the string at rest under the moving bow. A slip counts where the string runs
# against the bow faster than this moves. The dashed line is the speed of the bow.

# %%
DURATION, SHOWN = 0.25, 5
start = ss.State(np.zeros(string.size), np.zeros(string.size), "+")
times = DURATION - SHOWN * period + np.linspace(0.0, SHOWN * period, 2501)
figure, panels = plt.subplots(3, 1, figsize=(7.0, 6.0), sharex=True, layout="constrained")
for axes, force in zip(panels, (0.1, 1.0, 4.0), strict=True):
    run = ss.simulate(string.replace(normal_force=force), DURATION, start)
    velocity = run.sample(times).velocity.to_numpy() @ shapes
    begins = times[:-1][np.diff((velocity < -BOW_SPEED).astype(int)) == 1]
    apart = ", ".join(f"{gap:.2f}" for gap in np.diff(begins) / period)
    print(f"{force} N: periods from slip to slip {apart}; {len(run.events)} events")
    axes.plot((times - times[0]) / period, velocity, color="#4477aa")
    axes.axhline(BOW_SPEED, color="0.5", linestyle="--")
    axes.set(ylabel="m/s", title=f"{force} N")
    if force == 1.0:
        slowest = velocity.min()
panels[-1].set_xlabel("time, periods of the string")
ss.save(figure, "bowed-string.png", dpi=120)

# %% [markdown]
# While the corner of Helmholtz's motion travels between bridge and bow, the string under the bow slips with
# the speed `bow speed (1 - b) / b` at the place b of the bow, relative to the length.

# %%
expected = -BOW_SPEED * (1.0 - BOWED) / BOWED
print(f"fastest slip at 1 N: {slowest:.3f} m/s, in Helmholtz's motion {expected:.3f} m/s")

# %% [markdown]
# ## What it means
#
# Between 0.1 N and 4 N lies a range of forces in which the string slips once per period, with the speed that
# Helmholtz's motion has. A lighter bow lets the string slip more often: the note loses its ground. A heavier
# one holds it where it should slip, and the slips no longer follow the period. A bow force for a clear note
# is well inside this range, and the range is found by a sweep of such runs over force and place of the bow.
