"""`stickslip cycle`: the limit cycle that a run settles to."""

from __future__ import annotations

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
    waiting,
)


@click.command()
@motion_options
@click.option(
    "--further", type=float, default=10.0, show_default=True, help="How much longer to follow the motion, s."
)
@click.option(
    "--samples", type=Number(min=2), default=513, show_default=True, help="Number of instants in one period."
)
@answer_options
def cycle(
    case: ss.Case,
    settings: dict[str, Any],
    further: float,
    samples: int,
    answer: Answer,
) -> None:
    """Find the limit cycle: period, phases, stability, spectrum.

    The exit code is 1 if the motion settles to no limit cycle; a message says what it does instead. The exit
    code is 3 if the motion was too short to tell.

    \b
    Example:
      stickslip cycle brake.toml --set friction=2.2 --plot cycle.pdf
    """
    try:
        with waiting("looking for the limit cycle"):
            found = case.simulate(**settings).limit_cycle(further)
    except ss.errors.NotPeriodicError as error:
        if error.kind in ("stopped", "undecided"):
            # There is no answer, so the answer is not no.
            raise
        click.echo(f"no limit cycle ({error.kind}): {error}", err=True)
        raise SystemExit(NEGATIVE) from None
    from stickslip.plot import limit_cycle

    answer.give(
        lambda: found.to_dataset(samples),
        ("phase",),
        lambda out: show(out, found.summary()),
        lambda: limit_cycle(found),
    )
