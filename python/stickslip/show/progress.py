"""The progress bar of many jobs."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

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

#: A call that takes longer shows what is done, s.
LONG = 3.0
#: Between two looks at what is done, s.
_REFRESHED = 0.1


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


@contextmanager
def watched(
    done: Callable[[], int], total: int, description: str, progress: bool | None, patience: float
) -> Iterator[None]:
    """Show how many jobs of one long call are done: at once if asked, else once it takes long.

    `done` is called from another thread.
    """
    bar = progress_bar(progress)
    task = bar.add_task(description, total=total)
    over = threading.Event()

    def show() -> None:
        if over.wait(0.0 if progress else patience):
            return
        with bar:
            while not over.wait(_REFRESHED):
                bar.update(task, completed=min(done(), total))

    shown = threading.Thread(target=show, daemon=True)
    if not bar.disable:
        shown.start()
    try:
        yield
    finally:
        over.set()
        if shown.ident is not None:
            shown.join()
