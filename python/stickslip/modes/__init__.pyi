"""What the folder shows when it is asked for by name."""

from .comparison import mac, pairing
from .shape import orbit, phase_lag

__all__ = ["mac", "orbit", "pairing", "phase_lag"]
