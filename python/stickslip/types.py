"""What calls return, by name: for annotations and for `isinstance`."""

import lazy_loader

# The names stand in `types.pyi`, relative to the package; each is imported when it is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub("stickslip", __file__)
