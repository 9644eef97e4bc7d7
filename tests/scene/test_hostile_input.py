"""Whatever is wrong with the input, the error names the argument and the value; nothing panics."""

import numpy as np
import pytest
import scipy.sparse

import stickslip as ss

NAN, INF = float("nan"), float("inf")
DIAGONAL = np.diag([3e4, 5e4])


def contact(**changes):
    return ss.Contact(**{"tangential": 0, "normal": 1, "friction": 0.5, "slider_speed": 0.1, **changes})


def scene(**changes):
    arguments = {
        "mass": [1.0, 1.0],
        "stiffness": DIAGONAL,
        "damping": ss.Rayleigh(stiffness=1e-4),
        "force": [0.0, -20.0],
        "contacts": [contact()],
    }
    return ss.Scene(**{**arguments, **changes})


SCENES = [
    ({"mass": [1.0, NAN]}, "mass: must be finite, got NaN at index 1"),
    ({"mass": [1.0, INF]}, "mass: must be finite, got inf"),
    ({"mass": [1.0, -2.0]}, "mass: must be positive definite, got -2"),
    ({"mass": [[1.0, 2.0], [2.0, 1.0]]}, "mass: must be positive definite, got -3"),
    ({"mass": [[1.0, 0.5], [0.4, 1.0]]}, "mass: must be symmetric, got 0.5 at .*0.4"),
    ({"mass": [[1.0, 0.0]]}, r"mass: expected shape .n,. or .n, n., got \(1, 2\)"),
    (
        {"mass": [], "stiffness": np.zeros((0, 0)), "contacts": []},
        "mass: expected at least one dof, got none",
    ),
    ({"mass": 1.0}, "mass: expected a 1-dimensional or 2-dimensional array"),
    ({"mass": np.ones((2, 2, 2))}, r"mass: .* got shape \(2, 2, 2\)"),
    ({"mass": [1.0, True]}, r"mass: expected real numbers, got a truth value in \[1.0, True\]"),
    ({"stiffness": ([1.0, 0.0], [np.False_, 1.0])}, "stiffness: expected real numbers, got a truth value"),
    ({"mass": [1.0, 1j]}, "mass: expected real numbers, got .*complex"),
    ({"mass": ["a", "b"]}, "mass: expected real numbers, got .*'a'"),
    ({"mass": [1.0, None]}, "mass: expected real numbers, got .*None"),
    ({"mass": [True, True]}, "mass: expected real numbers, got .*bool"),
    ({"mass": [[1.0], [1.0, 2.0]]}, "mass: expected an array of numbers, got a ragged sequence"),
    ({"stiffness": np.eye(3)}, r"stiffness: expected shape \(2, 2\), got \(3, 3\)"),
    ({"stiffness": np.ones((2, 3))}, r"stiffness: expected a square matrix, got shape \(2, 3\)"),
    ({"stiffness": [1.0, 2.0]}, r"stiffness: expected a 2-dimensional array, got shape \(2,\)"),
    ({"stiffness": [[1.0, 2.0], [3.0, 4.0]]}, "stiffness: must be symmetric, got 2 at .*3"),
    ({"stiffness": [[1.0, NAN], [NAN, 4.0]]}, "stiffness: must be finite, got NaN"),
    ({"stiffness": scipy.sparse.eye_array(3)}, r"stiffness: expected shape \(2, 2\), got \(3, 3\)"),
    ({"stiffness": scipy.sparse.csr_array(np.ones((2, 3)))}, "stiffness: expected a square matrix"),
    ({"stiffness": scipy.sparse.csr_array([[1.0, 2.0], [3.0, 4.0]])}, "stiffness: must be symmetric"),
    ({"stiffness": scipy.sparse.csr_array([[1j, 0.0], [0.0, 1.0]])}, "stiffness: expected real numbers"),
    ({"stiffness": scipy.sparse.csr_array([[INF, 0.0], [0.0, 1.0]])}, "stiffness: must be finite, got inf"),
    ({"damping": [[1.0, 0.0], [5.0, 1.0]]}, "damping: must be symmetric"),
    ({"damping": np.eye(1)}, r"damping: expected shape \(2, 2\), got \(1, 1\)"),
    ({"damping": 1e-4}, "damping: expected a matrix, Rayleigh or None"),
    ({"force": [1.0]}, r"force: expected shape \(2,\), got \(1,\)"),
    ({"force": [0.0, NAN]}, "force: must be finite, got NaN"),
    ({"dofs": ["x"]}, "dofs: expected 2 names, got 1"),
    ({"dofs": ["x", "x"]}, "dofs: 'x' names more than one dof"),
    ({"dofs": ["x", 2]}, "dofs: expected names, got 2"),
    ({"impact_friction": "yes"}, "impact_friction: expected True or False, got 'yes'"),
    ({"contacts": contact()}, "contacts: expected a sequence of contacts, got a single Contact"),
    ({"contacts": [3]}, "contact 0: expected a Contact, got 3"),
]

CONTACTS = [
    ({"tangential": "x9"}, "contact 0: tangential: unknown dof 'x9'; known: x1, x2"),
    ({"tangential": "y"}, "contact 0: tangential: unknown dof 'y'; known: x1, x2"),
    ({"tangential": 2}, r"contact 0: tangential: dof index 2 is outside 0..1"),
    ({"normal": -1}, r"contact 0: normal: dof index -1 is outside 0..1"),
    ({"normal": True}, "contact 0: normal: expected a dof index, a dof name or a vector, got True"),
    ({"normal": [0.0, 1.0, 0.0]}, r"contact 0: normal: expected shape \(2,\), got \(3,\)"),
    ({"normal": [0.0, NAN]}, "contact 0: normal: must be finite, got NaN"),
    ({"normal": [0.0, 0.0]}, "contact 0: normal: must not be zero"),
    ({"normal": 0}, "contact 0: normal: must differ from the tangential direction, got a multiple of it"),
    ({"normal": [-2.0, 0.0]}, "contact 0: normal: must differ from the tangential direction"),
    (
        {"tangential": [0.3, 0.6], "normal": [-0.1, -0.2]},
        "contact 0: normal: must differ from the tangential",
    ),
    ({"tangential": [0.0, 0.0]}, "contact 0: tangential: must not be zero"),
    ({"normal": None}, "contact 0: normal_force: must be > 0 without a normal direction"),
    ({"friction": -0.3}, "contact 0: friction: must be >= 0, got -0.3"),
    ({"friction": NAN}, "contact 0: friction: must be finite, got NaN"),
    ({"friction": INF}, "contact 0: friction: must be finite, got inf"),
    ({"friction": 1j}, "contact 0: friction: expected a real number, got 1j"),
    ({"friction": "0.3"}, "contact 0: friction: expected a real number, got '0.3'"),
    ({"friction": None}, "friction: missing; only a"),
    ({"static_friction": 0.4}, "contact 0: static_friction: must be >= friction, got 0.4"),
    ({"slider_speed": NAN}, "contact 0: slider_speed: must be finite, got NaN"),
    ({"restitution": 1.1}, r"contact 0: restitution: must be in \[0, 1\], got 1.1"),
    ({"restitution": -0.1}, r"contact 0: restitution: must be in \[0, 1\], got -0.1"),
    ({"gap": INF}, "contact 0: gap: must be finite, got inf"),
]


@pytest.mark.parametrize(("changes", "message"), SCENES)
def test_scene(changes, message):
    with pytest.raises(ss.InputError, match=message):
        scene(**changes)


@pytest.mark.parametrize(("changes", "message"), CONTACTS)
def test_contact(changes, message):
    with pytest.raises(ss.InputError, match=message):
        scene(contacts=[contact(**changes)])


def test_errors_are_value_errors_of_one_family():
    with pytest.raises(ValueError, match="friction") as caught:
        scene(contacts=[contact(friction=-1.0)])
    assert isinstance(caught.value, ss.StickslipError)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fricton": 1.0}, "replace: unknown field 'fricton'; nearest: .*friction"),
        ({"friction": [0.1, 0.2]}, r"friction: expected a scalar or one value per contact \(1\), got 2"),
        ({"friction": -1.0}, "contact 0: friction: must be >= 0, got -1"),
        ({"force": [1.0]}, r"force: expected shape \(2,\)"),
        ({"contacts": [contact()], "friction": (1.0, 2.0)}, r"one value per contact \(1\), got 2"),
    ],
)
def test_replace(changes, message):
    with pytest.raises(ss.InputError, match=message):
        scene().replace(**changes)


@pytest.mark.parametrize(
    ("combination", "message"),
    [
        ("++", r"combination: expected one letter .* \(1 in all\), got \"\+\+\""),
        ("x", 'got "x"'),
        ("", 'got ""'),
        ("é", "got"),
    ],
)
def test_combination(combination, message):
    for ask in (ss.complex_modes, ss.equations_of):
        with pytest.raises(ss.InputError, match=message):
            ask(scene(), combination)
    with pytest.raises(ss.InputError, match=r"combination: expected one letter|got \"\""):
        ss.simulate(scene(), 0.1, ss.State([0.0, 0.0], [0.0, 0.0], combination))


def test_a_frictionless_contact_cannot_stick():
    with pytest.raises(ss.InputError, match="contact 0 has friction 0 and can't stick, got 's'"):
        ss.complex_modes(scene(contacts=[contact(friction=0.0)]), "s")


@pytest.mark.parametrize("duration", [0.0, -1.0, NAN, INF, "1", None, 1j])
def test_duration(duration):
    with pytest.raises(ss.InputError, match=r"duration: .* got"):
        ss.simulate(scene(), duration, ss.steady_sliding(scene()))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"method": "euler"}, "method: expected 'auto', 'modal', 'taylor' or 'local', got 'euler'"),
        ({"max_events": -1}, "max_events: expected an integer >= 0, got -1"),
        ({"max_events": 1.5}, "max_events: .* got 1.5"),
        ({"time_limit": 0.0}, "time_limit: .* got 0"),
        ({"accumulation_tolerance": -1.0}, "accumulation_tolerance: .* got -1"),
        ({"on_grazing": "ask"}, "on_grazing: expected 'keep' or 'stop', got 'ask'"),
    ],
)
def test_controls_of_a_run(changes, message):
    with pytest.raises(ss.InputError, match=message):
        ss.simulate(scene(), 0.1, ss.steady_sliding(scene()), **changes)


def test_scene_and_start_of_the_wrong_kind():
    start = ss.steady_sliding(scene())
    with pytest.raises(ss.InputError, match="scene: expected a Scene, got 1"):
        ss.simulate(1, 0.1, start)
    with pytest.raises(ss.InputError, match=r"start: expected a State or None, got \[0, 0\]"):
        ss.simulate(scene(), 0.1, [0, 0])


@pytest.mark.parametrize(
    ("position", "velocity", "combination", "message"),
    [
        (
            [0.0, -1e-6],
            [0.0, 0.0],
            "+",
            "position: contact 0 penetrates, gap -0.000001 m",
        ),
        ([0.0, 1e-6], [0.0, 0.0], "+", "position: contact 0 is '\\+' .*gap is 0.000001"),
        ([0.0, 0.0], [0.0, 1e-3], "+", "velocity: contact 0 is '\\+' .* is 0.001"),
        ([0.0, 0.0], [0.2, 0.0], "+", "velocity: contact 0 is '\\+' .*slip velocity is 0.1"),
        ([0.0, 0.0], [0.0, 0.0], "-", "velocity: contact 0 is '-' .*slip velocity is -0.1"),
        ([0.0, 0.0], [0.0, 0.0], "s", "velocity: contact 0 is 's' .*slip velocity is -0.1"),
        ([0.01, 0.0], [0.1, 0.0], "s", "contact 0 is 's' .*friction"),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "+", r"position: expected shape \(2,\), got \(3,\)"),
        ([0.0, NAN], [0.0, 0.0], "+", "position: must be finite, got nan at index 1"),
        ([0.0, 0.0], [INF, 0.0], "+", "velocity: must be finite, got inf"),
    ],
)
def test_start_state(position, velocity, combination, message):
    with pytest.raises(ss.InputError, match=message):
        ss.simulate(scene(), 0.1, ss.State(position, velocity, combination))


def test_a_start_state_whose_contact_pulls():
    pulled = scene(force=[0.0, 20.0])
    with pytest.raises(ss.InputError, match=r"contact 0 is '\+' .*normal force is -20"):
        ss.simulate(pulled, 0.1, ss.State([0.0, 0.0], [0.0, 0.0], "+"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0.0], [0.0, 0.0], "+"), r"velocity: expected shape \(1,\) like position, got \(2,\)"),
        (([[0.0]], [0.0], "+"), "position: expected a 1-dimensional array"),
        (([0.0], ["fast"], "+"), "velocity: expected real numbers"),
        (([0.0], [0.0], 3), "combination: expected a string such as .*, got 3"),
        (([0.0], [0.0], "+", ["a", "b"]), "dofs: expected 1 names, got 2"),
    ],
)
def test_state(arguments, message):
    with pytest.raises(ss.InputError, match=message):
        ss.State(*arguments)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"velocity": {"x3": 1.0}}, "velocity: unknown dof 'x3'; known: x1, x2"),
        ({"velocity": {7: 1.0}}, "velocity: dof index 7 is outside 0..1"),
        ({"position": {"x1": "far"}}, r"position\['x1'\]: expected a real number, got 'far'"),
        ({"position": [1.0]}, r"position: expected shape \(2,\), got \(1,\)"),
    ],
)
def test_perturbation(changes, message):
    with pytest.raises(ss.InputError, match=message):
        ss.State([0.0, 0.0], [0.0, 0.0], "+").perturbed(**changes)


def test_equilibrium_without_a_sliding_direction():
    with pytest.raises(ss.InputError, match="contact 0: slider_speed is 0"):
        ss.steady_sliding(scene(contacts=[contact(slider_speed=0.0)]))


def test_equilibrium_of_a_mass_that_nothing_holds():
    free = scene(stiffness=np.diag([0.0, 5e4]))
    with pytest.raises(ss.InputError, match=r"stiffness of combination .* is singular"):
        ss.steady_sliding(free)


@pytest.mark.parametrize("time", [-1e-9, 0.2, NAN, INF])
def test_times_outside_the_motion(time):
    run = ss.simulate(scene(), 0.1, ss.steady_sliding(scene()))
    with pytest.raises(ss.InputError, match=r"time: .* s lies outside the computed motion, 0 to 0.1 s"):
        run.state(time)
    for ask in (run.sample, run.modal_coordinates):
        with pytest.raises(ss.InputError, match=r"times: .* s lies outside the computed motion, 0 to 0.1 s"):
            ask([0.05, time])
    with pytest.raises(ss.InputError, match="times: expected real numbers"):
        run.sample(["soon"])
    with pytest.raises(ss.InputError, match="times: expected a 0-dimensional or 1-dimensional array"):
        run.sample([[0.0]])


SUBSYSTEM = {
    "upper_mass": 0.3,
    "contact_mass": 0.3,
    "inclination": 0.3,
    "vertical_stiffness": 4.5e5,
    "horizontal_stiffness": 3e5,
    "ceiling_stiffness": 6e4,
}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"subsystems": []}, "subsystems: expected at least one, got none"),
        ({"links": []}, "links: expected 1 between 2 subsystems, got 0"),
        ({"subsystems": [1, 2]}, r"subsystems\[0\]: expected a Subsystem, got 1"),
        ({"links": [1]}, r"links\[0\]: expected a Link, got 1"),
        ({"wall_stiffness": "stiff"}, "wall_stiffness: expected a real number, got 'stiff'"),
        ({"friction": [0.1]}, r"friction: expected a scalar or one value per contact \(2\), got 1: \[0.1\]"),
        ({"friction": -0.1}, "contact 0: friction: must be >= 0, got -0.1"),
        ({"damping": None}, "damping: expected a real number, got None"),
    ],
)
def test_chain(arguments, message):
    parts = [ss.models.Subsystem(**SUBSYSTEM)] * 2
    links = [ss.models.Link(horizontal_stiffness=1e6, vertical_stiffness=1e5)]
    given = {"subsystems": parts, "links": links, "wall_stiffness": 1e6, "friction": 0.1, "slider_speed": 0.1}
    with pytest.raises(ss.InputError, match=message):
        ss.models.chain(**{**given, **arguments})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"labels": "paper"}, "labels: expected 'matrix' or 'printed', got 'paper'"),
        ({"upper_mass": (0.3, -0.3)}, r"subsystems\[1\].upper_mass: must be positive, got -0.3"),
        ({"upper_mass": (0.3, 0.3, 0.3)}, r"upper_mass: .* \(2\), got 3"),
        ({"inclination": NAN}, r"subsystems\[0\].inclination: must be finite, got nan"),
        ({"contact_mass": "light"}, "contact_mass: expected a number, or one per contact, got 'light'"),
        ({"friction": (1.0, NAN)}, "contact 1: friction: must be finite, got NaN"),
        ({"wall_stiffness": NAN}, "stiffness: must be finite, got NaN"),
    ],
)
def test_two_subsystems(arguments, message):
    with pytest.raises(ss.InputError, match=message):
        ss.models.two_subsystems(**arguments)
