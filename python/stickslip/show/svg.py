"""Figures as SVG inside a page."""

from __future__ import annotations

import io
import re
from contextlib import AbstractContextManager
from typing import Any

import matplotlib
import numpy as np
from markupsafe import Markup, escape
from matplotlib.artist import Artist
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stickslip.show.style import readable_units

#: Points of a line, and members of a collection, above which they are drawn as pixels: a page stays small.
DENSE_LINE, DENSE_COLLECTION = 2500, 400
#: Of what is drawn as pixels, at most: per inch, and across a figure.
PIXELS, ACROSS = 270, 1300
#: Text stays text: it can be searched, read aloud, and is small.
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "stickslip",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "figure.titlesize": 10.0,
    "path.simplify_threshold": 0.2,
}


def style() -> AbstractContextManager[None]:
    """Draw in the style of the page while this holds."""
    return matplotlib.rc_context(STYLE)


def svg(figure: Figure, name: str, alternative: str) -> Markup:
    """Return a figure as an SVG element.

    `name` is the prefix of its identifiers, unique in the page; `alternative` says what it shows to those who
    do not see it.
    """
    readable_units(figure)
    for axes in figure.axes:
        for artist in axes.get_children():
            if _is_dense(artist):
                artist.set_rasterized(True)
    _name_entries(figure)
    stream = io.StringIO()
    with style():
        figure.dpi = min(PIXELS, ACROSS / figure.get_figwidth())
        # Not savefig, which draws everything once more before.
        canvas: Any = FigureCanvasSVG(figure)
        canvas.print_svg(stream, metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    # A style element would hold for the whole page; metadata repeats what the page says.
    text = re.sub(r"<style.*?</style>|<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # Several elements may stand for one entry of a legend, so these are no identifiers.
    text = re.sub(r'\bid="(entry|series)-(\d+)-\d+"', r'data-\1="\2"', text)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'((?:xlink:)?href)="#', rf'\1="#{name}-', text)
    text = text.replace("url(#", f"url(#{name}-")
    return Markup(
        text.replace("<svg ", f'<svg role="img" class="plot" aria-label="{escape(alternative)}" ', 1)
    )


def _name_entries(figure: Figure) -> None:
    """Name each entry of a legend and what it stands for alike, by which a page can hide it."""
    drawn: dict[str, list[Artist]] = {}
    for axes in figure.axes:
        for artist in axes.get_children():
            # What is drawn as pixels is no element of its own.
            if not artist.get_rasterized():
                drawn.setdefault(str(artist.get_label()).removeprefix("_"), []).append(artist)
    own = [legend for axes in figure.axes if (legend := axes.get_legend()) is not None]
    for legend in [*figure.legends, *own]:
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
            series = drawn.get(text.get_text(), [])
            if handle is None or not series:
                continue
            number = list(drawn).index(text.get_text())
            for kind, members in (("entry", [handle, text]), ("series", series)):
                for k, member in enumerate(members):
                    member.set_gid(f"{kind}-{number}-{k}")


def _is_dense(artist: Artist) -> bool:
    if isinstance(artist, Line2D):
        return np.size(artist.get_xdata()) > DENSE_LINE
    return isinstance(artist, Collection) and len(artist.get_paths()) > DENSE_COLLECTION
