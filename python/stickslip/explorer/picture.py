"""What a page shows at one point: the motion, what it settles to, its spectrum, its energy, a sentence."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip.cycles.attractors import affordable_search, shown_duration
from stickslip.cycles.cycle import Cycle
from stickslip.explorer.wanted import PATIENCE, Wanted
from stickslip.faults import InputError
from stickslip.modes.modes import Modes, shown_growth
from stickslip.motion.energy import STATUSES, Balance
from stickslip.motion.errors import NotPeriodicError, RunError
from stickslip.motion.figures import instants
from stickslip.motion.motion import Motion
from stickslip.scene.scene import Scene
from stickslip.scene.state import State
from stickslip.show.html import number
from stickslip.show.units import TIMES, measured
from stickslip.transient.simulate import simulate
from stickslip.transient.trajectory import Trajectory

#: Instants of one period, of a last stretch, and of the way there.
PERIOD, STRETCH, WAY = 257, 1201, 1501
#: Displacements of a stretch at most: of many dofs fewer instants are sent.
NUMBERS = 400_000
#: Contacts that a page draws, harmonics of a spectrum.
CONTACTS, HARMONICS = 4, 40
#: Largest product of an eigenvalue and the period with which lines are integrated: some seconds of work.
FASTEST = 2e5
#: What is looked at of a motion without period: its last part.
LAST = 0.2
#: How much longer than the transient a motion is followed for what it settles to, s of motion.
FURTHER = 3.0


def picture(wanted: Wanted, max_events: int | None = None) -> dict[str, Any]:
    """Return all that is shown of the motion at a point; if there is no motion, ``sentence`` says why.

    Motion, and search for what it settles to, end after `max_events` events each; None: no such limit.
    """
    patience = wanted.number("patience", PATIENCE)
    dof = wanted.dof()
    try:
        scene = wanted.scene()
    except InputError as error:
        return {"error": str(error), "sentence": f"There is no such scene: {error}."}
    found: dict[str, Any] = {"error": None}
    try:
        equilibrium, modes, unsteady = wanted.steady(scene)
    except InputError as error:
        return {"error": str(error), "sentence": f"There is no steady sliding: {error}."}
    if not len(modes):
        reason = "no mode lies in the band of frequencies"
        return {"error": reason, "sentence": f"There is nothing to show: {reason}."}
    found["modes"] = None if unsteady else _modes(modes)
    stability = (
        f"There is no steady sliding: {unsteady}. So there are no modes to show."
        if unsteady
        else _stability(scene, modes)
    )
    if (band := wanted.explored.band) is not None and not unsteady:
        stability = f"{stability[:-1]}, by the modes from {number(band[0])} to {number(band[1])} Hz."
    start, remark = wanted.start(scene, equilibrium, modes)
    duration = float(wanted.explored.case.run.get("duration", shown_duration(modes)))
    try:
        run = simulate(scene, duration, start, max_events=max_events, time_limit=patience)
    except RunError as error:
        if not isinstance(error.partial, Trajectory):
            return {**found, "error": str(error), "sentence": f"{stability} {error}."}
        run, remark = error.partial, f"{remark} The motion could not be continued: {error}.".strip()
    except InputError as error:
        return {**found, "error": str(error), "sentence": f"{stability} No start: {error}."}
    cycle, last, since, ending = _settled(run, duration, patience, max_events)
    chosen, dofs = _contacts(run), [*wanted.explored.sent, dof]
    found |= {
        "way": series(run, WAY, chosen, dofs, start=0.0),
        "motion": series(last, STRETCH if cycle is None else PERIOD, chosen, dofs, start=since),
        "contacts": chosen,
        "cycle": None if cycle is None else _cycle(cycle),
        "lines": _lines(cycle, last, since, dof, np.abs(modes.eigenvalues).max(initial=0.0)),
        "energy": _energy(last.balance(since), scene),
        "state": _state(last),
        "sentence": " ".join(part for part in (stability, ending, remark) if part),
    }
    return found


def _modes(modes: Modes) -> dict[str, Any]:
    return {
        "combination": modes.combination,
        "growth": shown_growth(modes.eigenvalues.real, modes.unstable).tolist(),
        "frequency": modes.frequencies.tolist(),
        "unstable": modes.unstable.tolist(),
    }


def _stability(scene: Scene, modes: Modes) -> str:
    unstable = np.flatnonzero(modes.unstable)
    labels = scene.contact_labels()
    opened = [str(label) for label, status in zip(labels, modes.combination, strict=True) if status == "d"]
    steady = f"Steady sliding with open contact{'s' * (len(opened) > 1)} {', '.join(opened)}"
    steady = steady if opened else "Steady sliding"
    if not unstable.size:
        return f"{steady} is {'marginal' if modes.marginal.any() else 'stable'}."
    k = unstable[int(np.argmax(modes.eigenvalues[unstable].real))]
    more = "" if unstable.size == 1 else f", and {unstable.size - 1} more modes grow"
    growth, frequency = number(modes.eigenvalues[k].real, 3), number(modes.frequencies[k], 4)
    return f"{steady} is unstable: {frequency} Hz grows at {growth} 1/s{more}."


def _settled(
    run: Trajectory, duration: float, patience: float, max_events: int | None
) -> tuple[Cycle | None, Motion, float, str]:
    """Return the cycle, the motion to look at, from when on, and how it ends in a sentence."""
    since = (1.0 - LAST) * run.duration
    if run.stop_reason != "duration":
        why = {
            "time_limit": "computing took too long",
            "unbounded": "it grows without bound",
            "max_events": f"that is the limit of {max_events} events",
        }
        reason = why.get(run.stop_reason, run.stop_reason)
        return None, run, since, f"The motion is shown up to {number(run.duration, 3)} s: {reason}."
    further = max(FURTHER, duration)
    if max_events is not None:
        further = affordable_search(run, further, max_events)
    try:
        cycle = run.limit_cycle(further, time_limit=patience)
    except NotPeriodicError as error:
        last: Motion = error.partial if isinstance(error.partial, Motion) else run
        if error.kind == "equilibrium":
            return None, run, since, "Disturbed, it comes to rest again."
        return None, last, (1.0 - LAST) * last.duration, f"{str(error)[:1].upper()}{str(error)[1:]}."
    except RunError as error:
        return None, run, since, f"The motion could not be continued: {error}."
    return cycle, cycle.run, 0.0, _told(cycle)


def _told(cycle: Cycle) -> str:
    """Return what happens on a cycle in a sentence."""
    times = cycle.durations / cycle.period
    parts = []
    for i, label in enumerate(cycle.scene.contact_labels()[:CONTACTS]):
        shares = {
            letter: 100.0
            * float(sum(times[k] for k, name in enumerate(cycle.combinations) if name[i] == letter))
            for letter in "sd+-"
        }
        speed = cycle.scene.contacts[i].slider_speed
        words = {"s": "sticks", "d": "is open"}
        if speed == 0.0:
            words |= {"-": "slides forwards", "+": "slides backwards"}
        else:
            # The other sense is that of steady sliding, which is not told.
            words["-" if speed > 0.0 else "+"] = "overtakes its slider"
        happens = [
            f"{word} {shares[letter]:.0f} %" for letter, word in words.items() if shares[letter] >= 0.5
        ]
        parts.append(f"contact {label} {' and '.join(happens) if happens else 'never stops sliding'}")
    which = "an unstable" if cycle.stable is False else "a"
    return (
        f"The motion settles to {which} limit cycle of {measured(cycle.period, TIMES, 5)} "
        f"({number(cycle.frequency, 5)} Hz): {', '.join(parts)} of the time."
    )


def _contacts(run: Motion) -> list[int]:
    """Return the contacts that are drawn: all, or those with most events."""
    count = len(run.scene.contacts)
    own = run.events.contact[run.events.contact >= 0]
    changes = np.bincount(own, minlength=count)
    return sorted(np.argsort(-changes, kind="stable")[:CONTACTS].tolist())


def series(
    run: Motion, samples: int, contacts: Sequence[int], dofs: Sequence[int], start: float
) -> dict[str, Any]:
    """Return a stretch of a motion as the page draws it, from `start` to its end.

    Displacements are those of `dofs`, tangential motion and statuses those of `contacts`; every array is in
    base64, of float32 or letters, in rows of one instant each.
    """
    samples = min(samples, NUMBERS // len(dofs))
    if len(run.events) > samples:
        times = np.linspace(start, run.duration, samples)
    else:
        times = instants(run, samples, contacts, start)
    position, velocity, _, _, status = run.core.sample(times)
    directions = [run.scene.tangential_direction(i) for i in contacts]
    along = np.array(directions).reshape(len(contacts), run.scene.size).T
    return {
        "begin": start,
        "end": run.duration,
        "time": packed(times),
        "position": packed(position[:, list(dofs)]),
        "displaced": packed(position @ along),
        "slip": packed(velocity @ along),
        "status": base64.b64encode(status[:, list(contacts)].tobytes()).decode(),
        "speed": [run.scene.contacts[i].slider_speed for i in contacts],
    }


def packed(values: Any) -> str:
    """Return numbers as float32 in base64."""
    return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode()


def json_text(answer: Any) -> str:
    """Return an answer as JSON, with null for what that has no number for."""

    def finite(part: Any) -> Any:
        if isinstance(part, float):
            return part if math.isfinite(part) else None
        if isinstance(part, dict):
            return {name: finite(value) for name, value in part.items()}
        return [finite(value) for value in part] if isinstance(part, list | tuple) else part

    return json.dumps(finite(answer), allow_nan=False)


def _cycle(cycle: Cycle) -> dict[str, Any]:
    return {
        "period": cycle.period,
        "frequency": cycle.frequency,
        "combinations": list(cycle.combinations),
        "stability": cycle.stability,
    }


def _lines(cycle: Cycle | None, last: Motion, since: float, dof: int, fastest: float) -> dict[str, Any]:
    """Return the spectrum of a dof, in µm; `fastest` is the largest modulus of an eigenvalue, 1/s."""
    if cycle is not None and fastest * cycle.period <= FASTEST:
        size = 2.0 * np.abs(cycle.core.harmonics(HARMONICS)[1:, dof])
        lines = cycle.frequency * np.arange(1, HARMONICS + 1)
        return {"exact": True, "frequency": lines.tolist(), "amplitude": (1e6 * size).tolist()}
    if last.duration <= since:
        return {"exact": False, "frequency": [], "amplitude": []}
    # A cycle is one period, which needs no window.
    window = "hann" if cycle is None else "boxcar"
    sampled = last.spectrum(last.scene.dofs[dof], begin=since, samples=2048, window=window)
    kept = slice(1, 512)
    return {
        "exact": False,
        "frequency": sampled.frequency.to_numpy()[kept].tolist(),
        "amplitude": (1e6 * sampled.amplitude.to_numpy()[kept]).tolist(),
    }


def _energy(balance: Balance, scene: Scene) -> list[dict[str, Any]]:
    """Return the works of every contact by status and of the rest, in mJ, into the structure positive."""
    table = balance.contacts
    works = 1e3 * table.work.to_numpy()
    heat = 1e3 * table.friction_heat.to_numpy().sum(axis=1)
    impact = -1e3 * table.impact_normal.to_numpy()
    rows = [
        {
            "name": f"contact {label}",
            "parts": {
                **{letter: float(work) for letter, work in zip(STATUSES, works[i], strict=True)},
                "impact": float(impact[i]),
            },
            "heat": float(heat[i]),
        }
        for i, label in enumerate(scene.contact_labels()[:12])
    ]
    others = {"external": balance.external, "circulatory": balance.circulatory, "damping": -balance.damping}
    others |= {"stored": -balance.stored}
    shown = {name: work for name, work in others.items() if name != "circulatory" or work}
    return rows + [
        {"name": name, "parts": {"other": 1e3 * work}, "heat": 0.0} for name, work in shown.items()
    ]


def _state(last: Motion) -> dict[str, Any]:
    """Return the state from which a motion at other parameters goes on: within its longest phase."""
    begins = np.concatenate([[0.0], last.events.time, [last.duration]])
    longest = int(np.argmax(np.diff(begins)))
    state: State = last.state(0.5 * float(begins[longest] + begins[longest + 1]))
    return {
        "position": state.position.tolist(),
        "velocity": state.velocity.tolist(),
        "combination": state.combination,
    }
