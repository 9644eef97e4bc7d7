"""`stickslip figures`: the figures of the paper."""

from __future__ import annotations

from pathlib import Path

import click

from stickslip.cli.options import Number, dpi_option, save_figure
from stickslip.show.progress import tracked


@click.command()
@click.argument("numbers", nargs=-1, type=Number(2, 15))
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(file_okay=False, path_type=Path),
    default="figures",
    show_default=True,
    help="Folder; created if missing.",
)
@click.option(
    "--format", "suffix", type=click.Choice(["pdf", "svg", "eps", "png"]), default="pdf", show_default=True
)
@dpi_option
def figures(numbers: tuple[int, ...], out: Path, suffix: str, dpi: int) -> None:
    """Draw figures of the paper, 2 to 15, computed anew; without numbers all of them.

    They are as wide as a column of a journal, 85 mm, with letters of at least 6 points.

    \b
    Example:
      stickslip figures 3 9 --format svg
    """
    from stickslip.reference.figures import FIGURES

    out.mkdir(parents=True, exist_ok=True)
    for number in tracked(numbers or tuple(FIGURES), "figures"):
        path = out / f"figure-{number:02}.{suffix}"
        save_figure(FIGURES[number](), path, dpi)
        click.echo(f"wrote {path}: {(FIGURES[number].__doc__ or '').splitlines()[0]}", err=True)
