"""The page as a whole: what is in it, in which order, and what it says first."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from stickslip.faults import InputError
from stickslip.report.findings import Findings, findings
from stickslip.report.motion import cycle_section, energy_section, spectrum_section, transient_section
from stickslip.report.steady import (
    boundary_section,
    equilibrium_section,
    loci_section,
    modes_section,
    scene_section,
)
from stickslip.report.touch import HEADING, touch_section
from stickslip.scene.checks import file_path
from stickslip.scene.known import Known
from stickslip.scene.parameters.family import Model
from stickslip.scene.scene import Scene, checked
from stickslip.scene.state import State
from stickslip.show.html import details, facts, number, section, template
from stickslip.show.replaced_file import replace_file
from stickslip.show.units import ENERGIES, TIMES, measured

#: Letters of a scene file up to which the page holds a copy.
COPIED = 200_000
CONTENTS = {
    "scene": "Scene",
    "equilibrium": "Steady sliding",
    "modes": "Modes",
    "loci": "Stability over a parameter",
    "boundary": "Stability over two parameters",
    "move": HEADING,
    "transient": "Transient",
    "cycle": "Limit cycle",
    "spectrum": "Spectrum",
    "energy": "Energy",
    "computation": "How it was computed",
}


def write_report(
    scene: Scene,
    path: str | Path,
    *,
    title: str | None = None,
    start: State | None = None,
    settings: Mapping[str, Any] | None = None,
    model: Model | None = None,
    parameters: Mapping[str, Any] | None = None,
    band: Sequence[float] | None = None,
    known: Known = Known(),  # noqa: B008
    origin: Mapping[str, str] | None = None,
    source: str | None = None,
    told: Callable[[str], None] = lambda _: None,
) -> Findings:
    """Write everything about a scene as one HTML page that needs no network.

    The page holds the scene, steady sliding, complex modes in motion, eigenvalues over a parameter, the
    curves over two on which stability ends if you name two, the transient, the limit cycle, its spectrum and
    its energy, and a section of your own (`known`). If a result cannot be computed, the page says why in its
    place.

    Parameters
    ----------
    scene
        The scene.
    path
        The file, replaced if it exists.
    title
        Name of the scene on the page; None: the name of the file.
    start
        State in which the motion starts; None: steady sliding with its leading mode set in motion.
    settings
        Arguments of `simulate`. Without a duration the motion lasts as long as the leading mode takes to grow
        (or decay) by e^30, but 20 to 400 of its periods.
    model, parameters
        The model to which the scene belongs (None: the scene itself), and one of its parameters with the
        values over which eigenvalues are followed; None: friction. Of two parameters with values: the curves
        between the smallest and the largest on which stability ends (`stability_boundary`), besides
        eigenvalues over friction.
    band
        Lowest and highest frequency, Hz, of the modes that the page shows and judges, as for `complex_modes`;
        None: all. A large scene needs one.
    known
        Facts about the scene beyond its numbers: a start, places of its masses, a section of your own.
    origin
        Entries by which the page says where it comes from: names and texts, such as a date and a command.
    source
        The text of the scene file, which the page holds folded; None: the page has none.
    told
        Function that is called with the name of each step as it begins.

    Returns
    -------
    Findings
        The results that the page shows.

    Raises
    ------
    InputError
        If a setting is ill-posed, the start does not fit the scene, or the folder does not exist.
    OSError
        If the file cannot be written.
    """
    checked(scene)
    file = file_path(path)
    if not file.parent.is_dir():
        raise InputError(f"path: no such folder: {file.parent}")
    begun = time.perf_counter()
    found = findings(
        scene,
        file.stem if title is None else title,
        start=start,
        settings=settings,
        model=model,
        parameters=parameters,
        band=band,
        known=known,
        told=told,
    )
    told("drawing the page")
    replace_file(file, page(found, begun, origin, source, model, told).encode())
    return found


def page(
    found: Findings,
    begun: float | None = None,
    origin: Mapping[str, str] | None = None,
    source: str | None = None,
    model: Model | None = None,
    told: Callable[[str], None] = lambda _: None,
) -> str:
    """Return the page; it says how long the work took if that has `begun` (`time.perf_counter`)."""
    sections: dict[str, str] = {
        "scene": scene_section(found),
        "equilibrium": equilibrium_section(found),
        "modes": modes_section(found),
        "loci": loci_section(found),
        **(
            {"boundary": boundary_section(found)}
            if found.boundary is not None or "boundary" in found.reasons
            else {}
        ),
        "move": touch_section(found, found.scene if model is None else model, told),
        "transient": transient_section(found),
        "cycle": cycle_section(found),
        "spectrum": spectrum_section(found),
        "energy": energy_section(found),
    }
    headings = dict(CONTENTS)
    if found.known.section is not None:
        name, heading, made = found.known.section
        headings[name], sections[name] = heading, made()
    sections["computation"] = _computation(found, begun, origin or {}, source)
    folder = files("stickslip.report")
    style, script = (folder.joinpath(name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    return template("report/page.html").render(
        title=found.title,
        verdict=verdict(found),
        contents={name: headings[name] for name in sections},
        sections=sections.values(),
        style=Markup(style),
        script=Markup(script),
    )


def verdict(found: Findings) -> str:
    """Return the answer of the report in two or three sentences."""
    if found.equilibrium is None:
        first = f"There is no steady sliding: {found.reasons['equilibrium']}."
    else:
        modes = found.modes
        unstable = np.flatnonzero(modes.unstable)
        if unstable.size:
            shown = ", ".join(
                f"{number(modes.frequencies[k], 5)} Hz growing at {number(modes.eigenvalues[k].real, 4)} 1/s"
                for k in unstable[:4]
            )
            more = "" if unstable.size <= 4 else f" and {unstable.size - 4} more"
            count = "one mode grows" if unstable.size == 1 else f"{unstable.size} modes grow"
            first = f"Steady sliding is unstable: {count} ({shown}{more})."
        else:
            largest = float(modes.eigenvalues.real.max())
            kind = "marginal" if modes.marginal.any() else "stable"
            first = f"Steady sliding is {kind}: the largest growth rate is {number(largest, 4)} 1/s."
        if found.band is not None:
            first += f" Only modes from {number(found.band[0])} to {number(found.band[1])} Hz were computed."
    if found.run is None:
        return first
    if found.cycle is not None:
        cycle = found.cycle
        second = (
            f"Disturbed, the motion settles to a limit cycle of period {measured(cycle.period, TIMES)} "
            f"({number(cycle.frequency)} Hz) through {' '.join(cycle.combinations[:16])}"
            f"{' ...' if len(cycle.combinations) > 16 else ''}."
        )
    elif found.settled == "equilibrium":
        second = "Disturbed, the motion comes to rest again."
    else:
        second = f"{found.reasons['cycle']}."
    if found.balance is not None and found.cycle is not None:
        second += (
            f" Per period the sliders bring {measured(found.balance.slider, ENERGIES, 4)}, of which "
            f"{measured(found.balance.friction_heat, ENERGIES, 4)} become friction heat."
        )
    return f"{first} {second}"


def _computation(
    found: Findings, begun: float | None, origin: Mapping[str, str], source: str | None
) -> Markup:
    from stickslip import __version__

    rows = [*origin.items(), ("stickslip", __version__)]
    if found.run is not None:
        rows.append(("touches within rounding", str(len(found.run.grazings))))
    if found.balance is not None and found.balance.turnover > 0.0:
        rows.append(
            ("energy residual over turnover", number(abs(found.balance.residual) / found.balance.turnover, 2))
        )
    rows.append(("largest residual of a mode", number(float(found.modes.residual.max(initial=0.0)), 2)))
    if begun is not None:
        rows.append(("computed in", f"{time.perf_counter() - begun:.1f} s"))
    copy: str = ""
    if source is not None:
        if len(source) <= COPIED:
            copy = details("The scene file", Markup("<pre>{}</pre>").format(source))
        else:
            digest = hashlib.sha256(source.encode()).hexdigest()
            rows.append((f"SHA-256 of the scene file, {len(source.encode())} bytes", digest))
    return section("computation", CONTENTS["computation"], facts(rows), copy)
