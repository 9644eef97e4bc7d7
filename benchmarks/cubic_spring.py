"""The reference model with hardening springs on its upper masses: beside heyoka, and beside linear springs.

The programs follow the same scene from the same start and take turns, round by round. Times are processor
time, the least over all rounds and the median. The error is the largest of the times of the first events
against 45 digits.
"""

from __future__ import annotations

import importlib.util
import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from clock import in_turns
from friction_laws import COUNTED, DURATION, error

import stickslip as ss
from report import Report, arguments, left_out

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))
from friction_peer import Peer

#: N/m^3: at the largest motions, of 1 mm, a tenth of the stiffness of a subsystem.
HARD = 2e10


def hardened(count: int) -> tuple[ss.Scene, ss.State]:
    """Return the scene of the standard run with some cubic springs, and its start."""
    scene = ss.models.two_subsystems(friction=1.5, slider_speed=0.025, preload_displacement=1e-3)
    law = ss.spring.Polynomial(0.0, 0.0, HARD)
    held = {scene.dofs[k] for contact in scene.contacts for k in (contact.tangential, contact.normal)}
    free = [name for name in scene.dofs if name not in held]
    scene = scene.replace(elements=[ss.Spring({name: 1.0}, law) for name in free[:count]])
    return scene, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=100)
    options = parser.parse_args()
    cases = {"linear": hardened(0), "one cubic spring": hardened(1), "four cubic springs": hardened(4)}

    def by_ourselves(scene: ss.Scene, start: ss.State) -> Callable[[], Any]:
        return lambda: ss.simulate(scene, DURATION, start).events

    runs = {name: by_ourselves(*case) for name, case in cases.items()}
    if importlib.util.find_spec("heyoka") is None:
        left_out("heyoka", "the comparison")
    else:
        from peers.taylor import prepare

        for name, case in cases.items():
            runs[f"{name}, heyoka"] = prepare(*case, DURATION, 0.0)
    found = {name: run() for name, run in runs.items()}
    expected = {name: Peer(*case).run(COUNTED, DURATION) for name, case in cases.items()}
    times = in_turns(runs, options.rounds)
    least = {name: min(own) for name, own in times.items()}
    rows = [
        [
            name,
            str(len(found[name].time)),
            f"{1e3 * least[name]:.3g}",
            f"{1e3 * statistics.median(own):.3g}",
            f"{1e6 * least[name] / len(found[name].time):.2f}",
            f"{least[name] / least[name.removesuffix(', heyoka')]:.2f}",
            error(found[name], expected[name.removesuffix(", heyoka")]),
        ]
        for name, own in times.items()
    ]
    report = Report("cubic-spring")
    report.table(("run", "events", "ms", "median ms", "us per event", "x ours", "error, s"), rows)
    used = ["stickslip", "numpy", "mpmath", *(["heyoka"] if "linear, heyoka" in runs else [])]
    report.finish(options.into, *used)


if __name__ == "__main__":
    main()
