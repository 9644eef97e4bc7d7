"""Datasets come back from files as they were written."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import stickslip as ss
from stickslip.dataset_file import csv_text

NUMBERS = st.floats(allow_infinity=False)


@given(
    arrays(complex, (3, 2), elements=st.complex_numbers(allow_infinity=False, allow_nan=False)),
    arrays(float, 3, elements=NUMBERS),
    arrays(bool, 3),
    st.lists(st.sampled_from(["++", "s+", "+d", "µ"]), min_size=3, max_size=3),
    st.sampled_from([".nc", ".json"]),
)
def test_a_dataset_comes_back(tmp_path_factory, values, numbers, truth, names, suffix):
    dataset = xr.Dataset(
        {
            "eigenvalue": (("mode", "dof"), values, {"units": "1/s"}),
            "frequency": ("mode", numbers, {"units": "Hz"}),
            "unstable": ("mode", truth),
            "status": ("mode", np.array(names)),
            "count": ("mode", np.arange(3)),
        },
        coords={"dof": ["x1", "x2"]},
        attrs={"duration": 0.1, "stop_reason": "duration"},
    )
    path = tmp_path_factory.mktemp("data") / f"d{suffix}"
    ss.write_dataset(dataset, path)
    found = ss.read_dataset(path)
    xr.testing.assert_identical(found, dataset)
    assert found.eigenvalue.values.tobytes() == values.tobytes()


@pytest.mark.parametrize("suffix", [".nc", ".json"])
def test_a_run_without_events_comes_back(tmp_path, suffix):
    scene = ss.models.two_subsystems(friction=0.3)
    run = ss.simulate(scene, ss.sliding_equilibrium(scene), 0.1)
    assert len(run.events) == 0
    ss.write_dataset(run.dataset(5), tmp_path / f"run{suffix}")
    found = ss.read_dataset(tmp_path / f"run{suffix}")
    assert found.sizes["event"] == 0
    assert found.position.values.tobytes() == run.dataset(5).position.values.tobytes()


def test_csv_has_a_column_per_label():
    dataset = xr.Dataset(
        {"position": (("time", "dof"), [[0.1 + 0.2, 1.0], [2.0, 3.0]]), "period": 1.0},
        coords={"time": [0.0, 0.5], "dof": ["a", "b"]},
    )
    assert csv_text(dataset) == "time,position_a,position_b\n0.0,0.30000000000000004,1.0\n0.5,2.0,3.0\n"
    long = csv_text(dataset, ("time", "dof"))
    assert long.splitlines()[:3] == ["time,dof,position", "0.0,a,0.30000000000000004", "0.0,b,1.0"]
    with pytest.raises(ss.InputError, match="no dimension 'mode'"):
        csv_text(dataset, ("mode",))


def test_hostile_files(tmp_path):
    with pytest.raises(ss.InputError, match=r"expected a file \.nc, \.json, \.csv"):
        ss.write_dataset(xr.Dataset(), tmp_path / "a.xls")
    with pytest.raises(ss.InputError, match=r"expected a file \.nc or \.json"):
        ss.read_dataset(tmp_path / "a.csv")
    for name in ("a.nc", "a.json"):
        with pytest.raises(ss.InputError, match="no such file"):
            ss.read_dataset(tmp_path / name)
        (tmp_path / name).write_bytes(b"not data")
        with pytest.raises(ss.InputError, match="not readable"):
            ss.read_dataset(tmp_path / name)
