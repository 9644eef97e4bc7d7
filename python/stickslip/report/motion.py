"""The part of a report about motion: transient, limit cycle, spectrum, energy."""

from __future__ import annotations

from collections import Counter

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from stickslip.motion.energy import STATUSES
from stickslip.motion.events import LOAD
from stickslip.motion.figures import SAMPLES, spectrum
from stickslip.motion.motion import Motion
from stickslip.report.findings import AT_REST, BIG, Findings
from stickslip.show import svg as drawing
from stickslip.show.html import details, facts, figure, note, number, paragraph, section, table
from stickslip.show.style import NAMES
from stickslip.show.units import ENERGIES, LENGTHS, TIMES, measured, suited

#: Events and lines of tables, contacts of phase portraits.
EVENTS, LINES, PORTRAITS = 24, 12, 4
#: Fewest instants at which a motion is drawn, and displacements that are computed for one figure: each
#: instant costs as much as there are dofs.
COARSE, DISPLACEMENTS = 1201, 240_000
#: Contacts whose status is drawn, and roundings of the turnover up to which a work is zero.
STATUSES_SHOWN, ROUNDINGS = 12, 64


def transient_section(found: Findings) -> Markup:
    """Return the motion from its disturbed start."""
    run = found.run
    if run is None:
        return section("transient", "Transient", note(found.reasons["run"], "warning"))
    scene = found.scene
    kinds = Counter(run.events.kind.tolist())
    parts = [
        *(note(found.reasons[key], "warning") for key in ("stopped", "cut") if key in found.reasons),
        facts(
            [
                ("computed", f"{number(run.duration)} s"),
                (
                    "events",
                    f"{len(run.events)}"
                    + (f" ({', '.join(f'{n} {k}' for k, n in kinds.items())})" if kinds else ""),
                ),
                ("first event", f"{number(run.events.time[0])} s" if len(run.events) else "none"),
                ("touches within rounding", str(len(run.grazings))),
            ]
        ),
    ]
    if run.duration > 0.0 and found.moving:
        dofs = [scene.dofs[k] for k in found.moving]
        with drawing.style():
            history = _panels(len(dofs), 1.25)
            run.plot.history(dofs, origin="mean", samples=_samples(found), figure=history)
        parts.append(
            figure(
                drawing.svg(
                    history, "history", f"Displacements of {', '.join(dofs)} over {number(run.duration)} s"
                ),
                f"Displacement about its mean over time: {', '.join(dofs)}; these move most.",
            )
        )
        if scene.contacts:
            parts.append(_status(run, "status", "Status of every contact over time."))
    rows = [
        [number(event.time, 12), event.name, event.kind, event.combination] for event in run.events[:EVENTS]
    ]
    if rows:
        caption = (
            "Events" if len(rows) == len(run.events) else f"The first {len(rows)} of {len(run.events)} events"
        )
        parts.append(details(caption, table(caption, ["time, s", "contact", "kind", "status after"], rows)))
    if run.grazings:
        parts.append(
            table(
                "Touches within rounding: the run kept the status, the event may be true",
                ["time, s", "contact", "event not taken", "value", "bound of its error"],
                [
                    [
                        number(g.time, 12),
                        str(scene.contact_labels()[g.contact]),
                        g.alternative,
                        g.value,
                        g.uncertainty,
                    ]
                    for g in run.grazings
                ],
            )
        )
    return section("transient", "Transient", *parts)


def cycle_section(found: Findings) -> Markup:
    """Return what the motion settles to."""
    if found.last is None:
        return section("cycle", "Limit cycle", note("There is no motion to settle.", "warning"))
    if found.cycle is None:
        parts = [note(f"{found.reasons['cycle']}.")]
        if found.settled not in AT_REST and found.scene.contacts and found.last.duration > 0.0:
            parts.append(
                _portraits(
                    found, f"Phase portraits of the last {number(found.last.duration - found.since, 4)} s."
                )
            )
        return section("cycle", "Limit cycle", *parts)
    cycle = found.cycle
    largest = cycle.largest_multiplier
    times = cycle.table()
    time, per_second = suited(cycle.period, TIMES)
    sequence = table(
        "The phases of one period, and the frequencies of their modes (Hz; u: unstable)",
        ["status", f"duration, {time}", *(f"pair {k + 1}" for k in range(times.sizes["pair"]))],
        [
            [
                str(row.combination.item()),
                per_second * float(row.duration),
                *(
                    "" if np.isnan(f) else number(f, 5) + (" u" if grows else "")
                    for f, grows in zip(row.frequency.to_numpy(), row.unstable.to_numpy(), strict=True)
                ),
            ]
            for row in (times.isel(phase=k) for k in range(times.sizes["phase"]))
        ],
    )
    multipliers = table(
        "Floquet multipliers that are not zero",
        ["multiplier", "modulus"],
        [
            [f"{number(m.real)} {'+' if m.imag >= 0 else '−'} {number(abs(m.imag))} i", abs(complex(m))]
            for m in cycle.multipliers
            if abs(m) > 1e-12
        ],
    )
    farthest = max((abs(float(x)) for ends in (cycle.minimum, cycle.maximum) for x in ends), default=0.0)
    length, per_metre = suited(farthest, LENGTHS)
    amplitudes = table(
        "Extremes of every displacement",
        ["dof", *(f"{value}, {length}" for value in ("smallest", "largest", "amplitude"))],
        [
            [name, per_metre * float(low), per_metre * float(high), per_metre * float(half)]
            for name, low, high, half in zip(
                found.scene.dofs, cycle.minimum, cycle.maximum, cycle.amplitude, strict=True
            )
        ],
    )
    return section(
        "cycle",
        "Limit cycle",
        facts(
            [
                ("period", measured(cycle.period, TIMES, 12)),
                ("frequency", f"{number(cycle.frequency, 8)} Hz"),
                ("stability", cycle.stability),
                ("largest multiplier across the flow", "not known" if np.isnan(largest) else number(largest)),
                ("mismatch of the orbit, relative", number(cycle.residual, 2)),
            ]
        ),
        _portraits(
            found, f"Phase portrait of every contact over one period of {measured(cycle.period, TIMES)}."
        ),
        _status(cycle.run, "cycle-status", "Status of every contact over one period."),
        sequence,
        details("Multipliers and extremes", multipliers, amplitudes),
    )


def spectrum_section(found: Findings) -> Markup:
    """Return the spectrum of what the motion settles to."""
    if found.lines is None or not found.moving or found.settled in AT_REST:
        return section("spectrum", "Spectrum", note("No spectrum: no motion is left."))
    exact = found.lines.attrs["method"] == "exact"
    dofs = [found.scene.dofs[k] for k in found.moving][:2]
    with drawing.style():
        drawn = _panels(len(dofs), 1.6)
        for axes, dof in zip(drawn.axes, dofs, strict=True):
            spectrum(found.lines, dof, ax=axes)
            largest = 1e6 * float(found.lines.amplitude.sel(dof=dof)[1:].max())
            axes.set(title=dof, ylim=(1e-6 * largest, 2.0 * largest) if largest > 0.0 else None)
            axes.label_outer()
    amplitude = found.lines.amplitude.to_numpy()
    size = np.sqrt((amplitude[1:] ** 2).sum(axis=1))
    order = 1 + np.argsort(-size)[:LINES]
    frequency = found.lines.frequency.to_numpy()
    main = number(float(frequency[order[0]]))
    unit, per_metre = suited(float(amplitude[order].max(initial=0.0)), LENGTHS)
    rows = [
        [float(frequency[k]), *(per_metre * float(amplitude[k, d]) for d in found.moving)]
        for k in sorted(order)
    ]
    text = "Lines of the limit cycle, integrated in closed form phase by phase: no window, no leakage."
    if not exact:
        length = number(float(found.lines.attrs["end"] - found.lines.attrs["begin"]), 4)
        text = f"Discrete Fourier transform of the last {length} s, Hann window."
    return section(
        "spectrum",
        "Spectrum",
        paragraph(text),
        figure(
            drawing.svg(
                drawn, "spectrum", f"Amplitude over frequency of {', '.join(dofs)}; main line at {main} Hz"
            ),
            f"Amplitudes of {', '.join(dofs)} over frequency. The main line of all motion is at {main} Hz.",
        ),
        table(
            "The largest lines",
            ["frequency, Hz", *(f"{found.scene.dofs[d]}, {unit}" for d in found.moving)],
            rows,
        ),
    )


def energy_section(found: Findings) -> Markup:
    """Return where the energy comes from and where it goes."""
    balance, last = found.balance, found.last
    if found.is_large and last is not None:
        left_out = f"Energy is left out for more than {BIG} dofs; Trajectory.balance computes it."
        return section("energy", "Energy", note(left_out))
    if balance is None or last is None or last.duration == 0.0:
        return section("energy", "Energy", note("There is no motion.", "warning"))
    over = "one period" if found.cycle is not None else f"the last {number(last.duration - found.since, 4)} s"
    with drawing.style():
        history = last.plot.energy(begin=found.since)
        history.set_size_inches(7.2, 6.0)
        flow = Figure(figsize=(7.2, 4.0), layout="constrained")
        balance.plot.flow(ax=flow.subplots()).set_title("")
    # What rounding leaves of zero is printed as zero.
    nothing = ROUNDINGS * np.finfo(float).eps * balance.turnover
    works: list[tuple[str, float]] = [
        ("work of the sliders", balance.slider),
        ("friction heat", -balance.friction_heat),
        ("impacts, normal loss", -balance.impact_loss),
        ("constant forces", balance.external),
        *([("circulatory forces", balance.circulatory)] if balance.circulatory else []),
        ("dampers", -balance.damping),
        ("stored", balance.stored),
    ]
    rows = [[name, work if abs(work) > nothing else 0.0] for name, work in works]
    rows.append(["residual", balance.residual])
    by_status = balance.contacts.sel(status=list(STATUSES))
    works_of = {
        name: by_status[name].transpose("contact", "status").to_numpy()
        for name in ("time", "slider", "friction_heat", "work")
    }
    lasting, per_second = suited(float(works_of["time"].max(initial=0.0)), TIMES)
    works_shown = ("slider", "friction_heat", "work")
    energy, per_joule = suited(
        max(float(np.abs(works_of[name]).max(initial=0.0)) for name in works_shown), ENERGIES
    )
    by_contact = [
        [
            f"{label}, {NAMES[status]}",
            per_second * float(works_of["time"][i, k]),
            *(per_joule * float(works_of[name][i, k]) for name in works_shown),
        ]
        for i, label in enumerate(found.scene.contact_labels())
        for k, status in enumerate(STATUSES)
        if works_of["time"][i, k] > 0.0
    ]
    return section(
        "energy",
        "Energy",
        paragraph(
            f"Over {over}; every term from its own formula, integrated to rounding. "
            "Into the structure is positive."
        ),
        figure(
            drawing.svg(
                flow,
                "flow",
                f"Energy: sliders bring {number(balance.slider)} J, dampers take {number(balance.damping)} J",
            ),
            f"Where the energy of {over} comes from and goes; widths are proportional.",
        )
        if balance.turnover > 0.0 and balance.slider > 0.0
        else "",
        table(f"Energy of {over}", ["term", "J"], rows),
        table(
            "Contacts by status: time and works",
            [
                "contact, status",
                f"time, {lasting}",
                *(f"{work}, {energy}" for work in ("slider", "friction heat", "into the structure")),
            ],
            by_contact,
        )
        if by_contact
        else "",
        figure(
            drawing.svg(history, "energy-history", f"Stored energy, its rate, powers and status over {over}"),
            f"Stored energy, its rate, powers and contact status over {over}.",
        ),
    )


def _samples(found: Findings) -> int:
    """Return at how many instants motion is drawn."""
    return min(SAMPLES, max(COARSE, DISPLACEMENTS // found.scene.size))


def _panels(count: int, height: float) -> Figure:
    figure = Figure(figsize=(7.2, 0.5 + height * count), layout="constrained")
    figure.subplots(count, 1, sharex=True, squeeze=False)
    return figure


def _status(run: Motion, name: str, caption: str) -> Markup:
    contacts = len(run.scene.contacts)
    own = run.events.contact[run.events.kind != LOAD]
    changes = np.bincount(own, minlength=contacts)
    shown = sorted(np.argsort(-changes, kind="stable")[:STATUSES_SHOWN].tolist())
    if len(shown) < contacts:
        caption += f" The {len(shown)} of {contacts} contacts with most events."
    with drawing.style():
        drawn = Figure(figsize=(7.2, 0.7 + 0.4 * len(shown)), layout="constrained")
        run.plot.statuses(shown, ax=drawn.subplots())
    seen = dict.fromkeys([run.start.combination, *run.events.combination.tolist()])
    return figure(
        drawing.svg(drawn, name, f"Contact status over time: {', '.join(list(seen)[:12])}"), caption
    )


def _portraits(found: Findings, caption: str) -> Markup:
    last, scene = found.last, found.scene
    assert last is not None
    count = min(len(scene.contacts), PORTRAITS)
    with drawing.style():
        drawn = Figure(figsize=(7.2, 3.3 * -(-count // 2)), layout="constrained")
        drawn.subplots(-(-count // 2), min(count, 2))
        last.plot.phase_planes(range(count), begin=found.since, samples=_samples(found), figure=drawn)
        for axes in drawn.axes[count:]:
            axes.set_visible(False)
    alternative = f"Tangential velocity over displacement of {count} contacts, coloured by status"
    more = "" if count == len(scene.contacts) else f" The first {count} of {len(scene.contacts)} contacts."
    return figure(
        drawing.svg(drawn, "portraits", alternative), caption + more + " Dashed: the slider's speed."
    )
