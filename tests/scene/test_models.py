import inspect
import pickle
import re
import tomllib
from functools import partial

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stickslip as ss
from stickslip.cli.verbs.init import EXPLAINED, LISTED, save_model
from stickslip.scene.models import MODELS as MODELS_BY_NAME
from stickslip.scene.parameters.family import Family


def test_two_subsystems_is_the_model_of_the_reference_solution(standard):
    scene = ss.models.two_subsystems(friction=1.5, slider_speed=0.025, preload_displacement=1e-3)
    given_stiffness = standard.scene.stiffness
    # Entries are sums of at most five products of three rounded factors.
    rounding = 8 * np.finfo(float).eps * np.abs(given_stiffness).max()
    assert np.abs(scene.stiffness.toarray() - given_stiffness).max() <= rounding
    assert scene.mass.tolist() == standard.scene.mass.tolist()
    assert scene.force == pytest.approx(standard.scene.force, rel=1e-15)
    assert scene.damping == standard.scene.damping


def springs(parts, links, wall):
    """(stiffness, elongation) of every spring of a chain, as the design's table lists them."""
    size = 4 * len(parts)
    for i, part in enumerate(parts):
        x = np.eye(size)[4 * i : 4 * i + 4]
        a, b = np.cos(part.inclination), np.sin(part.inclination)
        horizontal, vertical = a * x[2] - b * x[3], b * x[2] + a * x[3]
        if i == 0:
            yield wall, x[0]
        yield part.ceiling_stiffness, x[1]
        yield part.vertical_stiffness, x[1] - vertical
        yield part.horizontal_stiffness, x[0] - horizontal
        if i + 1 < len(parts):
            following = np.eye(size)[4 * i + 4 : 4 * i + 8]
            yield links[i].horizontal_stiffness, x[0] - following[0]
            yield links[i].vertical_stiffness, x[1] - following[1]


@given(st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_the_stiffness_of_a_chain_is_that_of_its_springs(count, seed):
    rng = np.random.default_rng(seed)
    draw = rng.uniform
    parts = [
        ss.models.Subsystem(
            upper_mass=draw(0.1, 1.0),
            contact_mass=draw(0.1, 1.0),
            inclination=draw(-1.5, 1.5),
            vertical_stiffness=draw(1e4, 1e6),
            horizontal_stiffness=draw(1e4, 1e6),
            ceiling_stiffness=draw(1e4, 1e6),
            preload_displacement=draw(0.0, 1e-3),
            external_force=draw(-10.0, 10.0),
        )
        for _ in range(count)
    ]
    links = [
        ss.models.Link(horizontal_stiffness=draw(1e4, 1e6), vertical_stiffness=draw(1e4, 1e6))
        for _ in range(count - 1)
    ]
    scene = ss.models.chain(parts, links, wall_stiffness=2e6, friction=0.5, slider_speed=0.1)
    expected = sum(k * np.outer(e, e) for k, e in springs(parts, links, 2e6))
    assert scene.stiffness.toarray() == pytest.approx(expected, rel=0, abs=1e-15 * 8 * np.abs(expected).max())
    assert scene.mass.tolist() == [m for p in parts for m in [p.upper_mass] * 2 + [p.contact_mass] * 2]
    pressed = [-p.ceiling_stiffness * p.preload_displacement - p.external_force for p in parts]
    assert scene.force[1::4] == pytest.approx(pressed, rel=1e-14)
    assert np.count_nonzero(np.delete(scene.force, np.arange(1, 4 * count, 4))) == 0
    assert [(c.tangential, c.normal) for c in scene.contacts] == [
        (4 * i + 2, 4 * i + 3) for i in range(count)
    ]


def test_every_parameter_of_two_subsystems_has_a_name_and_one_value_per_contact():
    scene = ss.models.two_subsystems(
        friction=(0.5, 0.6),
        slider_speed=(0.1, 0.2),
        static_friction=(0.7, 0.8),
        restitution=(0.1, 0.2),
        preload_displacement=(1e-3, 2e-3),
        external_force=(3.0, 4.0),
        damping=2e-5,
        upper_mass=(0.1, 0.2),
        contact_mass=(0.3, 0.4),
        inclination=(0.5, 0.6),
        wall_stiffness=1e6,
        horizontal_stiffness=(2e6, 3e6),
        vertical_stiffness=(4e6, 5e6),
        ceiling_stiffness=(6e6, 7e6),
        link_horizontal_stiffness=8e6,
        link_vertical_stiffness=9e6,
        impact_friction=True,
    )
    assert scene.mass.tolist() == [0.1, 0.1, 0.3, 0.3, 0.2, 0.2, 0.4, 0.4]
    assert scene.force[[1, 5]] == pytest.approx([-6003.0, -14004.0], rel=1e-15)
    assert scene.damping == ss.Rayleigh(stiffness=2e-5)
    assert scene.impact_friction
    assert [(c.friction, c.slider_speed, c.static_friction, c.restitution) for c in scene.contacts] == [
        (0.5, 0.1, 0.7, 0.1),
        (0.6, 0.2, 0.8, 0.2),
    ]
    k = scene.stiffness.toarray()
    assert [k[0, 0], k[1, 1]] == pytest.approx([1e6 + 2e6 + 8e6, 4e6 + 6e6 + 9e6], rel=1e-15)
    assert [k[4, 4], k[5, 5]] == pytest.approx([3e6 + 8e6, 5e6 + 7e6 + 9e6], rel=1e-15)


def test_labels_as_printed_give_other_frequencies():
    frequencies = ss.complex_modes(ss.models.two_subsystems(friction=0.0, labels="printed")).frequencies
    assert np.abs(frequencies[:2] - [44.58, 122.60]).max() < 0.01  # one unit of the last printed digit


def test_a_preload_displacement_acts_as_the_force_of_its_spring():
    by_displacement = ss.models.two_subsystems(preload_displacement=(1e-3, 2e-3))
    by_force = ss.models.two_subsystems(preload_displacement=0.0, external_force=(60.0, 360.0))
    assert by_displacement.force == pytest.approx(by_force.force, rel=1e-15)


#: Models that need no arguments.
MODELS = {name: model for name, model in MODELS_BY_NAME.items() if name != "chain"}


def matrices(scene, folder):
    """Return all numbers of a scene as text."""
    ss.save(scene, folder / "matrices.toml", matrices="inline")
    return (folder / "matrices.toml").read_text()


@pytest.mark.parametrize("name", list(MODELS))
def test_a_model_goes_by_its_name_through_files(name, tmp_path):
    path = tmp_path / "scene.toml"
    scene = pickle.loads(pickle.dumps(MODELS[name]()))
    ss.save(scene, path)
    assert tomllib.loads(path.read_text())["model"] == {"name": name}
    again = ss.load(path).scene
    assert matrices(again, tmp_path) == matrices(scene, tmp_path)
    assert again.model.func is getattr(ss.models, name)
    # A changed number goes into the file by its name.
    number = next(key for key, value in Family(MODELS[name]).numbers().items() if value)
    changed = (
        MODELS[name] if name == "two_subsystems" else partial(MODELS[name], **{number: doubled(name, number)})
    )
    ss.save(changed(), path)
    assert matrices(ss.load(path).scene, tmp_path) == matrices(changed(), tmp_path)
    assert "model" in tomllib.loads(path.read_text())


def doubled(name, number):
    """Return twice the default of an argument."""
    return 2 * inspect.signature(MODELS[name]).parameters[number].default


@pytest.mark.parametrize("name", LISTED)
def test_a_model_is_written_with_all_of_its_numbers(name, tmp_path):
    path = tmp_path / "scene.toml"
    save_model(name, path)
    assert matrices(ss.load(path).scene, tmp_path) == matrices(MODELS[name](), tmp_path)
    written = set(tomllib.loads(path.read_text())["model"]) - {"name"}
    assert written == {
        key for key, one in inspect.signature(MODELS[name]).parameters.items() if one.default is not None
    }


def test_every_model_is_public_and_can_be_written():
    assert sorted([*MODELS_BY_NAME, "Link", "Subsystem"]) == ss.models.__all__
    assert {*EXPLAINED, *LISTED} - {"oscillator"} == set(MODELS)


def test_models_draw_themselves():
    for name, model in MODELS.items():
        assert model().plot().lines or model().plot().patches, name
    plt.close("all")


def test_a_changed_scene_of_a_model_is_saved_by_its_matrices(tmp_path):
    """The force that holds the mass of the minimal model depends on its friction."""
    path = tmp_path / "scene.toml"
    scene = ss.models.hoffmann(friction=0.5).replace(friction=0.6)
    ss.save(scene, path)
    assert "scene" in tomllib.loads(path.read_text())
    assert matrices(ss.load(path).scene, tmp_path) == matrices(scene, tmp_path)


def test_the_minimal_model_slides_at_zero_and_moves_by_its_equation():
    rng = np.random.default_rng(2002)
    friction, damping, cubic, preload = 0.6, (0.1, 0.3), 0.7, 40.0
    scene = ss.models.hoffmann(
        friction=friction, damping=damping, cubic=cubic, preload=preload, slider_speed=-1e3
    )
    steady = ss.steady_sliding(scene)
    assert np.abs(steady.position).max() <= 1e-15 * preload
    x, y, u, v = rng.uniform(-1.0, 1.0, 4)
    step = 1e-4
    run = ss.simulate(scene, 2 * step, ss.State([x, y, 0.0], [u, v, 0.0], "-"))
    before, _, after = run.sample([0.0, step, 2 * step]).velocity.to_numpy()[:, :2]
    middle = run.state(step)
    x, y, u, v = *middle.position[:2], *middle.velocity[:2]
    spring = 4.0 / 3.0 * y + cubic * y**3
    expected = [
        -damping[0] * u - 2.0 * x - y + friction * spring,
        -damping[1] * v - x - 2.0 / 3.0 * y - spring,
    ]
    # A central difference leaves step^2 / 6 times the third derivative, which stays below 100.
    assert (after - before) / (2 * step) == pytest.approx(expected, abs=100.0 * step**2 / 6.0)


def test_the_cubic_law_has_its_least_friction_where_it_is_told():
    scene = ss.models.thomsen_fidlin(static=0.4, least=0.25, speed=0.5)
    law = scene.contacts[0].friction
    assert [law.coefficient(s) for s in (0.0, 0.5)] == pytest.approx([0.4, 0.25], rel=1e-15)
    assert law.coefficient(0.5 - 1e-4) == pytest.approx(law.coefficient(0.5 + 1e-4), abs=1e-11)
    (hopf,) = ss.critical_points(ss.models.thomsen_fidlin, {"slider_speed": (0.2, 0.49)}, kinds=("hopf",))
    assert hopf.value == pytest.approx(0.5 * np.sqrt(1.0 - 4.0 * 0.05 * 0.5 / (3.0 * 0.15)), rel=1e-12)
    assert hopf.criticality == "supercritical"


def test_waves_of_the_rotating_disc_travel_with_the_sum_and_the_difference():
    scene = ss.models.rotating_disc(frequency=100.0, diameters=3, speed=7.0, damping=0.0)
    rates = np.sort(ss.complex_modes(scene).eigenvalues.imag)
    assert rates == pytest.approx(2.0 * np.pi * 100.0 + np.array([-21.0, 21.0]), rel=1e-13)


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("mass_on_belt", {"mass": -1.0}, "mass: must be positive, got -1"),
        ("mass_on_belt", {"stiffness": "stiff"}, "stiffness: expected a real number, got 'stiff'"),
        ("mass_on_belt", {"friction": -0.1}, "friction: must be >= 0, got -0.1"),
        ("mass_on_belt_in_plane", {"damping": [1.0, 2.0, 3.0]}, "damping: expected a number or two, got 3"),
        (
            "mass_on_belt_in_plane",
            {"slider_speed": "fast"},
            "slider_speed: expected a real number, got 'fast'",
        ),
        ("thomsen_fidlin", {"least": -1.0}, "least: must be >= 0, got -1"),
        ("bistable_oscillator", {"static_ratio": 0.5}, "static_ratio: must be >= 1, got 0.5"),
        ("den_hartog", {"frequency_ratio": 0.0}, "frequency_ratio: must be positive, got 0"),
        ("lugre_slider", {"pull_speed": np.nan}, "pull_speed: must be finite, got nan"),
        (
            "spring_slider",
            {"normal_force": 0.0},
            "normal_force: must be > 0 without a normal direction, got 0",
        ),
        ("hoffmann", {"preload": 0.0}, "preload: must be positive, got 0"),
        ("rotating_disc", {"frequency": -3.0}, "frequency: must be positive, got -3"),
        ("burridge_knopoff", {"blocks": 0}, "blocks: expected an integer >= 1, got 0"),
        ("burridge_knopoff", {"damping": -1.0}, "damping: must be >= 0, got -1"),
        ("bowed_string", {"bow_place": 1.2}, "bow_place: must be between 0 and 1, got 1.2"),
    ],
)
def test_a_wrong_number_of_a_model_is_named(name, given, message):
    with pytest.raises(ss.InputError, match=re.escape(message)):
        MODELS[name](**given)
