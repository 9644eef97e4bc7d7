"""Beside heyoka: the events of one run by Taylor integration, errors beside times over its tolerance.

Five scenes: the standard run, the same under Stribeck friction, the same with one and with four cubic
springs, and LuGre's bristles, these by LSODA and CVODE, too. The programs take turns, round by round. Times
are processor time, the least over all rounds; the compilation of heyoka is apart. The errors are the largest
of the times of events against references of 45 or more digits, and of the digits that others published for
the bristles.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from clock import in_turns

import stickslip as ss
from comparisons import bristles
from comparisons.peer import importable, milliseconds
from comparisons.scenes import COUNTED, DURATION, LAW, error, hardened, reference_model
from report import Report, arguments

TOLERANCES = {"1 ulp": 0.0, "1e-12": 1e-12, "1e-9": 1e-9, "1e-6": 1e-6}
REMEDY = "pip install heyoka"

#: Runs of stickslip, of heyoka by its tolerance, and the error of a run.
Scene = tuple[Callable[[], Any], Callable[[float], Callable[[], Any]], Callable[[Any], str]]


def scenes() -> dict[str, Scene]:
    """Return the scenes by name."""
    from peers.taylor import prepare

    from friction_peer import Peer

    found: dict[str, Scene] = {}
    for name, (scene, start) in {
        "standard run": hardened(0),
        "Stribeck friction": reference_model(LAW),
        "one cubic spring": hardened(1),
        "four cubic springs": hardened(4),
    }.items():
        expected = Peer(scene, start).run(COUNTED, DURATION)
        found[name] = (
            partial(follow, scene, start),
            partial(prepare, scene, start, DURATION),
            partial(error, expected=expected),
        )
    return found | {"bristles": (bristles.ours, bristles.by_heyoka, bristles.error)}


def follow(scene: ss.Scene, start: ss.State) -> Any:
    """Return the events by stickslip."""
    return ss.simulate(scene, DURATION, start).events


def count(found: Any) -> int:
    """Return the number of events, of a list of times too."""
    return len(found if isinstance(found, np.ndarray) else found.time)


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=20)
    chosen = parser.parse_args()
    importable("heyoka", REMEDY)
    rows = []
    for name, (ours, prepare, missed) in scenes().items():
        runs = {"stickslip": ours} | {
            f"heyoka, {tolerance}": prepare(number) for tolerance, number in TOLERANCES.items()
        }
        if name == "bristles":
            runs |= {"LSODA, 1e-13": bristles.by_lsoda(1e-13), "CVODE, 1e-12": bristles.by_cvode(1e-12)}
        # The first run compiles.
        found = {program: run() for program, run in runs.items()}
        for program, times in in_turns(runs, chosen.rounds).items():
            rows.append(
                [
                    name, program, str(count(found[program])), milliseconds(min(times)),
                    missed(found[program]),
                ]
            )  # fmt: skip
    report = Report("heyoka")
    report.table(("scene", "program", "events", "ms", "error, s"), rows)
    report.finish(chosen.into, "stickslip", "heyoka", "numpy", "scipy", "scikit-sundae", "mpmath")


if __name__ == "__main__":
    main()
