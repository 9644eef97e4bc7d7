"""Motions of two lumped bodies whose meshes do not match: pairs share nodes, and an impact moves several."""

import numpy as np
import pytest
import skfem

import stickslip as ss
from fuzz_checks import (
    balance_residual,
    complementarity,
    continuity,
    energy_residual,
)
from fuzz_samples import Sampled
from meshed import elastic, plate
from peer_integrator import assert_same_motion

BODY = {"young": 1e9, "damping": ss.Rayleigh(stiffness=1e-6)}


def blocks(restitution=0.5, columns=(3, 4)):
    """Return two blocks in plane strain, one on the other, pressed together by 1 um."""

    def body(count, low, high, name, held):
        x, y = (np.linspace(a, b, n + 1) for a, b, n in zip(low, high, (count, 1), strict=True))
        mesh = skfem.MeshQuad.init_tensor(x, y).with_boundaries(
            {"bottom": lambda x: x[1] < low[1] + 1e-9, "top": lambda x: x[1] > high[1] - 1e-9}
        )
        made = elastic(mesh, thickness=0.01, name=name, **BODY).lumped()
        return made.held(made.surface(held))

    pad = body(columns[0], (0.003, 0.01), (0.037, 0.02), "pad", "top")
    base = body(columns[1], (0.0, 0.0), (0.04, 0.01), "base", "bottom")
    pairs = ss.fe.contact_pairs(
        pad.surface("bottom"),
        base.surface("top"),
        velocity=(1.0, 0.0),
        friction=0.3,
        restitution=restitution,
        gap=-1e-6,
    )
    return ss.fe.assemble([pad, base], pairs)


def plates(restitution=0.5, plane=False):
    """Return two plates in space, one on the other, pressed together by 1 um."""
    pad = plate((2, 1, 1), (0.03, 0.01, 0.01), (0.003, 0.004, 0.01), name="pad", **BODY).lumped()
    base = plate((3, 2, 1), (0.04, 0.02, 0.01), (0.0, 0.0, 0.0), name="base", **BODY).lumped()
    pad, base = pad.held(pad.surface("top")), base.held(base.surface("bottom"))
    pairs = ss.fe.contact_pairs(
        pad.surface("bottom"),
        base.surface("top"),
        velocity=(1.0, 0.0, 0.0),
        friction=0.3,
        plane=plane,
        restitution=restitution,
        gap=-1e-6,
    )
    return ss.fe.assemble([pad, base], pairs)


def falling(scene, held=""):
    """Return a state above the sliding equilibrium: nodes of the pad fall at different heights and speeds.

    Contacts of `held` stay closed.
    """
    combination = "".join("+" if str(i) in held else "d" for i in range(len(scene.contacts)))
    start = ss.steady_sliding(scene)
    position, velocity = np.array(start.position), np.zeros(scene.size)
    for i, letter in enumerate(combination):
        own = scene.normal_direction(i)
        node = int(np.argmax(own))
        if letter == "d":
            position[node] += 1e-6 * (1.0 + 0.37 * i) * own[node]
            velocity[node] = -0.05 * (1.0 + 0.2 * i)
    return ss.State(position, velocity, combination, scene.dofs)


def directions(scene):
    """Return the normal and the tangential directions, a row each."""
    count = range(len(scene.contacts))
    return (np.array([of(i) for i in count]) for of in (scene.normal_direction, scene.tangential_direction))


def couplings(scene):
    """Return the parts of ``D' M^-1 D`` between normals, and between normal and tangential directions."""
    normal, tangential = directions(scene)
    return normal / scene.mass @ normal.T, normal / scene.mass @ tangential.T


def assert_laws(run):
    """Complementarity, balances of energy, and at impacts those of momentum and Newton's law."""
    sampled = Sampled(run)
    assert complementarity(sampled) == ""
    assert continuity(run) == ""
    assert energy_residual(sampled) < 1e-11
    assert balance_residual(run) < 1e-12
    scene = run.scene
    normal, tangential = directions(scene)
    restitution = np.array([contact.restitution for contact in scene.contacts])
    # Where a series ends, the impulses of its rest have no law of their own.
    single = ~np.isin(run.events.time[sampled.impacts], run.events.time[run.events.kind == "accumulation"])
    before, after = sampled.before.velocity[single], sampled.after[1][single]
    size = 1e-8 * np.abs(before).max()
    # An impact leaves every slip velocity as it is.
    assert np.abs((after - before) @ tangential.T).max() <= size
    # Impulses along normals alone, which push both bodies of a pair alike.
    change = (after - before) * scene.mass
    impulse = np.linalg.lstsq(normal.T, change.T)[0].T
    rounding = size * scene.mass.max()
    assert np.abs(impulse @ normal - change).max() <= rounding
    assert impulse.min() >= -rounding
    approach, leaving = before @ normal.T, after @ normal.T
    pushed = impulse > rounding
    assert np.abs(leaving + restitution * approach)[pushed].max() <= size
    ends = run.events.combination[sampled.impacts][single]
    touching = np.array([[letter != "d" for letter in letters] for letters in ends])
    assert (leaving[touching | pushed] >= -size).all()


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("make", [blocks, plates])
def test_an_impact_moves_other_pairs_and_no_slip(make, restitution):
    scene = make(restitution)
    between, across = couplings(scene)
    assert np.count_nonzero(between - np.diag(np.diag(between)))
    assert not across.any()
    run = ss.simulate(scene, 1e-4, falling(scene), max_events=300)
    assert list(run.events.kind).count("impact") >= 5
    assert_laws(run)


@pytest.mark.parametrize("held", ["", "01"])
def test_the_motion_is_that_of_runge_kutta(held):
    """From impact to impact, also beside pairs that slide."""
    scene = blocks()
    run = assert_same_motion(scene, falling(scene, held), 2e-5)
    assert list(run.events.kind).count("impact") >= 3


def test_both_methods_follow_the_same_motion():
    scene = blocks()
    modal, taylor = (
        ss.simulate(scene, 3e-5, falling(scene, "01"), method=method) for method in ("modal", "taylor")
    )
    assert list(modal.events.combination) == list(taylor.events.combination)
    np.testing.assert_allclose(modal.events.time, taylor.events.time, atol=1e-15, rtol=1e-10)


def test_a_pad_comes_to_slide():
    """Series of impacts of neighbours that lift each other end, and the motion settles to steady sliding."""
    scene = blocks(0.0)
    run = ss.simulate(scene, 2e-2, falling(scene))
    assert run.stop_reason == "duration"
    end, steady = run.state(2e-2), ss.steady_sliding(scene)
    assert end.combination == steady.combination
    assert np.abs(end.position - steady.position).max() < 1e-3 * np.abs(steady.position).max()


def test_friction_in_the_plane_names_what_is_computed():
    scene = plates(plane=True)
    start = ss.steady_sliding(scene)
    with pytest.raises(ss.InputError, match=r"plane=False.*boundary='lumped'"):
        ss.simulate(scene, 1e-6, start)
    assert ss.simulate(plates(), 1e-6).stop_reason == "duration"
    reduced = ss.fe.reduce(scene, (0.0, 30e3), tolerance=0.1, growth_tolerance=None)
    assert ss.simulate(reduced.scene, 1e-6, ss.steady_sliding(reduced.scene)).stop_reason == "duration"
