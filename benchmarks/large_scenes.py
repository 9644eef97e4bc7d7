"""Time of the command line on long chains: `modes --plot`, `report`, and a sweep that follows some modes.

Every verb runs in a process of its own, start of Python included, as from a terminal. Chains alternate the
two published subsystems; every contact is closed in steady sliding, which damping leaves stable or not.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from chains import scene_of

import stickslip as ss
from report import Report, arguments

#: Dofs, of four per subsystem.
SIZES = (100, 1000)
FRICTION = 0.45
#: s, beta of C = beta K.
DAMPING = {"unstable": 1e-5, "stable": 1e-4}
#: s; what takes longer is stopped and told so.
PATIENCE = 300.0


def verbs(scene: str, sweep_options: list[str]) -> dict[str, list[str]]:
    """Return the calls that are timed, by what they are called in the table."""
    over = ["--over", "friction=0:1.5:31"]
    return {
        "modes --plot": ["modes", scene, "--plot", "modes.png"],
        "report": ["report", scene, "-o", "report.html"],
        "sweep, 31 points": ["sweep", scene, *over, *sweep_options],
    }


def seconds(arguments: list[str], folder: Path) -> str:
    """Return how long a call takes, or how it ended."""
    program = [sys.executable, "-c", "from stickslip.cli import main; main()", *arguments]
    begin = time.perf_counter()
    try:
        done = subprocess.run(program, cwd=folder, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return f"> {PATIENCE:g}"
    elapsed = time.perf_counter() - begin
    return f"{elapsed:.1f}" if done.returncode in (0, 1) else f"exit code {done.returncode}"


def main() -> None:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--only", help="verb to time alone, such as report")
    parser.add_argument(
        "--sweep-options",
        default="--modes 24",
        help="options of sweep that choose the modes to follow, in one word",
    )
    chosen = parser.parse_args()
    report = Report("large-scenes")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for size in SIZES:
            for kind, damping in DAMPING.items():
                file = f"chain-{size}-{kind}.toml"
                scene = scene_of(size // 4).replace(friction=FRICTION, damping=ss.Rayleigh(stiffness=damping))
                ss.save(scene, folder / file)
                for verb, options in verbs(file, chosen.sweep_options.split()).items():
                    if chosen.only is None or verb.startswith(chosen.only):
                        rows.append([str(size), kind, verb, seconds(options, folder)])
                        print(*rows[-1], file=sys.stderr)
    report.table(["dofs", "sliding", "verb", "time, s"], rows)
    report.finish(chosen.into, "stickslip", "matplotlib")


if __name__ == "__main__":
    main()
