"""What notebooks show of scenes, modes, motions, cycles and balances: the tables of their `repr` as HTML."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.scene.checks import Real
from stickslip.scene.contact import described_direction
from stickslip.show.html import facts, table
from stickslip.scene.scene import described_damping, shortened

if TYPE_CHECKING:
    from stickslip.cycles.cycle import Cycle
    from stickslip.motion.energy import Balance
    from stickslip.modes.modes import Modes
    from stickslip.scene.scene import Scene
    from stickslip.transient.trajectory import Events, Trajectory

#: Events shown of a run.
SHOWN = 12


def scene_html(scene: Scene) -> str:
    """Return the size of a scene and a table of its contacts."""
    rows = [
        (
            str(label),
            described_direction(contact.tangential, scene.dofs),
            described_direction(contact.normal, scene.dofs),
            float(contact.friction),
            float(contact.friction if contact.static_friction is None else contact.static_friction),
            float(contact.slider_speed),
            float(contact.restitution),
            float(contact.gap),
        )
        for label, contact in zip(scene.contact_labels(), scene.contacts, strict=True)
    ]
    headings = (
        "contact",
        "tangential",
        "normal",
        "friction",
        "static friction",
        "slider speed, m/s",
        "restitution",
        "gap, m",
    )
    mass = "lumped" if scene.mass.ndim == 1 else "coupled"
    listed = facts(
        [
            ("dofs", f"{scene.size}: {', '.join(shortened(scene.dofs))}"),
            ("mass", f"{mass}, {_range(scene.mass if scene.mass.ndim == 1 else np.diag(scene.mass))} kg"),
            ("damping", described_damping(scene.damping)),
        ]
    )
    return listed + table("Contacts of the scene", headings, rows)


def modes_html(modes: Modes) -> str:
    """Return a table of frequencies, damping ratios and growth rates."""
    upper = np.flatnonzero(modes.eigenvalues.imag >= 0.0)
    rows = [
        (
            str(k),
            f"{modes.frequencies[k]:.4f}",
            float(modes.damping_ratios[k]) + 0.0,
            float(modes.eigenvalues[k].real) + 0.0,
            modes.remark(int(k)),
        )
        for k in upper
    ]
    headings = ("mode", "frequency, Hz", "damping ratio", "real part, 1/s", "")
    kinds = ["unstable" if modes.unstable[k] and not modes.marginal[k] else "" for k in upper]
    return table(f"Modes of {modes.combination}", headings, rows, row_kinds=kinds)


def events_html(events: Events) -> str:
    """Return a table of the first events."""
    rows = [
        (f"{t:.12f}", int(contact), str(kind), str(combination))
        for t, contact, kind, combination in zip(
            events.time[:SHOWN], events.contact, events.kind, events.combination, strict=False
        )
    ]
    caption = f"{len(events)} events" + (f", the first {SHOWN}" if len(events) > SHOWN else "")
    return table(caption, ("time, s", "contact", "kind", "combination after"), rows)


def trajectory_html(run: Trajectory) -> str:
    """Return how long each combination held, and the first events."""
    held = run.time_by_combination()
    rows = [(name, time, 100.0 * time / (run.duration or 1.0)) for name, time in held.items()]
    listed = facts(
        [
            ("motion", f"0 to {run.duration:g} s, stopped by {run.stop_reason}"),
            ("events", str(len(run.events))),
            ("grazings", str(len(run.grazings))),
        ]
    )
    shares = table("Time by status combination", ("combination", "time, s", "share, %"), rows)
    return listed + shares + events_html(run.events)


def cycle_html(cycle: Cycle) -> str:
    """Return period, stability and a table of the phases."""
    listed = facts(
        [
            ("period", f"{1e3 * cycle.period:.9g} ms"),
            ("frequency", f"{cycle.frequency:.6g} Hz"),
            ("stability", cycle.stability),
            (
                "largest multiplier",
                "not known" if np.isnan(cycle.largest_multiplier) else f"{cycle.largest_multiplier:.4g}",
            ),
        ]
    )
    rows = [
        (phase.combination, 1e3 * phase.start, 1e3 * phase.duration)
        for phase in cycle.phases
        if phase.duration > 0.0
    ]
    return listed + table("Phases of one period", ("combination", "start, ms", "duration, ms"), rows)


def balance_html(balance: Balance) -> str:
    """Return a table of the works."""
    caption = f"Energy from {balance.start:g} s to {balance.end:g} s"
    return table(caption, ("", "work, J"), [(name, value) for name, value, _ in balance.rows()])


def _range(values: Real) -> str:
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
