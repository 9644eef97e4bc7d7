"""The published two-subsystem model: printed numbers, comparison with computed ones, figures of the paper."""

import lazy_loader

# Figures take matplotlib: each module is loaded when it is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
