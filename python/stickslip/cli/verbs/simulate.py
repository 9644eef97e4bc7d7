"""`stickslip simulate`: the transient from the start of the file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

import stickslip as ss
from stickslip.cli.options import (
    Answer,
    Number,
    answer_options,
    motion_options,
    table,
    waiting,
)
from stickslip.scene.contact import dof_index

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

#: Events that are shown of a run.
SHOWN = 12
#: What happens at an event of a kind.
KINDS = {
    "velocity": "the slip velocity reaches zero",
    "slip+": "sticking ends, positive sliding begins",
    "slip-": "sticking ends, negative sliding begins",
    "release": "the contact opens",
    "impact": "the contact closes",
    "accumulation": "infinitely many bounces end",
}


@click.command()
@motion_options
@click.option("--max-events", type=int, help="Stop after that many events.")
@click.option("--time-limit", type=float, help="Stop after that much computing, s.")
@click.option(
    "--samples",
    type=Number(min=2),
    default=2001,
    show_default=True,
    help="Instants, equidistant from 0 to the end, at which the motion is written.",
)
@click.option("--events", is_flag=True, help="In CSV: the events instead of the motion.")
@click.option("--dof", "dofs", multiple=True, help="Dofs of the figure; default: those that move most.")
@answer_options
def simulate(
    case: ss.Case,
    settings: dict[str, Any],
    max_events: int | None,
    time_limit: float | None,
    samples: int,
    events: bool,
    dofs: tuple[str, ...],
    answer: Answer,
) -> None:
    """Compute the transient: motion, contact forces and every status change.

    What a run has computed is written also if it cannot go on or is interrupted.

    \b
    Example:
      stickslip simulate brake.toml --duration 2 -o run.nc --plot history.pdf
    """
    if events and not answer.is_rows():
        raise click.UsageError("--events goes with --csv, or with -o and a .csv file")
    if dofs and answer.plot is None:
        raise click.UsageError("--dof goes with --plot")
    for dof in dofs:
        dof_index("--dof", dof, case.scene.dofs)

    def give(run: ss.types.Motion) -> None:
        answer.give(
            lambda: run.to_dataset(samples),
            ("event",) if events else ("time",),
            lambda out: _show(out, run),
            lambda: _figure(run, dofs),
        )

    try:
        with waiting("simulating"):
            run = case.simulate(max_events=max_events, time_limit=time_limit, **settings)
    except (ss.RunError, ss.errors.RunInterrupted) as error:
        if error.partial is not None:
            give(error.partial)
        raise
    give(run)


def _figure(run: ss.types.Motion, dofs: tuple[str, ...]) -> Figure:
    from stickslip.plot import history

    return history(run, dofs or None)


def _show(out: Console, run: ss.types.Motion) -> None:
    out.print(repr(run), markup=False)
    shares = run.time_by_combination()
    total = run.duration or 1.0
    rows = [(name, f"{time:.6g}", f"{100.0 * time / total:.2f}") for name, time in shares.items()]
    out.print(table("Time by status combination", ("status", "time, s", "%"), rows))
    events = run.events
    first = max(0, len(events) - SHOWN)
    listed = [
        (f"{events.time[k]:.12f}", str(run.scene.contact_labels()[events.contact[k]]), *_what(events, k))
        for k in range(first, len(events))
    ]
    title = f"Events {first + 1} to {len(events)}" if first else "Events"
    out.print(table(title, ("time, s", "contact", "kind", "then"), listed))
    kinds = dict.fromkeys(map(str, events.kind[first:]))
    if kinds:
        out.print("Kinds: " + "; ".join(f"{kind}: {KINDS[kind]}" for kind in kinds), markup=False)


def _what(events: ss.types.Events, k: int) -> tuple[str, str]:
    return str(events.kind[k]), str(events.combination[k])
