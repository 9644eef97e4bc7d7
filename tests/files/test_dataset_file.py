"""Datasets come back from files as they were written."""

import json
import os
import pickle
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest
import scipy.stats
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import stickslip as ss
from stickslip.files.dataset_text import csv_text, json_text, split_complex

NUMBERS = st.floats()
FORMATS = [".nc", ".zarr"]


@given(
    arrays(complex, (3, 2), elements=st.complex_numbers(allow_infinity=False, allow_nan=False)),
    arrays(float, 3, elements=NUMBERS),
    arrays(bool, 3),
    st.lists(st.sampled_from(["++", "s+", "+d", "µ", "", "#1", 'a "b", c']), min_size=3, max_size=3),
    st.sampled_from(FORMATS),
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
    ss.save(dataset, path)
    found = ss.load(path)
    xr.testing.assert_identical(found, dataset)
    assert found.eigenvalue.values.tobytes() == values.tobytes()


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_run_without_events_comes_back(tmp_path, suffix):
    scene = ss.models.two_subsystems(friction=0.3)
    run = ss.simulate(scene, 0.1, ss.steady_sliding(scene))
    assert len(run.events) == 0
    ss.save(run.to_dataset(5), tmp_path / f"run{suffix}")
    found = ss.load(tmp_path / f"run{suffix}")
    assert found.sizes["event"] == 0
    assert found.position.values.tobytes() == run.to_dataset(5).position.values.tobytes()


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


def test_whatever_a_dataset_may_hold_comes_back(tmp_path):
    dataset = xr.Dataset(
        {
            "position": (("time", "dof"), [[0.1 + 0.2, -0.0], [2.0, np.nan], [np.inf, 5e-324]]),
            "shape": (("dof", "time"), 1j * np.arange(6.0).reshape(2, 3)),
            "pole": ("dof", np.array([complex(-0.0, 1.0), complex(np.nan, -0.0)])),
            "kind": ("event", np.array([], dtype=str)),
            "impulse": (("event", "dof"), np.zeros((0, 2))),
            "root": ("event", np.zeros(0, dtype=complex)),
            "count": 2**62 + 1,
            "small": ("dof", np.arange(2, dtype=np.int32)),
        },
        coords={"time": ("time", [0.0, 0.5, 1.0], {"units": "s"}), "dof": ["a", "µ"]},
        attrs={
            "limits": [0.0, 1.0],
            "reason": "duration",
            "found": True,
            "none": np.bool_(False),
            "flags": [True, False],
            "word": np.str_("µ"),
            "nothing": "",
            "empty": [],
            "names": ["a", "bc"],
        },
    )
    for suffix in FORMATS:
        ss.save(dataset, tmp_path / f"data{suffix}")
        found = ss.load(tmp_path / f"data{suffix}")
        xr.testing.assert_identical(found, dataset)
        for name in ("position", "pole", "shape"):
            assert found[name].values.tobytes() == dataset[name].values.tobytes()
        # Of texts without an entry xarray writes an empty array of numbers into zarr.
        names = [name for name in dataset if name != "kind" or suffix == ".nc"]
        assert [found[name].dtype for name in names] == [dataset[name].dtype for name in names]
    assert "format_version" not in dataset.attrs


def test_netcdf_holds_complex_numbers_as_such(tmp_path):
    """And the version of its format."""
    ss.save(xr.Dataset({"pole": ("mode", [1.0 + 2.0j])}), tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as raw:
        assert raw.pole.dtype == complex
        assert raw.attrs == {"format_version": 1}


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_dataset_of_a_later_version_is_refused(tmp_path, monkeypatch, suffix):
    with monkeypatch.context() as patch:
        patch.setattr("stickslip.files.dataset_file.FORMAT_VERSION", 2)
        ss.save(xr.Dataset({"a": 1.0}), tmp_path / f"a{suffix}")
    with pytest.raises(ss.InputError, match="reads files up to version 1, got 2; pip install --upgrade"):
        ss.load(tmp_path / f"a{suffix}")


def test_json_is_for_other_programs():
    dataset = xr.Dataset({"pole": ("mode", [1.0 + 2.0j, complex(np.nan, np.inf)])}, attrs={"word": "a"})
    found = json.loads(json_text(dataset))
    assert found["attrs"] == {"word": "a"}
    assert found["dims"] == {"mode": 2}
    data = {name: variable["data"] for name, variable in found["data_vars"].items()}
    assert data == {"pole_real": [1.0, None], "pole_imag": [2.0, "inf"]}


def labelled(array):
    if isinstance(array, xr.DataArray):
        return array.to_dataset(name=array.name or "value")
    return array if isinstance(array, xr.Dataset) else array.to_dataset()


@pytest.fixture(scope="module")
def public(datasets):
    """Every labelled array of the package, of studies too."""
    study = ss.Study(
        ss.models.two_subsystems,
        {"friction": scipy.stats.uniform(0.3, 2.2), "slider_speed": scipy.stats.uniform(0.02, 0.08)},
        samples=8,
    )
    saltelli = ss.Study(
        ss.models.two_subsystems,
        {"friction": scipy.stats.uniform(0.3, 2.2), "wall_stiffness": scipy.stats.uniform(1.8e6, 2e5)},
        samples=32,
        sampler="saltelli",
    )
    morris = ss.Study(
        ss.models.two_subsystems,
        {"friction": scipy.stats.uniform(0.3, 2.2), "wall_stiffness": scipy.stats.uniform(1.8e6, 2e5)},
        samples=4,
        sampler="morris",
    )
    grid = ss.Study(ss.models.two_subsystems, {"friction": [0.5, 1.5], "slider_speed": [0.02, 0.05]})
    results = study.run()
    return {
        **datasets,
        "unstacked": ss.study.unstacked(grid.run()),
        "study": results,
        "probability": ss.study.probability(results),
        "probability over a parameter": ss.study.probability(results, "friction", bins=2),
        "distribution": ss.study.distribution(results, "growth_rate"),
        "convergence": ss.study.convergence(results, "growth_rate", points=3),
        "sobol": ss.study.importance(saltelli.run(), "growth_rate"),
        "morris": ss.study.importance(morris.run(), "growth_rate"),
        "eigenvalue_moments": study.eigenvalue_moments(),
    }


@pytest.mark.slow
@pytest.mark.parametrize("suffix", FORMATS)
def test_every_public_dataset_comes_back(public, tmp_path, suffix):
    for call, array in public.items():
        expected = labelled(array)
        ss.save(array, tmp_path / f"data{suffix}")
        again = ss.load(tmp_path / f"data{suffix}")
        found = again if isinstance(again, xr.Dataset) else again.to_dataset()
        xr.testing.assert_identical(found, expected)
        for name, variable in expected.variables.items():
            # Texts differ in length and kind of their cells, all else has the same type.
            if variable.dtype.kind in "biufc":
                assert found[name].dtype == variable.dtype, (call, name)
    assert [path.name for path in tmp_path.iterdir()] == [f"data{suffix}"]


def test_every_public_dataset_as_a_table(public, tmp_path):
    for call, array in public.items():
        expected = split_complex(labelled(array))
        ss.save(array, tmp_path / "data.csv")
        # As text: the default reader of pandas 2 rounds numbers once more.
        table = pandas.read_csv(tmp_path / "data.csv", dtype=str, keep_default_na=False)
        (first, *_) = [*expected.sizes, None]
        seen = [
            name
            for name, variable in expected.variables.items()
            if variable.dims == ((first,) if first else ())
        ]
        assert len(table) == (expected.sizes[first] if first else 1), call
        for name in seen:
            column = expected[name].to_numpy()
            if column.dtype.kind in "iuf":
                numbers = np.array(table[name].tolist(), dtype=str).astype(column.dtype)
                np.testing.assert_array_equal(numbers, column, err_msg=f"{call}: {name}")
            elif column.dtype.kind == "b":
                assert table[name].tolist() == list(map(str, column)), (call, name)
            else:
                assert table[name].astype(str).tolist() == column.tolist(), (call, name)


def test_a_file_that_cannot_be_made_leaves_the_old_one(tmp_path):
    good, bad = xr.Dataset({"a": ("x", [1.0])}), xr.Dataset({"a": ("x", [object()])})
    for suffix in (".nc", ".csv", ".zarr"):
        path = tmp_path / f"data{suffix}"
        ss.save(good, path)
        if suffix == ".csv":
            written = path.read_bytes()
        with pytest.raises(ss.InputError, match="dataset: a: expected numbers, truth values or texts"):
            ss.save(bad, path)
        with pytest.raises(ss.InputError, match="dataset: attribute cycles: expected"):
            ss.save(good.assign_attrs(cycles=ss.models.two_subsystems()), path)
        if suffix == ".csv":
            assert path.read_bytes() == written
        else:
            xr.testing.assert_identical(ss.load(path), good)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".csv", ".nc", ".zarr"]


def test_a_writer_that_fails_half_way_leaves_the_old_file(tmp_path, monkeypatch):
    dataset = xr.Dataset({"a": ("x", [1.0])})
    for suffix in (".nc", ".zarr"):
        ss.save(dataset, tmp_path / f"data{suffix}")

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("pathlib.Path.replace", full)
        with pytest.raises(OSError, match="No space"):
            ss.save(dataset + 1.0, tmp_path / "data.nc")
    with monkeypatch.context() as patch:
        patch.setattr("zarr.Group.create_array", full)
        patch.setattr("zarr.Array.__setitem__", full)
        with pytest.raises(OSError, match="No space"):
            ss.save(dataset + 1.0, tmp_path / "data.zarr")
    for suffix in (".nc", ".zarr"):
        xr.testing.assert_identical(ss.load(tmp_path / f"data{suffix}"), dataset)
    assert len(list(tmp_path.iterdir())) == 2


def test_modes_of_a_scene_without_freedom_make_a_table_of_no_rows():
    scene = ss.Scene(
        mass=[1.0, 1.0],
        stiffness=[1.0, 1.0] * np.eye(2),
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.5, slider_speed=1.0)],
    )
    text = csv_text(ss.complex_modes(scene, "s").to_dataset(), ("mode",))
    assert text.startswith("mode,")
    assert len(text.splitlines()) == 1


def test_folders_that_hold_something_else_are_kept(tmp_path):
    (tmp_path / "notes.zarr").mkdir()
    (tmp_path / "notes.zarr" / "text").write_text("kept")
    with pytest.raises(ss.InputError, match="holds something else"):
        ss.save(xr.Dataset({"a": 1.0}), tmp_path / "notes.zarr")
    assert (tmp_path / "notes.zarr" / "text").read_text() == "kept"
    study = ss.Study(ss.models.two_subsystems, {"friction": scipy.stats.uniform(0.3, 2.2)}, samples=4)
    results = study.run(tmp_path / "study.zarr")
    with pytest.raises(ss.InputError, match="holds something else"):
        ss.save(results, tmp_path / "study.zarr")


class Touch:
    """Makes a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.mark.parametrize("codec", [None, "filters", "compressor"])
@pytest.mark.parametrize("kind", ["<f8", "|O"])
def test_zarr_folders_of_format_2_are_refused_before_anything_is_decoded(tmp_path, monkeypatch, codec, kind):
    folder, made = tmp_path / "a.zarr", tmp_path / "made"
    (folder / "a").mkdir(parents=True)
    (folder / ".zgroup").write_text('{"zarr_format": 2}')
    (folder / ".zattrs").write_text("{}")
    (folder / "a" / ".zattrs").write_text('{"_ARRAY_DIMENSIONS": ["x"]}')
    record = {"zarr_format": 2, "shape": [1], "chunks": [1], "dtype": kind, "order": "C", "fill_value": 0}
    record |= {"filters": None, "compressor": None}
    if codec is not None:
        unpickle = {"id": "pickle", "protocol": 4}
        record[codec] = [{"id": "vlen-utf8"}, unpickle] if codec == "filters" else unpickle
    (folder / "a" / ".zarray").write_text(json.dumps(record))
    (folder / "a" / "0").write_bytes(np.ones(1).tobytes() if codec is None else pickle.dumps(Touch(made)))
    asked = []
    monkeypatch.setattr("numcodecs.registry.get_codec", asked.append)
    with pytest.raises(ss.InputError, match="expected a zarr folder of format 3"):
        ss.load(folder)
    assert not asked
    assert not made.exists()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"zarr_format": 2}, "zarr_format: expected 3, got 2"),
        ({"codecs": [{"name": "numcodecs.pickle"}]}, "codecs: expected bytes, .*got 'numcodecs.pickle'"),
    ],
)
def test_arrays_of_zarr_with_other_formats_or_codecs_are_refused(tmp_path, changed, message):
    ss.save(xr.Dataset({"a": ("x", [1.0])}), tmp_path / "a.zarr")
    file = tmp_path / "a.zarr" / "a" / "zarr.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | changed))
    with pytest.raises(ss.InputError, match=message):
        ss.load(tmp_path / "a.zarr")


@pytest.mark.skipif(sys.platform == "win32", reason="modes of files")
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444])
@pytest.mark.parametrize("suffix", [".nc", ".csv", ".zarr"])
def test_a_file_that_is_replaced_keeps_its_mode(tmp_path, suffix, mode):
    path = tmp_path / f"data{suffix}"
    ss.save(xr.Dataset({"a": ("x", [1.0])}), path)
    mode |= 0o700 if path.is_dir() else 0
    path.chmod(mode)
    ss.save(xr.Dataset({"a": ("x", [2.0])}), path)
    assert os.stat(path).st_mode & 0o777 == mode
    if suffix != ".csv":
        assert ss.load(path).a.item() == 2.0


def test_zarr_is_optional(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(ss.InputError, match=r"a\.zarr: this needs zarr; pip install 'stickslip\[study\]'"):
        ss.save(xr.Dataset({"a": 1.0}), tmp_path / "a.zarr")


@pytest.mark.skipif(sys.platform == "win32", reason="no such device")
def test_a_device_is_written_to(tmp_path):
    (tmp_path / "sink.csv").symlink_to("/dev/null")
    ss.save(xr.Dataset({"a": ("x", [1.0])}), tmp_path / "sink.csv")
    assert (tmp_path / "sink.csv").is_char_device()


def test_hostile_files(tmp_path):
    with pytest.raises(ss.InputError, match=r"expected a file \.nc, \.zarr, \.csv$"):
        ss.save(xr.Dataset(), tmp_path / "a.xls")
    with pytest.raises(ss.InputError, match=r"expected a file \.toml, \.nc, \.zarr$"):
        ss.load(tmp_path / "a.xls")
    with pytest.raises(ss.InputError, match=r"a\.csv: .*pandas\.read_csv reads a table"):
        ss.load(tmp_path / "a.csv")
    for call in (ss.load, lambda path: ss.save(xr.Dataset(), path)):
        with pytest.raises(ss.InputError, match=r"a\.json: .*write \.nc or \.zarr"):
            call(tmp_path / "a.json")
    for suffix in (".nc", ".zarr"):
        with pytest.raises(ss.InputError, match="dataset: m/s: expected a name without /"):
            ss.save(xr.Dataset({"m/s": 1.0}), tmp_path / f"a{suffix}")
    with pytest.raises(
        ss.InputError, match="what: expected a Scene, a Case, a result with to_dataset, an xarray dataset"
    ):
        ss.save([1.0], tmp_path / "a.nc")
    whole = xr.Dataset({"eigenvalue": ("mode", [1.0, 2j]), "status": ("mode", ["+", "s"])})
    for name in ("a.nc", "a.zarr"):
        path = tmp_path / name
        with pytest.raises(ss.InputError, match="no such file"):
            ss.load(path)
        path.write_bytes(b"not data")
        with pytest.raises(ss.InputError, match="not readable"):
            ss.load(path)
        path.unlink()
        ss.save(whole, path)
        if path.is_dir():
            (path / "eigenvalue" / "zarr.json").write_text("{")
            with pytest.raises(ss.InputError, match="not readable"):
                ss.load(path)
            shutil.rmtree(path)
            continue
        content = path.read_bytes()
        for length in (0, 4, 20, len(content) // 2):
            path.write_bytes(content[:length])
            with pytest.raises(ss.InputError, match="not readable"):
                ss.load(path)
