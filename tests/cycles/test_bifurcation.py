"""Attractors over a parameter, branches of orbits, and the points at which they change."""

import numpy as np
import pytest

import stickslip as ss
from return_map import assert_multipliers

EPSILON = np.finfo(float).eps


def cycle_at(friction, slider_speed=0.025):
    scene = ss.models.two_subsystems(friction=friction, slider_speed=slider_speed)
    return ss.simulate(scene, 0.6, ss.disturbed_sliding(scene)).limit_cycle()


def block(speed=0.1, stiffness_damping=1e-4):
    """A mass on a belt with static friction above kinetic: stable sliding beside a stick-slip cycle."""
    return ss.Scene(
        [1.0, 1.0],
        np.diag([1e4, 1e4]),
        damping=ss.Rayleigh(stiffness=stiffness_damping),
        force=[0.0, -100.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.2, static_friction=0.5, slider_speed=speed)],
    )


def test_a_diagram_over_friction():
    values = np.array([0.69, 0.8, 1.5, 2.2, 3.0])
    found = ss.bifurcation(ss.models.two_subsystems(), {"friction": values})
    diagram = found.data
    assert [cycle is None for cycle in found.cycles] == [True, False, False, False, False]
    assert list(diagram.kind.to_numpy()) == ["equilibrium", *["cycle"] * 4]
    assert list(diagram.period_doubled.to_numpy()) == [False, False, False, False, True]
    assert diagram.sequence.sel(friction=1.5) == "++ +d ++ s+ ss s+"
    assert float(diagram.period.sel(friction=1.5)) == pytest.approx(8.908492605779e-3, rel=1e-12)
    assert float(diagram.largest_multiplier.sel(friction=2.2)) == pytest.approx(0.9369, abs=5e-5)
    assert np.isnan(diagram.amplitude.sel(friction=0.69)).all()
    assert (diagram.amplitude.sel(friction=1.5, dof=["x1", "x2", "x3"]) > 0.0).all()
    # Each value is computed by itself: alone it gives the same bits.
    alone = ss.bifurcation(ss.models.two_subsystems(), {"friction": values[3:4]}, stretch=0.5)
    again = ss.bifurcation(ss.models.two_subsystems(), {"friction": values[2:4]}, stretch=0.5)
    assert float(alone.data.period[0]) == float(again.data.period[1])


def test_the_doubling_point():
    points = ss.continuation(cycle_at(2.4), {"friction": (2.4, 2.7)}, step=0.2).points
    (point,) = [point for point in points if point.kind == "period_doubling"]
    assert abs(point.multiplier + 1.0) <= 1e-8
    assert point.value == pytest.approx(2.546, abs=5e-4)  # design, section 3
    assert point.cycle.combinations == ("++", "s+", "ss", "s+")


def test_the_branch_goes_on_unstable_beyond_the_doubling():
    values = [2.4, 2.6, 3.0]
    branch = ss.continuation(cycle_at(2.4), {"friction": (2.4, 3.0)}, at=[2.6], step=0.3)
    assert branch.at(2.5) == ()
    found = [orbit for value in values for orbit in branch.at(value)]
    assert [orbit.stable for orbit in found] == [True, False, False]
    assert branch.data.followed.all()
    assert (np.abs(branch.data.period - branch.data.period[0]) < 1e-4).all()
    assert all(orbit.multipliers.real.min() < -1.0 for orbit in found[1:])


@pytest.mark.slow
def test_a_touch_is_found_from_both_sides():
    """Contact 1 lifts off below friction 1.612: from above N touches zero, from below the flight shrinks."""
    (above,) = ss.continuation(cycle_at(1.7), {"friction": (1.7, 1.5)}, step=0.1).points
    (below,) = ss.continuation(cycle_at(1.55), {"friction": (1.55, 1.7)}, step=0.1).points
    assert above.kind == below.kind == "grazing"
    assert (above.contact, above.event) == (below.contact, below.event) == (1, "release")
    # The square of the flight's duration, extrapolated to zero: its own rounding is that of Newton's method.
    assert above.value == pytest.approx(below.value, abs=1e-8)
    before, after = cycle_at(above.value - 1e-4), cycle_at(above.value + 1e-4)
    assert "+d" in before.combinations
    assert "+d" not in after.combinations


def test_events_that_meet_switch_the_sequence():
    (point,) = ss.continuation(cycle_at(1.4), {"friction": (1.4, 1.3)}, step=0.2).points
    assert point.kind == "switching"
    assert cycle_at(point.value + 1e-3).combinations != cycle_at(point.value - 1e-3).combinations


def test_a_chaotic_motion_says_so():
    scene = ss.models.two_subsystems(friction=1.5, slider_speed=0.2)
    run = ss.simulate(scene, 0.6, ss.disturbed_sliding(scene))
    with pytest.raises(ss.NotPeriodicError, match="Lyapunov") as error:
        run.limit_cycle()
    assert error.value.kind == "chaotic"
    # Against two neighbouring runs: their distance grows by the same rate, from 1e-11 to 1e-5 of the motion.
    middle = ss.simulate(scene, 5.0, ss.disturbed_sliding(scene)).state(5.0)
    duration = np.log(1e6) / error.value.exponent
    nudged = middle.perturbed(position={"x1": 1e-14})
    ends = [ss.simulate(scene, duration, start).state(duration).position for start in (middle, nudged)]
    growth = np.log(np.abs(ends[0] - ends[1]).max() / 1e-14) / duration
    # One sample of a fluctuating rate over 0.6 s.
    assert growth == pytest.approx(error.value.exponent, rel=0.7)


def two_blocks(stiffness=1e4, link=0.0, *, gap=None):
    """Two blocks on belts of their own, tied to each other."""
    matrix = np.diag([1e4, stiffness, 1e4, 1e4])
    matrix[:2, :2] += link * np.array([[1.0, -1.0], [-1.0, 1.0]])
    laws = {"friction": 0.2, "static_friction": 0.5, "slider_speed": 0.1}
    return ss.Scene(
        [1.0] * 4,
        matrix,
        damping=ss.Rayleigh(stiffness=1e-4),
        force=[0.0, 0.0, -100.0, -100.0],
        contacts=[ss.Contact(tangential=k, normal=k + 2, **laws) for k in (0, 1)],
    )


def thrown(scene, first=-0.5, second=-0.5):
    return ss.steady_sliding(scene).perturbed(velocity={"x1": first, "x2": second})


def test_a_torus_says_so():
    """Blocks with frequencies in no simple ratio, hardly tied: neither periodic nor chaotic."""
    scene = two_blocks(137.0**2, 10.0)
    with pytest.raises(ss.NotPeriodicError) as error:
        ss.simulate(scene, 1.0, thrown(scene)).limit_cycle()
    assert error.value.kind == "quasi-periodic"
    assert abs(error.value.exponent) <= 3.0 * error.value.error + 1e-2
    assert error.value.error < 1.0


def test_motion_that_does_not_settle_is_not_called_chaotic_at_once():
    """Friction 3 at 0.046 m/s wanders for seconds: the verdict comes with the error of the rate."""
    scene = ss.models.two_subsystems(friction=3.0, slider_speed=0.046)
    run = ss.simulate(scene, 0.6, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    with pytest.raises(ss.NotPeriodicError, match="follow it longer") as error:
        run.limit_cycle(5.0)
    assert error.value.kind in ("undecided", "unsettled")
    # Within four standard errors the rate has no sign.
    assert abs(error.value.exponent) <= 4.0 * error.value.error


def test_growth_before_any_event_is_not_chaos():
    scene = ss.models.two_subsystems()
    run = ss.simulate(scene, 0.3, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-12}))
    assert run.events.time.size == 0
    with pytest.raises(ss.NotPeriodicError) as error:
        run.limit_cycle(0.0)
    assert error.value.kind == "undecided"
    assert np.isnan(error.value.exponent)
    assert run.limit_cycle().period == pytest.approx(8.908492605779e-3, rel=1e-12)


def test_events_that_always_coincide():
    """Equal blocks thrown alike slip and stick together; their orbit is that of one, twice."""
    scene = two_blocks(link=2e3)
    cycle = ss.simulate(scene, 2.0, thrown(scene)).limit_cycle()
    lasting = [phase.combination for phase in cycle.phases if phase.duration > 1e-9 * cycle.period]
    assert lasting == ["++", "ss"]
    alone = block()
    single = ss.simulate(alone, 2.0, ss.steady_sliding(alone).perturbed(velocity={"x1": -0.5})).limit_cycle()
    assert cycle.period == pytest.approx(single.period, rel=1e-9)
    assert_multipliers(cycle, 1e-5)


def test_stick_slip_in_closed_form():
    """Undamped: slip from T = mu_s N with the belt's speed until it is met again, then carried over 2 a."""
    stiffness, speed, omega = 1e4, 0.1, 100.0
    amplitude = (0.5 - 0.2) * 100.0 / stiffness
    period = 2.0 * amplitude / speed + 2.0 / omega * (np.pi - np.arctan(amplitude * omega / speed))
    scene = block(stiffness_damping=0.0)
    run = ss.simulate(scene, 1.0, ss.steady_sliding(scene).perturbed(velocity={"x1": -0.5}))
    cycle = run.limit_cycle()
    assert cycle.period == pytest.approx(period, rel=32 * EPSILON)
    assert cycle.combinations == ("+", "s")
    # Sliding has a displacement and a velocity, sticking a displacement only: one zero, and the phase.
    assert cycle.structural_zeros == 1
    assert cycle.multipliers == pytest.approx([1.0, 0.0], abs=1e-12)
    assert float(cycle.maximum.sel(dof="x1")) == pytest.approx(
        0.2 * 100.0 / stiffness + np.hypot(amplitude, speed / omega), rel=32 * EPSILON
    )


def test_coexisting_attractors_and_their_basins():
    scene = block()
    found = ss.basins(
        scene,
        start=ss.steady_sliding(scene),
        position={"x1": [0.0, 5e-4]},
        velocity={"x1": [-0.5, -0.02, 0.0]},
    )
    attractors = found.attractors
    assert sorted(type(attractor).__name__ for attractor in attractors) == ["Cycle", "str"]
    assert "equilibrium" in attractors
    rest = attractors.index("equilibrium")
    assert (found.map.to_numpy() == rest).tolist() == [[False, True, True], [False, True, True]]


def loaded_block(speed=0.1):
    """The block with a second mass on it: its stick-slip branch turns back at low speeds."""
    stiffness = np.array([[7e4, -6e4, 0.0], [-6e4, 7e4, 0.0], [0.0, 0.0, 1e4]])
    contact = ss.Contact(tangential=0, normal=2, friction=0.2, static_friction=0.5, slider_speed=speed)
    return ss.Scene(
        [1.0, 0.3, 1.0],
        stiffness,
        damping=ss.Rayleigh(stiffness=1e-4),
        force=[0.0, 0.0, -100.0],
        contacts=[contact],
    )


def test_a_fold_of_a_bi_stable_scene():
    """Stick-slip beside stable sliding; the branch turns back at a fold and goes on unstable."""
    scene = loaded_block()
    assert ss.complex_modes(scene).eigenvalues.real.max() < 0.0
    run = ss.simulate(scene, 2.0, ss.steady_sliding(scene).perturbed(velocity={"x1": -0.5}))
    cycle = run.limit_cycle(3.0)
    branch = ss.continuation(cycle, {"slider_speed": (0.1, 0.05)}, points=150)
    (fold,) = branch.folds
    assert fold.kind == "fold"
    assert abs(fold.multiplier - 1.0) <= 1e-8
    speeds, stable = branch.data.slider_speed.to_numpy(), branch.data.stable.to_numpy()
    turn = int(np.argmin(speeds))
    assert speeds[turn] == pytest.approx(fold.value, abs=1e-4)
    assert speeds.min() >= fold.value
    # Down to the fold and up again: stable before, unstable behind, motions of the scene on either side.
    assert (np.diff(speeds[: turn + 1]) < 0.0).all()
    assert (np.diff(speeds[turn + 1 : turn + 20]) > 0.0).all()
    assert stable[: turn - 1].all()
    assert not stable[turn + 2 : turn + 20].any()
    assert branch.data.followed.to_numpy()[turn - 10 : turn + 10].all()
    # Past the fold there is no such orbit; before it there are two, with multipliers on either side of 1.
    with pytest.raises(ss.OrbitError):
        fold.cycle.continued(loaded_block(fold.value - 1e-3))
    above = fold.value + 2e-4
    sides = [
        int(np.argmin(np.abs(speeds[: turn + 1] - above))),
        turn + 1 + int(np.argmin(np.abs(speeds[turn + 1 : turn + 20] - above))),
    ]
    largest = [branch.cycles[k].transverse_multipliers.real.max() for k in sides]
    assert largest[0] < 1.0 < largest[1]
    assert "fold" in str(branch.summary())
    # The same fold in longer steps, and both orbits at a value above it.
    again = ss.continuation(cycle, {"slider_speed": (0.1, 0.08)}, at=[above], step=0.1)
    assert again.folds[0].value == pytest.approx(fold.value, rel=1e-9)
    assert [orbit.stable for orbit in again.at(above)] == [True, False]


def test_hysteresis_over_slider_speed():
    """Stick-slip lives on above the speed from which small motions no longer start it."""
    speeds = np.linspace(0.05, 1.0, 12)
    moving = lambda scene: ss.steady_sliding(scene).perturbed(velocity={"x1": -0.5})  # noqa: E731
    up = ss.bifurcation(block(), {"slider_speed": speeds}, follow=True, start=moving)
    down = ss.bifurcation(block(), {"slider_speed": speeds[::-1]}, follow=True)
    kinds_up, kinds_down = up.data.kind.to_numpy(), down.data.kind.to_numpy()[::-1]
    assert kinds_up[0] == "cycle"
    assert kinds_up[-1] == kinds_down[-1] == "equilibrium"
    assert ((kinds_up == "cycle") & (kinds_down == "equilibrium")).any()


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ({}, {}, "parameter"),
        ("friction", {}, "parameters: expected values by name"),
        ({"friction": 1.5}, {}, "parameter"),
        ({"friction": [1.0], "slider_speed": [0.1]}, {}, "parameter"),
        ({"friction": [1.0, np.nan]}, {}, "friction"),
        ({"friction": []}, {}, "friction"),
        ({"fricton": [1.0]}, {}, "fricton"),
        ({"friction": [-1.0]}, {}, "friction"),
        ({"friction": [1.5]}, {"stretch": 0.0}, "stretch"),
        ({"friction": [1.5]}, {"limit": np.inf}, "limit"),
        ({"friction": [1.5]}, {"start": 3}, "start"),
    ],
)
def test_ill_posed_diagrams(arguments, options, message):
    with pytest.raises(ss.InputError, match=message):
        ss.bifurcation(ss.models.two_subsystems(), arguments, **options)


def test_ill_posed_basins_and_branches():
    scene = block()
    with pytest.raises(ss.InputError, match="expected two axes"):
        ss.basins(scene, start=ss.steady_sliding(scene), velocity={"x1": [0.0]})
    cycle = cycle_at(1.5)
    with pytest.raises(ss.InputError, match="begin, end"):
        ss.continuation(cycle, {"friction": (1.5, 1.5)})
    with pytest.raises(ss.InputError, match=r"at: expected values from 1\.5 to 1\.6, got \[1\.7\]"):
        ss.continuation(cycle, {"friction": (1.5, 1.6)}, at=[1.7])
    with pytest.raises(ss.InputError, match="scene"):
        cycle.continued(block())


def test_a_branch_that_does_not_begin_at_its_cycle_says_where_to_begin():
    first = r"friction: no orbit is found at the first value, 1 \("
    hint = r"\); begin at the value of the cycle, 1\.5$"
    with pytest.raises(ss.OrbitError, match=f"{first}.*{hint}"):
        ss.continuation(cycle_at(1.5), {"friction": (1.0, 3.0)})
