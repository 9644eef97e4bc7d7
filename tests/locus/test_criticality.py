"""Criticality of Hopf points beside closed forms and the cycles that are born there."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.locus.criticality import criticality

BELT = ss.friction.Stribeck(0.5, 0.3, 0.1)
STIFFNESS = [[1000.0, -300.0], [-300.0, 2000.0]]
DAMPING = [[0.8, 0.2], [0.2, 2.0]]


def oscillator(law, speed, damping=0.1):
    """Return a mass on a belt, ``x'' + c x' + x = mu(v - x')``, whose frequency is 1."""
    belt = ss.Contact(tangential="x", normal_force=1.0, friction=law, slider_speed=speed)
    return ss.Scene([1.0], [[1.0]], damping=[[damping]], contacts=[belt], dofs=["x"])


def pressed(law, speed=0.2, **given):
    """Return a mass whose normal force on a belt changes as it moves."""
    belt = ss.Contact(tangential="x", normal="y", friction=law, slider_speed=speed, **given)
    return ss.Scene(
        [1.0, 1.0], STIFFNESS, damping=DAMPING, force=[0.0, -20.0], contacts=[belt], dofs=["x", "y"]
    )


def in_plane(law, stiffness=None, damping=0.02, **pressed):
    """Return a mass on a belt that moves it in the plane of x and y, obliquely."""
    if stiffness is None:
        stiffness = [[100.0, -30.0, 20.0], [-30.0, 200.0, -15.0], [20.0, -15.0, 400.0]]
    belt = ss.Contact(tangential=("x", "y"), friction=law, slider_speed=(0.3, 0.3), **pressed)
    return ss.Scene(
        [1.0, 1.0, 0.5],
        stiffness,
        damping=damping * np.array(stiffness),
        force=[0.0, 0.0, -20.0],
        dofs=["x", "y", "z"],
        contacts=[belt],
    )


def hopf_point(scene, low, high):
    points = ss.critical_points(scene, {"slider_speed": (low, high)}, kinds=("hopf",))
    return next(point for point in reversed(points) if point.steady_sliding)


def test_a_mass_on_a_belt_has_the_coefficient_of_its_equation():
    # x'' + x = a_2 x'^2 + a_3 x'^3 with a_3 = -mu'''/6 has l_1 = 3 a_3 / 2; the square alone only shifts it.
    at = hopf_point(oscillator(ss.friction.Stribeck(1.0, 0.5, 0.5), 1.5), 1.0, 2.0)
    assert at.criticality == "subcritical"
    assert at.lyapunov == pytest.approx(np.exp(-at.value / 0.5), rel=1e-12)


def test_friction_whose_slope_turns_upward_is_supercritical():
    law = ss.friction.Law("0.5 - 0.1 * s - 0.01 * (s - 1)**2 + 0.02 * (s - 1)**3")
    at = hopf_point(oscillator(law, 1.0), 0.7, 1.2)
    assert at.criticality == "supercritical"
    assert at.value == pytest.approx(1.0, rel=1e-12)
    assert at.lyapunov == pytest.approx(-0.03, rel=1e-12)


LAWS = [
    BELT,
    ss.friction.Rational(0.9, 0.3, 0.1),
    ss.friction.Law("0.3 + 0.2 * exp(-s / 0.1)"),
    ss.friction.Law("0.3 + 0.2 / (1 + (s / 0.15)**2)"),
    ss.friction.Tabulated([0.0, 0.1, 0.3, 0.6, 1.2], [0.9, 0.7, 0.5, 0.4, 0.35]),
]
SCENES = {
    **{f"law {k}": pressed(law) for k, law in enumerate(LAWS)},
    "sliding backward": pressed(BELT, -0.2),
    "compliant": pressed(BELT, normal_stiffness=3000.0),
    "two subsystems": ss.models.two_subsystems(friction=ss.friction.Stribeck(0.8, 0.5, 0.1)),
    "stop": pressed(BELT).replace(
        contacts=[*pressed(BELT).contacts, ss.Contact(normal={"x": 1.0}, gap=1.0)],
    ),
    "bristles": oscillator(
        ss.friction.LuGre(1.0, 0.5, 0.5, stiffness=50.0, damping=0.1, viscous=0.01), 1.0, damping=0.3
    ),
    "own state": oscillator(
        ss.friction.StateLaw("(0.8 - 0.4 * exp(-z)) * tanh(s / 0.05)", "1 - abs(s) * z / 0.2"),
        1.0,
        damping=0.05,
    ),
    "plane": in_plane(BELT, normal_force=20.0),
    "plane that presses": in_plane(ss.friction.Rational(0.9, 0.3, 0.1), normal="z"),
    "plane by a table": in_plane(
        ss.friction.Tabulated([0.0, 0.2, 0.5, 1.0, 2.0], [0.9, 0.6, 0.45, 0.4, 0.38]), normal="z"
    ),
    # What turns with the slip makes constant friction nonlinear.
    "plane with constant friction": in_plane(
        0.6,
        stiffness=[[100.0, 0.0, 60.0], [0.0, 90.0, -50.0], [60.0, -50.0, 110.0]],
        damping=0.004,
        normal="z",
    ),
    "rate and state": oscillator(ss.friction.RateState(0.3, 0.05, 0.08, 0.5, 1.0), 1.0, damping=0.01),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_cycle_is_born_with_the_amplitude_of_the_coefficient(name):
    scene = SCENES[name]
    ends = sorted(np.sign(scene.contacts[0].slider_speed) * np.array([0.15, 3.0]))
    at = hopf_point(scene, *ends)
    assert at.criticality in ("subcritical", "supercritical")
    frequency, off = 2.0 * np.pi * at.frequency, []
    for step in (1e-4, 2.5e-5):
        change = -np.sign(at.slope * at.lyapunov) * step * abs(at.value)
        amplitude = np.sqrt(-4.0 * at.slope * change / (frequency * at.lyapunov))
        beside = scene.replace(slider_speed=at.value + change)
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
        cycle = ss.simulate(beside, 12.0 * 2.0 * np.pi / frequency, start).closed_cycle()
        # A subcritical point has a cycle that repels.
        assert cycle.stable == (at.criticality == "supercritical")
        motion = cycle.run.sample(np.linspace(0.0, cycle.period, 2001)).position.to_numpy()[:, largest]
        off.append(float(np.ptp(motion)) / (2.0 * amplitude) - 1.0)
    assert abs(off[1]) < 1e-3
    # What is left is of the next order, in the square of the amplitude.
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("power", [2, 3, 4])
def test_stiff_bristles_have_the_coefficient_of_their_steady_slip(power):
    def level(s):
        return 0.5 + 0.5 * np.exp(-((s / 0.5) ** 2))

    rigid = hopf_point(oscillator(ss.friction.Law(level), 1.0), 0.7, 2.0)
    stiffness = 10.0**power
    bent = hopf_point(oscillator(ss.friction.LuGre(1.0, 0.5, 0.5, stiffness), 1.0), 0.7, 2.0)
    assert bent.criticality == rigid.criticality == "subcritical"
    assert (bent.lyapunov / rigid.lyapunov - 1.0) * stiffness == pytest.approx(-0.2425, rel=0.04)
    # In a user's words the derivatives are those of formulas, not of products.
    words = ("k * z", "s - k * abs(s) * z / (0.5 + 0.5 * exp(-(s / 0.5)**2))")
    own = hopf_point(oscillator(ss.friction.StateLaw(*words, k=stiffness), 1.0), 0.7, 2.0)
    assert own.lyapunov == pytest.approx(bent.lyapunov, rel=1e-11)


def test_the_friction_of_bristles_presses_another_contact():
    def beside(law):
        scrubber = ss.Contact(tangential="z", normal_force=40.0, friction=law, slider_speed=0.2)
        return ss.Scene(
            [1.0, 1.0, 1.0],
            [[1000.0, -300.0, 0.0], [-300.0, 2000.0, -800.0], [0.0, -800.0, 3000.0]],
            damping=[[0.8, 0.2, 0.0], [0.2, 2.0, 0.0], [0.0, 0.0, 2.0]],
            force=[0.0, -20.0, 0.0],
            contacts=[*pressed(BELT).contacts, scrubber],
            dofs=["x", "y", "z"],
        )

    rigid = hopf_point(beside(ss.friction.Linear(0.5, 0.5)), 0.15, 3.0)
    bent = hopf_point(beside(ss.friction.LuGre(0.5, 0.5, 1.0, stiffness=1e6, viscous=0.5)), 0.15, 3.0)
    assert bent.value == pytest.approx(rigid.value, rel=1e-4)
    assert bent.lyapunov == pytest.approx(rigid.lyapunov, rel=1e-3)


def test_constant_friction_is_linear_until_a_status_changes():
    points = ss.critical_points(ss.models.two_subsystems(), {"friction": (0.6, 1.0)}, kinds=("hopf",))
    assert [point.criticality for point in points] == ["linear until a status changes"]
    assert points[0].lyapunov == 0.0
    assert "linear until a status changes" in repr(points[0])
    # So it is where friction falls along a straight line, and the normal force stays.
    falling = oscillator(ss.friction.Linear(0.9, -0.1), 1.0)
    points = ss.critical_points(falling, {"damping": (0.5, 1.5)}, kinds=("hopf",))
    assert [point.criticality for point in points] == ["linear until a status changes"]


def test_no_coefficient_without_steady_sliding():
    scene = ss.models.two_subsystems(friction=ss.friction.Stribeck(0.8, 0.5, 0.1))
    assert criticality(scene, "s+", 700.0j) is None
    points = ss.critical_points(scene, {"slider_speed": (0.05, 1.0)})
    others = [point for point in points if point.kind != "hopf"]
    assert others
    assert all(point.criticality is None and point.lyapunov is None for point in others)
    data = points.to_dataset()
    assert data.criticality.to_numpy().tolist() == [point.criticality or "" for point in points]
    assert np.isnan(data.lyapunov).sum() == len(others)
    assert list(type(points).from_dataset(data)) == list(points)
