"""The comparison with the published numbers, and that it can disagree."""

import json
import struct
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from paper import comparison as reproduce
from paper import numbers as published
from paper.__main__ import main
from paper.numbers import MISLABELS, MISPRINTS, agrees, last_digit

from pictures import assert_shown


@pytest.fixture(scope="module")
def rows():
    return reproduce.rows()


def test_every_published_quantity_is_compared(rows):
    record = published.published()
    numbers = len(record["natural_frequencies_mu0"]["hz"]) + 3
    numbers += sum(len(table["hz"]) for table in record["status_frequencies"])
    assert len(record["status_frequencies"]) == 13
    keys = ("statuses", "main_frequency_hz", "period_doubled", "first_status_change_after_s")
    numbers += sum(key in cycle for cycle in record["limit_cycles"] for key in keys)
    assert len([row for row in rows if row.source != "Table 1"]) == numbers


def test_nothing_differs_but_the_named_errata(rows):
    assert not [row for row in rows if row.verdict == "differs"]
    errata = [row for row in rows if row.verdict == "erratum"]
    assert all(row.note for row in errata)
    assert len(errata) == len(MISPRINTS) + len(MISLABELS) + len(published.TABLE_1_FREQUENCIES)
    assert [row.quantity for row in rows if row.verdict == "not printed"] == [
        "friction 2.2, slider speed 0.9: statuses"
    ]


def test_critical_frictions_are_those_of_the_model():
    exact = (0.70156717308523, 2.1002056016114, 2.39623672105574)
    assert reproduce.critical_frictions() == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize(
    ("printed", "computed", "expected"),
    [
        ("112.20", 112.2099, True),
        ("112.20", 112.2101, False),
        ("112.2", 112.2101, True),
        ("112", 112.99, True),
        ("112", 111.0, False),
        ("0.7", 0.7016, True),
    ],
)
def test_agreement_is_less_than_one_unit_of_the_last_printed_digit(printed, computed, expected):
    assert agrees(Decimal(printed), computed) == expected


def test_trailing_zeros_are_kept():
    assert last_digit(published.published()["natural_frequencies_mu0"]["hz"][1]) == 0.01


def test_every_erratum_of_the_record_is_one_the_program_checks():
    record = published.published()
    named = {(t["table"], t["status"]) for t in record["status_frequencies"] if "erratum" in t}
    assert named == {(misprint.table, misprint.status) for misprint in MISPRINTS}
    noted = {
        (c["friction"], c["slider_speed"])
        for c in record["limit_cycles"]
        if "note" in c and c["statuses"] is not None
    }
    assert noted == {(mislabel.friction, mislabel.slider_speed) for mislabel in MISLABELS}


def changed(path, value):
    """The record with one entry changed."""
    text = Path(published.__file__).with_name("published.json").read_text(encoding="utf-8")
    record = json.loads(text, parse_float=Decimal, parse_int=Decimal)
    entry = record
    for key in path[:-1]:
        entry = entry[key]
    entry[path[-1]] = value
    return record


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (["natural_frequencies_mu0", "hz", 0], Decimal("91.58")),
        (["critical_friction", "second_hopf"], Decimal("2.3")),
        (["status_frequencies", 5, "hz", 2], Decimal("212.84")),
        (["limit_cycles", 0, "statuses"], ["++", "s+", "ss", "sd"]),
        (["limit_cycles", 0, "main_frequency_hz"], Decimal("114")),
        (["limit_cycles", 0, "first_status_change_after_s"], Decimal("0.13")),
        (["limit_cycles", 2, "period_doubled"], False),
        # An erratum excuses only what it states: a misprint of 's-', a label the model replaces.
        (["status_frequencies", 1, "hz", 3], Decimal("306.99")),
        (["limit_cycles", 4, "statuses"], ["++", "+s", "s+", "ss", "sd", "dd"]),
    ],
)
def test_a_changed_number_is_found_and_named(monkeypatch, path, value):
    record = changed(path, value)
    monkeypatch.setattr(reproduce, "published", lambda: record)
    differing = [row for row in reproduce.rows() if row.verdict == "differs"]
    assert len(differing) == 1


def test_an_erratum_is_wrong_if_the_model_has_another_value(monkeypatch):
    wrong = published.Misprint("Table 2", "+d", 6, Decimal("588.10"))
    monkeypatch.setattr(published, "MISPRINTS", (*MISPRINTS[:2], wrong))
    differing = [row for row in reproduce.rows() if row.verdict == "differs"]
    assert [(row.source, row.published) for row in differing] == [("Table 2", "588.18")]


@pytest.mark.slow
def test_command_line(tmp_path):
    result = CliRunner().invoke(main, ["reproduce", "--output", str(tmp_path / "figures")])
    assert result.exit_code == 0, result.output
    assert "0 differs" in result.output
    assert "the model gives 588.01" in result.output
    written = sorted(path.name for path in (tmp_path / "figures").iterdir())
    energy = ["energy-cycle.png", "energy-flow.png", "energy-growth.png", "energy.png"]
    motion = ["contact-status.png", "history.png", "limit-cycle.png", "phase-plane.png"]
    modes = ["loci.png", "mode-orbits.png", "mode-shapes.png", "mode.gif"]
    assert written == sorted([*energy, *motion, *modes, "comparison.json"])
    for path in (tmp_path / "figures").glob("*.[pg]*"):
        assert path.read_bytes().startswith({".png": b"\x89PNG", ".gif": b"GIF8"}[path.suffix])
        assert path.stat().st_size > 10_000
    for name in ("limit-cycle.png", "energy-cycle.png", "energy-flow.png"):
        assert_shown(name, tmp_path / "figures" / name)
    rows = json.loads((tmp_path / "figures" / "comparison.json").read_text())
    assert {row["verdict"] for row in rows} == {"agrees", "erratum", "not printed"}


@pytest.mark.slow
def test_figures_of_the_paper_are_files(tmp_path):
    def run(*words, code=0):
        result = CliRunner().invoke(main, ["figures", *map(str, words)])
        assert result.exit_code == code, result.output
        return result.stderr

    said = run(2, 3, "--output", tmp_path / "new" / "folder", "--format", "svg")
    assert "figure-03.svg: Eigenvalues of steady sliding over friction" in said
    written = sorted((tmp_path / "new" / "folder").iterdir())
    assert [path.name for path in written] == ["figure-02.svg", "figure-03.svg"]
    assert all("<svg" in path.read_text()[:1000] for path in written)
    run(2, "--output", tmp_path, "--format", "png")
    # A column of a journal, 85 mm, at 300 points per inch.
    assert struct.unpack(">I", (tmp_path / "figure-02.png").read_bytes()[16:20])[0] == int(85 / 25.4 * 300)
    assert "16 is not in the range 2<=x<=15" in run(16, code=2)


def test_command_line_fails_on_a_difference(monkeypatch):
    record = changed(["natural_frequencies_mu0", "hz", 0], Decimal("91.58"))
    monkeypatch.setattr(reproduce, "published", lambda: record)
    result = CliRunner().invoke(main, ["reproduce"])
    assert result.exit_code == 1
    assert "1 differs" in result.output


def test_figures_show_the_run():
    from matplotlib.figure import Figure
    from matplotlib.path import Path

    run = reproduce.standard_run(0.2)
    drawn = run.plot.history(("x1",)).axes[0].lines[0]
    motion = run.sample(drawn.get_xdata()).position.sel(dof="x1")
    assert drawn.get_ydata() == pytest.approx(1e6 * (motion - motion[0]).values)
    axes = run.plot.statuses(ax=Figure().subplots())
    spans = sum((artist.get_path().codes == Path.MOVETO).sum() for artist in axes.patches)
    letters = np.array([list(name) for name in (run.start.combination, *run.events.combination)])
    assert spans == 2 + (letters[1:] != letters[:-1]).sum()
