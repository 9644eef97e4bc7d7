"""A file that appears when it is complete: it is written under another name first and then renamed."""

from __future__ import annotations

import os
import shutil
import stat
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


def replace_file(
    path: str | os.PathLike[str], content: bytes | memoryview | Callable[[Path], object]
) -> None:
    """Write a file under another name and rename it; its mode stays. Devices and pipes are written to.

    `content` is what the file holds, or a function that writes the file of a path.
    """
    try:
        _replace(Path(os.path.realpath(path)), content)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), os.fspath(path)) from error


def _replace(file: Path, content: bytes | memoryview | Callable[[Path], object]) -> None:
    write = content if callable(content) else lambda draft: draft.write_bytes(content)
    if file.exists() and not file.is_file():
        write(file)
        return
    with draft_of(file) as draft:
        if file.exists():
            # Before the content is there, others may read no more of it than of the file.
            draft.touch()
            draft.chmod(file.stat().st_mode | stat.S_IWUSR)
        write(draft)
        if file.exists():
            shutil.copymode(file, draft)
        draft.replace(file)


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """Give a name beside a path; what is there at the end is removed."""
    draft = path.with_name(f"{path.name}.{uuid.uuid4().hex}.partial")
    try:
        yield draft
    finally:
        if draft.is_dir():
            shutil.rmtree(draft, ignore_errors=True)
        else:
            draft.unlink(missing_ok=True)
