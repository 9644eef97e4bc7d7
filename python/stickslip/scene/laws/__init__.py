"""Laws of friction."""

from stickslip.scene.laws import friction

__all__ = ["friction"]
