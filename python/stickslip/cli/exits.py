"""What the command line exits with, and how it ends where its output cannot be written."""

from __future__ import annotations

import codecs
import os
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import click

from stickslip.faults import InputError, OrbitError, StudyError
from stickslip.motion.errors import RunError

DONE = 0
#: Computed, and the answer is no.
NEGATIVE = 1
REFUSED = 2
#: Without an answer: a run could not go on, or was followed too short to tell.
STOPPED = 3
FAULT = 4
INTERRUPTED = 130

#: What stands for a letter that the encoding of the output does not have.
FALLBACKS = {"∠": "at", "→": "->", "←": "<-", "°": " deg", "µ": "u", "π": "pi", "±": "+-", "…": "..."}


class Ended(click.ClickException):
    """The end of a command by a message and an exit code."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code  # type: ignore[misc]

    def show(self, file: Any = None) -> None:
        """Write the message, unless standard error is what cannot be written."""
        with suppress(OSError):
            super().show(file)


class Verbs(click.Group):
    """A group whose verbs may raise the errors of the package."""

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """Read the arguments; this is where help is printed."""
        with _ended():
            _encode_everything()
            return super().make_context(*args, **kwargs)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the verb; errors of the package become messages and exit codes."""
        with _ended(), warnings.catch_warnings():
            warnings.showwarning = _show_warning
            try:
                return super().invoke(ctx)
            finally:
                # What cannot be written shows here, and not when the interpreter ends.
                if sys.stdout is not None:
                    sys.stdout.flush()


@contextmanager
def _ended() -> Iterator[None]:
    """Turn what ends a command into a message and an exit code."""
    try:
        yield
    except InputError as error:
        raise Ended(str(error), REFUSED) from error
    except (RunError, StudyError, OrbitError) as error:
        raise Ended(str(error), STOPPED) from error
    except KeyboardInterrupt:
        click.echo("interrupted", err=True)
        raise click.exceptions.Exit(INTERRUPTED) from None
    except OSError as error:
        if error.filename is not None:
            raise Ended(f"{error.filename}: {error.strerror}", REFUSED) from error
        _discard_output()
        if isinstance(error, BrokenPipeError):
            # Whoever reads, such as `head`, has what it wanted.
            raise click.exceptions.Exit(REFUSED) from None
        raise Ended(f"cannot write: {error.strerror or error}", REFUSED) from error
    except (click.ClickException, click.exceptions.Exit, click.Abort):
        raise
    except Exception as error:
        traceback.print_exc()
        message = "this is a defect of stickslip; please report it with what stands above"
        raise Ended(message, FAULT) from error


def _discard_output() -> None:
    """Let go what is left of standard output, which the interpreter would try to write once more."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _show_warning(message: Warning | str, *_where: Any, **_more: Any) -> None:
    click.echo(f"warning: {message}", err=True)


def _encode_everything() -> None:
    """Let output that is no UTF-8, such as a file on Windows, have other letters where it has none."""
    codecs.register_error("stickslip", _fallback)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="stickslip")


def _fallback(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letter = error.object[error.start]
    if letter in FALLBACKS:
        return FALLBACKS[letter], error.start + 1
    return codecs.backslashreplace_errors(
        UnicodeEncodeError(error.encoding, error.object, error.start, error.start + 1, error.reason)
    )
