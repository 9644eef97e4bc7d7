"""Tables of a benchmark: printed as Markdown, and written into the page that has their block."""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import re
import subprocess
import sys
from collections.abc import Sequence
from datetime import date
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

#: Wide enough for every row: a wrapped row is no Markdown.
WIDTH = 200


class Report:
    """What one benchmark has to say, under its name."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.console = Console(width=WIDTH, record=True, highlight=False, soft_wrap=True, no_color=True)

    def table(self, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Add a table; all columns but the first are aligned right."""
        table = Table(box=box.MARKDOWN)
        for place, heading in enumerate(headings):
            table.add_column(heading, justify="right" if place else "left", no_wrap=True)
        for row in rows:
            table.add_row(*row)
        self.console.print(table)
        self.console.print()

    def text(self, *lines: str) -> None:
        """Add a paragraph of some pieces."""
        self.console.print(" ".join(lines), markup=False, end="\n\n")

    def finish(self, folder: Path | None, *packages: str, peers: str = "") -> None:
        """Add versions, also of other programs, commit, date and machine; replace the block of this report.

        The block stands between its two comments, in one page of the folder or in the README beside it.
        Without a folder the tables are printed only.
        """
        used = ", ".join(part for part in (versions(*packages), peers) if part)
        self.text(f"{used}; commit {commit()}, {date.today():%Y-%m-%d}; {machine()}.")
        if folder is None:
            return
        lines = self.console.export_text().splitlines()
        text = re.sub(r"\n{3,}", "\n\n", "\n".join(line.rstrip() for line in lines)).strip("\n")
        begin, end = f"<!-- {self.name} -->", f"<!-- end of {self.name} -->"
        pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        pages = [page for page in (*folder.rglob("*.md"), folder.parent / "README.md") if page.exists()]
        holding = [page for page in pages if pattern.search(page.read_text(encoding="utf-8"))]
        if len(holding) != 1:
            raise SystemExit(f"{folder}: {len(holding)} pages have a block '{begin}' to '{end}', not one")
        old = holding[0].read_text(encoding="utf-8")
        holding[0].write_text(pattern.sub(lambda _: f"{begin}\n\n{text}\n{end}", old), encoding="utf-8")


def arguments(description: str) -> argparse.ArgumentParser:
    """Return a reader of the command line that knows the folder to write into."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--into", type=Path, default=None, help="the folder of the pages to write into")
    return parser


def machine() -> str:
    """Return processor, system and Python."""
    processor = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    fields = [line.partition(":") for line in lines]
    named = [value.strip() for key, _, value in fields if key.strip() == "model name"]
    if named:
        clocks = [float(value) for key, _, value in fields if key.strip() == "cpu MHz"]
        processor = f"{len(named)} x {named[0]} at {max(clocks, default=0.0) / 1e3:.1f} GHz"
    return f"{processor}, {platform.system()} {platform.machine()}, Python {platform.python_version()}"


def commit() -> str:
    """Return the commit of the sources, ``-dirty`` where they differ from it, and the profile of the core.

    BUILD names the profile in which the core was compiled, where it is not the one of the verbs.
    """
    root = Path(__file__).parent.parent
    head = ["git", "-C", str(root), "rev-parse", "--short=8", "HEAD"]
    changed = ["git", "-C", str(root), "status", "--porcelain", "--", "rust", "python", "benchmarks"]
    name, changes = (
        subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
        for command in (head, changed)
    )
    return f"{name}{'-dirty' if changes else ''}, {os.environ.get('BUILD', 'release')} build"


def versions(*packages: str) -> str:
    """Return the packages with their versions."""
    return ", ".join(f"{package} {importlib.metadata.version(package)}" for package in packages)


def left_out(package: str, what: str) -> None:
    """Say that a program is missing."""
    print(f"{package} is not installed: {what} left out (pip install 'stickslip[bench]')", file=sys.stderr)
