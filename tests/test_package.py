"""What importing the package loads, and that its names are what they say."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

import stickslip as ss

STUB = ast.parse(Path(ss.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
HEAVY = {"matplotlib", "numpy", "pandas", "rich", "scipy", "scipy.sparse", "scipy.stats", "xarray"}


def loaded(code):
    """The heavy modules that a fresh interpreter has loaded after some code."""
    report = "import sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{report}"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return HEAVY & set(done.stdout.split())


@pytest.mark.process
def test_importing_the_package_loads_nothing_heavy():
    assert loaded("import stickslip") == set()


@pytest.mark.process
def test_modes_and_runs_take_no_figures():
    modes = "import stickslip as ss; ss.complex_modes(ss.models.two_subsystems())"
    assert loaded(modes) <= {"numpy", "scipy", "scipy.sparse"}
    run = "scene = ss.models.two_subsystems(); ss.simulate(scene, 0.01, ss.steady_sliding(scene))"
    assert "matplotlib" not in loaded(f"import stickslip as ss; {run}")


def test_every_public_name_is_there_and_once_in_the_stub():
    (listed,) = (node.value for node in STUB.body if isinstance(node, ast.Assign))
    names = ast.literal_eval(listed)
    assert names == sorted(set(names))
    assert ss.__all__ == names
    for name in names:
        assert getattr(ss, name).__doc__, name
    assert set(names) <= set(dir(ss))


def test_modules_of_a_folder_that_users_name():
    assert ss.models.two_subsystems().size == 8


def test_an_unknown_name():
    with pytest.raises(AttributeError, match="swep"):
        ss.swep  # noqa: B018


def test_the_version_stands_in_one_place_and_the_citation_follows():
    root = Path(__file__).parent.parent
    cargo = tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))
    stated = cargo["workspace"]["package"]["version"]
    assert ss.__version__ == stated
    assert f"version: {stated}" in (root / "CITATION.cff").read_text(encoding="utf-8").splitlines()


def test_versions_are_shown_with_those_of_every_dependency(capsys):
    ss.show_versions()
    # Metadata may write lazy-loader for lazy_loader.
    shown = capsys.readouterr().out.replace("-", "_")
    assert shown.startswith(f"stickslip {ss.__version__}\nPython 3.")
    root = Path(__file__).parents[1]
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for bound in project["dependencies"]:
        name = bound.split(">=")[0]
        assert f"\n  {name} {version(name)}\n".replace("-", "_") in shown
    for extra, bounds in project["optional-dependencies"].items():
        first = bounds[0].split(">=")[0].replace("-", "_")
        assert re.search(rf"\nextra {extra}\n(  .*\n)*?  {first} (\d|not installed)", shown, re.I), extra


@pytest.mark.process
def test_the_module_is_the_command_line():
    done = subprocess.run(
        [sys.executable, "-m", "stickslip", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"stickslip, version {ss.__version__}\n"


def test_the_lowest_versions_that_are_tested_are_the_bounds():
    root = Path(__file__).parents[1]
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    bounds = [bound.split(">=") for bound in (*project["dependencies"], *extras["study"], *extras["fe"])]
    lines = (root / ".ci" / "lowest.txt").read_text(encoding="utf-8").splitlines()
    lowest = dict(line.split("==") for line in lines if not line.startswith("#"))
    assert set(lowest) == {name for name, _ in bounds}
    for name, bound in bounds:
        # 3.8 and 3.8.0 are the same.
        assert lowest[name].removesuffix(".0").removesuffix(".0") == bound.removesuffix(".0"), name


def test_the_recipe_of_conda_has_the_version_and_the_bounds_of_the_package():
    root = Path(__file__).parents[1]
    # Names of conda-forge that differ: matplotlib without a window system.
    text = (root / "conda" / "meta.yaml").read_text(encoding="utf-8").replace("matplotlib-base", "matplotlib")
    assert re.search(r'^\{% set version = "(.*)" %\}$', text, re.MULTILINE)[1] == ss.__version__
    pyproject = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    project = pyproject["project"]
    listed = {
        section: re.findall(r"^    - (.*)$", block, re.MULTILINE)
        for section, block in re.findall(r"^  (build|host|run):\n((?:    - .*\n)+)", text, re.MULTILINE)
    }
    python = f"python {project['requires-python']}"
    assert listed["run"] == [python, *(bound.replace(">=", " >=") for bound in project["dependencies"])]
    (maturin,) = pyproject["build-system"]["requires"]
    assert listed["host"] == [python, "pip", maturin.replace(">=", " >=", 1)]
    assert {'{{ compiler("rust") }}', '{{ compiler("c") }}'} <= set(listed["build"])
    assert f"license: {project['license']}" in text
    assert f'summary: "{project["description"]}"' in text
    rust = tomllib.loads((root / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"][
        "rust-version"
    ]
    assert f'- "{rust}"' in (root / "conda" / "conda_build_config.yaml").read_text(encoding="utf-8")


def test_issue_templates_ask_for_what_is_there():
    templates = Path(__file__).parents[1] / ".github" / "ISSUE_TEMPLATE"
    for name in ("defect.yml", "question.yml"):
        text = (templates / name).read_text(encoding="utf-8")
        assert re.findall(r"^(name|description|labels|body):", text, re.MULTILINE) == [
            "name",
            "description",
            "labels",
            "body",
        ]
    assert "stickslip.show_versions()" in (templates / "defect.yml").read_text(encoding="utf-8")
    assert callable(ss.show_versions)
