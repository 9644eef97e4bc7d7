"""Studies: samples per second beside loops of scipy over a part of the samples, and memory over their number.

The parameters are those of `examples/uncertain_brake.py`. Verdicts: the loop gets the reduced matrices
as sums of constant matrices times stiffness and friction, so that all it does per sample is that sum and
`scipy.linalg.eigvals`; the same with one call for the whole stack stands beside it. Cycles: scipy's DOP853
follows the same motion from event to event over the same 0.6 s, without refining the orbit.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy.linalg
from batch_throughput import peak
from numpy.typing import NDArray

import stickslip as ss
from report import Report, arguments
from stickslip import types

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))
from peers.solve_ivp import prepare
from uncertain_model import STIFFNESSES, parameters

Real = NDArray[np.float64]

VERDICTS, CYCLES = 1_000_000, 10_000
#: Samples of the loops.
LOOPED, FOLLOWED = 2000, 3
DURATION, RTOL = 0.6, 1e-9
#: s, the targets on two cores
WITHIN = {VERDICTS: 60.0, CYCLES: 30.0}
#: Numbers of verdicts whose memory is compared.
MEMORY = (100_000, 1_000_000)


def verdicts(samples: int) -> ss.Study:
    return ss.Study(
        ss.models.two_subsystems,
        parameters(),
        outputs=["growth_rate", "frequency", "unstable_modes"],
        samples=samples,
        seed=1,
    )


def cycles(samples: int) -> ss.Study:
    return ss.Study(
        ss.models.two_subsystems,
        parameters(),
        outputs=["attractor", "amplitude", "period", "statuses"],
        samples=samples,
        seed=1,
        duration=DURATION,
    )


class Sliding:
    """Companion matrices of the sliding model, as an expert assembles them once the model is known."""

    def __init__(self) -> None:
        def reduced(friction: float, values: Real) -> types.Reduced:
            study = verdicts(1)
            return ss.equations_of(study.scene_of(np.array([friction, *values])), "++")

        base = np.array(list(STIFFNESSES.values()))
        plain, rubbed = reduced(0.0, base), reduced(1.0, base)
        self.mass = np.asarray(plain.mass)
        if not np.array_equal(self.mass, rubbed.mass):
            raise SystemExit("mass depends on friction: the loop has to be written anew")
        sums = []
        for k in range(len(base)):
            moved = base.copy()
            moved[k] += base[k]
            without = (np.asarray(reduced(0.0, moved).stiffness) - plain.stiffness) / base[k]
            both = (np.asarray(reduced(1.0, moved).stiffness) - rubbed.stiffness) / base[k]
            sums.append((without, both - without))
        self.plain = np.array([one for one, _ in sums])
        self.rubbed = np.array([other for _, other in sums])
        self.beta = 1e-4

    def companion(self, row: Real) -> Real:
        """Return the matrix of x' = A x for a row of friction and stiffnesses."""
        size = len(self.mass)
        stiffness = np.tensordot(row[1:], self.plain + row[0] * self.rubbed, 1)
        scaled = np.linalg.solve(self.mass, stiffness)
        whole = np.zeros((2 * size, 2 * size))
        whole[:size, size:] = np.eye(size)
        whole[size:, :size], whole[size:, size:] = -scaled, -self.beta * scaled
        return whole


def run_timed(study: ss.Study, threads: int) -> tuple[float, float, object]:
    """Return time, processor time and results."""
    begin, processor = time.perf_counter(), time.process_time()
    results = study.run(threads=threads, progress=False)
    return time.perf_counter() - begin, time.process_time() - processor, results


def compare_verdicts(samples: int, report: Report) -> None:
    """Add the table of verdicts."""
    study, model = verdicts(samples), Sliding()
    verdicts(2000).run(progress=False)  # loads what is loaded once
    rows = study.design[: min(LOOPED, samples)]
    begin = time.process_time()
    looped = np.array(
        [scipy.linalg.eigvals(model.companion(row), check_finite=False).real.max() for row in rows]
    )
    loop = (time.process_time() - begin) / len(rows)
    begin = time.process_time()
    np.linalg.eigvals(np.array([model.companion(row) for row in rows]))
    stack = (time.process_time() - begin) / len(rows)
    table = []
    for threads in (1, 2):
        elapsed, processor, results = run_timed(study, threads)
        each = processor / samples
        table.append(
            [
                f"stickslip, {threads} threads",
                f"{samples / elapsed:.3g}",
                f"{elapsed:.1f}",
                f"{1e6 * each:.2f}",
                "1",
            ]
        )
    rates = results.growth_rate.to_numpy()[: len(rows)]
    table.append(
        ["scipy.linalg.eigvals, a loop", f"{1 / loop:.3g}", "-", f"{1e6 * loop:.1f}", f"{loop / each:.0f}"]
    )
    table.append(
        [
            "numpy.linalg.eigvals, a stack",
            f"{1 / stack:.3g}",
            "-",
            f"{1e6 * stack:.1f}",
            f"{stack / each:.0f}",
        ]
    )
    report.table(("stability", "samples/s", "s", "processor time per sample, us", "ratio"), table)
    scale = np.abs(looped).max()
    report.text(
        f"{samples} samples, {int((results.growth_rate > 0).sum())} unstable, {elapsed:.1f} s on two threads",
        f"(target <= {WITHIN[VERDICTS]:g} s for {VERDICTS}); growth rates differ from scipy's by at most",
        f"{np.abs(rates - looped).max() / scale:.1e} of the largest.",
    )


def compare_cycles(samples: int, report: Report) -> None:
    """Add the table of limit cycles."""
    study = cycles(samples)
    cycles(4).run(progress=False)
    spent, events = 0.0, 0
    for row in study.design[:FOLLOWED]:
        scene = study.scene_of(row)
        motion = prepare(scene, ss.disturbed_sliding(scene), DURATION, "DOP853", RTOL)
        begin = time.process_time()
        events += len(motion().time)
        spent += time.process_time() - begin
    loop = spent / FOLLOWED
    table = []
    for threads in (1, 2):
        elapsed, processor, results = run_timed(study, threads)
        each = processor / samples
        table.append(
            [
                f"stickslip, {threads} threads",
                f"{samples / elapsed:.0f}",
                f"{elapsed:.1f}",
                f"{1e3 * each:.2f}",
                "1",
            ]
        )
    table.append(
        [f"scipy DOP853, rtol {RTOL:g}", f"{1 / loop:.2g}", "-", f"{1e3 * loop:.0f}", f"{loop / each:.0f}"]
    )
    report.table(("limit cycles", "samples/s", "s", "processor time per sample, ms", "ratio"), table)
    kinds, counts = np.unique(results.attractor.to_numpy(), return_counts=True)
    found = ", ".join(
        f"{count} {kind or 'without answer'}" for kind, count in zip(kinds, counts, strict=True)
    )
    report.text(
        f"{samples} samples of {DURATION:g} s ({found}), {elapsed:.1f} s on two threads",
        f"(target <= {WITHIN[CYCLES]:g} s for {CYCLES});",
        f"the loop over {FOLLOWED} of them has {events} events and refines no orbit.",
    )


def memory(counts: tuple[int, ...], report: Report) -> None:
    """Add the table of peaks, each of a process of its own that writes to a store."""
    table = []
    for count in counts:
        command = [sys.executable, __file__, "--only-store", str(count)]
        answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
        table.append([str(count), *answer])
    headings = ("samples into a store", "peak memory, MB", "after the design, MB", "design matrix, MB")
    report.table(headings, table)


def only_store(count: int) -> None:
    """Run verdicts into a store, and print peak memory, that with the design alone, and its matrix."""
    study = verdicts(count)
    before = peak()
    with tempfile.TemporaryDirectory() as directory:
        study.run(Path(directory) / "x.zarr", progress=False)
        print(f"{peak():.0f} {before:.0f} {study.design.nbytes / 1e6:.0f}")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="a hundredth of the samples")
    parser.add_argument("--only-store", type=int, default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.only_store is not None:
        only_store(options.only_store)
        return
    part = 100 if options.quick else 1
    report = Report("studies")
    compare_verdicts(VERDICTS // part, report)
    compare_cycles(CYCLES // part, report)
    memory(tuple(count // part for count in MEMORY), report)
    report.finish(options.into, "stickslip", "numpy", "scipy", "zarr")


if __name__ == "__main__":
    main()
