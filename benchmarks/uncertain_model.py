"""The two-subsystem model with every stiffness known to 5 %, as `examples/uncertain_brake.py` takes it."""

from __future__ import annotations

from scipy import stats

#: Every stiffness of the model with its published value, N/m.
STIFFNESSES = {
    "wall_stiffness": 1.8e6,
    "vertical_stiffness_0": 4.5e5,
    "vertical_stiffness_1": 3.0e4,
    "horizontal_stiffness_0": 3.0e5,
    "horizontal_stiffness_1": 2.4e6,
    "ceiling_stiffness_0": 6.0e4,
    "ceiling_stiffness_1": 1.8e5,
    "link_horizontal_stiffness": 1.5e6,
    "link_vertical_stiffness": 2.4e5,
}


def parameters() -> dict[str, object]:
    """Return the distributions: friction uniform from 0.3 to 2.5, stiffnesses normal."""
    springs = {name: stats.norm(value, 0.05 * value) for name, value in STIFFNESSES.items()}
    return {"friction": stats.uniform(0.3, 2.2), **springs}
