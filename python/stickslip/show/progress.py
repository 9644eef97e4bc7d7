"""The progress bar of many jobs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

T = TypeVar("T")


class Rate(ProgressColumn):
    """Jobs per second."""

    def render(self, task: Any) -> Text:
        """Return the rate of a task, blank until it is known."""
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:,.0f}/s")


def progress_bar(progress: bool | None, *columns: ProgressColumn) -> Progress:
    """Return a bar on standard error: jobs done, `columns`, time left; None: on a terminal."""
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        *columns,
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not (console.is_terminal if progress is None else progress),
    )


def tracked(jobs: Sequence[T], description: str, progress: bool | None = None) -> Iterator[T]:
    """Go through jobs with a bar on standard error while that lasts; None: on a terminal."""
    with progress_bar(progress) as bar:
        yield from bar.track(jobs, description=description)
