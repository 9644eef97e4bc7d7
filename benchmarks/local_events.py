"""What an event costs by local marches: over the size of a chain, and beside marches of the whole scene.

The chains and their starts are those of `chains.py`. Work is counted: coordinates whose series were
expanded, and event functions looked at. Small chains run from several starts.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from batch_throughput import peak
from chains import on_cycles, scene_of, settled

import stickslip as ss
from report import Report, arguments

#: Subsystems, and s of motion of each.
SIZES, MOTION = (100, 300, 1000, 3000, 10_000, 30_000, 100_000), 1e-3
#: Up to here the whole is marched as well.
WHOLE = 1000
#: The comparison: subsystems and motion, s.
COMPARED, LONG = 1000, 0.05


def cost(run: ss.Trajectory, count: int, method: str) -> list[float]:
    """Return expansions, functions looked at and processor time, s, per event."""
    events = 0
    work = np.zeros(3)
    for start in range(max(1, 1000 // count)):
        scene, state = scene_of(count), on_cycles(run, count, seed=start)
        begin = time.process_time()
        found = ss.simulate(scene, MOTION, state, method=method)
        spent = time.process_time() - begin
        events += len(found.events)
        work += [found.counters["expansions"], found.counters["refinements"], spent]
    return list(work / events)


def scaling(sizes: tuple[int, ...], report: Report, figure: Path | None) -> None:
    """Add the table, the exponents and the picture of the cost over the size."""
    run = settled()
    local = {count: cost(run, count, "local") for count in sizes}
    whole = {count: cost(run, count, "taylor") for count in sizes if count <= WHOLE}
    rows = []
    for count in sizes:
        expansions, functions, seconds = local[count]
        beside = f"{1e3 * whole[count][2]:.3f}" if count in whole else ""
        rows.append([str(count), f"{expansions:.1f}", f"{functions:.1f}", f"{1e3 * seconds:.3f}", beside])
    headings = ("subsystems", "coordinates expanded per event", "functions looked at per event")
    report.table((*headings, "local, ms per event", "whole scene, ms per event"), rows)
    logs = np.log(sizes)
    exponents = [np.polyfit(logs, np.log([local[count][k] for count in sizes]), 1)[0] for k in range(3)]
    report.text(
        f"Exponents over the size: {exponents[0]:.3f} of the coordinates expanded, {exponents[1]:.3f} of the",
        f"functions looked at (target below 0.05), {exponents[2]:.3f} of the time (target below 0.25).",
        f"The largest chain has {4 * sizes[-1]} dofs; this process took {peak():.0f} MB.",
    )
    if figure is not None:
        fig, ax = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
        ax.loglog(
            sizes, [1e3 * local[count][2] for count in sizes], "o-", color="#4074a8", label="local march"
        )
        ax.loglog(
            list(whole),
            [1e3 * each[2] for each in whole.values()],
            "s--",
            color="#cc3311",
            label="march of the whole scene",
        )
        ax.set(xlabel="subsystems", ylabel="processor time per event, ms", ylim=(0.1, None))
        ax.legend(frameon=False)
        ss.save(fig, figure, dpi=150)


def only(method: str, motion: float, into: Path) -> None:
    """Run the chain that is compared, and leave its events."""
    run = settled()
    scene, start = scene_of(COMPARED), on_cycles(run, COMPARED)
    begin = time.process_time()
    found = ss.simulate(scene, motion, start, method=method)
    spent = time.process_time() - begin
    memory = peak()
    end = found.state(found.duration).position
    np.savez(into, time=found.events.time, contact=found.events.contact, kind=found.events.kind, end=end)
    print(json.dumps({"processor": spent, "memory": memory, "stopped": found.stop_reason}))


def compared(motion: float, report: Report) -> None:
    """Add the comparison of a local march with that of the whole scene, each in a process of its own."""
    got, events = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for method in ("local", "taylor"):
            into = Path(folder) / f"{method}.npz"
            command = [sys.executable, __file__, "--only", method, repr(motion), str(into)]
            printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            got[method] = json.loads(printed)
            with np.load(into) as archive:
                events[method] = dict(archive)
    # Of each contact in order: two contacts may meet within rounding.
    mine, other = (np.lexsort((each["time"], each["contact"])) for each in events.values())
    one, two = events.values()
    same = mine.size == other.size and all(
        np.array_equal(one[name][mine], two[name][other]) for name in ("contact", "kind")
    )
    apart = np.abs(one["time"][mine] - two["time"][other]).max() if same else np.nan
    ends = np.abs(one["end"] - two["end"]).max() / np.abs(two["end"]).max()
    ratio = got["taylor"]["processor"] / got["local"]["processor"]
    mine, other = got["local"], got["taylor"]
    report.text(
        f"{COMPARED} subsystems, {1e3 * motion:g} ms of motion: {one['time'].size} events by a local march,",
        f"{two['time'].size} by that of the whole scene, {'the same' if same else 'NOT the same'} at every",
        f"contact, at most {apart:.1e} s apart; the last places differ by {ends:.1e} of the largest.",
        f"Local march: {mine['processor']:.2f} s of processor time in a process of {mine['memory']:.0f} MB;",
        f"the whole scene: {other['processor']:.2f} s, {other['memory']:.0f} MB.",
        f"It is {ratio:.1f} times as fast (target: 10 times, below 500 MB).",
    )
    if not same:
        raise SystemExit("the two marches differ")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller chains, a tenth of the motion compared")
    parser.add_argument("--figure", type=Path, default=None, help="where to draw the cost over the size")
    parser.add_argument("--only", nargs=3, default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.only is not None:
        method, motion, into = options.only
        only(method, float(motion), Path(into))
        return
    report = Report("local-events")
    scaling(SIZES[:4] if options.quick else SIZES, report, options.figure)
    compared(LONG / 10 if options.quick else LONG, report)
    report.finish(options.into, "stickslip", "numpy")


if __name__ == "__main__":
    main()
