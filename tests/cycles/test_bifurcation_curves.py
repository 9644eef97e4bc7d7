"""Bifurcations of periodic orbits over two parameters, beside scaling laws and printed folds."""

from functools import cache, partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import stickslip as ss
from stickslip import types
from stickslip.cycles.branches import plane_curve

#: The printed folds of the forced oscillator of Duffing, rad/s (tests/verification/nonlinear_springs.py).
FOLDS = (1.115700251771, 1.269601955546)
#: The printed friction at the fold of the minimal model (tests/verification/cubic_contact.py).
FOLD = 0.5457499619
#: Belt speed, m/s, that the unstable cycle of bSTAB's oscillator touches (tests/verification/bistable.py).
TOUCH = 1.836600972

hoffmann = partial(ss.models.hoffmann, damping=0.1, cubic=1.0, preload=50.0, slider_speed=-100.0)
bistable = ss.models.bistable_oscillator


@cache
def coupled_cycle() -> ss.Cycle:
    """Return the stable cycle of the minimal model at friction 0.8."""
    state = [-3.37510688174579, 2.11978586044956, 0.0], [0.738843274206283, 0.0, 0.0]
    return ss.simulate(hoffmann(friction=0.8), 10.0, ss.State(*state, "-")).limit_cycle(further=100.0)


@cache
def coupled_fold() -> types.BranchPoint:
    return ss.continuation(coupled_cycle(), {"friction": (0.8, 0.5)}, hoffmann, step=0.1, points=20).folds[0]


@cache
def touch() -> types.BranchPoint:
    """Return where the cycle of sliding touches the speed of its belt."""
    scene = bistable(slider_speed=1.5)
    start = ss.steady_sliding(scene).perturbed(velocity={"x": 1.3})
    cycle = ss.simulate(scene, 8.0, start).closed_cycle()
    return ss.continuation(cycle, {"slider_speed": (1.5, 1.9)}, step=0.2).points[0]


def test_a_branch_beyond_its_fold_ends_at_the_hopf_point():
    branch = ss.continuation(coupled_cycle(), {"friction": (0.8, 0.5)}, hoffmann, step=0.1, points=200)
    fold, hopf = branch.points
    assert (fold.kind, hopf.kind, branch.end) == ("fold", "hopf", "hopf")
    assert fold.value == pytest.approx(FOLD, rel=2e-10)
    # 3/4 (1 + 2 c^2). The parabola over the square of the amplitude leaves out its cube, which is one of a
    # scale: that of the fold, from which the branch has come back, of 1.2 m.
    last = [float(cycle.amplitude.max()) / 1.2 for cycle in branch.cycles[-3:]]
    assert hopf.value == pytest.approx(0.765, abs=10.0 * (0.765 - FOLD) * np.prod(last) ** 2)
    with pytest.raises(ss.InputError, match=r"cycle: a Hopf point .* stability_boundary"):
        ss.continuation(hopf, {"friction": (0.5, 0.9), "damping": (0.05, 0.15)}, hoffmann)


@pytest.mark.slow
@pytest.mark.nightly
def test_a_fold_does_not_depend_on_the_unit_of_length():
    """With y in units of (4/3 / cubic)^(1/2) the equations hold no cubic: the fold is at one friction."""
    plane = {"cubic": (0.8, 1.2), "friction": (0.4, 0.7)}
    found = ss.continuation(coupled_fold(), plane, hoffmann, step=0.3)
    assert found.curve.ends == ("range", "range")
    assert found.points == ()
    assert sorted(found.curve.values[[0, -1], 0]) == [0.8, 1.2]
    # The fold is found to 2e-10 of friction, as over one parameter.
    assert found.curve.values[:, 1] == pytest.approx(np.full(len(found.cycles), FOLD), rel=2e-10)
    assert found.curve.error.max() <= 1e-11
    # Below it there is one stable cycle fewer, and one unstable.
    assert (found.curve.unstable_modes == 0).all()


@pytest.mark.slow
def test_a_fold_over_damping_is_that_over_one_parameter():
    plane = {"friction": (0.4, 0.7), "damping": (0.1, 0.15)}
    found = ss.continuation(coupled_fold(), plane, hoffmann, step=0.5)
    friction, damping = found.curve.values[-1] if found.curve.values[-1, 1] > 0.1 else found.curve.values[0]
    assert damping == 0.15
    strong = partial(hoffmann, damping=0.15)
    cycle = coupled_cycle().continued(hoffmann(friction=0.8, damping=0.12)).continued(strong(friction=0.8))
    (fold,) = ss.continuation(cycle, {"friction": (0.8, 0.5)}, strong, step=0.1, points=20).folds
    assert friction == pytest.approx(fold.value, rel=1e-10)
    assert friction > FOLD + 0.01


def touching_speed(damping: float) -> float:
    """Return the belt speed at which the motion that just does not stick comes back to that speed."""

    def excess(speed: float) -> float:
        # The law goes on beyond rest as an analytic function; at its largest velocity the mass is in balance.
        def rate(_: float, y: np.ndarray) -> list[float]:
            force = 0.5 * (1.0 + np.exp(-(speed - y[1]) / 0.5))
            return [y[1], -y[0] - 2.0 * damping * y[1] + force]

        def top(_: float, y: np.ndarray) -> float:
            return rate(0.0, y)[1]

        def gone(_: float, y: np.ndarray) -> float:
            return float(y[1] - speed - 0.5)

        top.direction, gone.terminal = -1.0, True
        start = [1.0 - 2.0 * damping * speed, speed]
        run = solve_ivp(rate, (0.0, 9.0), start, method="DOP853", rtol=1e-13, atol=1e-15, events=(top, gone))
        turns = zip(run.t_events[0], run.y_events[0], strict=True)
        # Where the velocity passes that of the belt by half a metre, it does not turn any more.
        return float(next((y[1] for t, y in turns if t > 3.0), speed + 0.5) - speed)

    return float(brentq(excess, 1.2, 2.4, xtol=1e-13))


@pytest.mark.slow
@pytest.mark.nightly
def test_a_touch_of_the_belt_is_that_of_an_integrator():
    assert touch().value == pytest.approx(TOUCH, abs=1e-9)
    plane = {"slider_speed": (1.3, 2.3), "damping_ratio": (0.04, 0.07)}
    found = ss.continuation(touch(), plane, bistable, step=0.3)
    assert found.curve.ends == ("range", "range")
    assert (found.curve.kind, found.curve.contact) == ("grazing", 0)
    damping = found.curve.values[:, 1]
    assert {float(damping.min()), float(damping.max())} == {0.04, 0.07}
    # The tolerance of the integrator, over a slope of order 1.
    expected = [touching_speed(float(ratio)) for ratio in damping]
    assert found.curve.values[:, 0] == pytest.approx(np.array(expected), abs=1e-10)
    assert found.curve.error.max() <= 1e-11


@pytest.mark.slow
@pytest.mark.nightly
def test_a_closed_curve_comes_back_to_its_start():
    """Over a and b with a belt speed of 1 + a^2 + b^2 the touch is a circle."""

    def model(a: float = 0.3, b: float = 0.5) -> ss.Scene:
        return bistable(slider_speed=1.0 + a * a + b * b)

    start = ss.steady_sliding(model()).perturbed(velocity={"x": 1.0})
    cycle = ss.simulate(model(), 8.0, start).closed_cycle()
    (point,) = ss.continuation(cycle, {"a": (0.3, 1.0)}, model, step=0.3).points
    found = ss.continuation(point, {"a": (-1.2, 1.2), "b": (-1.2, 1.2)}, model, step=0.15)
    assert found.curve.closed
    assert found.curve.values[0].tolist() == found.curve.values[-1].tolist()
    assert (found.curve.values**2).sum(axis=1) == pytest.approx(
        np.full(len(found.cycles), touch().value - 1.0), rel=1e-11
    )
    radius = np.sqrt(touch().value - 1.0)
    turns = [(one.kind, one.parameter, *np.round(list(one.values.values()), 6)) for one in found.points]
    # Where a velocity of differences vanishes is known to the root of their error.
    edge = round(radius, 6)
    assert sorted(turns) == sorted(
        ("degenerate", name, *place)
        for name, place in (("a", (edge, 0)), ("a", (-edge, 0)), ("b", (0, edge)), ("b", (0, -edge)))
    )


@pytest.mark.slow
def test_a_period_doubling_over_speed_ends_where_a_contact_lifts_off():
    """About steady sliding the orbit is in proportion to the speed until a normal force vanishes.

    All conditions of slip and sticking are homogeneous there: friction at the doubling is one number.
    """
    scene = ss.models.two_subsystems(friction=2.4)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    cycle = ss.simulate(scene, 0.6, start).limit_cycle()
    branch = ss.continuation(cycle, {"friction": (2.4, 2.7)}, step=0.2)
    (point,) = (one for one in branch.points if one.kind == "period_doubling")
    found = ss.continuation(point, {"friction": (2.0, 3.0), "slider_speed": (0.02, 0.04)}, step=0.2)
    friction, speed = found.curve.values.T
    assert friction == pytest.approx(np.full(friction.size, point.value), rel=1e-11)
    assert found.curve.error.max() <= 1e-10
    assert set(found.curve.ends) == {"range", "sequence"}
    # The least normal force of contact 1 falls linearly from its value in steady sliding, at no speed.
    (change,) = found.points
    assert (change.kind, change.contact, change.values["slider_speed"]) == ("sequence", 1, speed.max())
    resting = float(ss.steady_sliding(point.cycle.scene).normal_forces[1])
    least = min(one.value for one in point.cycle.margins() if (one.contact, one.kind) == (1, "release"))
    assert speed.max() == pytest.approx(0.025 * resting / (resting - least), rel=1e-8)


def duffing(rate: float = 1.0, amplitude: float = 0.18) -> ss.Scene:
    load = ss.Harmonic({"x1": amplitude}, rate / (2.0 * np.pi))
    spring = ss.Spring("x1", ss.spring.Polynomial(0.0, 0.0, 0.1))
    return ss.Scene([1.0], [[1.0]], [[0.05]], loads=[load], elements=[spring])


@cache
def resonant() -> ss.Cycle:
    return ss.simulate(duffing(), 400.0, ss.State([1.3], [0.0], "")).limit_cycle(further=800.0)


@pytest.mark.slow
@pytest.mark.nightly
def test_two_folds_meet_in_a_cusp():
    fold = ss.continuation(resonant(), {"rate": (1.0, 1.35)}, duffing, step=0.2).folds[0]
    # The point lies on the border of the rectangle, where the curve ends.
    plane = {"rate": (0.9, 1.35), "amplitude": (0.02, 0.18)}
    found = ss.continuation(fold, plane, duffing, step=0.15)
    assert found.curve.ends == ("range", "range")
    ends = found.curve.values[[0, -1]]
    assert ends[:, 1].tolist() == [0.18, 0.18]
    assert len(np.unique(found.curve.values, axis=0)) == len(found.cycles)
    assert np.sort(ends[:, 0]) == pytest.approx(np.array(FOLDS), abs=1e-10)
    assert found.curve.error.max() <= 1e-10
    (cusp,) = (one for one in found.points if one.kind == "cusp")
    # Above its amplitude there are two folds, below it none.
    folds = {}
    for factor in (0.99, 1.01):
        model = partial(duffing, amplitude=factor * cusp.values["amplitude"])
        run = ss.simulate(model(rate=0.95), 400.0, ss.State([0.1], [0.0], ""))
        cycle = run.limit_cycle(further=800.0)
        branch = ss.continuation(cycle, {"rate": (0.95, 1.2)}, model, step=0.05)
        folds[factor] = [one.value for one in branch.folds]
    assert folds[0.99] == []
    assert len(folds[1.01]) == 2
    assert np.mean(folds[1.01]) == pytest.approx(cusp.values["rate"], abs=1e-3)


@pytest.mark.slow
def test_a_second_pair_on_the_unit_circle_is_told():
    """Beside the oscillator stands a linear one, whose damping passes zero: it does not move the fold."""

    def model(rate: float = 1.0, second: float = 0.02) -> ss.Scene:
        load = ss.Harmonic({"x1": 0.18, "x2": 1.0}, rate / (2.0 * np.pi))
        spring = ss.Spring("x1", ss.spring.Polynomial(0.0, 0.0, 0.1))
        matrices = np.diag([1.0, 4.0]), np.diag([0.05, second])
        return ss.Scene([1.0, 1.0], *matrices, loads=[load], elements=[spring])

    start = ss.State([1.3, 0.3], [0.0, 0.0], "")
    cycle = ss.simulate(model(), 800.0, start).limit_cycle(further=800.0)
    fold = ss.continuation(cycle, {"rate": (1.0, 1.35)}, model, step=0.2).folds[0]
    plane = {"rate": (1.2, 1.35), "second": (-0.01, 0.02)}
    found = ss.continuation(fold, plane, model, step=0.5)
    assert found.curve.ends == ("range", "range")
    assert found.curve.values[:, 0] == pytest.approx(np.full(len(found.cycles), FOLDS[1]), abs=1e-10)
    (point,) = found.points
    assert point.kind == "second_multiplier"
    assert point.values["second"] == pytest.approx(0.0, abs=1e-10)
    # A turn of 2 rad/s over a period of the load.
    expected = np.exp(2.0j * fold.cycle.period)
    assert min(abs(point.multiplier - expected), abs(point.multiplier - expected.conjugate())) <= 1e-8
    order = np.argsort(found.curve.values[:, 1])
    outside = found.curve.unstable_modes[order]
    assert (outside[0], outside[-1]) == (2, 0)


def shaken(amplitude: float = 0.3, rate: float = 1.7, slider_speed: float = 0.42) -> ss.Scene:
    """Return a mass that oscillates by itself, and is kept from it by a large load."""
    load = ss.Harmonic({"x": amplitude}, rate / (2.0 * np.pi))
    return ss.models.thomsen_fidlin(slider_speed=slider_speed).replace(loads=[load])


@cache
def quenched() -> types.BranchPoint:
    start = ss.steady_sliding(shaken()).perturbed(velocity={"x": 1e-3})
    cycle = ss.simulate(shaken(), 600.0, start).limit_cycle(further=400.0)
    (point,) = ss.continuation(cycle, {"amplitude": (0.3, 0.1)}, shaken, step=0.2).points
    assert point.kind == "torus"
    return point


@pytest.mark.slow
@pytest.mark.nightly
def test_a_torus_ends_in_a_resonance():
    found = ss.continuation(quenched(), {"amplitude": (0.1, 0.4), "rate": (1.6, 2.2)}, shaken, step=0.2)
    assert set(found.curve.ends) == {"range", "resonance"}
    (point,) = (one for one in found.points if one.kind == "resonance")
    assert point.multiplier == -1.0
    moduli = np.abs([cycle.transverse_multipliers for cycle in found.cycles])
    assert moduli == pytest.approx(np.ones(moduli.shape), abs=1e-11)


@pytest.mark.slow
@pytest.mark.nightly
def test_a_torus_grows_from_the_end_of_stable_sliding():
    """The load is small against the friction law: averaged, the speed falls by the square of the load."""
    plane = {"amplitude": (0.02, 0.3), "slider_speed": (0.41, 0.45)}
    found = ss.continuation(quenched(), plane, shaken, step=0.2)
    values = found.curve.values
    amplitude, speed = values[np.argmin(values[:, 0])]
    assert amplitude == 0.02
    (hopf,) = ss.critical_points(ss.models.thomsen_fidlin, {"slider_speed": (0.3, 0.6)}, kinds=("hopf",))
    # Of the law, N mu' = N (static - least) / speed (-3/2 + 3/2 (v / speed)^2): the mean of v^2 grows by half
    # the square of the velocity of the answer to the load.
    velocity = 1.7 * amplitude / (1.7**2 - 1.0)
    assert speed**2 == pytest.approx(hopf.value**2 - 0.5 * velocity**2, abs=velocity**4)


@pytest.mark.slow
@pytest.mark.nightly
def test_a_grazing_within_a_sequence_ends_where_another_event_changes():
    scene = ss.models.two_subsystems(friction=1.7)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    cycle = ss.simulate(scene, 0.6, start).limit_cycle()
    (point,) = ss.continuation(cycle, {"friction": (1.7, 1.5)}, step=0.1).points
    found = ss.continuation(point, {"friction": (1.55, 2.4), "slider_speed": (0.02, 0.04)}, step=0.2)
    assert set(found.curve.ends) == {"range", "sequence"}
    (change,) = (one for one in found.points if one.kind == "sequence")
    assert (change.contact, change.name) == (1, "1")
    last = found.cycles[-1 if found.curve.ends[1] == "sequence" else 0]
    touches = sorted(
        (one.value, one.phase) for one in last.margins() if (one.contact, one.kind) == (1, "release")
    )
    # Newtons, beside a normal force of 180 N: the touch of the curve, and one in another phase.
    assert len({phase for _, phase in touches[:2]}) == 2
    assert np.abs([value for value, _ in touches[:2]]).max() <= 1e-8


@pytest.mark.slow
@pytest.mark.nightly
def test_two_events_meet_up_to_where_a_flight_vanishes():
    """On one curve contact 1 just does not lift off; where its flight vanishes on the other, the two meet."""
    plane = {"friction": (1.32, 1.37), "slider_speed": (0.0238, 0.0254)}
    ends = {}
    for first, towards in ((1.7, 1.5), (1.4, 1.3)):
        scene = ss.models.two_subsystems(friction=first)
        start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
        cycle = ss.simulate(scene, 0.6, start).limit_cycle()
        (point,) = ss.continuation(cycle, {"friction": (first, towards)}, step=0.2).points
        wide = {"friction": (1.3, 1.7), "slider_speed": (0.0238, 0.027)} if first == 1.7 else plane
        found = ss.continuation(point, wide, step=0.3)
        assert found.curve.error.max() <= 1e-10
        last = {"grazing": "sequence", "switching": "tangency"}[found.curve.kind]
        assert set(found.curve.ends) == {"range", last}
        ends[found.curve.kind] = found.curve.values[0 if found.curve.ends[0] == last else -1]
        if last == "tangency":
            # Contact 1 takes off and lands with the same vanishing speed; contact 0 slips throughout.
            (touch,) = (one for one in found.points if one.kind == last)
            assert (touch.contact, touch.remark) == (1, "contact 1")
            assert list(touch.values.values()) == ends["switching"].tolist()
            assert ("tangency", "contact 1") in zip(
                found.to_dataset().special_kind.values, found.to_dataset().special_remark.values, strict=True
            )
    assert set(ends) == {"grazing", "switching"}
    # The curve ends when the flight lasts some 1e-5 s; friction differs by the square of that.
    assert ends["switching"] == pytest.approx(ends["grazing"], rel=1e-4)


def test_an_interrupted_curve_keeps_its_points(monkeypatch):
    further, left = plane_curve._shortened, [3]

    def interrupted(*arguments):
        left[0] -= 1
        if left[0] == 0:
            raise KeyboardInterrupt
        return further(*arguments)

    monkeypatch.setattr(plane_curve, "_shortened", interrupted)
    plane = {"slider_speed": (1.3, 2.3), "damping_ratio": (0.03, 0.1)}
    with pytest.raises(ss.Interrupted, match="interrupted after 3 points") as stopped:
        ss.continuation(touch(), plane, bistable, step=0.1)
    found = stopped.value.partial
    assert len(found.cycles) == 3
    assert found.curve.ends == ("points", "points")


def test_a_curve_lost_for_another_cause_names_none(monkeypatch):
    further, left = plane_curve._shortened, [3]

    def failing(*arguments):
        left[0] -= 1
        return further(*arguments) if left[0] > 0 else None

    monkeypatch.setattr(plane_curve, "_shortened", failing)
    plane = {"slider_speed": (1.3, 2.3), "damping_ratio": (0.03, 0.1)}
    found = ss.continuation(touch(), plane, bistable, step=0.1)
    assert found.curve.ends == ("lost", "lost")
    assert found.points == ()


def test_a_curve_is_drawn_on_the_boundary_of_sliding():
    plane = {"slider_speed": (1.0, 2.0), "damping_ratio": (0.03, 0.1)}
    axes = ss.stability_boundary(bistable, plane, cells=2).plot()
    found = ss.continuation(touch(), plane, bistable, step=0.5, points=3)
    assert found.curve.ends == ("points", "points") or len(found.cycles) == 3
    assert found.plot(ax=axes) is axes
    assert {text.get_text() for text in axes.get_legend().get_texts()} == {"hopf", "grazing"}
    assert "largest error of the condition" in str(found.summary())
    assert found.to_dataset().damping_ratio.dims == ("point",)


def test_mistakes_are_named():
    plane = {"slider_speed": (1.3, 2.3), "damping_ratio": (0.03, 0.1)}
    with pytest.raises(ss.InputError, match="at: expected no values"):
        ss.continuation(touch(), plane, bistable, at=[1.5])
    with pytest.raises(ss.InputError, match="expected ranges of 'slider_speed'"):
        ss.continuation(touch(), {"kinetic": (0.1, 1.0), "damping_ratio": (0.03, 0.1)}, bistable)
    with pytest.raises(ss.InputError, match=r"damping_ratio: expected a range that holds the point, 0\.05"):
        ss.continuation(touch(), {**plane, "damping_ratio": (0.06, 0.1)}, bistable)
    with pytest.raises(ss.OrbitError, match="grazing is not"):
        ss.continuation(touch(), {**plane, "kinetic": 0.3}, bistable)


@pytest.mark.slow
def test_a_factor_needs_the_scene_of_the_branch():
    """In the scene of the orbit at the point the factor is 1 again."""
    scene = bistable(slider_speed=1.7)
    start = ss.steady_sliding(scene).perturbed(velocity={"x": 1.5})
    cycle = ss.simulate(scene, 8.0, start).closed_cycle()
    (point,) = ss.continuation(cycle, {"damping": (1.0, 1.3)}, step=0.3).points
    plane = {"damping": (0.9, 1.3), "slider_speed": (1.65, 1.75)}
    with pytest.raises(ss.InputError, match=r"model: damping is 1 in the scene of the orbit, 1\.1"):
        ss.continuation(point, plane)
    found = ss.continuation(point, plane, scene, step=0.4)
    expected = [touching_speed(0.05 * float(factor)) for factor in found.curve.values[:, 0]]
    assert found.curve.values[:, 1] == pytest.approx(np.array(expected), abs=1e-10)


def test_a_grazing_in_which_a_phase_vanishes_is_refused():
    scene = bistable(slider_speed=1.5)
    cycle = ss.simulate(scene, 60.0, ss.State([0.0], [1.5], "s", dofs=scene.dofs)).limit_cycle()
    (point,) = ss.continuation(cycle, {"slider_speed": (1.5, 1.9)}, step=0.2).points
    with pytest.raises(ss.OrbitError, match="take the same point from the branch on its other side"):
        ss.continuation(point, {"slider_speed": (1.3, 2.3), "damping_ratio": (0.03, 0.1)}, bistable)
