"""`stickslip study`: what a scene does where its parameters are not known."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

import stickslip as ss
from stickslip.cli.options import (
    Answer,
    answer_options,
    loaded,
    method_option,
    named,
    parameter,
    scene_argument,
    start_option,
    started,
    table,
)
from stickslip.show.summary import Table

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console

#: Reasons of failures that are shown.
SHOWN = 5
#: What a parameter is given as.
LAW = "NAME={law=[numbers]} or NAME=[values]"
QUANTILES = (0.05, 0.5, 0.95)


@click.command()
@scene_argument
@click.option(
    "--over",
    multiple=True,
    metavar="NAME=LAW",
    help="Parameter and its distribution, such as 'friction={uniform=[0.3,2.5]}'; default: those of [study].",
)
@click.option("--ask", multiple=True, metavar="OUTPUT", help="Output, such as growth_rate; repeatable.")
@click.option("--samples", type=int, help="Number of samples; default: that of [study].")
@click.option("--seed", type=int, help="Default: that of [study], or 0.")
@click.option("--sampler", help="random, latin_hypercube, sobol, saltelli or morris.")
@click.option("--duration", type=float, help="Duration of each motion, s; default: that of [study] or [run].")
@start_option
@method_option
@click.option(
    "-c",
    "--combination",
    help="Statuses for the modes, a letter of + - s d per contact; default: steady sliding.",
)
@click.option("--threads", type=int, help="Default: one per core.")
@click.option(
    "--store",
    type=click.Path(file_okay=False, path_type=Path),
    help="Zarr store; the same command continues a study that was stopped.",
)
@answer_options
def study(
    scene: Path,
    changes: tuple[str, ...],
    start: tuple[str, ...],
    method: str | None,
    combination: str | None,
    over: tuple[str, ...],
    ask: tuple[str, ...],
    samples: int | None,
    seed: int | None,
    sampler: str | None,
    duration: float | None,
    threads: int | None,
    store: Path | None,
    answer: Answer,
) -> None:
    """Run the scene over distributions of its parameters.

    Parameters and outputs are those of [study] in the file, or of --over and --ask. If the study cannot go on
    or is interrupted, all complete samples are written.

    \b
    Example:
      stickslip study brake.toml --over 'friction={uniform=[0.3,2.5]}' --samples 10000 --plot study.pdf
    """
    case = started(loaded(scene, changes), start, None)
    laws = named("--over", (parameter(text, LAW) for text in over))
    if not laws and "parameters" not in case.study:
        raise click.UsageError(f"{scene} has no [study.parameters]; say --over NAME=LAW")
    made = case.to_study(
        parameters=laws or None,
        outputs=list(ask) or None,
        samples=samples,
        seed=seed,
        sampler=sampler,
        duration=duration,
        method=method,
        combination=combination,
    )

    def give(results: xr.Dataset) -> None:
        answer.give(
            lambda: results, ("sample",), lambda out: _show(out, made, results), lambda: ss.plot(results)
        )

    try:
        results = made.run(store, threads=threads)
    except (ss.StudyError, ss.Interrupted) as error:
        give(error.partial)
        raise
    give(results)


def _show(out: Console, made: ss.Study, results: xr.Dataset) -> None:
    out.print(repr(made), markup=False)
    status = results.status.to_numpy()
    kinds, counts = np.unique(status, return_counts=True)
    out.print(", ".join(f"{count} {kind}" for kind, count in zip(kinds, counts, strict=True)))
    reasons = results.reason.to_numpy()
    for kind in [kind for kind in kinds if kind not in ("ok", "pending")][:SHOWN]:
        first = int(np.argmax(status == kind))
        out.print(f"  {kind}, such as sample {first}: {reasons[first]}", markup=False)
    if {"growth_rate", "eigenvalue", "unstable_modes"} & set(results.data_vars) and made.sampler != "grid":
        found = ss.study.probability(results)
        band = f"{found.lower.item():.4f} to {found.upper.item():.4f} at {found.attrs['confidence']:.0%}"
        line = f"Sliding is unstable with probability {found.probability.item():.4f} ({band})"
        if not found.samples.item():
            line = "Whether sliding is unstable is not known: no sample has a verdict"
        elif found.without_value.item():
            line += f" of {found.samples.item()} samples; {found.without_value.item()} have no verdict"
        out.print(line)
    rows = [
        row
        for column in made.outputs.columns[:-2]
        if column.dtype in ("float64", "int64")
        for row in _rows(results, column.name)
    ]
    headings = ("output", "samples", "mean", "deviation", *(f"{q:.0%}" for q in QUANTILES), "unit")
    out.print(table(Table("Distributions", headings, rows)))


def _rows(results: xr.Dataset, name: str) -> list[tuple[str, ...]]:
    """Return a row for every dof, contact or mode of an output."""
    dims = [dim for dim in results[name].dims if dim != "sample"]
    if not dims:
        return [_row(results, name, {})]
    (dim,) = dims
    entries = results[dim].to_numpy() if dim in results.coords else np.arange(results.sizes[dim])
    return [_row(results, name, {str(dim): entry}) for entry in entries]


def _row(results: xr.Dataset, name: str, labels: dict[str, Any]) -> tuple[str, ...]:
    said = " ".join([name, *map(str, labels.values())])
    units = str(results[name].attrs.get("units", ""))
    column = results[name].sel(labels).to_numpy()
    if not (np.isfinite(column) & (column >= 0 if column.dtype.kind == "i" else True)).any():
        return (said, "0", *[""] * (2 + len(QUANTILES)), units)
    found = ss.study.distribution(results, name, quantiles=QUANTILES, **labels)
    numbers = (found.expectation.item(), found.deviation.item(), *found.value.to_numpy())
    return (said, str(found.samples.item()), *(f"{number:.6g}" for number in numbers), units)
