"""Modes of steady sliding where slip has no mass and friction rises with it: a state of first order."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, linear_sum_assignment

import stickslip as ss
from stickslip.scene.laws.friction import FrictionLaw, Linear, Rational, Stribeck, Tabulated

#: Slider speed, m/s, normal force, N, springs of the block and of its node, N/m, and damping, N s/m.
SPEED, PRESSED, HELD, SPRING, DAMPING = 0.2, 10.0, 100.0, 700.0, 0.4
#: Each with its slope at the slider speed, s/m.
LAWS = [
    (Linear(0.4, 0.3), 0.3),
    (Stribeck(0.5, 0.3, 0.1, viscous=2.5), 2.5 - 2.0 * np.exp(-2.0)),
    (Rational(0.3, 0.5, 0.1), 2.0 / 9.0),
]


def block(law: FrictionLaw | float, speed: float = SPEED) -> ss.Scene:
    """Return a mass of 1 kg with a node on a belt, under a given normal force."""
    node = ss.Contact(
        tangential=0, normal_force=PRESSED, friction=law, slider_speed=speed, tangential_stiffness=SPRING
    )
    return ss.Scene([1.0], [[HELD]], damping=[[DAMPING]], contacts=[node])


@pytest.mark.parametrize(("law", "slope"), LAWS, ids=repr)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_block_has_the_roots_of_its_cubic(law, slope, side):
    """``(l^2 + c l + k + k_t) (d l + k_t) = k_t^2`` with d = N mu'(v), the damper that moves the node."""
    modes = ss.complex_modes(block(law, side * SPEED)).with_conjugates
    damper = PRESSED * slope
    cubic = np.polysub(np.polymul([1.0, DAMPING, HELD + SPRING], [damper, SPRING]), [SPRING**2])
    expected = np.roots(cubic)
    assert len(modes) == 3
    order = [np.abs(modes.eigenvalues - root).argmin() for root in expected]
    assert sorted(order) == [0, 1, 2]
    np.testing.assert_allclose(modes.eigenvalues[order], expected, rtol=1e-12)
    # The node follows the block: (d l + k_t) s = k_t x.
    ratio = SPRING / (damper * modes.eigenvalues + SPRING)
    np.testing.assert_allclose(modes.right_displacement[1], ratio * modes.right_displacement[0], rtol=1e-12)


@st.composite
def scenes(draw) -> ss.Scene:
    """Return a scene of up to six dofs with contacts that slide without mass, by laws and by numbers."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size = draw(st.integers(2, 6))
    root = random.standard_normal((size, size))
    dofs = random.permutation(size)
    contacts, force = [], random.uniform(-2.0, 2.0, size)
    for k in range(draw(st.integers(1, size // 2))):
        law = draw(st.sampled_from([Linear(0.3, 0.8), LAWS[1][0], LAWS[2][0], 0.4]))
        shared = {
            "tangential": int(dofs[2 * k]),
            "friction": law,
            "slider_speed": random.choice([-1.0, 1.0]) * random.uniform(0.1, 0.5),
            "tangential_stiffness": random.uniform(100.0, 900.0),
        }
        if draw(st.booleans()):
            force[dofs[2 * k + 1]] -= 50.0
            normal = {"normal": int(dofs[2 * k + 1]), "normal_stiffness": random.uniform(100.0, 900.0)}
            contacts.append(ss.Contact(**shared, **normal))
        else:
            contacts.append(ss.Contact(**shared, normal_force=random.uniform(1.0, 30.0)))
    return ss.Scene(
        random.uniform(0.5, 2.0, size),
        100.0 * root @ root.T + 50.0 * np.eye(size),
        damping=np.diag(random.uniform(0.1, 1.0, size)),
        force=force,
        contacts=contacts,
    )


@settings(max_examples=60)
@given(scenes())
def test_modes_are_the_finite_eigenpairs_of_the_pencil(scene):
    modes = ss.complex_modes(scene, scene.core.sliding_combination()).with_conjugates
    first = sum(isinstance(contact.friction, FrictionLaw) for contact in scene.contacts)
    size = modes.mass.shape[0]
    assert size == scene.size + first
    assert len(modes) == 2 * size - first
    assert np.count_nonzero(np.diag(modes.mass) == 0.0) == first
    values = scipy.linalg.eigvals(-modes.state_b, modes.state_a)
    values = values[np.argsort(np.abs(values))][: len(modes)]
    distance = np.abs(modes.eigenvalues[:, None] - values)
    rows, columns = linear_sum_assignment(distance)
    largest = np.abs(values).max()
    # QZ leaves rounding of the whole pencil.
    assert (distance[rows, columns] <= 1e-11 * largest * modes.condition).all()
    assert modes.residual.max() < 1e-14
    # Bi-orthogonal, in the length in which each pair has a = 1.
    scale = np.sqrt(modes.a)
    gram = modes.left.T @ modes.state_a @ modes.right / scale[:, None] / scale
    assert np.abs(gram - np.eye(len(modes))).max() <= 1e-12 * modes.condition.max()


def test_a_mass_that_vanishes_has_these_modes_and_one_more():
    law = LAWS[0][0]
    expected = ss.complex_modes(block(law)).eigenvalues
    errors = []
    for mass in (1e-5, 1e-6, 1e-7):
        contact = ss.Contact(tangential=1, normal_force=PRESSED, friction=law, slider_speed=SPEED)
        stiffness = [[HELD + SPRING, -SPRING], [-SPRING, SPRING]]
        scene = ss.Scene([1.0, mass], stiffness, damping=np.diag([DAMPING, 0.0]), contacts=[contact])
        found = ss.complex_modes(scene).eigenvalues
        # The fourth one decays at about d / m.
        assert found[-1].real == pytest.approx(-PRESSED * 0.3 / mass, rel=0.1)
        errors.append(np.abs(found[:-1] - expected).max())
    # In proportion to the mass.
    assert errors[1] == pytest.approx(0.1 * errors[0], rel=0.05)
    assert errors[2] == pytest.approx(0.01 * errors[0], rel=0.05)


def test_a_disturbed_motion_is_the_sum_of_its_modes():
    """A linear law under a given normal force leaves the motion linear, as long as the node slides."""
    scene = block(Linear(0.4, 0.3))
    modes = ss.complex_modes(scene).with_conjugates
    rest = ss.steady_sliding(scene)
    run = ss.simulate(scene, 2.0, rest.perturbed(velocity={"x1": 0.05}))
    assert run.events.time.size == 0
    # v' (C x + M x' + lambda M x) / a, of x = (0, 0) and x' = (0.05, .)
    weights = modes.left_displacement[0] * 0.05 / modes.a
    for time in (0.01, 0.1, 0.7, 2.0):
        expected = (modes.right_displacement[0] * weights * np.exp(modes.eigenvalues * time)).sum()
        assert expected.imag == pytest.approx(0.0, abs=1e-15)
        moved = run.state(time).position[0] - rest.position[0]
        assert moved == pytest.approx(expected.real, rel=0.0, abs=1e-14)


def unstable() -> ss.Scene:
    """Return a scene in which friction without mass couples two modes."""
    contact = ss.Contact(
        tangential=0,
        normal=1,
        friction=Rational(0.4, 0.8, 0.2),
        slider_speed=0.3,
        tangential_stiffness=4000.0,
        normal_stiffness=900.0,
    )
    stiffness = [[1000.0, -60.0], [-60.0, 100.0]]
    return ss.Scene(
        [1.0, 1.0], stiffness, damping=np.diag([0.05, 0.05]), force=[0.0, -12.0], contacts=[contact]
    )


def test_a_small_motion_grows_as_its_mode():
    scene = unstable()
    modes = ss.complex_modes(scene)
    (number,) = (mode.number for mode in modes.select(unstable=True))
    growth, period = modes.eigenvalues[number].real, 2.0 * np.pi / modes.eigenvalues[number].imag
    assert growth > 0.5
    rest = ss.steady_sliding(scene)
    run = ss.simulate(scene, 6.0, rest.perturbed(velocity={"x1": 1e-9}))
    assert run.events.time.size == 0
    first, last = (run.state(count * period).position - rest.position for count in (12, 24))
    # The other modes have decayed by 1e-6, and the slip speed has changed by 1e-4 of itself.
    np.testing.assert_allclose(np.log(last / first) / (12 * period), growth, rtol=1e-5)


def test_a_rising_law_moves_the_hopf_point_of_a_falling_one():
    """One block on two belts: c + N_0 mu_0'(v) < 0, and a node of damper d = N_1 slope and spring k_t.

    ``(c d + m k_t) ((k + k_t) d + c k_t) = d m k k_t`` is Routh's condition for the cubic above.
    """
    falling, slope = Stribeck(0.5, 0.3, 0.1), 0.3
    node = ss.Contact(
        tangential=0,
        normal_force=8.0,
        friction=Linear(0.3, slope),
        slider_speed=SPEED,
        tangential_stiffness=SPRING,
    )
    rubbing = ss.Contact(tangential=0, normal_force=5.0, friction=falling, slider_speed=SPEED)
    scene = ss.Scene([1.0], [[HELD]], damping=[[0.2]], contacts=[rubbing, node])

    def routh(speed: float) -> float:
        c, d = 0.2 - 5.0 * 2.0 * np.exp(-speed / 0.1), 8.0 * slope
        return (c * d + SPRING) * ((HELD + SPRING) * d + c * SPRING) - d * HELD * SPRING

    expected = brentq(routh, 0.05, 0.5, xtol=1e-16)
    (point,) = ss.critical_points(scene, {"slider_speed": (0.05, 0.6)})
    assert (point.kind, point.cause, point.direction) == ("hopf", "falling friction", -1)
    assert point.value == pytest.approx(expected, rel=1e-12)
    (found,) = ss.critical_points(scene, {"slider_speed": (0.05, 0.6)}, kinds=("hopf",))
    assert found.value == pytest.approx(expected, rel=1e-12)
    speeds = np.array([0.9, 1.1]) * expected
    sweep = ss.sweep(scene, {"slider_speed": speeds})
    np.testing.assert_array_equal(sweep.stable, [False, True])
    assert sweep.sizes["branch"] == 3
    np.testing.assert_array_equal(ss.stability(scene, {"slider_speed": speeds}).unstable_modes, [1, 0])


def test_a_divergence_is_found_where_the_stiffness_is_singular():
    node = ss.Contact(
        tangential=0,
        normal_force=5.0,
        friction=Linear(0.3, 0.5),
        slider_speed=0.2,
        tangential_stiffness=700.0,
    )

    def model(stiffness: float) -> ss.Scene:
        return ss.Scene([1.0, 1.0], [[stiffness, 60.0], [60.0, 400.0]], damping=np.eye(2), contacts=[node])

    # The node relaxes, so the spring to the belt carries no small displacement for long.
    points = ss.critical_points(model, {"stiffness": (-5.0, 40.0)})
    (point,) = (point for point in points if point.kind == "divergence")
    assert point.value == pytest.approx(60.0**2 / 400.0, rel=1e-12)


@pytest.mark.parametrize("name", ["slider_speed", "friction_viscous", "normal_force", "tangential_stiffness"])
def test_sensitivities_are_differences_of_eigenvalues(name):
    scene = block(LAWS[1][0])
    value = {"slider_speed": SPEED, "friction_viscous": 2.5, "normal_force": PRESSED}.get(name, SPRING)
    step = 1e-4 * value
    above, below = (
        ss.complex_modes(scene.replace(**{name: value + side * step})).eigenvalues for side in (1.0, -1.0)
    )
    found = ss.sensitivity(scene, [name]).derivative.to_numpy()[0]
    # Differences err by the square of the step.
    np.testing.assert_allclose(found, (above - below) / (2.0 * step), rtol=1e-5)


def chain(slope: float = 0.5) -> ss.Scene:
    """Return a chain of 120 masses with eight compliant contacts."""
    size = 120
    stiffness = 2e4 * np.eye(size) - 1e4 * (np.eye(size, k=1) + np.eye(size, k=-1))
    stiffness += np.diag(500.0 + 500.0 * np.sin(np.arange(size)))
    contacts = [
        ss.Contact(
            tangential=k,
            normal=k + 1,
            friction=Linear(0.3, slope + 0.01 * k),
            slider_speed=0.3,
            tangential_stiffness=5e3,
            normal_stiffness=4e3,
        )
        for k in range(0, size, 15)
    ]
    force = np.zeros(size)
    force[1::15] = -300.0
    return ss.Scene(np.ones(size), stiffness, damping=0.3 * np.eye(size), force=force, contacts=contacts)


def test_modes_of_a_band_are_those_of_all():
    every = ss.complex_modes(chain())
    band = (20.0, 21.5)
    part = ss.complex_modes(chain(), band=band)
    assert abs(part.missing) < 0.5
    inside = (every.frequencies >= band[0]) & (every.frequencies <= band[1])
    np.testing.assert_allclose(part.eigenvalues, every.eigenvalues[inside], rtol=1e-13)
    np.testing.assert_allclose(part.condition, every.condition[inside], rtol=1e-3)
    np.testing.assert_allclose(part.shapes, every.shapes[:, inside], atol=1e-10)
    # Real ones: nodes that relax.
    real = every.eigenvalues[every.eigenvalues.imag == 0.0]
    near = ss.complex_modes(chain(), near=real[0], count=2)
    np.testing.assert_allclose(near.eigenvalues, real[:2], rtol=1e-12)


def test_a_sweep_of_a_band_has_no_mode_that_is_none():
    band = (20.0, 20.6)
    sweep = ss.sweep(chain, {"slope": np.linspace(0.5, 0.8, 3)}, band=band)
    for value in sweep.slope.to_numpy():
        exact = ss.complex_modes(chain(float(value)), band=band).with_conjugates.eigenvalues
        found = sweep.eigenvalue.sel(slope=value).to_numpy()
        frequency = np.abs(found) / (2.0 * np.pi)
        found = found[(frequency >= band[0]) & (frequency <= band[1])]
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(exact), rtol=1e-9)


def test_a_law_that_has_levelled_off_is_refused():
    law = Tabulated([0.0, 0.1, 0.3], [0.3, 0.4, 0.5])
    assert ss.complex_modes(block(law, 0.2)).eigenvalues.size == 2
    for call in (ss.complex_modes, lambda scene: ss.stability(scene, {"slider_speed": [0.4]})):
        with pytest.raises(ss.InputError, match=r"contact 0: its friction levels off at the slip speed 0\.4"):
            call(block(law, 0.4))
