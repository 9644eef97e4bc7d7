"""What the folder shows when it is asked for by name."""

from . import models

__all__ = ["models"]
