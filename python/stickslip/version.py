"""The version of the package, as it was installed, and those of what it stands on."""

from __future__ import annotations

import platform
import re
import sys
from importlib.metadata import PackageNotFoundError, requires, version

__version__ = version("stickslip")


def show_versions() -> None:
    """Print the versions of stickslip, Python, the system and every dependency, for a report of a defect.

    Optional dependencies stand below the extra that installs them; one that is not installed says so.
    """
    print(f"stickslip {__version__}")
    print(f"Python {platform.python_version()}, {sys.implementation.name}")
    print(f"{platform.system()} {platform.release()}, {platform.machine()}")
    extras: dict[str, list[str]] = {}
    for requirement in requires("stickslip") or []:
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        marked = re.search(r"extra == ['\"]([\w-]+)['\"]", requirement)
        extras.setdefault(marked.group(1) if marked else "", []).append(name)
    for extra, names in extras.items():
        print(f"\n{f'extra {extra}' if extra else 'dependencies'}")
        for package in names:
            print(f"  {package} {_installed(package)}")


def _installed(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
