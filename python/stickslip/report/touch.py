"""The part of a report to touch: a parameter to move over motions computed beforehand."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from typing import Any

import numpy as np
from markupsafe import Markup

from stickslip.explorer.maps import hopf_points, loci
from stickslip.explorer.picture import json_text, picture
from stickslip.explorer.wanted import Explored, Wanted
from stickslip.faults import InputError
from stickslip.files.case import Case
from stickslip.report.findings import Findings
from stickslip.scene.parameters.family import Model
from stickslip.show.html import note, section, template

#: Values of the parameter whose motions the page holds, values of its loci.
VALUES, LOCI = 31, 121
#: Events of one motion, and of the search for what it settles to, times the number of dofs; fewest events.
EVENTS, FEWEST = 40_000, 1000
#: Wall-clock limit of all motions together, s, and of one: last resorts, since the events limit the work.
ALL, EACH = 90.0, 5.0
#: Dofs beyond which no motions are computed beforehand.
LARGE = 48
#: What a motion of another value leaves out: only that of the scene itself is shown from its start on.
LEFT_OUT = ("way", "state")

HEADING = "Move it"


def touch_section(found: Findings, model: Model, told: Callable[[str], None] = lambda _: None) -> Markup:
    """Return the parameter's slider with what follows it, or why there is none."""
    reason = _refused(found)
    if reason:
        return section("move", HEADING, note(reason))
    told("computing motions to move through")
    run = {} if found.run is None else {"duration": found.run.duration}
    cases = [Case(one, _start(found), run) for one in (found.scene, model)]
    several = [Explored(case, found.known, found.title) for case in cases]
    explored = next((one for one in several if found.parameter in {**one.knobs, **one.joint}), None)
    if explored is None:
        reason = f"{found.parameter} is not one number of the model; stickslip explore moves its parts."
        return section("move", HEADING, note(reason))
    try:
        data = _data(found, explored)
    except InputError as error:
        return section("move", HEADING, note(f"No motions over {found.parameter}: {error}."))
    folder = files("stickslip.explorer").joinpath("page")
    scripts = [folder.joinpath(name).read_text(encoding="utf-8") for name in ("plots.js", "panels.js")]
    scripts.append(files("stickslip.report").joinpath("touch.js").read_text(encoding="utf-8"))
    # In a script element "</script" ends it, and "<!--<script>" keeps it from ending.
    text = json_text(data).replace("<", "\\u003c")
    return section(
        "move",
        HEADING,
        Markup(
            template("report/touch.html").render(
                name=found.parameter.replace("_", " "),
                count=len(data["pictures"]),
                first=data["first"],
                data=Markup(text),
                script=Markup("\n".join(scripts)),
            )
        ),
    )


def _refused(found: Findings) -> str:
    if found.run is None or found.loci is None:
        return "There is no motion over a parameter to move through."
    if found.parameter == "friction_factor":
        return "The contacts differ in friction; stickslip explore moves each of them."
    if found.scene.size > LARGE:
        return f"Left out for more than {LARGE} dofs; stickslip explore computes on release."
    return ""


def _start(found: Findings) -> dict[str, Any]:
    """Return what the start of the report's motion adds to steady sliding."""
    start, rest = found.start, found.equilibrium
    if start is None or rest is None:
        return {}
    if start.combination != rest.combination:
        return {"position": start.position, "velocity": start.velocity, "combination": start.combination}
    return {"position": start.position - rest.position, "velocity": start.velocity - rest.velocity}


def _data(found: Findings, explored: Explored) -> dict[str, Any]:
    assert found.loci is not None
    name = found.parameter
    low, high = float(found.loci[name].min()), float(found.loci[name].max())
    singles = explored.joint.get(name, [name])
    standing = explored.knobs[singles[0]].value if singles[0] in explored.knobs else None
    grid = np.linspace(low, high, VALUES).tolist()
    if standing is not None and low <= standing <= high:
        grid = sorted({*grid, standing})
    dof = found.moving[0] if found.moving else 0
    wanted = partial(_wanted, explored, singles, dof)
    first = grid.index(standing) if standing in grid else len(grid) // 2
    begun = time.perf_counter()
    pictures: list[dict[str, Any]] = [{} for _ in grid]
    # From the scene itself outwards: what the time does not suffice for is far from it.
    for k in sorted(range(len(grid)), key=lambda k: abs(k - first)):
        if time.perf_counter() - begun > ALL:
            sentence = f"This value was not computed: the time limit of all motions, {ALL:g} s, was reached."
            pictures[k] = {"sentence": sentence}
            continue
        pictures[k] = picture(wanted(grid[k]), max(EVENTS // found.scene.size, FEWEST))
        if k != first:
            pictures[k] = {key: value for key, value in pictures[k].items() if key not in LEFT_OUT}
    branches = loci(Wanted(explored, {"values": {}, "x": [name, low, high], "count": LOCI}))
    unit = found.loci[name].attrs.get("units", "1")
    return {
        "scene": explored.told,
        "loci": {**branches, "hopf": hopf_points(found.critical), "count": LOCI},
        "values": grid,
        "unit": "" if unit == "1" else unit,
        "first": first,
        "dof": dof,
        "pictures": pictures,
    }


def _wanted(explored: Explored, singles: list[str], dof: int, value: float) -> Wanted:
    message = {
        "values": dict.fromkeys(singles, value),
        "dof": dof,
        "patience": EACH,
        "start": {"kind": "file"},
    }
    return Wanted(explored, message)
