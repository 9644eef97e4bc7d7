"""A rigid pad that sticks on many points slips when the sum of their friction limits is reached."""

import numpy as np
import pytest

import stickslip as ss


@pytest.mark.parametrize("points", [4, 8, 13, 24])
def test_a_pad_slips_at_the_sum_of_its_limits(points):
    places = (np.arange(points) - (points - 1) / 2) / 256
    scene = ss.Scene(
        [1.0, 1.0, 1e-3],
        np.diag([1e6, 1e4, 200.0]),
        force=[0.0, -100.0, 0.25],
        contacts=[
            ss.Contact(
                tangential={"x": 1.0},
                normal={"y": 1.0, "turn": float(place)},
                friction=0.3,
                slider_speed=0.1,
            )
            for place in places
        ],
        dofs=["x", "y", "turn"],
        impact_friction=True,
    )
    state = ss.State([0.0, 0.0, 0.0], [0.1, 0.0, 0.0], "s" * points, dofs=scene.dofs)
    run = ss.simulate(scene, 1e-3, state, time_limit=20.0)
    assert run.stop_reason == "duration"
    # 1e6 N/m times 0.1 m/s t is 0.3 times 100 N.
    assert run.events.time[0] == pytest.approx(3e-4, rel=1e-12)
