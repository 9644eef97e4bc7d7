"""The patches of docs/extending.md apply to this tree, are short, compile, and do what they say."""

import os
import re
import shutil
import subprocess
import sys

import pytest

import pages
from stickslip import _core

PAGE = (pages.ROOT / "docs/extending.md").read_text(encoding="utf-8")
PATCHES = re.findall(r"^```diff\n(.*?)^```\n", PAGE, re.MULTILINE | re.DOTALL)
#: What the Rust workspace and the package consist of.
TREE = ("Cargo.toml", "Cargo.lock", "README.md", "pyproject.toml", "rust", "python")
#: Most lines that such a patch may add and take away together.
LINES = 40

USE = """
import sys
import numpy as np
import stickslip as ss
from stickslip.scene.laws.friction import InverseRoot, law_of

law = law_of({"law": "inverse root", "static": 0.5, "kinetic": 0.3, "speed": 0.1})
assert law == InverseRoot(0.5, 0.3, 0.1) and abs(law.coefficient(0.15) - 0.4) < 1e-15
stiffness = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 5.0]])
scene = ss.Scene([1.0, 2.0, 1.0], stiffness, damping=ss.EqualRatio(0.02))
values = ss.complex_modes(scene).eigenvalues
assert np.allclose(-np.real(values), 0.02 * np.abs(values), rtol=1e-12)
try:
    ss.Scene([1.0, 0.0], np.eye(2), damping=ss.EqualRatio(0.02))
except ss.InputError as error:
    assert "a mass at every dof" in str(error)
print(sys.modules["stickslip"].__file__)
"""


@pytest.fixture(scope="module")
def patched(tmp_path_factory):
    """Return a copy of the tree with all patches."""
    copy = tmp_path_factory.mktemp("tree")
    for name in TREE:
        source = pages.ROOT / name
        ignored = shutil.ignore_patterns("*.so", "__pycache__", "proptest-regressions")
        if source.is_dir():
            shutil.copytree(source, copy / name, ignore=ignored)
        else:
            shutil.copy(source, copy / name)
    for patch in PATCHES:
        subprocess.run(["git", "apply", "-"], input=patch, cwd=copy, text=True, check=True)
    return copy


def test_patches_are_short():
    assert len(PATCHES) == 2
    for patch in PATCHES:
        assert 0 < len(re.findall(r"^[+-](?![+-]{2} )", patch, re.MULTILINE)) < LINES


@pytest.mark.process
def test_patches_do_what_they_say(patched):
    shutil.copy(_core.__file__, patched / "python/stickslip")
    environment = {**os.environ, "PYTHONPATH": str(patched / "python")}
    run = subprocess.run(
        [sys.executable, "-P", "-c", USE], env=environment, cwd=patched, text=True, capture_output=True
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == str(patched / "python/stickslip/__init__.py")


@pytest.mark.slow
@pytest.mark.process
@pytest.mark.skipif(shutil.which("cargo") is None, reason="the core is compiled by cargo")
def test_patches_compile(patched, pytestconfig):
    # Into the folder of `make lint`, which has compiled the dependencies.
    cargo = ["cargo", "--offline", "--config", f"build.target-dir={str(pages.ROOT / 'target')!r}"]
    check = subprocess.run(
        [*cargo, "check", "--quiet", "--locked", "--workspace"], cwd=patched, text=True, capture_output=True
    )
    assert check.returncode == 0, check.stderr
    assert "warning" not in check.stderr, check.stderr
    # Of the tests of the core, which compile for minutes, those that every decay has to pass.
    if pytestconfig.getoption("--hypothesis-profile") == "slow":
        verbs = ["test", "--release", "--locked", "--package", "stickslip-core", "--lib", "decays"]
        subprocess.run([*cargo, *verbs], cwd=patched, check=True)
