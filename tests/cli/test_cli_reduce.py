"""`stickslip reduce`: a scene file of the reduced model, and how well it agrees."""

import numpy as np
import pytest
from click.testing import CliRunner

import stickslip as ss
from meshed import block
from stickslip.cli import main


@pytest.fixture
def scene_file(tmp_path):
    """A scene file of a block of elements on a belt, without its mesh."""
    body = block(5, 5)
    pairs = ss.fe.contact_pairs(body.surface("low"), None, velocity=(1.0, 0.0), friction=0.3, gap=-1e-6)
    scene = ss.fe.assemble(body, pairs)
    ss.save(scene, tmp_path / "block.toml")
    return scene, tmp_path / "block.toml"


def test_the_reduced_scene_is_written(scene_file, tmp_path):
    scene, path = scene_file
    options = ["--band", "1000", "60e3", "--modes", "20", "--output", str(tmp_path / "small.toml")]
    shown = CliRunner().invoke(main, ["reduce", str(path), *options])
    assert shown.exit_code == 0, shown.output
    assert "60 dofs, 6 contacts" in shown.output
    small = ss.load(tmp_path / "small.toml").scene
    expected = ss.fe.reduce(scene, (1e3, 60e3), modes=20).scene
    assert small.dofs == expected.dofs
    found, wanted = (ss.complex_modes(one).eigenvalues for one in (small, expected))
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_what_cannot_be_reduced_is_told(scene_file, tmp_path):
    _, path = scene_file
    output = ["--output", str(tmp_path / "small.toml")]
    for options, told in (
        (["--band", "60e3", "1000"], "band: expected (lowest, highest) in Hz"),
        (["--band", "1", "2"], "the scene has no eigenvalue from 1 to 2 Hz"),
        ([], "Missing option '--band'"),
    ):
        shown = CliRunner().invoke(main, ["reduce", str(path), *options, *output])
        assert shown.exit_code == 2
        assert told in shown.output
    assert not (tmp_path / "small.toml").exists()
