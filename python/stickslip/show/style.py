"""Colours, line styles and hatching that every figure shares, and how a figure becomes a file."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import Formatter, FuncFormatter

from stickslip.show.plots import figure_of
from stickslip.show.replaced_file import replace_file
from stickslip.show.units import ENERGIES, LENGTHS, suited

#: One colour per status, the same in every figure.
COLOURS = {"+": "#4477aa", "-": "#aa3377", "s": "#cc3311", "d": "#ddaa33", "o": "#228833"}
NAMES = {
    "+": "positive sliding",
    "-": "negative sliding",
    "s": "sticking",
    "d": "detached",
    "o": "slip in a plane",
}
#: Line style and hatching of each status.
STYLES = {"+": "-", "-": "-.", "s": ":", "d": "--", "o": (0, (5, 1))}
HATCHES = {"+": "", "-": "\\\\\\\\", "s": "....", "d": "////", "o": "oo"}
#: From dark to light, each with a line style of its own.
OVERLAY = (("#222255", "-"), ("#cc3311", "--"), ("#228833", "-."), ("#ddaa33", ":"), ("#77aadd", "-"))
MARKERS = "osD^v<>P"
#: One colour per contact, or per mode; they differ in lightness too, for print without colour.
CONTACT = ("#004488", "#66ccee", "#997700", "#ee99aa")
#: Stable and unstable.
STABLE, UNSTABLE = "#4477aa", "#cc3311"
#: Range of a time axis, s, below which its ticks are in ms.
SHORT = 0.1
#: Points per inch that journals ask for at least.
DPI = 300
#: Length of an inch, m, and the size of text below which no figure goes, points.
INCH, SMALLEST = 0.0254, 6.0


#: Names that figures write in other words.
WORDS = {"friction": "friction coefficient", "hopf_point": "Hopf point"}


def quantity(name: object, units: str = "1") -> str:
    """Return the name of a quantity as figures write it, with its unit."""
    words = WORDS.get(str(name)) or str(name).replace("_", " ")
    return words if units in ("", "1") else f"{words}, {units}"


def save(
    figure: Figure | Axes,
    path: str | Path | BinaryIO,
    dpi: int = DPI,
    form: str | None = None,
    width: float | None = None,
) -> None:
    """Write a figure in the form that the suffix of the path names; the same figure gives the same bytes.

    A file is replaced once the figure is drawn; an error leaves it as it was.

    If the figure has several panels, they bear letters. Axes have units that suit what they show. If the
    figure has no layout engine and its border would cut a legend or label, the layout becomes "constrained".
    With a `width` on paper, m, height, text and lines change in the same ratio, text not below 6 points. A
    stream in place of a path needs a `form`: ``png``, ``pdf``, ``svg``, ``eps``.
    """
    import matplotlib

    if isinstance(figure, Axes):
        return save(figure_of(figure), path, dpi, form, width)
    if isinstance(path, str | Path):
        file = Path(path)
        if not (form or file.suffix):
            # As matplotlib names a file without suffix.
            form = str(matplotlib.rcParams["savefig.format"])
            file = file.with_name(f"{file.name}.{form}")
        drawn = io.BytesIO()
        save(figure, drawn, dpi, form or file.suffix[1:], width)
        replace_file(file, drawn.getbuffer())
        return
    readable_units(figure)
    panel_letters(figure)
    if width is not None:
        with _of_width(figure, width):
            save(figure, path, dpi, form)
        return
    if figure.get_layout_engine() is None and _is_cut(figure):
        figure.set_layout_engine("constrained")
    # What would tell when and by which version a file was made.
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    with matplotlib.rc_context({"svg.hashsalt": "stickslip", "pdf.fonttype": 42}):
        figure.savefig(path, dpi=dpi, format=form, metadata=metadata.get(form or ""))


@contextmanager
def _of_width(figure: Figure, width: float) -> Iterator[None]:
    """Let a figure have a width, m, while it is written, with text and lines in proportion."""
    size = figure.get_size_inches()
    ratio = width / INCH / float(size[0])
    # Those of ticks that only the new size asks for included.
    figure.set_size_inches(*(ratio * size))
    figure.draw_without_rendering()
    changed: list[tuple[Callable[[float], object], float]] = []

    def scale(get: Callable[[], Any], put: Callable[[float], object], least: float = 0.0) -> None:
        changed.append((put, get()))
        put(max(ratio * get(), min(least, get())))

    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        scale(text.get_fontsize, text.set_fontsize, SMALLEST)
    for line in figure.findobj(Line2D):
        assert isinstance(line, Line2D)
        scale(line.get_linewidth, line.set_linewidth)
        scale(line.get_markersize, line.set_markersize)
    try:
        yield
    finally:
        for put, value in reversed(changed):
            put(value)
        figure.set_size_inches(*size)


def _is_cut(figure: Figure) -> bool:
    drawn, paper = figure.get_tightbbox(), figure.bbox_inches
    return bool(drawn.x0 < paper.x0 or drawn.y0 < paper.y0 or drawn.x1 > paper.x1 or drawn.y1 > paper.y1)


def readable_units(figure: Figure) -> None:
    """Let the axes of a figure have units that suit what they show: s or ms, m, mm or µm, J, mJ, µJ or nJ."""
    panels = _panels(figure)
    _readable_times(panels)
    for axes in panels:
        for axis in (axes.xaxis, axes.yaxis):
            name, comma, unit = axis.get_label_text().rpartition(", ")
            units = LENGTHS if unit in ("m", "µm") else ENERGIES if unit == "mJ" else None
            if not comma or units is None or axis.get_scale() != "linear":
                continue
            largest = np.abs(axis.get_view_interval()).max() / units[unit]
            fitting, count = suited(largest, units)
            if fitting != unit:
                factor = count / units[unit]
                axis.set_label_text(f"{name}, {fitting}")
                axis.set_major_formatter(_scaled(factor))


def _readable_times(panels: list[Axes]) -> None:
    """Let time axes be in milliseconds where all panels show a short time."""
    timed = [axes for axes in panels if axes.get_xlabel() == "time, s"]
    # A panel without a label of its own is read by that of another.
    read_alike = [axes for axes in panels if axes in timed or not axes.get_xlabel()]
    if any(abs(axes.get_xlim()[1] - axes.get_xlim()[0]) >= SHORT for axes in read_alike):
        return
    for axes in timed:
        axes.set_xlabel("time, ms")
    for axes in read_alike if timed else []:
        axes.xaxis.set_major_formatter(_scaled(1e3))


def _scaled(factor: float) -> FuncFormatter:
    return FuncFormatter(lambda value, _: Formatter.fix_minus(f"{factor * value:.6g}"))


def panel_letters(figure: Figure) -> None:
    """Let the panels of a figure that has several bear letters, by which a caption can name them."""
    panels = _panels(figure)
    if len(panels) < 2:
        return
    for axes, letter in zip(panels, "abcdefghijklmnopqrstuvwxyz", strict=False):
        if not any(text.get_gid() == "letter" for text in axes.texts):
            size = float(axes.xaxis.label.get_fontsize())
            # Left of the panel, where neither title nor legend stands, and above a tick at its upper end.
            axes.annotate(
                f"({letter})",
                (0.0, 1.0),
                xycoords="axes fraction",
                xytext=(-6.0, 0.5 * size + 3.0),
                textcoords="offset points",
                ha="right",
                va="bottom",
                fontsize=size,
                gid="letter",
            )


def _panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_visible() and axes.get_label() != "<colorbar>"]
