"""Time and memory of large meshes: a pad on a rotating disc (`meshed_contact`) with up to 200 000 dofs.

Every step runs in a process of its own that makes the scene first, and finds the contacts that are open
before modes, so that the memory of a step is what a process needs that does nothing else.
"""

from __future__ import annotations

import sys
import time
from multiprocessing import get_context

from clock import clocked
from meshed_contact import BAND, memory, model

import stickslip as ss
from report import Report, arguments

#: Sizes and the steps that are measured there.
STEPS = {
    "50000": ("scene", "steady sliding", "modes, without a count", "modes"),
    "200000": ("scene", "steady sliding", "modes, without a count"),
}


def measured(size: str, step: str) -> tuple[int, int, float, float, float, str]:
    """Return dofs, contacts, processor and elapsed time, s, memory, GB, and what was found."""
    times, scene, pairs = model(size)
    found = f"{scene.stiffness.nnz / 1e6:.1f} million entries"
    begin, spent = time.perf_counter(), sum(times.values())
    if step == "steady sliding":
        spent, rest = clocked(lambda: ss.steady_sliding(scene))
        found = f"{rest.combination.count('d')} contacts open"
    elif step != "scene":
        combination = ss.steady_sliding(scene).combination
        begin, certify = time.perf_counter(), step == "modes"
        spent, modes = clocked(lambda: ss.complex_modes(scene, combination, band=BAND, certify=certify))
        found = f"{len(modes)} modes" + (f", missing {modes.missing:.0e}" if step == "modes" else "")
    elapsed = time.perf_counter() - begin if step != "scene" else spent
    return scene.size, len(pairs), spent, elapsed, memory() / 1000.0, found


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--sizes", nargs="+", default=list(STEPS), choices=STEPS)
    parser.add_argument("--steps", nargs="+", help="instead of those of each size")
    chosen = parser.parse_args()
    rows = []
    for size in chosen.sizes:
        for step in chosen.steps or STEPS[size]:
            with get_context("spawn").Pool(1) as pool:
                dofs, contacts, spent, elapsed, most, found = pool.apply(measured, (size, step))
            rows.append(
                [f"{dofs}", f"{contacts}", step, f"{spent:.0f}", f"{elapsed:.0f}", f"{most:.1f}", found]
            )
            print(*rows[-1], file=sys.stderr, flush=True)
    report = Report("large-meshes")
    report.table(["dofs", "contacts", "step", "CPU s", "elapsed, s", "memory, GB", "found"], rows)
    report.finish(chosen.into, "stickslip", "scipy")


if __name__ == "__main__":
    main()
