"""What searches for cycles find, drawn by the result, by `ss.plot`, and from a dataset read back."""

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import stickslip as ss

mpl.use("agg")
SCENE = ss.models.two_subsystems()


@pytest.fixture
def axes():
    return Figure().add_subplot()


@pytest.fixture(scope="module")
def map_of_starts():
    start = ss.steady_sliding(SCENE)
    return ss.basins(SCENE, {"friction": [0.5, 0.6, 1.5]}, start=start, velocity={"x1": [-1e-3, 1e-3]})


def test_basins_are_drawn_where_they_were_asked(axes, map_of_starts):
    assert map_of_starts.plot(ax=axes) is axes
    (mesh,) = axes.collections
    # Columns are the first axis: rest at low friction, a cycle at high friction.
    assert mesh.get_array().reshape(3, 2).tolist() == [[0, 0], [0, 0], [1, 1]]
    corners = mesh.get_coordinates()
    assert corners[:, :, 0].min() == pytest.approx(-2e-3)
    assert corners[:, :, 1].max() == pytest.approx(1.95)
    assert axes.get_xlabel() == "velocity of x1, m/s"
    assert axes.get_ylabel() == "friction coefficient"
    labels = [text.get_text() for text in axes.figure.axes[1].get_yticklabels()]
    assert labels[0] == "equilibrium"
    assert labels[1].startswith("8.908 ms: ")


def test_basins_read_back_are_drawn_alike_and_what_is_missing_is_seen(axes, map_of_starts, tmp_path):
    ss.save(map_of_starts.to_dataset(), tmp_path / "basins.nc")
    again = ss.load(tmp_path / "basins.nc")
    again["reached"][0, 0] = -1
    again["reached"][1, 2] = -2
    ss.plot(again, ax=axes)
    mesh, hatched = axes.collections
    assert mesh.get_array().mask.reshape(3, 2).tolist() == [[True, False], [False, False], [False, True]]
    assert hatched.get_hatch() == "///"
    assert hatched.get_array().count() == 1


def test_diagrams_and_branches_are_drawn_by_themselves(axes, tmp_path):
    diagram = ss.bifurcation(SCENE, {"friction": [0.5, 1.5, 1.52]})
    assert diagram.plot(ax=axes) is axes
    largest = diagram.cycles[1].amplitude
    assert axes.get_ylabel() == f"amplitude of {largest.dof.to_numpy()[largest.to_numpy().argmax()]}, µm"
    assert axes.get_xlabel() == "friction coefficient"
    drawn = [line for line in axes.lines if line.get_marker() != "x"]
    points = np.concatenate([line.get_xydata() for line in drawn])
    assert sorted(points[:, 0]) == [1.5, 1.52]
    assert points[:, 1].min() == pytest.approx(1e6 * float(largest.max()), rel=0.1)
    ss.save(diagram.to_dataset(), tmp_path / "diagram.nc")
    other = ss.plot(ss.load(tmp_path / "diagram.nc"), ax=Figure().add_subplot())
    assert [line.get_xydata().tolist() for line in other.lines] == [
        line.get_xydata().tolist() for line in axes.lines
    ]
    branch = ss.continuation(diagram.cycles[1], {"friction": (1.5, 1.6)}, step=0.3)
    along = branch.plot("x2", ax=Figure().add_subplot())
    assert along.get_xlabel() == "friction coefficient"
    values = np.concatenate([line.get_xdata() for line in along.lines])
    assert set(np.asarray(branch.data.friction)) <= set(values)


def test_maps_and_studies_are_drawn_from_their_datasets():
    values = np.linspace(0.2, 2.5, 4)
    swept = ss.sweep(SCENE, {"friction_0": values, "friction_1": values})
    assert isinstance(ss.plot(swept), Figure)
    assert isinstance(ss.plot(ss.sweep(SCENE, {"friction": values})), Figure)
    results = ss.Study(SCENE, {"friction": values}).run(progress=False)
    assert isinstance(results, xr.Dataset)
    assert isinstance(ss.plot(results), Figure)
