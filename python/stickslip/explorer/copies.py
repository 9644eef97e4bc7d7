"""What a page hands on of a point: the scene as TOML and as Python, a figure, a sound."""

from __future__ import annotations

import io
from functools import partial
from typing import Any

from stickslip.cycles.attractors import shown_duration
from stickslip.explorer.sound import sound
from stickslip.explorer.wanted import PATIENCE, SECONDS, Wanted
from stickslip.faults import InputError
from stickslip.files.case import HEADER, Case, case_text
from stickslip.scene import models
from stickslip.scene.scene import Scene
from stickslip.show.style import save
from stickslip.transient.simulate import simulate
from stickslip.transient.trajectory import Trajectory


def texts(wanted: Wanted) -> dict[str, str]:
    """Return the point as a scene file, and as Python that computes its limit cycle."""
    scene = wanted.scene()
    zero, modes, _ = wanted.steady(scene)
    start = wanted.start(scene, zero, modes)[0]
    case = wanted.explored.case
    moved = case.replace(**wanted.changed) if wanted.changed else case
    added = {"position": start.position - zero.position, "velocity": start.velocity - zero.velocity}
    amounts = {
        name: {scene.dofs[k]: float(vector[k]) for k in range(scene.size) if vector[k]}
        for name, vector in added.items()
    }
    told: dict[str, Any] = {name: amount for name, amount in amounts.items() if amount}
    if start.combination != zero.combination or "s" in zero.combination:
        told = {"position": start.position, "velocity": start.velocity, "combination": start.combination}
    run = {"duration": _duration(wanted, scene), **case.run}
    return {"toml": _toml(moved, told, run, scene), "python": _python(wanted, told, run)}


def _toml(moved: Case, start: dict[str, Any], run: dict[str, Any], scene: Scene) -> str:
    try:
        return case_text(Case(moved.model, start, run), HEADER)
    except InputError:
        # A function of your own has no name in a file; its scene has matrices.
        return case_text(Case(scene, start, run), HEADER)


def _python(wanted: Wanted, start: dict[str, Any], run: dict[str, Any]) -> str:
    model = (
        wanted.explored.family.replaced(wanted.changed) if wanted.changed else wanted.explored.family.given
    )
    function = model.func if isinstance(model, partial) else model
    named = next((name for name, one in models.MODELS.items() if one is function and name != "chain"), None)
    lines = ["import stickslip as ss", ""]
    if named:
        given = model.keywords if isinstance(model, partial) else {}
        arguments = ", ".join(f"{name}={_plain(value)!r}" for name, value in given.items())
        lines.append(f"scene = ss.models.{named}({arguments})")
    else:
        changes = ", ".join(f"{name}={value!r}" for name, value in wanted.changed.items())
        lines.append('case = ss.load("scene.toml")  # the file that this page was started with')
        lines.append(f"scene = case.replace({changes}).scene" if changes else "scene = case.scene")
    lines += ["start = ss.steady_sliding(scene)"]
    if "combination" in start:
        parts = ", ".join(repr(_plain(start[name])) for name in ("position", "velocity", "combination"))
        lines[-1] = f"start = ss.State({parts}, scene.dofs)"
    elif start:
        lines[-1] += f".perturbed({', '.join(f'{name}={value!r}' for name, value in start.items())})"
    duration, *others = (value if name == "duration" else f"{name}={value!r}" for name, value in run.items())
    settings = ", ".join([repr(duration), "start", *map(str, others)])
    lines += [f"run = ss.simulate(scene, {settings})", "cycle = run.limit_cycle()", "print(cycle)"]
    return "\n".join(lines) + "\n"


def _plain(value: Any) -> Any:
    listed = getattr(value, "tolist", lambda: value)()
    return [_plain(one) for one in listed] if isinstance(listed, list | tuple) else listed


def drawn(wanted: Wanted) -> bytes:
    """Return a figure of the limit cycle, or of the motion where there is none, as PDF."""
    run = _run(wanted, _duration(wanted, wanted.scene()))
    try:
        figure = run.limit_cycle(time_limit=PATIENCE[1]).plot.phase_planes()
    except RuntimeError:
        figure = run.plot.history()
    stream = io.BytesIO()
    save(figure, stream, form="pdf")
    return stream.getvalue()


def heard(wanted: Wanted) -> bytes:
    """Return the motion of a contact from its start on as a WAV file."""
    return sound(_run(wanted, wanted.number("seconds", SECONDS)), wanted.contact())


def _run(wanted: Wanted, duration: float) -> Trajectory:
    scene = wanted.scene()
    equilibrium, modes, _ = wanted.steady(scene)
    start, _ = wanted.start(scene, equilibrium, modes)
    return simulate(scene, duration, start, time_limit=PATIENCE[1])


def _duration(wanted: Wanted, scene: Scene) -> float:
    given = wanted.explored.case.run.get("duration")
    return float(given) if given is not None else shown_duration(wanted.steady(scene)[1])
