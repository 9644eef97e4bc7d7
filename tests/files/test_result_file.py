"""Results that `load` reads back whole: the same points, orbits and methods, to the last bit."""

import numpy as np
import pytest

import stickslip as ss
from stickslip import types

MODEL = ss.models.two_subsystems


def matrices():
    """A block on a belt by its matrices, whose friction no model names."""
    contact = ss.Contact(
        tangential="x1", friction=0.2, static_friction=0.5, slider_speed=0.2, normal_force=1.0, name="belt"
    )
    return ss.Scene([1.0], [[1.0]], damping=[[0.05]], contacts=[contact])


@pytest.fixture(scope="module")
def cycles():
    belt = ss.simulate(matrices(), 60.0, ss.State([0.0], [0.2], "s")).limit_cycle()
    return {"model": ss.simulate(MODEL(friction=1.5), 0.6).limit_cycle(), "matrices": belt}


def same(first, second):
    assert first.core.record() == second.core.record()
    for k, (one, other) in enumerate(zip(first.scene.contacts, second.scene.contacts, strict=True)):
        assert vars(one) | {"tangential": 0, "normal": 0} == vars(other) | {"tangential": 0, "normal": 0}
        assert np.array_equal(first.scene.tangential_direction(k), second.scene.tangential_direction(k))
    for name in ("mass", "stiffness", "force"):
        one, other = (getattr(cycle.scene, name) for cycle in (first, second))
        assert np.array_equal(*(m.toarray() if hasattr(m, "toarray") else m for m in (one, other)))
    assert first.period == second.period
    assert first.stability == second.stability


@pytest.mark.parametrize("suffix", ["nc", "zarr"])
@pytest.mark.parametrize(
    ("scene", "parameters"),
    [
        (MODEL(), {"friction": (0.0, 3.0)}),
        (MODEL, {"friction": 1.5, "damping": (1e-5, 1e-3)}),
        (MODEL(slider_speed=0.05, preload_displacement=1e-5), {"friction": (0.0, 3.0)}),
    ],
)
def test_critical_points_read_back_are_equal(tmp_path, suffix, scene, parameters):
    points = ss.critical_points(scene, parameters)
    assert len(points) > 0
    ss.save(points, tmp_path / f"points.{suffix}")
    again = ss.load(tmp_path / f"points.{suffix}")
    assert isinstance(again, types.CriticalPoints)
    assert again.parameter == points.parameter
    for one, other in zip(again, points, strict=True):
        assert repr(one) == repr(other)
        assert {**vars(one), "complex_value": 0} == {**vars(other), "complex_value": 0} or np.isnan(
            other.eigenvalue
        )
    assert again.to_dataset().identical(points.to_dataset())
    assert str(again.summary()) == str(points.summary())


def test_no_critical_points_are_still_critical_points(tmp_path):
    ss.save(ss.critical_points(MODEL(), {"friction": (0.0, 0.1)}), tmp_path / "none.nc")
    again = ss.load(tmp_path / "none.nc")
    assert isinstance(again, types.CriticalPoints)
    assert len(again) == 0
    assert again.parameter == "friction"


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("model", {"friction": (1.5, 1.6)}),
        ("model", {"damping": (1.0, 0.97)}),
        ("matrices", {"friction": (0.2, 0.22)}),
        # A factor counts from the scene of the branch: the scenes along it are written one by one.
        ("matrices", {"stiffness": (1.0, 1.05)}),
    ],
)
def test_a_branch_read_back_goes_on(tmp_path, cycles, kind, parameters):
    branch = ss.continuation(cycles[kind], parameters, step=0.5)
    ss.save(branch, tmp_path / "branch.nc")
    again = ss.load(tmp_path / "branch.nc")
    assert isinstance(again, types.Branch)
    assert again.data.identical(branch.data)
    assert again.end == branch.end
    assert len(again.cycles) > 1
    for one, other in zip(again.cycles, branch.cycles, strict=True):
        same(one, other)
    ((name, (first, last)),) = parameters.items()
    same(again.at(last)[0], branch.at(last)[0])
    assert str(again.summary()) == str(branch.summary())
    # The orbits are orbits: one of them is continued, and draws itself.
    further = ss.continuation(again.cycles[-1], {name: (last, last + 0.1 * (last - first))}, step=0.5)
    assert len(further.cycles) > 1
    assert again.plot().get_xlabel()


def test_points_of_a_branch_are_read_back_with_their_orbits(tmp_path, cycles):
    cycle = cycles["model"]
    grazing = types.BranchPoint("friction", 2.5, "grazing", complex(np.nan, np.nan), 0, "impact", cycle)
    doubling = types.BranchPoint("friction", 2.0, "period_doubling", -1.0 + 0j, None, None, cycle)
    branch = ss.continuation(cycle, {"friction": (1.5, 1.51)}, step=0.5)
    branch = types.Branch(branch.data, branch.cycles, (doubling, grazing), "sequence")
    ss.save(branch, tmp_path / "branch.zarr")
    again = ss.load(tmp_path / "branch.zarr")
    assert again.end == "sequence"
    for one, other in zip(again.points, branch.points, strict=True):
        assert repr(one) == repr(other)
        same(one.cycle, other.cycle)
    assert again.folds == ()


def test_a_bifurcation_read_back_has_its_cycles(tmp_path):
    diagram = ss.bifurcation(MODEL(), {"friction": [0.3, 1.5]})
    ss.save(diagram, tmp_path / "diagram.nc")
    again = ss.load(tmp_path / "diagram.nc")
    assert isinstance(again, types.Bifurcation)
    assert again.cycles[0] is None
    same(again.cycles[1], diagram.cycles[1])
    assert again.data.identical(diagram.data)


def test_a_file_that_was_changed_is_refused_by_name(tmp_path, cycles):
    import h5netcdf

    ss.save(ss.continuation(cycles["model"], {"friction": (1.5, 1.51)}, step=0.5), tmp_path / "branch.nc")
    with h5netcdf.File(tmp_path / "branch.nc", "a") as file:
        file.attrs["stickslip_result"] = "Brunch"
    with pytest.raises(ss.InputError, match=r"branch\.nc: stickslip_result: .*, got 'Brunch'"):
        ss.load(tmp_path / "branch.nc")
    with h5netcdf.File(tmp_path / "branch.nc", "a") as file:
        file.attrs["stickslip_result"] = "CriticalPoints"
    with pytest.raises(ss.InputError, match=r"branch\.nc: not readable as CriticalPoints"):
        ss.load(tmp_path / "branch.nc")
