"""Instructions per event, and which functions of the core they go to.

Needs valgrind. The core is built with line tables beside the usual build and run under callgrind; what the
compiler inlined counts for the function of the core whose lines it surrounds. Unlike times, the numbers do
not depend on what else the machine does.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from bisect import bisect_right
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path

from report import Report, arguments

ROOT = Path(__file__).parent.parent
CORE = ROOT / "rust" / "core" / "src"
#: Mangled name of the function whose instructions count, calls included.
COUNTED = "*8simulate8simulate17h*"
#: Functions listed; the rest is one row.
LISTED = 10
#: Events of a chain: each costs thousands of times one of the small scene.
CHAIN_EVENTS = 20


def drive(what: str, data: Path, count: int) -> None:
    """Run under callgrind: `count` runs, the first of them cold, and nothing else that is counted."""
    import pickle

    import stickslip as ss

    if what == "standard run":
        scene = ss.models.two_subsystems()
        start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
        runs = [ss.simulate(scene, 0.6, start) for _ in range(count)]
    else:
        from chains import LARGE, scene_of

        scene, start = scene_of(LARGE), ss.State(*pickle.loads(data.read_bytes()))
        runs = [ss.simulate(scene, 1.0, start, max_events=CHAIN_EVENTS) for _ in range(count)]
    print(len(runs[0].events))


def build(into: Path) -> None:
    """Copy the package, with a core that knows its lines."""
    target = ROOT / "target" / "lines"
    environment = os.environ | {
        "CARGO_TARGET_DIR": str(target),
        "CARGO_PROFILE_RELEASE_DEBUG": "line-tables-only",
        "PYO3_PYTHON": sys.executable,
    }
    command = ["cargo", "build", "--release", "--locked", "--package", "stickslip-python"]
    subprocess.run(command, check=True, cwd=ROOT, env=environment)
    shutil.copytree(ROOT / "python" / "stickslip", into / "stickslip")
    (library,) = (
        path for path in (target / "release").glob("lib_core.*") if path.suffix in (".so", ".dylib")
    )
    shutil.copy(library, into / "stickslip" / "_core.abi3.so")


def callgrind(package: Path, what: str, count: int) -> tuple[Counter[str], int]:
    """Return the instructions of `count` runs by function, and the number of events of one."""
    record = package / "record"
    environment = os.environ | {"PYTHONPATH": f"{package}{os.pathsep}{Path(__file__).parent}"}
    command = ["valgrind", "--tool=callgrind", "--demangle=no", f"--toggle-collect={COUNTED}"]
    command += [f"--callgrind-out-file={record}", sys.executable, __file__]
    answer = subprocess.run(
        [*command, "--drive", what, "--runs", str(count), "--data", str(package / "start")],
        check=True,
        env=environment,
        capture_output=True,
        text=True,
    )
    found = cost(record)
    if not found.total():
        raise SystemExit(f"no instructions counted: no function is called {COUNTED}")
    return found, int(answer.stdout)


@cache
def starts(path: Path) -> tuple[list[int], list[str]]:
    """First lines and names of the functions of a source file."""
    found = [
        (number, match[1])
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if (match := re.match(r"\s*(?:pub(?:\(\w+\))? )?(?:const )?fn (\w+)", line))
    ]
    return [number for number, _ in found], [name for _, name in found]


def function_at(file: str, line: int) -> str | None:
    """Return ``file: function`` of a line of the core, None for lines of others."""
    _, mark, name = file.partition("/core/src/")
    path = CORE / name
    if not mark or not path.is_file():
        return None
    lines, names = starts(path)
    place = bisect_right(lines, line) - 1
    return f"{name}: {names[place]}" if place >= 0 else None


def cost(record: Path) -> Counter[str]:
    """Return the instructions of a record by function of the core, or by symbol for others.

    The format is callgrind's: names are written once and numbered, positions may be relative, and the line
    after ``calls=`` holds the cost of what was called, which is counted there.
    """
    names: dict[tuple[str, str], str] = {}

    def name(kind: str, text: str) -> str:
        number, _, full = text.partition(" ")
        if full:
            names[kind, number] = full
        return names.get((kind, number), text)

    total: Counter[str] = Counter()
    inside: dict[str, Counter[str]] = defaultdict(Counter)
    symbol = own = current = ""
    line, called = 0, False
    for text in record.read_text().splitlines():
        key, _, value = text.partition("=")
        if key == "fn":
            symbol, current = name("fn", value), own
        elif key == "fl":
            own = current = name("file", value)
        elif key in ("fi", "fe"):
            current = name("file", value)
        elif key == "cfn":
            name("fn", value)
        elif key in ("cfi", "cfl"):
            name("file", value)
        elif key == "calls":
            called = True
        elif match := re.fullmatch(r"([+-]?\d+|\*) (\d+)", text):
            at, instructions = match.groups()
            line = line if at == "*" else line + int(at) if at[0] in "+-" else int(at)
            if called:
                called = False
                continue
            total[symbol] += int(instructions)
            where = function_at(current, line)
            if where is not None:
                inside[symbol][where] += int(instructions)
    result: Counter[str] = Counter()
    for symbol, instructions in total.items():
        ours = inside[symbol].most_common(1)
        result[ours[0][0] if ours else plain(symbol)] += instructions
    return result


def plain(symbol: str) -> str:
    """What a symbol of others is for."""
    for part, meaning in (("sin", "sine and cosine"), ("exp", "exponentials"), ("mem", "copying memory")):
        if part in symbol and not symbol.startswith("_ZN"):
            return meaning
    return "allocation" if re.search("alloc|free", symbol) else "other"


def rows(by_function: Counter[str], events: int) -> list[list[str]]:
    """Rows of a table: the largest, the rest, the total."""
    total = by_function.total()
    listed = [item for item in by_function.most_common() if item[0] != "other"][:LISTED]
    rest = total - sum(instructions for _, instructions in listed)
    return [
        [
            f"`{name}`" if ".rs" in name else name,
            f"{instructions / events:.0f}",
            f"{instructions / total:.0%}",
        ]
        for name, instructions in [*listed, ("all others", rest), ("all", total)]
    ]


def main() -> None:
    """Print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--drive", default=None, help=argparse.SUPPRESS)
    parser.add_argument("--runs", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--data", type=Path, default=None, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.drive is not None:
        drive(options.drive, options.data, options.runs)
        return
    if shutil.which("valgrind") is None:
        print(
            "valgrind is not installed: instructions are not counted (apt install valgrind)", file=sys.stderr
        )
        return
    report = Report("instructions")
    with tempfile.TemporaryDirectory() as directory:
        package = Path(directory)
        build(package)
        _save_start(package / "start")
        cold, events = callgrind(package, "standard run", 1)
        both, _ = callgrind(package, "standard run", 2)
        report.text(f"Standard run, warm, per event (cold: {cold.total() / events:.0f} in all):")
        report.table(("function", "instructions", "share"), rows(both - cold, events))
        chain, events = callgrind(package, "chain", 1)
        report.text("A chain of 1000 subsystems, per event:")
        report.table(("function", "instructions", "share"), rows(chain, events))
    report.finish(options.into, "stickslip")


def _save_start(path: Path) -> None:
    import pickle

    from chains import LARGE, on_cycles, settled

    start = on_cycles(settled(), LARGE)
    path.write_bytes(pickle.dumps((start.position, start.velocity, start.combination)))


if __name__ == "__main__":
    main()
