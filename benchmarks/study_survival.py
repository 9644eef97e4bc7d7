"""Studies killed at random moments: the same bits, and nothing computed twice that was complete.

Every study is begun in a process of its own, killed by SIGKILL at a random moment between its first chunk and
its last, and continued. Threads, chunks, an executor and a dask cluster of separate processes, one of them
killed on the way, give the same bits as well.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import xarray as xr

from report import Report, arguments

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))
import study_models as models

SAMPLES, CHUNK = 400, 7
#: Time limit of what should take seconds, s.
PATIENCE = 300.0


def same(results: xr.Dataset, expected: xr.Dataset) -> bool:
    """Return whether two studies are equal to the last bit."""
    return results.load().identical(expected) and all(
        results[name].to_numpy().tobytes() == variable.to_numpy().tobytes()
        for name, variable in expected.variables.items()
        if variable.dtype.kind in "fci"
    )


def marks(path: Path) -> dict[Path, int]:
    """Return the marks of complete chunks with the times at which they were written."""
    place = path / "status" / "c"
    return {mark: mark.stat().st_mtime_ns for mark in place.glob("*[0-9]")} if place.exists() else {}


def killed(path: Path, complete: int, after: float) -> None:
    """Begin the study in another process, and kill it that long after so many chunks were complete."""
    command = [sys.executable, models.__file__, str(path), str(SAMPLES), str(CHUNK)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline and process.poll() is None:
            if path.exists() and len(marks(path)) >= complete:
                break
            time.sleep(0.001)
        time.sleep(after)
        process.send_signal(signal.SIGKILL)


def kills(count: int, expected: xr.Dataset, length: float, report: Report) -> bool:
    """Add what became of studies killed at random moments; return whether all of it is as it should be."""
    rng = np.random.default_rng()
    complete, equal, repeated = [], 0, 0
    chunks = -(-SAMPLES // CHUNK)
    for moment in rng.random(count) * (chunks - 1):
        with tempfile.TemporaryDirectory() as directory:
            path = Path(directory) / "x.zarr"
            killed(path, int(moment), (moment % 1.0) * length / chunks)
            before = marks(path)
            complete.append(len(before))
            equal += same(models.campaign(samples=SAMPLES).run(path, progress=False), expected)
            after = marks(path)
            repeated += sum(after[mark] != when for mark, when in before.items())
    report.text(
        f"{count} studies of {SAMPLES} samples in {chunks} chunks, killed after",
        f"{min(complete)} to {max(complete)} chunks and continued:",
        f"{equal} of {count} equal to the last bit, {repeated} chunks computed again that were complete.",
    )
    return equal == count and repeated == 0


def backends(expected: xr.Dataset, report: Report) -> bool:
    """Add the comparison of threads, chunks, executor and cluster."""
    study = models.campaign(samples=SAMPLES)
    ways = {
        f"{threads} threads, chunks of {chunk}": study.run(threads=threads, chunk=chunk, progress=False)
        for threads in (1, 2)
        for chunk in (CHUNK, 1000)
    }
    # Threads of a forked process would wait for threads that it does not have.
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        ways["2 processes"] = study.run(executor=pool, chunk=CHUNK, progress=False)
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        print("distributed is not installed: dask left out (pip install 'stickslip[dask]')", file=sys.stderr)
    else:
        with (
            LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):
            client.run(sys.path.insert, 0, str(Path(models.__file__).parent))
            ways["dask"] = study.run(client=client, chunk=CHUNK, progress=False)
            victim = next(iter(client.run(os.getpid).values()))
            os.kill(victim, signal.SIGKILL)
            ways["dask, a worker killed"] = study.run(client=client, chunk=CHUNK, progress=False)
    alike = {way: same(results, expected) for way, results in ways.items()}
    other = [way for way, right in alike.items() if not right]
    report.text(
        f"Beside one thread with chunks of {CHUNK}: {', '.join(alike)}:",
        f"{'equal to the last bit' if not other else 'DIFFERENT with ' + ', '.join(other)}.",
    )
    return not other


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--kills", type=int, default=20, help="studies killed (default: %(default)s)")
    options = parser.parse_args()
    report = Report("study-survival")
    study = models.campaign(samples=SAMPLES)
    begin = time.perf_counter()
    expected = study.run(chunk=CHUNK, threads=1, progress=False)
    length = time.perf_counter() - begin
    right = backends(expected, report)
    right = kills(options.kills, expected, length, report) and right
    report.finish(options.into, "stickslip", "xarray", "zarr")
    if not right:
        raise SystemExit("studies differ")


if __name__ == "__main__":
    main()
