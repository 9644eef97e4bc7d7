"""Verbs that write scene files: `stickslip init`, a commented one, and `stickslip reduce`, a reduced one."""

from __future__ import annotations

from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import click

import stickslip as ss
from stickslip.cli.options import loaded, scene_argument, waiting
from stickslip.show.replaced_file import replace_file

if TYPE_CHECKING:
    from stickslip.fe.reduced.model import Boundary

#: Models with a file that explains every line.
EXPLAINED = ("two_subsystems", "oscillator")
#: Those of `stickslip.models` that are written with their numbers.
LISTED = (
    "mass_on_belt",
    "thomsen_fidlin",
    "bistable_oscillator",
    "mass_on_belt_in_plane",
    "den_hartog",
    "lugre_slider",
    "dahl_oscillator",
    "spring_slider",
    "hoffmann",
    "rotating_disc",
    "burridge_knopoff",
    "bowed_string",
)


@click.command()
@click.argument("scene", type=click.Path(dir_okay=False, path_type=Path), default="scene.toml")
@click.option(
    "--model",
    type=click.Choice([*EXPLAINED, *LISTED]),
    default=EXPLAINED[0],
    show_default=True,
    help="The published model by its parameters, one mass on a belt by its matrices (oscillator), or another "
    "model of the library by its parameters.",
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
    if model in EXPLAINED:
        text = files("stickslip.cli").joinpath(f"templates/{model}.toml").read_text(encoding="utf-8")
        replace_file(scene, text.encode())
    else:
        save_model(model, scene)
    click.echo(f"wrote {scene}", err=True)


def save_model(name: str, path: Path) -> None:
    """Write a model of the library with all of its numbers."""
    from stickslip.scene.models import MODELS
    from stickslip.scene.models.naming import defaults

    ss.save(ss.Case(partial(MODELS[name], **defaults(MODELS[name]))), path)


@click.command()
@scene_argument
@click.option(
    "--band", nargs=2, type=float, required=True, metavar="LOW HIGH", help="Frequencies that count, Hz."
)
@click.option(
    "--boundary",
    type=click.Choice(["lumped", "consistent", "massless"]),
    default="lumped",
    show_default=True,
    help="Model of the mass that the modes leave at the contacts.",
)
@click.option(
    "--tolerance",
    type=float,
    default=1e-3,
    show_default=True,
    help="Largest relative error of a frequency.",
)
@click.option(
    "--growth-tolerance",
    type=float,
    default=0.05,
    show_default=True,
    help="Largest relative error of a growth rate.",
)
@click.option("--modes", type=int, help="Number of modes with held contacts; default: as the tolerances ask.")
@click.option(
    "-c", "--combination", help="Combination whose eigenvalues are compared; default: that of steady sliding."
)
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    help="Scene file of the reduced model.",
)
def reduce(
    scene: Path,
    changes: tuple[str, ...],
    band: tuple[float, float],
    boundary: Boundary,
    tolerance: float,
    growth_tolerance: float,
    modes: int | None,
    combination: str | None,
    output: Path,
) -> None:
    """Reduce a large scene to its contacts and its lowest modes.

    \b
    Example:
      stickslip reduce brake.toml --band 0 20e3 --output small.toml
    """
    case = loaded(scene, changes)
    with waiting("reducing the scene"):
        reduced = ss.fe.reduce(
            case.scene,
            band,
            boundary,
            tolerance,
            growth_tolerance=growth_tolerance,
            modes=modes,
            combination=combination,
        )
    ss.save(reduced.scene, output)
    click.echo(str(reduced.summary()))
