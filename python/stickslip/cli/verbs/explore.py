"""`stickslip explore`: a page on which parameters are dragged; `stickslip listen`: the motion as sound."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import click

import stickslip as ss
from stickslip.cli.exits import INTERRUPTED
from stickslip.cli.options import Number, band_option, changed, loaded, motion_options, scene_argument
from stickslip.show.replaced_file import replace_file


@click.command()
@partial(scene_argument, required=False)
@click.option(
    "--port",
    type=Number(0, 65535),
    default=0,
    show_default=True,
    help="Port of the page; 0: any free port.",
)
@click.option("--no-browser", is_flag=True, help="Print the address, but open no window.")
@band_option
def explore(
    scene: Path | None,
    changes: tuple[str, ...],
    port: int,
    no_browser: bool,
    band: tuple[float, float] | None,
) -> None:
    """Show a scene on a page on which its parameters are dragged and the motion follows.

    Without a file the page shows the published model. The page is served on 127.0.0.1 alone and needs no
    network; Ctrl-C ends it.

    \b
    Example:
      stickslip explore brake.toml
    """
    if scene is None:
        case, title = changed(ss.Case(ss.models.two_subsystems), changes), "two_subsystems"
    else:
        case, title = loaded(scene, changes), scene.stem
    try:
        page = ss.explore(case, port=port, open_browser=not no_browser, title=title, band=band)
    except OSError as error:
        raise OSError(error.errno, error.strerror, f"port {port}") from error
    click.echo(f"{page.url}  (Ctrl-C ends it)")
    try:
        page.wait()
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None


@click.command()
@motion_options
@click.option("--contact", default="0", show_default=True, help="Name or index of the contact.")
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    required=True,
    help="Sound file, .wav.",
)
def listen(case: ss.Case, settings: dict[str, Any], contact: str, out: Path) -> None:
    """Write the tangential velocity of a contact as sound, from the start on, at its own speed.

    \b
    Example:
      stickslip listen brake.toml --duration 3 -o squeal.wav
    """
    from stickslip.explorer import sound

    if out.suffix != ".wav":
        raise click.BadParameter(f"expected a file .wav, got {str(out)!r}", param_hint="-o / --output")
    run = case.simulate(**settings)
    replace_file(out, sound(run, contact))
    click.echo(f"wrote {out}: {run.duration:g} s of contact {contact}")
