"""Ctrl-C stops searches over many motions at once and keeps what they have."""

import os
import sys

import pytest

import interrupts

#: Two blocks, weakly tied, on belts of their own: at rest, or on a torus that is watched without end.
SEARCH = """
    import sys
    import numpy as np
    import stickslip as ss
    from interrupts import Interrupt

    stiffness = np.diag([1e4, 137.0**2, 1e4, 1e4])
    stiffness[:2, :2] += np.array([[10.0, -10.0], [-10.0, 10.0]])
    contacts = [
        ss.Contact(tangential=k, normal=k + 2, friction=0.2, static_friction=0.5, slider_speed=0.1)
        for k in (0, 1)
    ]
    scene = ss.Scene([1.0] * 4, stiffness, damping=ss.Rayleigh(stiffness=1e-4),
                     force=[0.0, 0.0, -100.0, -100.0], contacts=contacts)

    def start(scene):
        speed = -0.5 if scene.contacts[0].friction > 0.2 else 0.0
        return ss.steady_sliding(scene).perturbed(velocity={"x1": speed, "x2": speed})

    def diagram(follow):
        ss.bifurcation(scene, {"friction": [0.15, 0.18, 0.21, 0.22]}, start=start, follow=follow, limit=1e6)

    def basins():
        start = ss.steady_sliding(scene)
        ss.basins(scene, start=start, velocity={"x1": [0.0, -0.5], "x2": [0.0, -0.5]}, limit=1e6)

    def cycle():
        moving = scene.replace(friction=0.21)
        ss.simulate(moving, 1.0, start(moving)).limit_cycle(1e6)

    def harmonics():
        published = ss.models.two_subsystems(friction=1.5)
        disturbed = ss.steady_sliding(published).perturbed(velocity={"x1": 1e-3})
        found = ss.simulate(published, 0.2, disturbed).limit_cycle()
        while True:
            found.harmonics(2_000_000)

    search = eval(sys.argv[1])
    interrupt = Interrupt(after=1.5)
    try:
        search()
    except KeyboardInterrupt as stopped:
        print(interrupt.unheard(), flush=True)
        print(repr(getattr(stopped, "partial", None)), flush=True)
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT to one process")
@pytest.mark.parametrize(
    ("search", "kept"),
    [
        ("lambda: diagram(False)", ("(friction: 2,", "'equilibrium' 'equilibrium'")),
        ("basins", ("array([[ 0,  1],", "-2]])")),
        ("cycle", ("Trajectory(", "stopped by interrupted")),
        ("harmonics", ("None",)),
    ],
)
def test_an_interrupt_is_heard_at_once_and_what_is_done_is_kept(search, kept):
    unheard, printed = interrupts.printed(SEARCH, search, timeout=120).split("\n", 1)
    # The promise is 1 s, here of the processor time of every thread together.
    assert float(unheard) <= 1.0 * os.cpu_count()
    for part in kept:
        assert part in printed
