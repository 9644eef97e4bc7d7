"""Pages of the documentation as programs: blocks of Python in one namespace, and what they print."""

import contextlib
import io
import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
#: A block of Python, and the block of text just below it, if there is one.
BLOCK = re.compile(r"^```python\n(.*?)^```\n(?:\n+```text\n(.*?)^```\n)?", re.DOTALL | re.MULTILINE)


def run(page):
    """Run the blocks of a page; return, for each that shows output, code, shown and printed."""
    names, results = {}, []
    text = page.read_text(encoding="utf-8")
    for match in BLOCK.finditer(text):
        code, shown = match.groups()
        printed = io.StringIO()
        line = text.count("\n", 0, match.start(1))
        with contextlib.redirect_stdout(printed):
            # Line numbers of an error are those of the page.
            exec(compile("\n" * line + code, str(page), "exec"), names)
        if shown is not None:
            results.append((code, shown, printed.getvalue()))
    return results


def rewritten(page):
    """Return a page with what its blocks print in place of what they showed."""
    outputs = iter([printed for _, _, printed in run(page)])

    def replaced(match):
        if match.group(2) is None:
            return match.group(0)
        return f"```python\n{match.group(1)}```\n\n```text\n{next(outputs)}```\n"

    return BLOCK.sub(replaced, page.read_text(encoding="utf-8"))
