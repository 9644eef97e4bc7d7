"""A store has one writer, survives a full disk, and is read only where nothing in it can run code."""

import errno
import json
import threading

import numpy as np
import pytest
import xarray as xr

import stickslip as ss
import study_models as models
from stickslip.study.run import store


def test_of_writers_that_start_together_one_makes_the_store(tmp_path, monkeypatch):
    """All of them have a draft before the first one is renamed; the others are told, none by an OSError."""
    count = 4
    drafted = threading.Barrier(count)
    move, renamed = store.Path.rename, []

    def rename(self, target):
        if self.name.endswith(".partial"):
            drafted.wait(60)
            renamed.append(target)
        return move(self, target)

    monkeypatch.setattr(store.Path, "rename", rename)
    ends = []

    def run():
        try:
            ends.append(models.verdicts(samples=2000).run(tmp_path / "x.zarr", threads=1, chunk=10).load())
        except BaseException as error:
            ends.append(error)

    writers = [threading.Thread(target=run) for _ in range(count)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert len(renamed) == count
    results = [end for end in ends if isinstance(end, xr.Dataset)]
    refused = [end for end in ends if not isinstance(end, xr.Dataset)]
    assert all(isinstance(end, ss.InputError) for end in refused), refused
    assert results
    assert (results[0].status == "ok").all()
    assert [path.name for path in tmp_path.iterdir()] == ["x.zarr"]


@pytest.mark.parametrize("name", ["growth_rate", "status"])
def test_a_full_disk_keeps_what_is_complete(tmp_path, monkeypatch, name):
    study, path = models.verdicts(), tmp_path / "x.zarr"
    expected = study.run().load()
    array = store.ZarrStore.array

    class Full:
        def __setitem__(self, where, values):
            if where.start == 20:
                raise OSError(errno.ENOSPC, "No space left on device")
            array(kept[0], name)[where] = values

    kept = []

    def full(self, asked):
        kept[:] = [self]
        return Full() if asked == name else array(self, asked)

    with monkeypatch.context() as patched:
        patched.setattr(store.ZarrStore, "array", full)
        message = "No space left on device; 20 of 96 samples are complete"
        with pytest.raises(ss.StudyError, match=message) as stopped:
            study.run(path, chunk=10, threads=1)
    partial = stopped.value.partial
    assert np.flatnonzero(partial.status != "pending").tolist() == list(range(20))
    xr.testing.assert_identical(study.run(path).load(), expected)


def test_a_store_that_cannot_be_made_is_a_store_error(tmp_path, monkeypatch):
    def full(self, target):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(store.Path, "rename", full)
    with pytest.raises(ss.InputError, match=r"store: .*x.zarr cannot be made: .*No space left"):
        models.verdicts().run(tmp_path / "x.zarr")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"zarr_format": 2}, "growth_rate/zarr.json: zarr_format: expected 3, got 2"),
        (
            {"codecs": [{"name": "numcodecs.pickle"}]},
            "growth_rate/zarr.json: codecs: .*got 'numcodecs.pickle'",
        ),
    ],
)
def test_a_store_with_other_formats_or_codecs_is_refused_before_it_is_opened(
    tmp_path, monkeypatch, changed, message
):
    study, path = models.verdicts(), tmp_path / "x.zarr"
    study.run(path)
    file = path / "growth_rate" / "zarr.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | changed))
    monkeypatch.setattr("zarr.open_group", lambda *_, **__: pytest.fail("zarr has opened the folder"))
    with pytest.raises(ss.InputError, match=message):
        study.run(path)


def test_a_store_of_a_later_version_is_refused(tmp_path):
    study, path = models.verdicts(), tmp_path / "x.zarr"
    study.run(path)
    file = path / "zarr.json"
    record = json.loads(file.read_text())
    assert record["attributes"]["format_version"] == 1
    record["attributes"]["format_version"] = 2
    file.write_text(json.dumps(record))
    with pytest.raises(ss.InputError, match="reads files up to version 1, got 2; pip install --upgrade"):
        study.run(path)


@pytest.mark.parametrize("place", [".zgroup", "growth_rate/.zarray", ".zmetadata"])
def test_a_folder_of_both_formats_is_refused(tmp_path, place):
    study, path = models.verdicts(), tmp_path / "x.zarr"
    study.run(path)
    (path / place).write_text('{"zarr_format": 2}')
    message = f"expected a zarr folder of format 3 alone, got one with {place} of format 2"
    with pytest.raises(ss.InputError, match=message):
        study.run(path)
    with pytest.raises(ss.InputError, match=message):
        ss.load(path)
