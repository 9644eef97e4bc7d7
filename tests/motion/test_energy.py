"""Energy: every term from its own formula, works integrated to rounding, the balance closed to rounding."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from peer_integrator import Mechanics
from random_scenes import drawn_scenes

EPS = np.finfo(float).eps
RESTITUTION = (0.0, 0.3, 0.8, 1.0)


def motion(scene, drawn, strength, duration, **options):
    """A run from the kicked equilibrium, where the kick leaves all contacts pressed."""
    return ss.simulate(scene, duration, drawn.kicked(strength), **options)


def closed(balance):
    """The residual over the sum of the absolute work terms."""
    return abs(balance.residual) / balance.turnover


def dense(scene):
    """Mass, damping and stiffness as full matrices."""
    mass = np.diag(scene.mass) if scene.mass.ndim == 1 else scene.mass
    if isinstance(scene.damping, ss.Rayleigh):
        return mass, scene.damping.mass * mass + scene.damping.stiffness * scene.stiffness, scene.stiffness
    return mass, scene.damping if scene.damping is not None else np.zeros_like(mass), scene.stiffness


def single_impacts(run):
    """(contact, time, velocity just before, velocity just after) of instants with one event, an impact."""
    _, after = run.event_states()
    for k, (time, kind) in enumerate(zip(run.events.time, run.events.kind, strict=True)):
        if kind == "impact" and np.count_nonzero(run.events.time == time) == 1:
            yield run.events.contact[k], float(time), run.state(np.nextafter(time, 0.0)).velocity, after[k]


@given(drawn_scenes(restitution=RESTITUTION), st.floats(0.5, 6.0), st.booleans())
def test_the_balance_closes_over_the_whole_run(drawn, strength, impact_friction):
    """Restitution, Coulomb impulse, static friction, constant force and general damping: `drawn_scenes`."""
    scene = drawn.scene.replace(impact_friction=impact_friction)
    run = motion(scene, drawn, strength, 0.05, max_events=400)
    assert closed(run.balance()) <= 1e-12


@given(drawn_scenes(restitution=RESTITUTION), st.floats(0.5, 6.0))
def test_rate_of_energy_and_powers_agree_at_any_time(drawn, strength):
    scene = drawn.scene
    run = motion(scene, drawn, strength, 0.02, max_events=200)
    times = drawn.rng.uniform(0.0, run.duration, 50)
    flow = run.energy(times)
    powers = flow.contact_power.sum("contact") + flow.external_power - flow.damping_power
    speed = np.abs(run.sample(times).velocity.values)
    _, damping, stiffness = dense(scene)
    # What is added up: forces of springs, dampers and load times velocities; friction multiplies N.
    forces = np.abs(run.sample(times).position.values) @ np.abs(stiffness) + speed @ np.abs(damping)
    forces += np.abs(scene.force)
    scale = (forces * speed).sum(axis=1) + (forces.sum(axis=1) * speed.max(axis=1))
    amplification = 1.0 + max(contact.static_friction for contact in scene.contacts)
    # Full mass matrices are inverted: their condition number is below 1e2.
    assert (np.abs(flow.energy_rate - powers) <= 1e2 * EPS * amplification * scale).all()
    assert (flow.damping_power >= 0.0).all()
    # Heat is -T s, and a contact sticks with s = 0 exactly.
    assert (flow.friction_heat >= -4 * EPS * np.abs(flow.slider_power)).all()


@given(drawn_scenes(restitution=(0.0, 0.5, 1.0), max_friction=0.0), st.floats(0.5, 6.0))
def test_without_damping_and_friction_only_impacts_take_energy(drawn, strength):
    scene = drawn.scene.replace(damping=None)
    start = ss.steady_sliding(scene)
    velocity = np.zeros(scene.size)
    velocity[-1] = 0.2 * strength
    # The start of every phase is rounded to an ulp of its energy, the same one in a series of bounces:
    # 200 of them are 4e-14.
    run = ss.simulate(scene, 0.05, start.perturbed(velocity=velocity), max_events=200)
    balance = run.balance()
    assert (balance.contact, balance.damping) == (0.0, 0.0)
    end = run.energy([0.0, run.duration])
    energy = float((end.kinetic + end.elastic).max()) + abs(scene.force @ run.state(run.duration).position)
    assert abs(balance.residual) <= 1e-13 * energy
    assert balance.impact >= -1e-13 * energy
    if all(contact.restitution == 1.0 for contact in scene.contacts):
        assert balance.impact <= 1e-13 * energy


@pytest.mark.slow
@given(drawn_scenes(restitution=(0.0, 0.3, 0.8)), st.floats(1.0, 6.0), st.booleans())
def test_what_an_impact_takes(drawn, strength, impact_friction):
    """Normal: 1/2 m (1 - e^2) g'^2; tangential impulse: slider work p_t v, heat -p_t (s+ + s-) / 2."""
    scene = drawn.scene.replace(impact_friction=impact_friction)
    run = ss.simulate(scene, 0.05, drawn.lifted(strength), max_events=100)
    mechanics = Mechanics(scene)
    impacts = list(single_impacts(run))
    assert impacts
    for contact, time, before, after in impacts:
        law = scene.contacts[contact]
        taken = run.balance(np.nextafter(time, 0.0), time).contacts.isel(contact=contact)
        normal, tangential = mechanics.normal[contact], mechanics.tangential[contact]
        mass = 1.0 / (normal @ np.linalg.solve(mechanics.mass, normal))
        arrival = normal @ before
        # Velocities are known to one ulp of time times some 1e4 m/s^2, besides their own rounding.
        step = 1e4 * np.spacing(time) + 20 * EPS * np.abs(before).max()
        expected = 0.5 * mass * (1.0 - law.restitution**2) * arrival**2
        assert float(taken.impact_normal) == pytest.approx(
            expected, rel=1e-13, abs=mass * abs(arrival) * step
        )
        tangential_mass = 1.0 / (tangential @ np.linalg.solve(mechanics.mass, tangential))
        slip = np.array([tangential @ before, tangential @ after]) - law.slider_speed
        impulse = tangential_mass * (slip[1] - slip[0])
        if not impact_friction:
            assert abs(slip[1] - slip[0]) <= step
            continue
        largest = law.friction * (1.0 + law.restitution) * mass * abs(arrival)
        assert abs(impulse) <= largest * (1.0 + 1e-12) + tangential_mass * step
        slack = tangential_mass * step * (np.abs(slip).max() + abs(law.slider_speed))
        assert float(taken.impact_slider) == pytest.approx(impulse * law.slider_speed, rel=1e-12, abs=slack)
        assert float(taken.impact_friction) == pytest.approx(-impulse * slip.mean(), rel=1e-12, abs=slack)
        assert float(taken.impact_friction) >= -slack


@given(drawn_scenes(restitution=RESTITUTION), st.floats(0.5, 6.0), st.data())
def test_balances_of_adjoining_intervals_add_up(drawn, strength, data):
    run = motion(drawn.scene, drawn, strength, 0.03, max_events=100)
    inside = [*run.events.time, *drawn.rng.uniform(0.0, run.duration, 3)]
    middle = float(data.draw(st.sampled_from(inside), label="middle"))
    whole, first, second = run.balance(), run.balance(0.0, middle), run.balance(middle)
    for name in ("stored", "contact", "external", "damping", "impact", "slider", "friction_heat"):
        parts = getattr(first, name) + getattr(second, name)
        # Each part is rounded against all that flowed, and the first against what flowed and came back.
        rounding = 1e-13 * (first.turnover + second.turnover + abs(first.stored) + abs(first.external))
        assert getattr(whole, name) == pytest.approx(parts, rel=0, abs=rounding)


@given(drawn_scenes(), st.floats(0.5, 3.0))
def test_both_kinds_of_motion_give_the_same_works(drawn, strength):
    modal = motion(drawn.scene, drawn, strength, 0.03, max_events=60)
    taylor = ss.simulate(drawn.scene, 0.03, modal.start, method="taylor", max_events=60)
    assert modal.events.kind.tolist() == taylor.events.kind.tolist()
    a, b = modal.balance(), taylor.balance()
    for name in ("stored", "contact", "external", "damping", "impact"):
        # Event times of either differ by rounding times the condition of their roots: below 1e-9.
        assert getattr(a, name) == pytest.approx(
            getattr(b, name), rel=0, abs=1e-9 * (a.turnover + b.turnover)
        )


def test_fast_modes_cost_nothing_once_they_have_decayed():
    """Time constants of 1e-6 s and 1e-1 s in one scene: panels follow what still moves."""
    stiffness = np.array([[4e6, -3e6], [-3e6, 3e6 + 2e3]])
    scene = ss.Scene([1e-6, 2.0], stiffness, damping=ss.Rayleigh(stiffness=5e-7), force=[0.0, -20.0])
    run = ss.simulate(scene, 0.5, ss.State([1e-4, 1e-3], [0.3, 0.2], ""))
    balance = run.balance()
    # The fast mode, |lambda| = 2e6 1/s, decays at 1e6 1/s and counts for 36 of its time constants; the slow
    # one has sqrt(7.5e5 / 2) 1/s. Panels have |lambda| times width = 6; one more each for rounding up.
    fast, slow = 2e6, np.sqrt(7.6e5 / 2.0)
    assert balance.states <= 18 * (36e-6 * fast / 6 + 0.5 * slow / 6 + 4)
    assert balance.states >= 18 * (0.5 * slow / 6)
    assert closed(balance) <= 1e-12


def test_limit_of_bounces_takes_the_rest_of_the_relative_motion():
    """A mass that falls and bounces with e = 0.5 on a rigid floor loses all of m g h, and keeps none."""
    mass, load, height = 1.5, 20.0, 0.01
    contact = ss.Contact(tangential=0, normal=1, friction=0.0, slider_speed=0.0, restitution=0.5)
    scene = ss.Scene([mass, mass], np.diag([0.0, 0.0]), force=[0.0, -load], contacts=[contact])
    run = ss.simulate(scene, 0.3, ss.State([0.0, height], [0.0, 0.0], "d"))
    assert run.events.kind[-1] == "accumulation"
    balance = run.balance()
    assert balance.impact == pytest.approx(load * height, rel=1e-14 * len(run.events))
    assert balance.external == pytest.approx(load * height, rel=4 * EPS)
    assert closed(balance) <= 1e-14
    # Cut short by a coarse tolerance, the sum of what is left is the same geometric series.
    coarse = ss.simulate(scene, 0.3, ss.State([0.0, height], [0.0, 0.0], "d"), accumulation_tolerance=1e-3)
    assert len(coarse.events) < len(run.events)
    assert coarse.balance().impact == pytest.approx(load * height, rel=1e-13)


def test_coupled_contacts_close_too():
    """A full mass matrix that couples two contacts: impulses of all closed contacts."""
    rng = np.random.default_rng(7)
    size = 6
    factor = rng.normal(size=(size, size))
    mass = np.eye(size) + 0.05 * factor @ factor.T
    stiffness = np.diag(rng.uniform(5e4, 2e5, size)) + 2e4 * np.ones((size, size))
    contacts = [
        ss.Contact(tangential=2 * i, normal=2 * i + 1, friction=0.4, slider_speed=0.1, restitution=0.3 * i)
        for i in range(2)
    ]
    force = np.array([0.0, -40.0, 0.0, -60.0, 0.0, 0.0])
    scene = ss.Scene(
        mass,
        stiffness,
        damping=ss.Rayleigh(1.0, 2e-5),
        force=force,
        contacts=contacts,
        impact_friction=True,
    )
    start = ss.steady_sliding(scene)
    velocity = np.zeros(size)
    velocity[4:] = 2.0, -1.5
    run = ss.simulate(scene, 0.1, start.perturbed(velocity=velocity))
    assert np.count_nonzero(run.events.kind == "impact") > 5
    balance = run.balance()
    assert closed(balance) <= 1e-12
    assert balance.impact_loss > 1e6 * abs(balance.residual)
    assert (balance.contacts.impact_friction >= 0.0).all()


def test_nothing_is_computed_before_it_is_asked_for(standard):
    """The counters of a run are those without energies; each balance counts its own states."""
    scene = standard.scene.replace()
    run = ss.simulate(scene, standard.duration, standard.start)
    before = dict(run.core.counters)
    balance = run.balance()
    run.energy(np.linspace(0.0, 0.6, 50))
    assert dict(run.core.counters) == before
    # Whole panels of 18 nodes; two phases in three need one or two.
    assert balance.states % 18 == 0
    assert balance.states == 9666


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1.0,), "t0: -1 s lies outside"),
        ((0.0, 9.0), "t1: 9 s lies outside"),
        ((float("nan"),), "t0: NaN s lies outside"),
        ((0.3, 0.1), "t0: must be at most t1, got 0.3"),
        (("now",), "t0: expected a real number, got 'now'"),
    ],
)
def test_hostile_intervals(arguments, message, standard):
    run = ss.simulate(standard.scene, 0.5, standard.start)
    with pytest.raises(ss.InputError, match=message):
        run.balance(*arguments)
    with pytest.raises(ss.InputError, match="times"):
        run.energy([0.1, 9.0])


def test_an_empty_interval_is_all_zero(standard):
    run = ss.simulate(standard.scene, 0.5, standard.start)
    balance = run.balance(0.2, 0.2)
    assert (balance.stored, balance.contact, balance.damping, balance.residual) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("stiffness", "closes"), [(1e8, True), pytest.param(8e15, False, marks=pytest.mark.nightly)]
)
def test_a_balance_that_does_not_close_says_so(stiffness, closes):
    """Two masses tied by a spring 8e11 times stiffer than their own lose 12 digits of their place.

    Half a ulp of 8e15 N/m is 0.5 N/m of the 1e4 N/m that carry the centre: 5e-5 of them.
    """
    tie = np.zeros((4, 4))
    tie[:2, :2] = [[1.0, -1.0], [-1.0, 1.0]]
    rubs = {"friction": 0.3, "static_friction": 0.6, "slider_speed": 0.1}
    scene = ss.Scene(
        np.ones(4),
        np.diag([1e4, 1e4, 1e5, 1e5]) + stiffness * tie,
        damping=ss.Rayleigh(mass=1.0),
        force=[0.0, 0.0, -100.0, -100.0],
        contacts=[ss.Contact(tangential=k, normal=2 + k, **rubs) for k in (0, 1)],
    )
    rest = ss.steady_sliding(scene)
    start = ss.State(rest.position, [0.05, 0.05, 0.0, 0.0], "++")
    balance = ss.simulate(scene, 0.02, start).balance()
    assert balance.closes == closes
    for text in (repr(balance), str(balance.summary())):
        assert ("does not close" in text) == (not closes), text


def test_a_free_vibration_does_no_work_and_its_balance_closes():
    """After a period nothing has changed: the residual is rounding of the energy, not of the work."""
    scene = ss.Scene([1.0], [[(2 * np.pi) ** 2]])
    balance = ss.simulate(scene, 1.0, ss.State([1.0], [0.0], "")).balance()
    assert balance.turnover == 0.0
    assert balance.closes
