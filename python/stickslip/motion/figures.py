"""Figures of motions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip.scene.checks import Real
from stickslip.scene.contact import dof_index
from stickslip.cycles.cycle import Cycle
from stickslip.transient.trajectory import Trajectory

#: One colour per status, the same in every figure.
COLOURS = {"+": "#4477aa", "-": "#aa3377", "s": "#cc3311", "d": "#ddaa33"}
NAMES = {"+": "positive sliding", "-": "negative sliding", "s": "sticking", "d": "detached"}
#: Samples of one period.
PERIOD = 4097
#: Samples of a history: some thirty per period of the fastest visible line.
HISTORY = 6001
#: Points per inch that journals ask for at least.
DPI = 300


def history(run: Trajectory, dofs: Sequence[str] | None = None) -> Figure:
    """Return displacements over time, relative to the start.

    Parameters
    ----------
    run
        The motion.
    dofs
        Names of dofs; None: the four that move most.

    Raises
    ------
    InputError
        If a dof is unknown.
    """
    motion = run.sample(np.linspace(0.0, run.duration, HISTORY))
    if dofs is None:
        extent = np.ptp(motion.position.to_numpy(), axis=0)
        dofs = [run.scene.dofs[k] for k in sorted(np.argsort(-extent, kind="stable")[:4])]
    for dof in dofs:
        dof_index("dofs", dof, run.scene.dofs)
    figure = Figure(figsize=(9.0, 1.7 * len(dofs)), layout="constrained")
    panels = figure.subplots(len(dofs), 1, sharex=True, squeeze=False)[:, 0]
    for axes, dof in zip(panels, dofs, strict=True):
        displacement = motion.position.sel(dof=dof)
        axes.plot(motion.time, 1e6 * (displacement - displacement[0]), color=COLOURS["+"], linewidth=0.7)
        axes.set_ylabel(f"{dof}, µm")
    panels[-1].set_xlabel("time, s")
    figure.suptitle("Displacement from steady sliding")
    return figure


def phase_plane(run: Trajectory) -> Figure:
    """Return slip motion of every contact in its phase plane, from the start on (the paper's Fig. 6)."""
    return _phase_planes(run, 4 * HISTORY, "Phase plane of the contact masses")


def limit_cycle(cycle: Cycle) -> Figure:
    """Return the slip motion of every contact over one period of the limit cycle."""
    sequence = " → ".join(cycle.combinations)
    title = f"Limit cycle, period {1e3 * cycle.period:.4f} ms: {sequence}"
    return _phase_planes(cycle.run, PERIOD, title)


def contact_status(run: Trajectory) -> Figure:
    """Return the status of every contact over time (the paper's Fig. 7)."""
    contacts = run.scene.contact_labels()
    figure = Figure(figsize=(9.0, 1.2 + 0.7 * len(contacts)), layout="constrained")
    axes = figure.subplots()
    present = {run.start.combination, *run.events.combination}
    for contact in range(len(contacts)):
        for status, spans in status_spans(run, contact).items():
            axes.broken_barh(spans, (contact - 0.4, 0.8), facecolors=COLOURS[status])
    axes.set(xlabel="time, s", xlim=(0.0, run.duration), yticks=range(len(contacts)))
    axes.set_yticklabels([f"contact {label}" for label in contacts])
    axes.invert_yaxis()
    _status_legend(axes, "".join(sorted(set("".join(present)))))
    return figure


def status_spans(run: Trajectory, contact: int) -> dict[str, list[tuple[float, float]]]:
    """Return the stretches of every status of a contact that occurs, as (begin, width), s."""
    letters = [run.start.combination[contact], *(found[contact] for found in run.events.combination)]
    begins = np.concatenate([[0.0], run.events.time])
    changes = [0, *(k for k in range(1, len(letters)) if letters[k] != letters[k - 1])]
    ends = np.append(begins[changes[1:]], run.duration)
    spans: dict[str, list[tuple[float, float]]] = {status: [] for status in COLOURS}
    for k, end in zip(changes, ends, strict=True):
        if end > begins[k]:
            spans[letters[k]].append((float(begins[k]), float(end - begins[k])))
    return {status: found for status, found in spans.items() if found}


def instants(run: Trajectory, samples: int) -> Real:
    """Return equidistant times, and the instants just before and after every event, s.

    A curve through them shows each status from its first to its last instant.
    """
    events = run.events.time
    return np.unique(
        np.concatenate([np.linspace(0.0, run.duration, samples), events, np.nextafter(events, 0.0)])
    )


def save(figure: Figure, path: str | Path, dpi: int = DPI) -> None:
    """Write a figure in the form that the suffix of the path names; the same figure gives the same bytes.

    Parameters
    ----------
    figure
        The figure.
    path
        The file.
    dpi
        Points per inch of a `.png`, and of what is drawn as points in other forms.
    """
    import matplotlib

    # What would tell when and by which version a file was made.
    metadata = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    with matplotlib.rc_context({"svg.hashsalt": "stickslip", "pdf.fonttype": 42}):
        figure.savefig(path, dpi=dpi, metadata=metadata.get(Path(path).suffix))


def _phase_planes(run: Trajectory, samples: int, title: str) -> Figure:
    motion = run.sample(instants(run, samples))
    scene = run.scene
    labels = scene.contact_labels()
    figure = Figure(figsize=(4.8 * len(labels), 4.4), layout="constrained")
    panels = figure.subplots(1, len(labels), squeeze=False)[0]
    for index, (axes, contact, label) in enumerate(zip(panels, scene.contacts, labels, strict=True)):
        direction = scene.tangential_direction(index)
        displacement = 1e6 * motion.position.to_numpy() @ direction
        velocity = motion.velocity.to_numpy() @ direction
        status = motion.status.to_numpy()[:, index]
        for letter, colour in COLOURS.items():
            shown = np.where(status == letter, displacement, np.nan)
            axes.plot(shown, velocity, color=colour, linewidth=1.2)
        axes.axhline(contact.slider_speed, color="black", linewidth=0.6, linestyle="--", zorder=1)
        axes.set(xlabel="tangential displacement, µm", title=f"contact {label}")
    panels[0].set_ylabel("tangential velocity, m/s (dashed: slider)")
    _status_legend(panels[-1], "".join(np.unique(motion.status)))
    figure.suptitle(title)
    return figure


def _status_legend(axes: Axes, present: str) -> None:
    for status in present:
        axes.plot([], [], color=COLOURS[status], linewidth=4, label=f"{status}  {NAMES[status]}")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
