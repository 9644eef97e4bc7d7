"""The package keeps its order: no arrow runs back, no files form a circle, no folder is crowded."""

from pathlib import Path

import pytest

import stickslip
from architecture import MOST, arrows, circles, crowded, drawing, modules, private, strangers, unread, upward

ROOT = Path(stickslip.__file__).parent


def test_every_file_belongs_to_a_part_and_is_read():
    assert strangers(ROOT) == []
    assert len(modules(ROOT)) > 100
    # What is imported at the top, within a function, and for types only.
    assert {
        ("stickslip.cycles.cycle", "stickslip.motion.motion"),
        ("stickslip.transient.trajectory", "stickslip.cycles.cycle"),
        ("stickslip.energy.modal", "stickslip.motion.motion"),
        ("stickslip.scene.contact", "stickslip._core"),
        ("stickslip._core", "stickslip.faults"),
        ("stickslip.types", "stickslip.cycles.phases"),
        ("stickslip.scene", "stickslip.scene.models"),
    } <= arrows(ROOT)


def test_no_arrow_runs_from_an_earlier_part_to_a_later_one():
    assert upward(ROOT) == []


def test_only_packages_of_others_are_imported_by_a_name_that_is_computed():
    assert unread(ROOT) == ["stickslip.scene.checks"]


def test_no_private_module_of_another_package_is_used():
    assert private(ROOT) == []


def test_no_files_form_a_circle():
    assert circles(ROOT) == []


def test_the_drawing_of_the_parts_is_that_of_the_imports():
    text = (Path(__file__).parent.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    drawn = text.split("```mermaid\nflowchart LR\n")[1].split("```")[0]
    lines = [tuple(line.strip().split(" --> ")) for line in drawn.splitlines()]
    parts, edges = drawing(ROOT)
    assert {line for line in lines if len(line) == 2} == edges
    assert {name for line in lines for name in line} == parts


def test_no_folder_is_crowded():
    assert crowded(ROOT) == []


def test_every_folder_says_what_it_holds():
    for file in ROOT.rglob("__init__.py"):
        first = file.read_text(encoding="utf-8").split("\n", 1)[0]
        assert first.startswith('"""'), file
        assert first.rstrip('"').endswith("."), file


@pytest.fixture
def planted(tmp_path):
    """A small package in order, and how to put something into it."""
    root = tmp_path / "house"

    def plant(name, text):
        file = root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return root

    plant("__init__.py", "")
    plant("scene/__init__.py", "")
    plant("scene/scene.py", "import math\n")
    plant("modes/__init__.py", "")
    plant("modes/modes.py", "from house.scene.scene import Scene\n")
    return plant


@pytest.mark.parametrize(
    "text",
    [
        "from house.modes.modes import Modes\n",
        "from house.modes import modes\n",
        "import house.modes.modes\n",
        "from ..modes import modes\n",
        "def late():\n    from house.modes.modes import Modes\n",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from house.modes.modes import Modes\n",
        "from importlib import import_module\nModes = import_module('house.modes.modes').Modes\n",
        "import importlib\nlate = [importlib.import_module(f'house.modes.modes.{k}') for k in 'ab']\n",
        "modes = __import__('house.modes.modes')\n",
        "import lazy_loader as lazy\nmodes = lazy.load('house.modes.modes')\n",
    ],
)
def test_an_arrow_that_runs_back_is_found_wherever_it_stands(planted, text):
    assert upward(planted("scene/state.py", "")) == []
    root = planted("scene/state.py", text)
    assert upward(root) == ["house.scene.state -> house.modes.modes"]
    assert circles(root) == []


def test_what_is_loaded_on_demand_is_an_arrow(planted):
    planted("scene/__init__.py", "import lazy_loader\nlazy_loader.attach_stub(__name__, __file__)\n")
    root = planted("scene/__init__.pyi", "from ..modes import modes\nfrom .scene import Scene\n")
    assert upward(root) == ["house.scene -> house.modes.modes"]
    assert ("house.scene", "house.scene.scene") in arrows(root)
    listed = "import lazy_loader\nlazy_loader.attach(__name__, ['scene'], {'state': ['State']})\n"
    planted("scene/__init__.py", listed)
    assert {("house.scene", "house.scene.scene"), ("house.scene", "house.scene.state")} <= arrows(
        planted("scene/state.py", "")
    )


def test_an_import_that_cannot_be_read_is_found(planted):
    assert unread(planted("scene/state.py", "name = 'math'\nmath = __import__(name)\n")) == [
        "house.scene.state"
    ]


@pytest.mark.parametrize(
    ("text", "module"),
    [
        ("from xarray.core import indexing\n", "xarray.core.indexing"),
        ("def late():\n    import scipy.stats._continuous_distns\n", "scipy.stats._continuous_distns"),
        ("import numpy as np\nkind = np._core.multiarray\n", "numpy._core.multiarray"),
        ("import scipy.stats\nkind = scipy.stats._distn\n", "scipy.stats._distn"),
    ],
)
def test_a_private_module_is_found(planted, text, module):
    root = planted("scene/state.py", "from __future__ import annotations\nfrom house import _core\n")
    assert private(root) == []
    assert ("house.scene.state", module) in private(planted("scene/state.py", text))


def test_a_circle_within_a_part_is_found(planted):
    planted("modes/shape.py", "from house.modes.table import row\n")
    root = planted("modes/table.py", "def row():\n    import house.modes.shape\n")
    assert circles(root) == [("house.modes.shape", "house.modes.table")]
    assert upward(root) == []


def test_a_stub_of_the_core_that_looks_up_is_found(planted):
    root = planted("_core.pyi", "from house.scene.scene import Scene\n")
    assert upward(root) == ["house._core -> house.scene.scene"]


def test_a_crowded_folder_and_a_stranger_are_found(planted):
    for number in range(MOST):
        root = planted(f"modes/part_{number}.py", "")
    assert crowded(root) == ["house/modes"]
    assert strangers(planted("misc/odds.py", "")) == ["house.misc.odds"]
