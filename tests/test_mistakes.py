"""Common mistakes are told in words that say what to do."""

import dataclasses

import numpy as np
import pytest

import stickslip as ss

SCENE = ss.models.two_subsystems()
START = ss.steady_sliding(SCENE)
MODEL = ss.models.two_subsystems


def small(**changes):
    parts = {
        "mass": [1.0, 1.0],
        "stiffness": 100.0 * np.eye(2),
        "contacts": [ss.Contact(tangential=0, normal=1, friction=0.5)],
    }
    return ss.Scene(**parts | changes)


@pytest.mark.parametrize(
    ("mistake", "message"),
    [
        # degrees for radians
        (lambda: MODEL(inclination=30), "inclination: expected radians, got 30; 30 degrees are 0.523599"),
        (lambda: MODEL(inclination=(17.2, 0.7)), "expected radians, got 17.2"),
        (lambda: ss.sweep(MODEL, {"inclination": [10.0, 20.0]}), "expected radians, got 10"),
        (lambda: ss.stability(MODEL, {"inclination": [0.1, -43.0]}), "expected radians, got -43"),
        (
            lambda: ss.Study(MODEL, {"inclination_1": [0.1, -43.0]}),
            "inclination_1: expected radians, got -43",
        ),
        # names
        (lambda: START.perturbed(velocity={"X1": 1e-3}), "velocity: unknown dof 'X1'; nearest: x1"),
        (lambda: ss.complex_modes(SCENE).orbit(0, ["x11"]), "unknown dof 'x11'; nearest: x1"),
        (
            lambda: small(contacts=[ss.Contact(tangential="y", normal=1, friction=0.5)]),
            "contact 0: tangential: unknown dof 'y'; known: x1, x2",
        ),
        (lambda: SCENE.replace(frction=1.0), "unknown field 'frction'; nearest: .*friction"),
        (lambda: ss.sweep(SCENE, {"friction_2": [1.0, 2.0]}), "friction_2: .*nearest: friction, friction_0"),
        (lambda: ss.sweep(MODEL, {"Friction": [1.0, 2.0]}), "Friction: .*nearest: friction"),
        (lambda: ss.bifurcation(SCENE, {"sliderspeed": [1.0]}), "nearest: slider_speed"),
        (lambda: ss.critical_points(SCENE, {"mu": (0.0, 3.0)}), "mu: a scene has no such parameter; known: "),
        # what is handed over
        (lambda: ss.complex_modes(MODEL), "scene: expected a Scene, got <function.*; call it"),
        (
            lambda: ss.steady_sliding(ss.Case(SCENE)),
            "expected a Scene, got Case of .*; its scene is .scene",
        ),
        (lambda: ss.simulate(START, 1.0, SCENE), "scene: expected a Scene, got Equilibrium"),
        (lambda: ss.simulate(SCENE, 1.0, np.zeros(8)), "start: expected a State"),
        (lambda: ss.complex_modes(SCENE, ["+", "+"]), "as one text, got"),
        (lambda: ss.equations_of(SCENE, "+"), "one letter of .* per contact"),
        (lambda: small(damping=1e-4), r"pass Rayleigh\(stiffness=beta\)"),
        (lambda: small(contacts=ss.Contact(tangential=0, normal=1, friction=0.5)), "got a single Contact"),
        (lambda: SCENE.replace(friction="1.5"), "friction: expected a number, or one per contact, got '1.5'"),
        (lambda: ss.sweep(SCENE, {"friction": 1.5}), "expected one or two parameters with arrays of values"),
        # shapes and numbers
        (lambda: small(stiffness=np.eye(3)), r"stiffness: expected shape \(2, 2\), got \(3, 3\)"),
        (lambda: small(force=[1.0, 2.0, 3.0]), r"force: expected shape \(2,\), got \(3,\)"),
        (lambda: small(stiffness=[[1.0, 2.0], [3.0, 4.0]]), "stiffness: must be symmetric"),
        (lambda: SCENE.replace(friction=-1), "contact 0: friction: must be >= 0, got -1"),
        (lambda: SCENE.replace(friction=[1.0, 2.0, 3.0]), r"one value per contact \(2\), got 3"),
        (lambda: ss.simulate(SCENE, "1 s", START), "duration: expected a real number, got '1 s'"),
        (lambda: ss.critical_points(SCENE, {"friction": (3.0, 0.0)}), "expected finite lower < upper"),
        (
            lambda: ss.simulate(SCENE, np.timedelta64(1, "s"), START),
            "duration: expected a real number, got np.timedelta64",
        ),
        (
            lambda: ss.steady_sliding(
                small(
                    stiffness=1e308 * np.eye(2),
                    force=[0.0, -1.0],
                    contacts=[ss.Contact(tangential=0, normal=1, friction=0.5, slider_speed=1.0)],
                )
            ),
            r"stiffness: its entries, 1e\+308 to 1e\+308 N/m, leave no finite equilibrium",
        ),
        (
            lambda: ss.fe.reduce(SCENE, band=(0.0, 1000.0), boundary="massless"),
            "without counterpart, and more modes no less; give a larger tolerance, or another boundary",
        ),
        # files and figures
        (lambda: ss.load(None), "path: expected the path of a file, got None"),
        (lambda: ss.save(ss.complex_modes(SCENE), 5), "path: expected the path of a file, got 5"),
        (lambda: ss.load(0).scene, "path: expected the path of a file, got 0"),
        (lambda: ss.save(SCENE, 5), "path: expected the path of a file, got 5"),
        (lambda: ss.write_report(SCENE, 5), "path: expected the path of a file, got 5"),
        (lambda: ss.write_report(5, "x.html"), "scene: expected a Scene, got 5"),
        (lambda: ss.plot(5), "data: expected the dataset of results of a study, .*, got 5"),
        (
            lambda: ss.simulate(SCENE, 1e-3, START).plot(["x1"]),
            "dof: expected the name or index of a dof, got \\['x1'\\]",
        ),
        (
            lambda: ss.complex_modes(SCENE).plot.orbits(0, ["x1", "x2"]),
            "masses: expected the two dofs of at least one mass by its name, got",
        ),
    ],
)
def test_message(mistake, message):
    with pytest.raises(ss.InputError, match=message) as caught:
        mistake()
    assert "\n" not in str(caught.value)


def test_a_full_turn_is_still_an_angle():
    turned = MODEL(inclination=2.0 * np.pi + 0.0)
    assert turned.size == 8


def test_misspelt_names_of_the_package_have_suggestions():
    with pytest.raises(AttributeError) as caught:
        ss.simualte  # noqa: B018
    # What the interpreter makes its suggestion from.
    assert caught.value.name == "simualte"
    assert caught.value.obj is ss
    assert "simulate" in dir(ss)


def test_titles_of_many_contacts_are_short():
    count = 2000
    contacts = [ss.Contact(tangential=0, normal=1, friction=0.1, slider_speed=1.0, gap=1.0)] * count
    scene = small(contacts=contacts)
    equilibrium = ss.steady_sliding(scene)
    assert equilibrium.combination == count * "d"
    assert repr(equilibrium).startswith(f"Equilibrium('{24 * 'd'}… (2000 contacts)', 2 dofs, 0 contacts")
    modes = ss.complex_modes(scene, equilibrium.combination)
    assert modes.summary().tables[0].caption == f"Modes of {24 * 'd'}… (2000 contacts)"
    assert modes.plot().get_title() == f"Modes of {24 * 'd'}… (2000 contacts)"
    assert "-0.0000" not in str(dataclasses.replace(modes, missing=-1e-6).summary())
