"""Rest, modes and their loci beside springs: closed forms, and scenes whose springs are linear there."""

import numpy as np
import pytest
from tests.support.small_motions import check_small_motions

import stickslip as ss

K1, K3, OFFSET = 200.0, 4e4, 0.01


def pressed(**changes):
    """Return two masses on a belt, the first on a hardening spring with a damper beside it."""
    given = {
        "elements": [
            ss.Spring("x", ss.spring.Polynomial(K1, 0.0, K3), OFFSET, name="mount"),
            ss.Damper("x", ss.spring.Polynomial(0.5, 0.0, 1.0)),
        ],
        "contacts": [ss.Contact(tangential="x", normal="y", friction=0.4, slider_speed=0.2)],
    }
    return ss.Scene(
        [1.0, 1.0],
        [[300.0, 50.0], [50.0, 400.0]],
        ss.Rayleigh(0.0, 1e-3),
        [0.0, -20.0],
        dofs=["x", "y"],
        **{**given, **changes},
    )


def test_steady_sliding_balances_the_springs():
    state = ss.steady_sliding(pressed())
    x = state.position[0]
    normal = 20.0 + 50.0 * x
    spring = K1 * (x - OFFSET) + K3 * (x - OFFSET) ** 3
    assert 0.4 * normal == pytest.approx(300.0 * x + spring, rel=1e-14)
    assert state.normal_forces == pytest.approx([normal], rel=1e-14)
    assert state.unique is None


def test_modes_have_the_slopes_of_the_springs_at_rest():
    scene = pressed()
    x = ss.steady_sliding(scene).position[0]
    slope = K1 + 3.0 * K3 * (x - OFFSET) ** 2
    linear = pressed(
        elements=[ss.Spring("x", slope), ss.Damper("x", 0.5)],
    )
    found, expected = (ss.complex_modes(one).eigenvalues for one in (scene, linear))
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    # By hand: T = mu N, and N has the damper 1e-3 K as well.
    damping, stiffness = 0.3 - 0.4 * 0.05 + 0.5, 300.0 - 0.4 * 50.0 + slope
    roots = np.roots([1.0, damping, stiffness])
    np.testing.assert_allclose(found, roots[roots.imag > 0.0], rtol=1e-12)
    power = ss.complex_modes(scene).power()
    assert np.abs(power.residual).max() < 1e-12 * np.abs(power.damping_power).max()


def test_a_number_is_a_linear_spring():
    stiff = ss.Scene([1.0], [[0.0]], elements=[ss.Spring(0, 40.0), ss.Damper(0, 0.2)])
    given = ss.Scene([1.0], [[40.0]], [[0.2]])
    start = ss.State(position=[0.1], velocity=[0.0], combination="")
    ends = [ss.simulate(one, 3.0, start).state(3.0).position[0] for one in (stiff, given)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-16)
    np.testing.assert_allclose(ss.complex_modes(stiff).eigenvalues, ss.complex_modes(given).eigenvalues)


def test_springs_alone_may_hold_the_structure():
    # k3 u^3 = 8 has the root 0.2 for k3 = 1000, where its slope is 120.
    scene = ss.Scene(
        [1.0], [[0.0]], [[0.1]], [8.0], elements=[ss.Spring(0, ss.spring.Polynomial(0.0, 0.0, 1e3))]
    )
    state = ss.steady_sliding(scene)
    assert state.position[0] == pytest.approx(0.2, rel=1e-14)
    assert abs(ss.complex_modes(scene).eigenvalues[0]) ** 2 == pytest.approx(120.0, rel=1e-12)


def test_a_gap_closes_where_the_rest_is():
    for clearance, slope in ((0.01, 150.0), (0.03, 50.0)):
        spring = ss.Spring(0, ss.spring.Gap(100.0, clearance))
        scene = ss.Scene([1.0], [[50.0]], [[0.1]], [1.0], elements=[spring])
        x = ss.steady_sliding(scene).position[0]
        assert 50.0 * x + 100.0 * max(x - clearance, 0.0) == pytest.approx(1.0, rel=1e-14)
        assert abs(ss.complex_modes(scene).eigenvalues[0]) ** 2 == pytest.approx(slope, rel=1e-12)


def coupled(**changes):
    """Return three masses of which springs of friction couple two modes."""
    given = {"friction": 0.4, "k3": 4e4, **changes}
    contact = ss.Contact(tangential=0, normal=2, friction=given["friction"], slider_speed=0.2)
    spring = ss.Spring({0: 1.0, 1: 0.6}, ss.spring.Polynomial(100.0, 0.0, given["k3"]), name="mount")
    stiffness = [[300.0, -40.0, 0.0], [-40.0, 420.0, -100.0], [0.0, -100.0, 150.0]]
    damping = ss.Rayleigh(given.get("alpha", 0.0), 1e-3)
    return ss.Scene([1.0, 1.0, 0.5], stiffness, damping, [0.0, 0.0, -20.0], [contact], elements=[spring])


@pytest.mark.parametrize(("name", "values"), [("friction", [0.0, 0.7, 2.0]), ("mount_k3", [0.0, 3e4, 1e5])])
def test_sweeps_and_derivatives_follow_the_rest(name, values):
    check_small_motions(coupled(), name, values)


def test_a_damper_of_third_order_has_the_coefficient_of_its_equation():
    # x'' + x = -c x' - c3 x'^3 has l_1 = -3 c3 / 2.
    scene = ss.Scene([1.0], [[1.0]], elements=[ss.Damper(0, ss.spring.Polynomial(0.1, 0.0, 0.02), name="d")])
    (at,) = ss.critical_points(scene, {"d_k1": (-0.3, 0.4)}, kinds=("hopf",))
    assert at.value == pytest.approx(0.0, abs=1e-14)
    assert (at.criticality, at.lyapunov) == ("supercritical", pytest.approx(-0.03, rel=1e-12))


@pytest.mark.parametrize("k3", [4e3, -300.0])
def test_a_cycle_is_born_with_the_amplitude_of_the_coefficient(k3):
    # Negative damping, a spring with a square, and a damper that bounds the motion or not.
    def scene(damping):
        return ss.Scene(
            [1.0, 2.0],
            [[100.0, -30.0], [-30.0, 150.0]],
            [[0.5, 0.0], [0.0, 0.6]],
            [0.2, 0.1],
            [ss.Contact(tangential=1, normal_force=1.0, friction=0.3, slider_speed=5.0)],
            elements=[
                ss.Spring({0: 1.0, 1: -1.0}, ss.spring.Polynomial(20.0, 200.0, k3)),
                ss.Damper(0, ss.spring.Polynomial(damping, 0.0, np.sign(k3) * 2.0), name="d"),
            ],
        )

    points = ss.critical_points(scene(-0.3), {"d_k1": (-2.0, 0.0)}, kinds=("hopf",))
    at = max(points, key=lambda point: point.value)
    off = []
    for step in (4e-4, 1e-4):
        change = -np.sign(at.slope * at.lyapunov) * step
        beside = scene(at.value + change)
        frequency = 2.0 * np.pi * at.frequency
        amplitude = np.sqrt(-4.0 * at.slope * change / (frequency * at.lyapunov))
        modes = ss.complex_modes(beside)
        k = int(np.abs(modes.eigenvalues - at.eigenvalue).argmin())
        shape = modes.shapes[:, k]
        largest = int(np.abs(shape).argmax())
        shape = amplitude * shape / shape[largest]
        velocity = (modes.eigenvalues[k] * shape).real
        start = ss.steady_sliding(beside).perturbed(
            position=dict(zip(beside.dofs, shape.real, strict=True)),
            velocity=dict(zip(beside.dofs, velocity, strict=True)),
        )
        cycle = ss.simulate(beside, 8.0 / at.frequency, start).closed_cycle()
        assert cycle.stable == (at.criticality == "supercritical")
        motion = cycle.run.sample(np.linspace(0.0, cycle.period, 2001)).position.to_numpy()[:, largest]
        off.append(float(np.ptp(motion)) / (2.0 * amplitude) - 1.0)
    assert abs(off[1]) < 5e-3
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.2)


def test_what_the_slope_of_a_spring_leaves_undefined_is_refused():
    still = pressed(contacts=[ss.Contact(tangential="x", normal="y", friction=0.4)])
    with pytest.raises(ss.InputError, match="leaves open: it sticks to a slider without a speed"):
        ss.complex_modes(still, "s")
    with pytest.raises(ss.InputError, match="entries: stiffness also moves the rest"):
        ss.sensitivity(pressed(), entries="stiffness")
    # u + u^2 = -5 has no root.
    soft = ss.Scene([1.0], [[1.0]], force=[-5.0], elements=[ss.Spring(0, ss.spring.Polynomial(0.0, 1.0))])
    with pytest.raises(ss.InputError, match="no state of rest with these springs was found"):
        ss.steady_sliding(soft)
