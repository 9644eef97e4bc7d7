"""Pages of the documentation as programs: what is typed into Python or a shell, and what it prints.

``python -m pages docs/tutorial.md docs/pictures`` types a page and keeps the pictures that it writes.
"""

import code
import contextlib
import importlib.util
import io
import re
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

from click.testing import CliRunner

from stickslip.cli import main

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
#: A block that is typed, and the block of text just below it, if there is one.
BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```\n(?:\n+```text\n(.*?)^```\n)?", re.DOTALL | re.MULTILINE)
#: What stands above a block that is typed only where a package is installed.
NEEDS = re.compile(r"<!-- needs (\w+) -->\n\Z")


class Session(code.InteractiveConsole):
    """A session of the interpreter in which any error ends the test."""

    def showtraceback(self):
        raise

    def showsyntaxerror(self, *_, **__):
        raise


def run(page):
    """Type the blocks of a page; return, for each that shows output, block, shown and printed."""
    session, results, text = Session(filename=str(page)), [], page.read_text(encoding="utf-8")
    for match in BLOCK.finditer(text):
        language, block, shown = match.groups()
        needed = NEEDS.search(text[: match.start()])
        if needed and importlib.util.find_spec(needed[1]) is None:
            printed = shown
        else:
            printed = typed(session, block) if language == "python" else entered(block)
        if shown is not None:
            results.append((block, shown, printed))
    return results


def typed(session, block):
    """Type a block into a session; return what it prints."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        for line in block.splitlines():
            unfinished = session.push(line)
        # An empty line ends what is indented.
        unfinished = unfinished and session.push("")
    assert not unfinished, f"a block ends in the middle of a statement: {block}"
    return printed.getvalue()


def entered(block):
    """Run the lines of a shell's block that call `stickslip`; return what they print."""
    printed = ""
    for line in block.splitlines():
        command, *arguments = shlex.split(line, comments=True) or [""]
        if command == "stickslip":
            result = CliRunner().invoke(main, arguments, prog_name=command)
            assert result.exit_code == 0, f"{line}: {result.output}"
            printed += result.stdout
    return printed


def rewritten(page):
    """Return a page with what its blocks print in place of what they showed."""
    outputs = iter([printed for _, _, printed in run(page)])

    def replaced(match):
        language, block, shown = match.groups()
        if shown is None:
            return match.group(0)
        return f"```{language}\n{block}```\n\n```text\n{next(outputs)}```\n"

    return BLOCK.sub(replaced, page.read_text(encoding="utf-8"))


def redraw(page, folder):
    """Type a page in a folder of its own and copy the pictures that it shows from there."""
    shown = re.findall(rf"\]\({folder.name}/([\w.-]+)\)", page.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
        run(page)
        for name in shown:
            shutil.copy(name, folder / name)


if __name__ == "__main__":
    redraw(*(Path(argument).resolve() for argument in sys.argv[1:]))
