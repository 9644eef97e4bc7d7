"""Examples, which open as notebooks, run as they are, and draw what they name."""

import re
import runpy
from pathlib import Path

import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np
import pytest

from nightly import nightly

pytestmark = pytest.mark.slow

EXAMPLES = {path.name: path for path in (Path(__file__).parents[1] / "examples").glob("*.py")}


#: Those that take longest.
NIGHTLY = (
    *("squealing_disc.py", "burridge_knopoff.py", "fault.py", "pad_on_belt.py", "worn_joint.py"),
    "stable_but_squealing.py",
)


@pytest.mark.parametrize("name", nightly(sorted(EXAMPLES), NIGHTLY.__contains__))
def test_an_example_runs_and_draws_its_figures(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = EXAMPLES[name].read_text(encoding="utf-8")
    assert text.startswith("# %% [markdown]")
    drawn = re.findall(r"`([\w-]+\.png)`", text.split("# %%\n", 1)[0])
    assert drawn
    assert "# ## What it means" in text
    found = runpy.run_path(str(EXAMPLES[name]))
    plt.close("all")
    for picture in drawn:
        assert np.ptp(matplotlib.image.imread(picture)[..., :3]) > 0.5
    if name == "calculix_block.py":
        cycle = found["cycle"]
        assert cycle.stable
        assert [phase.combination for phase in cycle.phases][1::2] == ["++++++s+", "++s+++++"]
        assert cycle.frequency == pytest.approx(65424.9, rel=1e-5)
    if name == "squealing_disc.py":
        assert found["scene"].size == 9964
        assert found["steady"].combination == "o" * 56
        assert abs(found["reduced"].errors.missing) < 0.01
        # Two modes grow, and the reduced model says how far the faster one is off.
        full, small = (found["reduced"].errors[name].to_numpy() for name in ("full", "reduced"))
        assert [(values.real > 0.0).sum() for values in (full, small)] == [2, 2]
        assert sorted(full.real)[-2:] == pytest.approx([4.87, 47.52], rel=1e-3)
        assert sorted(small.real)[-2:] == pytest.approx([5.53, 86.33], rel=1e-3)
        assert found["reduced"].errors.growth_error.max() == pytest.approx(86.33 / 47.52 - 1.0, rel=0.01)
        # The example is what a user writes: forty lines.
        code = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
        assert len(code) <= 40
        cycle = found["cycle"]
        assert cycle.stable
        assert cycle.frequency == pytest.approx(4673.282, rel=1e-6)
        # On a limit cycle nothing is stored.
        assert abs(cycle.balance().residual) < 1e-9
        # The energy balance closes to rounding of the stored energy, some joule.
        assert abs(found["run"].balance().residual) < 1e-9
        assert len(list(tmp_path.glob("squeal/cycle_*.vtu"))) == 48
        assert len(list(tmp_path.glob("squeal/mode_*.vtu"))) == 24
