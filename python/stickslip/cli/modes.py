"""`stickslip modes`: complex modes of a status combination."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

import stickslip as ss
from stickslip.cli.options import Answer, answer_options, loaded, scene_argument, table

if TYPE_CHECKING:
    from rich.console import Console


@click.command()
@scene_argument
@click.option(
    "-c", "--combination", help="One letter of + - s d per contact; default: that of steady sliding."
)
@click.option("--all", "every", is_flag=True, help="All status combinations: frequencies and stability.")
@answer_options
def modes(
    scene: Path, changes: tuple[str, ...], combination: str | None, every: bool, answer: Answer
) -> None:
    """Compute the complex modes of steady sliding, or of any status combination.

    \b
    Example:
      stickslip modes brake.toml --set friction=2.2 -c +s --plot shapes.pdf
    """
    case = loaded(scene, changes)
    if every:
        if combination is not None or answer.plot is not None:
            raise click.UsageError("--all goes with neither --combination nor --plot")
        statuses = ss.status_table(case.scene)
        answer.give(
            lambda: statuses.data,
            ("combination", "mode"),
            lambda out: out.print(repr(statuses), markup=False),
            None,
        )
        return
    found = ss.complex_modes(case.scene, combination)
    from stickslip.mode_figures import shapes

    answer.give(found.dataset, ("mode",), lambda out: _show(out, found), lambda: shapes(found))


def _show(out: Console, found: ss.Modes) -> None:
    rows = [
        (
            f"{hertz:.4f}",
            f"{ratio:+.6f}",
            f"{value.real:+.4f}",
            ("[bold red]unstable[/]" if value.real > 0.0 else "stable")
            + (", real" if value.imag == 0.0 else ""),
        )
        for value, hertz, ratio in zip(
            found.eigenvalues, found.frequencies, found.damping_ratios, strict=True
        )
        if value.imag >= 0.0
    ]
    headings = ("frequency, Hz", "damping ratio", "real part, 1/s", "")
    out.print(table(f"Modes of status {found.combination}", headings, rows))
