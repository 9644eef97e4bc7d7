"""Friction-induced vibration: complex modes, stick-slip transients and their limit cycles.

A `Scene` holds the model; `complex_modes` says whether steady sliding is stable, `simulate` what happens when
it is not. SI units throughout.
"""

import lazy_loader

# The public names stand in `__init__.pyi`; each is imported when it is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
