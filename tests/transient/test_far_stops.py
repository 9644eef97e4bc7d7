"""Stops that a motion never reaches, at any clearance, against the scene without them.

Displacements that were measured from a stop would be rounded to its clearance, not to the motion.
"""

import numpy as np
import pytest

import stickslip as ss

#: m, beside motions of micrometres to a millimetre.
CLEARANCES = 10.0 ** np.arange(-1, 13, 3)


def block_on_a_belt():
    """Return a stick-slip oscillator, and how its mass would meet a stop."""
    belt = ss.Contact(tangential="x", normal_force=10.0, friction=0.3, static_friction=0.5, slider_speed=1e-4)
    scene = ss.Scene([1.0], [[1e6]], damping=[[1.0]], contacts=[belt], dofs=["x"])
    return scene, ss.State([0.0], [1e-4], "s", dofs=["x"]), {"x": 1.0}


def chain(loads=(), mass=(1.0, 2.0, 0.5), beta=2e-5, sides=(1.0,)):
    """Return three masses in a chain, of which the first strikes near stops, and a direction of the last."""
    stiffness = np.array([[5e4, -2e4, 0.0], [-2e4, 4e4, -1e4], [0.0, -1e4, 3e4]])
    near = [ss.Contact(normal={"x1": sign}, gap=5e-4, restitution=0.6) for sign in sides]
    scene = ss.Scene(
        mass,
        stiffness,
        damping=ss.Rayleigh(0.1, beta),
        contacts=near,
        dofs=["x1", "x2", "x3"],
        loads=loads,
    )
    return (
        scene,
        ss.State([2e-4, -1e-3, 5e-4], [0.3, 0.1, -0.2], "d" * len(near), dofs=scene.dofs),
        {"x3": -1.0},
    )


def forced():
    return chain(loads=[ss.Harmonic({"x2": 20.0}, frequency=23.0)])


def undamped():
    return chain(beta=0.0)


def between():
    return chain(sides=(1.0, -1.0))


def coupled():
    return chain(sides=(1.0, -1.0), mass=[[1.0, 0.2, 0.1], [0.2, 2.0, -0.1], [0.1, -0.1, 0.5]])


def with_stop(scene, start, direction, clearance, **law):
    stop = ss.Contact(normal=direction, gap=clearance, **law)
    farther = scene.replace(contacts=[*scene.contacts, stop])
    return farther, ss.State(start.position, start.velocity, start.combination + "d", dofs=scene.dofs)


METHODS = ("auto", "modal", "taylor")
CASES = [(build, method) for build in (block_on_a_belt, between, coupled) for method in METHODS]
CASES += [(build, method) for build in (chain, forced, undamped) for method in (*METHODS, "local")]


@pytest.mark.parametrize("law", [{}, {"normal_stiffness": 1e6}], ids=["rigid", "compliant"])
@pytest.mark.parametrize(("build", "method"), CASES, ids=[f"{b.__name__}-{m}" for b, m in CASES])
def test_a_stop_that_is_never_reached_changes_nothing(build, method, law):
    if law and (method == "local" or build in (between, coupled)):
        pytest.skip("what has no mass is refused here")
    scene, start, direction = build()
    duration = 0.5
    alone = ss.simulate(scene, duration, start, method=method)
    assert len(alone.events) > 5
    times = np.linspace(0.0, duration, 400)
    expected = alone.sample(times)
    for clearance in CLEARANCES:
        farther, there = with_stop(scene, start, direction, clearance, **law)
        run = ss.simulate(farther, duration, there, method=method)
        assert list(run.events.kind) == list(alone.events.kind)
        assert np.abs(run.events.time - alone.events.time).max() <= 1e-13 * duration
        found = run.sample(times)
        for one, other in ((found.position, expected.position), (found.velocity, expected.velocity)):
            assert np.abs(one - other).max() <= 1e-13 * np.abs(other).max()
