"""What has labels is taken by its labels: states, vectors, matrices, directions and loads."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import stickslip as ss
from stickslip.scene.loads.in_time import Harmonic

STIFFNESS = np.array([[300.0, -100.0], [-100.0, 500.0]])


def scene(**changes):
    return ss.Scene(**{"mass": [1.0, 2.0], "stiffness": STIFFNESS, "dofs": ["x", "y"], **changes})


def moved(start, of=None):
    run = ss.simulate(of or scene(), 0.01, start)
    return run.sample([0.01]).position.to_numpy()[0]


def test_a_state_is_taken_by_the_names_of_its_dofs():
    expected = moved(ss.State([0.0, 1.0], [0.2, 0.0], "", ["x", "y"]))
    swapped = ss.State([1.0, 0.0], [0.0, 0.2], "", ["y", "x"])
    np.testing.assert_array_equal(moved(swapped), expected)
    (outcome,) = ss.simulate_many([scene()], swapped, duration=0.01)
    np.testing.assert_array_equal(outcome.run.sample([0.01]).position.to_numpy()[0], expected)
    # Without names of its own a state has the order of the scene.
    np.testing.assert_array_equal(moved(ss.State([0.0, 1.0], [0.2, 0.0], "")), expected)


@pytest.mark.parametrize(("names", "unknown"), [(["foo", "bar"], "foo"), (["x", "z"], "z")])
def test_a_state_with_names_that_the_scene_has_not_is_refused(names, unknown):
    start = ss.State([1.0, 0.0], [0.0, 0.0], "", names)
    with pytest.raises(ss.InputError, match=f"start: dofs: the scene has no dof '{unknown}'"):
        ss.simulate(scene(), 1.0, start)
    (outcome,) = ss.simulate_many([scene()], [start], duration=1.0)
    assert "no dof" in str(outcome.error)


def test_the_names_of_a_state_are_different_texts():
    with pytest.raises(ss.InputError, match="'x' names more than one dof"):
        ss.State([1.0, 0.0], [0.0, 0.0], "", ["x", "x"])


def labelled(values, order):
    """Return a vector or matrix over x, y in another order of its labels, by pandas and by xarray."""
    places = ["xy".index(name) for name in order]
    entries = np.asarray(values, float)[np.ix_(*[places] * np.ndim(values))]
    names = ["dof", "other"][: entries.ndim]
    frame = pd.Series(entries, index=order) if entries.ndim == 1 else pd.DataFrame(entries, order, order)
    return frame, xr.DataArray(entries, dims=names, coords=dict.fromkeys(names, order))


@pytest.mark.parametrize("which", [0, 1], ids=["pandas", "xarray"])
def test_vectors_and_matrices_are_taken_by_their_labels(which):
    order = ["y", "x"]
    skew = np.array([[0.0, 3.0], [-3.0, 0.0]])
    given = {
        "mass": [1.0, 2.0],
        "stiffness": STIFFNESS,
        "damping": np.diag([0.1, 0.2]),
        "gyroscopic": skew,
        "circulatory": skew,
        "force": [0.0, -10.0],
    }
    plain = scene(**given)
    by_label = scene(**{name: labelled(values, order)[which] for name, values in given.items()})
    for name in given:
        np.testing.assert_array_equal(getattr(by_label, name), getattr(plain, name))
    position = labelled([0.5, 1.0], order)[which]
    assert ss.State(position, position, "", ["x", "y"]).position.tolist() == [0.5, 1.0]
    rest = ss.State([0.0, 0.0], [0.0, 0.0], "", ["x", "y"])
    assert rest.perturbed(velocity=position).velocity.tolist() == [0.5, 1.0]


@pytest.mark.parametrize("which", [0, 1], ids=["pandas", "xarray"])
def test_directions_and_loads_are_taken_by_their_labels(which, tmp_path):
    direction = labelled([0.6, 0.8], ["y", "x"])[which]
    one = scene(contacts=[ss.Contact(normal=direction)], loads=[Harmonic(direction, 2.0)])
    np.testing.assert_array_equal(one.normal_direction(0), [0.6, 0.8])
    assert one.loads[0].amplitude == {"y": 0.8, "x": 0.6}
    ss.save(one, tmp_path / "scene.toml")
    np.testing.assert_array_equal(ss.load(tmp_path / "scene.toml").scene.normal_direction(0), [0.6, 0.8])


def test_labels_that_are_no_dofs_are_refused():
    for labels in (["x", "z"], ["x", "x"], [0.5, 1.5], [5, 6]):
        with pytest.raises(ss.InputError, match="force: "):
            scene(force=pd.Series([1.0, 2.0], index=labels))
    # A column without labels of its own is a plain vector.
    assert scene(force=pd.Series([1.0, 2.0])).force.tolist() == [1.0, 2.0]
