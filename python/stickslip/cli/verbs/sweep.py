"""`stickslip sweep`: eigenvalues over one or two parameters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

import stickslip as ss
from stickslip.cli.options import (
    Answer,
    Number,
    answer_options,
    combination_option,
    loaded,
    named,
    parameter,
    scene_argument,
    table,
)
from stickslip.show.summary import Table

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console

#: What an axis is given as.
RANGE = "NAME=FROM:TO:COUNT or NAME=[values]"


@click.command()
@scene_argument
@click.option(
    "--over",
    multiple=True,
    metavar="NAME=FROM:TO:COUNT",
    help="Parameter and its values; once or twice; default: [sweep] of the file.",
)
@combination_option
@click.option(
    "--modes",
    type=Number(min=1),
    metavar="COUNT",
    help="Follow only so many modes, those with the largest real parts; default: all.",
)
@answer_options
def sweep(
    scene: Path,
    changes: tuple[str, ...],
    over: tuple[str, ...],
    combination: str | None,
    modes: int | None,
    answer: Answer,
) -> None:
    """Follow eigenvalues over one or two parameters, and find where stability changes.

    \b
    Example:
      stickslip sweep brake.toml --over friction=0:3:301 --plot loci.pdf -o loci.nc
    """
    case = loaded(scene, changes)
    values: dict[str, Any] = named("--over", map(_values, over)) if over else {**case.values()}
    if not values:
        raise click.UsageError(f"{scene} has no [sweep]; say --over NAME=FROM:TO:COUNT")
    if answer.plot is not None and len(values) == 2 and min(map(len, values.values())) < 2:
        raise click.UsageError("--plot needs at least two values of each of two parameters")
    if modes is not None and len(values) == 2:
        raise click.UsageError("--modes follows modes over one parameter, not over two")
    branches = ss.sweep(case.model, values, combination=combination, modes=modes, marginal=True)
    answer.give(
        lambda: branches.assign_attrs(meetings=branches.attrs["meetings"].tolist()),
        (*values, "branch"),
        lambda out: _show(out, case, combination, values, branches, modes),
        lambda: ss.plot(branches),
    )


def _values(text: str) -> tuple[str, Any]:
    from stickslip.files.scene_file import parameter_values

    name, _, value = text.partition("=")
    parts = value.split(":")
    if len(parts) != 3:
        name, entries = parameter(text, RANGE)
        if not isinstance(entries, list):
            raise click.BadParameter(f"expected {RANGE}, got {text!r}")
        return name, parameter_values(name, entries)
    try:
        limits: dict[str, Any] = {"from": float(parts[0]), "to": float(parts[1]), "count": int(parts[2])}
    except ValueError:
        raise click.BadParameter(f"expected {RANGE}, got {text!r}") from None
    if not np.isfinite([limits["from"], limits["to"]]).all():
        raise click.BadParameter(f"FROM and TO must be finite, got {text!r}")
    return name, parameter_values(name, limits)


def _show(
    out: Console,
    case: ss.Case,
    combination: str | None,
    values: dict[str, Any],
    branches: xr.Dataset,
    modes: int | None,
) -> None:
    stable, exists = branches.stable.to_numpy(), branches.steady_sliding.to_numpy()
    if combination is not None:
        # Whoever names the statuses asks for their modes, whether or not the load keeps them.
        exists = np.ones_like(exists)
    marginal = branches.marginal.to_numpy()
    counts = f"{int((stable & exists & ~marginal).sum())} stable, {int((~stable & exists).sum())} unstable"
    if marginal.any():
        counts += f", {int(marginal.sum())} marginal (a mode neither grows nor decays)"
    if not exists.all():
        counts += f", {int((~exists).sum())} without steady sliding (a contact would pull)"
    out.print(f"{stable.size} scenes over {' and '.join(values)}: {counts}")
    if len(values) != 1:
        return
    ((name, axis),) = values.items()
    if modes is not None:
        # A search for critical points would follow all modes.
        out.print(
            table(Table("Changes of stability", ("between", "and", ""), _changes(np.asarray(axis), stable)))
        )
        return
    limits: dict[str, Any] = {name: (float(np.min(axis)), float(np.max(axis)))}
    points = ss.critical_points(case.model, limits, combination=combination)
    out.print(table(points.summary().tables[0]))


def _changes(axis: Any, stable: Any) -> list[tuple[str, ...]]:
    """Return the neighbouring values between which stability is lost or gained."""
    order = np.argsort(axis)
    ascending, verdicts = axis[order], stable[order]
    changed = np.flatnonzero(verdicts[1:] != verdicts[:-1])
    return [
        (f"{ascending[k]:.6g}", f"{ascending[k + 1]:.6g}", "lost" if verdicts[k] else "gained")
        for k in changed
    ]
