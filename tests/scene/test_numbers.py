"""Every number of a scene is a parameter: coefficients of damping, factors on matrices, loads, laws, gaps."""

import dataclasses

import numpy as np
import pytest
from click.testing import CliRunner

import stickslip as ss
from stickslip.cli import main
from stickslip.explorer.knobs import knobs
from stickslip.scene.parameters.family import Family

MASS = np.array([[2.0, 0.1], [0.1, 1.0]])
STIFFNESS = np.array([[100.0, -40.0], [-40.0, 80.0]])
GYROSCOPIC = np.array([[0.0, 0.3], [-0.3, 0.0]])
CIRCULATORY = np.array([[0.0, 2.0], [-2.0, 0.0]])
CONTACT = ss.Contact(tangential="x", normal="y", friction=0.3, slider_speed=0.1, restitution=0.2, name="pad")
ARGUMENTS = {
    "mass": MASS,
    "stiffness": STIFFNESS,
    "damping": ss.Rayleigh(mass=0.02, stiffness=1e-3),
    "force": [1.0, -10.0],
    "contacts": [CONTACT],
    "dofs": ["x", "y"],
    "gyroscopic": GYROSCOPIC,
    "circulatory": CIRCULATORY,
    "loads": [ss.Harmonic({"x": 0.5}, frequency=2.0, name="shaker")],
}
SCENE = ss.Scene(**ARGUMENTS)


def other(**changes):
    return ss.Scene(**{**ARGUMENTS, **changes})


def contact(**changes):
    return other(contacts=[dataclasses.replace(CONTACT, **changes)])


#: Names with a value, their unit, and the scene at this value by other means.
NUMBERS = {
    "mass": (1.25, "1", other(mass=1.25 * MASS)),
    "stiffness": (1.25, "1", other(stiffness=1.25 * STIFFNESS)),
    "damping": (3.0, "1", other(damping=ss.Rayleigh(0.06, 3e-3))),
    "gyroscopic": (0.5, "1", other(gyroscopic=0.5 * GYROSCOPIC)),
    "circulatory": (-1.0, "1", other(circulatory=-CIRCULATORY)),
    "force": (2.0, "1", other(force=[2.0, -20.0])),
    "damping_mass": (0.5, "1/s", other(damping=ss.Rayleigh(0.5, 1e-3))),
    "damping_stiffness": (2e-3, "s", other(damping=ss.Rayleigh(0.02, 2e-3))),
    "friction": (0.4, "1", contact(friction=0.4)),
    "friction_pad": (0.4, "1", contact(friction=0.4)),
    "slider_speed": (0.2, "m/s", contact(slider_speed=0.2)),
    "restitution_0": (0.5, "1", contact(restitution=0.5)),
    "gap": (-0.01, "m", contact(gap=-0.01)),
    "shaker_amplitude": (0.6, "N", other(loads=[ss.Harmonic({"x": 0.6}, frequency=2.0, name="shaker")])),
    "shaker_frequency": (3.0, "Hz", other(loads=[ss.Harmonic({"x": 0.5}, frequency=3.0, name="shaker")])),
}
#: Of a function that is not called yet, the one may be that of a slider, the other the number of a formula.
NOT_KNOWN = ("shaker_amplitude", "friction_pad")


def own(speed=0.1):
    """A function of a user's own, without a keyword for most numbers."""
    return SCENE.replace(slider_speed=speed)


def parts(scene):
    """Everything that a scene is made of, as lists."""
    matrices = (scene.mass, scene.stiffness, scene.gyroscopic, scene.circulatory)
    return [m.toarray().tolist() if hasattr(m, "toarray") else m.tolist() for m in matrices] + [
        scene.damping,
        scene.force.tolist(),
        [vars(one) for one in scene.contacts],
        scene.loads,
    ]


@pytest.mark.parametrize("model", [SCENE, own], ids=["scene", "function"])
@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_of_a_scene_is_what_its_name_says(name, model):
    value, unit, expected = NUMBERS[name]
    assert parts(Family(model).scene({name: value})) == parts(expected)
    assert parts(ss.Case(model).replace(**{name: value}).scene) == parts(expected)
    if model is SCENE or name not in NOT_KNOWN:
        assert Family(model).units(name) == {"units": unit}


@pytest.mark.parametrize("model", [SCENE, own], ids=["scene", "function"])
@pytest.mark.parametrize("name", NUMBERS)
def test_every_question_about_stability_takes_every_number(name, model):
    value, unit, expected = NUMBERS[name]
    modes = ss.complex_modes(expected).with_conjugates
    near = value * (1.0 + 1e-3)
    swept = ss.sweep(model, {name: [value, near]})
    found = swept.eigenvalue.to_numpy()[0]
    assert max(np.abs(modes.eigenvalues - one).min() for one in found) <= 1e-11 * np.abs(found).max()
    assert swept.normal_force.to_numpy()[0] == pytest.approx(ss.steady_sliding(expected).normal_forces)
    verdict = ss.stability(model, {name: [value, near]})
    assert float(verdict.growth_rate[0]) == pytest.approx(modes.eigenvalues.real.max(), rel=1e-9, abs=1e-12)
    study = ss.Study(model, {name: [value, near]}, outputs=["growth_rate"]).run(progress=False)
    points = ss.critical_points(model, {name: sorted((value, near))}).to_dataset()
    for dataset in (swept, verdict, study, points):
        if model is SCENE or name not in NOT_KNOWN:
            assert dataset[name].attrs["units"] == unit
    assert float(study.growth_rate[0]) == pytest.approx(modes.eigenvalues.real.max(), rel=1e-9, abs=1e-12)
    slope = ss.sensitivity(model, {name: value}).derivative.to_numpy()[0]
    step = 1e-6 * abs(value)
    around = [
        ss.complex_modes(Family(model).scene({name: value + side * step})).eigenvalues for side in (-1, 1)
    ]
    size = np.abs(slope).max() or 1.0
    assert slope == pytest.approx((around[1] - around[0]) / (2.0 * step), abs=1e-5 * size + 1e-6)


def test_searches_for_motions_take_factors():
    rubbing = ss.Contact(tangential=0, friction=0.2, static_friction=0.5, slider_speed=0.2, normal_force=1.0)
    belt = ss.Scene([1.0], [[1.0]], damping=[[0.05]], contacts=[rubbing])
    start = ss.State([0.0], [0.2], "s")
    diagram = ss.bifurcation(belt, {"stiffness": [1.0, 4.0]}, start=start)
    harder = ss.Scene([1.0], [[4.0]], damping=[[0.05]], contacts=belt.contacts)
    expected = ss.simulate(harder, 60.0, start).limit_cycle()
    assert diagram.cycles[1].period == pytest.approx(expected.period, rel=1e-9)
    assert diagram.data.stiffness.units == "1"
    reached = ss.basins(belt, {"damping": [1.0, 2.0]}, start=start, velocity={"x1": [0.0]})
    assert reached.map.damping.units == "1"
    branch = ss.continuation(diagram.cycles[0], {"stiffness": (1.0, 1.05)}, at=[1.05])
    near = ss.Scene([1.0], [[1.05]], damping=[[0.05]], contacts=belt.contacts)
    assert branch.at(1.05)[0].period == pytest.approx(diagram.cycles[0].continued(near).period, rel=1e-9)
    assert branch.data.stiffness.units == "1"


def test_laws_of_friction_stay_beside_factors():
    law = ss.friction.Stribeck(0.5, 0.3, 0.1)
    scene = contact(friction=law)
    found = ss.sweep(scene, {"stiffness": [1.0, 1.25], "friction_kinetic": 0.35})
    expected = ss.complex_modes(
        other(
            stiffness=1.25 * STIFFNESS,
            contacts=[dataclasses.replace(CONTACT, friction=dataclasses.replace(law, kinetic=0.35))],
        )
    )
    assert np.sort_complex(found.eigenvalue.to_numpy()[1]) == pytest.approx(
        np.sort_complex(expected.with_conjugates.eigenvalues), rel=1e-9
    )


def test_factors_of_published_models_and_what_sets_the_same_number():
    model = ss.models.two_subsystems
    stiffer = Family(model).scene({"stiffness": 2.0}).stiffness.toarray()
    assert (stiffer == 2.0 * model().stiffness.toarray()).all()
    assert ss.sweep(model, {"damping": [1e-4, 2e-4]}).damping.units == "s"
    assert ss.sweep(model, {"damping_stiffness": [1e-4, 2e-4]}).damping_stiffness.units == "s"
    assert float(ss.stability(model, {"damping_mass": [3.0]}).growth_rate[0]) == pytest.approx(
        ss.complex_modes(model().replace(damping=ss.Rayleigh(3.0, 1e-4))).eigenvalues.real.max(), rel=1e-9
    )
    for source, names in ((SCENE, ("damping", "damping_mass")), (model, ("damping", "damping_stiffness"))):
        with pytest.raises(ss.InputError, match="set the same number"):
            ss.stability(source, {name: np.ones(1) for name in names})


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("damping_stiffness", "damping_stiffness: .* is a matrix.*vary 'damping'.*Rayleigh"),
        ("gyroscopic", "gyroscopic: .*is a factor, and the scene has no gyroscopic"),
        ("force", "force: .*is a factor, and the scene has no force"),
        ("stifness", "stifness: a scene has no such parameter; nearest: .*stiffness"),
    ],
)  # fmt: skip
def test_what_a_scene_does_not_have_is_refused_with_the_remedy(name, message):
    scene = ss.Scene(np.ones(2), STIFFNESS, damping=np.eye(2), contacts=[CONTACT], dofs=["x", "y"])
    with pytest.raises(ss.InputError, match=message):
        ss.sweep(scene, {name: [1.0, 2.0]})


def test_a_number_for_a_matrix_is_no_argument_of_a_scene():
    with pytest.raises(ss.InputError, match="damping: expected a matrix"):
        SCENE.replace(damping=1e-4)
    assert SCENE.replace(damping_stiffness=1e-4).damping == ss.Rayleigh(0.02, 1e-4)
    undamped = ss.Scene(np.ones(2), STIFFNESS)
    with pytest.raises(ss.InputError, match="the scene has no damping; vary damping_mass or"):
        ss.sweep(undamped, {"damping": [1.0, 2.0]})
    assert undamped.replace(damping_stiffness=1e-4).damping == ss.Rayleigh(0.0, 1e-4)


def test_every_number_has_a_slider_in_its_unit():
    known = knobs(Family(SCENE))
    single = {name for name in NUMBERS if name not in ("friction_pad", "restitution_0", "damping")}
    assert single <= set(known)
    for name in single:
        assert known[name].unit == ("" if NUMBERS[name][1] == "1" else NUMBERS[name][1])
        assert known[name].low < known[name].high
    # Coefficients stand for the factor on damping that is in proportion.
    assert "damping" not in known
    assert "damping" in knobs(Family(other(damping=np.eye(2))))


def test_the_command_line_takes_factors_and_coefficients(tmp_path):
    ss.save(SCENE, tmp_path / "scene.toml")
    words = [str(tmp_path / "scene.toml"), "--set", "stiffness=1.25", "--set", "damping_mass=0.5"]
    changed = other(stiffness=1.25 * STIFFNESS, damping=ss.Rayleigh(0.5, 1e-3))
    shown = CliRunner().invoke(main, ["modes", *words, "-o", str(tmp_path / "modes.nc")])
    assert shown.exit_code == 0, shown.output
    found = ss.load(tmp_path / "modes.nc").eigenvalue.to_numpy()
    assert found == pytest.approx(ss.complex_modes(changed).eigenvalues, rel=1e-12)
    swept = CliRunner().invoke(main, ["sweep", words[0], "--over", "damping_stiffness=0:1e-3:5"])
    assert swept.exit_code == 0, swept.output
    assert "over damping_stiffness: 5 stable" in swept.output


def test_a_parameter_may_be_named_as_a_result():
    pad = ss.Contact(tangential=0, friction=0.3, slider_speed=0.1, normal_force=2.0)
    joint = ss.Scene([1.0], [[100.0]], damping=[[0.1]], contacts=[pad])
    loads = {"normal_force": [1.0, 2.0]}
    for found in (ss.sweep(joint, loads), ss.stability(joint, loads)):
        assert found.normal_force.values.tolist() == [1.0, 2.0]
        assert found.computed_normal_force.values.ravel().tolist() == [1.0, 2.0]
        assert found.normal_force.units == found.computed_normal_force.units == "N"

    def model(frequency):
        return ss.Scene([1.0], [[(2.0 * np.pi * frequency) ** 2]], damping=[[1.0 - frequency]])

    points = ss.critical_points(model, {"frequency": (0.5, 1.5)}).to_dataset()
    assert points.frequency.values == pytest.approx([1.0])
    assert points.computed_frequency.values == pytest.approx([1.0])
    with pytest.raises(ss.InputError, match="outputs: 'normal_force' is the name of a parameter"):
        ss.Study(joint, loads, outputs=["normal_force"])
