"""`stickslip cycle`: the limit cycle that a run settles to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click
import numpy as np

import stickslip as ss
from stickslip.cli.exits import NEGATIVE
from stickslip.cli.options import (
    Answer,
    Number,
    answer_options,
    motion_options,
    table,
    waiting,
)

if TYPE_CHECKING:
    from rich.console import Console

#: Multipliers that are shown.
SHOWN = 6


@click.command()
@motion_options
@click.option(
    "--further", type=float, default=10.0, show_default=True, help="How much longer to follow the motion, s."
)
@click.option("--samples", type=Number(min=2), default=513, show_default=True, help="Instants of one period.")
@answer_options
def cycle(
    case: ss.Case,
    settings: dict[str, Any],
    further: float,
    samples: int,
    answer: Answer,
) -> None:
    """Find the limit cycle: period, phases, stability, spectrum.

    Exits with 1 if the motion settles to none; it says what it is instead. Exits with 3 if it was followed
    too short to tell.

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
        lambda out: _show(out, found),
        lambda: limit_cycle(found),
    )


def _show(out: Console, found: ss.Cycle) -> None:
    verdict = "[bold red]unstable[/]" if found.stable is False else found.stability
    doubled = ", period-doubled" if found.period_doubled else ""
    period = f"Period {1e3 * found.period:.9g} ms ({found.frequency:.6g} Hz)"
    out.print(f"{period}, main line {found.main_frequency():.6g} Hz{doubled}; {verdict}")
    rows = []
    for name, duration in zip(found.combinations, found.durations, strict=True):
        modes = found.modes[name]
        lines = modes.frequencies[modes.eigenvalues.imag >= 0.0]
        rows.append((name, f"{1e3 * duration:.6f}", " ".join(f"{line:.2f}" for line in lines)))
    out.print(table("Phases", ("status", "duration, ms", "frequencies of its modes, Hz"), rows))
    multipliers = found.transverse_multipliers[:SHOWN]
    listed = ", ".join(f"{abs(m):.6g} ∠ {np.degrees(np.angle(m)):.1f}°" for m in multipliers)
    if np.isnan(found.largest_multiplier):
        listed = "not known"
    out.print(f"Largest multipliers: {listed}; {found.structural_zeros} zero by structure")
