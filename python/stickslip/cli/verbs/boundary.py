"""`stickslip boundary`: the curves over two parameters on which stability ends."""

from __future__ import annotations

from pathlib import Path

import click

import stickslip as ss
from stickslip import types
from stickslip.cli.options import (
    RANGE,
    Answer,
    Number,
    answer_options,
    band_option,
    combination_option,
    loaded,
    ranges_of,
    scene_argument,
    show,
)


@click.command()
@scene_argument
@click.option(
    "--over",
    multiple=True,
    required=True,
    metavar=RANGE,
    help="Parameter and its range; twice. The second one is the horizontal axis of a figure.",
)
@combination_option
@click.option(
    "--cells",
    type=Number(2, 1000),
    default=16,
    show_default=True,
    help="Lines searched in each parameter: no wider curve is missed.",
)
@band_option
@answer_options
def boundary(
    scene: Path,
    changes: tuple[str, ...],
    over: tuple[str, ...],
    combination: str | None,
    cells: int,
    band: tuple[float, float] | None,
    answer: Answer,
) -> None:
    """Follow the curves over two parameters on which stability of sliding ends.

    \b
    Example:
      stickslip boundary brake.toml --over friction=0:3 --over damping=1e-5:2e-4 --plot boundary.pdf
    """
    ranges, model = ranges_of(over), loaded(scene, changes).model

    def give(found: types.StabilityBoundary) -> None:
        answer.give(found.to_dataset, ("point",), lambda out: show(out, found.summary()), found.plot)

    try:
        found = ss.stability_boundary(model, ranges, combination=combination, cells=cells, band=band)
    except ss.Interrupted as interruption:
        give(interruption.partial)
        raise
    give(found)
