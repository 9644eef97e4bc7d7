"""`stickslip report`: everything about a scene on one page."""

from __future__ import annotations

from pathlib import Path

import click

from stickslip.cli.options import waiting


@click.command(epilog="\b\nExample:\n  stickslip report scene.toml -o report.html")
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    help="The page; by default beside the scene file, with the suffix .html.",
)
@click.option("--title", help="What to call the scene; by default the name of its file.")
@click.option("--duration", type=float, help="Of the motion, s; by default that of the file.")
def report(file: Path, out: Path | None, title: str | None, duration: float | None) -> None:
    """Write one HTML page about a scene: FILE is a scene file.

    The page needs no network and prints: scene, steady sliding, complex modes in motion, eigenvalues over
    the parameter of [sweep] or friction, transient, limit cycle, spectrum, energy. For the published
    two-subsystem model at published parameters also every published number and figure beside the
    computed one.
    """
    from stickslip.errors import InputError
    from stickslip.files.case import load_case
    from stickslip.reference.section import known
    from stickslip.report import write_report
    from stickslip.report.page import verdict

    path = file.with_suffix(".html") if out is None else out
    if not path.parent.is_dir():
        raise click.BadParameter(f"no such folder: {path.parent}", param_hint="-o / --output")
    case = load_case(file)
    settings = dict(case.run) if duration is None else {**case.run, "duration": duration}
    try:
        start = case.initial_state() if case.start else None
    except InputError:
        # Without steady sliding nothing can be disturbed: the page says so and shows the rest.
        start = None
    over = case.values()
    if len(over) > 1:
        click.echo(f"[sweep] has {len(over)} parameters: the report follows friction instead", err=True)
        over = {}
    with waiting("reading the scene") as status:
        found = write_report(
            case.scene,
            path,
            title=file.stem if title is None else title,
            start=start,
            settings=settings,
            model=case.model,
            over=over,
            known=known(case.scene),
            told=status.update,
        )
    click.echo(verdict(found))
    click.echo(f"wrote {path}")
