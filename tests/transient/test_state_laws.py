"""A user's own law with a state, rate and state, and bristles that are elastic first."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss

NUMBERS = {
    "static": 1.5,
    "kinetic": 1.0,
    "speed": 1e-3,
    "stiffness": 1e5,
    "damping": np.sqrt(1e5),
    "viscous": 0.4,
}
RATE = "s - stiffness * abs(s) * z / (kinetic + (static - kinetic) * exp(-(s / speed)**2))"
FORCE = f"stiffness * z + damping * ({RATE}) + viscous * s"


def rate(s, z, static=1.5, kinetic=1.0, speed=1e-3, stiffness=1e5):
    level = kinetic + (static - kinetic) * np.exp(-((s / speed) ** 2))
    return s - stiffness * np.abs(s) * z / level


def force(s, z, static=1.5, kinetic=1.0, speed=1e-3, stiffness=1e5, damping=1e5**0.5, viscous=0.4):
    return stiffness * z + damping * rate(s, z, static, kinetic, speed, stiffness) + viscous * s


def dragged(law, stiffness=2.0, **changes):
    """Return a mass whose spring is pulled at 0.1 m/s, in the frame of the pulled end."""
    given = {"tangential": "x1", "normal_force": 1.0, "friction": law, "slider_speed": -0.1}
    return ss.Scene([1.0], [[stiffness]], contacts=[ss.Contact(**{**given, **changes})])


def test_the_law_of_lugre_in_a_users_words_is_lugres_law():
    own = ss.friction.StateLaw(force=FORCE, rate=RATE, **NUMBERS)
    start = ss.State([0.0], [-0.1], "-")
    runs = [ss.simulate(dragged(law), 11.0, start) for law in (ss.friction.LuGre(**NUMBERS), own)]
    assert runs[1].events.time == pytest.approx(runs[0].events.time, abs=1e-12)
    assert len(runs[1].events) == 4
    # The numbers of other programs.
    assert runs[1].events.time[0] == pytest.approx(10.2660909412841, abs=1e-12)
    # Deflections of bristles follow from their balances in slip, the state of two formulas in time.
    assert runs[0].counters["panels"] == pytest.approx(362, rel=0.1)
    assert runs[1].counters["panels"] == pytest.approx(11_324, rel=0.01)
    friction = [run.sample([0.5, 10.28]).friction_force.to_numpy() for run in runs]
    assert friction[1] == pytest.approx(friction[0], rel=1e-11)
    modes = [ss.complex_modes(dragged(law)).eigenvalues for law in (ss.friction.LuGre(**NUMBERS), own)]
    assert modes[1] == pytest.approx(modes[0], rel=1e-12)
    # What it stores is not known: all work is heat.
    balances = [run.balance() for run in runs]
    assert abs(balances[1].residual) < 1e-13
    stored = balances[0].elastic - balances[1].elastic
    assert stored == pytest.approx(0.5 * 1e5 * 1.1e-5**2, rel=0.5)


def test_a_function_is_noted_as_a_text():
    law = ss.friction.StateLaw(force=force, rate=rate, kinetic=0.8)
    assert law.rate == RATE
    assert law == ss.friction.StateLaw(law.force, law.rate, **{**NUMBERS, "kinetic": 0.8})
    assert law.parameters() == {**NUMBERS, "kinetic": 0.8}
    assert law.replace(kinetic=1.0) == ss.friction.StateLaw(force=FORCE, rate=RATE, **NUMBERS)
    assert eval(repr(law), {"StateLaw": ss.friction.StateLaw}) == law
    assert law.coefficient(0.1) == pytest.approx(0.8 + 0.04, rel=1e-12)
    assert law.coefficient(0.0) == 0.0
    assert ss.friction.StateLaw("z + sign(s) * abs(s)", "s - z").coefficient(0.3) == pytest.approx(0.6)


def test_a_law_goes_through_a_file(tmp_path):
    for law in (
        ss.friction.StateLaw(force=force, rate=rate),
        ss.friction.RateState(0.6, 0.01, 0.015, 1e-5, 1e-6),
        ss.friction.ElastoPlastic(0.4, 1e3, 0.6, 0.1, 0.05),
    ):
        ss.save(dragged(law), tmp_path / "scene.toml")
        assert ss.load(tmp_path / "scene.toml").scene.contacts[0].friction == law


def test_its_numbers_are_parameters():
    law = ss.friction.StateLaw(
        "stiffness * z", "s - stiffness * abs(s) * z / kinetic", stiffness=1e3, kinetic=0.4
    )
    scene = dragged(law)
    values = np.array([0.2, 0.4])
    found = ss.sweep(scene, {"friction_kinetic": values})
    dahl = ss.sweep(dragged(ss.friction.Dahl(0.4, 1e3)), {"friction_kinetic": values})
    assert np.sort_complex(found.eigenvalue.to_numpy().ravel()) == pytest.approx(
        np.sort_complex(dahl.eigenvalue.to_numpy().ravel()), rel=1e-12
    )


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("z", "s - u"), "friction: rate: formula: u in 's - u' has no value; give it as u="),
        (("3.0 * 2", "s - z"), "friction: force: 6 does not depend on the slip velocity s and the state z"),
        (
            ("z", "s - abs(z)"),
            r"friction: rate: formula: 'abs\(z\)': a law cannot branch on the slip velocity",
        ),
        (("z", lambda s: s), "friction: rate: expected a function of the slip velocity s and the state z"),
        (
            (lambda s, z, k=1.0: k * z, lambda s, z, k=2.0: s - k * z),
            "friction: k: has two defaults, 1 and 2",
        ),
    ],
)
def test_what_is_no_law_is_refused(given, said):
    with pytest.raises(ss.InputError, match=said):
        ss.friction.StateLaw(*given)


def test_numbers_without_a_place_are_refused():
    with pytest.raises(ss.InputError, match="friction: hardness: is no number of 'z' and 's - z'"):
        ss.friction.StateLaw("z", "s - z", hardness=1.0)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (
            ss.friction.StateLaw("0.3 * sign(s) + z", "s - z"),
            r"contact 0: friction: the force must not jump as slip turns, got 3e-1 and -3e-1 at z = 0",
        ),
        (
            ss.friction.StateLaw("z", "s + abs(s) * z"),
            r"contact 0: friction: must be finite at the slider speed -0.1 m/s, got nan, as the rate has to",
        ),
        # Both -1 and 1 are states of steady slip.
        (ss.friction.StateLaw("z", "abs(s) * z * (1 - z**2)"), "as the rate has to fall through zero at one"),
    ],
)
def test_what_is_no_friction_is_refused(law, said):
    with pytest.raises(ss.InputError, match=said):
        dragged(law)


def test_a_start_without_steady_slip_needs_its_state():
    law = ss.friction.StateLaw("0.1 * z", "0.5 - s - z * (1 - s)")
    scene = dragged(law)
    with pytest.raises(ss.InputError, match="no steady slip at the slip velocity 2e0 m/s of the start; give"):
        ss.simulate(scene, 1.0, ss.State([0.0], [1.9], "-"))
    assert ss.simulate(scene, 0.01, ss.State([0.0], [1.9], "-", internal=[0.3])).duration == 0.01


def test_a_formula_that_loses_its_meaning_ends_the_run():
    """The state falls to the place where its logarithm ends."""
    law = ss.friction.StateLaw("0.1 * log(z + 1)", "s - 0.5 - 0.2 * z * abs(s)")
    scene = dragged(law, slider_speed=-3.0)
    with pytest.raises(ss.RunError, match="contact 0") as caught:
        ss.simulate(scene, 20.0, ss.State([-10.0], [-2.9], "-", internal=[0.0]))
    assert caught.value.partial.duration > 3.0


#: m, N, a, b, length, speed of the slider: k_c = 500005000 N/m, w_c = 70.71067811865474 1/s.
ROCK = ss.friction.RateState(reference=0.6, direct=0.01, evolution=0.015, length=1e-5, speed=1e-6)


def rock(stiffness):
    contact = ss.Contact(tangential="x1", normal_force=1e6, friction=ROCK, slider_speed=1e-3)
    return ss.Scene([1.0], [[stiffness]], contacts=[contact])


def test_the_critical_stiffness_of_rate_and_state():
    (point,) = ss.critical_points(rock, {"stiffness": (4e8, 6e8)})
    assert point.kind == "hopf"
    assert point.value == pytest.approx(500005000.0, rel=1e-12)
    assert point.frequency == pytest.approx(70.71067811865474 / (2.0 * np.pi), rel=1e-12)


def test_rate_and_state_follows_its_equations():
    """The equations in ln(theta) and ln(v), stiff, by an implicit method."""
    scene = rock(5.2e8)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 2e-4})
    run = ss.simulate(scene, 2e-3, start)
    assert ROCK.coefficient(1e-3) == pytest.approx(0.6 - 0.005 * np.log(1e3), rel=1e-12)

    def rates(_, y):
        x, u, z = y
        s = u - 1e-3
        friction = -1e6 * 0.01 * np.arcsinh(s / 2e-6 * np.exp((0.6 + 0.015 * z) / 0.01))
        return [u, friction - 5.2e8 * x, (1e-6 * np.exp(-z) - abs(s)) / 1e-5]

    state = run.state(0.0)
    first = [state.position[0], state.velocity[0], state.internal[0]]
    path = solve_ivp(rates, (0.0, 2e-3), first, method="Radau", rtol=1e-10, atol=[1e-14, 1e-13, 1e-11])
    last = run.state(2e-3)
    found = [last.position[0], last.velocity[0], last.internal[0]]
    assert found == pytest.approx(path.y[:, -1], rel=1e-6, abs=1e-9)
    assert abs(run.balance().residual) < 1e-12


def drift(law):
    """Return how far a load of changing size moves a body that a constant load leaves short of slip, m."""
    contact = ss.Contact(tangential="x1", normal_force=1.0, friction=law)
    shaker = ss.Harmonic({"x1": 0.05}, frequency=1.0, name="shaker")
    scene = ss.Scene([0.1], [[1e-6]], force=[0.1], damping=[[2.0]], contacts=[contact], loads=[shaker])
    run = ss.simulate(scene, 30.0, ss.State([0.0], [0.0], "-", internal=[0.0]))
    first, last = run.sample([10.0, 30.0]).position.to_numpy()[:, 0]
    return last - first


def test_bristles_that_are_elastic_first_do_not_drift():
    elastic = ss.friction.ElastoPlastic(kinetic=0.4, stiffness=1e3, break_away=0.7)
    assert abs(drift(elastic)) < 1e-13
    # Those of Dahl creep by a tenth of their deflection a period.
    assert drift(ss.friction.Dahl(0.4, 1e3)) > 1e-4


def test_bristles_that_are_elastic_first_slip_at_last():
    """Loaded from rest: z = x up to the break-away, and z' = x' (1 - f) beyond."""
    kinetic, stiffness, part, pressed = 0.4, 300.0, 0.5, 5.0
    contact = ss.Contact(
        tangential="x1", normal_force=pressed, friction=ss.friction.ElastoPlastic(kinetic, stiffness, part)
    )
    scene = ss.Scene([1.0], [[100.0]], contacts=[contact])
    run = ss.simulate(scene, 1.0, ss.State([0.0], [0.3], "-", internal=[0.0]))
    turn = float(run.events.time[0])
    sample = run.sample(np.linspace(0.0, turn, 40))
    extent = kinetic / stiffness
    place = sample.position.to_numpy()[:, 0] / extent
    z = -sample.friction_force.to_numpy()[:, 0] / (pressed * stiffness) / extent
    elastic = place < part
    assert z[elastic] == pytest.approx(place[elastic], abs=1e-13)

    def loss(z):
        w = (z - part) / (1.0 - part)
        return np.where(w < 0.0, 0.0, np.where(w > 1.0, z, (2.0 + part) * w**2 - (1.0 + part) * w**3))

    path = solve_ivp(
        lambda x, z: 1.0 - loss(z),
        (0.0, place[-1]),
        [0.0],
        "DOP853",
        place,
        rtol=1e-12,
        atol=1e-14,
        max_step=0.01,
    )
    assert z == pytest.approx(path.y[0], abs=1e-9)
    assert z[-1] == pytest.approx(1.0, abs=1e-2)


def test_nothing_is_said_of_motions_where_friction_is_not_smooth():
    """Steady slip of such bristles lies where two pieces of their law meet."""
    law = ss.friction.ElastoPlastic(kinetic=0.4, stiffness=1e3)
    points = ss.critical_points(
        lambda damping: dragged(law).replace(damping=[[damping]]), {"damping": (-0.1, 0.1)}
    )
    assert [point.kind for point in points] == ["hopf"]
    assert points[0].criticality is None


@pytest.mark.parametrize("break_away", [0.0, 1.0, -0.2])
def test_a_break_away_is_a_part(break_away):
    with pytest.raises(ss.InputError, match="contact 0: friction: break_away: must be between 0 and 1"):
        dragged(ss.friction.ElastoPlastic(0.4, 1e3, break_away))
