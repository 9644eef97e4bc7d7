"""`ss.plot` draws every dataset that the package returns, also one that comes from a file."""

from functools import cache

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

import stickslip as ss

SCENE = ss.models.two_subsystems(friction=1.5)


@cache
def datasets():
    """Return a dataset of every kind with a picture, by name."""
    run = ss.simulate(SCENE, 0.3)
    cycle = run.limit_cycle()
    over = {"friction": [1.4, 1.5]}
    study = ss.Study(
        ss.models.two_subsystems,
        {"friction": stats.uniform(0.5, 1.5)},
        outputs=["growth_rate", "normal_force", "eigenvalues"],
        samples=16,
    )
    results = study.run()
    times = np.linspace(0.0, cycle.period, 33)
    return {
        "sweep": ss.sweep(SCENE, {"friction": [0.5, 1.0, 1.5]}),
        "map": ss.sweep(SCENE, {"friction_0": [0.5, 1.5], "friction_1": [0.5, 1.5]}),
        "diagram": ss.bifurcation(SCENE, over).to_dataset(),
        "branch": ss.continuation(cycle, {"friction": (1.5, 1.51)}, step=0.5).to_dataset(),
        "basins": ss.basins(SCENE, over, velocity={"x1": [1e-3, 2e-3]}).to_dataset(),
        "lines": run.spectrum(),
        "harmonics": cycle.harmonics(8),
        "transform": run.spectrum("x2", end=0.1),
        "energy": cycle.run.energy(times),
        "modal": ss.modal_energy(cycle.run, times),
        "study": results,
        "probability": ss.study.probability(results, "friction", bins=2),
        "convergence": ss.study.convergence(results, "growth_rate"),
        "moments": study.eigenvalue_moments(),
    }


SINGLE = {
    "diagram": [((), {}), (("x1",), {})],
    "branch": [((), {})],
    "basins": [((), {})],
    "lines": [((), {}), (("x2",), {"label": "exact"})],
    "harmonics": [((), {}), (("x2",), {})],
    "transform": [((), {})],
    "energy": [(("stored",), {}), (("rate",), {}), (("powers",), {})],
    "modal": [(("++",), {})],
    "study": [(("growth_rate",), {"bins": 4}), (("normal_force",), {"contact": 0})],
    "probability": [((), {"label": "all"})],
    "convergence": [((), {})],
    "moments": [((), {"results": "study", "mode": 1})],
}
SEVERAL = {"sweep": {"slow": False}, "map": {}, "energy": {}, "study": {}}


@pytest.mark.parametrize("kind", SINGLE)
def test_one_panel_is_drawn_on_the_axes_that_are_given(kind):
    for what, options in SINGLE[kind]:
        axes = Figure().add_subplot()
        given = {name: datasets()[value] if name == "results" else value for name, value in options.items()}
        assert ss.plot(datasets()[kind], *what, ax=axes, **given) is axes
        assert axes.has_data()
        assert axes.get_xlabel() or kind == "energy"


@pytest.mark.parametrize("kind", SEVERAL)
def test_several_panels_are_a_figure(kind):
    figure = ss.plot(datasets()[kind], **SEVERAL[kind])
    assert isinstance(figure, Figure)
    assert all(axes.has_data() for axes in figure.axes if axes.axison)
    own = Figure()
    assert ss.plot(datasets()[kind], figure=own, **SEVERAL[kind]) is own
    assert len(own.axes) == len(figure.axes)


def test_the_number_of_parameters_chooses_loci_or_a_map():
    assert ss.plot(datasets()["sweep"]).axes[0].get_ylabel() == "growth rate, 1/s"
    assert ss.plot(datasets()["map"]).axes[0].get_ylabel() == "friction 0"


def test_outputs_with_the_names_of_other_kinds_are_those_of_a_study():
    outputs = ["amplitude", "frequency", "sequence", "period", "stability"]
    results = ss.Study(SCENE, {"friction": [1.4, 1.5]}, outputs=outputs, duration=0.3).run()
    axes = Figure().add_subplot()
    assert ss.plot(results, "period", ax=axes).get_xlabel() == "period, s"
    assert isinstance(ss.plot(results), Figure)


def test_a_dataset_that_was_saved_is_drawn_as_before(tmp_path):
    for kind in ("sweep", "lines", "study"):
        ss.save(datasets()[kind], tmp_path / f"{kind}.nc")
        again, before = (ss.plot(data) for data in (ss.load(tmp_path / f"{kind}.nc"), datasets()[kind]))
        panels = [drawn.axes if isinstance(drawn, Figure) else [drawn] for drawn in (again, before)]
        for first, second in zip(*panels, strict=True):
            assert isinstance(first, Axes)
            for one, other in zip(first.lines, second.lines, strict=True):
                assert np.array_equal(one.get_xydata(), other.get_xydata(), equal_nan=True)


@pytest.mark.parametrize(
    ("kind", "what", "options", "message"),
    [
        ("sweep", "friction", {}, "what: a sweep has one picture, got 'friction'"),
        ("sweep", None, {"bins": 3}, "plot: a sweep: got an unexpected keyword argument 'bins'"),
        ("map", None, {"slow": True}, "plot: a sweep: got an unexpected keyword argument 'slow'"),
        ("modal", None, {}, "plot: energies of modes: missing a required argument: 'combination'"),
        ("energy", "heat", {}, r"what: expected one of \['stored', 'rate', 'powers'\], got 'heat'"),
        ("lines", "x9", {}, "dof: unknown dof 'x9'"),
        ("diagram", "x9", {}, "dof: unknown dof 'x9'"),
    ],
)
def test_what_does_not_fit_is_refused(kind, what, options, message):
    with pytest.raises(ss.InputError, match=message):
        ss.plot(datasets()[kind], what, **options)


def test_a_dataset_without_a_picture_is_refused():
    with pytest.raises(ss.InputError, match=r"data: expected the dataset of results of .*, got <xarray"):
        ss.plot(ss.complex_modes(SCENE).to_dataset())
