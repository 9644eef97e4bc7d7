"""`stickslip init`: a commented scene file."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import click

MODELS = ("two_subsystems", "oscillator")


@click.command()
@click.argument("scene", type=click.Path(dir_okay=False, path_type=Path), default="scene.toml")
@click.option(
    "--model",
    type=click.Choice(MODELS),
    default=MODELS[0],
    show_default=True,
    help="The published model by its parameters, or one mass on a belt by its matrices.",
)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def init(scene: Path, model: str, force: bool) -> None:
    """Write a commented scene file to start from.

    \b
    Example:
      stickslip init brake.toml && stickslip modes brake.toml
    """
    if scene.exists() and not force:
        raise click.UsageError(f"{scene} exists; --force replaces it")
    text = files("stickslip.cli").joinpath(f"templates/{model}.toml").read_text(encoding="utf-8")
    scene.write_text(text, encoding="utf-8")
    click.echo(f"wrote {scene}", err=True)
