"""One grammar of parameter names in every call that takes parameters."""

import inspect
from functools import partial

import numpy as np
import pytest

import stickslip as ss

MODEL = ss.models.two_subsystems
SCENE = MODEL()
NAMED = SCENE.replace(
    contacts=[
        ss.Contact(tangential="x3", normal="x4", friction=1.5, slider_speed=0.025, name="left"),
        ss.Contact(tangential="x7", normal="x8", friction=1.5, slider_speed=0.025, name="right"),
    ]
)
SUBSYSTEMS = [
    ss.models.Subsystem(
        upper_mass=mass,
        contact_mass=mass,
        inclination=angle,
        vertical_stiffness=vertical,
        horizontal_stiffness=horizontal,
        ceiling_stiffness=ceiling,
        preload_displacement=1e-3,
    )
    for mass, angle, vertical, horizontal, ceiling in (
        (0.3, 0.3, 4.5e5, 3.0e5, 6.0e4),
        (0.7, 0.75, 3.0e4, 2.4e6, 1.8e5),
    )
]
CHAIN = partial(
    ss.models.chain,
    subsystems=SUBSYSTEMS,
    links=[ss.models.Link(horizontal_stiffness=1.5e6, vertical_stiffness=2.4e5)],
    wall_stiffness=1.8e6,
    friction=1.5,
    slider_speed=0.025,
)


def own(vertical_stiffness=(4.5e5, 3.0e4), friction=1.5):
    """A function of a user's own, with an array keyword and a number."""
    return MODEL(vertical_stiffness=vertical_stiffness, friction=friction)


def named(friction=1.5):
    return NAMED.replace(friction=friction)


#: Model, name of a parameter, two values of it, and the scene at the first by other means.
CASES = {
    "scene, all": (SCENE, "friction", (1.5, 1.52), MODEL()),
    "scene, one": (SCENE, "friction_0", (1.4, 1.42), MODEL(friction=[1.4, 1.5])),
    "scene, by name": (NAMED, "friction_left", (1.4, 1.42), MODEL(friction=[1.4, 1.5])),
    "scene, named, by index": (NAMED, "friction_1", (1.4, 1.42), MODEL(friction=[1.5, 1.4])),
    "model, all": (MODEL, "friction", (1.5, 1.52), MODEL()),
    "model, one": (MODEL, "friction_0", (1.4, 1.42), MODEL(friction=[1.4, 1.5])),
    "model, entry": (MODEL, "vertical_stiffness_1", (3.1e4, 3.2e4), MODEL(vertical_stiffness=[4.5e5, 3.1e4])),
    "model, keyword": (MODEL, "wall_stiffness", (1.81e6, 1.82e6), MODEL(wall_stiffness=1.81e6)),
    "partial, entry": (
        partial(MODEL, vertical_stiffness=[4.4e5, 3e4]),
        "vertical_stiffness_1",
        (3.1e4, 3.2e4),
        MODEL(vertical_stiffness=[4.4e5, 3.1e4]),
    ),
    "chain, entry": (CHAIN, "vertical_stiffness_1", (3.1e4, 3.2e4), MODEL(vertical_stiffness=[4.5e5, 3.1e4])),
    "chain, link": (CHAIN, "link_vertical_stiffness_0", (2.5e5, 2.6e5), MODEL(link_vertical_stiffness=2.5e5)),
    "chain, one": (CHAIN, "friction_1", (1.4, 1.42), MODEL(friction=[1.5, 1.4])),
    "own, keyword": (own, "friction", (1.4, 1.42), MODEL(friction=1.4)),
    "own, entry": (own, "vertical_stiffness_1", (3.1e4, 3.2e4), MODEL(vertical_stiffness=[4.5e5, 3.1e4])),
    "own, contact": (own, "friction_0", (1.4, 1.42), MODEL(friction=[1.4, 1.5])),
    "own, contact by name": (named, "friction_right", (1.4, 1.42), MODEL(friction=[1.5, 1.4])),
    "own, law that is no keyword": (own, "slider_speed_1", (0.03, 0.031), MODEL(slider_speed=[0.025, 0.03])),
}


def eigenvalues(scene):
    return ss.complex_modes(scene).with_conjugates.eigenvalues


def swept(model, over):
    return ss.sweep(model, over).eigenvalue.to_numpy()[0]


def least_stable(model, over):
    return ss.stability(model, over).eigenvalue.to_numpy()[:1]


def derived(model, over):
    ((name, values),) = over.items()
    upper = ss.sensitivity(model, {name: values[0]}).eigenvalue.to_numpy()
    return np.concatenate([upper, upper.conj()])


def saved(model, over):
    ((name, values),) = over.items()
    return eigenvalues(ss.Case(model).replace(**{name: values[0]}).scene)


def studied(model, over):
    found = ss.Study(model, over, outputs=["eigenvalues"]).run(progress=False)
    return found.eigenvalues.to_numpy()[0]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("call", [swept, least_stable, derived, saved, studied])
def test_a_name_stands_for_the_same_number_in_every_question_about_stability(call, case):
    model, name, values, scene = CASES[case]
    found = call(model, {name: np.array(values)})
    expected = eigenvalues(scene)
    # Pairs in any order; eigenvalues of these scenes have condition numbers of some tens.
    for value in found:
        assert np.abs(expected - value).min() <= 1e-9 * np.abs(value)
    assert call is least_stable or found.size == expected.size


@pytest.fixture(scope="module")
def cycle():
    start = ss.steady_sliding(SCENE).perturbed(velocity={"x1": 1e-3})
    return ss.simulate(SCENE, 0.6, start).limit_cycle()


#: The cycle of the standard run is near that of every one of these scenes.
NEAR = {
    "friction": (1.5, 1.51),
    "friction_0": (1.5, 1.51),
    "vertical_stiffness_1": (3.0e4, 3.01e4),
    "slider_speed": (0.025, 0.0252),
}


@pytest.mark.parametrize("name", NEAR)
def test_a_name_stands_for_the_same_number_in_searches_for_cycles(cycle, name):
    model = SCENE if name in ("friction", "friction_0", "slider_speed") else MODEL
    values = np.array(NEAR[name])
    traced = ss.continuation(cycle, {name: values}, model, step=0.5)
    scene = ss.Case(MODEL).replace(**{name: values[1]}).scene
    settled = ss.bifurcation(
        model, {name: values[1:]}, start=ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    )
    reached = ss.basins(
        model,
        {name: values[1:]},
        start=lambda made: ss.steady_sliding(made),
        velocity={"x1": [1e-3]},
    )
    expected = cycle.continued(scene).period
    for found in (
        traced.data.period.to_numpy()[-1],
        settled.data.period.to_numpy()[-1],
        reached.attractors[0].period,
    ):
        assert found == pytest.approx(expected, rel=1e-9)
    # The last point lies at the end of the range, another within it.
    assert traced.data[name][-1] == values[1]
    last = float(traced.data[name][-2])
    assert values[0] <= last < values[1]
    place = ss.Case(MODEL).replace(**{name: last}).scene
    assert float(traced.data.period[-2]) == pytest.approx(cycle.continued(place).period, rel=1e-9)
    assert traced.points == ()


def test_critical_points_are_those_of_the_same_number_by_any_name():
    expected = [point.value for point in ss.critical_points(MODEL, {"friction": (0.0, 3.0)})]
    for model in (SCENE, own):
        found = ss.critical_points(model, {"friction": (0.0, 3.0)})
        assert [point.value for point in found] == pytest.approx(expected, rel=1e-9)
    one = [point.value for point in ss.critical_points(SCENE, {"friction_0": (0.0, 3.0)}, kinds=("hopf",))]
    for model, name in (
        (MODEL, "friction_0"),
        (own, "friction_0"),
        (NAMED, "friction_left"),
        (CHAIN, "friction_0"),
    ):
        found = [point.value for point in ss.critical_points(model, {name: (0.0, 3.0)}, kinds=("hopf",))]
        assert found == pytest.approx(one, rel=1e-9)


def test_starts_of_a_map_are_steady_sliding_with_amounts_or_disturbed_sliding():
    amounts = {"velocity": {"x1": [1e-3]}}
    found, said = (
        ss.basins(SCENE, {"friction": [0.5, 1.5]}, **amounts, **start)
        for start in ({}, {"start": ss.steady_sliding})
    )
    assert found.map.identical(said.map)
    disturbed = ss.basins(SCENE, {"friction": [1.5], "stiffness": [1.0]})
    assert disturbed.map.dims == ("friction", "stiffness")
    assert isinstance(disturbed.attractors[0], ss.Cycle)


def test_two_axes_of_parameters_and_starts_are_one_map():
    found = ss.basins(SCENE, {"friction": [0.5, 1.5]}, start=ss.steady_sliding, velocity={"x1": [1e-3]})
    assert found.map.dims == ("velocity_x1", "friction")
    assert found.attractors[0] == "equilibrium"
    assert isinstance(found.attractors[1], ss.Cycle)


#: Calls that take parameters, with values of one.
CALLS = {
    ss.sweep: np.array([1.5, 1.52]),
    ss.critical_points: (1.4, 1.6),
    ss.stability_boundary: (1.4, 1.6),
    ss.stability: np.array([1.5, 1.52]),
    ss.sensitivity: 1.5,
    ss.bifurcation: np.array([1.5]),
    ss.continuation: (1.5, 1.51),
    ss.basins: np.array([1.5, 1.52]),
}
#: Those that begin at a cycle.
OF_CYCLES = (ss.continuation,)


def called(call, model, cycle, parameters):
    if call in OF_CYCLES:
        return call(cycle, parameters, model)
    return call(model, parameters, **({"velocity": {"x1": [1e-3]}} if call is ss.basins else {}))


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
def test_parameters_are_the_second_argument_of_every_call(call):
    assert list(inspect.signature(call).parameters)[1] == "parameters"
    kinds = {one.kind for one in inspect.signature(call).parameters.values()}
    assert inspect.Parameter.VAR_KEYWORD not in kinds


def test_a_parameter_may_be_named_as_an_option():
    def model(friction=1.5, progress=1.0):
        return MODEL(friction=friction * progress)

    found = ss.sweep(model, {"friction": [1.0, 1.2], "progress": 1.1}, progress=False)
    expected = ss.sweep(MODEL, {"friction": [1.1, 1.32]})
    assert found.eigenvalue.to_numpy() == pytest.approx(expected.eigenvalue.to_numpy(), rel=1e-9)


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ("friction", "parameters: expected (a sequence of names, or )?values by name"),
        ({"fricton": 1.0}, "fricton: a scene has no such parameter; nearest: friction"),
        ({"friction_2": 1.0}, "friction_2: a scene has no such parameter; nearest: friction, friction_0"),
        ({"friction": 1.0, "friction_0": 1.0}, "'friction_0' and 'friction' set the same number"),
    ],
)
def test_wrong_names_are_refused_by_every_call(call, parameters, message, cycle):
    with pytest.raises(ss.InputError, match=message):
        called(call, SCENE, cycle, parameters)
