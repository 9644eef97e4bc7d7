"""The other program of a comparison: where it is, what it answers, and what it takes."""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from report import arguments

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

#: One thread, as the other side has, so that processor times compare.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def options(description: str, default: str, what: str) -> argparse.ArgumentParser:
    """Return a reader of the command line that knows the page and the place of the other program."""
    parser = arguments(description)
    parser.add_argument("--peer", default=default, help=f"{what}, by default {default}")
    return parser


def importable(package: str, remedy: str) -> None:
    """End with the remedy where this interpreter has not the package."""
    if importlib.util.find_spec(package) is None:
        raise SystemExit(f"{package} is not installed beside stickslip; {remedy}")


def program(name: str, remedy: str) -> str:
    """Return the path of a program; end with the remedy where there is none."""
    found = shutil.which(name)
    if found is None:
        raise SystemExit(f"--peer: there is no program '{name}'; {remedy}")
    return os.path.abspath(found)


def ask(interpreter: str, side: str, question: dict[str, Any], remedy: str) -> dict[str, Any]:
    """Return what a script of the folder `sides` answers in another interpreter, which has the other program.

    The script reads the question and prints the answer as its last line, both as JSON. ``--version`` comes
    first, which tells a program that is missing from one that fails.
    """
    script = Path(__file__).parent / "sides" / f"{side}_side.py"
    command = [program(interpreter, remedy), str(script)]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | ONE_THREAD
    with tempfile.TemporaryDirectory() as folder:
        begun = subprocess.run(
            [*command, "--version"], text=True, capture_output=True, env=environment, cwd=folder
        )
        if begun.returncode:
            reason = (begun.stderr.strip().splitlines() or ["no message"])[-1]
            raise SystemExit(f"--peer: '{interpreter}' cannot import the other program ({reason}); {remedy}")
        answer = subprocess.run(
            command,
            input=json.dumps(question),
            text=True,
            stdout=subprocess.PIPE,
            env=environment,
            cwd=folder,
            check=True,
        )
    return {"version": begun.stdout.strip(), **json.loads(answer.stdout.splitlines()[-1])}


def timed(command: list[str], folder: Path) -> float:
    """Run a program in a folder on one thread; return its processor time, s."""
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, cwd=folder, env=os.environ | ONE_THREAD, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(
            f"{command[0]} ended with code {done.returncode}:\n{(done.stdout + done.stderr)[-2000:]}"
        )
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime


def milliseconds(seconds: float) -> str:
    """Return a time with three digits."""
    return f"{1e3 * seconds:.3g}" if seconds < 1.0 else f"{1e3 * seconds:.0f}"
