"""The report says what the package computes, whatever the scene does."""

import itertools
import json
import re
import sys
import time
from dataclasses import replace
from functools import partial
from hashlib import sha256
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest
from click.testing import CliRunner
from paper.comparison import rows
from paper.section import known

import stickslip as ss
from quad_block import quad_block
from stickslip.cli import main
from stickslip.report import findings, page
from stickslip.scene.known import Known

pytestmark = pytest.mark.slow

#: Elements that have no end tag.
VOID = {"meta", "link", "br", "input", "img"}


class Outline(HTMLParser):
    """Headings, tables, identifiers and links of a page; fails where an element is not closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.headings, self.identifiers, self.links = [], [], [], []
        self.cells, self.captions, self.pictures = [], [], []
        self.addresses = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if tag not in VOID:
            self.open.append(tag)
        if "id" in given:
            self.identifiers.append(given["id"])
        if tag == "a":
            self.links.append(given["href"])
        if tag == "svg":
            self.pictures.append(given.get("aria-label", ""))
        self.addresses += [given[name] for name in ("src", "href", "xlink:href", "data") if name in given]
        if tag in ("h1", "h2", "h3"):
            self.headings.append((int(tag[1]), ""))
        if tag in ("td", "th"):
            self.cells.append("")
        if tag == "caption":
            self.captions.append("")

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open:
            return
        if self.open[-1] in ("h1", "h2", "h3"):
            level, text = self.headings[-1]
            self.headings[-1] = (level, text + data)
        elif self.open[-1] in ("td", "th"):
            self.cells[-1] += data
        elif self.open[-1] == "caption":
            self.captions[-1] += data


def check(text):
    """Check what holds for every page, and return its outline."""
    outline = Outline(text)
    assert len(set(outline.identifiers)) == len(outline.identifiers)
    assert [level for level, _ in outline.headings].count(1) == 1
    for (before, _), (after, _) in zip(outline.headings, outline.headings[1:], strict=False):
        assert after <= before + 1
    assert all(label for label in outline.pictures)
    assert all(caption for caption in outline.captions)
    for link in outline.links:
        assert link.startswith("#")
        assert link[1:] in outline.identifiers
    # Nothing is loaded: what is not inside the page is inside the address.
    assert all(address.startswith(("#", "data:")) for address in outline.addresses)
    assert "url(http" not in text
    assert "@import" not in text
    assert "nan" not in [cell.lower() for cell in outline.cells]
    return outline


@pytest.fixture(scope="module")
def standard():
    found = findings(
        ss.models.two_subsystems(),
        "the <standard> run",
        settings={"duration": 0.6},
        known=known(ss.models.two_subsystems()),
    )
    return found, page(found)


def belt(**law):
    """A mass on a spring, on a belt."""
    contact = ss.Contact(tangential=0, normal=1, **{"friction": 0.3, "slider_speed": 0.1} | law)
    return ss.Scene([1.0, 1.0], np.diag([100.0, 1e4]), force=[0.0, -10.0], contacts=[contact])


def test_the_page_of_the_standard_run(standard):
    found, text = standard
    outline = check(text)
    assert "the &lt;standard&gt; run" in text
    assert (1, "the <standard> run") in outline.headings
    cycle = found.cycle
    assert f"{1e3 * cycle.period:.12g} ms" in text
    assert cycle.period == pytest.approx(8.908492605779e-3, rel=1e-12)
    assert "Steady sliding is unstable: one mode grows (119.36 Hz growing at 49.87 1/s)" in text
    for name in ("Scene", "Steady sliding", "Complex modes", "Limit cycle", "Spectrum", "Energy"):
        assert (2, name) in outline.headings
    for value in (0.6124841528, 0.7015671731, 1.989108991, 2.100205602):
        (point,) = (one for one in found.critical if one.value == pytest.approx(value, rel=5e-10))
        assert f"{point.value:.12g}" in outline.cells
    moved = json.loads(re.search(r'id="move-data">(.*?)</script>', text, re.DOTALL)[1])
    begins = [one.value for one in found.critical if one.kind == "hopf"]
    assert [one["value"] for one in moved["loci"]["hopf"]] == begins
    # Contact forces in steady sliding: friction is 1.5 times normal.
    forces = found.scene.stiffness @ found.equilibrium.position - found.scene.force
    assert f"{forces[3]:.6g}" in outline.cells
    assert f"{forces[2]:.6g}" in outline.cells
    assert forces[2] == pytest.approx(1.5 * forces[3], rel=1e-12)


def test_every_published_number_stands_beside_the_computed_one(standard):
    outline = check(standard[1])
    compared = rows()
    assert len(compared) == 97
    cells = outline.cells
    triples = {tuple(cells[i : i + 3]) for i in range(len(cells) - 2)}
    assert [row for row in compared if (row.quantity, row.published, row.computed) not in triples] == []
    for number in range(2, 16):
        assert any(
            _names(caption, number)
            for caption in re.findall(r"<figcaption>(.*?)<", standard[1])
            + [heading for _, heading in outline.headings]
        ), number


def _names(text, number):
    """Whether a text names a figure, by itself or in a range such as Figs. 5-8."""
    ranges = re.findall(r"(\d+)(?:-(\d+))?", text) if "Fig" in text else []
    return any(int(first) <= number <= int(last or first) for first, last in ranges)


def test_a_shape_in_motion_is_the_mode(standard):
    found, text = standard
    drawing = re.findall(r'<svg role="img" class="motion".*?</svg>', text)[1]
    modes = found.modes
    points = re.findall(r'class="point " .*?data-y="(\S+) (\S+)"', drawing)
    drawn = np.array([complex(float(re_), float(im)) for re_, im in points])
    k = np.flatnonzero(modes.unstable)[0]
    # Three decimals are written.
    assert np.abs(drawn - drawn[6] / modes.shapes[6, k] * modes.shapes[:, k]).max() < 2e-3
    assert np.abs(drawn).max() == pytest.approx(44.0, abs=1e-3)


@pytest.mark.parametrize(
    ("scene", "says"),
    [
        (
            ss.models.two_subsystems(friction=0.3, damping=2e-4),
            ["Steady sliding is stable", "No limit cycle was looked for: no contact changed its status"],
        ),
        (belt(), ["Steady sliding is marginal", "neither grows nor dies out"]),
        (belt(slider_speed=0.0), ["There is no steady sliding", "slider_speed is 0"]),
        (belt(friction=0.0), ["no loci: friction is zero"]),
        (ss.Scene([1.0], [[100.0]], force=[1.0]), ["no loci: the scene has no contact"]),
    ],
    ids=["stable", "neutral", "no speed", "no friction", "no contact"],
)
def test_a_scene_without_limit_cycle_has_a_page(scene, says):
    found = findings(scene, "scene")
    # The published section depends on the model alone and is checked above.
    text = page(found)
    outline = check(text)
    for words in says:
        assert words in text
    assert found.cycle is None
    assert (2, "Limit cycle") in outline.headings
    assert (found.run is None) == ("equilibrium" in found.reasons)


@pytest.mark.nightly
def test_under_a_law_of_friction_stability_is_told_over_slider_speed():
    law = ss.friction.Stribeck(static=0.6, kinetic=0.3, speed=0.2)
    damping = ss.Rayleigh(mass=0.5)
    # mu' N = -(damping) at the Hopf point: 0.3 / 0.2 exp(-v / 0.2) 10 N = 0.5 kg/s.
    expected = 0.2 * np.log(0.3 / 0.2 * 10.0 / 0.5)
    found = findings(belt(friction=law, slider_speed=0.5).replace(damping=damping), "law")
    assert found.parameter == "slider_speed"
    assert [point.value for point in found.critical if point.kind == "hopf"] == pytest.approx([expected])
    text = page(found)
    check(text)
    assert "Stability over slider speed" in text
    assert "There is no motion over a parameter" not in text
    table = ss.friction.Tabulated(speeds=[0.0, 0.2, 0.5], values=[0.6, 0.4, 0.35])
    found = findings(belt(friction=table, slider_speed=0.3).replace(damping=damping), "table")
    # One piece of the table, in which mu is a polynomial.
    assert found.loci.slider_speed.to_numpy()[[0, -1]] == pytest.approx([0.2, 0.5])


def test_quantities_of_a_slow_large_motion_have_units_that_suit_them():
    belt = ss.Contact(tangential="x", friction=0.2, static_friction=0.4, normal_force=10.0, slider_speed=0.5)
    scene = ss.Scene([1.0], [[1.0]], [[0.0]], [0.0], contacts=[belt], dofs=["x"])
    start = Known(start=ss.steady_sliding(scene).perturbed(velocity={"x": -9.0}))
    found = findings(scene, "slow", known=start)
    outline = Outline(page(found))
    period = found.cycle.period
    text = unescape(page(found))
    assert f"limit cycle of period {period:.6g} s (" in text
    assert re.search(r"Per period the sliders bring [0-9.]+ J, of which [0-9.]+ J become friction heat", text)
    assert {"duration, s", "largest, m", "x, m", "slider, J", "displacement, m"} <= set(outline.cells)


def test_a_chaotic_motion_is_named_with_its_exponent():
    found = findings(ss.models.two_subsystems(slider_speed=0.2), "chaos")
    text = page(found)
    check(text)
    assert found.settled == "chaotic"
    assert re.search(r"No limit cycle: the motion is chaotic: largest Lyapunov exponent \d", text)
    assert found.lines.attrs["method"] == "sampled"
    assert "Hann window" in text


def test_a_run_that_its_limit_stops_is_shown_up_to_there():
    found = findings(ss.models.two_subsystems(), "cut", settings={"duration": 1e4, "time_limit": 1e-3})
    assert 0.0 < found.run.duration < 1e4
    assert found.cycle is None
    text = page(found)
    check(text)
    assert f"the time limit of computing, 0.001 s, was reached at {found.run.duration:g} s" in text


def test_events_limit_the_motion_and_no_clock_does():
    found = findings(ss.models.two_subsystems(), "endless", settings={"duration": 1e4})
    assert found.run.stop_reason == "max_events"
    assert len(found.run.events) == 400_000 // 8
    assert found.cycle is not None
    assert f"the limit of 50000 events was reached at {found.run.duration:g} s" in page(found)


def test_a_slow_computer_draws_the_same_page(monkeypatch):
    scene = ss.models.two_subsystems()
    searches = []
    search = ss.Trajectory.limit_cycle
    clock = itertools.count(0.0, 0.5)

    def watched(run, further=None, **options):
        searches.append(further)
        return search(run, further, **options)

    monkeypatch.setattr(ss.Trajectory, "limit_cycle", watched)
    first = page(findings(scene, "same"))
    asked = searches.copy()
    searches.clear()
    # Every look at the clock takes half a second.
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    assert page(findings(scene, "same")) == first
    assert searches == asked
    assert "not computed" not in first


def test_the_search_gets_what_the_motion_leaves_of_the_time_limit(monkeypatch):
    limits = []
    search = ss.Trajectory.limit_cycle

    def watched(run, **options):
        limits.append(options["time_limit"])
        return search(run, **options)

    monkeypatch.setattr(ss.Trajectory, "limit_cycle", watched)
    findings(ss.models.two_subsystems(), "x", settings={"duration": 0.1, "time_limit": 60.0})
    assert len(limits) == 1
    assert 0.0 < limits[0] < 60.0


def test_only_the_published_matrices_are_the_published_model():
    assert [
        c.inclination for c in known(ss.models.two_subsystems(friction=2.2, external_force=3.0)).columns
    ] == [0.3, 0.75]
    assert known(ss.models.two_subsystems(damping=2e-4)) == Known()
    assert known(ss.models.two_subsystems(labels="printed")) == Known()
    assert known(belt()) == Known()


def test_the_paper_belongs_to_its_own_scenes():
    def of_the_paper(scene):
        return known(scene).section is not None

    assert of_the_paper(ss.models.two_subsystems(friction=2.2, slider_speed=0.05))
    assert not of_the_paper(ss.models.two_subsystems(friction=0.6))
    assert not of_the_paper(ss.models.two_subsystems(preload_displacement=2e-3))
    assert not of_the_paper(belt())


def test_the_parameter_of_the_sweep_is_followed():
    model = partial(ss.models.two_subsystems, friction=0.5)
    found = findings(
        model(), "x", settings={"duration": 0.01}, model=model, parameters={"wall_stiffness": [1.8e6, 1.9e6]}
    )
    assert found.parameter == "wall_stiffness"
    assert found.loci.wall_stiffness.to_numpy().tolist() == [1.8e6, 1.9e6]
    assert "Stability over wall stiffness" in page(found)


def test_curves_over_two_parameters_have_a_section():
    model, values = ss.models.two_subsystems, {"friction": [0.0, 3.0], "vertical_stiffness_0": [5e4, 2e6]}
    found = findings(model(), "x", settings={"duration": 0.01}, model=model, parameters=values)
    assert found.parameter == "friction"
    assert len(found.boundary) == 2
    text = page(found)
    outline = check(text)
    assert (2, "Stability over two parameters") in outline.headings
    assert {"Curves", "Points of codimension two"} <= set(outline.captions)
    assert {"double hopf", "2.20159862977", "156687.999188", "0.584721 to 3"} <= set(outline.cells)
    assert "agree at 64 x 64 places" in text
    (drawing,) = (label for label in outline.pictures if "2 curves on which" in label)
    assert drawing.startswith("Largest growth rate over vertical stiffness 0 and friction; ")
    # Without curves there is nothing to draw, and the map is still there.
    values = {"friction": [0.0, 0.1], "damping": [1e-4, 2e-4]}
    calm = findings(model(), "x", settings={"duration": 0.01}, model=model, parameters=values)
    assert len(calm.boundary) == 0
    assert "Curves: none." in page(calm)


@pytest.mark.nightly
def test_a_band_of_a_large_scene_and_what_is_missing_along_its_curves(monkeypatch):
    # As many values as show what is told; a whole report of a mesh takes a minute.
    for name, count in (("CELLS", 3), ("VALUES", 11)):
        monkeypatch.setattr(sys.modules["stickslip.report.findings"], name, count)
    mesh, ranges = quad_block(10, 6, 2, sparse=True), {"friction": [0.0, 0.5], "stiffness": [0.95, 1.05]}
    settings = {"duration": 1e-4, "time_limit": 2.0}
    found = findings(mesh, "x", settings=settings, parameters=ranges, band=(38e3, 45e3))
    assert len(mesh.dofs) == 132
    assert 0 < len(found.modes) < 10
    assert found.loci.sizes["branch"] < 10
    text = page(found)
    outline = check(text)
    assert "All modes from 38000 to 45000 Hz; 0.00 eigenvalues of this band were not found." in text
    assert "Only modes from 38000 to 45000 Hz were computed." in text
    assert len(found.boundary) >= 1
    for curve in found.boundary:
        counted = ~np.isnan(curve.missing)
        assert 2 <= np.count_nonzero(counted) < counted.size
        assert f"0.00 at {np.count_nonzero(counted)} of {counted.size} points" in outline.cells
    with pytest.raises(ss.InputError, match="band: steady sliding has no mode from"):
        findings(mesh, "x", settings=settings, band=(1.0, 2.0))


def test_the_command_line_takes_a_band(tmp_path):
    scene, path = tmp_path / "brake.toml", tmp_path / "brake.html"
    assert CliRunner().invoke(main, ["init", str(scene)]).exit_code == 0
    command = ["report", str(scene), "--duration", "0.01", "--band", "150", "250"]
    told = CliRunner().invoke(main, command)
    assert told.exit_code == 0, told.output
    assert "Only modes from 150 to 250 Hz were computed." in told.output.replace("\n", " ")
    text = path.read_text(encoding="utf-8")
    assert "All modes from 150 to 250 Hz; 0.00 eigenvalues of this band were not found." in text
    assert "--duration 0.01 --band 150.0 250.0" in text


def test_curves_that_cannot_be_followed_say_why_and_wrong_names_are_refused():
    scene, settings = ss.models.two_subsystems(damping=0.0), {"duration": 0.01}
    values = {"friction": [0.0, 3.0], "stiffness": [0.5, 2.0]}
    found = findings(scene, "x", settings=settings, parameters=values)
    assert found.boundary is None
    text = page(found)
    check(text)
    assert "no curves over friction and stiffness: model: a mode neither grows nor decays" in text
    assert "Stability over two parameters" not in page(findings(scene, "x", settings=settings))
    for wrong, message in (
        ({"friction": [0.0, 3.0], "nothing": [0.0, 1.0]}, "nothing: "),
        ({"friction": [0.0, 3.0], "stiffness": "wide"}, "stiffness: "),
        ({"friction": [0.0], "stiffness": [1.0], "mass": [1.0]}, "expected one or two, got"),
    ):
        with pytest.raises(ss.InputError, match=message):
            findings(scene, "x", settings=settings, parameters=wrong)


def test_a_scene_file_with_a_sweep_over_two_parameters_asks_for_curves(tmp_path):
    file = tmp_path / "brake.toml"
    over = {"friction": {"from": 0.0, "to": 3.0, "count": 5}, "damping": [1e-4, 2e-4]}
    ss.save(ss.Case(ss.models.two_subsystems, run={"duration": 0.01}, sweep=over), file)
    result = CliRunner().invoke(main, ["report", str(file)])
    assert result.exit_code == 0, result.output
    assert "follows friction instead" not in result.output
    outline = check((tmp_path / "brake.html").read_text(encoding="utf-8"))
    assert any("2 curves on which stability" in label for label in outline.pictures)


def test_nothing_is_searched_where_every_mode_decays(monkeypatch):
    def search(*_, **__):
        raise AssertionError("a limit cycle was looked for")

    monkeypatch.setattr(ss.Trajectory, "limit_cycle", search)
    found = findings(ss.models.two_subsystems(friction=0.3), "x", settings={"duration": 0.2})
    assert found.settled == "decaying"
    assert "every mode decays" in found.reasons["cycle"]


def test_it_tells_what_it_is_at(tmp_path):
    told = []
    ss.write_report(belt(), tmp_path / "belt.html", settings={"duration": 0.5}, told=told.append)
    assert [text.split()[0] for text in told] == ["computing"] * 3 + ["looking", "drawing", "computing"]
    assert told[-1] == "computing motions to move through"


def test_the_verb_writes_the_page(tmp_path):
    file = tmp_path / "belt.toml"
    ss.save(belt(static_friction=0.4), file)
    result = CliRunner().invoke(main, ["report", str(file), "--duration", "2.0"])
    assert result.exit_code == 0, result.output
    assert "Steady sliding is marginal" in result.output
    outline = check((tmp_path / "belt.html").read_text(encoding="utf-8"))
    assert (1, "belt") in outline.headings
    nowhere = CliRunner().invoke(main, ["report", str(file), "-o", str(tmp_path / "none" / "a.html")])
    assert nowhere.exit_code == 2
    assert f"no such folder: {tmp_path / 'none'}" in nowhere.output
    refused = CliRunner().invoke(main, ["report", str(tmp_path / "none.toml")])
    assert refused.exit_code == 2
    assert "none.toml" in refused.output
    negative = CliRunner().invoke(main, ["report", str(file), "--duration", "-1"])
    assert negative.exit_code == 2
    assert "duration" in negative.output


def test_the_page_holds_date_command_and_scene_file(tmp_path):
    file = tmp_path / "belt.toml"
    ss.save(belt(static_friction=0.4), file)
    file.write_text(file.read_text() + "# <as it stands> & nothing else\n")
    options = ["--duration", "0.5", "--set", "friction=[0.2]"]
    told = CliRunner().invoke(main, ["report", str(file), *options], env={"SOURCE_DATE_EPOCH": "86400"})
    assert told.exit_code == 0, told.output
    text = (tmp_path / "belt.html").read_text(encoding="utf-8")
    check(text)
    assert "1970-01-02 00:00 UTC" in text
    assert f"stickslip report {file} --set &#39;friction=[0.2]&#39; --duration 0.5" in text
    copies = re.findall("<pre>(.*?)</pre>", text, flags=re.DOTALL)
    assert [unescape(copy) for copy in copies] == [file.read_text()]
    wrong = CliRunner().invoke(main, ["report", str(file)], env={"SOURCE_DATE_EPOCH": "today"})
    assert wrong.exit_code == 2
    assert "SOURCE_DATE_EPOCH: expected seconds since 1970, got 'today'" in wrong.output


def test_a_scene_file_too_long_for_the_page_is_told_by_its_digest():
    text = page(findings(belt(), "x", settings={"duration": 0.1}), source="#" * 300_000)
    assert "<pre>" not in text
    assert sha256(b"#" * 300_000).hexdigest() in text


def test_many_dofs_are_drawn_at_fewer_instants_and_told_from_the_last_quarter():
    size = 60
    stiffness = np.diag(np.linspace(1e2, 1e4, size))
    contact = ss.Contact(tangential=0, normal=1, friction=0.3, slider_speed=0.1)
    force = np.zeros(size)
    force[1] = -10.0
    scene = ss.Scene(np.ones(size), stiffness, force=force, contacts=[contact])
    start = ss.steady_sliding(scene).perturbed(velocity={"x3": 1e-3})
    found = findings(scene, "x", start=start, settings={"duration": 1.0})
    assert found.since == 0.75
    assert float(found.balance.contacts.time.sum()) == pytest.approx(0.25)
    assert found.lines.attrs["begin"] == 0.75
    # As many samples a second as of the whole.
    assert found.lines.frequency.to_numpy()[-1] == pytest.approx(2**13)
    assert "transform of the last 0.25 s" in page(found)


def test_unsymmetric_matrices_are_shown():
    scene = belt(friction=0.5, static_friction=0.8)
    skew = np.zeros((scene.size, scene.size))
    skew[0, 1], skew[1, 0] = 1.0, -1.0
    unsymmetric = scene.replace(gyroscopic=0.01 * skew, circulatory=0.01 * skew)
    text, plain = (page(findings(one, "belt")) for one in (unsymmetric, scene))
    for caption in ("Gyroscopic matrix, N s/m", "Circulatory matrix, N/m"):
        assert caption in text
        assert caption not in plain


def test_names_of_dofs_keep_the_scripts_of_the_page_alive(tmp_path):
    # "<!--<script>" inside a script element keeps "</script>" from ending it.
    standard = ss.models.two_subsystems()
    names = ["<!--<script>", *standard.dofs[1:]]
    contacts = [
        replace(one, tangential=t, normal=t + 1) for one, t in zip(standard.contacts, (2, 6), strict=True)
    ]
    scene = standard.replace(dofs=names, contacts=contacts)
    path = tmp_path / "report.html"
    ss.write_report(scene, path)
    (data,) = re.findall(r'<script type="application/json" id="move-data">(.*?)</script>', path.read_text())
    assert "<" not in data
    assert names[0] in json.dumps(json.loads(data))


def test_a_folder_that_does_not_exist_is_told_before_anything_is_computed(tmp_path):
    steps = []
    with pytest.raises(ss.InputError, match="path: no such folder: "):
        ss.write_report(ss.models.two_subsystems(), tmp_path / "missing" / "page.html", told=steps.append)
    assert steps == []
