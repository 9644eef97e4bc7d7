"""Options of several verbs: the scene and its changes, and where the answer goes."""

from __future__ import annotations

import dataclasses
import errno
import os
import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import wraps
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

import stickslip as ss
from stickslip.scene.checks import described
from stickslip.show.summary import cell

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from rich.console import Console, RenderableType

    from stickslip.show.summary import Summary, Table

#: What a start and a range are given as.
RANGE = "NAME=FROM:TO"
START = "position.DOF=METRES or velocity.DOF=METRES_PER_SECOND"

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])


changes_option = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="NAME=VALUE",
    help="Change a parameter, such as friction=2.2 or 'friction=[1.5,1.2]'; repeatable.",
)
combination_option = click.option(
    "-c", "--combination", help="One letter of + - s d per contact; default: that of steady sliding."
)
band_option = click.option(
    "--band",
    nargs=2,
    type=float,
    metavar="LOW HIGH",
    help="Frequencies of the modes that count, Hz, as of a large mesh; default: all modes.",
)


def scene_argument(verb: F, required: bool = True) -> F:
    """Give a verb the scene file and the changes of its parameters."""
    kind = click.Path(exists=True, dir_okay=False, path_type=Path)
    return click.argument("scene", type=kind, required=required)(changes_option(verb))


def loaded(path: Path, changes: Sequence[str]) -> ss.Case:
    """Return the case of a scene file with its changes."""
    return changed(ss.load(path), changes)


def changed(case: ss.Case, changes: Sequence[str]) -> ss.Case:
    """Return a case with changes of its parameters."""
    return case.replace(**named("--set", map(parameter, changes))) if changes else case


def started(case: ss.Case, start: Sequence[str], combination: str | None) -> ss.Case:
    """Return the case with the start that `--start` and `--combination` say, if they say one."""
    if not start and combination is None:
        return case
    told: dict[str, Any] = {} if combination is None else {"combination": combination}
    amounts = named("--start", (parameter(text, START) for text in start))
    for name, amount in amounts.items():
        quantity, _, dof = name.partition(".")
        if quantity not in ("position", "velocity") or not dof:
            raise click.BadParameter(f"expected {START}, got {name!r}")
        told.setdefault(quantity, {})[dof] = amount
    return dataclasses.replace(case, start=told)


start_option = click.option(
    "--start",
    multiple=True,
    metavar="QUANTITY.DOF=VALUE",
    help="Amount added to sliding equilibrium in place of [start], such as velocity.x1=1e-3, m or m/s; "
    "repeatable.",
)
time_limit_option = click.option("--time-limit", type=float, help="Stop after so many seconds of computing.")
method_option = click.option(
    "--method",
    type=click.Choice(["auto", "modal", "taylor", "local"]),
    help="Method of computing motions; default: that of [run], or auto.",
)


def motion_options(verb: F) -> Callable[..., None]:
    """Give a verb the scene file with its changes and the options of a run; it gets the case and settings."""

    @wraps(verb)
    def told(
        scene: Path,
        changes: Sequence[str],
        start: Sequence[str],
        combination: str | None,
        method: str | None,
        duration: float | None,
        **others: Any,
    ) -> None:
        case = started(loaded(scene, changes), start, combination)
        if duration is None and "duration" not in case.run:
            raise click.UsageError(f"{scene} has no duration in [run]; say --duration SECONDS")
        verb(case=case, settings={"duration": duration, "method": method}, **others)

    of_start = click.option(
        "-c",
        "--combination",
        help="Statuses at the start, one letter of + - s d per contact; --start is then the state itself.",
    )
    length = click.option("--duration", type=float, help="Duration of the run, s; default: that of [run].")
    return scene_argument(start_option(of_start(method_option(length(told)))))


def steadily_sliding(case: ss.Case) -> bool:
    """Return whether a run of the case begins in exact steady sliding and stays there, stable or not."""
    vibrates = any(contact.slider_vibration is not None for contact in case.scene.contacts)
    return not (case.start or case.scene.loads or vibrates)


def named(option: str, pairs: Iterable[tuple[str, T]]) -> dict[str, T]:
    """Return values by name."""
    found: dict[str, T] = {}
    for name, value in pairs:
        if name in found:
            raise click.UsageError(f"{option}: {name} is given twice")
        found[name] = value
    return found


def ranges_of(over: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return the ranges of the two parameters that `--over` gives."""

    def interval(text: str) -> tuple[str, tuple[float, float]]:
        name, _, value = text.partition("=")
        try:
            lower, upper = map(float, value.split(":"))
        except ValueError:
            raise click.BadParameter(f"expected {RANGE}, got {text!r}") from None
        return name.strip(), (lower, upper)

    ranges = named("--over", map(interval, over))
    if len(ranges) != 2:
        raise click.UsageError(f"--over: expected two parameters, got {len(ranges)}")
    return ranges


def parameter(text: str, expected: str = "NAME=VALUE with a number or [numbers]") -> tuple[str, Any]:
    """Return name and value of ``name=value``; the value is as in a scene file."""
    name, _, value = text.partition("=")
    try:
        return name.strip(), tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError):
        raise click.BadParameter(f"expected {expected}, got {described(text)}") from None


class Number(click.IntRange):
    """A whole number, called so in messages."""

    name = "integer"


@dataclass(frozen=True)
class Answer:
    """Where the answer of a verb goes."""

    json: bool
    csv: bool
    file: Path | None
    plot: Path | None
    dpi: int

    def give(
        self,
        dataset: Callable[[], xr.Dataset],
        rows: Sequence[str],
        shown: Callable[[Console], None],
        figure: Callable[[], Figure | Axes] | None,
    ) -> None:
        """Print or write what was asked for; each form is made only then.

        `dataset` is the answer for machines, with the dimensions `rows` of a CSV table; `shown` prints it for
        people; without `figure` there is none to draw.
        """
        from stickslip.files.dataset_file import write_dataset
        from stickslip.files.dataset_text import csv_text, json_text

        if self.json:
            click.echo(json_text(dataset()), nl=False)
        elif self.csv:
            click.echo(csv_text(dataset(), rows), nl=False)
        else:
            shown(console())
        if self.file is not None:
            write_dataset(dataset(), self.file, rows)
            click.echo(f"wrote {self.file}", err=True)
        if self.plot is not None and figure is not None:
            ss.save(figure(), self.plot, dpi=self.dpi)
            click.echo(f"wrote {self.plot}", err=True)

    def is_rows(self) -> bool:
        """Return whether a CSV table is printed or written."""
        return self.csv or (self.file is not None and self.file.suffix == ".csv")


def answer_options(verb: Callable[..., None]) -> Callable[..., None]:
    """Give a verb `--json`, `--csv`, `-o`, `--plot` and `--dpi`; it gets an `Answer` for them."""

    # The options that click keeps on the verb go along.
    @wraps(verb)
    def told(json: bool, csv: bool, file: Path | None, plot: Path | None, dpi: int, **others: Any) -> None:
        if json and csv:
            raise click.UsageError("--json and --csv exclude each other")
        verb(answer=Answer(json, csv, file, plot, dpi), **others)

    target = click.Path(dir_okay=False, writable=True, path_type=Path)
    data, figure = _file_of(".nc", ".csv"), _file_of(".pdf", ".svg", ".eps", ".png")
    options = (
        click.option("--json", is_flag=True, help="Print JSON instead of a table."),
        click.option("--csv", is_flag=True, help="Print CSV instead of a table."),
        click.option("-o", "--output", "file", type=target, callback=data, help="Write .nc or .csv."),
        click.option("--plot", type=target, callback=figure, help="Draw to .pdf, .svg, .eps or .png."),
        click.option(
            "--dpi", type=Number(50, 2400), default=300, show_default=True, help="Points per inch of a .png."
        ),
    )
    for option in reversed(options):
        told = option(told)
    return told


def console(width: int = 140) -> Console:
    """Return where tables go: as wide as the terminal, or `width` letters into a file or pipe."""
    from rich.console import Console

    class Page(Console):
        def on_broken_pipe(self) -> None:
            # Rich would exit with 1, which says that the answer is no.
            raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))

    found = Page(highlight=False)
    return found if found.is_terminal else Page(width=width, highlight=False)


def waiting(message: str) -> Any:
    """Return a context in which a terminal shows that work goes on."""
    from rich.console import Console

    return Console(stderr=True).status(message)


def show(out: Console, summary: Summary) -> None:
    """Print the facts and the tables of a result."""
    width = max((len(name) for name, _ in summary.facts), default=0)
    for name, value in summary.facts:
        out.print(f"{name:<{width}}  {value}", markup=False)
    for one in summary.tables:
        out.print(table(one))


def table(shown: Table) -> RenderableType:
    """Return a table; every column but the first is aligned to the right; one without rows says so.

    Rows of a kind of their own, such as unstable modes, are red.
    """
    import rich.table
    from rich.text import Text

    if not shown.rows:
        return Text(f"{shown.caption}: none")
    made = rich.table.Table(title=Text(shown.caption), title_justify="left", title_style="bold")
    for column, heading in enumerate(shown.headings):
        made.add_column(heading, justify="right" if column else "left")
    for row, kind in zip_longest(shown.rows, shown.kinds):
        made.add_row(*map(Text, map(cell, row)), style="red" if kind else None)
    return made


def _file_of(*suffixes: str) -> Callable[[click.Context, click.Parameter, Path | None], Path | None]:
    """Return a callback that refuses a file of another suffix, or in no folder."""

    def checked(_ctx: click.Context, _option: click.Parameter, path: Path | None) -> Path | None:
        if path is not None and path.suffix not in suffixes:
            raise click.BadParameter(f"expected a file {', '.join(suffixes)}, got {str(path)!r}")
        if path is not None and not path.parent.is_dir():
            raise click.BadParameter(f"no such folder: {path.parent}")
        return path

    return checked
