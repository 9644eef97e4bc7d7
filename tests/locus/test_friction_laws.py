"""Friction over slip speed: its laws, small motions about steady sliding, and where these lose stability."""

import functools

import numpy as np
import pytest
import scipy
from scipy.optimize import brentq

import stickslip as ss
from stickslip.locus import critical
from stickslip.scene.laws.friction import Constant, FrictionLaw, Linear, Rational, Stribeck, Tabulated
from stickslip.scene.parameters.family import Family

STRIBECK = Stribeck(0.5, 0.3, 0.1)
LAWS = [
    Linear(0.4, 0.2),
    Linear(0.4, -0.2),
    STRIBECK,
    Stribeck(0.4, 0.3, 0.05, viscous=0.3),
    Rational(0.5, 0.3, 0.1),
    Tabulated([0.0, 0.05, 0.2, 0.6], [0.5, 0.35, 0.3, 0.32]),
]


def block(law: FrictionLaw | float, speed: float = 0.2, damping: float = 0.7) -> ss.Scene:
    """Return a block on a belt under a given normal force."""
    contact = ss.Contact(tangential=0, normal_force=10.0, friction=law, slider_speed=speed)
    return ss.Scene([1.0], [[100.0]], damping=[[damping]], contacts=[contact])


def slope(law: FrictionLaw, speed: float) -> float:
    """Return d mu / d |s| by differences of order six."""
    h = 1e-3 * speed
    value = [law.coefficient(speed + k * h) - law.coefficient(speed - k * h) for k in (1, 2, 3)]
    return (45.0 * value[0] - 9.0 * value[1] + value[2]) / (60.0 * h)


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_modes_of_steady_sliding_feel_the_slope_as_damping(law, speed):
    eigenvalue = ss.complex_modes(block(law, speed)).eigenvalues[0]
    damping = 0.7 + 10.0 * slope(law, abs(speed))
    # Rounding of the differences, times N / 2m.
    assert eigenvalue.real == pytest.approx(-0.5 * damping, abs=1e-10)
    assert abs(eigenvalue) == pytest.approx(10.0, rel=1e-14)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_two_contacts_are_those_of_constant_friction_with_the_slope_as_damping(law):
    speeds = [0.11, 0.33]
    scene = ss.models.two_subsystems(friction=law, slider_speed=speeds, preload_displacement=1e-3)
    mu = [law.coefficient(v) for v in speeds]
    constant = ss.models.two_subsystems(friction=mu, slider_speed=speeds, preload_displacement=1e-3)
    normal = ss.steady_sliding(constant).normal_forces
    steady = ss.steady_sliding(scene)
    np.testing.assert_allclose(steady.normal_forces, normal, rtol=1e-12)
    friction = steady.contact_forces(scene).friction_force
    np.testing.assert_allclose(friction, mu * normal, rtol=1e-12)
    damping = 1e-4 * constant.stiffness.toarray()
    for i, dof in enumerate((2, 6)):
        damping[dof, dof] += normal[i] * slope(law, speeds[i])
    expected = ss.complex_modes(
        ss.Scene(
            constant.mass,
            constant.stiffness,
            damping=damping,
            force=constant.force,
            contacts=constant.contacts,
        )
    ).eigenvalues
    found = ss.complex_modes(scene).eigenvalues
    np.testing.assert_allclose(found, expected, rtol=1e-10)


TABLE = Tabulated([0.0, 0.05, 0.2, 0.6, 0.7, 0.71], [0.5, 0.35, 0.3, 0.32, 0.25, 0.25])


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_table_gives_hopf_points_where_its_slope_balances_the_damping(direction):
    """c + N mu'(v) = 0 in every cubic of the table: mu' is quadratic there."""
    spline = scipy.interpolate.PchipInterpolator(TABLE.speeds, TABLE.values)
    slopes = spline.derivative()(TABLE.speeds)
    slopes[-1] = 0.0
    derivative = scipy.interpolate.CubicHermiteSpline(TABLE.speeds, TABLE.values, slopes).derivative()
    expected = np.sort(derivative.solve(-0.07, extrapolate=False))
    assert len(expected) == 3
    limits = sorted((0.01 * direction, 0.9 * direction))
    points = ss.critical_points(block(TABLE), {"slider_speed": limits})
    found = np.sort([abs(point.value) for point in points if point.kind == "hopf"])
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    (only,) = ss.critical_points(
        block(TABLE), {"slider_speed": sorted((0.01 * direction, 0.5 * direction))}, kinds=("hopf",)
    )
    assert abs(only.value) == pytest.approx(expected[0], rel=1e-12)


def test_a_model_that_slides_at_a_function_of_its_parameter_is_divided_at_the_knots_of_its_table():
    def model(turns: float) -> ss.Scene:
        return block(TABLE, speed=0.3 * turns**2)

    points = ss.critical_points(model, {"turns": (0.3, 1.7)})
    speeds = [point.value for point in ss.critical_points(block(TABLE), {"slider_speed": (0.027, 0.867)})]
    np.testing.assert_allclose([0.3 * point.value**2 for point in points], speeds, rtol=1e-12)
    swept = ss.sweep(model, {"turns": np.linspace(0.3, 1.7, 29)})
    expected = [ss.complex_modes(model(float(value))).eigenvalues.real.max() for value in swept.turns]
    np.testing.assert_allclose(swept.eigenvalue.real.max("branch"), expected, rtol=1e-10, atol=1e-12)


def test_falling_friction_gives_a_hopf_point_in_closed_form():
    # c + N mu'(v) = 0 with mu' = -(static - kinetic) / speed exp(-v / speed).
    (point,) = ss.critical_points(block(STRIBECK), {"slider_speed": (0.05, 1.0)})
    assert (point.kind, point.cause, point.direction) == ("hopf", "falling friction", -1)
    assert point.value == pytest.approx(0.1 * np.log(20.0 / 0.7), rel=1e-12)
    (point,) = ss.critical_points(block(STRIBECK), {"friction_kinetic": (0.1, 0.5)}, kinds=("hopf",))
    assert point.value == pytest.approx(0.5 - 0.1 * 0.07 * np.exp(2.0), rel=1e-12)
    (point,) = ss.critical_points(block(Linear(0.4, 0.0)), {"friction_slope": (-0.2, 0.2)}, kinds=("hopf",))
    assert point.value == pytest.approx(-0.07, rel=1e-12)
    # (static - kinetic) / speed (1 + v / speed)^-2 N = c
    (point,) = ss.critical_points(
        block(Rational(0.5, 0.3, 0.1)), {"slider_speed": (0.05, 1.0)}, kinds=("hopf",)
    )
    assert point.value == pytest.approx(0.1 * (np.sqrt(2.0 * 10.0 / 0.7) - 1.0), rel=1e-12)


def test_a_hopf_point_over_every_number_of_the_law():
    """``(static - kinetic) / speed exp(-v / speed) - viscous = c / N`` at v = 0.2 m/s, c / N = 0.07 s/m."""
    falling = np.exp(-2.0) / 0.1
    expected = {
        "friction_static": 0.3 + 0.07 / falling,
        "friction_kinetic": 0.5 - 0.07 / falling,
        "friction_viscous": 0.2 * falling - 0.07,
        "friction_speed": brentq(lambda v: 0.2 / v * np.exp(-0.2 / v) - 0.07, 0.02, 0.1, xtol=1e-16),
    }
    around = {
        "friction_static": (0.31, 0.9),
        "friction_kinetic": (0.1, 0.5),
        "friction_viscous": (0.0, 0.5),
        "friction_speed": (0.02, 0.1),
    }
    for name, value in expected.items():
        (point,) = ss.critical_points(block(STRIBECK), {name: around[name]})
        assert (point.kind, point.cause) == ("hopf", "falling friction")
        assert point.value == pytest.approx(value, rel=1e-12)


def test_where_one_slides_by_a_law_and_another_sticks_there_are_no_modes():
    scene = ss.models.two_subsystems(friction=STRIBECK, slider_speed=0.2, preload_displacement=1e-3)
    with pytest.raises(ss.NoSteadyStateError, match="contact 0 sticks"):
        ss.complex_modes(scene, "s+")
    table = ss.status_table(scene, ["++", "s+", "ss"]).data
    assert np.isnan(table.frequency.sel(combination="s+")).all()
    assert np.isfinite(table.frequency.sel(combination="ss", pair=0))


def test_mode_coupling_is_told_apart():
    """Where friction rises with speed, only the coupling of modes is left to destabilise."""
    scene = ss.models.two_subsystems(friction=Linear(0.1, 1e-3), slider_speed=0.2, preload_displacement=1e-3)
    points = ss.critical_points(scene, {"friction_mu0": (0.1, 2.0)}, kinds=("hopf",))
    assert points
    assert {point.cause for point in points} == {"mode coupling"}
    assert "mode coupling" in repr(points[0])


def test_numbers_and_constant_laws_mean_the_same():
    np.testing.assert_array_equal(
        ss.complex_modes(block(Constant(0.4))).eigenvalues, ss.complex_modes(block(0.4)).eigenvalues
    )


def test_static_friction_is_the_law_at_rest_unless_given():
    assert block(STRIBECK).contacts[0].holding == 0.5
    with pytest.raises(ss.InputError, match="static_friction: must be >= friction"):
        block(STRIBECK).replace(static_friction=0.4)
    assert block(STRIBECK).replace(static_friction=0.6).contacts[0].holding == 0.6


def test_parameters_of_laws_have_names_everywhere():
    scene = ss.models.two_subsystems(friction=[STRIBECK, 0.4], slider_speed=0.2, preload_displacement=1e-3)
    changed = scene.replace(friction_static_0=0.7)
    assert [contact.friction for contact in changed.contacts] == [Stribeck(0.7, 0.3, 0.1), 0.4]
    assert scene.replace(friction_kinetic=0.2).contacts[0].friction.kinetic == 0.2
    with pytest.raises(ss.InputError, match="friction_static_1"):
        scene.replace(friction_static_1=0.7)
    swept = ss.sweep(scene, {"friction_speed_0": [0.05, 0.1]})
    assert swept.friction_speed_0.attrs["units"] == "m/s"
    single = ss.complex_modes(scene).with_conjugates.eigenvalues
    found = swept.eigenvalue.sel(friction_speed_0=0.1).values
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(single), rtol=1e-9)
    verdicts = ss.stability(scene, {"friction_static_0": [0.4, 0.5]})
    assert verdicts.growth_rate[1] == pytest.approx(single.real.max(), rel=1e-9)


@pytest.mark.parametrize("law", [Constant(0.3), *LAWS], ids=repr)
def test_files_keep_laws(law, tmp_path):
    for scene in (block(law), ss.models.two_subsystems(friction=[law, 0.3], slider_speed=0.2)):
        ss.save(scene, tmp_path / "scene.toml")
        read = ss.load(tmp_path / "scene.toml").scene
        assert [contact.friction for contact in read.contacts] == [c.friction for c in scene.contacts]


def test_tables_of_laws_stand_for_laws():
    table = {"law": "stribeck", "static": 0.5, "kinetic": 0.3, "speed": 0.1}
    assert block(table).contacts[0].friction == STRIBECK
    assert block(0.3).replace(friction=table).contacts[0].friction == STRIBECK


def test_tabulated_passes_through_its_values_monotonically():
    law = Tabulated([0.0, 0.05, 0.2, 0.6], [0.5, 0.35, 0.3, 0.3])
    assert [law.coefficient(v) for v in law.speeds] == pytest.approx(law.values, rel=1e-15)
    assert (np.diff([law.coefficient(v) for v in np.linspace(0.0, 1.0, 500)]) <= 1e-15).all()
    assert law.coefficient(5.0) == 0.3
    eigenvalue = ss.complex_modes(block(law, 2.0)).eigenvalues[0]
    assert eigenvalue.real == pytest.approx(-0.35, rel=1e-13)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: block(Stribeck(0.5, 0.3, 0.0)), "friction: speed: must be finite and > 0, got 0"),
        (lambda: block(Stribeck(-0.5, 0.3, 0.1)), "friction: must be >= 0, got -0.5"),
        (lambda: block(Rational(0.5, -0.3, 0.1)), "friction: kinetic: must be >= 0, got -0.3"),
        (lambda: block(Stribeck(0.5, 0.3, 0.1, np.nan)), "viscous"),
        (lambda: Tabulated([0.1, 0.2], [0.3, 0.4]), "speeds: must ascend from 0"),
        (lambda: Tabulated([0.0, 0.2], [0.3, -0.4]), "values: must be >= 0"),
        (lambda: block({"law": "stribek"}), "law: expected one of"),
        (lambda: block({"law": "linear", "mu0": 0.3}), "needs slope"),
        (lambda: block({"law": "linear", "mu0": 0.3, "slope": 0.1, "speed": 1.0}), "has no 'speed'"),
    ],
)
def test_ill_posed_laws_are_refused(make, message):
    with pytest.raises(ss.InputError, match=message):
        make()


@pytest.mark.parametrize("law", [STRIBECK, LAWS[-1]], ids=repr)
@pytest.mark.parametrize(
    "call",
    [
        lambda model: ss.sweep(model, {"friction": [0.1, 0.2]}),
        lambda model: ss.stability(model, {"friction": [0.1, 0.2]}),
        lambda model: ss.critical_points(model, {"friction": (0.1, 0.2)}, kinds=("hopf",)),
        lambda model: ss.sensitivity(model),
        lambda model: ss.sweep(model, {"friction_0": [0.1, 0.2]}),
    ],
    ids=["sweep", "stability", "hopf_points", "sensitivity", "one contact"],
)
def test_a_number_never_replaces_a_law_in_silence(law, call):
    scene = block(law)
    chain = functools.partial(ss.models.two_subsystems, friction=[law, 0.3], slider_speed=0.2)
    named = "friction_static" if law is STRIBECK else "no numbers"
    for model in (scene, chain, lambda preload=1.0: block(law)):
        with pytest.raises(ss.InputError, match=f"friction: .* law of contact 0, .*{named}"):
            call(model)
    with pytest.raises(ss.InputError, match="law of contact 0"):
        ss.Study(scene, {"friction": scipy.stats.uniform(0.1, 0.2)}, samples=2)


def test_a_law_and_the_number_of_a_contact_without_a_law_may_be_set():
    chain = functools.partial(ss.models.two_subsystems, friction=[STRIBECK, 0.3], slider_speed=0.2)
    assert np.isfinite(ss.stability(chain, {"friction_1": [0.1, 0.2]}).growth_rate).all()
    table = {"law": "stribeck", "static": 0.6, "kinetic": 0.3, "speed": 0.1}
    assert Family(block(STRIBECK)).replaced({"friction": table}).contacts[0].friction.static == 0.6


def test_the_cause_of_a_point_of_a_large_scene_needs_one_mode(monkeypatch):
    size = 130
    stiffness = 1e4 * (2.5 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1))
    law = ss.friction.Stribeck(static=0.5, kinetic=0.2, speed=0.3)
    contact = ss.Contact(tangential=size // 2, normal_force=100.0, friction=law, slider_speed=0.2)
    scene = ss.Scene(np.ones(size), stiffness, 1e-5 * stiffness, np.zeros(size), contacts=[contact])
    modes = ss.complex_modes(scene)
    leading = modes.eigenvalues[int(np.argmax(modes.eigenvalues.real))]
    point = critical.CriticalPoint(
        kind="hopf",
        parameter="slider_speed",
        value=0.2,
        complex_value=0.2 + 0.0j,
        eigenvalue=complex(leading),
        other=None,
        slope=1.0,
        direction=1,
    )
    computed = []

    def counted(*arguments, **options):
        found = ss.complex_modes(*arguments, **options)
        computed.append(len(found))
        return found

    monkeypatch.setattr(critical, "complex_modes", counted)
    (told,) = critical._with_causes([point], critical.Sliding(critical.Family(scene), None), {})
    assert told.cause == "falling friction"
    assert computed
    assert max(computed) <= 2
