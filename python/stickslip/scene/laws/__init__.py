"""Laws of friction, and of springs and dampers."""

from stickslip.scene.laws import friction, spring

__all__ = ["friction", "spring"]
