"""Everything to type in README and documentation runs, page by page, and prints what stands below it."""

import inspect
import operator
import re
import shlex
import types

import pytest

import pages
import stickslip as ss
from stickslip import types as result_types
from stickslip.cycles.figures import CyclePlots
from stickslip.modes.figures import ModesPlots
from stickslip.motion.energy_figures import BalancePlots
from stickslip.motion.figures import MotionPlots
from stickslip.scene.drawing.figures import ScenePlots

PLOTS = [ScenePlots, ModesPlots, MotionPlots, CyclePlots, BalancePlots]
SHORT = {page.relative_to(pages.ROOT).as_posix(): page for page in pages.PAGES}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [name for name, page in SHORT.items() if pages.BLOCK.search(page.read_text("utf-8"))]
)
def test_a_page_runs_and_prints_what_it_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for block, shown, printed in pages.run(SHORT[name]):
        assert printed == shown, block


def test_no_block_escapes():
    for page in SHORT.values():
        text = page.read_text(encoding="utf-8")
        fences = re.findall(r"^ *```+ *\{?(?:python|sh|bash|shell|console)", text, re.MULTILINE)
        assert len(pages.BLOCK.findall(text)) == len(fences), page
    assert {"README.md", "docs/tutorial.md", "docs/energy.md"} < set(SHORT)


def test_output_is_compared(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```python\nx = 1\n```\n\nwords\n\n```python\nprint(x)\n```\n\n```text\n2\n```\n")
    assert pages.run(page) == [("print(x)\n", "2\n", "1\n")]
    assert pages.rewritten(page).endswith("```text\n1\n```\n")


def test_blocks_are_typed_line_by_line(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```python\nfor x in range(2):\n    print(x)\nprint(x)\n```\n")
    with pytest.raises(SyntaxError):
        pages.run(page)
    page.write_text("```python\nprint(1\n```\n")
    with pytest.raises(AssertionError, match="middle of a statement"):
        pages.run(page)
    page.write_text("```python\nprint(1 / 0)\n```\n")
    with pytest.raises(ZeroDivisionError):
        pages.run(page)


def test_a_block_that_needs_what_is_not_installed_is_left_out(tmp_path):
    page = tmp_path / "page.md"
    for name, printed in (("no_such_package", "2\n"), ("math", "1\n")):
        page.write_text(f"<!-- needs {name} -->\n```python\nprint(1)\n```\n\n```text\n2\n```\n")
        assert pages.run(page) == [("print(1)\n", "2\n", printed)]


def test_commands_are_run_and_verbs_exist(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert pages.entered("stickslip --version  # words\nmake reproduce\n").startswith("stickslip")
    with pytest.raises(AssertionError, match="no-such"):
        pages.entered("stickslip no-such-verb\n")
    verbs = set(re.findall(r"^([a-z-]+):", (pages.ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in SHORT.values():
        text = page.read_text(encoding="utf-8")
        typed = "".join(block for language, block, _ in pages.BLOCK.findall(text) if language == "sh")
        named = re.findall(r"^make ([a-z-]+)", typed, re.MULTILINE) + re.findall(r"`make ([a-z-]+)", text)
        assert set(named) <= verbs, page


def test_links_between_pages_lead_somewhere():
    for page in SHORT.values():
        for link, place in re.findall(r"\]\(([^)#:\s]*)(?:#([^)]*))?\)", page.read_text(encoding="utf-8")):
            target = page.parent / link if link else page
            assert target.exists(), f"{page}: {link}"
            if place:
                headings = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
                slugs = {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}
                assert place in slugs, f"{page}: {link}#{place}"


#: A table that a command writes, between the two comments with its name.
WRITTEN = re.compile(r"<!-- ([\w-]+) -->\n(.*?)<!-- end of \1 -->", re.DOTALL)


def test_every_block_has_one_command_that_writes_it():
    """`make bench` or `compare` writes every block, and only those; `bench-long` some with more samples."""
    makefile = (pages.ROOT / "Makefile").read_text().replace("\\\n", " ")
    benches = " ".join(re.findall(r"^(?:LONG_)?BENCHES := (.*)$", makefile, re.MULTILINE))
    peers = re.search(r"for peer in (.*?); do", makefile)[1]
    scripts = [f"{name}.py" for name in dict.fromkeys(_first_words(benches))]
    scripts += [f"comparisons/{name}.py" for name in _first_words(peers)]
    names = [
        name
        for script in scripts
        for name in re.findall(r'Report\("([\w-]+)"\)', (pages.ROOT / "benchmarks" / script).read_text())
    ]
    blocks = [name for page in SHORT.values() for name, _ in WRITTEN.findall(page.read_text("utf-8"))]
    assert sorted(blocks) == sorted(names)
    assert len(set(blocks)) == len(blocks)


def _first_words(calls):
    """Return the first word of each word or quoted call."""
    return [call.split()[0] for call in shlex.split(calls)]


#: What a block states below its tables: commit, build and date. A changed source has no commit.
STATED = re.compile(r"; commit ([0-9a-f]{8}, \w+ build, \d{4}-\d\d-\d\d); \S")
#: Pages whose numbers are measured by `make bench INTO=docs`.
MEASURED = ("README.md", "docs/performance.md", "docs/certification.md")


def stated(page):
    """Return the commits of the blocks of a page, each of which states one."""
    found = []
    for name, text in WRITTEN.findall(page.read_text(encoding="utf-8")):
        commits = STATED.findall(text)
        assert len(commits) == 1, f"{page}: {name} states {len(commits)} commits"
        found += commits
    return found


PEERS = [name for name in SHORT if name.startswith("docs/comparisons/")]


def test_tables_of_a_comparison_state_one_commit_and_one_build():
    assert len(PEERS) == 5
    for page in map(SHORT.get, PEERS):
        assert [name for name, _ in WRITTEN.findall(page.read_text(encoding="utf-8"))] == [page.stem]
        assert len(stated(page)) == 1


def test_no_measured_page_holds_a_number_of_another_build():
    """All of `make bench` and `make compare` is of one commit; no measured page has another table."""
    written = (*MEASURED, "docs/stability-boundaries.md", *PEERS)
    builds = {name: {build.rpartition(",")[0] for build in stated(SHORT[name])} for name in written}
    assert all(builds.values())
    assert len(set.union(*builds.values())) == 1, builds
    for name in MEASURED:
        outside = WRITTEN.sub("", SHORT[name].read_text(encoding="utf-8"))
        assert not re.search(r"^\|", outside, re.MULTILINE), name


def test_every_picture_of_a_page_is_shown():
    for page in SHORT.values():
        typed = "".join(block for _, block, _ in pages.BLOCK.findall(page.read_text(encoding="utf-8")))
        written = re.findall(r'ss\.save\(.*, "([\w.-]+\.png)"', typed)
        shown = re.findall(r"\]\(pictures/([\w.-]+)\)", page.read_text(encoding="utf-8"))
        assert page.name != "tutorial.md" or written == shown


def test_pages_name_only_what_exists():
    for page in SHORT.values():
        text = page.read_text(encoding="utf-8")
        # What was called otherwise stands in the first column.
        text = re.sub(r"^\| .*? \| ", "", text, flags=re.MULTILINE) if page.name == "renamed.md" else text
        for name in re.findall(r"`ss\.([A-Za-z_][\w.]*)", text):
            operator.attrgetter(name)(ss)


def test_the_index_names_every_page_once():
    docs = pages.ROOT / "docs"
    text = (docs / "index.md").read_text(encoding="utf-8")
    entries = [
        entry
        for tree in re.findall(r"^```\{toctree\}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
        for entry in re.findall(r"^\w[\w/-]*$", tree, re.MULTILINE)
    ]
    written = [page.relative_to(docs).with_suffix("").as_posix() for page in docs.rglob("*.md")]
    assert sorted([*entries, "index"]) == sorted(name for name in written if name[0] != "_")


#: Public names over all namespaces but the models, each counted once; models, with the parts of a chain; and
#: types of results, for annotations alone.
NAMES, MODELS, TYPES = 87, 16, 27


def test_namespaces_show_their_public_names_and_nothing_else():
    spaces = [getattr(ss, name) for name in ss.__all__ if isinstance(getattr(ss, name), types.ModuleType)]
    assert len(spaces) == 5
    names = {
        id(getattr(space, name)): f"{space.__name__}.{name}" for space in (ss, *spaces) for name in dir(space)
    }
    for space in (ss, *spaces):
        assert sorted(dir(space)) == sorted(space.__all__)
    assert len(ss.models.__all__) == MODELS
    assert len(names) == NAMES + MODELS, sorted(names.values())
    assert len(set(dir(result_types)) - set(dir(ss))) == TYPES


def test_every_public_name_is_in_the_reference_and_says_what_it_is():
    text = SHORT["docs/reference.md"].read_text(encoding="utf-8")
    listed = re.findall(
        r"^\.\. auto(?:class|exception|function|module):: stickslip\.([\w.]+)$", text, re.MULTILINE
    )
    assert len(listed) == len(set(listed))
    # Pictures of results are reached by their `plot`, not by a name.
    accessors = [name for name in listed if name.endswith("Plots")]
    assert accessors == [f"{kind.__module__}.{kind.__name__}".removeprefix("stickslip.") for kind in PLOTS]
    listed = [name for name in listed if name not in accessors]
    top = [name for name in listed if "." not in name]
    assert sorted([*top, "__version__"]) == sorted(ss.__all__) == sorted(dir(ss))
    names = [name.removeprefix("types.") for name in listed if name.startswith("types.")]
    assert sorted(names) == sorted(dir(result_types))
    for name in listed:
        thing = operator.attrgetter(name)(ss)
        public = [thing]
        if isinstance(thing, types.ModuleType):
            public += [
                value
                for key, value in vars(thing).items()
                if key in getattr(thing, "__all__", ())
                or (not key.startswith("_") and getattr(value, "__module__", "") == thing.__name__)
            ]
        elif inspect.isclass(thing):
            public += [
                value for key, value in vars(thing).items() if not key.startswith("_") and callable(value)
            ]
        for part in public:
            assert part.__doc__, (name, part)
            # One argument, the subject, speaks for itself.
            if inspect.isfunction(part) and len(inspect.signature(part).parameters) > 2:
                unnamed = [
                    parameter
                    for parameter in inspect.signature(part).parameters
                    if parameter != "self" and not re.search(rf"\b{parameter}\b", part.__doc__)
                ]
                assert unnamed == [], (name, part.__qualname__)
