"""The boundary of basins: cycles of one mass as exact curves, and bisected segments where there is none."""

import dataclasses

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.cycles.basins import boundary as searched
from stickslip.cycles.basins.curve import OrbitCurve

mpl.use("agg")
ZERO = ss.State([0.0], [0.0], "+", ["x"])
#: A mass on a belt of 1.8 m/s whose friction 1 - g(x') takes and feeds energy by turns: at first order the
#: amplitudes 0.486 and 1.276 are unstable cycles, 0.887 is a stable one.
FEED, TURNS, WIDTH = 0.3, (0.4, 0.8, 1.2), 0.6


def feed(v):
    return FEED * v * np.exp(-(v**2) / WIDTH) * np.prod([1.0 - (v / turn) ** 2 for turn in TURNS], axis=0)


def nested():
    factors = " * ".join(f"(1.0 - ((1.8 - s) / {turn}) ** 2)" for turn in TURNS)
    law = ss.friction.Law(f"1.0 - {FEED} * (1.8 - s) * exp(-(1.8 - s) ** 2 / {WIDTH}) * {factors}")
    belt = ss.Contact(tangential="x", normal_force=1.0, friction=law, slider_speed=1.8)
    return ss.Scene([1.0], [[1.0]], contacts=[belt], dofs=["x"])


def bistable(speed, columns=9, rows=6):
    return ss.basins(
        ss.models.bistable_oscillator(slider_speed=speed),
        start=ZERO,
        position={"x": np.linspace(-2.0, 2.0, columns)},
        velocity={"x": np.linspace(0.0, 2.0, rows)},
    )


@pytest.fixture(scope="module")
def boundary():
    return bistable(1.5).boundary()


def test_the_basin_of_sliding_is_the_inside_of_the_unstable_cycle(boundary):
    (cycle,) = boundary.cycles
    assert cycle.combinations == ("+",)
    assert not cycle.stable
    assert cycle.is_followed()
    assert cycle.period == pytest.approx(6.295334793503, abs=1e-11)
    inside, outside = boundary.sides[0]
    assert boundary.basins.attractors[inside] == "equilibrium"
    assert "s" in boundary.basins.attractors[outside].combinations
    # Printed to 12 digits by an integral over the orbit in 30 digits.
    assert boundary.fractions == pytest.approx([0.307126137782], abs=1e-12)
    assert boundary.segments.shape == (0, 2, 2)
    assert boundary.reason == ""


def test_the_cycle_is_the_exact_boundary_of_a_map_that_it_has_not_seen(boundary):
    curve = OrbitCurve(boundary.cycles[0])
    fine = bistable(1.5, 24, 15)
    rest = fine.attractors.index("equilibrium")
    for place in np.ndindex(fine.map.shape):
        if fine.map.to_numpy()[place] >= 0:
            x, v = float(fine.map.position_x[place[0]]), float(fine.map.velocity_x[place[1]])
            assert curve.encloses(x, v) == (int(fine.map[place]) == rest), (x, v)


@pytest.mark.parametrize("turned", [False, True])
def test_the_axes_of_the_map_may_stand_in_any_order(turned, boundary):
    position, velocity = {"x": np.linspace(-2.0, 2.0, 5)}, {0: np.linspace(0.0, 2.0, 6)}
    found = ss.basins(boundary.basins.scene, start=ZERO, position=position, velocity=velocity)
    if turned:
        found = dataclasses.replace(found, map=found.map.T)
    assert found.boundary().fractions == pytest.approx(boundary.fractions, abs=1e-12)


@pytest.mark.parametrize(("speed", "fraction"), [(1.625, 0.42810), (1.775, 0.55837), (1.836, 0.61)])
def test_a_rectangle_clips_the_basin(speed, fraction):
    found = bistable(speed).boundary()
    (cycle,) = found.cycles
    assert float(cycle.maximum[0]) > 2.0
    assert found.fractions == pytest.approx([fraction], abs=5e-6 if speed < 1.8 else 1e-3)
    curve = OrbitCurve(cycle)
    whole = curve.area((-9.0, -9.0), (9.0, 9.0))
    parts = [
        curve.area(low, high)
        for low, high in (((-9.0, -9.0), (2.0, 0.0)), ((-9.0, 0.0), (2.0, 9.0)), ((2.0, -9.0), (9.0, 9.0)))
    ]
    assert sum(parts) == pytest.approx(whole, rel=1e-13)
    assert 8.0 * fraction == pytest.approx(parts[1], rel=2e-3)


def test_no_cycle_bounds_a_basin_beyond_the_speed_at_which_both_cycles_meet():
    found = bistable(1.837).boundary()
    assert found.basins.attractors == ("equilibrium",)
    assert found.cycles == ()
    assert found.reason == ""
    assert "0" in str(found.summary())


def test_the_cycle_leads_to_the_speed_at_which_both_meet():
    (cycle,) = bistable(1.8).boundary().cycles
    branch = ss.continuation(cycle, {"slider_speed": (1.8, 1.9)})
    (end,) = (point for point in branch.points if point.kind == "grazing")
    # Printed to 10 digits.
    assert end.value == pytest.approx(1.836600972, abs=5e-10)


@pytest.mark.parametrize("form", ["stick-slip", "impacts"])
def test_an_area_is_the_work_of_a_damper_of_one(form):
    if form == "stick-slip":
        cycle = next(one for one in bistable(1.5).attractors if not isinstance(one, str))
        damping = 0.1
    else:
        stop = ss.Contact(normal="x", gap=1.0, restitution=0.8)
        load = ss.Harmonic({"x": 1.0}, 0.16, name="shaker")
        scene = ss.Scene([1.0], [[1.0]], [[0.1]], contacts=[stop], dofs=["x"], loads=[load])
        cycle = ss.simulate(scene, 300.0, ss.State([0.0], [0.0], "d")).limit_cycle()
        damping = 0.1
    area = OrbitCurve(cycle).area((-99.0, -99.0), (99.0, 99.0))
    assert area == pytest.approx(cycle.balance().damping / damping, rel=1e-12)


def reversed_orbit(amplitude, periods):
    """Return area and period of an unstable cycle of `nested`: in reversed time motions settle to it."""

    def rate(t, y):
        x, v, _ = y
        return [-v, x + feed(v), v * v]

    def rise(t, y):
        return y[1] + (t < 1.0)

    rise.terminal, rise.direction = True, 1.0
    y = np.array([-amplitude, 0.0, 0.0])
    for _ in range(periods):
        y[1:] = 0.0
        turn = solve_ivp(rate, (0.0, 9.0), y, method="DOP853", rtol=1e-13, atol=1e-15, events=rise)
        y = turn.y[:, -1]
    return y[2], turn.t[-1]


@pytest.mark.nightly
def test_two_cycles_one_within_the_other_bound_three_basins():
    found = ss.basins(
        nested(),
        start=ZERO,
        position={"x": [-0.6, 0.1, 0.7, 1.3, 1.9, 2.6]},
        velocity={"x": [-1.5, 0.0, 1.5]},
    )
    bounds = found.boundary(1e-2)
    assert bounds.reason == ""
    order = np.argsort([cycle.amplitude[0] for cycle in bounds.cycles])
    first, second = (bounds.cycles[k] for k in order)
    (rest, between), (middle, outer) = bounds.sides[order]
    assert between == middle
    assert found.attractors[rest] == "equilibrium"
    assert found.attractors[between].combinations == ("+",)
    assert "s" in found.attractors[outer].combinations
    for cycle, fraction, amplitude in zip(
        (first, second), bounds.fractions[order], (0.486, 1.276), strict=True
    ):
        area, period = reversed_orbit(amplitude, 40)
        # An error of the motion reversed in time, 1e-13, is shrunk by the multiplier, which is above 1.2.
        assert cycle.period == pytest.approx(period, rel=1e-11)
        assert 3.2 * 3.0 * fraction == pytest.approx(area, rel=1e-11)


def test_where_a_motion_that_grazes_is_the_boundary_there_are_segments_alone():
    """Static friction above a constant kinetic one: what once reaches the belt sticks and slips for ever."""
    speed, damping, kinetic = 0.3, 0.1, 0.2
    belt = ss.Contact(
        tangential="x", normal_force=1.0, friction=kinetic, static_friction=1.5, slider_speed=speed
    )
    scene = ss.Scene([1.0], [[1.0]], [[damping]], contacts=[belt], dofs=["x"])
    found = ss.basins(
        scene,
        position={"x": np.linspace(-0.8, 0.8, 7)},
        velocity={"x": np.linspace(-0.8, 0.2, 5)},
    )
    bounds = found.boundary()
    assert bounds.cycles == ()
    assert "grazes" in bounds.reason
    assert len(bounds.segments) >= 4
    assert np.abs(np.diff(bounds.segments, axis=1)).max() <= 1.001e-6 * 0.27
    rate = np.sqrt(1.0 - 0.25 * damping**2)
    for ends, reached in zip(bounds.segments, bounds.reached, strict=True):
        highest = []
        for x, v in ends:
            # Sliding about x = kinetic: v(t) = exp(-d t / 2) (v cos w t - (x + d v / 2) / w sin w t).
            t = np.linspace(0.0, 2.0 * np.pi / rate, 20001)
            swing = v * np.cos(rate * t) - (x + 0.5 * damping * v) / rate * np.sin(rate * t)
            highest.append((np.exp(-0.5 * damping * t) * swing).max())
        kinds = [found.attractors[k] for k in reached]
        rests = [kind == "equilibrium" for kind in kinds]
        assert sorted(rests) == [False, True]
        # The ends lie 3e-7 apart, and so do the speeds; the maximum of the samples is exact to 1e-8.
        for top, at_rest in zip(highest, rests, strict=True):
            assert (top < speed + 1e-7) if at_rest else (top > speed - 1e-7)
        assert highest == pytest.approx([speed, speed], abs=1e-6)


def test_beyond_one_mass_segments_are_all_that_is_said():
    stiffness = np.array([[7e4, -6e4, 0.0], [-6e4, 7e4, 0.0], [0.0, 0.0, 1e4]])
    contact = ss.Contact(tangential=0, normal=2, friction=0.2, static_friction=0.5, slider_speed=0.3)
    scene = ss.Scene(
        [1.0, 0.3, 1.0],
        stiffness,
        damping=ss.Rayleigh(stiffness=1e-4),
        force=[0.0, 0.0, -100.0],
        contacts=[contact],
    )
    found = ss.basins(scene, position={"x1": [0.0, 4e-3]}, velocity={"x1": [-1.0, -0.5, 0.0]})
    bounds = found.boundary(1e-2)
    assert bounds.cycles == ()
    assert bounds.fractions.shape == (0,)
    assert bounds.reason.startswith("the scene has 3 dofs")
    assert len(bounds.segments)
    for (x, v), number in zip(bounds.segments.reshape(-1, 2), bounds.reached.ravel(), strict=True):
        (again,) = ss.basins(scene, position={"x1": [x]}, velocity={"x1": [v]}).attractors
        assert (again == "equilibrium") == (found.attractors[number] == "equilibrium")
    assert (bounds.reached[:, 0] != bounds.reached[:, 1]).all()
    lengths = np.abs(np.diff(bounds.segments, axis=1)).max(axis=(1, 2))
    # Seven halvings of 4e-3 m or 0.5 m/s.
    assert set(lengths.round(9)) <= {round(width / 128.0, 9) for width in (4e-3, 0.5)}
    drawn = bounds.plot(ax=Figure().subplots())
    assert drawn.lines[0].get_xydata() == pytest.approx(bounds.segments.mean(axis=1), abs=1e-15)
    assert "Bisected segments" in str(bounds.summary())


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (ss.models.two_subsystems(), "dofs"),
        (ss.models.den_hartog(), "loads in time"),
        (ss.models.lugre_slider(), "a state of its own"),
        (
            ss.Scene(
                [1.0],
                [[1.0]],
                contacts=[
                    ss.Contact(tangential="x", normal_force=1.0, friction=0.2, tangential_stiffness=0.25)
                ],
                dofs=["x"],
            ),
            "a state of its own",
        ),
        (ss.models.bistable_oscillator(), ""),
    ],
)
def test_the_plane_of_one_mass_is_told_from_more(scene, reason):
    said = searched.beyond_the_plane(scene)
    assert reason in said
    assert bool(said) == bool(reason)


@pytest.mark.parametrize("suffix", ["nc", "zarr"])
def test_files_hold_basins_and_their_boundary_whole(suffix, tmp_path, boundary):
    ss.save(boundary, tmp_path / f"boundary.{suffix}")
    again = ss.load(tmp_path / f"boundary.{suffix}")
    assert again.to_dataset().identical(boundary.to_dataset())
    assert repr(again) == repr(boundary)
    ss.save(boundary.basins, tmp_path / f"basins.{suffix}")
    basins = ss.load(tmp_path / f"basins.{suffix}")
    assert basins.boundary().to_dataset().identical(boundary.to_dataset())


def test_the_curve_is_drawn_on_the_map(boundary):
    axes = boundary.plot(ax=Figure().subplots())
    curve = axes.lines[0].get_xydata()
    cycle = boundary.cycles[0]
    assert curve[0] == pytest.approx(curve[-1], abs=1e-12)
    assert curve[:, 0].max() == pytest.approx(float(cycle.maximum[0]), abs=1e-4)
    assert len(axes.collections) == len(boundary.basins.plot(ax=Figure().subplots()).collections)
    drawn = ss.plot(boundary.to_dataset(), ax=Figure().subplots())
    assert drawn.lines[0].get_xydata().tolist() == curve.tolist()


def test_what_is_asked_must_be_well_posed(boundary, monkeypatch):
    for tolerance in (0.0, 1.0, np.nan):
        with pytest.raises(ss.InputError, match="tolerance"):
            boundary.basins.boundary(tolerance)
    over = ss.basins(ss.models.two_subsystems(), {"friction": [0.5, 1.5]}, velocity={"x1": [1e-3]})
    with pytest.raises(ss.InputError, match="boundary: expected two initial coordinates as axes, got vel"):
        over.boundary()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(searched.Search, "close", interrupted)
    with pytest.raises(ss.Interrupted) as stopped:
        boundary.basins.boundary()
    assert stopped.value.partial is boundary.basins
