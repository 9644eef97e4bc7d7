"""`stickslip cycle` and `stickslip curve`: the limit cycle that a run settles to, and where it bifurcates."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_args

import click

import stickslip as ss
from stickslip import types
from stickslip.cli.exits import NEGATIVE
from stickslip.cli.options import (
    RANGE,
    Answer,
    Number,
    answer_options,
    motion_options,
    ranges_of,
    show,
    steadily_sliding,
    time_limit_option,
    waiting,
)
from stickslip.locus.boundary.curves import OrbitKind
from stickslip.scene.parameters.family import Family

further_option = click.option(
    "--further", type=float, help="How much longer to follow the motion, s; default: ten times the duration."
)


@click.command()
@motion_options
@further_option
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
    found = _limit_cycle(case, settings, further, time_limit)
    answer.give(
        lambda: found.to_dataset(samples),
        ("phase",),
        lambda out: show(out, found.summary()),
        found.plot.phase_planes,
    )


@click.command()
@motion_options
@click.option(
    "--over",
    multiple=True,
    required=True,
    metavar=RANGE,
    help="Parameter and its range; twice. The bifurcation is looked for over the first one; the second one "
    "is the horizontal axis of a figure.",
)
@click.option(
    "--kind",
    type=click.Choice(get_args(OrbitKind)),
    help="What bifurcation to follow; default: the one nearest to the limit cycle.",
)
@click.option("--step", type=float, default=0.1, show_default=True, help="Longest step, part of the ranges.")
@click.option(
    "--points", type=Number(min=1), default=200, show_default=True, help="Most orbits of the curve."
)
@further_option
@time_limit_option
@answer_options
def curve(
    case: ss.Case,
    settings: dict[str, Any],
    over: tuple[str, ...],
    kind: str | None,
    step: float,
    points: int,
    further: float | None,
    time_limit: float | None,
    answer: Answer,
) -> None:
    """Follow a bifurcation of the limit cycle over two parameters.

    The limit cycle is that of `stickslip cycle`. From its value the first parameter goes to both ends of its
    range, until the cycle bifurcates. The nearest point is followed; a message names one that cannot be.

    The exit code is 1 if there is no limit cycle, or it bifurcates nowhere in the range.

    \b
    Example:
      stickslip curve brake.toml --over friction=1.3:1.5 --over slider_speed=0.0245:0.0255 --plot curve.pdf
    """
    ranges = ranges_of(over)
    first = next(iter(ranges))
    own = Family(case.model).value(first)
    found = _limit_cycle(case, settings, further, time_limit)
    with waiting("looking for a bifurcation"):
        branches = [
            ss.continuation(found, {first: (own, end)}, case.model, step=step)
            for end in ranges[first]
            if end != own
        ]
    (low, high), kinds = ranges[first], get_args(OrbitKind) if kind is None else (kind,)
    known = [point for branch in branches for point in branch.points]
    known = [point for point in known if point.kind in kinds and low <= point.value <= high]
    if not known:
        what = "bifurcation" if kind is None else kind.replace("_", " ")
        click.echo(f"no {what} of the limit cycle for {first} from {low:g} to {high:g}", err=True)
        raise SystemExit(NEGATIVE)

    def give(result: types.BifurcationCurve) -> None:
        answer.give(result.to_dataset, ("point",), lambda out: show(out, result.summary()), result.plot)

    known.sort(key=lambda one: abs(one.value - own))
    for point in known:
        try:
            with waiting(f"following the {point.kind}"):
                result = ss.continuation(point, ranges, case.model, step=step, points=points)
        except ss.Interrupted as interruption:
            give(interruption.partial)
            raise
        except ss.OrbitError as error:
            if point is known[-1]:
                raise
            click.echo(f"passed over, {first} = {point.value:.6g}: {error}", err=True)
        else:
            return give(result)


def _limit_cycle(
    case: ss.Case, settings: dict[str, Any], further: float | None, time_limit: float | None
) -> ss.Cycle:
    """Return the limit cycle that a run settles to; the verb ends with a message where there is none."""
    if steadily_sliding(case):
        case = replace(case, start={"velocity": ss.disturbed_sliding(case.scene).velocity})
    try:
        with waiting("looking for the limit cycle"):
            return case.simulate(**settings).limit_cycle(further, time_limit=time_limit)
    except ss.NotPeriodicError as error:
        if error.kind in ("stopped", "undecided"):
            # There is no answer, so the answer is not no.
            raise
        click.echo(f"no limit cycle ({error.kind}): {error}", err=True)
        raise SystemExit(NEGATIVE) from None
