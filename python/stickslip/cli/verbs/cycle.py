"""`stickslip cycle`: the limit cycle that a run settles to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

import stickslip as ss
from stickslip.cli.exits import NEGATIVE
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


@click.command()
@motion_options
@click.option(
    "--further", type=float, help="How much longer to follow the motion, s; default: ten times the duration."
)
@time_limit_option
@click.option(
    "--samples", type=Number(min=2), default=513, show_default=True, help="Number of instants in one period."
)
@answer_options
def cycle(
    case: ss.Case,
    settings: dict[str, Any],
    further: float | None,
    time_limit: float | None,
    samples: int,
    answer: Answer,
) -> None:
    """Find the limit cycle: period, phases, stability, spectrum.

    Without a start, in the file or by --start, the motion begins in steady sliding with its fastest growing
    mode set in motion, if no load varies in time. --time-limit holds for the search alone.

    The exit code is 1 if the motion settles to no limit cycle; a message says what it does instead. The exit
    code is 3 if the motion was too short to tell.

    \b
    Example:
      stickslip cycle brake.toml --set friction=2.2 --plot cycle.pdf
    """
    if steadily_sliding(case):
        case = replace(case, start={"velocity": ss.disturbed_sliding(case.scene).velocity})
    try:
        with waiting("looking for the limit cycle"):
            found = case.simulate(**settings).limit_cycle(further, time_limit=time_limit)
    except ss.NotPeriodicError as error:
        if error.kind in ("stopped", "undecided"):
            # There is no answer, so the answer is not no.
            raise
        click.echo(f"no limit cycle ({error.kind}): {error}", err=True)
        raise SystemExit(NEGATIVE) from None
    answer.give(
        lambda: found.to_dataset(samples),
        ("phase",),
        lambda out: show(out, found.summary()),
        found.plot.phase_planes,
    )
