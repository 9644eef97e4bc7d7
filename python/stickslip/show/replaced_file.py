"""A file that appears when it is complete: it is written under another name first and then renamed."""

from __future__ import annotations

import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def replace_file(path: str | os.PathLike[str], content: bytes | memoryview) -> None:
    """Write a file under another name and rename it; its mode stays. Devices and pipes are written to.

    Raises
    ------
    OSError
        If the file cannot be written; its `filename` is the path.
    """
    try:
        _replace(Path(os.path.realpath(path)), content)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), os.fspath(path)) from error


def _replace(file: Path, content: bytes | memoryview) -> None:
    if file.exists() and not file.is_file():
        file.write_bytes(content)
        return
    with draft_of(file) as draft:
        with draft.open("wb") as handle:
            if file.exists():
                # Before the content is there, and while a file that nobody may write to can be written.
                shutil.copymode(file, draft)
            handle.write(content)
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
