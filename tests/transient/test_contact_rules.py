"""What contacts do at events: impulses, coinciding events, contacts that mass couples, paradoxes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from equal_chain import equal_chain
from one_mass import MASS
from peer_integrator import assert_same_motion

EPS = np.finfo(float).eps


@given(
    st.floats(-2.0, 2.0),
    st.floats(0.1, 2.0),
    st.floats(0.0, 0.9),
    st.floats(0.0, 1.5),
    st.sampled_from([-0.3, 0.0, 0.3]),
)
def test_an_impact_with_friction_drives_slip_towards_zero(tangential, normal, restitution, friction, speed):
    """At most mu (1 + e) m |g'-| of impulse, and none beyond the stop of slip."""
    contact = ss.Contact(
        tangential=0, normal=1, friction=friction, slider_speed=speed, restitution=restitution
    )
    scene = ss.Scene([MASS, MASS], np.diag([0.0, 5e4]), contacts=[contact], impact_friction=True)
    height = 1e-3
    start = ss.State([0.0, height], [tangential, -normal], "d")
    run = ss.simulate(scene, 1.0, start, max_events=1)
    assert run.events.kind.tolist() == ["impact"]
    # From the height to the equilibrium, which is the stop, energy is kept.
    arrival = np.sqrt(normal**2 + 5e4 / MASS * height**2)
    slip = tangential - speed
    reach = friction * (1.0 + restitution) * arrival
    after = tangential - np.clip(slip, -reach, reach)
    velocity = run.event_states()[1][0]
    assert velocity[1] == pytest.approx(restitution * arrival, rel=20 * EPS)
    # A stop of slip is exact.
    assert velocity[0] == pytest.approx(after, abs=20 * EPS * (abs(tangential) + reach))
    if abs(slip) < 0.99 * reach:
        assert velocity[0] == speed


def symmetric_scene(**changes):
    """Two equal subsystems between two equal walls."""
    scene = equal_chain(2, **{"friction": 1.6, "damping": 2e-5, **changes})
    stiffness = scene.stiffness.toarray()
    stiffness[4, 4] += 1e6
    return scene.replace(stiffness=stiffness)


@pytest.mark.parametrize("method", ["modal", "taylor"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_events_of_a_symmetric_scene_coincide(method, restitution):
    scene = symmetric_scene(restitution=restitution)
    kick = {"x1": 0.2, "x5": 0.2, "x2": -0.1, "x6": -0.1}
    start = ss.steady_sliding(scene).perturbed(velocity=kick)
    run = ss.simulate(scene, 0.1, start, max_events=60, method=method)
    events = run.events
    assert len(events) == 60
    assert {"velocity", "release", "impact"} <= set(events.kind)
    first, second = slice(0, None, 2), slice(1, None, 2)
    assert np.array_equal(events.time[first], events.time[second])
    assert np.array_equal(events.kind[first], events.kind[second])
    # One entry per contact, in order, and the combination after all of the instant.
    assert (events.contact[first] == 0).all()
    assert (events.contact[second] == 1).all()
    assert np.array_equal(events.combination[first], events.combination[second])
    assert all(letters[0] == letters[1] for letters in events.combination)


def test_equal_contacts_without_a_link_change_together():
    """Exactly equal functions: every one of ten contacts has its own entry at every instant."""
    count = 10
    contacts = [
        ss.Contact(tangential=2 * i, normal=2 * i + 1, friction=0.4, static_friction=0.7, slider_speed=0.1)
        for i in range(count)
    ]
    scene = ss.Scene(
        np.full(2 * count, MASS),
        np.diag(np.tile([3e4, 5e4], count)),
        force=np.tile([0.0, -20.0], count),
        contacts=contacts,
    )
    start = ss.State(np.zeros(2 * count), np.tile([0.1, 0.0], count), "s" * count)
    run = ss.simulate(scene, 0.2, start)
    instants = np.unique(run.events.time)
    assert len(instants) > 5
    assert len(run.events) == count * len(instants)
    assert np.array_equal(run.events.contact, np.tile(np.arange(count), len(instants)))
    assert set(run.events.combination) == {"+" * count, "s" * count}


def coupled_scene(seed, coupling, **changes):
    """Two contacts and a free coordinate, all tied by mass."""
    rng = np.random.default_rng(seed)
    size = 5
    mixing = rng.normal(size=(size, size))
    mass = np.diag(rng.uniform(0.5, 1.5, size)) + coupling * mixing @ mixing.T
    springs = rng.normal(size=(size, size))
    stiffness = np.diag(rng.uniform(2e4, 1e5, size)) + 2e4 * springs @ springs.T
    contacts = [
        ss.Contact(tangential=2 * i, normal=2 * i + 1, friction=0.3, slider_speed=0.05, **changes)
        for i in range(2)
    ]
    return ss.Scene(
        mass,
        stiffness,
        damping=ss.Rayleigh(stiffness=2e-5),
        force=[0.0, -200.0, 0.0, -200.0, 0.0],
        contacts=contacts,
        impact_friction=True,
    )


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_contacts_that_mass_couples_move_like_an_independent_solution(seed):
    """Against multipliers and a Runge-Kutta method, through sticking and sliding."""
    scene = coupled_scene(seed, 0.05)
    start = ss.steady_sliding(scene).perturbed(velocity=[0.0, 0.0, 0.0, 0.0, 0.4])
    run = assert_same_motion(scene, start, 0.02)
    assert {"velocity", "slip+"} <= set(run.events.kind)


def test_forces_of_coupled_contacts_hold_their_accelerations_at_zero():
    scene = coupled_scene(1, 0.05)
    start = ss.steady_sliding(scene).perturbed(velocity=[0.0, 0.0, 0.0, 0.0, 0.4])
    run = ss.simulate(scene, 0.02, start)
    sample = run.sample(np.linspace(0.0, 0.02, 200))
    x, v = sample.position.values, sample.velocity.values
    damping = scene.damping.stiffness * scene.stiffness
    load = scene.force - x @ scene.stiffness - v @ damping
    scale = np.abs(scene.force).max() + np.abs(x).max() * np.abs(scene.stiffness).max()
    for i in range(2):
        load[:, 2 * i] += sample.friction_force.values[:, i]
        load[:, 2 * i + 1] += sample.normal_force.values[:, i]
    acceleration = np.linalg.solve(scene.mass, load.T).T
    limit = 1e-11 * scale / np.diag(scene.mass).min()
    for i in range(2):
        status = sample.status.values[:, i]
        assert (status != "d").any()
        assert np.abs(acceleration[status != "d", 2 * i + 1]).max(initial=0.0) <= limit
        assert np.abs(acceleration[status == "s", 2 * i]).max(initial=0.0) <= limit


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_a_paradox_is_reported_with_the_motion_up_to_it(method):
    """Painleve: W_nn + mu W_nt = 1.5 - 2 < 0. At the onset of slip several statuses solve.

    The belt carries the mass until k v t + c v = mu N.
    """
    mass = np.linalg.inv([[1.0, -1.0], [-1.0, 1.5]])
    contact = ss.Contact(tangential=0, normal=1, friction=2.0, slider_speed=0.1)
    scene = ss.Scene(
        mass,
        np.diag([1e4, 1e4]),
        damping=ss.Rayleigh(stiffness=1e-4),
        force=[0.0, -20.0],
        contacts=[contact],
        impact_friction=True,
    )
    start = ss.State([0.0, 0.0], [0.1, 0.0], "s")
    ambiguous = r"contacts \[0\] at t = 0\.039(9|89{4}).*several solutions"
    with pytest.raises(ss.RunError, match=ambiguous) as caught:
        ss.simulate(scene, 1.0, start, method=method)
    run = caught.value.partial
    assert run.stop_reason == "failed"
    onset = (2.0 * 20.0 - 1e-4 * 1e4 * 0.1) / (1e4 * 0.1)
    assert run.duration == pytest.approx(onset, rel=20 * EPS)
    # What was computed up to there can be asked for.
    middle = run.state(0.5 * onset)
    assert middle.combination == "s"
    assert middle.position[0] == pytest.approx(0.05 * onset, rel=20 * EPS)
    # Below the critical friction the same scene runs on.
    assert ss.simulate(scene.replace(friction=1.4), 1.0, start, method=method).stop_reason == "duration"


@pytest.mark.parametrize("tangential", [None, "y", ("y", "z")])
@pytest.mark.parametrize("gap", [0.0, 0.1, 0.3, 0.7])
def test_a_plastic_impact_where_the_mass_would_rest_leaves_it_there(tangential, gap):
    """Its normal force is zero but for rounding, which neither opens the contact for good nor without end."""
    friction = {} if tangential is None else {"friction": 0.5, "slider_speed": np.zeros(np.size(tangential))}
    if isinstance(tangential, str):
        friction["slider_speed"] = 0.0
    contact = ss.Contact(tangential=tangential, normal="x", gap=gap, restitution=0.0, **friction)
    scene = ss.Scene(
        [1.0, 1.0, 1.0],
        np.diag([100.0, 50.0, 30.0]),
        damping=0.2 * np.eye(3),
        force=[-100.0 * gap, 0.0, 0.0],
        dofs=["x", "y", "z"],
        contacts=[contact],
    )
    run = ss.simulate(scene, 5.0, ss.State([0.5, 0.0, 0.0], np.zeros(3), "d" * len(scene.contacts)))
    assert run.stop_reason == "duration"
    assert run.events.kind[0] == "impact"
    state = run.state(5.0)
    assert state.position[0] == pytest.approx(-gap, abs=1e-15)
    assert abs(state.velocity[0]) < 1e-14


@pytest.mark.parametrize(
    "law", [ss.friction.Dahl(kinetic=0.5, stiffness=1e3), ss.friction.Law(lambda s: 0.5 * np.tanh(s / 0.05))]
)
def test_friction_that_vanishes_at_rest_closes_where_nothing_slides(law):
    """Bounces come to an end on a slider at rest, with a slip velocity and a friction force of zero."""
    contact = ss.Contact(tangential="x", normal="z", friction=law, slider_speed=0.0, restitution=0.5)
    scene = ss.Scene(
        [1.0, 1.0], np.diag([100.0, 0.0]), force=[0.0, -4.0], dofs=["x", "z"], contacts=[contact]
    )
    run = ss.simulate(scene, 3.0, ss.State([0.0, 0.5], [0.0, 0.0], "d"))
    assert run.events.kind[-1] == "accumulation"
    # t (1 + e) / (1 - e), where the first fall takes t = 1/2.
    assert run.events.time[-1] == pytest.approx(0.5 * (1.0 + 2.0), rel=1e-12)
    state = run.state(3.0)
    assert state.combination in "+-"
    assert state.position[0] == state.velocity[0] == 0.0
