"""What holds of every public class: it says what it is, notebooks show it, it survives pickle and copy."""

import copy
import inspect
import pickle
import re
from functools import cache, partial
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray as xr
from matplotlib.animation import AbstractMovieWriter, FuncAnimation
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.linalg import block_diag

import stickslip as ss
from stickslip import types
from stickslip.show.mesh import Mesh


def plane_of():
    """Return where the published model becomes unstable over two parameters; the curve turns in one."""
    ranges = {"friction": (0.5, 0.75), "vertical_stiffness_0": (2e5, 4e5)}
    return ss.stability_boundary(ss.models.two_subsystems, ranges, cells=3)


def boundary_of_basins():
    """Return the cycle that bounds the basin of steady sliding of a mass on a belt."""
    scene = ss.models.bistable_oscillator()
    starts = {"position": {"x": [0.0, 1.0, 2.0]}, "velocity": {"x": [0.0, 0.5]}}
    return ss.basins(scene, start=ss.steady_sliding(scene), **starts).boundary()


def touching_speed():
    """Return where the unstable cycle of sliding touches the speed of its belt, over that and damping."""
    model = ss.models.bistable_oscillator
    start = ss.steady_sliding(model()).perturbed(velocity={"x": 1.3})
    cycle = ss.simulate(model(), 8.0, start).closed_cycle()
    (point,) = ss.continuation(cycle, {"slider_speed": (1.5, 1.9)}, step=0.2).points
    plane = {"slider_speed": (1.8, 1.9), "damping_ratio": (0.04, 0.06)}
    return ss.continuation(point, plane, model, step=0.5)


@cache
def examples():
    scene = ss.models.two_subsystems()
    run = ss.simulate(scene, 0.6, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}))
    cycle = run.limit_cycle()
    bouncing = ss.Scene(
        [1.0, 1.0],
        np.diag([100.0, 1.0]),
        force=[0.0, -10.0],
        contacts=[ss.Contact(tangential=0, normal=1, friction=0.5, restitution=0.5, name="ball")],
    )
    drop = ss.simulate(bouncing, 3.0, ss.State([0.0, 0.1], [0.0, 0.0], "d"))
    shaken = ss.Scene(
        [1.0], [[50.0]], damping=[[1.0]], loads=[ss.Harmonic({"x1": 1.0}, frequency=1.0, name="shaker")]
    )
    grazing = types.Grazing(0.1, 0, "impact", 1e-20, 1e-18, "0")
    unstable = types.BranchPoint("friction", 2.5464, "period_doubling", -1.0 + 0j, None, None, cycle)
    return {
        "Scene": scene,
        "Contact": bouncing.contacts[0],
        "Rayleigh": scene.damping,
        "State": run.start,
        "Equilibrium": ss.steady_sliding(scene),
        "Case": ss.Case(scene, run={"duration": 0.6}),
        "Modes": ss.complex_modes(scene),
        "Mode": ss.complex_modes(scene)[2],
        "Reduced": ss.equations_of(scene, "+s"),
        "StatusTable": ss.status_table(scene, ["++", "ss"]),
        "CriticalPoint": ss.critical_points(scene, {"friction": (0.5, 1.0)}, kinds=("hopf",))[0],
        "CriticalPoints": ss.critical_points(scene, {"friction": (0.5, 1.0)}),
        "StabilityBoundary": (boundary := plane_of()),
        "BoundaryCurve": boundary[0],
        "CodimensionTwo": boundary.points[0],
        "Trajectory": run,
        "Motion": cycle.run,
        "BasinBoundary": boundary_of_basins(),
        "Basins": types.Basins(xr.DataArray([[0]], {"x": [0.5], "y": [1.0]}, ("x", "y")), (cycle,)),
        "Bifurcation": ss.bifurcation(scene, {"friction": [1.5]}),
        "Branch": ss.continuation(cycle, {"friction": (1.5, 1.51)}, step=0.5),
        "Events": run.events,
        "Event": run.events[0],
        "Grazing": grazing,
        "Accumulation": drop.accumulations[0],
        "Outcome": next(ss.simulate_many([scene], duration=0.2, velocity={"x1": 1e-3})),
        "Cycle": cycle,
        "Harmonic": shaken.loads[0],
        "Spring": ss.Spring({"x1": 1.0, "x2": -1.0}, ss.spring.Gap(1e5, 1e-3), 0.1, name="bump"),
        "Damper": ss.Damper([1.0, 0.0], ss.spring.Law(lambda u, c=2.0: c * np.tanh(u))),
        "Switched": ss.Switched({"x1": 1.0}, times=[0.1], values=[1.0, 0.0]),
        "FrequencyResponse": ss.frequency_response(
            shaken, {"shaker_frequency": [1.0, 1.5]}, start=ss.State([0.0], [0.0], "")
        ),
        "CyclePhase": cycle.phases[0],
        "Margin": cycle.margins()[0],
        "BranchPoint": unstable,
        "BifurcationCurve": touching_speed(),
        "Balance": cycle.balance(),
        "ModeSelection": ss.mode_selection(scene, np.linspace(1e-5, 1e-4, 3), phases=4),
        "View": types.View(
            Mesh(np.eye(2), np.array([[0, -1], [-1, 1]]), {}), np.ones((2, 2)), 0.1, 1.0, ("", ""), "m"
        ),
        "StickslipError": ss.StickslipError("something"),
        "InputError": ss.InputError("friction: must be >= 0, got -1"),
        "NoSteadyStateError": ss.NoSteadyStateError("contact 0 would pull"),
        "RunError": ss.RunError("cannot go on", drop),
        "OrbitError": ss.OrbitError("no orbit"),
        "NotPeriodicError": ss.NotPeriodicError("chaotic", drop, "chaotic", 3.0, 0.5),
        "StudyError": ss.StudyError("cannot go on", xr.Dataset({"x": 1.0})),
        "Interrupted": ss.Interrupted("interrupted", xr.Dataset({"x": 1.0})),
        "Study": ss.Study(scene, {"friction": [0.5, 1.0, 1.5, 2.0]}, outputs=["growth_rate"]),
    }


NAMES = [
    "Accumulation", "Balance", "BasinBoundary", "Basins", "Bifurcation", "BifurcationCurve",
    "BoundaryCurve", "Branch", "BranchPoint", "Case", "CodimensionTwo", "Contact", "CriticalPoint",
    "CriticalPoints", "Cycle", "CyclePhase", "Damper", "Equilibrium", "Event", "Events",
    "FrequencyResponse", "Grazing", "Harmonic", "InputError", "Interrupted", "Margin", "Mode",
    "ModeSelection", "Modes", "Motion", "NoSteadyStateError", "NotPeriodicError", "OrbitError", "Outcome",
    "Rayleigh", "Reduced", "RunError", "Scene", "Spring", "StabilityBoundary", "State", "StatusTable",
    "StickslipError", "Study", "StudyError", "Switched", "Trajectory", "View",
]  # fmt: skip


def same(a, b):
    """Whether two values are equal to the last bit, all the way down."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, xr.Dataset | xr.DataArray):
        return a.identical(b)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    if isinstance(a, types.Events):
        return same(vars_of(a, "time", "contact", "kind", "combination"), vars_of(b, *EVENTS))
    if isinstance(a, types.CriticalPoints):
        return same(list(a), list(b)) and same(a.to_dataset(), b.to_dataset())
    if isinstance(a, types.Motion | ss.Cycle):
        return same(a.scene, b.scene) and same(a.core.record(), b.core.record())
    if isinstance(a, ss.Scene):
        return same(a.__reduce__()[1], b.__reduce__()[1])
    if isinstance(a, ss.Study):
        return same(a.identity, b.identity)
    if hasattr(a, "data") and hasattr(a, "indptr"):
        return same([a.data, a.indices, a.indptr], [b.data, b.indices, b.indptr])
    if isinstance(a, partial):
        return same([a.func, a.args, a.keywords], [b.func, b.args, b.keywords])
    if isinstance(a, BaseException):
        return same(a.args, b.args) and same(vars(a), vars(b))
    if type(a).__module__.startswith("stickslip") and hasattr(a, "__dict__"):
        return same(public(a), public(b))
    if isinstance(a, partial):
        return same([a.func, a.args, a.keywords], [b.func, b.args, b.keywords])
    if isinstance(a, float | complex):
        return np.array(a).tobytes() == np.array(b).tobytes()
    return bool(a == b)


EVENTS = ("time", "contact", "kind", "combination")


def vars_of(value, *names):
    return [getattr(value, name) for name in names]


def public(value):
    return {name: part for name, part in vars(value).items() if not name.startswith("_")}


def test_every_public_class_is_here():
    spaces = (ss, types)
    classes = {name for space in spaces for name in dir(space) if inspect.isclass(getattr(space, name))}
    assert sorted(classes) == NAMES == sorted(examples())


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("way", ["pickle", "copy", "deepcopy"])
def test_copies_are_the_same_to_the_last_bit(name, way):
    value = examples()[name]
    ways = {
        "pickle": lambda x: pickle.loads(pickle.dumps(x)),
        "copy": copy.copy,
        "deepcopy": copy.deepcopy,
    }
    assert same(ways[way](value), value)


def test_a_difference_would_be_seen():
    run = examples()["Trajectory"]
    other = ss.simulate(run.scene, 0.6, run.start.perturbed(velocity={"x2": 1e-17}))
    assert not same(other, run)
    assert not same(examples()["Scene"].replace(friction=1.6), examples()["Scene"])


@pytest.mark.parametrize("method", ["modal", "taylor"])
def test_a_motion_read_back_goes_on_as_before(method):
    scene = ss.models.two_subsystems(friction=2.2, slider_speed=0.05)
    run = ss.simulate(scene, 0.3, ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3}), method=method)
    again = pickle.loads(pickle.dumps(run))
    times = np.linspace(0.0, 0.3, 997)
    assert again.sample(times).identical(run.sample(times))
    assert again.energy(times).identical(run.energy(times))
    assert same(again.balance(0.1, 0.2), run.balance(0.1, 0.2))
    assert again.counters == run.counters
    first, second = again.limit_cycle(), run.limit_cycle()
    assert first.period == second.period
    assert first.multipliers.tobytes() == second.multipliers.tobytes()


def test_parts_that_run_by_themselves_survive():
    one = ss.models.two_subsystems(friction=2.2)
    pair = ss.Scene(
        np.concatenate([one.mass, [1.0]]),
        block_diag(one.stiffness.toarray(), 100.0),
        one.damping,
        np.concatenate([one.force, [0.0]]),
        one.contacts,
    )
    run = ss.simulate(pair, 0.3, ss.steady_sliding(pair).perturbed(velocity={"x1": 1e-3, "x9": 1.0}))
    again = pickle.loads(pickle.dumps(run))
    times = np.linspace(0.0, 0.3, 101)
    assert len(run.events) > 50
    assert again.sample(times).identical(run.sample(times))


def test_a_cycle_read_back_can_be_asked_everything():
    cycle = examples()["Cycle"]
    again = pickle.loads(pickle.dumps(cycle))
    assert again.harmonics().identical(cycle.harmonics())
    assert again.margins() == cycle.margins()
    assert again.multipliers.tobytes() == cycle.multipliers.tobytes()
    assert same(again.run, cycle.run)
    near = cycle.scene.replace(friction=1.51)
    assert again.continued(near).period == cycle.continued(near).period


def test_motions_that_stopped_early_survive():
    scene = examples()["Scene"]
    start = examples()["State"]
    stopped = ss.simulate(scene, 10.0, start, max_events=5)
    assert pickle.loads(pickle.dumps(stopped)).stop_reason == "max_events"


class Tables(HTMLParser):
    """Tags that are open, and the text in cells."""

    def __init__(self):
        super().__init__()
        self.open, self.cells = [], []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        if tag in ("td", "th", "dd", "dt", "caption"):
            self.cells.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th", "dd", "dt", "caption"):
            self.cells[-1] += data


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Scene", ["x3", "x4", "1.5", "0.025", "slider speed, m/s", "0.0001 s times stiffness"]),
        ("Modes", ["119.3580", "unstable", "+49.8657"]),
        ("Trajectory", ["ss", "312", "0 to 0.6 s, stopped by duration", "slip+"]),
        ("Events", ["Events 301 to 312", "0.584245903512", "velocity"]),
        ("Cycle", ["8.90849261 ms", "112.252 Hz", "stable", "+d", "2.37965"]),
        ("Balance", ["stored", "damping", "work, J", "−0.00213284"]),
        ("StatusTable", ["113.14", "ss"]),
    ],
)
def test_notebooks_show(name, expected):
    parser = Tables()
    parser.feed(examples()[name]._repr_html_())
    assert parser.open == []
    for text in expected:
        assert text in parser.cells, parser.cells


def test_names_cannot_break_a_notebook():
    scene = examples()["Scene"].replace(dofs=["<script>", *"bcdefgh"])
    assert "<script>" not in scene._repr_html_()


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        ("Scene", r"8 dofs, 2 contacts(.|\n)*contact 0 \(x3 / x4\): friction 1.5, slider speed 0.025 m/s"),
        (
            "Contact",
            r"^Contact\(tangential=0, normal=1, friction=0.5, restitution=0.5, name='ball'\)$",
        ),
        ("State", r"\+\+.*8 dofs"),
        ("Modes", r"119\.3580 +-0\.066492 +\+49\.8657  unstable"),
        ("Reduced", r"'\+s', 5 of 8 coordinates free"),
        ("Trajectory", r"0\.6 s, 312 events, 0 grazings, stopped by duration"),
        ("Events", r"Events\(312\)(.|\n)*302 more"),
        ("Cycle", r"period 8\.90849261 ms, 112\.252 Hz, \+\+ \+d .* stable"),
        ("Balance", r"damping +-2\.13283\de-03 J"),
        ("CriticalPoint", r"hopf at friction = 0\.7015671730\d+, .* Hz, destabilising"),
        ("BifurcationCurve", r"grazing of contact 0 over slider_speed, damping_ratio"),
        ("BranchPoint", r"period_doubling at friction = 2\.5464, multiplier -1\+0j, 112\.252 Hz"),
        ("Outcome", r"^Outcome\(0: Trajectory\(0\.2 s, \d+ events"),
        ("Case", r"Case of Scene(.|\n)*run: duration = 0\.6"),
        ("StatusTable", r"ss +113\.14"),
        ("ModeSelection", r"119\.358 +49\.8657 .* dominant"),
        ("Study", r"4 samples.*friction -> growth_rate"),
    ],
)
def test_repr_tells(name, pattern):
    text = repr(examples()[name])
    assert re.search(pattern, text), text
    assert " at 0x" not in text


def test_repr_of_other_contacts():
    contact = ss.Contact(
        tangential=[0.8, 0.6],
        normal=[-0.6, 0.8],
        friction=0.3,
        static_friction=0.4,
        restitution=0.2,
        gap=1e-3,
    )
    scene = ss.Scene([1.0, 1.0], np.eye(2), np.eye(2), contacts=[contact])
    assert repr(scene) == (
        "Scene(2 dofs, 1 contacts)\n  dofs: x1, x2\n  damping: matrix\n"
        "  contact 0 (0.8 x1 + 0.6 x2 / -0.6 x1 + 0.8 x2): friction 0.3, static 0.4, slider speed 0 m/s, "
        "restitution 0.2, gap 0.001 m"
    )
    failed = next(ss.simulate_many([scene.replace(slider_speed=0.0)], duration=0.1))
    assert "InputError: contact 0: slider_speed is 0" in repr(failed)


def test_events_are_a_sequence_that_names_contacts():
    contacts = [
        ss.Contact(tangential=2, normal=3, friction=1.5, slider_speed=0.025, name="left"),
        ss.Contact(tangential=6, normal=7, friction=1.5, slider_speed=0.025, name="right"),
    ]
    scene = ss.models.two_subsystems().replace(contacts=contacts)
    start = ss.steady_sliding(scene).perturbed(velocity={"x1": 1e-3})
    events = ss.simulate(scene, 0.2, start).events
    assert [one.time for one in events] == events.time.tolist()
    assert [one.name for one in events] == [("left", "right")[place] for place in events.contact]
    assert events[-1] == events[len(events) - 1] == list(events)[-1]
    assert events[2:5] == tuple(events[k] for k in (2, 3, 4))
    with pytest.raises(IndexError):
        events[len(events)]
    frame = events.to_dataframe()
    assert frame.contact.tolist() == [one.name for one in events]
    assert frame.combination.tolist() == events.combination.tolist()
    assert f"contact {events[0].name} " in repr(events).splitlines()[1]
    assert events.summary().tables[0].rows[-1][1] == events[-1].name


def test_a_mode_has_the_number_that_is_shown():
    modes = examples()["Modes"]
    assert len(modes) == modes.eigenvalues.size == len(list(modes))
    grows = [mode.number for mode in modes if mode.unstable]
    assert grows == np.flatnonzero(modes.unstable).tolist()
    mode = modes[grows[0]]
    assert mode.eigenvalue == modes.eigenvalues[grows[0]]
    np.testing.assert_array_equal(mode.shape, modes.shapes[:, grows[0]])
    assert modes[-1].number == len(modes) - 1
    with pytest.raises(IndexError):
        modes[len(modes)]
    (shown,) = (line for line in repr(modes).splitlines() if "unstable" in line)
    (row,) = (
        row
        for row, kind in zip(modes.summary().tables[0].rows, modes.summary().tables[0].kinds, strict=True)
        if kind
    )
    assert int(shown.split()[0]) == int(row[0]) == mode.number
    assert modes.plot.shapes([mode.number]).axes[0].get_title().startswith(f"mode {mode.number}: ")


#: What analyses return.
RESULTS = [
    "Balance", "BasinBoundary", "Basins", "Bifurcation", "Branch", "CriticalPoints", "Cycle",
    "Balance", "Basins", "Bifurcation", "BifurcationCurve", "Branch", "CriticalPoints", "Cycle",
    "Equilibrium", "Events",
    "FrequencyResponse",
    "ModeSelection", "Modes", "Motion",
    "StabilityBoundary", "StatusTable", "Trajectory",
]  # fmt: skip


def test_every_result_is_here():
    classes = {getattr(space, name) for space in (ss, types) for name in dir(space)}
    shown = {one.__name__ for one in classes if inspect.isclass(one) and hasattr(one, "to_dataset")}
    # Critical points are drawn with the loci that they belong to.
    assert shown == set(RESULTS)


@pytest.mark.parametrize("name", RESULTS)
def test_every_result_has_a_dataset_a_summary_and_a_drawing(name, tmp_path):
    result = examples()[name]
    dataset = result.to_dataset()
    assert dataset.data_vars
    for variable in dataset.data_vars.values():
        assert variable.dtype.kind in "biUO" or variable.attrs.get("units"), variable.name
    ss.save(result, tmp_path / "result.nc")
    again = ss.load(tmp_path / "result.nc")
    again = again if isinstance(again, xr.Dataset) else again.to_dataset()
    assert set(again.variables) == set(dataset.variables)
    axes = Figure().subplots()
    assert result.plot(ax=axes) is axes
    assert axes.get_xlabel()
    assert axes.lines or axes.patches or axes.collections


#: What names a thing that is drawn, or is drawn itself: the only arguments without a keyword.
NAMING = {
    "contacts", "displacement", "displacements", "dof", "dofs", "masses", "number", "numbers", "values",
    "branches", "combination", "data", "effects", "energy", "estimate", "estimates", "flow", "indices",
    "lines", "mode", "moments", "output", "results",
}  # fmt: skip
#: What a drawing needs beside its result.
GIVEN = {"shape": (2,), "orbits": (2, {"m1": ("x1", "x2")})}
DRAWN = sorted({"Scene", *RESULTS})


def drawings(plot):
    """Return the ways to draw of a `plot`, a method or an accessor, by name."""
    if inspect.ismethod(plot):
        return {"": plot}
    names = [name for name in dir(plot) if not name.startswith("_")]
    return {"": plot.__call__, **{name: getattr(plot, name) for name in names}}


def follows_the_rule(draw):
    """Whether keywords, return and docstring of a drawing fit each other; returns what it returns."""
    signature = inspect.signature(draw)
    for name, parameter in signature.parameters.items():
        assert parameter.kind is not inspect.Parameter.POSITIONAL_OR_KEYWORD or name in NAMING, (draw, name)
    owners = {"ax", "figure"} & set(signature.parameters)
    for name in owners:
        assert signature.parameters[name].default is None
    # Matplotlib is imported for types only where a result has one drawing.
    kinds = {one.__name__: one for one in (Axes, Figure, FuncAnimation, types.View)}
    returned = kinds[signature.return_annotation]
    assert owners == {Axes: {"ax"}, Figure: {"figure"}}.get(returned, set()), draw
    first = inspect.getdoc(draw).split("\n\n")[0]
    assert "return the Axes" in first if returned is Axes else f"Return a {returned.__name__}" in first, first
    return returned


@pytest.mark.parametrize("name", DRAWN)
def test_every_drawing_returns_what_its_docstring_says(name):
    result = examples()[name]
    for method, draw in drawings(result.plot).items():
        returned = follows_the_rule(draw)
        if method in ("mesh", "view"):
            continue
        given = {"ax": Figure().subplots()} if returned is Axes else {}
        if method == "animate":
            given = {"frames": 2}
        drawn = draw(*GIVEN.get(method, ()), **given)
        assert type(drawn) is returned or drawn is given.get("ax")
        if method == "animate":
            drawn.save("unused", writer=Nowhere())


class Nowhere(AbstractMovieWriter):
    """A writer of no file."""

    def setup(self, fig, outfile, dpi=None):
        super().setup(fig, outfile, dpi)

    def grab_frame(self, **_):
        assert self.fig.axes

    def finish(self):
        pass


def test_pairs_follow_the_same_rule():
    assert follows_the_rule(ss.fe.Pairs.plot.__get__(object())) is Axes


def test_several_panels_are_drawn_in_a_figure_that_is_given():
    run = examples()["Trajectory"]
    own = Figure()
    panels = own.subplots(2, 1).tolist()
    assert run.plot.history(["x1", "x2"], figure=own) is own
    assert own.axes == panels
    assert [axes.get_ylabel() for axes in panels] == ["x1, µm", "x2, µm"]
    with pytest.raises(ss.InputError, match="figure: expected 3 panels or none, got 2"):
        run.plot.history(["x1", "x2", "x3"], figure=own)
    left, _ = (whole := Figure(layout="constrained")).subfigures(1, 2)
    assert run.plot.phase_planes(figure=left) is whole
    assert len(left.axes) == len(whole.axes) == 2


def test_a_plot_lists_its_drawings():
    assert repr(examples()["Balance"].plot) == "BalancePlots: plot(), plot.flow()"


@pytest.mark.parametrize("name", ["Scene", *RESULTS])
def test_a_summary_is_text_and_html(name):
    summary = examples()[name].summary()
    text, page = str(summary), summary._repr_html_()
    assert page == examples()[name]._repr_html_()
    for table in summary.tables:
        assert table.caption in text
        assert table.caption in page
        assert len(table.rows) > 0


@pytest.mark.parametrize("name", RESULTS)
def test_every_attribute_of_a_result_has_a_type(name):
    kind = type(examples()[name])
    for attribute in dir(kind):
        found = inspect.getattr_static(kind, attribute)
        if attribute.startswith("_") or getattr(found, "__module__", "stickslip").startswith("collections"):
            continue
        getter = found.fget if isinstance(found, property) else getattr(found, "func", None)
        if getter is not None:
            assert "Any" not in str(getter.__annotations__["return"]), attribute
        elif inspect.isfunction(found):
            assert "Any" not in str(found.__annotations__["return"]), attribute
    for attribute, annotation in inspect.get_annotations(kind).items():
        assert "Any" not in str(annotation), attribute


def test_columns_of_numbers_are_aligned():
    text = str(examples()["Scene"].summary())
    assert "0.3 to 0.7 kg" in text
    # Numbers stand to the right below their headings.
    assert len({len(line) for line in text.splitlines()[-3:]}) == 1
