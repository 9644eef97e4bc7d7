"""What the folder shows when it is asked for by name."""

from . import comparison, figures, numbers
from .section import known

__all__ = ["comparison", "figures", "known", "numbers"]
