"""The explorer: a page on this machine on which parameters are dragged and the motion follows."""

from stickslip.explorer.running import Explorer, explore
from stickslip.explorer.sound import sound

__all__ = ["Explorer", "explore", "sound"]
