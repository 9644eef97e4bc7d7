"""Random scenes by two methods each: how many agree to their end, and what rounding decides in the others.

The scenes and the checks are those of `make fuzz` (`tests/support/fuzz_campaign.py`), some of every kind.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from report import Report, arguments

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
from fuzz_campaign import campaign
from fuzz_events import PASSED

#: What the scenes of a row have besides, and the part of the scenes that the row takes.
KINDS: dict[str, tuple[tuple[str, ...], float]] = {
    "chains, blocks, defective": ((), 1.0),
    "stops": (("stops",), 0.5),
    "contact springs, loads": (("forced", "compliant"), 0.5),
    "unsymmetric terms": (("unsymmetric",), 0.5),
    "laws of friction": (("laws",), 0.25),
    "laws that vanish at rest": (("vanishing",), 0.1),
    "nonlinear springs": (("elements",), 0.25),
    "two tied equal halves": (("twins",), 0.25),
    "5 to 40 contacts, local": (("sparse",), 0.5),
}


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--scenes", type=int, default=150, help="of the first kind (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=7)
    chosen = parser.parse_args()
    rows, failed = [], 0
    for name, (extras, part) in KINDS.items():
        count = max(1, round(part * chosen.scenes))
        outcomes = campaign(count, chosen.seed, None, os.cpu_count() or 1, extras)
        verdicts = Counter(outcome.verdict for outcome in outcomes)
        wrong = sum(number for verdict, number in verdicts.items() if verdict not in PASSED)
        failed += wrong
        numbers = [count, sum(outcome.compared for outcome in outcomes), verdicts["ok"]]
        numbers += [count - verdicts["ok"] - wrong, wrong]
        energy = np.nanmax([outcome.energy_residual for outcome in outcomes])
        rows.append([name, *(str(number) for number in numbers), f"{energy:.0e}"])
        print(*rows[-1], dict(verdicts), f"{sum(o.seconds for o in outcomes):.0f} s", file=sys.stderr)
    report = Report("random-scenes")
    headings = (
        "kind of scene",
        "scenes",
        "events compared",
        "agree to their end",
        "rounding decides",
        "failed",
    )
    report.table((*headings, "energy residual"), rows)
    report.finish(chosen.into, "stickslip", "numpy")
    if failed:
        raise SystemExit(f"{failed} scenes failed: make fuzz SEED={chosen.seed} names them")


if __name__ == "__main__":
    main()
