"""`stickslip report`: everything about a scene on one page."""

from __future__ import annotations

import os
import shlex
import time
from pathlib import Path

import click

from stickslip.cli.options import band_option, loaded, scene_argument, waiting


@click.command(epilog="\b\nExample:\n  stickslip report scene.toml -o report.html")
@scene_argument
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    help="The page; by default beside the scene file, with the suffix .html.",
)
@click.option("--title", help="Name of the scene on the page; by default the name of its file.")
@click.option("--duration", type=float, help="Duration of the motion, s; by default that of the file.")
@band_option
def report(
    scene: Path,
    changes: tuple[str, ...],
    out: Path | None,
    title: str | None,
    duration: float | None,
    band: tuple[float, float] | None,
) -> None:
    """Write one HTML page about the scene of a scene file.

    The page needs no network and can be printed. It shows the scene, steady sliding, complex modes in
    motion, eigenvalues over the parameter of [sweep] or friction, the transient, the limit cycle, spectrum
    and energy; if [sweep] has two parameters, also the curves over both on which stability ends. The last
    section holds date, command and scene file; the date
    is that of SOURCE_DATE_EPOCH, if it is set.
    """
    from stickslip.faults import InputError
    from stickslip.report import write_report
    from stickslip.report.page import verdict
    from stickslip.scene.known import known_of

    path = scene.with_suffix(".html") if out is None else out
    if not path.parent.is_dir():
        raise click.BadParameter(f"no such folder: {path.parent}", param_hint="-o / --output")
    case = loaded(scene, changes)
    settings = dict(case.run) if duration is None else {**case.run, "duration": duration}
    try:
        start = case.initial_state() if case.start else None
    except InputError:
        # Without steady sliding nothing can be disturbed: the page says so and shows the rest.
        start = None
    over = case.values()
    if len(over) > 2:
        click.echo(f"[sweep] has {len(over)} parameters: the report follows friction instead", err=True)
        over = {}
    words = ["stickslip", "report", str(scene), *(part for text in changes for part in ("--set", text))]
    for option, value in (("--output", out), ("--title", title), ("--duration", duration)):
        words += [] if value is None else [option, str(value)]
    words += [] if band is None else ["--band", *map(str, band)]
    with waiting("reading the scene") as status:
        found = write_report(
            case.scene,
            path,
            title=scene.stem if title is None else title,
            start=start,
            settings=settings,
            model=case.model,
            parameters=over,
            band=band,
            known=known_of(case.scene),
            origin={"date": _date(), "command": shlex.join(words)},
            source=scene.read_text(encoding="utf-8"),
            told=status.update,
        )
    click.echo(verdict(found))
    click.echo(f"wrote {path}")


def _date() -> str:
    """Return the date, or the one that reproducible-builds.org has a build use instead."""
    told = os.environ.get("SOURCE_DATE_EPOCH")
    try:
        seconds = time.time() if told is None else int(told)
        return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(seconds))
    except (ValueError, OverflowError, OSError):
        raise click.UsageError(f"SOURCE_DATE_EPOCH: expected seconds since 1970, got {told!r}") from None
