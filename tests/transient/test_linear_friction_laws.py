"""Laws that leave phases linear: by modes, against closed forms and against the nonlinear series."""

import numpy as np
import pytest
from mpmath import mp, mpf

import stickslip as ss
from stickslip.scene.laws.friction import Linear, Rational, Stribeck, Tabulated


def table(law: Linear) -> Tabulated:
    """Return the same law as measured values: its phases go by the series of the nonlinear equations.

    It is the same up to its second speed, faster than which nothing slips here.
    """
    half = min(8.0, 0.5 * law.mu0 / abs(law.slope))
    speeds = [0.0, half, 2.0 * half]
    return Tabulated(speeds, [max(law.coefficient(speed), 0.0) for speed in speeds])


def block(law, damping: float = 0.7, **given) -> tuple[ss.Scene, ss.State]:
    """Return a block on a belt under a given normal force, and a start that slides."""
    contact = ss.Contact(tangential=0, normal_force=10.0, friction=law, slider_speed=0.2, **given)
    scene = ss.Scene([1.0], [[100.0]], damping=[[damping]], contacts=[contact])
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})


def two_blocks(law, other=None) -> tuple[ss.Scene, ss.State]:
    """Return two blocks on two belts under given normal forces."""
    contacts = [
        ss.Contact(tangential=0, normal_force=10.0, friction=law, slider_speed=0.3),
        ss.Contact(tangential=1, normal_force=7.0, friction=other or law, slider_speed=-0.2),
    ]
    stiffness = [[160.0, -60.0], [-60.0, 300.0]]
    scene = ss.Scene([1.0, 1.4], stiffness, damping=np.diag([0.2, 0.3]), contacts=contacts)
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})


def pressed_block(law) -> tuple[ss.Scene, ss.State]:
    """Return a block that a weight presses, on springs that its slip does not load."""
    contact = ss.Contact(tangential=0, normal=1, friction=law, slider_speed=0.2)
    stiffness = np.diag([100.0, 500.0])
    scene = ss.Scene(
        [1.0, 1.0], stiffness, damping=np.diag([0.7, 0.1]), force=[0.0, -10.0], contacts=[contact]
    )
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})


def block_and_stops(law) -> tuple[ss.Scene, ss.State]:
    """Return a block between two stops: three contacts act along one dof."""
    contacts = [
        ss.Contact(tangential="x1", normal_force=1.0, friction=law, static_friction=8.0),
        ss.Contact(normal={"x1": 1.0}, gap=0.4),
        ss.Contact(normal={"x1": -1.0}, gap=0.4),
    ]
    scene = ss.Scene([1.0], [[500.0]], force=[-125.0], contacts=contacts, dofs=["x1"])
    return scene, ss.State([0.0], [-5.0], "+dd", dofs=scene.dofs)


def coupled_blocks(law) -> tuple[ss.Scene, ss.State]:
    """Return two blocks whose mass couples their slips."""
    contacts = [
        ss.Contact(tangential=0, normal_force=10.0, friction=law, slider_speed=0.3),
        ss.Contact(tangential=[0.3, 1.0], normal_force=7.0, friction=law, slider_speed=0.2),
    ]
    stiffness = [[160.0, -60.0], [-60.0, 300.0]]
    mass = [[1.0, 0.2], [0.2, 1.4]]
    scene = ss.Scene(mass, stiffness, damping=np.diag([0.2, 0.3]), contacts=contacts)
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})


def shaken_block(law) -> tuple[ss.Scene, ss.State]:
    """Return a block on a belt that vibrates, under a load that oscillates."""
    contact = ss.Contact(
        tangential=0,
        normal_force=10.0,
        friction=law,
        slider_speed=0.3,
        slider_vibration=ss.Harmonic(0.05, frequency=3.1),
    )
    loads = [ss.Harmonic({"x1": 1.0}, frequency=2.3)]
    scene = ss.Scene([1.0], [[100.0]], damping=[[0.3]], contacts=[contact], loads=loads)
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 0.05})


SCENES = [block, two_blocks, pressed_block, block_and_stops, coupled_blocks, shaken_block]


def test_a_sliding_block_is_a_damped_oscillator_in_closed_form():
    law = Linear(0.4, 0.05)
    scene, start = block(law)
    times = np.linspace(0.0, 6.0, 50)
    run = ss.simulate(scene, 6.0, start, method="modal")
    assert run.events.time.size == 0
    # x'' + (c + N m) x' + k x = N (mu0 + m v)
    decay, rest = (0.7 + 0.5) / 2.0, 10.0 * (0.4 + 0.05 * 0.2) / 100.0
    rate = np.sqrt(100.0 - decay**2)
    away, speed = start.position[0] - rest, start.velocity[0]
    turn = away * np.cos(rate * times) + (speed + decay * away) / rate * np.sin(rate * times)
    found = run.sample(times)
    np.testing.assert_allclose(found.position.values[:, 0], rest + np.exp(-decay * times) * turn, rtol=1e-12)
    forces = [10.0 * law.coefficient(0.2 - v) for v in found.velocity.values[:, 0]]
    np.testing.assert_allclose(found.friction_force.values[:, 0], forces, rtol=1e-13)


@pytest.mark.parametrize(("own", "other"), [(0.0, 0.0), (0.1, 0.0), (0.0, 0.2), (0.1, 0.2)])
@pytest.mark.parametrize("first", [True, False])
def test_two_sliders_on_one_dof_of_which_some_vibrate(own, other, first):
    """A damper between body and slider has to follow the slider; a table of the same law never takes one."""
    speeds = np.linspace(0.0, 3.0, 7)
    ends = []
    for law in (Linear(0.2, 0.1), Tabulated(speeds, 0.2 + 0.1 * speeds)):
        contacts = [
            ss.Contact(
                tangential=0,
                normal_force=force,
                friction=friction,
                slider_speed=speed,
                slider_vibration=ss.Harmonic(amplitude, frequency=3.0) if amplitude else None,
            )
            for force, friction, speed, amplitude in ((10.0, law, 0.5, own), (5.0, 0.1, 0.9, other))
        ]
        scene = ss.Scene([1.0], [[100.0]], contacts=contacts if first else contacts[::-1])
        end = ss.simulate(scene, 0.4, ss.State([0.0], [0.0], "++", dofs=scene.dofs)).state(0.4)
        ends.append([*end.position, *end.velocity])
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-12)


def test_the_end_of_slip_is_a_root_of_the_closed_form():
    mp.dps = 40
    scene, start = block(Linear(0.4, -0.3))
    start = start.perturbed(velocity={"x1": 0.1})
    run = ss.simulate(scene, 5.0, start, max_events=1)
    decay, rest = (mpf(0.7) - 10 * mpf(0.3)) / 2, 10 * (mpf(0.4) - mpf(0.3) * mpf(0.2)) / 100
    rate = mp.sqrt(100 - decay**2)
    away, speed = mpf(float(start.position[0])) - rest, mpf(float(start.velocity[0]))

    def velocity(t: mpf) -> mpf:
        b = (speed + decay * away) / rate
        wave = (b * rate - decay * away) * mp.cos(rate * t) - (away * rate + decay * b) * mp.sin(rate * t)
        return mp.exp(-decay * t) * wave

    time = mp.findroot(lambda t: velocity(t) - mpf(0.2), mpf(float(run.events.time[0])))
    assert abs(float(mpf(float(run.events.time[0])) - time)) < 1e-14


@pytest.mark.parametrize("law", [Linear(0.4, -0.03), Linear(0.4, 0.02)], ids=repr)
@pytest.mark.parametrize("scene_of", SCENES)
def test_modes_and_both_series_have_the_same_events(scene_of, law):
    if scene_of is block_and_stops:
        law = Linear(8.0, 10.0 * law.slope)
    scene, start = scene_of(law)
    nonlinear, _ = scene_of(table(law))
    modal = ss.simulate(scene, 4.0, start, method="modal")
    others = [ss.simulate(scene, 4.0, start, method="taylor"), ss.simulate(nonlinear, 4.0, start)]
    for other in others:
        assert list(modal.events.combination) == list(other.events.combination)
        assert list(modal.events.kind) == list(other.events.kind)
        np.testing.assert_allclose(modal.events.time, other.events.time, rtol=0.0, atol=2e-12)
        state, same = modal.state(4.0), other.state(4.0)
        np.testing.assert_allclose(state.position, same.position, rtol=0.0, atol=2e-12)
        np.testing.assert_allclose(state.velocity, same.velocity, rtol=0.0, atol=2e-11)
    # Works of some joules.
    assert abs(modal.balance().residual) < 1e-12
    works, same = modal.balance(), others[1].balance()
    np.testing.assert_allclose(works.friction_heat, same.friction_heat, atol=1e-11)


def test_laws_with_one_value_are_linear():
    for law in (Stribeck(0.4, 0.4, 0.1, 0.05), Rational(0.4, 0.4, 0.1), Linear(0.4, 0.0)):
        scene, start = block(law)
        run = ss.simulate(scene, 1.0, start, method="modal")
        assert run.stop_reason == "duration"


def test_a_normal_force_that_moves_is_refused_by_modes():
    law = Linear(0.4, 0.02)
    contact = ss.Contact(tangential=0, normal=1, friction=law, slider_speed=0.2)
    stiffness = [[100.0, -20.0], [-20.0, 500.0]]
    scene = ss.Scene([1.0, 1.0], stiffness, force=[0.0, -10.0], contacts=[contact])
    with pytest.raises(ss.InputError, match="method 'modal'"):
        ss.simulate(scene, 1.0, ss.steady_sliding(scene), method="modal")


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_friction_that_falls_to_zero_stops_the_run(method):
    law = Linear(0.4, -1.0)
    scene, start = block(law)
    with pytest.raises(ss.RunError, match=r"contact 0 at t = .* its friction reaches 0") as stopped:
        ss.simulate(scene, 50.0, start, method=method)
    partial = stopped.value.partial
    assert 0.2 - partial.state(partial.duration).velocity[0] == pytest.approx(0.4, abs=1e-12)
    # It begins beyond.
    beyond = ss.State(start.position, [-0.3], "+", dofs=scene.dofs)
    with pytest.raises(ss.RunError, match="at t = 0 s: its friction reaches 0"):
        ss.simulate(scene, 1.0, beyond, method=method)


def test_cycles_multipliers_and_harmonics_are_those_of_the_series():
    law = Linear(0.4, -0.2)
    cycles = []
    for same in (law, table(law)):
        scene, _ = block(same, static_friction=0.45)
        start = ss.State([0.04], [0.2], "s", dofs=scene.dofs)
        cycles.append(ss.simulate(scene, 20.0, start).limit_cycle())
    found, expected = cycles
    assert found.period == pytest.approx(expected.period, rel=1e-12)
    np.testing.assert_allclose(found.multipliers, expected.multipliers, atol=1e-10)
    for name, values in found.harmonics(6).items():
        np.testing.assert_allclose(values, expected.harmonics(6)[name], atol=1e-12)
