"""Periodic motions under loads in time: period, multipliers, spectra, answers over frequency."""

import pickle

import numpy as np
import pytest

import stickslip as ss


def belt(ratio=0.8, friction=0.2, amplitude=1.0, damping=0.02, **contact):
    """A mass of 1 kg on a spring of 1 N/m, pressed onto a floor or belt by 1 N, under a harmonic load."""
    floor = ss.Contact(tangential="x", normal="y", friction=friction, **contact)
    load = ss.Harmonic({"x": amplitude}, frequency=ratio / (2.0 * np.pi), name="shaker")
    return ss.Scene(
        [1.0, 1.0],
        np.eye(2),
        damping=np.diag([damping, damping]),
        force=[0.0, -1.0],
        contacts=[floor],
        dofs=["x", "y"],
        loads=[load],
    )


START = ss.State([0.0, 0.0], [1e-3, 0.0], "-")


@pytest.fixture(scope="module")
def cycle():
    return ss.simulate(belt(), 400.0, START).limit_cycle()


def test_the_period_is_that_of_the_load(cycle):
    assert cycle.load_periods == 1
    assert cycle.period == pytest.approx(2.0 * np.pi / 0.8, rel=1e-15)
    assert cycle.residual <= 1e-13
    assert cycle.is_followed()
    assert not cycle.period_doubled


def test_the_orbit_begins_with_the_load(cycle):
    """Its first state, run as a scene does from time 0, comes back after a period."""
    run = ss.simulate(cycle.scene, 3.0 * cycle.period, cycle.run.state(0.0))
    for periods in (1, 2, 3):
        state = run.state(periods * cycle.period)
        assert state.position == pytest.approx(cycle.run.state(0.0).position, abs=1e-12)
        assert state.velocity == pytest.approx(cycle.run.state(0.0).velocity, abs=1e-12)


def test_multipliers_are_those_of_differences_of_runs(cycle):
    """All of them count: no shift along the motion is free."""
    start, step = cycle.run.state(0.0), 1e-6
    columns = []
    for kind, which in (("position", 0), ("velocity", 0)):
        ends = []
        for sign in (1.0, -1.0):
            shift = np.zeros(2)
            shift[which] = sign * step
            run = ss.simulate(cycle.scene, cycle.period, start.perturbed(**{kind: shift}))
            end = run.state(cycle.period)
            ends.append(np.array([end.position[0], end.velocity[0]]))
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    expected = np.linalg.eigvals(np.column_stack(columns))
    found = cycle.multipliers
    assert found.size == 2
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), abs=1e-8)
    assert cycle.transverse_multipliers.tolist() == found.tolist()


def test_without_friction_the_orbit_is_the_linear_answer():
    scene = belt(friction=0.0, damping=0.1)
    cycle = ss.simulate(scene, 300.0, START).limit_cycle()
    linear = 1.0 / abs(1.0 - 0.8**2 + 0.8j * 0.1)
    assert cycle.amplitude.to_numpy()[0] == pytest.approx(linear, rel=1e-12)
    coefficients = cycle.harmonics(3).amplitude.to_numpy()[:, 0]
    assert coefficients[1] == pytest.approx(linear, rel=1e-12)
    assert np.abs(coefficients[[0, 2, 3]]).max() <= 1e-12
    decay = np.exp(-0.1 * np.pi / 0.8 / 2.0 * 2.0)
    assert np.abs(cycle.multipliers) == pytest.approx([decay] * 2, rel=1e-12)


def test_the_spectrum_is_that_of_samples(cycle):
    times = np.linspace(0.0, cycle.period, 4097)[:-1]
    samples = cycle.run.sample(times).position.to_numpy()[:, 0]
    # The third derivative jumps: what is left out falls with the third power of 4096.
    sampled = np.fft.rfft(samples)[:6] / samples.size
    exact = cycle.harmonics(5).coefficient.to_numpy()[:, 0]
    assert np.abs(sampled - exact).max() <= 1e-7


def test_energy_over_a_period_closes(cycle):
    balance = cycle.balance()
    assert abs(balance.residual) <= 1e-13 * balance.turnover
    assert abs(balance.stored) <= 1e-12 * balance.turnover
    heat = float(balance.contacts.friction_heat.sum())
    # Archard: friction times the wear integral is the heat.
    assert 0.2 * float(balance.contacts.wear.sum()) == pytest.approx(heat, rel=1e-12)


def test_a_cycle_comes_back_from_its_pickle(cycle):
    again = pickle.loads(pickle.dumps(cycle))
    assert again.load_periods == 1
    assert again.multipliers.tolist() == cycle.multipliers.tolist()
    assert [phase.event for phase in again.phases][-1] == "load"
    assert again.phases[-1].name == "load"


def test_two_loads_have_the_period_of_both():
    base = belt(friction=0.1, damping=0.1)
    second = ss.Harmonic({"x": 0.5}, frequency=1.5 * base.loads[0].frequency, phase=0.4)
    scene = base.replace(loads=[*base.loads, second])
    cycle = ss.simulate(scene, 600.0, START).limit_cycle()
    assert cycle.period == pytest.approx(2.0 / base.loads[0].frequency, rel=1e-14)
    assert cycle.load_periods == 1
    assert cycle.stable


def test_loads_without_a_common_period_are_named():
    base = belt()
    second = ss.Harmonic({"x": 0.5}, frequency=np.sqrt(2.0) * base.loads[0].frequency)
    run = ss.simulate(base.replace(loads=[*base.loads, second]), 50.0, START)
    with pytest.raises(ss.InputError, match="have no common period"):
        run.limit_cycle()


def test_what_always_sticks_is_an_orbit_of_one_phase():
    plate = ss.Contact(tangential="x", normal="y", friction=0.5, slider_vibration=ss.Harmonic(0.1, 1.0))
    scene = ss.Scene([1.0, 1.0], np.zeros((2, 2)), force=[0.0, -10.0], contacts=[plate], dofs=["x", "y"])
    cycle = ss.simulate(scene, 20.0, ss.State([0.0, 0.0], [0.1, 0.0], "s")).limit_cycle()
    assert cycle.combinations == ("s",)
    assert cycle.amplitude.to_numpy()[0] == pytest.approx(0.1 / (2.0 * np.pi), rel=1e-12)


def test_a_switched_load_keeps_its_last_value():
    base = belt(friction=0.1, damping=0.2)
    offset = ss.Switched({"x": 0.3}, times=[5.0, 11.0], values=[0.0, -1.0, 1.0])
    cycle = ss.simulate(base.replace(loads=[*base.loads, offset]), 400.0, START).limit_cycle()
    shifted = ss.simulate(base.replace(force=[0.3, -1.0]), 400.0, START).limit_cycle()
    assert cycle.maximum.to_numpy() == pytest.approx(shifted.maximum.to_numpy(), rel=1e-11)
    assert cycle.multipliers == pytest.approx(shifted.multipliers, abs=1e-10)


def test_rest_after_a_switch_is_found():
    stop = ss.Switched({"x": 1.0}, times=[3.0], values=[1.0, 0.0])
    scene = ss.Scene([1.0], [[1.0]], damping=[[0.5]], dofs=["x"], loads=[stop])
    run = ss.simulate(scene, 100.0, ss.State([0.0], [0.0], ""))
    with pytest.raises(ss.RunError, match="equilibrium"):
        run.limit_cycle()


def test_a_branch_over_the_amplitude_and_the_frequency(cycle):
    branch = ss.continuation(cycle, {"shaker_amplitude": (1.0, 1.2)}, step=0.5)
    largest = branch.data.maximum.sel(dof="x").to_numpy()
    assert (np.diff(largest) > 0.0).all()
    alone = ss.simulate(belt(amplitude=1.2), 400.0, START).limit_cycle()
    assert largest[-1] == pytest.approx(float(alone.maximum.sel(dof="x")), rel=1e-11)
    slower = ss.continuation(cycle, {"shaker_frequency": (0.4 / np.pi, 0.7 / (2.0 * np.pi))}, step=0.5)
    alone = ss.simulate(belt(ratio=0.7), 400.0, START).limit_cycle()
    assert slower.data.maximum.sel(dof="x").to_numpy()[-1] == pytest.approx(
        float(alone.maximum.sel(dof="x")), rel=1e-11
    )
    assert slower.data.followed.all()


def test_bifurcations_over_a_load_are_stroboscopic():
    result = ss.bifurcation(
        belt(), {"shaker_amplitude": [0.5, 1.0, 1.5]}, start=START, follow=True, stretch=60.0
    )
    assert (result.data.kind == "cycle").all()
    assert [cycle.load_periods for cycle in result.cycles] == [1, 1, 1]
    assert not result.data.restarted.any()


def test_frequency_response_without_contact_is_the_linear_one():
    # A load on two dofs has no one amplitude, but one frequency.
    load = ss.Harmonic({"x1": 1.0, "x2": -0.5}, frequency=1.0, name="shaker")
    scene = ss.Scene([1.0, 2.0], [[50.0, -20.0], [-20.0, 40.0]], damping=0.3 * np.eye(2), loads=[load])
    response = ss.frequency_response(
        scene, {"shaker_frequency": np.linspace(0.4, 1.6, 7)}, start=ss.State([0.0, 0.0], [0.0, 0.0], "")
    )
    data = response.data
    assert data.sizes["point"] == 7
    assert data.stable.all()
    assert data.response.to_numpy() == pytest.approx(data.linear.to_numpy()[::8], rel=1e-11)
    assert data.linear_frequency.to_numpy()[::8] == pytest.approx(data.frequency.to_numpy(), rel=1e-15)
    diagram = ss.bifurcation(
        scene, {"shaker_frequency": [0.4, 0.6]}, start=ss.State([0.0, 0.0], [0.0, 0.0], "")
    )
    largest = np.array([cycle.maximum.to_numpy() for cycle in diagram.cycles])
    assert largest == pytest.approx(data.linear.to_numpy()[[0, 8]], rel=1e-11)


@pytest.fixture(scope="module")
def hitting():
    """An oscillator that hits a stop at x = -4, with a restitution of 0.8, around its resonance."""
    stop = ss.Contact(normal="x", gap=4.0, restitution=0.8)
    load = ss.Harmonic({"x": 1.0}, frequency=0.1, name="shaker")
    scene = ss.Scene([1.0], [[1.0]], damping=[[0.04]], contacts=[stop], dofs=["x"], loads=[load])
    ratios = np.array([0.8, 1.05, 1.15, 1.25, 1.35, 1.45, 1.55])
    return ss.frequency_response(
        scene, {"shaker_frequency": ratios / (2.0 * np.pi)}, start=ss.State([0.0], [0.0], "d")
    )


def test_a_response_has_two_stable_answers_and_an_unstable_one_between(hitting):
    data = hitting.data
    ratio = 2.0 * np.pi * data.frequency.to_numpy()
    response, stable = data.response.to_numpy()[:, 0], data.stable.to_numpy()
    for value in (1.15, 1.25, 1.35, 1.45):
        here = stable & np.isclose(ratio, value)
        assert here.sum() == 2
        low, high = np.sort(response[here])
        # The lower one does not touch the stop.
        assert low == pytest.approx(1.0 / abs(1.0 - value**2 + 0.04j * value), rel=1e-11)
        assert high > 4.0
        between = ~stable & (np.abs(ratio - value) < 0.01)
        assert between.any()
        assert (response[between] > low).all()
        assert (response[between] < high).all()
    assert (data.largest_multiplier.to_numpy()[stable] < 1.0).all()
    # The branch turns back near 1.497.
    assert 1.49 < ratio[~stable].max() < 1.50


def test_a_response_draws_and_keeps_its_numbers(hitting, tmp_path):
    axes = hitting.plot()
    assert axes.get_xlabel().endswith("Hz")
    assert "linear" in {text.get_text() for text in axes.get_legend().get_texts()}
    ss.save(hitting.to_dataset(), tmp_path / "response.nc")
    again = ss.load(tmp_path / "response.nc")
    assert again.response.equals(hitting.data.response)
    assert "orbits" in str(hitting.summary())
    with pytest.raises(ss.InputError, match="no dof 'z'"):
        hitting.plot("z")


def test_mistakes_of_a_response_are_named():
    scene = belt()
    with pytest.raises(ss.InputError, match="shake_frequency: a scene has no such"):
        ss.frequency_response(scene, {"shake_frequency": [1.0]})
    with pytest.raises(ss.InputError, match="expected the frequency of a load, got 'shaker_amplitude'"):
        ss.frequency_response(scene, {"shaker_amplitude": [1.0]})
    with pytest.raises(ss.InputError, match="must be positive"):
        ss.frequency_response(scene, {"shaker_frequency": [0.0, 1.0]})
    with pytest.raises(ss.InputError, match="unknown dof 'z'"):
        ss.frequency_response(scene, {"shaker_frequency": [1.0]}, dofs=["z"])


def test_a_joint_that_never_slips_answers_with_the_period_of_its_load():
    """A linear motion: x'' + 5 x' + 3e4 x = 20 sin(w t), which the spring of the stuck contact stiffens."""

    def joint(frequency):
        contact = ss.Contact(tangential="x", friction=0.3, normal_force=100.0, tangential_stiffness=2e4)
        load = ss.Harmonic({"x": 20.0}, frequency, name="shaker")
        matrices = {"mass": [1.0], "stiffness": [[1e4]], "damping": [[5.0]], "dofs": ["x"]}
        return ss.Scene(**matrices, contacts=[contact], loads=[load])

    frequencies = np.linspace(8.0, 40.0, 60)
    start = ss.State([0.0], [0.0], "s", dofs=["x"])
    response = ss.frequency_response(joint(20.0), {"shaker_frequency": frequencies}, start=start)
    assert (response.data.load_periods == 1).all()
    for frequency in (17.76, 37.29):
        cycle = ss.simulate(joint(frequency), 20.0, start).limit_cycle()
        assert cycle.load_periods == 1
        assert "contact 0 sticks throughout" in cycle.stability
        rate = 2.0 * np.pi * frequency
        # The constant that the spring keeps shifts the motion of the stiffer oscillator.
        x = cycle.run.sample(np.linspace(0.0, cycle.period, 64, endpoint=False)).position.values[:, 0]
        amplitude = 2.0 * np.abs(np.fft.rfft(x)[1]) / 64
        assert amplitude == pytest.approx(20.0 / np.abs(3e4 - rate**2 + 5j * rate), rel=1e-10)


def one_sided(rate=0.73):
    """NLvib's two masses (verification/nonlinear_springs.py): the first meets a stop of 100 N/m at 1 m."""
    stiffness = np.array([[1.0, -1.0], [-1.0, 2.0]])
    load = ss.Harmonic({"x2": 0.1}, rate / (2.0 * np.pi))
    stop = ss.Spring("x1", ss.spring.Gap(100.0, 1.0))
    return ss.Scene([1.0, 1.0], stiffness, 0.03 * stiffness, loads=[load], elements=[stop])


@pytest.mark.parametrize("by_function", [False, True])
def test_a_branch_may_begin_far_from_its_cycle(by_function):
    """Newton's method does not come from 0.73 to 0.6 rad/s at once, where the branch has an orbit."""
    period = 2.0 * np.pi / 0.73
    run = ss.simulate(one_sided(), 150.0 * period, ss.State([1.0, 0.5], [0.3, 0.0], ""))
    cycle = run.limit_cycle(further=100.0 * period)
    with pytest.raises(ss.OrbitError):
        cycle.continued(one_sided(0.6))
    name, unit = ("rate", 1.0) if by_function else ("load_0_frequency", 2.0 * np.pi)
    model = one_sided if by_function else None
    there = ss.continuation(cycle, {name: (0.73 / unit, 0.6 / unit)}, model, step=0.3)
    back = ss.continuation(cycle, {name: (0.6 / unit, 0.73 / unit)}, model, step=0.3)
    assert (there.end, back.end) == ("range", "range")
    assert back.data.followed.all()
    # The same orbits at both ends, to the rounding that Newton's method leaves beside multipliers of 1.4.
    for a, b in ((there.cycles[0], back.cycles[-1]), (there.cycles[-1], back.cycles[0])):
        assert b.amplitude.to_numpy() == pytest.approx(a.amplitude.to_numpy(), rel=1e-11)
