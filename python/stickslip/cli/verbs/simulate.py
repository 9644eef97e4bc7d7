"""`stickslip simulate`: the transient from the start of the file."""

from __future__ import annotations

from typing import Any

import click

import stickslip as ss
from stickslip import types
from stickslip.cli.options import (
    Answer,
    Number,
    answer_options,
    motion_options,
    show,
    steadily_sliding,
    time_limit_option,
    waiting,
)
from stickslip.scene.contact import dof_index


@click.command()
@motion_options
@click.option("--max-events", type=int, help="Stop after so many events.")
@time_limit_option
@click.option(
    "--samples",
    type=Number(min=2),
    default=2001,
    show_default=True,
    help="Number of instants, equidistant from 0 to the end, at which the motion is written.",
)
@click.option("--events", is_flag=True, help="Write the events to the CSV table instead of the motion.")
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

    If a run cannot go on or is interrupted, the motion computed so far is written.

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

    def give(run: types.Motion) -> None:
        answer.give(
            lambda: run.to_dataset(samples),
            ("event",) if events else ("time",),
            lambda out: show(out, run.summary()),
            lambda: run.plot.history(dofs or None),
        )

    try:
        with waiting("simulating"):
            run = case.simulate(max_events=max_events, time_limit=time_limit, **settings)
    except (ss.RunError, ss.Interrupted) as error:
        if error.partial is not None:
            give(error.partial)
        raise
    give(run)
    if steadily_sliding(case) and not len(run.events):
        click.echo(
            "hint: the run begins in exact steady sliding and stays there, stable or not; "
            "--start velocity.DOF=METRES_PER_SECOND disturbs it",
            err=True,
        )
