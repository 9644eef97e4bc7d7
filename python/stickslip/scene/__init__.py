"""The model as a value: scenes, contacts, states, the models of the library, and the checks of all input."""

import lazy_loader

# `stickslip.models` is a module that users name; it is loaded when it is first used, as every other.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
