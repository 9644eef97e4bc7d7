"""The README's examples run as printed."""

import contextlib
import io
import re
from pathlib import Path

import pytest

README = Path(__file__).parent.parent / "README.md"
#: A block of Python, followed by a block of what it prints.
EXAMPLES = re.findall(
    r"```python\n(.*?)```\n+```text\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL
)


def test_there_is_an_example():
    assert EXAMPLES
    assert len(EXAMPLES) == README.read_text(encoding="utf-8").count("```python")


@pytest.mark.parametrize(("code", "output"), EXAMPLES)
def test_an_example_prints_what_it_says(code, output):
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "README.md", "exec"), {})
    assert printed.getvalue() == output


def test_paths_of_the_map_exist():
    root = README.parent
    text = README.read_text(encoding="utf-8")
    paths = re.findall(r"^\| `([^`]+)` \|", text, re.MULTILINE)
    assert len(paths) > 10
    assert [path for path in paths if not (root / path).exists()] == []
    for link in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (root / link).exists(), link
