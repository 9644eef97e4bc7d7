"""Every search gives the same answer for the same motion, and says so where it does not know."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import stickslip as ss
from mode_coupling import mode_coupling
from pad_on_disc import pad_on_disc
from quad_block import quad_block
from return_map import differenced_multipliers
from stickslip import types
from stickslip.cycles import attractors
from stickslip.cycles.attractors import described, disturbed_sliding
from stickslip.cycles.bifurcation import table

#: Newton's method ends at rounding; the searches reach the orbit from different states.
SAME = 1e-10


@pytest.fixture(scope="module")
def pad():
    return pad_on_disc()


@pytest.fixture(scope="module")
def cycle(pad):
    return ss.simulate(pad, 0.5, disturbed_sliding(pad)).limit_cycle()


def test_searches_agree_where_contacts_strike_in_turn(pad, cycle):
    # Two contacts strike in turn, infinitely often in a finite time: roundings say how many impacts are met.
    diagram = ss.bifurcation(pad, {"friction": [0.6]}).data
    assert diagram.kind.item() == "cycle"
    assert diagram.period.item() == pytest.approx(cycle.period, rel=SAME)
    assert diagram.stability.item() == cycle.stability == "stable"
    assert diagram.largest_multiplier.item() == pytest.approx(cycle.largest_multiplier, abs=1e-6)
    basins = ss.basins(pad, start=disturbed_sliding(pad), position={"x1": [0.0]}, velocity={"x2": [0.0]})
    (reached,) = basins.attractors
    assert reached.period == pytest.approx(cycle.period, rel=SAME)
    study = ss.Study(
        pad,
        {"friction": [0.6]},
        outputs=["attractor", "period", "stability", "largest_multiplier"],
        duration=0.5,
    )
    answers = study.run()
    assert answers.attractor.item() == "cycle"
    assert answers.period.item() == pytest.approx(cycle.period, rel=SAME)
    assert answers.stability.item() == "stable"
    assert answers.largest_multiplier.item() == pytest.approx(cycle.largest_multiplier, abs=1e-6)


def test_multipliers_across_the_limit_of_a_series_of_impacts(cycle):
    assert sum(phase.event == "accumulation" for phase in cycle.phases) == 1
    assert not cycle.corner
    assert cycle.stable is True
    longest = max(range(len(cycle.phases)), key=lambda k: cycle.phases[k].duration)
    # The differences of runs err by 1e-7 (see `return_map`).
    differenced = differenced_multipliers(cycle, phase=longest)
    for multiplier in cycle.multipliers:
        assert np.abs(differenced - multiplier).min() <= 1e-6


def test_orbit_with_a_series_of_impacts_is_followed(cycle):
    assert cycle.is_followed()
    assert cycle.continued(pad_on_disc(0.601)).is_followed()


@pytest.fixture(scope="module")
def symmetric():
    """An orbit of two equal subsystems, started alike: their contacts strike at the same instants."""
    part = ss.models.Subsystem(
        upper_mass=0.3,
        contact_mass=0.7,
        inclination=0.75,
        vertical_stiffness=3e5,
        horizontal_stiffness=6e5,
        ceiling_stiffness=6e4,
        preload_displacement=1e-3,
    )
    one = ss.models.chain([part], [], wall_stiffness=1e6)
    tie = np.eye(8)[0] - np.eye(8)[4]
    scene = ss.Scene(
        mass=np.tile(one.mass, 2),
        stiffness=np.kron(np.eye(2), one.stiffness.toarray()) + 1e4 * np.outer(tie, tie),
        damping=ss.Rayleigh(stiffness=1e-4),
        force=np.tile(one.force, 2),
        contacts=[
            ss.Contact(tangential=2 + 4 * i, normal=3 + 4 * i, friction=2.0, slider_speed=0.025)
            for i in (0, 1)
        ],
    )
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3, "x5": 1e-3})
    return ss.simulate(scene, 1.0, start).limit_cycle()


def test_stability_that_is_not_known_is_a_third_answer(symmetric):
    reason = "stability not known: events of contacts 0 and 1 coincide, and their order matters to neighbours"
    assert symmetric.corner
    assert symmetric.stable is None
    assert symmetric.stability == reason
    assert np.isnan(symmetric.largest_multiplier)
    # Its neighbours meet the two impacts in the one or the other order.
    assert [phase.event for phase in symmetric.phases].count("impact") == 2
    for shown in (repr(symmetric), symmetric._repr_html_()):
        assert reason in shown
        assert "unstable" not in shown
        assert "nan" not in shown
    assert symmetric.to_dataset().attrs["stability"] == reason
    assert symmetric.to_dataset().attrs["stable"] == -1


def test_stability_that_is_not_known_in_diagrams(symmetric):
    data = table("friction", np.array([2.0]), [symmetric], {})
    assert data.stability.item() == symmetric.stability
    assert not data.stable.item()
    figure, axes = plt.subplots()
    types.Bifurcation(data, (symmetric,)).plot("x1", ax=axes)
    shown = [text.get_text() for text in axes.get_legend().get_texts()]
    plt.close(figure)
    assert "stability not known" in shown


def test_a_motion_followed_too_short_says_so():
    nothing = (float("nan"), float("inf"), 0.0)
    kind, message = described("aperiodic", nothing, "")
    assert kind == "undecided"
    assert "followed too short" in message
    assert "nan" not in message
    assert "inf" not in message


def test_neighbours_that_have_met_are_told_without_an_infinite_exponent():
    kind, message = described("aperiodic", (-float("inf"), 0.0, 2.5), "")
    assert kind == "unsettled"
    assert "its difference from a neighbouring motion vanishes within 2.5 s" in message
    assert "inf" not in message


def test_a_scene_without_contacts_says_so():
    scene = ss.Scene(mass=[1.0, 1.0], stiffness=np.diag([100.0, 200.0]))
    run = ss.simulate(scene, 1.0, ss.State([1e-3, 1e-3], [0.0, 0.0], "", dofs=scene.dofs))
    with pytest.raises(ss.NotPeriodicError, match="followed too short") as caught:
        run.limit_cycle(further=2.0)
    assert "nan" not in str(caught.value)


def test_a_search_ends_with_its_time_limit_and_tells_what_it_knows(pad):
    run = ss.simulate(pad, 0.02, disturbed_sliding(pad))
    with pytest.raises(
        ss.NotPeriodicError, match=r"the time limit of computing, 1e-09 s, was reached"
    ) as stopped:
        run.limit_cycle(further=1e9, time_limit=1e-9)
    assert stopped.value.kind == "undecided"
    assert stopped.value.partial.stop_reason == "time_limit"
    # In time it is the cycle.
    assert run.limit_cycle(further=1.0, time_limit=1e9).stable is True


def test_a_disturbance_from_the_modes_of_a_band():
    """Of a large scene they are computed by shift and invert, and have the same shape."""
    scene = quad_block(20, 10, 2, sparse=True)
    modes = ss.complex_modes(scene)
    growing = modes.frequencies[modes.eigenvalues.real.argmax()]
    start = disturbed_sliding(scene, band=(growing - 1e3, growing + 1e3))
    expected = disturbed_sliding(scene)
    sign = np.sign(start.velocity @ expected.velocity)
    size = np.abs(expected.velocity).max()
    np.testing.assert_allclose(start.velocity, sign * expected.velocity, rtol=0, atol=1e-6 * size)
    with pytest.raises(ss.InputError, match="band: steady sliding has no mode from 1 to 2 Hz"):
        disturbed_sliding(scene, band=(1.0, 2.0))


@pytest.mark.parametrize("limit", [0.0, -1.0, np.inf, np.nan])
def test_an_ill_posed_time_limit_of_a_search(pad, limit):
    run = ss.simulate(pad, 1e-3, disturbed_sliding(pad))
    with pytest.raises(ss.InputError, match=r"^time_limit: "):
        run.limit_cycle(time_limit=limit)


@pytest.mark.parametrize("rate", [1.0, 1e5])
def test_a_search_follows_a_motion_for_as_many_periods_in_any_unit_of_time(rate):
    """0.16 Hz and 16 kHz: the same motion, of which ten times the part computed are followed."""
    scene = mode_coupling(rate)
    cycle = ss.simulate(scene, 40.0 / rate, disturbed_sliding(scene)).limit_cycle()
    # The period of the orbit that DOP853 closes to 1.8e-12.
    assert cycle.period == pytest.approx(6.29102074 / rate, rel=1e-8)
    assert cycle.stable


def test_a_motion_in_exact_steady_sliding_is_told_how_to_leave_it():
    scene = mode_coupling()
    run = ss.simulate(scene, 40.0, ss.steady_sliding(scene))
    with pytest.raises(ss.NotPeriodicError, match="unless the start is disturbed") as caught:
        run.limit_cycle()
    assert "give further, or a longer duration" in str(caught.value)


def test_the_time_between_looks_of_a_large_scene_needs_its_slowest_modes_alone(monkeypatch):
    size = 200
    stiffness = 1e4 * (2.0 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    scene = ss.Scene(np.ones(size), stiffness, 1e-5 * stiffness, np.zeros(size), contacts=[])
    free = stiffness.copy()
    free[0, 0] = free[-1, -1] = 1e4
    drifting = ss.Scene(np.ones(size), free, 1e-5 * free, np.zeros(size), contacts=[])
    computed = []

    def counted(*arguments, **options):
        found = ss.complex_modes(*arguments, **options)
        computed.append(len(found))
        return found

    monkeypatch.setattr(attractors, "complex_modes", counted)
    slowest = 2.0 * 100.0 * np.sin(np.pi / (2 * (size + 1)))
    assert attractors.stretch_of(scene, None) == pytest.approx(60.0 * 2.0 * np.pi / slowest, rel=1e-9)
    # A body that stands still sets no time scale.
    slowest = 2.0 * 100.0 * np.sin(np.pi / (2 * size))
    assert attractors.stretch_of(drifting, None) == pytest.approx(60.0 * 2.0 * np.pi / slowest, rel=1e-9)
    assert max(computed) < 60


def test_a_disturbance_leaves_every_contact_pressed():
    """At half the slider speed, damping between its directions would take the small normal force."""
    scene = ss.Scene(
        [1.0, 1.0],
        [[100.0, -20.0], [-20.0, 100.0]],
        damping=[[5.0, -4.5], [-4.5, 5.0]],
        force=[0.0, -0.01],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.2, slider_speed=1.0)],
    )
    rest = ss.steady_sliding(scene)
    pressed = float(rest.contact_forces(scene).normal_force[0])
    assert pressed < 0.02
    start = disturbed_sliding(scene)
    assert 0.0 < abs(start.velocity[0]) < 1e-2
    assert 0.5 * pressed <= float(start.contact_forces(scene).normal_force[0])
    assert ss.simulate(scene, 0.1, start).stop_reason == "duration"
    # The other way round nothing is lost.
    assert abs(disturbed_sliding(scene.replace(damping=None)).velocity[0]) == pytest.approx(0.5)
