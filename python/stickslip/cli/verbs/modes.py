"""`stickslip modes`: complex modes of a status combination."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

import stickslip as ss
from stickslip.cli.options import (
    Answer,
    answer_options,
    combination_option,
    loaded,
    scene_argument,
    show,
    waiting,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@click.command()
@scene_argument
@combination_option
@click.option(
    "--modes",
    "numbers",
    callback=lambda _ctx, _option, text: _numbers(text),
    metavar="NUMBERS",
    help="Modes to draw, such as 0,2,3 of the table; default: at most 9 with the largest growth rates.",
)
@click.option(
    "--band",
    nargs=2,
    type=float,
    metavar="LOW HIGH",
    help="Two frequencies, Hz: compute only the modes between, and count missing ones.",
)
@click.option(
    "--growth",
    nargs=2,
    callback=lambda _ctx, _option, bounds: _growth(bounds),
    metavar="LOW HIGH",
    help="With --band: growth rates in 1/s; none stands for no bound.",
)
@click.option(
    "--certify/--no-certify",
    default=True,
    show_default=True,
    help="With --band: whether missing modes are counted, which takes longer than their search.",
)
@click.option(
    "--near",
    multiple=True,
    type=click.FloatRange(min=0.0),
    metavar="HZ",
    help="Frequency in Hz: compute only the modes nearest to it.",
)
@click.option("--count", type=int, default=20, show_default=True, help="With --near: the number of modes.")
@click.option(
    "--all", "every", is_flag=True, help="Show frequencies and stability of all status combinations."
)
@answer_options
def modes(
    scene: Path,
    changes: tuple[str, ...],
    combination: str | None,
    numbers: list[int] | None,
    band: tuple[float, float] | None,
    growth: tuple[float | None, float | None],
    certify: bool,
    near: tuple[float, ...],
    count: int,
    every: bool,
    answer: Answer,
) -> None:
    """Compute the complex modes of steady sliding, or of any status combination.

    \b
    Example:
      stickslip modes brake.toml --set friction=2.2 -c +s --plot shapes.pdf
      stickslip modes mesh.toml --band 0 20e3 --growth -50 none
    """
    if numbers is not None and answer.plot is None:
        raise click.UsageError("--modes goes with --plot")
    case = loaded(scene, changes)
    if every:
        if combination is not None or answer.plot is not None or band is not None or near:
            raise click.UsageError("--all goes with neither --combination nor --plot, --band and --near")
        statuses = ss.status_table(case.scene)
        answer.give(
            lambda: statuses.data,
            ("combination", "pair"),
            lambda out: out.print(repr(statuses), markup=False),
            None,
        )
        return
    with waiting("computing the modes"):
        found = ss.complex_modes(
            case.scene,
            combination,
            band=band,
            growth=growth,
            certify=certify,
            near=[2j * math.pi * hertz for hertz in near] or None,
            count=count,
        )

    def drawn() -> Figure:
        with waiting("drawing"):
            return found.plot.shapes(numbers)

    if numbers is not None:
        wrong = [number for number in numbers if number >= len(found)]
        if wrong:
            raise click.BadParameter(f"--modes: the scene has the modes 0 to {len(found) - 1}, got {wrong}")
    answer.give(found.to_dataset, ("mode",), lambda out: show(out, found.summary()), drawn)


def _growth(bounds: tuple[str, str] | None) -> tuple[float | None, float | None]:
    if bounds is None:
        return None, None
    try:
        low, high = (None if bound == "none" else float(bound) for bound in bounds)
    except ValueError:
        raise click.BadParameter(f"expected two numbers in 1/s or none, got {' '.join(bounds)}") from None
    return low, high


def _numbers(text: str | None) -> list[int] | None:
    if text is None:
        return None
    parts = text.split(",")
    if not all(part.strip().isdecimal() for part in parts):
        raise click.BadParameter(f"expected numbers of modes such as 0,2,3, got {text!r}")
    return [int(part) for part in parts]
