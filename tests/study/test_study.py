"""Studies give the same bits however they are computed, and lose nothing."""

from __future__ import annotations

import contextlib
import copy
import json
import multiprocessing
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import stickslip as ss
import study_models as models
from stickslip.study import GaussianCopula, Output
from stickslip.study.run import identity, runners, store
from stickslip.study.sample import evaluation
from stickslip.study.sample.fingerprint import described_function
from stickslip.study.samplers import unit_design


def assert_same_bits(results: xr.Dataset, expected: xr.Dataset) -> None:
    xr.testing.assert_identical(results.load(), expected.load())
    for name, variable in expected.variables.items():
        if variable.dtype.kind in "fc":
            assert results[name].to_numpy().tobytes() == variable.to_numpy().tobytes(), name


@pytest.fixture(scope="module")
def expected() -> xr.Dataset:
    results = models.campaign().run()
    assert (results.status == "ok").all()
    # Both kinds of answers are among them.
    assert 0 < (results.unstable_modes > 0).sum() < results.sizes["sample"]
    assert results.period.notnull().any()
    assert results.period.isnull().any()
    return results


@pytest.mark.parametrize(
    "arguments", [{"threads": 1}, {"threads": 2}, {"chunk": 7}, {"chunk": 1000}], ids=str
)
def test_bits_do_not_depend_on_threads_and_chunks(arguments: dict[str, int], expected: xr.Dataset) -> None:
    assert_same_bits(models.campaign().run(**arguments), expected)


def test_bits_of_verdicts_do_not_depend_on_threads_and_chunks() -> None:
    study = models.verdicts(samples=3000)
    expected = study.run()
    for arguments in ({"threads": 1}, {"threads": 2, "chunk": 7}, {"chunk": 1000}):
        assert_same_bits(study.run(**arguments), expected)


def test_a_chunk_takes_no_more_threads_than_it_has_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    counts: list[int | None] = []
    inner = evaluation.Evaluation.columns

    def counted(self: evaluation.Evaluation, rows: Any, threads: int | None) -> evaluation.Columns:
        counts.append(threads)
        return inner(self, rows, threads)

    monkeypatch.setattr(evaluation.Evaluation, "columns", counted)
    models.verdicts(samples=3).run(threads=500)
    assert counts == [3]
    with pytest.raises(ss.InputError, match="threads: expected an integer <= 1024, got 100000"):
        models.verdicts(samples=3).run(threads=100_000)


@pytest.mark.process
def test_bits_do_not_depend_on_the_executor(expected: xr.Dataset) -> None:
    # Threads of a forked process would wait for threads that it does not have.
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert_same_bits(models.campaign().run(executor=pool, chunk=13), expected)
    with ThreadPoolExecutor(2) as pool:
        assert_same_bits(models.campaign().run(executor=pool, chunk=13), expected)


def test_bits_do_not_depend_on_the_order(expected: xr.Dataset) -> None:
    study = models.campaign()
    evaluation = study.evaluation
    for k in np.random.default_rng(1).permutation(study.size)[:20]:
        alone = evaluation.columns(study.design[k : k + 1], 1)
        assert alone["eigenvalue"].tobytes() == expected.eigenvalue.to_numpy()[k].tobytes()
        assert alone["amplitude"].tobytes() == expected.amplitude.to_numpy()[k].tobytes()


@pytest.mark.slow
def test_a_store_gives_back_what_memory_holds(tmp_path: Path, expected: xr.Dataset) -> None:
    results = models.campaign().run(tmp_path / "x.zarr", chunk=10)
    assert results.eigenvalue.dtype == np.complex128
    assert_same_bits(results, expected)
    for described in (results.attrs["identity"], results.attrs["machine"], results.attrs["scene"]):
        assert json.loads(described)
    again = xr.open_zarr(tmp_path / "x.zarr", consolidated=False)
    assert set(expected.coords) <= set(again.coords)


@pytest.mark.slow
def test_a_run_goes_on_where_it_stopped_and_repeats_nothing(
    tmp_path: Path, expected: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    computed: list[int] = []
    inner = runners.threads

    def counted(count: int | None) -> runners.Runner:
        def run(evaluation, tasks):  # type: ignore[no-untyped-def]
            for result in inner(count)(evaluation, tasks):
                if len(computed) == 4:
                    computed.append(-1)
                    raise KeyboardInterrupt
                computed.append(result[0])
                yield result

        return run

    monkeypatch.setattr(runners, "threads", counted)
    with pytest.raises(ss.Interrupted) as stopped:
        models.campaign().run(tmp_path / "x.zarr", chunk=10)
    partial = stopped.value.partial
    assert isinstance(stopped.value, KeyboardInterrupt)
    assert (partial.status != "pending").sum() == 40
    assert_same_bits(partial.isel(sample=slice(0, 40)), expected.isel(sample=slice(0, 40)))
    assert_same_bits(models.campaign().run(tmp_path / "x.zarr", chunk=3), expected)
    assert computed == [0, 1, 2, 3, -1, 4, 5, 6, 7, 8, 9]


def complete_chunks(path: Path) -> int:
    return len(list((path / "status" / "c").glob("*[0-9]")))


def run_and_kill(path: Path, samples: int, chunk: int, more: int) -> int:
    """Start a run in a process of its own, kill it when `more` chunks are complete; return how many are."""
    here, before = Path(models.__file__), complete_chunks(path)
    process = subprocess.Popen(
        [sys.executable, str(here), str(path), str(samples), str(chunk)], stdout=subprocess.DEVNULL
    )
    try:
        deadline = time.monotonic() + 60.0
        while (
            complete_chunks(path) < before + more and process.poll() is None and time.monotonic() < deadline
        ):
            time.sleep(0.001)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    return complete_chunks(path)


@pytest.mark.process
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs kill -9")
def test_a_killed_run_goes_on(tmp_path: Path) -> None:
    samples, chunk = 400, 5
    path = tmp_path / "x.zarr"
    complete = 0
    for more in (1, 3):
        found = run_and_kill(path, samples, chunk, more)
        assert complete + more <= found < samples // chunk
        complete = found
    touched = {mark: mark.stat().st_mtime_ns for mark in (path / "status" / "c").glob("*[0-9]")}
    study = models.campaign(samples=samples)
    assert_same_bits(study.run(path), study.run())
    # Nothing that was complete has been computed again.
    assert all(mark.stat().st_mtime_ns == when for mark, when in touched.items())


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"seed": 8}, "seed: 8 here, 7 there"),
        ({"samples": 128}, "samples: 128 here, 96 there"),
        ({"sampler": "sobol", "samples": 128}, "sampler:"),
        ({"duration": 0.2}, "settings.duration: 0.2 here, 0.15 there"),
        ({"outputs": ["period"]}, "outputs."),
        ({"fixed": {"damping": 2e-4}}, "model.fixed"),
    ],
    ids=lambda value: value if isinstance(value, str) else next(iter(value)),
)
def test_a_store_refuses_another_study(
    tmp_path_factory: pytest.TempPathFactory, changes: dict[str, object], named: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "refusing.zarr"
    models.campaign().run(path)
    with pytest.raises(ss.InputError, match="holds another study") as refused:
        models.campaign(**changes).run(path)
    assert named in str(refused.value)


def test_a_store_names_the_parameter_that_differs(tmp_path: Path) -> None:
    models.verdicts().run(tmp_path / "x.zarr")
    other = ss.Study(
        ss.models.two_subsystems,
        models.distributions(0.06),
        outputs=["eigenvalue", "growth_rate", "frequency", "unstable_modes"],
        samples=96,
        seed=7,
    )
    with pytest.raises(ss.InputError, match=r"parameters\.vertical_stiffness_1"):
        other.run(tmp_path / "x.zarr")


@pytest.mark.process
def test_a_store_holds_one_writer_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "x.txt").write_text("not a study")
    with pytest.raises(ss.InputError, match="not a study"):
        models.verdicts().run(tmp_path / "notes")
    study = models.verdicts()
    study.run(tmp_path / "x.zarr")
    with (
        store.opened(tmp_path / "x.zarr", study._layout(), 8),
        pytest.raises(ss.InputError, match="another process or thread is writing"),
    ):
        study.run(tmp_path / "x.zarr")
    holder = (
        "import sys, time; sys.path.insert(0, sys.argv[2]); import study_models as m;"
        "from stickslip.study.run import store; s = m.verdicts();"
        "held = store.ZarrStore(sys.argv[1], s._layout(), 8); print('held', flush=True); time.sleep(60)"
    )
    here = str(Path(models.__file__).parent)
    with subprocess.Popen(
        [sys.executable, "-c", holder, str(tmp_path / "x.zarr"), here], stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        with pytest.raises(ss.InputError, match="another process"):
            study.run(tmp_path / "x.zarr")
        process.kill()
    assert study.run(tmp_path / "x.zarr").sizes["sample"] == 96


def test_another_machine_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    models.verdicts().run(tmp_path / "x.zarr")
    here = store.Layout.__init__

    def elsewhere(self, *arguments):  # type: ignore[no-untyped-def]
        here(self, *arguments)
        self.machine = {**self.machine, "extensions": ["none"]}

    monkeypatch.setattr(store.Layout, "__init__", elsewhere)
    with pytest.warns(UserWarning, match="another machine.*extensions"):
        models.verdicts().run(tmp_path / "x.zarr")


def released_as(monkeypatch: pytest.MonkeyPatch, version: str) -> None:
    installed = identity.versions()
    monkeypatch.setattr(identity, "versions", lambda: {**installed, "stickslip": version})


def test_a_store_survives_a_patch_release(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    released_as(monkeypatch, "1.2.3")
    begun = models.verdicts().run(tmp_path / "x.zarr")
    released_as(monkeypatch, "1.2.10")
    with pytest.warns(UserWarning, match=r'another patch release.*stickslip: "1.2.10" here, "1.2.3" there'):
        continued = models.verdicts().run(tmp_path / "x.zarr")
    assert continued.equals(begun)


def test_a_store_of_another_minor_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    released_as(monkeypatch, "1.2.3")
    models.verdicts().run(tmp_path / "x.zarr")
    released_as(monkeypatch, "1.3.0")
    with pytest.raises(ss.InputError, match=r'another study; version: "1.3" here, "1.2" there'):
        models.verdicts().run(tmp_path / "x.zarr")


@pytest.mark.process
@pytest.mark.filterwarnings("default")
@pytest.mark.nightly
def test_dask_with_a_worker_killed_on_the_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")
    study = models.campaign(samples=600)
    victims: list[int] = []
    write = store.ZarrStore.write

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):

        def write_and_kill(self, chunk, columns):  # type: ignore[no-untyped-def]
            write(self, chunk, columns)
            if not victims:
                victims.append(next(iter(client.run(os.getpid).values())))
                os.kill(victims[0], signal.SIGKILL)

        monkeypatch.setattr(store.ZarrStore, "write", write_and_kill)
        client.run(sys.path.insert, 0, str(Path(models.__file__).parent))
        results = study.run(tmp_path / "x.zarr", client=client, chunk=20)
        assert victims
        assert victims[0] not in client.run(os.getpid).values()
    assert_same_bits(results, study.run())


def die(scene: ss.Scene) -> float:
    os._exit(1)


@pytest.mark.process
def test_what_is_complete_survives_lost_workers(tmp_path: Path) -> None:
    study = ss.Study(
        ss.models.two_subsystems,
        models.distributions(),
        outputs=["growth_rate", {"dead": Output(die, of="scene")}],
        samples=8,
    )
    with (
        ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool,
        pytest.raises(ss.StudyError, match="0 of 8 samples") as lost,
    ):
        study.run(tmp_path / "x.zarr", executor=pool, chunk=2)
    assert (lost.value.partial.status == "pending").all()


class Interrupting:
    """Values of a column at which Ctrl-C comes."""

    def __len__(self) -> int:
        raise KeyboardInterrupt


@pytest.mark.parametrize("kept_in", ["memory", "zarr"])
@pytest.mark.parametrize("name", ["growth_rate", "status"])
def test_ctrl_c_while_a_chunk_is_written_leaves_no_half_sample(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept_in: str, name: str
) -> None:
    inner = runners.threads

    def interrupted(count: int | None) -> runners.Runner:
        def run(evaluation, tasks):  # type: ignore[no-untyped-def]
            for k, columns in inner(count)(evaluation, tasks):
                yield k, {**columns, name: Interrupting()} if k == 2 else columns

        return run

    monkeypatch.setattr(runners, "threads", interrupted)
    with pytest.raises(ss.Interrupted, match="20 of 96 samples are complete") as stopped:
        models.verdicts().run(tmp_path / "x.zarr" if kept_in == "zarr" else None, chunk=10)
    partial = stopped.value.partial
    assert np.flatnonzero(partial.status != "pending").tolist() == list(range(20))


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT to one process")
def test_ctrl_c_during_a_chunk_keeps_what_is_done(tmp_path: Path) -> None:
    """Whole chunks are kept, all that were complete before, with the bits of an uninterrupted study."""
    samples, chunk, path = 4096, 16, tmp_path / "x.zarr"
    code = (
        "import sys; sys.path.insert(0, sys.argv[2]); import study_models as m, stickslip as ss\n"
        "try:\n"
        f"    m.campaign(samples={samples}).run(sys.argv[1], chunk={chunk})\n"
        "except ss.Interrupted as error:\n"
        "    print(str(error), '|', int((error.partial.status != 'pending').sum()))\n"
    )
    here = str(Path(models.__file__).parent)
    with subprocess.Popen(
        [sys.executable, "-c", code, str(path), here], stdout=subprocess.PIPE, text=True
    ) as process:
        while complete_chunks(path) < 3 and process.poll() is None:
            time.sleep(0.001)
        before = complete_chunks(path)
        process.send_signal(signal.SIGINT)
        answer, kept = process.communicate(timeout=120)[0].split("|")
    assert process.returncode == 0
    after = complete_chunks(path)
    assert 3 <= before <= after < samples // chunk
    assert int(kept) == after * chunk
    assert f"{int(kept)} of {samples} samples are complete" in answer
    stored, study = xr.open_zarr(path, consolidated=False), models.campaign(samples=samples)
    complete = np.flatnonzero(stored.status[::chunk] != "pending")
    assert complete.size == after
    for first in chunk * complete[:2]:
        alone = study.evaluation.columns(study.design[first : first + chunk], 1)
        assert alone["eigenvalue"].tobytes() == stored.eigenvalue.to_numpy()[first : first + chunk].tobytes()


def test_compiled_scenes_are_those_of_python() -> None:
    """The same bits from the family in compiled code and from scenes that Python makes."""
    study = models.campaign(samples=24)
    compiled = study.run()

    def model(**values: float) -> ss.Scene:
        return study.scene_of(list(values.values()))

    slow = ss.Study(
        model,
        models.distributions(),
        outputs=["unstable_modes", "amplitude", "period", "sequence", "contact_energy"],
        samples=24,
        seed=7,
        duration=0.15,
        further=0.15,
    ).run()
    for name in slow.data_vars:
        assert np.array_equal(slow[name], compiled[name], equal_nan=slow[name].dtype.kind == "f"), name


def test_outputs_are_those_of_the_functions_for_one_scene() -> None:
    study = models.campaign(
        samples=12,
        duration=0.6,
        outputs=[
            "growth_rate", "frequency", "unstable_modes", "eigenvalues", "normal_force", "hopf_point",
            "hopf_frequency", "events", "attractor", "amplitude", "period", "cycle_frequency", "statuses",
            "sequence", "largest_multiplier", "stability", "energy_per_cycle", "contact_energy",
            "slider_energy",
        ],
        hopf={"friction": (0.0, 3.0)},
    )  # fmt: skip
    results = study.run()
    seen = set()
    for k in range(study.size):
        row, scene = results.isel(sample=k), study.scene_of(study.design[k])
        modes = ss.complex_modes(scene)
        assert row.growth_rate.item() == pytest.approx(modes.eigenvalues.real.max(), rel=1e-9)
        assert row.unstable_modes.item() == modes.unstable.sum()
        assert (row.eigenvalues.to_numpy() == modes.with_conjugates.eigenvalues).all()
        first = next(
            p for p in ss.critical_points(scene, {"friction": (0.0, 3.0)}, kinds=("hopf",)) if p.direction > 0
        )
        assert row.hopf_point.item() == first.value
        assert row.hopf_frequency.item() == pytest.approx(first.frequency, rel=1e-15)
        run = ss.simulate(scene, 0.6, ss.disturbed_sliding(scene))
        assert row.events.item() == len(run.events)
        still = ss.steady_sliding(scene)
        forces = ss.simulate(scene, 1e-3, still).sample(0.0).normal_force.to_numpy()[0]
        assert row.normal_force.to_numpy() == pytest.approx(forces, rel=1e-9)
        seen.add(row.attractor.item())
        if row.attractor.item() != "cycle":
            continue
        cycle = run.limit_cycle()
        assert row.period.item() == cycle.period
        assert row.cycle_frequency.item() == cycle.frequency
        assert (row.amplitude.to_numpy() == cycle.amplitude.to_numpy()).all()
        assert row.sequence.item() == " ".join(cycle.combinations)
        assert row.statuses.item() == " ".join(sorted(set(cycle.combinations)))
        largest = np.abs(cycle.transverse_multipliers).max()
        assert row.largest_multiplier.item() == pytest.approx(largest, rel=1e-12)
        assert row.stability.item() == cycle.stability
        balance = cycle.balance()
        turnover = balance.turnover
        impacts = balance.contacts.impact_slider - balance.contacts.impact_friction
        through = (balance.contacts.work.sum("status") + impacts).to_numpy()
        assert row.contact_energy.to_numpy() == pytest.approx(through, abs=1e-12 * turnover)
        lost = balance.damping + balance.impact_loss
        assert row.energy_per_cycle.item() == pytest.approx(lost, abs=1e-12 * turnover)
        gained = row.contact_energy.sum().item() + balance.external
        assert row.energy_per_cycle.item() == pytest.approx(gained, abs=1e-9 * turnover)
        slider = (balance.contacts.slider.sum("status") + balance.contacts.impact_slider).to_numpy()
        assert row.slider_energy.to_numpy() == pytest.approx(slider, abs=1e-12 * turnover)
    assert seen >= {"cycle", "equilibrium"}


def test_failure_is_data() -> None:
    """A preload that pulls, a negative mass, few events allowed: each says why, the rest goes on."""
    study = ss.Study(
        ss.models.two_subsystems,
        {"preload_displacement": [-1e-3, 1e-3], "upper_mass_0": [-0.3, 0.3]},
        outputs=["growth_rate", "normal_force", "amplitude", "events"],
        duration=0.3,
        max_events=50,
    )
    results = study.run()
    assert results.status.to_numpy().tolist() == ["ill_posed", "no_equilibrium", "ill_posed", "max_events"]
    assert "would pull" in results.reason.item(1)
    assert "mass" in results.reason.item(0)
    # Where a contact would pull, the motion goes on with it open.
    assert results.events.to_numpy().tolist() == [-1, 0, -1, 50]
    # Without steady sliding there is no verdict on it.
    assert np.isnan(results.growth_rate).to_numpy().tolist() == [True, True, True, False]
    assert np.isnan(results.amplitude[[0, 2, 3]]).all()


def raises_often(friction: float) -> ss.Scene:
    if friction > 1.0:
        raise ArithmeticError("too much friction")
    return ss.models.two_subsystems(friction=friction)


def test_functions_may_raise() -> None:
    def refuses(run: ss.Trajectory) -> float:
        raise LookupError(f"{len(run.events)} events")

    study = ss.Study(
        raises_often,
        {"friction": [0.5, 0.8, 1.5]},
        outputs=["growth_rate", models.last_position, refuses],
        duration=0.05,
    )
    results = study.run()
    assert results.status.to_numpy().tolist() == ["error"] * 3
    assert results.reason.item(2) == "model: ArithmeticError: too much friction"
    assert results.reason.item(0).startswith("refuses: LookupError:")
    scene = ss.models.two_subsystems(friction=0.5)
    run = ss.simulate(scene, 0.05, ss.disturbed_sliding(scene))
    assert results.last_position.item(0) == run.state(0.05).position[0]
    assert np.isnan(results.last_position.item(2))


def test_own_outputs_of_cycles_and_scenes() -> None:
    study = ss.Study(
        ss.models.two_subsystems(),
        {"friction": [0.5, 1.5]},
        outputs=[
            "period",
            {
                "line": Output(lambda cycle: cycle.main_frequency(), of="cycle", units="Hz"),
                "masses": Output(lambda scene: scene.mass, of="scene", size=8),
                "first": Output(
                    lambda scene: ss.complex_modes(scene).eigenvalues[0], of="scene", dtype=complex
                ),
            },
        ],
        duration=0.6,
    )
    results = study.run()
    # No cycle is the answer to one question, not a failure of the sample.
    assert np.isnan(results.line.item(0))
    assert results.line.item(1) == pytest.approx(1.0 / results.period.item(1), rel=1e-12)
    assert results.masses.dims == ("sample", "masses_index")
    assert (results.masses.to_numpy()[0] == study.family.template.mass).all()
    assert results["first"].dtype == np.complex128


def test_a_grid_unfolds() -> None:
    study = ss.Study(ss.models.two_subsystems(), {"friction_0": [0.5, 1.0, 1.5], "friction_1": [1.0, 2.0]})
    table = ss.study.unstacked(study.run())
    assert table.growth_rate.dims == ("friction_0", "friction_1")
    scene = ss.models.two_subsystems(friction=(1.5, 2.0))
    rate = ss.complex_modes(scene).eigenvalues.real.max()
    assert table.growth_rate.sel(friction_0=1.5, friction_1=2.0).item() == pytest.approx(rate, rel=1e-10)


def test_parameters_of_chains_and_scenes_reach_their_places() -> None:
    part = ss.models.Subsystem(
        upper_mass=0.5, contact_mass=0.4, inclination=0.2, vertical_stiffness=3e5, horizontal_stiffness=4e5,
        ceiling_stiffness=1e5, preload_displacement=1e-3,
    )  # fmt: skip
    link = ss.models.Link(horizontal_stiffness=1e6, vertical_stiffness=2e5)
    fixed = {"subsystems": [part] * 3, "links": [link] * 2, "slider_speed": 0.1}
    names = (
        "upper_mass_1",
        "inclination",
        "link_vertical_stiffness_1",
        "friction_2",
        "damping",
        "wall_stiffness",
    )
    values = (0.7, 0.3, 5e5, 0.4, 2e-4, 3e6)
    study = ss.Study(
        ss.models.chain,
        {name: [value] for name, value in zip(names, values, strict=True)},
        fixed=fixed,
        outputs=["growth_rate", "normal_force"],
    )
    results = study.run()
    parts = [ss.models.Subsystem(**{**vars(part), "inclination": 0.3}) for _ in range(3)]
    parts[1] = ss.models.Subsystem(**{**vars(parts[1]), "upper_mass": 0.7})
    scene = ss.models.chain(
        parts,
        [link, ss.models.Link(horizontal_stiffness=1e6, vertical_stiffness=5e5)],
        wall_stiffness=3e6,
        friction=(0.0, 0.0, 0.4),
        slider_speed=0.1,
        damping=2e-4,
    )
    rate = ss.complex_modes(scene).eigenvalues.real.max()
    assert results.growth_rate.item() == pytest.approx(rate, rel=1e-9)
    assert (study.scene_of(study.design[0]).stiffness != scene.stiffness).nnz == 0
    # Static friction follows friction unless it is a parameter itself.
    stuck = ss.Study(ss.models.two_subsystems(), {"static_friction": [1.0, 2.0]}).run()
    assert stuck.status.to_numpy().tolist() == ["ill_posed", "ok"]


def scaled(weight: float) -> Callable[[ss.Scene], float]:
    return lambda scene: weight * float(scene.force[1])


def fingerprints_apart(*functions: Callable[..., object]) -> bool:
    found = [json.dumps(described_function(function)) for function in functions]
    assert found == [json.dumps(described_function(function)) for function in functions]
    return len(set(found)) == len(functions)


def test_functions_are_told_apart_by_what_they_carry() -> None:
    """Same source, other numbers: another study."""
    assert fingerprints_apart(scaled(1.0), scaled(2.0))
    assert fingerprints_apart(partial(max, 1.0), partial(max, 2.0), partial(min, 1.0))
    assert fingerprints_apart(
        lambda scene, weight=1.0: weight, lambda scene, weight=1.0, *, key=2: weight, np.array([1.0]).dot
    )

    def endless(count: int) -> object:
        return endless(count - 1)

    class Weighted:
        def __init__(self, weight: float) -> None:
            self.weight = weight

        def __call__(self, scene: ss.Scene) -> float:
            return self.weight

    assert fingerprints_apart(endless)
    assert described_function(raises_often) == described_function(raises_often)
    compiled = {}
    for name in ("first", "second"):
        exec(f"{name} = lambda scene: [force for force in scene.force if force > 1.0]", compiled)
    # Functions without source files differ by name, not by where they lie in memory.
    sources = {described_function(compiled[name])["source"] for name in ("first", "second")}
    assert len(sources) == 1


FINGERPRINT = """
import json
from stickslip.study.sample.fingerprint import described_function

class Limits:
    def __init__(self):
        self.names = {"friction", "speed", "gap", "mass"}
        self.table = {name: len(name) for name in self.names}
        self.owner = self

def carrying():
    limits, names = Limits(), {"friction", "speed", "gap", "mass"}
    table = {name: 1.0 for name in names}
    return lambda scene: (limits, names, table)

print(json.dumps(described_function(carrying())))
"""


@pytest.mark.process
def test_a_function_is_the_same_after_a_restart() -> None:
    """Sets are in the order of hashes of texts, which another process draws anew."""
    found = {
        subprocess.run(
            [sys.executable, "-c", FINGERPRINT],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(found) == 1


def test_a_partial_of_a_model_stays_compiled() -> None:
    parameters = {"friction_0": stats.uniform(0.3, 2.2), "damping": stats.uniform(5e-5, 1e-4)}
    given = {"inclination": (0.2, 0.6), "damping": 3e-4}
    study = ss.Study(partial(ss.models.two_subsystems, **given), parameters, samples=16)
    assert study.family.compiled(study.parameters.names)
    fixed = {"inclination": (0.2, 0.6)}
    other = ss.Study(ss.models.two_subsystems, parameters, samples=16, fixed=fixed)
    assert study.identity == other.identity
    assert_same_bits(study.run(), other.run())


def test_points_of_ones_own() -> None:
    points = np.random.default_rng(4).random((32, 3))
    study = models.verdicts(sampler=points, samples=None)
    friction = models.distributions()["friction"]
    assert (study.design[:, 0] == friction.ppf(points[:, 0])).all()
    assert study.run().sizes["sample"] == 32
    for wrong, message in (
        (points[:, :2], r"expected points of shape \(n, 3\), got \(32, 2\)"),
        (points + 1.0, "in the unit cube"),
        (points[0], "sampler"),
    ):
        with pytest.raises(ss.InputError, match=message):
            models.verdicts(sampler=wrong, samples=None)
    with pytest.raises(ss.InputError, match="without samples"):
        models.verdicts(sampler=points)


def test_a_store_refuses_other_draws_of_the_same_seed(tmp_path: Path) -> None:
    """As another version of a package may make them."""
    models.verdicts().run(tmp_path / "x.zarr")
    other = models.verdicts()
    other.design[5, 1] *= 1.0 + 1e-9
    with pytest.raises(ss.InputError, match=r"vertical_stiffness_1 of sample 5: .* other versions"):
        other.run(tmp_path / "x.zarr")
    other.design[5, 1] *= 1.0 - 1e-9
    assert other.run(tmp_path / "x.zarr").sizes["sample"] == 96


@pytest.mark.slow
def test_results_go_on_with_other_libraries(tmp_path: Path, expected: xr.Dataset) -> None:
    stored = models.campaign().run(tmp_path / "x.zarr")
    for results in (stored, expected):
        few = results.where(results.status == "ok", drop=True)
        assert few.sizes["sample"] == 96
        assert results.period.groupby(results.sequence).count().sum() == results.period.notnull().sum()
        table = results[["period", "sequence"]].to_dataframe()
        assert set(table.columns) >= {"period", "sequence", "friction"}
        assert copy.deepcopy(results).identical(results)
        assert pickle.loads(pickle.dumps(results)).identical(results)
        for suffix in ("nc", "zarr"):
            ss.save(results, tmp_path / f"results.{suffix}")
            again = ss.load(tmp_path / f"results.{suffix}")
            assert again.eigenvalue.to_numpy().tobytes() == expected.eigenvalue.to_numpy().tobytes()
            assert again.sequence.to_numpy().tolist() == expected.sequence.to_numpy().tolist()
    study = models.campaign()
    assert_same_bits(pickle.loads(pickle.dumps(study)).run(chunk=50), expected)
    assert repr(study) == (
        "Study(96 samples, random, seed 7: friction, vertical_stiffness_1, link_horizontal_stiffness"
        " -> eigenvalue, unstable_modes, amplitude, period, sequence, contact_energy)"
    )


@pytest.mark.parametrize("kind", [ss.StudyError, ss.Interrupted])
def test_errors_travel_with_what_is_done(kind: type[Exception], expected: xr.Dataset) -> None:
    error = pickle.loads(pickle.dumps(kind("12 of 96 samples", expected)))
    assert str(error) == "12 of 96 samples"
    assert error.partial.identical(expected)


@pytest.mark.process
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a terminal")
def test_progress_shows_rate_and_time_left() -> None:
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import study_models as m\n"
        "m.campaign(samples=600).run(chunk=10, threads=1)"
    )
    here = str(Path(models.__file__).parent)
    ours, theirs = os.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    with subprocess.Popen([sys.executable, "-c", code, here], stderr=theirs, env=environment) as process:
        os.close(theirs)
        shown = b""
        # Linux ends a terminal nobody writes to with an error.
        with contextlib.suppress(OSError):
            while part := os.read(ours, 4096):
                shown += part
        assert process.wait(60) == 0
    os.close(ours)
    lines = shown.decode()
    counts = [int(count) for count in re.findall(r"(\d+)/600", lines)]
    assert counts[0] == 0
    assert counts == sorted(counts)
    assert len(set(counts)) > 2
    assert re.search(r"\d/s .*0:00:\d\d", lines)


def test_growth_of_a_longer_design_begins_with_the_shorter_one() -> None:
    for sampler in ("random", "sobol"):
        short, long = unit_design(sampler, 16, 3, 5, {}), unit_design(sampler, 64, 3, 5, {})
        assert (long[:16] == short).all()
    assert not (unit_design("random", 16, 3, 5, {}) == unit_design("random", 16, 3, 6, {})).any()
    strata = np.sort(unit_design("latin_hypercube", 50, 2, 1, {}) * 50, axis=0).astype(int)
    assert (strata == np.arange(50)[:, None]).all()
    with pytest.warns(UserWarning, match="powers of two"):
        unit_design("sobol", 100, 2, 1, {})


def test_correlated_parameters() -> None:
    marginals = (stats.uniform(1.0, 1.0), stats.lognorm(0.3, scale=1e5))
    copula = GaussianCopula(marginals, [[1.0, 0.8], [0.8, 1.0]])
    normal = stats.multivariate_normal([1e6, 2e5], [[1e10, -6e8], [-6e8, 1e8]])
    study = ss.Study(
        ss.models.two_subsystems,
        {
            ("friction", "ceiling_stiffness_0"): copula,
            ("wall_stiffness", "link_vertical_stiffness"): normal,
        },
        samples=2**14,
        sampler="sobol",
    )
    friction, ceiling, wall, link = study.design.T
    expected = 6.0 / np.pi * np.arcsin(0.4)
    # Sobol' points: errors far below those of 2^14 independent samples, 1 / 128.
    assert stats.spearmanr(friction, ceiling)[0] == pytest.approx(expected, abs=2e-3)
    assert stats.kstest(friction, marginals[0].cdf).statistic < 2e-3
    assert stats.kstest(ceiling, marginals[1].cdf).statistic < 2e-3
    assert np.cov(wall, link) == pytest.approx(normal.cov_object.covariance, rel=1e-2)
    mean, covariance = study.parameters.moments()
    sampled = np.cov(study.design.T)
    assert mean == pytest.approx(study.design.mean(axis=0), rel=1e-3)
    # Across the two sets only the rounding of the design is left.
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert np.abs(covariance - sampled).max() == pytest.approx(0.0, abs=1e-2 * scale.max())
    assert np.abs((covariance - sampled) / scale).max() < 1e-2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"parameters": {}}, "parameters: expected at least one"),
        (
            {"parameters": {"fricton": stats.norm(1.0)}},
            "fricton: the model has no such parameter; nearest: friction",
        ),
        ({"parameters": {"friction": stats.norm}}, "friction: .*freeze it"),
        ({"parameters": {"friction": "high"}}, "friction: expected a frozen"),
        ({"parameters": {"friction": stats.norm(1.0), "damping": [1.0]}}, "either a grid or not"),
        ({"parameters": {"friction": stats.norm(1), "friction_0": stats.norm(1)}}, "set the same number"),
        ({"parameters": {("friction_0", "friction_1"): stats.norm(1.0)}}, "expected a GaussianCopula"),
        ({"outputs": []}, "outputs: expected at least one"),
        ({"outputs": ["growthrate"]}, "unknown output 'growthrate'; nearest: growth_rate"),
        ({"outputs": ["amplitude"]}, "duration: outputs of motions need it"),
        ({"outputs": ["amplitude"], "duration": -1.0}, "duration: expected a positive"),
        ({"outputs": ["hopf_point"]}, "hopf: expected the friction"),
        (
            {"outputs": ["hopf_point"], "hopf": {"damping": (0.0, 1.0)}},
            "hopf: expected the friction",
        ),
        ({"samples": 0}, "samples: expected an integer >= 1, got 0"),
        ({"samples": 2.5}, "samples: expected an integer >= 1, got 2.5"),
        ({"seed": -1}, "seed: expected an integer >= 0"),
        ({"sampler": "halton"}, "sampler: expected one of"),
        ({"sampler": "grid"}, "do not go together"),
        ({"sampler": "sobol", "sampler_options": {"levels": 4}}, "'sobol' takes"),
        ({"fixed": {"friction": 1.0}}, "is a parameter of the study as well"),
        ({"fixed": {"lable": "printed"}}, "has no argument 'lable'"),
        ({"combination": "+++"}, "combination: expected one letter"),
        ({"model": 3}, "model: expected a Scene or a function"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_bad_arguments_are_named(arguments: dict[str, object], message: str) -> None:
    good: dict[str, object] = {
        "model": ss.models.two_subsystems,
        "parameters": {"friction": stats.uniform(0.3, 2.2)},
        "samples": 4,
    }
    with pytest.raises(ss.InputError, match=message):
        ss.Study(**(good | arguments))  # type: ignore[arg-type]


@pytest.mark.process
def test_a_design_that_memory_does_not_hold_is_an_input_error() -> None:
    with pytest.raises(ss.InputError, match=f"samples: {10**15} would take .* GiB, of .* GiB of memory"):
        models.verdicts(samples=10**15)


def test_bad_arguments_of_a_run_are_named() -> None:
    study = models.verdicts()
    for arguments, message in (
        ({"threads": 0}, "threads: expected an integer >= 1"),
        ({"chunk": 0}, "chunk: expected"),
        ({"executor": 3}, "executor: expected"),
        ({"client": 3}, "client: expected"),
        ({"threads": 1, "client": 3}, "one of threads, executor and client"),
    ):
        with pytest.raises(ss.InputError, match=message):
            study.run(**arguments)  # type: ignore[arg-type]
    lambdas = ss.Study(lambda friction: ss.models.two_subsystems(friction=friction), {"friction": [1.0]})
    with ProcessPoolExecutor(1) as pool, pytest.raises(ss.InputError, match="cannot be sent"):
        lambdas.run(executor=pool)


def test_moments_to_first_order_are_those_of_monte_carlo() -> None:
    """At a spread of 0.5 % the terms left out are a few 1e-3 of the deviation."""
    spread = 5e-3
    nominal = {"friction": 1.0, "wall_stiffness": 1.8e6, "vertical_stiffness_1": 3e4, "damping": 1e-4}
    study = ss.Study(
        ss.models.two_subsystems,
        {name: stats.norm(value, spread * value) for name, value in nominal.items()},
        outputs=["eigenvalues"],
        samples=2**12,
        sampler="sobol",
    )
    moments = study.eigenvalue_moments()
    values = study.run().eigenvalues.to_numpy()[:, ::2]
    assert moments.eigenvalue.to_numpy() == pytest.approx(values.mean(axis=0), rel=1e-3)
    assert moments.growth_deviation.to_numpy() == pytest.approx(values.real.std(axis=0), rel=0.02)
    frequency = np.abs(values).std(axis=0) / (2.0 * np.pi)
    assert moments.frequency_deviation.to_numpy() == pytest.approx(frequency, rel=0.02)
    assert moments.share.sum("parameter").to_numpy() == pytest.approx(1.0)
