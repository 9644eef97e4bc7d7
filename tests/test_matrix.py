"""Every kind of scene through every view: each cell is shown, or is refused by an error that says why."""

import importlib
import pickle
from collections.abc import Callable
from functools import cache
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from click.testing import CliRunner
from scipy import stats

import stickslip as ss
from nightly import nightly
from scene_kinds import KINDS, Kind
from stickslip import types
from stickslip.cli import main
from stickslip.explorer.curves import curves
from stickslip.explorer.picture import picture
from stickslip.explorer.wanted import Explored, MalformedError, Wanted
from stickslip.scene.known import Known
from stickslip.show import svg

kind_of = cache(Kind)


def saved(kind: Kind, folder: Any) -> Any:
    """Return the scene file of a kind, its start and its run in it."""
    path = folder / "scene.toml"
    if not path.exists():
        rest, start = ss.steady_sliding(kind.scene), kind.start
        added = {kind.scene.dofs[0]: float(start.velocity[0] - rest.velocity[0])}
        ss.save(ss.Case(kind.scene, {"velocity": added}, {"duration": kind.duration}), path)
    return path


def verb(*arguments: Any, codes: tuple[int, ...] = (0,)) -> str:
    """Run a verb of the command line; an exit of 2 or 3 is the refusal that it tells."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exit_code in (2, 3) and result.exit_code not in codes:
        raise ss.InputError(result.stderr)
    assert result.exit_code in codes, result.output
    return result.stdout


def back(data: Any, folder: Any) -> None:
    """Write a dataset as a table and as netCDF, and expect from this what was written."""
    ss.save(data, folder / "data.csv")
    ss.save(data, folder / "data.nc")
    assert ss.load(folder / "data.nc").identical(data)


def told(result: Any) -> None:
    assert repr(result)
    assert str(result)
    assert str(result.summary())
    assert "<" in result._repr_html_()


def again(result: Any) -> None:
    assert repr(pickle.loads(pickle.dumps(result))) == repr(result)


def figures_of_run(run: ss.Trajectory) -> None:
    run.plot()
    run.events.plot()
    run.balance().plot()
    run.plot.history()
    run.plot(run.scene.dofs[0], ax=plt.figure().subplots())
    run.plot.spectrum(end=run.duration)
    run.plot.energy()
    run.balance().plot.flow()


def over(kind: Kind, values: int) -> dict[str, Any]:
    """Return the parameter of a kind with some of its values."""
    name, low, high = kind.parameter
    return {name: np.linspace(low, high, values)}


def between(kind: Kind) -> dict[str, Any]:
    """Return the parameter of a kind with its range."""
    name, low, high = kind.parameter
    return {name: (low, high)}


def bounded(kind: Kind, folder: Any) -> None:
    """Find where stability ends over the parameter of a kind and its stiffness; tell, keep and draw it."""
    found = ss.stability_boundary(kind.scene, {**between(kind), "stiffness": (0.9, 1.1)}, cells=4)
    assert found.doubts == ()
    told(found)
    again(found)
    back(found.to_dataset(), folder)
    found.plot()


def plane(kind: Kind) -> list[str]:
    """Return the same two parameters as the command line takes them."""
    name, low, high = kind.parameter
    return ["--over", f"{name}={low}:{high}", "--over", "stiffness=0.9:1.1", "--cells", "4"]


def varied(kind: Kind) -> types.Bifurcation:
    return ss.bifurcation(kind.scene, over(kind, 2), stretch=0.5 * kind.duration, limit=kind.duration)


def studied(kind: Kind) -> Any:
    name, low, high = kind.parameter
    study = ss.Study(kind.scene, {name: stats.uniform(low, high - low)}, outputs=["growth_rate"], samples=2)
    return study.run(progress=False)


#: What the explorer's page asks for.
ASKED = {"values": {}, "dof": 0, "patience": 5.0, "start": {"kind": "mode"}}


def explored(kind: Kind, folder: Any) -> dict[str, Any]:
    case = ss.Case(kind.scene, run={"duration": kind.duration})
    seen = picture(Wanted(Explored(case, Known(), "kind"), ASKED))
    assert seen["sentence"]
    assert seen["error"] is None, seen["error"]
    return seen


def reported(kind: Kind, folder: Any) -> None:
    path = folder / "page.html"
    draw = svg.svg

    def without_layout(figure, name, alternative):
        # Most of the time of a page is the layout of its figures.
        figure.set_layout_engine("none")
        return draw(figure, name, alternative)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(svg, "svg", without_layout)
        ss.write_report(kind.scene, path, start=kind.start, settings={"duration": kind.duration})
    page = path.read_text()
    assert all(f'id="{name}"' in page for name in ("scene", "modes", "transient", "energy"))


def curved(kind: Kind, folder: Any) -> None:
    """Ask for the curves of a kind as the explorer's page does."""
    model, (name, low, high) = Explored(ss.Case(kind.scene), Known(), "kind"), kind.parameter
    # One slider moves all contacts where they have one value.
    name = name if name in {**model.knobs, **model.joint} else f"{name}_0"
    asked = {"values": {}, "x": [name, low, high], "y": ["stiffness", 0.9, 1.1], "cells": 4}
    try:
        seen = curves(Wanted(model, asked))
    except MalformedError as error:
        raise ss.InputError(str(error)) from None
    if seen["error"]:
        raise ss.InputError(seen["error"])
    assert seen["whole"]
    assert "agree at 16 x 16 places" in seen["said"]


def reported_curves(kind: Kind, folder: Any) -> None:
    """Write the page with the curves of a kind, short of motions and without figures."""
    over = {**between(kind), "stiffness": (0.9, 1.1)}
    settings = {"duration": 0.01 * kind.duration, "time_limit": 0.1}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(svg, "svg", lambda figure, name, alternative: name)
        patch.setattr("stickslip.report.touch.LARGE", 0)
        found = ss.write_report(
            kind.scene, folder / "curves.html", start=kind.start, settings=settings, parameters=over
        )
    if found.boundary is None:
        raise ss.InputError(found.reasons["boundary"])
    assert found.boundary.doubts == ()
    assert 'id="boundary"' in (folder / "curves.html").read_text()


def axis(kind: Kind) -> str:
    """Return the parameter of a kind as the command line takes it."""
    name, low, high = kind.parameter
    return f"{name}={low}:{high}:3"


def reported_by_verb(kind: Kind, folder: Any) -> None:
    """Write the page by its verb, without the figures, which `reported` draws."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(svg, "svg", lambda figure, name, alternative: name)
        verb("report", saved(kind, folder), "-o", folder / "verb.html")
    assert (folder / "verb.html").stat().st_size > 20_000


def curve_by_verb(kind: Kind, folder: Any) -> None:
    """Follow a bifurcation over the parameter of a kind and its stiffness; few cycles bifurcate there."""
    arguments = *plane(kind)[:4], "--further", 1, "--step", 0.5, "--points", 2
    verb("curve", saved(kind, folder), *arguments, codes=(0, 1, 3))


def drawn(kind: Kind) -> None:
    kind.cycle.plot()
    for draw in (kind.cycle.plot.phase_planes, kind.cycle.plot.outline, kind.cycle.plot.spectrum):
        draw()


#: Name of a view to what looks at a kind through it.
VIEWS: dict[str, Callable[[Kind, Any], Any]] = {
    "scene told": lambda kind, _: told(kind.scene),
    "scene pickled": lambda kind, _: again(kind.scene),
    "scene drawn": lambda kind, _: kind.scene.plot(),
    "scene file": lambda kind, folder: ss.load(saved(kind, folder)).scene,
    "steady sliding": lambda kind, _: repr(ss.steady_sliding(kind.scene).plot()),
    "contact forces": lambda kind, _: kind.start.contact_forces(kind.scene),
    "disturbed sliding": lambda kind, _: repr(ss.disturbed_sliding(kind.scene)),
    "modes told": lambda kind, _: told(kind.modes),
    "modes pickled": lambda kind, _: again(kind.modes),
    "modes in a file": lambda kind, folder: back(kind.modes.to_dataset(), folder),
    "modes drawn": lambda kind, _: (kind.modes.plot(), kind.modes.plot.structure(0)),
    "mode shapes": lambda kind, _: kind.modes.plot.shapes(),
    "mode power": lambda kind, _: ss.complex_modes(kind.scene).power(),
    "mode selection": lambda kind, _: ss.mode_selection(kind.scene, [1e-4], phases=2),
    "status table": lambda kind, _: told(ss.status_table(kind.scene)),
    "reduction": lambda kind, _: repr(ss.equations_of(kind.scene, kind.start.combination)),
    "sensitivity": lambda kind, _: ss.sensitivity(kind.scene),
    "sweep": lambda kind, _: ss.plot(ss.sweep(kind.scene, over(kind, 5))),
    "critical points": lambda kind, _: ss.critical_points(kind.scene, between(kind)).plot(),
    "stability boundary": bounded,
    "stability": lambda kind, _: ss.stability(kind.scene, over(kind, 2)),
    "factors": lambda kind, _: ss.sweep(kind.scene, {"stiffness": [1.0, 1.1], "mass": [1.0, 1.1]}),
    "coefficients": lambda kind, _: ss.stability(kind.scene, {"damping_stiffness": [1e-5, 2e-5]}),
    "run told": lambda kind, _: told(kind.run),
    "run pickled": lambda kind, _: again(kind.run),
    "run in a file": lambda kind, folder: back(kind.run.to_dataset(20), folder),
    "run drawn": lambda kind, _: figures_of_run(kind.run),
    "phase plane": lambda kind, _: kind.run.plot.phase_planes(),
    "contact status": lambda kind, _: kind.run.plot.statuses(ax=plt.figure().subplots()),
    "events told": lambda kind, _: told(kind.run.events),
    "events in a file": lambda kind, folder: back(kind.run.events.to_dataset(), folder),
    "energy": lambda kind, _: kind.run.energy(np.linspace(0.0, kind.run.duration, 5)),
    "balance told": lambda kind, _: told(kind.run.balance()),
    "balance in a file": lambda kind, folder: back(kind.run.balance().to_dataset(), folder),
    "spectrum": lambda kind, _: kind.run.spectrum(kind.scene.dofs[0], begin=0.0, samples=64),
    "modal coordinates": lambda kind, _: kind.run.modal_coordinates([0.0, kind.run.duration]),
    "modal energy": lambda kind, _: ss.modal_energy(kind.run, [0.0, kind.run.duration]),
    "cycle told": lambda kind, _: told(kind.cycle),
    "cycle pickled": lambda kind, _: again(kind.cycle),
    "cycle in a file": lambda kind, folder: back(kind.cycle.to_dataset(20), folder),
    "cycle drawn": lambda kind, _: drawn(kind),
    "harmonics": lambda kind, folder: back(kind.cycle.harmonics(), folder),
    "bifurcation": lambda kind, _: varied(kind).plot(),
    "study": lambda kind, _: studied(kind),
    "many runs": lambda kind, _: list(ss.simulate_many([kind.scene] * 2, duration=0.01)),
    "explorer": explored,
    "curves in the explorer": curved,
    "report": reported,
    "curves in the report": reported_curves,
    "modes verb": lambda kind, folder: verb("modes", saved(kind, folder)),
    "simulate verb": lambda kind, folder: verb("simulate", saved(kind, folder)),
    "sweep verb": lambda kind, folder: verb("sweep", saved(kind, folder), "--over", axis(kind)),
    "boundary verb": lambda kind, folder: verb("boundary", saved(kind, folder), *plane(kind)),
    "cycle verb": lambda kind, folder: verb("cycle", saved(kind, folder), "--further", 1, codes=(0, 1, 3)),
    "curve verb": curve_by_verb,
    "report verb": reported_by_verb,
}

CYCLE = ("cycle told", "cycle pickled", "cycle in a file", "cycle drawn", "harmonics")
VARIED = ("sweep", "critical points", "stability", "bifurcation", "study", "sweep verb")
VARIED += ("stability boundary", "boundary verb", "curves in the report")
STATES = ("bristles", "bristles that open", "own state")
GROWING = ("Stribeck", "plane", "table", "formula", *STATES, "two subsystems", "chain", "elastic stop")
RECURRING = (
    *(
        "lumped belt",
        "Stribeck",
        "plane",
        "table",
        "formula",
        *STATES,
        "harmonic load",
        "vibrating slider",
    ),
    *("two subsystems", "cubic spring", "elastic stop", "plane that opens", "compliant by Hertz"),
)
#: Views, kinds, and what the refusal says of them.
REFUSALS = [
    (
        CYCLE,
        set(KINDS) - set(RECURRING),
        "the motion (settles to an equilibrium|does not recur|was followed)",
    ),
    (
        ("mode selection",),
        set(KINDS) - set(GROWING),
        "scene: steady sliding has no oscillating unstable mode",
    ),
    (
        ("mode power", "modal energy"),
        (
            *("massless", "compliant", "compliant both ways", "rate and state on a spring"),
            *("compliant by a law", "compliant by Hertz", "springs beside a Jenkins element"),
        ),
        "scene: energies of modes and harmonics need mass on every dof|modal_energy: friction depends on",
    ),
    (
        ("modal energy",),
        ("Stribeck", "plane", "table", "formula", *STATES, "elastic stop"),
        "modal_energy: friction depends on slip speed",
    ),
    (
        ("modal energy",),
        ("cubic spring",),
        "scene: energies of modes and harmonics need a linear structure",
    ),
    (
        ("mode selection",),
        ("elastic stop",),
        "scene: energies of modes and harmonics need a linear structure",
    ),
    (
        ("sensitivity",),
        ("Stribeck", "plane", "formula", *STATES, "rate and state on a spring", "elastic stop"),
        "friction: a number would replace the law of contact belt",
    ),
    (("sensitivity",), ("table",), "friction: .* a table has no numbers to vary"),
    (("status table",), ("rigid pad",), "combination .*: the directions of its closed contacts depend"),
    (VARIED, ("no contact",), "no contact of the scene takes 'friction'|friction: the model has no such"),
    (("curve verb",), ("no contact",), "friction: has no one value to start from"),
    (("curves in the explorer",), ("no contact",), "x: unknown name"),
    (("phase plane",), ("no contact",), "motion: a scene without contacts has no phase plane"),
]
#: View and kind to what the refusal says.
REFUSED = {(kind, view): said for views, kinds, said in REFUSALS for view in views for kind in kinds}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return {name: tmp_path_factory.mktemp("kind") for name in KINDS}


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Let reports be short: few values of a parameter, few motions to move through."""
    for module, name, count in (
        ("touch", "VALUES", 2),
        ("touch", "LOCI", 5),
        ("findings", "VALUES", 21),
        ("findings", "CELLS", 4),
    ):
        monkeypatch.setattr(importlib.import_module(f"stickslip.report.{module}"), name, count)
    yield
    plt.close("all")


CELLS = [(kind, view) for kind in KINDS for view in VIEWS]
#: Views that take seconds, and the kinds that are seen through them always; all others are every night.
LONG = ("curve verb", "report verb", "report", "curves in the report", "stability boundary")
ALWAYS = ("Stribeck", "massless", "own state", "harmonic load", "plane that opens", "two subsystems")


def runs_every_night(cell: tuple[str, str]) -> bool:
    kind, view = cell
    return view in LONG and kind not in ALWAYS and cell not in REFUSED


@pytest.mark.parametrize("cell", nightly(CELLS, runs_every_night), ids="-".join)
def test_every_kind_is_seen_through_every_view(cell, folders):
    kind, view = cell
    seen = kind_of(kind)
    if (said := REFUSED.get(cell)) is None:
        VIEWS[view](seen, folders[kind])
        return
    with pytest.raises(ss.StickslipError, match=said):
        VIEWS[view](seen, folders[kind])


def test_the_cells_are_counted():
    assert set(CELLS) > set(REFUSED)
    assert (len(CELLS), len(REFUSED)) == (2016, 177)
