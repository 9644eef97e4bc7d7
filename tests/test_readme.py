"""The README's map and links lead somewhere."""

import re
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def test_paths_of_the_map_exist():
    root = README.parent
    text = README.read_text(encoding="utf-8")
    paths = re.findall(r"^\| `([^`]+)` \|", text, re.MULTILINE)
    assert len(paths) > 10
    assert [path for path in paths if not (root / path).exists()] == []
    for link in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (root / link).exists(), link
