"""What the command line exits with."""

from __future__ import annotations

from typing import Any

import click

from stickslip.errors import InputError, RunError, StoreError, StudyError

DONE = 0
#: Computed, and the answer is no.
NEGATIVE = 1
REFUSED = 2
STOPPED = 3
INTERRUPTED = 130


class Refused(click.ClickException):
    """Ill-posed input."""

    exit_code = REFUSED


class Stopped(click.ClickException):
    """A run that could not go on."""

    exit_code = STOPPED


class Verbs(click.Group):
    """A group whose verbs may raise the errors of the package."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the verb; errors of the package become messages and exit codes."""
        try:
            return super().invoke(ctx)
        except (InputError, StoreError) as error:
            raise Refused(str(error)) from error
        except (RunError, StudyError) as error:
            raise Stopped(str(error)) from error
        except KeyboardInterrupt:
            click.echo("interrupted", err=True)
            ctx.exit(INTERRUPTED)
        except OSError as error:
            if error.filename is None:
                raise
            raise Refused(f"{error.filename}: {error.strerror}") from error
