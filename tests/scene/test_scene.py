import pickle

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given

import stickslip as ss
from random_scenes import drawn_scenes


def test_a_scene_keeps_what_it_was_given_read_only():
    mass = np.array([1.0, 2.0])
    scene = ss.Scene(mass, np.diag([3.0, 4.0]), force=[5.0, 6.0])
    mass[0] = 99.0
    assert scene.mass.tolist() == [1.0, 2.0]
    for array in (scene.mass, scene.stiffness, scene.force):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 7.0
    with pytest.raises(AttributeError, match="mass"):
        scene.mass = np.ones(2)


def test_defaults_are_no_force_no_damping_and_numbered_names():
    scene = ss.Scene([1.0, 2.0], np.eye(2))
    assert scene.force.tolist() == [0.0, 0.0]
    assert scene.damping is None
    assert scene.dofs == ("x1", "x2")
    assert scene.contacts == ()
    assert ss.complex_modes(scene, "").damping_ratios == pytest.approx(0.0, abs=1e-15)


def test_replace_takes_a_scalar_or_one_value_per_contact():
    scene = ss.models.two_subsystems(friction=1.5)
    assert [c.friction for c in scene.replace(friction=2.2).contacts] == [2.2, 2.2]
    assert [c.friction for c in scene.replace(friction=[0.1, 0.2]).contacts] == [0.1, 0.2]
    changed = scene.replace(slider_speed=(0.1, -0.1), restitution=0.5, static_friction=3.0, gap=1e-4)
    assert [c.slider_speed for c in changed.contacts] == [0.1, -0.1]
    assert [(c.restitution, c.static_friction, c.gap) for c in changed.contacts] == [(0.5, 3.0, 1e-4)] * 2
    assert [c.friction for c in scene.contacts] == [1.5, 1.5]


def test_static_friction_follows_friction_unless_given():
    scene = ss.models.two_subsystems(friction=1.5)
    assert scene.replace(friction=2.2).contacts[0].static_friction is None
    with pytest.raises(ss.InputError, match=r"contact 0: static_friction: must be >= friction, got 2$"):
        scene.replace(friction=2.2, static_friction=2.0)


def test_a_replaced_scene_computes_like_one_built_so():
    replaced = ss.models.two_subsystems(friction=0.3).replace(friction=2.2)
    built = ss.models.two_subsystems(friction=2.2)
    for combination in ("++", "+d", "s-"):
        assert np.array_equal(
            ss.complex_modes(replaced, combination).eigenvalues,
            ss.complex_modes(built, combination).eigenvalues,
        )


def test_replace_takes_scene_arguments_too():
    scene = ss.models.two_subsystems()
    heavy = scene.replace(mass=2.0 * scene.mass, damping=None)
    # Without damping lambda = i omega, and omega goes with the inverse root of mass.
    light = scene.replace(damping=None)
    ratio = ss.complex_modes(heavy).frequencies / ss.complex_modes(light).frequencies
    assert ratio == pytest.approx(np.sqrt(0.5), rel=1e-12)
    assert scene.replace(impact_friction=True).impact_friction
    assert scene.replace(dofs=list("abcdefgh")).dofs == tuple("abcdefgh")
    assert len(scene.replace(contacts=scene.contacts[:1]).contacts) == 1


def test_sparse_and_dense_matrices_are_the_same_scene():
    dense = ss.models.two_subsystems()
    matrix = dense.stiffness.toarray()
    for form in (scipy.sparse.csr_array, scipy.sparse.csc_matrix, scipy.sparse.coo_array):
        sparse = ss.Scene(dense.mass, form(matrix), form(1e-4 * matrix), dense.force, dense.contacts)
        full = ss.Scene(dense.mass, matrix, 1e-4 * matrix, dense.force, dense.contacts)
        assert np.array_equal(ss.equations_of(sparse, "+s").stiffness, ss.equations_of(full, "+s").stiffness)
        assert np.array_equal(ss.equations_of(sparse, "+s").damping, ss.equations_of(full, "+s").damping)


def test_duplicate_entries_of_a_sparse_matrix_add_up():
    doubled = scipy.sparse.coo_array(([1.0, 1.0, 5.0], ([0, 0, 1], [0, 0, 1])), shape=(2, 2))
    scene = ss.Scene([1.0, 1.0], doubled)
    assert ss.equations_of(scene, "").stiffness.tolist() == [[2.0, 0.0], [0.0, 5.0]]


def test_a_direction_is_an_index_a_name_or_a_vector():
    model = ss.models.two_subsystems()

    def modes(tangential, normal):
        first = ss.Contact(tangential=tangential, normal=normal, friction=1.5, slider_speed=0.025)
        return ss.complex_modes(model.replace(contacts=[first, model.contacts[1]]))

    unit = np.eye(8)
    by_index = modes(2, 3)
    assert np.array_equal(modes("x3", "x4").eigenvalues, by_index.eigenvalues)
    assert np.array_equal(modes(np.int32(2), unit[3]).eigenvalues, by_index.eigenvalues)


def test_a_direction_by_some_of_its_entries():
    model = ss.models.two_subsystems()
    tangential, normal = np.zeros(8), np.zeros(8)
    tangential[[2, 6]], normal[[3, 7]] = (1.0, -0.5), (0.6, 1.0)

    def scene(tangential, normal):
        pad = ss.Contact(tangential=tangential, normal=normal, friction=1.5, slider_speed=0.025)
        return model.replace(contacts=[pad])

    by_vector = scene(tangential, normal)
    by_entries = scene({"x7": -0.5, "x3": 1.0}, {np.int32(3): 0.6, 7: 1.0, "x1": 0.0})
    for letters in "+sd":
        values = ss.complex_modes(by_entries, letters).eigenvalues
        assert np.array_equal(values, ss.complex_modes(by_vector, letters).eigenvalues)
    assert by_entries.tangential_direction(0).tolist() == tangential.tolist()
    assert by_entries.normal_direction(0).tolist() == normal.tolist()
    assert "-0.5 x7 + 1 x3 / 0.6 x4 + 1 x8" in repr(by_entries)
    copy = pickle.loads(pickle.dumps(by_entries))
    assert copy.contacts[0].tangential == {"x7": -0.5, "x3": 1.0}
    given = {"x3": 1.0}
    contact = ss.Contact(tangential=given, normal=3, friction=0.1)
    given["x5"] = 1.0
    assert contact.tangential == {"x3": 1.0}


def test_entries_of_a_sparse_direction_cost_nothing_elsewhere():
    """A contact between two nodes mixes their dofs alone."""
    size = 2000
    between = ss.Contact(
        tangential={10: 1.0, 1500: -1.0}, normal={11: 1.0, 1501: -1.0}, friction=0.3, slider_speed=0.1
    )
    scene = ss.Scene(np.ones(size), scipy.sparse.diags_array(np.full(size, 1e4)), contacts=[between])
    assert np.flatnonzero(scene.tangential_direction(0)).tolist() == [10, 1500]
    _, columns, starts = scene.core.matrices()[2]
    assert (np.diff(starts) <= 2).all()
    assert columns.max() < size
    start = np.zeros(size)
    start[[11, 1501]] = 1e-3, -1e-3
    run = ss.simulate(scene, 0.02, ss.State(start, np.zeros(size), "d"))
    # Both fall towards each other with 100 rad/s and meet after a quarter of a period.
    assert run.events.time[0] == pytest.approx(np.pi / 200.0, rel=1e-12)


@pytest.mark.parametrize(
    ("direction", "message"),
    [
        ({}, "contact 0: tangential: must not be zero|tangential.*zero"),
        ({"x3": 0.0}, "zero"),
        ({"x33": 1.0}, "contact 0: tangential: unknown dof 'x33'"),
        ({8: 1.0}, r"contact 0: tangential: dof index 8 is outside 0\.\.7"),
        ({2: 1.0, "x3": 1.0}, "contact 0: tangential: 'x3' names a dof that another key names too"),
        ({"x3": np.nan}, "contact 0: tangential: must be finite, got NaN at dof 2"),
        ({"x3": "1"}, "contact 0: tangential: x3: "),
        ({2.5: 1.0}, "contact 0: tangential: expected dof indices or names as keys, got 2.5"),
        ({"x4": -2.0}, "contact 0: .*normal"),
    ],
)
def test_sparse_directions_that_are_refused(direction, message):
    contact = ss.Contact(tangential=direction, normal="x4", friction=0.3, slider_speed=0.1)
    with pytest.raises(ss.InputError, match=message):
        ss.models.two_subsystems().replace(contacts=[contact])


def test_names_of_dofs_and_contacts_label_results():
    contact = ss.Contact(tangential="slip", normal="lift", friction=0.2, slider_speed=0.1, name="pad")
    scene = ss.Scene(
        [1.0, 1.0], 1e4 * np.eye(2), force=[0.0, -10.0], contacts=[contact], dofs=["slip", "lift"]
    )
    run = ss.simulate(scene, 1e-3, ss.steady_sliding(scene))
    sample = run.sample([0.0, 1e-3])
    assert sample.position.sel(dof="lift").shape == (2,)
    assert sample.normal_force.sel(contact="pad").values == pytest.approx(10.0, rel=1e-12)


@given(drawn_scenes())
def test_a_pickled_scene_is_the_same_scene(drawn):
    scene = drawn.scene
    copy = pickle.loads(pickle.dumps(scene))
    assert copy.dofs == scene.dofs
    combination = "+" * len(scene.contacts)
    assert np.array_equal(
        ss.complex_modes(copy, combination).eigenvalues, ss.complex_modes(scene, combination).eigenvalues
    )
    with pytest.raises(ValueError, match="read-only"):
        copy.force[0] = 1.0


def test_the_representation_says_what_it_is():
    text = repr(ss.models.two_subsystems())
    assert "8 dofs, 2 contacts" in text
    assert "contact 1 (x7 / x8): friction 1.5, slider speed 0.025 m/s" in text
    assert "'++'" in repr(ss.steady_sliding(ss.models.two_subsystems()))
    assert "118.4" in repr(ss.complex_modes(ss.models.two_subsystems()))


def test_the_representation_lists_the_first_contacts():
    contacts = [
        ss.Contact(tangential=k, normal_force=1.0, friction=0.3, slider_speed=0.1, name=f"c{k}")
        for k in range(10)
    ]

    def listed(count):
        text = repr(ss.Scene(np.ones(10), 1e4 * np.eye(10), contacts=contacts[:count]))
        return sum(line.startswith("  contact c") for line in text.splitlines()), text.splitlines()[-1]

    assert listed(8) == (8, "  contact c7 (x8 / none): friction 0.3, slider speed 0.1 m/s, normal force 1 N")
    assert listed(9) == (8, "  and 1 more contact: see scene.summary()")
    assert listed(10) == (8, "  and 2 more contacts: see scene.summary()")


def test_two_indices_are_no_plane():
    contact = ss.Contact(tangential=(0, 1), normal=2, friction=0.3, slider_speed=0.1)
    message = (
        r"contact 0: tangential: .* the two directions of a plane are names, like \('x1', 'x2'\), or vectors"
    )
    with pytest.raises(ss.InputError, match=message):
        ss.Scene(np.ones(3), 1e4 * np.eye(3), contacts=[contact])


def test_the_representation_lists_friction_in_a_plane_once():
    contacts = [
        ss.Contact(tangential=("x", "y"), normal="z", friction=0.5, slider_speed=(0.3, 0.1), name="pad"),
        ss.Contact(normal="w", name="stop"),
    ]
    scene = ss.Scene(np.ones(4), np.eye(4), dofs=("x", "y", "z", "w"), contacts=contacts, force=-np.ones(4))
    lines = repr(scene).splitlines()
    assert lines[0] == "Scene(4 dofs, 3 contacts, two for each of 1 plane)"
    assert "  contacts pad_x and pad_y (x, y / z): friction 0.5, slider speed (0.3, 0.1) m/s" in lines
    assert [line for line in lines if "contact" in line][2:] == [lines[-1]]
    assert lines[-1].startswith("  contact stop (none / w)")
