"""Curves on which stability of a band of modes ends: beside all modes, at bounds of the band, on a mesh."""

import dataclasses
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import interrupts
import stickslip as ss
from quad_block import quad_block
from stickslip import types
from stickslip.cli import main
from stickslip.locus.band import path

#: Planes of a block with bands of it; in the second one two curves cross others.
PLANES = [
    ({"friction": (0.0, 0.6), "stiffness": (0.8, 1.2)}, (30e3, 43e3)),
    ({"friction": (0.0, 0.8), "damping_stiffness": (1e-8, 3e-7)}, (30e3, 63e3)),
]
#: Ranges of models of two parameters.
UNIT = {"p": (0.0, 1.0), "q": (0.0, 1.0)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parameters", "band"), [PLANES[0], pytest.param(*PLANES[1], marks=pytest.mark.nightly)]
)
def test_curves_of_projected_matrices_are_those_of_all_modes(parameters, band, monkeypatch):
    block = quad_block(6, 3, 2)
    options = {"combination": "++++", "band": band, "cells": 6}
    every = ss.stability_boundary(block, parameters, **options)
    # As if its 38 free coordinates were many.
    monkeypatch.setattr(path, "FEW", 10)
    projected = ss.stability_boundary(block, parameters, **options)
    assert projected.doubts == every.doubts == ()
    assert len(projected) == len(every) >= 2
    for one, other in zip(projected, every, strict=True):
        assert (one.kind, one.ends) == (other.kind, other.ends)
        np.testing.assert_allclose(one.values, other.values, rtol=1e-10)
        np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-10)
        assert (one.unstable_modes == other.unstable_modes).all()
        assert one.error.max() <= 1e-14
        counted = ~np.isnan(one.missing)
        assert counted[[0, -1]].all()
        assert np.count_nonzero(counted) >= one.missing.size // 4
        assert np.abs(one.missing[counted]).max() < 0.01
        assert not other.missing.any()
    for one, other in zip(projected.points, every.points, strict=True):
        assert one.kind == other.kind
        assert list(one.values.values()) == pytest.approx(list(other.values.values()), rel=1e-10)
    assert {curve.ends for curve in projected} >= {("range", "band")} or len(projected.points) == 3
    np.testing.assert_allclose(projected.map.growth_rate, every.map.growth_rate, rtol=1e-7, atol=1e-3)
    sizes = [curve.missing.size for curve in projected]
    counted = [np.count_nonzero(~np.isnan(curve.missing)) for curve in projected]
    text = str(projected.summary())
    assert f"eigenvalues missing  0.00 at {sum(counted)} of {sum(sizes)} points of curves" in text
    assert all(f"0.00 at {n} of {size} points" in text for n, size in zip(counted, sizes, strict=True))
    assert "eigenvalues missing" not in str(every.summary())


def test_what_is_missing_is_told_and_marked():
    boundary = ss.stability_boundary(softer, UNIT, band=(0.0, 1e3))
    curve = boundary[0]
    missing = np.full(len(curve.values), np.nan)
    missing[[0, 3, -1]] = 0.003, 2.0, -0.0
    curves = [dataclasses.replace(curve, missing=missing), *boundary[1:]]
    rest = boundary.points, boundary.map, boundary.resolution, boundary.doubts
    found = types.StabilityBoundary(boundary.parameters, curves, *rest)
    assert curves[0].incomplete.nonzero()[0].tolist() == [3]
    assert f"2.00 at 3 of {missing.size} points" in str(found.summary())
    axes = found.plot()
    (marked,) = (line for line in axes.lines if line.get_label() == "eigenvalues missing")
    np.testing.assert_array_equal(marked.get_xydata(), curve.values[[3], ::-1])
    assert "eigenvalues missing" in [text.get_text() for text in axes.get_legend().get_texts()]
    assert "eigenvalues missing" not in [line.get_label() for line in boundary.plot().lines]
    data = found.to_dataset()
    np.testing.assert_array_equal(data.missing[: missing.size], missing)


def softer(p, q):
    """An oscillator of 100 (1 + p) rad/s that grows for q > 1/2, and one of 1 krad/s for p > 3/4."""
    stiffness = np.diag([1e4 * (1.0 + p) ** 2, 1e6])
    return ss.Scene(np.ones(2), stiffness, damping=np.diag([1.0 - 2.0 * q, 1.5 - 2.0 * p]))


def test_a_curve_ends_where_its_frequency_leaves_the_band():
    boundary = ss.stability_boundary(
        softer, {"p": (0.0, 1.0), "q": (0.0, 1.0)}, band=(0.0, 140.0 / (2.0 * np.pi))
    )
    (curve,) = boundary
    assert sorted(curve.ends) == ["band", "range"]
    np.testing.assert_allclose(curve.values[:, 1], 0.5, rtol=1e-13)
    assert sorted(curve.values[[0, -1], 0]) == pytest.approx([0.0, 0.4], rel=1e-12)
    assert curve.frequency.max() == pytest.approx(140.0 / (2.0 * np.pi), rel=1e-13)
    # Beyond it the mode grows, at p = 0.4 for all q > 1/2, and is not counted.
    (doubt,) = boundary.doubts
    assert "a growing mode crosses the bound of the band at 22.2817 Hz near p = 0.4" in doubt
    assert "take a wider band" in doubt
    assert not (curve.unstable_modes).any()
    # Both modes, with the curves that cross.
    both = ss.stability_boundary(softer, {"p": (0.0, 1.0), "q": (0.0, 1.0)}, band=(0.0, 1e3))
    assert (len(both), both.doubts) == (2, ())
    assert [point.kind for point in both.points] == ["double_hopf"]
    # The slow one alone in a band that holds it from below: the curve begins at its lower bound.
    above = ss.stability_boundary(
        softer, {"p": (0.0, 1.0), "q": (0.0, 0.9)}, band=(120.0 / (2.0 * np.pi), 100.0)
    )
    assert sorted(above[0].values[[0, -1], 0]) == pytest.approx([0.2, 1.0], rel=1e-12)
    assert sorted(above[0].ends) == ["band", "range"]


@pytest.mark.nightly
def test_curves_of_a_mesh_are_on_the_modes_of_the_mesh():
    mesh, combination, band = quad_block(40, 20, 4, sparse=True), "+" * 11, (0.0, 60e3)
    parameters = {"friction": (0.0, 0.8), "damping_stiffness": (1e-8, 3e-7)}
    boundary = ss.stability_boundary(mesh, parameters, combination=combination, band=band, cells=6)
    assert mesh.size == 1640
    assert boundary.doubts == ()
    assert [curve.kind for curve in boundary].count("hopf") == 3
    damping = mesh.damping
    for curve in boundary:
        assert np.nanmax(np.abs(curve.missing)) < 0.01
        for (friction, rate), frequency in list(zip(curve.values, curve.frequency, strict=True))[::3]:
            if curve.kind != "hopf":
                continue
            scene = mesh.replace(friction=friction, damping=ss.Rayleigh(damping.mass, rate))
            near = ss.complex_modes(scene, combination, near=2j * np.pi * frequency, count=1).eigenvalues
            own = near[np.abs(near - 2j * np.pi * frequency).argmin()]
            assert abs(own.real) <= 1e-12 * abs(own)
            assert own.imag == pytest.approx(2.0 * np.pi * frequency, rel=1e-12)
    # The map has the growth rates of the band.
    rates = boundary.map.growth_rate
    for i, j in ((1, 2), (9, 20), (15, 3)):
        at = rates[i, j]
        scene = mesh.replace(
            friction=float(at.friction), damping=ss.Rayleigh(damping.mass, float(at.damping_stiffness))
        )
        modes = ss.complex_modes(scene, combination, band=band)
        assert at.item() == pytest.approx(modes.eigenvalues.real.max(), rel=1e-6, abs=1e-3)


@pytest.mark.parametrize("band", [(3.0, 1.0), (1.0,), "all"])
def test_an_ill_posed_band(band):
    with pytest.raises(ss.InputError, match="band: expected"):
        ss.stability_boundary(softer, {"p": (0.0, 1.0), "q": (0.0, 1.0)}, band=band)


INTERRUPTED = """
    import numpy as np
    import stickslip as ss
    from interrupts import Interrupt
    from quad_block import quad_block

    block = quad_block(10, 5, 2)
    plane = {"friction": (0.0, 0.6), "stiffness": (0.8, 1.2)}
    interrupt = Interrupt(after=4.0)
    try:
        ss.stability_boundary(block, plane, combination="++++++", band=(0.0, 45e3), cells=500)
    except ss.Interrupted as stopped:
        print(type(stopped.partial).__name__, stopped.partial.doubts[-1].startswith("interrupted after"))
        # The modes of the band are counted along curves at the end alone.
        print(all(np.isnan(curve.missing).all() for curve in stopped.partial))
"""


@pytest.mark.process
@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT to one process")
def test_ctrl_c_leaves_what_a_band_has_by_then():
    assert interrupts.printed(INTERRUPTED, timeout=120).split() == ["StabilityBoundary", "True", "True"]


def test_the_command_line_takes_a_band(tmp_path):
    scene, out = tmp_path / "brake.toml", tmp_path / "curves.nc"
    ranges = ["--over", "friction=0:3", "--over", "damping=1e-5:2e-4", "--cells", "4"]
    assert CliRunner().invoke(main, ["init", str(scene)]).exit_code == 0
    command = ["boundary", str(scene), *ranges, "--band", "150", "250", "-o", str(out)]
    told = CliRunner().invoke(main, command)
    assert told.exit_code == 0, told.output
    data = ss.load(out)
    assert data.sizes["number"] == 1
    assert ((data.frequency >= 150.0) & (data.frequency <= 250.0)).all()
    assert not data.missing.any()
    assert CliRunner().invoke(main, [*command[:-4], "3", "1"]).exit_code != 0
