"""The fuzz campaign: random scenes by modes and by Taylor series, and everything that must hold of them.

    python tests/fuzz_campaign.py --scenes 1000 --seed 1 --store out/fuzz.jsonl

Every finished scene is a line of the store, and a scene that is there is not run again: a campaign goes on
where it was stopped, and campaigns of different seeds share no scene. Exit code 1 when a scene failed.

Checked are

* modes against Taylor series: the same events, at times that differ by less than 1e-9 s or than what the
  rounding grows to (measured by nudged runs);
* complementarity on a dense sample between events, and the impact law at the events;
* energy, against quadrature of the powers;
* that the run ends by itself in bounded time, and nothing panics.

With ``--twins`` runs of two equal halves are compared with a run of one half alone. With ``--sparse`` local
marches of chains, grids and stars are compared with marches of the whole, and their energy is balanced by the
program itself.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Collection
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

import stickslip as ss
from fuzz_checks import balance_residual, complementarity, continuity, energy_residual, impact_law
from fuzz_events import PASSED, compare, limits_of, sensitivity
from fuzz_laws import beside_a_faster_mass, phases_by_integrator
from fuzz_samples import Sampled
from fuzz_scenes import EXTRAS, fuzz_scene
from fuzz_terms import contact_directions, from_time
from fuzz_twins import compare_halves, doubled
from stickslip.scene.laws.friction import FrictionLaw

#: s
DURATION = 0.1
#: The same of sparse scenes, which have up to 40 contacts.
BRIEF = 3e-3
#: Events up to which a scene is run: chatter at restitution near 1 brings many.
MAX_EVENTS = 1000
#: m; where unsymmetric terms let a motion grow beyond it, gaps of 1e-5 m are lost in its rounding: it is
#: followed until then.
LARGEST = 1e3
#: s of wall clock that a run of 0.1 s may take before it counts as hanging; the stiffest take ten by Taylor
#: series, on a machine that does nothing else.
HANG = 300.0
#: Quadrature leaves 1e-12 of the powers, sampling 3e-12; impacts near the end of a chatter add theirs.
ENERGY_TOLERANCE = 1e-9
#: Quadrature that does not know where laws of friction change is a check of what is large only. The program's
#: own balance, which does, is held to the tolerance.
ENERGY_OF_SAMPLES = 1e-3
#: Density of the quadrature where that is exceeded: a law may change faster than the linear motion turns.
DENSER = 10.0
#: Why a motion under laws of friction may end.
LAW_ENDS = (
    "its friction reaches 0",
    "its friction levels off",
    "nothing determines how the forces",
    "if the contact does not slip as it does",
)


@dataclass
class Outcome:
    """What came of one scene."""

    index: int
    verdict: str
    detail: str = ""
    subsystems: int = 0
    events: int = 0
    distinct: int = 0
    compared: int = 0
    accumulations: int = 0
    grazings: int = 0
    time_difference: float = 0.0
    energy_residual: float = 0.0
    energy_until: float = 0.0
    seconds: float = 0.0
    #: Some combination has no sound modes: chosen by the program, and by Taylor series, are compared instead.
    defective: bool = False
    #: Of both runs.
    panels: list[int] = field(default_factory=list)


def run_scene(seed: int, extras: Collection[str], index: int) -> Outcome:
    """Return the outcome of one scene."""
    began = time.perf_counter()
    outcome = Outcome(index, "ok")
    scene, start = fuzz_scene(seed, index, extras)
    try:
        if "twins" in extras:
            examine_twins(outcome, scene, start, *doubled(scene, start, seed, index))
        elif "sparse" in extras:
            examine_sparse(outcome, scene, start)
        else:
            examine(outcome, scene, start)
    except Exception as error:
        outcome.verdict, outcome.detail = "error", f"{type(error).__name__}: {error}"
        if undecided(scene, str(error)):
            outcome.verdict = "several"
    outcome.seconds = time.perf_counter() - began
    return outcome


def undecided(scene: ss.Scene, message: str) -> bool:
    """Return whether a run ended where a contact problem has several solutions, for a reason that holds.

    Static friction exceeds the kinetic one at two or more of the contacts that the message names; or normal
    forces of these can be in balance with each other, at a contact that has friction.
    """
    split = "depends on how their forces are split" in message
    held = "static friction above the kinetic one" in message
    if not ("has several solutions" in message and (split or held)):
        return False
    named = [int(i) for i in message.split("[", 1)[1].split("]", 1)[0].split(",")]
    contacts = [scene.contacts[i] for i in named]
    if held:
        return sum(contact.holding > contact.coefficient(0.0) for contact in contacts) > 1
    _, size, right = np.linalg.svd(contact_directions(scene)[1][named].T)
    in_balance = np.abs(right[np.count_nonzero(size > 1e-12 * size[0]) :]).max(axis=0, initial=0.0) > 1e-9
    return any(balanced and c.holding > 0.0 for balanced, c in zip(in_balance, contacts, strict=True))


def examine(outcome: Outcome, scene: ss.Scene, start: ss.State) -> None:
    """Run a scene by modes and by Taylor series, and write down what was found.

    Phases under laws of friction or with nonlinear elements have no modes: there series of panels at most
    half as wide as these are in the mean are the other method.
    """
    limits: dict[str, Any] = {"max_events": MAX_EVENTS, "time_limit": HANG}
    has_laws = any(isinstance(contact.friction, FrictionLaw) for contact in scene.contacts)
    has_laws = has_laws or bool(scene.elements)
    has_springs = any(
        spring is not None for c in scene.contacts for spring in (c.normal_stiffness, c.tangential_stiffness)
    )
    scenes = {"modal": scene, "auto": scene, "taylor": scene}
    by_modes: Literal["auto", "modal"] = "auto" if has_laws else "modal"
    other, duration = start, DURATION

    def by(method: Literal["auto", "modal", "taylor"]) -> Callable[..., ss.Trajectory]:
        return lambda start, duration, begin=0.0: ss.simulate(
            from_time(scenes[method], begin), duration, start, method=method, **limits
        )

    def nudged(method: Literal["auto", "modal", "taylor"]) -> Callable[..., ss.Trajectory]:
        def follow(start: ss.State, duration: float, begin: float) -> ss.Trajectory:
            try:
                return by(method)(start, duration, begin)
            except ss.RunError as error:
                # It ends before a combination that the run itself does not come to.
                if error.partial is None or "modes are defective" not in str(error):
                    raise
                return error.partial

        return follow

    try:
        modal = by(by_modes)(start, duration)
    except ss.StickslipError as error:
        partial = error.partial if isinstance(error, ss.RunError) else None
        if partial and within_range(partial) < partial.duration:
            duration = within_range(partial)
        elif undecided(scene, str(error)) and partial and len(partial.events):
            duration = 0.5 * (partial.events.time[-1] + partial.duration)
        elif any(reason in str(error) for reason in LAW_ENDS) and partial and partial.duration:
            # The law holds no longer; both runs are compared up to there.
            duration = (1.0 - 1e-9) * partial.duration
        elif "modes are defective" in str(error):
            outcome.defective, by_modes = True, "auto"
        else:
            raise
        modal = by(by_modes)(start, duration)
    duration = min(duration, within_range(modal))
    if duration < modal.duration:
        modal = by(by_modes)(start, duration)
    if has_laws:
        width = 0.5 * duration / modal.counters["panels"]
        scenes["taylor"], other = beside_a_faster_mass(scene, start, width)
    taylor = by("taylor")(other, duration)
    outcome.subsystems, outcome.events = len(scene.contacts), len(modal.events)
    outcome.panels = [modal.counters["panels"], taylor.counters["panels"]]
    outcome.accumulations, outcome.grazings = len(modal.accumulations), len(modal.grazings)
    comparison = compare(
        modal,
        taylor,
        lambda directions: (
            sensitivity(modal, nudged(by_modes), directions, limits_of(taylor)),
            sensitivity(taylor, nudged("taylor"), directions, limits_of(modal)),
        ),
    )
    outcome.verdict, outcome.detail = comparison.verdict, comparison.detail
    outcome.compared, outcome.distinct = comparison.compared, comparison.distinct
    outcome.time_difference = comparison.difference
    one, other = Sampled(modal), Sampled(taylor, powers=False)
    # The quadrature of samples has the linear structure alone.
    sampled = 0.0 if scene.elements else energy_residual(one)
    if has_laws and sampled > ENERGY_OF_SAMPLES:
        sampled = energy_residual(Sampled(modal, density=DENSER))
    outcome.energy_residual = balance_residual(modal) if has_laws else sampled
    outcome.energy_until = one.powers_until
    failures = {
        "hang": ", ".join(run.stop_reason for run in (modal, taylor) if run.stop_reason == "time_limit"),
        "continuity": continuity(modal) or continuity(taylor),
        "complementarity": complementarity(one) or complementarity(other),
        "impact": impact_law(one) or impact_law(other),
        "energy": imbalance(outcome)
        or (f"residual of samples {sampled:.2e}" if sampled > ENERGY_OF_SAMPLES else ""),
        "equation of motion": phases_by_integrator(modal) if has_laws and not has_springs else "",
    }
    write_down(outcome, failures)


def imbalance(outcome: Outcome) -> str:
    """Return what is wrong with the energy of a scene; empty if it is balanced."""
    residual = outcome.energy_residual
    return f"residual {residual:.2e}" if residual > ENERGY_TOLERANCE else ""


def write_down(outcome: Outcome, failures: dict[str, str]) -> None:
    """Set the verdict to the last failure that has a detail."""
    for verdict, detail in failures.items():
        if detail:
            outcome.verdict, outcome.detail = verdict, detail


def examine_twins(
    outcome: Outcome, scene: ss.Scene, start: ss.State, both: ss.Scene, both_start: ss.State
) -> None:
    """Run a scene alone and two of it tied to each other, and write down what was found."""

    def follow(start: ss.State, duration: float, begin: float) -> ss.Trajectory:
        return ss.simulate(both, duration, start, max_events=2 * MAX_EVENTS, time_limit=HANG)

    alone = ss.simulate(scene, DURATION, start, max_events=MAX_EVENTS, time_limit=HANG)
    duration = min(alone.duration, within_range(alone))
    run = follow(both_start, duration, 0.0)
    if both.mass.ndim == 2 and run.accumulations:
        # Where mass couples contacts, a series of several is cut short by what the run tells as its error.
        duration = float(0.999 * run.events.time[run.accumulations[0].event])
        alone = ss.simulate(scene, duration, start, max_events=MAX_EVENTS, time_limit=HANG)
        run = follow(both_start, duration, 0.0)
    outcome.subsystems, outcome.events = len(both.contacts), len(run.events)
    outcome.accumulations, outcome.grazings = len(run.accumulations), len(run.grazings)
    for comparison in compare_halves(alone, run, follow):
        if outcome.verdict in PASSED:
            outcome.verdict, outcome.detail = comparison.verdict, comparison.detail
        outcome.compared += comparison.compared
        outcome.distinct += comparison.distinct
        outcome.time_difference = max(outcome.time_difference, comparison.difference)
    outcome.energy_until, outcome.energy_residual = duration, balance_residual(run)
    write_down(
        outcome,
        {
            "hang": "time_limit" if run.stop_reason == "time_limit" else "",
            "continuity": continuity(run),
            "energy": imbalance(outcome),
        },
    )


def within_range(run: ss.Trajectory) -> float:
    """Return the time up to which no displacement exceeds `LARGEST`, s; infinite if none does."""
    times = np.linspace(0.0, run.duration, 201)
    beyond = np.abs(run.sample(times).position.values).max(axis=1) > LARGEST
    return float(times[np.argmax(beyond) - 1]) if beyond.any() else np.inf


def examine_sparse(outcome: Outcome, scene: ss.Scene, start: ss.State) -> None:
    """Run a scene by local marches and by those of the whole, and write down what was found."""

    def by(method: Literal["local", "taylor"]) -> Callable[..., ss.Trajectory]:
        return lambda start, duration, begin=0.0: ss.simulate(
            from_time(scene, begin), duration, start, method=method, max_events=MAX_EVENTS, time_limit=HANG
        )

    local, whole = by("local")(start, BRIEF), by("taylor")(start, BRIEF)
    outcome.subsystems, outcome.events = len(scene.contacts), len(local.events)
    outcome.accumulations, outcome.grazings = len(local.accumulations), len(local.grazings)
    comparison = compare(
        local,
        whole,
        lambda directions: (
            sensitivity(local, by("local"), directions, limits_of(whole)),
            sensitivity(whole, by("taylor"), directions, limits_of(local)),
        ),
    )
    outcome.verdict, outcome.detail = comparison.verdict, comparison.detail
    outcome.compared, outcome.distinct = comparison.compared, comparison.distinct
    outcome.time_difference = comparison.difference
    if comparison.verdict == "ok" and local.stop_reason != whole.stop_reason:
        outcome.verdict, outcome.detail = "stop", f"{local.stop_reason}, {whole.stop_reason}"
    sampled = Sampled(local, powers=False)
    failures = {
        "continuity": continuity(local),
        "complementarity": complementarity(sampled),
        "impact": impact_law(sampled),
    }
    balance = local.balance()
    outcome.energy_until, outcome.energy_residual = BRIEF, abs(balance.residual) / (balance.turnover or 1.0)
    write_down(outcome, {**failures, "energy": imbalance(outcome)})


def finished(store: Path, seed: int, extras: Collection[str]) -> dict[int, Outcome]:
    """Return the outcomes that a store already holds for a seed and a kind of scenes."""
    if not store.exists():
        return {}
    outcomes = {}
    for line in store.read_text().splitlines():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:  # the line that an interruption cut
            continue
        own, having = record.pop("seed"), {name for name in EXTRAS if record.pop(name, False)}
        if (own, having) == (seed, set(extras)):
            outcomes[record["index"]] = Outcome(**record)
    return outcomes


def campaign(
    scenes: int, seed: int, store: Path | None, workers: int, extras: Collection[str] = ()
) -> list[Outcome]:
    """Run the scenes that the store does not hold yet; return all outcomes by index."""
    outcomes = finished(store, seed, extras) if store else {}
    kind = {"seed": seed, **dict.fromkeys(extras, True)}
    todo = [index for index in range(scenes) if index not in outcomes]
    with ExitStack() as stack:
        sink = stack.enter_context(store.open("a")) if store else None
        # Matrices of two dozen rows gain nothing from threads, and the workers need the cores. The setting is
        # read when numpy is loaded, so workers load their own.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        spawn = multiprocessing.get_context("spawn")
        pool = stack.enter_context(ProcessPoolExecutor(workers, mp_context=spawn))
        for outcome in pool.map(partial(run_scene, seed, extras), todo, chunksize=8):
            outcomes[outcome.index] = outcome
            if sink:
                sink.write(json.dumps({**kind, **asdict(outcome)}) + "\n")
                sink.flush()
    return [outcomes[index] for index in range(scenes)]


def summary(outcomes: list[Outcome]) -> str:
    """Return what a person wants to know of a campaign."""
    verdicts = Counter(outcome.verdict for outcome in outcomes)
    times = np.array([outcome.time_difference for outcome in outcomes if outcome.verdict in PASSED])
    energy = np.array([outcome.energy_residual for outcome in outcomes])
    whole = [outcome for outcome in outcomes if outcome.events < MAX_EVENTS]
    duration = max(o.energy_until for o in outcomes)
    lines = [
        f"{len(outcomes)} scenes, {sum(o.events for o in outcomes)} events, "
        f"{sum(o.distinct for o in outcomes)} of them distinct, "
        f"{sum(o.compared for o in outcomes)} compared, "
        f"{sum(o.accumulations for o in outcomes)} accumulations, "
        f"{sum(o.grazings for o in outcomes)} touches",
        *(f"  {count:6d} {verdict}" for verdict, count in verdicts.most_common()),
        f"largest time difference {times.max(initial=0):.2e} s, 99 % below {np.quantile(times, 0.99):.2e} s",
        f"energy residual: largest {np.nanmax(energy):.2e}, median {np.nanmedian(energy):.2e}",
        f"energy not followed to the end: {sum(o.energy_until < duration for o in whole)} of "
        f"{len(whole)} scenes that reach it",
        f"slowest scene {max(o.seconds for o in outcomes):.2f} s, "
        f"{sum(o.defective for o in outcomes)} with a combination without sound modes",
    ]
    failed = [o for o in outcomes if o.verdict not in PASSED]
    lines += [f"scene {o.index}: {o.verdict}: {o.detail}" for o in failed[:20]]
    return "\n".join(lines)


def main() -> int:
    """Run a campaign from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--store", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    for name, meaning in EXTRAS.items():
        parser.add_argument(f"--{name}", action="store_true", help=f"the same scenes with {meaning}")
    arguments = parser.parse_args()
    if arguments.store:
        arguments.store.parent.mkdir(parents=True, exist_ok=True)
    extras = [name for name in EXTRAS if getattr(arguments, name)]
    outcomes = campaign(arguments.scenes, arguments.seed, arguments.store, arguments.workers, extras)
    print(summary(outcomes))
    return int(any(outcome.verdict not in PASSED for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
