"""Transients of random reduced models: how each of them ends, and what it takes.

A pad of lumped mass on a rotating disc (`meshed_contact`), with 28 to 150 contacts, random friction,
pressure, speed and restitution, reduced with one of the boundaries. The motion of 5 ms begins with steady
sliding, where some contacts can be open, and the mode of the band that grows fastest. It ends
earlier after `EVENTS` events.
"""

from __future__ import annotations

import collections
import re
import resource
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

import numpy as np
from meshed_contact import bodies

import stickslip as ss
from report import Report, arguments

BOUNDARIES = ("lumped", "massless")
#: Hz and s
BAND, DURATION = (500.0, 8000.0), 5e-3
#: Cells of the pad along radius and angle, with 28 to 150 nodes on its face.
FACES = ((3, 6), (4, 7), (5, 8), (5, 12), (6, 14), (7, 14), (9, 14))
#: Work that a variant may take.
EVENTS = 400
#: What an error says where a boundary does not allow growth rates within 5 %.
REMEDY = re.compile(r"growth_tolerance=(None|[\d.e-]+)")


def variant(seed: int, most: int) -> tuple[str, str, int, int, float, float, float]:
    """Return how a variant ended.

    Boundary, why the run ended, contacts, events, the time that it reached, s, processor time, s, and largest
    memory, MB.
    """
    rng = np.random.default_rng(seed)
    boundary = BOUNDARIES[seed % len(BOUNDARIES)]
    disc, pad = bodies((4, 50, 2), (*FACES[rng.integers(len(FACES))], 2), lumped=True)
    pairs = ss.fe.contact_pairs(
        pad.surface("face"),
        disc.surface("top"),
        velocity=ss.fe.Rotation(float(rng.uniform(1.0, 20.0))),
        friction=float(rng.uniform(0.2, 0.8)),
        plane=False,
        restitution=0.0 if boundary == "massless" else float(rng.choice([0.0, 0.3])),
    )
    force = pad.surface("back").pressure(float(10.0 ** rng.uniform(5.0, 6.7)))
    scene = ss.fe.assemble([disc, pad], pairs, force=force)
    begin, events, reached = time.process_time(), 0, 0.0
    try:
        combination = ss.steady_sliding(scene).combination
        modes = ss.complex_modes(scene, combination, band=BAND, certify=False)
        try:
            small, remedy = ss.fe.reduce(scene, BAND, boundary, full_modes=modes).scene, ""
        except ss.InputError as error:
            print(seed, error, file=sys.stderr)
            if (named := REMEDY.search(str(error))) is None:
                raise
            tolerance = None if named[1] == "None" else float(named[1])
            small = ss.fe.reduce(scene, BAND, boundary, growth_tolerance=tolerance, full_modes=modes).scene
            remedy = f", growth_tolerance={'None' if tolerance is None else 'enlarged'}"
        run = ss.simulate(small, DURATION, ss.disturbed_sliding(small, band=BAND), max_events=most)
        ended, events, reached = run.stop_reason + remedy, len(run.events), run.duration
    except ss.StickslipError as error:
        ended = f"{type(error).__name__}: {error}"
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    spent = time.process_time() - begin
    return boundary, ended, len(pairs), events, reached, spent, memory


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--variants", type=int, default=100)
    parser.add_argument("--events", type=int, default=EVENTS)
    parser.add_argument("--workers", type=int, default=2)
    chosen = parser.parse_args()
    found = collections.defaultdict(list)
    # A process for each variant, so that its memory is its own.
    with ProcessPoolExecutor(chosen.workers, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        futures = [pool.submit(variant, seed, chosen.events) for seed in range(chosen.variants)]
        for seed, future in enumerate(futures):
            try:
                boundary, ended, *numbers = future.result()
            except BrokenProcessPool:
                boundary, ended = BOUNDARIES[seed % len(BOUNDARIES)], "the process was killed"
                numbers = [0, 0, 0.0, 0.0, 0.0]
            print(seed, boundary, ended, *numbers, file=sys.stderr, flush=True)
            found[boundary, ended.split(":")[0]].append(numbers)
    rows = []
    for (boundary, ended), results in sorted(found.items()):
        contacts, events, reached, times, memory = (np.array(column) for column in zip(*results, strict=True))
        rows.append(
            [
                boundary,
                ended,
                str(len(results)),
                f"{contacts.min()} to {contacts.max()}",
                f"{np.median(events):.0f}",
                f"{events.max()}",
                f"{1e3 * np.median(reached):.2g}",
                f"{np.median(times):.1f}",
                f"{times.max():.0f}",
                f"{memory.max() / 1000.0:.1f}",
            ]
        )
    headings = [
        "boundary", "ended by", "variants", "contacts", "events, median", "most", "ms, median",
        "CPU s, median", "most", "memory, GB",
    ]  # fmt: skip
    report = Report("reduced-variants")
    report.table(headings, rows)
    report.finish(chosen.into, "stickslip")


if __name__ == "__main__":
    main()
