"""Friction-induced vibration: complex modes, stick-slip transients and their limit cycles.

A `Scene` holds the model; `complex_modes` says whether steady sliding is stable, `simulate` what happens when
it is not. SI units throughout.
"""

# The public names stand in `__init__.pyi`, for type checkers and for this file: each is imported when it is
# first used (PEP 562), so that importing the package takes no time.

import ast
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

#: Public name to the module it comes from; public modules come from the package.
_SOURCES = {
    alias.name: node.module
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}


class _Package(ModuleType):
    def __getattr__(self, name: str) -> Any:
        source = _SOURCES.get(name)
        if name == "__version__":
            from importlib.metadata import version

            value: Any = version(__name__)
        elif name == "__all__":
            value = sorted([*_SOURCES, "__version__"])
        elif source is None:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=self)
        elif source == __name__:
            value = import_module(f"{__name__}.{name}")
        else:
            value = getattr(import_module(source), name)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        # Importing a module binds it to its package; `stickslip.locus.sweep` has to stay the function.
        if not (isinstance(value, ModuleType) and name in _SOURCES):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return [*self.__all__, *super().__dir__()]


sys.modules[__name__].__class__ = _Package
