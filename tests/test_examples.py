"""Examples that open as notebooks run as they are, and draw what they name; the large one runs small."""

import re
import runpy
from pathlib import Path

import matplotlib.image
import matplotlib.pyplot as plt
import numpy as np
import pytest

pytestmark = pytest.mark.slow

NOTEBOOKS = {
    path.name: path
    for path in (Path(__file__).parents[1] / "examples").glob("*.py")
    if path.read_text(encoding="utf-8").startswith("# %% [markdown]")
}


@pytest.mark.parametrize("name", sorted(NOTEBOOKS))
def test_a_notebook_runs_and_draws_its_figures(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = NOTEBOOKS[name].read_text(encoding="utf-8")
    drawn = re.findall(r"`([\w-]+\.png)`", text.split("# %%\n", 1)[0])
    assert drawn
    assert "# ## What it means" in text
    runpy.run_path(str(NOTEBOOKS[name]))
    plt.close("all")
    for picture in drawn:
        assert np.ptp(matplotlib.image.imread(picture)[..., :3]) > 0.5


def test_squealing_disc(tmp_path):
    import squealing_disc as brake

    said = brake.main(tmp_path, duration=2e-4)
    assert said[0] == "1492 dofs, 28 contacts, 0 of them open"
    # The mean energy balance closes to rounding of what is stored, some joule.
    assert abs(float(said[3].split("energy to ")[1].removesuffix(" J"))) < 1e-9
    assert (tmp_path / "squealing-disc.png").stat().st_size > 10_000
    assert len(list(tmp_path.glob("squeal_*.vtu"))) == 120
    assert len(list(tmp_path.glob("mode_*.vtu"))) == 24
