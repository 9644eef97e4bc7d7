"""The README's map names what is there, all of it."""

import re
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
SOURCES = ("rust/*/src", "python/stickslip", "tests", "benchmarks", "examples")


def rows():
    """Return the paths of the map; those after the first of a row lie beside it."""
    named = set()
    for cell in re.findall(r"^\| (`[^|]*`) \|", README, re.MULTILINE):
        first, *others = re.findall(r"`([^`]+)`", cell)
        named |= {first, *(str(PurePosixPath(first).parent / other) for other in others)}
    return named


def test_paths_of_the_map_exist():
    named = rows()
    assert len(named) > 80
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_every_source_is_in_the_map():
    named = rows()
    sources = {
        file.relative_to(ROOT).as_posix(): file.name
        for folder in SOURCES
        for place in ROOT.glob(folder)
        for suffix in ("*.rs", "*.py", "*.pyi")
        for file in place.rglob(suffix)
    }
    assert len(sources) > 150
    unnamed = [
        path
        for path, name in sources.items()
        if name != "__init__.py" and not {path, *map(str, PurePosixPath(path).parents)} & named
    ]
    assert unnamed == []
