"""Examples, run small, and those that open as notebooks, run as they are."""

import re
import runpy
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import stiffness_uncertainty as example

import stickslip as ss

pytestmark = pytest.mark.slow


def test_stiffness_uncertainty(tmp_path):
    results = example.squeal(64, tmp_path / "x.zarr")
    indices = example.importance(16)
    scene = ss.models.two_subsystems(
        **{
            "wall_stiffness": 1.8e6,
            **{
                name: tuple(example.STIFFNESSES[f"{name}_{k}"] for k in range(2))
                for name in ("vertical_stiffness", "horizontal_stiffness", "ceiling_stiffness")
            },
        }
    )
    # The nominal values are those of the model.
    assert (scene.stiffness != ss.models.two_subsystems().stiffness).nnz == 0
    assert results.sizes["sample"] == 64
    assert np.std(results.wall_stiffness) == pytest.approx(0.05 * 1.8e6, rel=0.3)
    said = example.answer(results, indices)
    assert f"P(unstable) = {(results.growth_rate > 0).mean().item():.3f}" in said
    assert "hopf_point: total Sobol' indices" in said
    figure = example.drawn(results, indices)
    assert [axes.get_title() for axes in figure.axes] == [
        "When does it squeal?", "At which frequency?", "How strongly?", "Which spring matters?",
    ]  # fmt: skip
    assert all(axes.has_data() for axes in figure.axes)


NOTEBOOKS = {
    path.name: path
    for path in Path(example.__file__).parent.glob("*.py")
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
