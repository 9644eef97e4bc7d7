"""Colours, line styles and hatching that every figure shares, and how a figure becomes a file."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

from matplotlib.axes import Axes
from matplotlib.figure import Figure

#: One colour per status, the same in every figure.
COLOURS = {"+": "#4477aa", "-": "#aa3377", "s": "#cc3311", "d": "#ddaa33"}
NAMES = {"+": "positive sliding", "-": "negative sliding", "s": "sticking", "d": "detached"}
#: Line style and hatching of each status.
STYLES = {"+": "-", "-": "-.", "s": ":", "d": "--"}
HATCHES = {"+": "", "-": "\\\\\\\\", "s": "....", "d": "////"}
#: From dark to light, each with a line style of its own.
OVERLAY = (("#222255", "-"), ("#cc3311", "--"), ("#228833", "-."), ("#ddaa33", ":"), ("#77aadd", "-"))
MARKERS = "osD^v<>P"
#: One colour per contact, or per mode; they differ in lightness too, for print without colour.
CONTACT = ("#004488", "#66ccee", "#997700", "#ee99aa")
#: Stable and unstable.
STABLE, UNSTABLE = "#4477aa", "#cc3311"
MICROMETRES = 1e6
#: Points per inch that journals ask for at least.
DPI = 300


def quantity(name: object, units: str = "1") -> str:
    """Return the name of a quantity as figures write it, with its unit."""
    words = "friction coefficient" if name == "friction" else str(name).replace("_", " ")
    return words if units in ("", "1") else f"{words}, {units}"


def save(figure: Figure, path: str | Path | BinaryIO, dpi: int = DPI, form: str | None = None) -> None:
    """Write a figure in the form that the suffix of the path names; the same figure gives the same bytes.

    Parameters
    ----------
    figure
        The figure.
    path
        The file, or what takes its bytes.
    dpi
        Points per inch of a `.png`, and of what is drawn as points in other forms.
    form
        ``png``, ``pdf``, ``svg``, ``eps``; None: by the suffix.
    """
    import matplotlib

    # What would tell when and by which version a file was made.
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    kind = Path(path).suffix[1:] if form is None and isinstance(path, str | Path) else form
    with matplotlib.rc_context({"svg.hashsalt": "stickslip", "pdf.fonttype": 42}):
        figure.savefig(path, dpi=dpi, format=kind or None, metadata=metadata.get(kind or ""))


def axes_of(ax: Axes | None) -> Axes:
    """Return the axes to draw on: those given, or new ones that a notebook shows."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    _, made = plt.subplots(layout="constrained")
    return made
