"""Complex modes of one status combination: eigenvalues, shapes, powers, comparisons, tables over statuses."""

import lazy_loader

# What users name; each is imported when it is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
