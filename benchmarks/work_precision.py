"""Run time against error on the standard run, for this program and its peers.

Every program follows the same scene from the same start through 312 events in 0.6 s. The error is the largest
of the times of events 2 to 41 against the 220-bit reference solution; an event is missed where none of the
same contact, kind and new combination lies within 0.1 ms. Compilation and set-up are apart.

The programs take turns, round by round, so that whatever else the machine does hits all alike; what takes
long has fewer turns. Times are processor time of the process, the least over all rounds and the median.
"""

from __future__ import annotations

import importlib
import importlib.util
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from clock import clocked

import stickslip as ss
from report import Report, arguments, left_out

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))
from reference_runs import reference_solution

#: s: what is further from its reference is another event; two of a contact and kind are 7 ms apart.
WINDOW = 1e-4
#: Events whose error counts: those of the growth to the limit cycle, without the first.
COUNTED = slice(1, 41)
#: Rounds, and the processor time, s, that one program may take in all of them.
ROUNDS, BUDGET = 40, 6.0
#: s; what takes less is run a few times in a row in each round, and the best of these counts.
SHORT, IN_A_ROW = 0.02, 3


@dataclass
class Entry:
    """One program with one setting."""

    program: str
    setting: str
    #: makes the run; what it does is set-up
    prepare: Callable[[], Callable[[], Any]]
    run: Callable[[], Any] = field(init=False)
    #: s
    set_up: float = 0.0
    times: list[float] = field(default_factory=list)
    #: s, of the events counted; nan where one is missed
    error: float = np.nan
    worst: float = np.nan
    missed: int = 0
    invented: int = 0

    @property
    def name(self) -> str:
        return f"{self.program}, {self.setting}"


def stickslip_entries(reference: Any) -> list[Entry]:
    """Warm: the scene has been run before. Cold: it knows nothing yet."""
    scene, start, duration = reference.scene, reference.start, reference.duration

    def warm(method: str) -> Callable[[], Any]:
        return lambda: ss.simulate(scene, duration, start, method=method)

    def cold() -> Callable[[], Any]:
        return lambda: ss.simulate(scene.replace(), duration, start)

    return [
        Entry("stickslip", "warm", lambda: warm("auto")),
        Entry("stickslip", "cold", cold),
        Entry("stickslip", "Taylor series", lambda: warm("taylor")),
    ]


def peer_entries(reference: Any) -> list[Entry]:
    """Every program that is installed."""
    given = (reference.scene, reference.start, reference.duration)
    peers: list[tuple[str, str, str, list[tuple[str, tuple[Any, ...]]]]] = [
        (
            "heyoka",
            "heyoka",
            "taylor",
            [("tol = eps", (0.0,)), ("tol 1e-12", (1e-12,)), ("tol 1e-9", (1e-9,)), ("tol 1e-6", (1e-6,))],
        ),
        (
            "numba",
            "numba DOPRI5",
            "fixed_step",
            [(f"h = {h:g} s", (h,)) for h in (2e-4, 1e-4, 3e-5, 1e-5, 3e-6)],
        ),
    ]
    peers += [
        ("scikit-sundae", f"CVODE {method}", "cvode", [(f"rtol {r:.0e}", (method, r)) for r in tolerances])
        for method, tolerances in (("Adams", (1e-6, 1e-9, 1e-12)), ("BDF", (1e-6, 1e-9, 1e-12)))
    ]
    peers += [
        ("scipy", f"scipy {method}", "solve_ivp", [(f"rtol {r:.0e}", (method, r)) for r in tolerances])
        for method, tolerances in (
            ("DOP853", (1e-6, 1e-9, 1e-12)),
            ("RK45", (1e-6, 1e-9, 1e-12)),
            ("LSODA", (1e-6, 1e-9, 1e-12)),
            ("Radau", (1e-4, 1e-6, 1e-8)),
        )
    ]
    entries = []
    modules = {"scikit-sundae": "sksundae"}
    for package, program, peer, settings in peers:
        if importlib.util.find_spec(modules.get(package, package)) is None:
            left_out(package, program)
            continue
        prepare = importlib.import_module(f"peers.{peer}").prepare
        entries += [Entry(program, name, partial(prepare, *given, *options)) for name, options in settings]
    return entries


def judge(entry: Entry, found: Any, reference: Any) -> None:
    """Compare a run with the reference, event by event."""
    if isinstance(found, ss.Trajectory):
        found = found.events
    times, contact, kind, after = map(np.asarray, (found.time, found.contact, found.kind, found.combination))
    error = np.full(len(reference.time), np.nan)
    used = set()
    for k, at in enumerate(reference.time):
        same = (contact == reference.contact[k]) & (kind == reference.kind[k])
        alike = np.flatnonzero(same & (after == reference.combination[k]))
        if alike.size:
            nearest = alike[np.argmin(np.abs(times[alike] - at))]
            if abs(times[nearest] - at) <= WINDOW and nearest not in used:
                error[k] = abs(times[nearest] - at)
                used.add(nearest)
    entry.missed = int(np.isnan(error).sum())
    entry.invented = len(times) - len(used)
    entry.error, entry.worst = float(error[COUNTED].max()), float(error.max())


def measure(entries: list[Entry], reference: Any, rounds: int, budget: float) -> None:
    """Fill in the entries."""
    for entry in entries:
        begin = time.process_time()
        entry.run = entry.prepare()
        found = entry.run()
        first = time.process_time() - begin
        judge(entry, found, reference)
        entry.times.append(clocked(entry.run)[0])
        entry.set_up = first - entry.times[0]
    strides = [max(1, round(rounds * entry.times[0] / budget)) for entry in entries]
    for turn in range(rounds):
        for entry, stride in zip(entries, strides, strict=True):
            if turn % stride == 0:
                again = IN_A_ROW if entry.times[0] < SHORT else 1
                entry.times.append(min(clocked(entry.run)[0] for _ in range(again)))


def milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g}" if seconds < 1.0 else f"{1e3 * seconds:.0f}"


def rows(entries: list[Entry]) -> list[list[str]]:
    """Rows of the table; ratios are to the first entry."""
    table = []
    for entry in entries:
        least = min(entry.times)
        ratio = least / min(entries[0].times)
        ours = entry.program == "stickslip"
        table.append(
            [
                entry.name,
                milliseconds(least),
                milliseconds(statistics.median(entry.times)),
                f"{ratio:.2f}" if ratio < 9.95 else f"{ratio:.0f}",
                "missed" if np.isnan(entry.error) else f"{entry.error:.1e}",
                "missed" if np.isnan(entry.worst) else f"{entry.worst:.1e}",
                str(entry.missed),
                str(entry.invented),
                "-" if ours else f"{max(entry.set_up, 0.0):.1f}",
            ]
        )
    return table


HEADINGS = (
    "program",
    "ms",
    "median ms",
    "x warm",
    "error, s",
    "all events, s",
    "missed",
    "invented",
    "set-up, s",
)


def headline(entries: list[Entry], folder: Path | None) -> None:
    """Print what the README says of this table."""
    named = {entry.name: entry for entry in entries}
    ours = named["stickslip, warm"]
    ratios = {
        program: min(named[f"{program}, {setting}"].times) / min(ours.times)
        for program, setting in (("heyoka", "tol = eps"), ("scipy DOP853", "rtol 1e-12"))
        if f"{program}, {setting}" in named
    }
    beside = " and ".join(f"{program} needs {ratio:.0f} times as long" for program, ratio in ratios.items())
    report = Report("headline")
    report.text(
        f"**{milliseconds(min(ours.times))} ms for 312 events, each within {ours.worst:.1e} s** of a",
        f"solution with 220 bits: 0.6 s of the published model. {beside}.",
    )
    report.finish(folder, "stickslip")


#: Settings that the table leaves out.
IN_THE_FIGURE_ALONE = {
    "heyoka, tol 1e-12",
    "heyoka, tol 1e-9",
    *(f"numba DOPRI5, h = {h:g} s" for h in (1e-4, 3e-5, 3e-6)),
    *(f"CVODE {method}, rtol {rtol}" for method in ("Adams", "BDF") for rtol in ("1e-06", "1e-09")),
    *(f"scipy {method}, rtol {rtol}" for method in ("RK45", "LSODA") for rtol in ("1e-06", "1e-09")),
    "scipy DOP853, rtol 1e-09",
    *(f"scipy Radau, rtol {rtol}" for rtol in ("1e-04", "1e-06")),
}
#: Marker and colour of each program.
STYLES = {
    "stickslip": ("*", "#c1272d"),
    "heyoka": ("o", "#0072b2"),
    "numba DOPRI5": ("s", "#009e73"),
    "CVODE Adams": ("^", "#e69f00"),
    "CVODE BDF": ("v", "#b8860b"),
    "scipy DOP853": ("D", "#7f3c8d"),
    "scipy RK45": ("P", "#cc79a7"),
    "scipy LSODA": ("X", "#666666"),
    "scipy Radau": ("h", "#aaaaaa"),
}


def draw(entries: list[Entry], path: Path) -> None:
    """Time over error, both logarithmic; a hollow marker at the right edge: events missed."""
    figure, axes = plt.subplots(figsize=(8.0, 5.6), layout="constrained")
    errors = [entry.error for entry in entries if not np.isnan(entry.error)]
    edge = 10.0 * max(errors)
    for program, (marker, colour) in STYLES.items():
        mine = [entry for entry in entries if entry.program == program]
        if not mine:
            continue
        good = [entry for entry in mine if not np.isnan(entry.error)]
        bad = [entry for entry in mine if np.isnan(entry.error)]
        size = 15 if program == "stickslip" else 8
        line = "none" if program == "stickslip" else "-"
        axes.plot(
            [max(entry.error, 1e-16) for entry in good],
            [1e3 * min(entry.times) for entry in good],
            marker=marker,
            color=colour,
            markersize=size,
            linestyle=line,
            label=program,
        )
        axes.plot(
            [edge] * len(bad),
            [1e3 * min(entry.times) for entry in bad],
            marker=marker,
            markerfacecolor="none",
            color=colour,
            markersize=size,
            linestyle="none",
        )
        if program == "stickslip":
            for entry in good:
                axes.annotate(
                    entry.setting,
                    (entry.error, 1e3 * min(entry.times)),
                    xytext=(11, -4),
                    textcoords="offset points",
                    color=colour,
                )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("largest error of the times of events 2 to 41, s (hollow: events missed)")
    axes.set_ylabel("processor time, ms")
    axes.grid(which="major", color="#dddddd")
    axes.set_axisbelow(True)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    ss.save(figure, path, dpi=130)
    plt.close(figure)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="few rounds, nothing that takes over a second")
    parser.add_argument("--figure", type=Path, default=None, help="where to write the figure")
    options = parser.parse_args()
    reference = reference_solution("paper-mu1.5-v0.025")
    entries = stickslip_entries(reference) + peer_entries(reference)
    if options.quick:
        slow = ("CVODE BDF", "scipy RK45", "scipy LSODA", "scipy Radau")
        entries = [entry for entry in entries if entry.program not in slow]
    measure(entries, reference, *((8, 1.0) if options.quick else (ROUNDS, BUDGET)))

    report = Report("work-precision")
    report.table(HEADINGS, rows([entry for entry in entries if entry.name not in IN_THE_FIGURE_ALONE]))
    used = ["stickslip", "numpy", "scipy"]
    used += [package for package in ("heyoka", "numba", "scikit-sundae") if _installed(package)]
    report.finish(options.into, *used)
    headline(entries, options.into)
    if options.figure is not None:
        draw(entries, options.figure)


def _installed(package: str) -> bool:
    try:
        importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


if __name__ == "__main__":
    main()
