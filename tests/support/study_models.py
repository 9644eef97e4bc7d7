"""Models of the tests of studies that other processes import."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from scipy import stats

import stickslip as ss

#: Natural frequency, rad/s, damping ratio, and how strongly friction feeds the one dof.
OMEGA, ZETA, COUPLING = 300.0, 0.02, 0.5


def fed_oscillator(friction: float) -> ss.Scene:
    """One dof in sliding, whose damper friction undoes.

    The row of the normal dof is taken from that of the tangential one, times friction: what is left is
    ``x'' + d (1 - friction COUPLING) x' + OMEGA^2 x = ...``, unstable beyond friction = 1 / COUPLING.
    """
    d = 2.0 * ZETA * OMEGA
    return ss.Scene(
        [1.0, 1.0],
        [[OMEGA**2, 0.0], [0.0, 4.0 * OMEGA**2]],
        damping=[[d, d * COUPLING], [d * COUPLING, d]],
        force=[0.0, -10.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=friction, slider_speed=0.1)],
    )


#: Where its sliding becomes unstable.
HOPF = 1.0 / COUPLING


def last_position(run: ss.Trajectory) -> float:
    """An output of a study."""
    return float(run.state(run.duration).position[0])


def distributions(spread: float = 0.05) -> dict[str, Any]:
    """Friction from 0.3 to 2.5, and two stiffnesses known to a few percent."""
    return {
        "friction": stats.uniform(0.3, 2.2),
        "vertical_stiffness_1": stats.uniform(3e4 * (1 - spread), 2 * spread * 3e4),
        "link_horizontal_stiffness": stats.norm(1.5e6, spread * 1.5e6),
    }


def campaign(**changes: Any) -> ss.Study:
    """A study of verdicts and cycles that takes a second or so."""
    arguments: dict[str, Any] = {
        "outputs": ["eigenvalue", "unstable_modes", "amplitude", "period", "sequence", "contact_energy"],
        "samples": 96,
        "seed": 7,
        "duration": 0.15,
        "further": 0.15,
    }
    return ss.Study(ss.models.two_subsystems, distributions(), **(arguments | changes))


def verdicts(**changes: Any) -> ss.Study:
    """A study of verdicts alone."""
    return campaign(outputs=["eigenvalue", "growth_rate", "frequency", "unstable_modes"], **changes)


if __name__ == "__main__":
    # A run for the test that kills it: store, samples, chunk.
    store, samples, chunk = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    campaign(samples=samples).run(store, chunk=chunk, threads=1, progress=False)
    print(np.datetime64("now"))
