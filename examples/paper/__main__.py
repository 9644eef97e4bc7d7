"""`python -m paper reproduce`: every published number beside the computed one; `python -m paper figures`."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

import stickslip as ss
from stickslip.cli.exits import NEGATIVE, Verbs
from stickslip.cli.options import Number, console
from stickslip.show.progress import progress_bar
from stickslip.show.replaced_file import replace_file

if TYPE_CHECKING:
    from rich.table import Table

    from paper.comparison import Row

#: The masses of the published model with their dofs; a contact mass moves in the axes of its slider.
MASSES = {"m1": ("x1", "x2"), "m2": ("x3", "x4"), "m3": ("x5", "x6"), "m4": ("x7", "x8")}
#: Colours of the verdicts.
STYLES = {"agrees": "green", "erratum": "yellow", "differs": "bold red", "not printed": "dim"}


dpi_option = click.option(
    "--dpi", type=Number(50, 2400), default=300, show_default=True, help="Points per inch of a .png."
)


@click.group(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Compute what was published of the two-subsystem model (folder `examples` on the path of Python).

    \b
    Example:
      PYTHONPATH=examples python -m paper reproduce -o figures
    """


@main.command()
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the figures, and for the comparison as comparison.json; created if missing.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
@dpi_option
def reproduce(out: Path | None, as_json: bool, dpi: int) -> None:
    """Compute every published number of the two-subsystem model and compare.

    A computed value agrees if it differs by less than one unit of the last printed digit. The exit code is 1
    if a value differs and no erratum explains it.

    \b
    Example:
      python -m paper reproduce -o figures
    """
    from paper.comparison import rows

    found = rows()
    differing = sum(row.verdict == "differs" for row in found)
    text = json.dumps([dataclasses.asdict(row) for row in found], indent=1)
    if as_json:
        click.echo(text)
    else:
        out_console = console(width=160)
        out_console.print(comparison_table(found))
        for number, note in enumerate(_notes(found), start=1):
            out_console.print(f"  \\[{number}] {note}")
        counts = ", ".join(f"{sum(row.verdict == verdict for row in found)} {verdict}" for verdict in STYLES)
        out_console.print(f"{len(found)} quantities: {counts}")
    if out is not None:
        written = write_figures(out, dpi)
        replace_file(out / "comparison.json", f"{text}\n".encode())
        for path in [*written, out / "comparison.json"]:
            click.echo(f"wrote {path}", err=True)
    if differing:
        raise SystemExit(NEGATIVE)


def comparison_table(found: list[Row]) -> Table:
    """Return the comparison as one table; notes are referred to by number."""
    from rich.table import Table

    numbers = {note: number for number, note in enumerate(_notes(found), start=1)}
    table = Table(title="Published and computed", title_justify="left")
    for heading in ("source", "quantity"):
        table.add_column(heading)
    for heading in ("published", "computed", "difference"):
        table.add_column(heading, justify="right")
    table.add_column("verdict")
    source = None
    for row in found:
        if source not in (None, row.source):
            table.add_section()
        note = f" \\[{numbers[row.note]}]" if row.note else ""
        table.add_row(
            "" if row.source == source else row.source,
            row.quantity,
            row.published,
            row.computed,
            row.difference,
            f"[{STYLES[row.verdict]}]{row.verdict}[/]{note}",
        )
        source = row.source
    return table


def write_figures(folder: Path, dpi: int) -> list[Path]:
    """Write the figures of the published model, and its unstable mode in motion, and return their paths."""
    import numpy as np
    from matplotlib.figure import Figure

    from paper.comparison import FRICTIONS, attractor, standard_run
    from paper.numbers import published
    from stickslip import plot
    from stickslip.locus.critical import critical_points
    from stickslip.locus.sweep import sweep
    from stickslip.modes.complex_modes import complex_modes
    from stickslip.scene.models import two_subsystems
    from stickslip.show.style import save

    folder.mkdir(parents=True, exist_ok=True)
    run = standard_run()
    settled = published()["limit_cycles"][0]
    cycle, onset = run.limit_cycle(), float(run.events.time[0])
    growing = complex_modes(run.scene)
    leading = int(np.argmax(growing.eigenvalues.real))
    statuses, flow = (Figure(figsize=size, layout="constrained") for size in ((9.0, 2.6), (9.0, 5.0)))
    run.plot.statuses(ax=statuses.subplots())
    cycle.balance().plot.flow(ax=flow.subplots())
    drawn = {
        "mode-shapes.png": complex_modes(two_subsystems(friction=0.0)).plot.shapes(),
        "loci.png": plot(
            sweep(two_subsystems(), {"friction": np.linspace(*FRICTIONS, 301)}),
            critical=critical_points(two_subsystems(), {"friction": FRICTIONS}, kinds=("hopf",)),
        ),
        "mode-orbits.png": growing.plot.orbits(leading, MASSES),
        "history.png": run.plot.history(),
        "phase-plane.png": run.plot.phase_planes(),
        "contact-status.png": statuses,
        "energy.png": run.plot.energy(),
        "energy-cycle.png": cycle.plot.energy(),
        "energy-growth.png": run.plot.energy(begin=onset - 0.03, end=onset + 0.01),
        "energy-flow.png": flow,
        "limit-cycle.png": attractor(settled["friction"], settled["slider_speed"])[1].plot.phase_planes(),
    }
    for name, figure in drawn.items():
        save(figure, folder / name, dpi)
    animation = folder / "mode.gif"
    growing.plot.animate(leading).save(animation, writer="pillow")
    return [*(folder / name for name in drawn), animation]


def _notes(found: list[Row]) -> list[str]:
    return list(dict.fromkeys(row.note for row in found if row.note))


@main.command()
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
      python -m paper figures 3 9 --format svg
    """
    from paper.figures import FIGURES

    out.mkdir(parents=True, exist_ok=True)
    with progress_bar(None) as bar:
        for number in bar.track(numbers or tuple(FIGURES), description="figures"):
            path = out / f"figure-{number:02}.{suffix}"
            ss.save(FIGURES[number](), path, dpi=dpi)
            click.echo(f"wrote {path}: {(FIGURES[number].__doc__ or '').splitlines()[0]}", err=True)


if __name__ == "__main__":
    main(prog_name="paper")
